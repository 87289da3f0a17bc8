"""``sysid export``: one result of a run, of whatever kind, as a bundle: a fit, a member, a whole."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from sysid.composite.doubting import Doubting
from sysid.errors import ConfigError, did_you_mean
from sysid.export.bundle import Bundle
from sysid.export.manifest import MANIFEST
from sysid.export.writing import zip_bundle
from sysid.field_checks import check
from sysid.names import slug
from sysid.workbench.fits.config import find_pipeline
from sysid.workbench.kinds import RunRequest, kind_of, kinds
from sysid.workbench.runner.console import console
from sysid.workbench.runner.dry_run import DryRun
from sysid.workbench.runner.program import look
from sysid.workbench.runner.store import RunFolder
from sysid.yaml_files import read_yaml


def export_command(
    pipeline: str,
    *,
    fit: str | None,
    out: Path | None,
    run_folder: Path | None,
    formats: str | None,
    pack: bool,
    doubt: Path | None = None,
) -> None:
    """Export a result that is stored, in a run or in a bundle.

    Args:
        pipeline: Name or file of the pipeline, or a bundle's folder or zip.
        fit: Name of the fit, the member or the whole.
        out: Folder of the bundle.
        run_folder: The run folder.
        formats: Of a bundle what is written, with commas.
        pack: Whether to write the bundle as one zip too.
        doubt: A YAML with what the whole of a bundle is to doubt, as in the section ``doubt`` of a pipeline.

    Raises:
        ConfigError: If there is no such result, or it has not been run as the pipeline now stands.
        ParityError: If a file differs from the model by more than the tolerance.
    """
    if fit is None and _is_bundle(Path(pipeline)):
        _tell(_renewed(Path(pipeline), out, formats, doubt), pack=pack)
        return
    if fit is None or formats is not None or doubt is not None:
        raise ConfigError(
            "a fit of a run is exported by its name, in the formats and with the doubts of its pipeline",
            where=pipeline,
            expected="--fit NAME, no --formats and no --doubt; or a bundle",
            got="no --fit" if fit is None else "--formats" if formats is not None else "--doubt",
            remedy="name the fit, or give the bundle's folder or zip",
        )
    path = find_pipeline(pipeline)
    program = kinds()[kind_of(path)].load_program()(RunRequest(path=path, typed=pipeline))
    store = RunFolder(path=(run_folder or Path("runs") / program.name).resolve())
    # Looked for as a run would: what is found is what the pipeline, its data and the code now stand for.
    run = DryRun(store=store, command="", loads=True)
    look(program, run)
    known = [*(one.called for one in program.outline()), *(one.step.called for one in run.seen.values())]
    called = _called(fit, known, path)
    done = next((one for one in run.seen.values() if one.step.called == called), None)
    if done is None or not done.stored or done.step.export is None:
        raise ConfigError(
            f"{called} is not stored as the pipeline now stands",
            where=store.path,
            expected="a finished run of this pipeline",
            remedy=f"run it first: sysid {program.verb} {shlex.quote(pipeline)}",
        )
    folder = out or store.path / f"bundle-{slug(called)}"
    command = shlex.join(["sysid", "export", pipeline, "--fit", fit])
    bundle = done.step.export(done.value, folder, {"pipeline": program.name, "fit": called, "command": command})
    _tell(bundle, pack=pack)


def _is_bundle(path: Path) -> bool:
    """Whether a path is a bundle's folder or zip; a pipeline is a name or a YAML."""
    return (path / MANIFEST).is_file() or (path.is_file() and path.suffix == ".zip")


def _renewed(path: Path, out: Path | None, formats: str | None, doubt: Path | None) -> Bundle:
    from sysid.export.renewing import renew_bundle

    asked = None if formats is None else [name.strip() for name in formats.split(",") if name.strip()]
    beside = path.with_suffix("") if path.is_file() else path
    if doubt is None:
        return renew_bundle(path, out or beside, formats=asked)
    found = _doubting(path, doubt)
    console().print(found.sentence, soft_wrap=True, markup=False)
    into = out or beside.with_name(f"{beside.resolve().name}-doubting")
    return renew_bundle(path, into, formats=asked, whole=found.whole, doubt=found.sentence)


def _doubting(bundle: Path, file: Path) -> Doubting:
    """The whole of a bundle with what a YAML asks it to doubt."""
    from sysid.composite.doubting import doubting
    from sysid.ingest import load_dataset
    from sysid.workbench.assembly.proof_config import DoubtConfig
    from sysid.workbench.assembly.warm_start import read_whole

    asked = check(DoubtConfig, read_yaml(file), where=file)
    beside = [read_whole(file.parent / one)[0] for one in asked.beside]
    return doubting(read_whole(bundle)[0], asked.asked(), tuple(load_dataset(asked.data)), beside=beside)


def _tell(bundle: Bundle, *, pack: bool) -> None:
    target = console()
    for entry in bundle.files:
        target.print(f"{entry.name}: at most {entry.largest_difference:.1e} from the model")
    target.print(f"Bundle: {bundle.folder}", soft_wrap=True)
    if pack:
        target.print(f"Packed: {zip_bundle(bundle.folder)}", soft_wrap=True)


def _called(name: str, known: Sequence[str], path: Path) -> str:
    """What people call so, or nearly so."""
    models = [one for one in dict.fromkeys(known) if one]
    if name in models:
        return name
    alike = [one for one in models if slug(one) == slug(name)]
    if len(alike) == 1:
        return alike[0]
    raise ConfigError(
        f"there is no fit named {name}",
        where=path,
        expected=f"one of {'; '.join(models)}" if models else "a pipeline that fits models",
        got=name,
        remedy=did_you_mean(name, models, "name one of them with --fit"),
    )
