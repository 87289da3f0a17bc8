"""A workspace that begins with an FMU: its experiments as a pipeline that runs, with what its description proposes."""

from __future__ import annotations

import shutil
from pathlib import Path

from sysid.errors import ConfigError
from sysid.names import slug
from sysid.references.described import Wish
from sysid.workbench.runner.store import write_bytes
from sysid.workbench.schemas import write_schemas
from sysid.workbench.surrogates.plan import text_of

README = """# A surrogate of {fmu}

    sysid run {name} --dry-run             what the experiments on it will cost
    sysid surrogate {name} --minutes 60    experiments, a model, an FMU in its place, and the proof

An FMU is code, and runs with your rights. `pipelines/{name}.yaml` says within what its inputs may move and how much is
run; read it before you run it, and change what is not so. Results lie in `runs/`, and can be made again.
"""


def make_reference_workspace(folder: Path, fmu: Path, wish: Wish) -> tuple[list[Path], str, list[str]]:
    """Fill a folder with a pipeline of experiments on an FMU, and a copy of it. Its binary is not touched.

    Args:
        folder: Made if it is not there; nothing that is there is overwritten.
        fmu: The reference.
        wish: What is said beside its description.

    Returns:
        The files made, the pipeline's name, and what was taken from where.

    Raises:
        ConfigError: If a file is there already, the folder cannot be written to, or the description does not say
            enough.
    """
    name = slug(fmu.stem)
    copy, pipeline, readme = (
        folder / "references" / fmu.name,
        folder / "pipelines" / f"{name}.yaml",
        folder / "README.md",
    )
    taken = [one for one in (copy, pipeline, readme) if one.exists()]
    if taken:
        raise ConfigError(
            "the folder has files of a workspace already", where=folder, expected="a folder without them",
            got=", ".join(str(one.relative_to(folder)) for one in taken),
            remedy="name another folder; nothing was changed",
        )  # fmt: skip
    text, notes = text_of(fmu, wish, written_as=f"../references/{fmu.name}", name=name)
    try:
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(fmu, copy)
        write_bytes(pipeline, text.encode())
        write_bytes(readme, README.format(fmu=fmu.name, name=name).encode())
        schemas = write_schemas(folder)
    except OSError as error:
        raise ConfigError(
            "the workspace cannot be written", where=folder, got=error, remedy="name another folder"
        ) from error
    return [copy, pipeline, readme, *schemas], name, notes
