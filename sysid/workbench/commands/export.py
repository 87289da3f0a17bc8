"""``sysid export``: one result of a run, of whatever kind, as a bundle: a fit, a member, a whole."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from sysid.errors import ConfigError, did_you_mean
from sysid.export.bundle import Bundle
from sysid.export.finding import RUN, find_bundle
from sysid.export.manifest import MANIFEST
from sysid.export.reading import read_bundle
from sysid.export.writing import zip_bundle
from sysid.field_checks import check
from sysid.ingest import load_dataset
from sysid.names import slug
from sysid.traces import TraceSet
from sysid.workbench.assembly.beside import Beside, Other
from sysid.workbench.assembly.proof_config import DoubtConfig, MeanConfig
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
    mean: Path | None = None,
) -> None:
    """Export a result that is stored, in a run or in a bundle."""
    if fit is None and _is_bundle(Path(pipeline)):
        _tell(_renewed(find_bundle(Path(pipeline)), out, formats, doubt=doubt, mean=mean), pack=pack)
        return
    path = find_pipeline(pipeline)
    given = {"--formats": formats, "--doubt": doubt, "--mean": mean}
    if fit is None or any(one is not None for one in given.values()):
        raise ConfigError(
            "a fit of a run is exported by its name, in the formats and with the doubts and the mean of its pipeline",
            where=pipeline,
            expected="--fit NAME, none of --formats, --doubt and --mean; or a bundle",
            got="no --fit" if fit is None else next(name for name, one in given.items() if one is not None),
            remedy="name the fit, or give the bundle's folder or zip",
        )
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
    """Whether a path is a bundle's folder or zip, or that of a run; a pipeline is a name or a YAML."""
    return any((path / one).is_file() for one in (MANIFEST, RUN)) or (path.is_file() and path.suffix == ".zip")


def _renewed(path: Path, out: Path | None, formats: str | None, *, doubt: Path | None, mean: Path | None) -> Bundle:
    from sysid.export.renewing import renew_bundle

    asked = None if formats is None else [name.strip() for name in formats.split(",") if name.strip()]
    beside = path.with_suffix("") if path.is_file() else path
    if mean is not None:
        return _averaged(path, out or beside.with_name(f"{beside.resolve().name}-mean"), asked, mean, doubt)
    if doubt is None:
        return renew_bundle(path, out or beside, formats=asked)
    config = check(DoubtConfig, read_yaml(doubt), where=doubt)
    whole = Other.of_bundle(read_bundle(path), str(path)).whole
    others = Beside.read(config, None, [config.output], doubt.parent)
    others.check(whole)
    found = others.doubts(whole, config, tuple(load_dataset(config.data)))
    console().print(found.sentence, soft_wrap=True, markup=False)
    into = out or beside.with_name(f"{beside.resolve().name}-doubting")
    return renew_bundle(path, into, formats=asked, whole=found.whole, doubt=found.sentence)


def _averaged(path: Path, into: Path, formats: Sequence[str] | None, mean: Path, doubt: Path | None) -> Bundle:
    """The mean of a bundle's whole and others, scored and checked on the cases that the bundle was scored on."""
    from sysid.export import export_bundle
    from sysid.validation import evaluate_cascade

    old = read_bundle(path)
    outputs, averaged = [str(one["name"]) for one in old.outputs], check(MeanConfig, read_yaml(mean), where=mean)
    if averaged.seeds:
        raise ConfigError(
            "a bundle is not trained again",
            where=mean,
            expected="beside: bundles of wholes that were trained",
            got=f"seeds: {list(averaged.seeds)}",
            remedy="say mean, seeds in the pipeline that trained it",
        )
    asked = None if doubt is None else check(DoubtConfig, read_yaml(doubt), where=doubt)
    names = dict.fromkeys([*outputs, *averaged.spread, *([] if asked is None else [asked.output])])
    whole, others = Other.of_bundle(old, str(path)), Beside.read(asked, averaged, names, mean.parent)
    others.check(whole.whole)
    command = ["sysid", "export", str(path), "--mean", str(mean), *([] if doubt is None else ["--doubt", str(doubt)])]
    provenance = {"command": shlex.join(command), "mean": others.sentence(whole.sentence)}
    if asked is None:
        found = others.answering(whole.whole)
    else:
        doubting = others.doubts(whole.whole, asked, tuple(load_dataset(asked.data)))
        console().print(doubting.sentence, soft_wrap=True, markup=False)
        found, provenance["doubt"] = doubting.whole, doubting.sentence
    cases = _cases(old)
    return export_bundle(
        found, cases, into, outputs=[*outputs, *averaged.spreads], metrics=evaluate_cascade(found, cases),
        formats=formats or list(dict.fromkeys(file.format for file in old.files)), provenance=provenance,
    )  # fmt: skip


def _cases(old: Bundle) -> TraceSet:
    """The cases that a bundle was scored on: another answer has other figures."""
    known = old.metadata["provenance"]["data"]
    cases = load_dataset(known["name"])
    if cases.digest != known["sha256"]:
        raise ConfigError(
            "the data set is not the one that the bundle was scored on, so that the mean cannot be",
            where=str(old.folder),
            expected=f"{known['name']}, SHA-256 {known['sha256']}",
            got=f"SHA-256 {cases.digest}",
            remedy="run where that data set is; or say mean in a pipeline of kind assembly, with warm_start",
        )
    return cases


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
