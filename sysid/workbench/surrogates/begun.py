"""A workspace that begins with a reference: its experiments as a pipeline that runs."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from sysid.errors import ConfigError
from sysid.names import slug
from sysid.references.described import Wish
from sysid.references.sources import Source
from sysid.workbench.runner.store import write_bytes
from sysid.workbench.schemas import write_schemas
from sysid.workbench.surrogates.plan import text_of

README = """# A surrogate of {source}

    sysid run {name} --dry-run             what the experiments on it will cost
    sysid surrogate {name} --minutes 60    experiments, a model, an FMU in its place, and the proof

It is code, and runs with your rights. `pipelines/{name}.yaml` says within what its inputs may move and how much is
run; read it before you run it, and change what is not so. Results lie in `runs/`, and can be made again.
"""


def make_reference_workspace(folder: Path, source: Source, wish: Wish) -> tuple[list[Path], str, list[str]]:
    """Fill a folder with a pipeline of experiments on a reference. Nothing is run.

    An FMU is copied; what a function or a program needs beside itself nobody knows, and it stays where it is.

    Args:
        folder: Made if it is not there; nothing that is there is overwritten.
        source: The reference.
        wish: What is said beside it.

    Returns:
        The files made, the pipeline's name, and what was taken from where.

    Raises:
        ConfigError: If a file is there already, the folder cannot be written to, or something is not said.
    """
    name, fmu = slug(source.name), source.fmu
    copies = [] if fmu is None else [folder / "references" / fmu.name]
    pipeline, readme = folder / "pipelines" / f"{name}.yaml", folder / "README.md"
    taken = [one for one in (*copies, pipeline, readme) if one.exists()]
    if taken:
        raise ConfigError(
            "the folder has files of a workspace already", where=folder, expected="a folder without them",
            got=", ".join(str(one.relative_to(folder)) for one in taken),
            remedy="name another folder; nothing was changed",
        )  # fmt: skip
    places = {"folder": _seen_from(pipeline.parent, Path(source.reference.get("folder", ".")))}
    if fmu is not None:
        places = {"folder": ".", "fmu": f"../references/{fmu.name}"}
    text, notes = text_of(source, wish, name=name, places=places)
    try:
        for copy in copies:
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(str(fmu), copy)
        write_bytes(pipeline, text.encode())
        write_bytes(readme, README.format(source=source.text, name=name).encode())
        schemas = write_schemas(folder)
    except OSError as error:
        raise ConfigError(
            "the workspace cannot be written", where=folder, got=error, remedy="name another folder"
        ) from error
    return [*copies, pipeline, readme, *schemas], name, notes


def _seen_from(place: Path, folder: Path) -> str:
    try:
        return Path(os.path.relpath(folder.resolve(), place.resolve())).as_posix()
    except ValueError:  # another drive
        return str(folder.resolve())
