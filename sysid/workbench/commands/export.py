"""``sysid export``: one fit of a finished run as a bundle."""

from __future__ import annotations

from pathlib import Path

from sysid.errors import ConfigError
from sysid.export.bundle import zip_bundle
from sysid.workbench.fits import steps
from sysid.workbench.fits.config import ExportConfig, FitConfig, Pipeline, find_pipeline, read_pipeline
from sysid.workbench.fits.data import Data, load_data
from sysid.workbench.fits.record import read_fit, read_scores
from sysid.workbench.runner.console import console
from sysid.workbench.runner.store import RunFolder


def export_command(pipeline: str, *, fit: str, out: Path | None, run_folder: Path | None, pack: bool) -> None:
    """Export a fit that is stored.

    Args:
        pipeline: Name or file of the pipeline.
        fit: Name of the fit.
        out: Folder of the bundle.
        run_folder: The run folder.
        pack: Whether to write the bundle as one zip too.

    Raises:
        ConfigError: If there is no such fit, or it has not been run as the pipeline now stands.
        ParityError: If a file differs from the model by more than the tolerance.
    """
    read = read_pipeline(find_pipeline(pipeline))
    store = RunFolder(path=(run_folder or Path("runs") / read.config.name).resolve())
    config = read.config.model_copy(update={"export": read.config.export or ExportConfig()})
    names = [one.name for one in config.fits]
    if fit not in names:
        raise ConfigError(
            f"there is no fit named {fit}",
            where=read.path,
            expected=f"one of {', '.join(names)}",
            got=fit,
            remedy="name one of them with --fit",
        )
    chosen = config.fits[names.index(fit)]
    data = load_data(config, beside=read.path.parent, progress=lambda _: None)
    _check_stored(store, read, chosen, data)
    folder = out or store.path / f"bundle-{chosen.slug}"
    bundle = steps.export(
        read_fit(store.fit(chosen.slug)),
        read_scores(store.fit(chosen.slug)),
        data,
        config,
        folder=folder,
        provenance={"pipeline": config.name, "fit": fit, "command": f"sysid export {pipeline} --fit '{fit}'"},
    )
    target = console()
    for entry in bundle.files:
        target.print(f"{entry.name}: at most {entry.largest_difference:.1e} from the model")
    target.print(f"Bundle: {folder}", soft_wrap=True)
    if pack:
        target.print(f"Packed: {zip_bundle(folder)}", soft_wrap=True)


def _check_stored(store: RunFolder, pipeline: Pipeline, chosen: FitConfig, data: Data) -> None:
    """Refuse a fit that was never run, or run before the pipeline, its data or the code changed."""
    keys: dict[str, str] = {}
    for fit in pipeline.config.fits:
        keys[fit.name] = steps.fit_key(fit, pipeline.config, data, keys[fit.initial] if fit.initial else None)
    key = keys[chosen.name]
    scores = steps.scores_key(key, chosen.structure, data, pipeline.config)
    if not (store.is_done(f"fit-{chosen.slug}", key) and store.is_done(f"scores-{chosen.slug}", scores)):
        raise ConfigError(
            f"the fit {chosen.name} is not stored as the pipeline now stands",
            where=store.path,
            expected="a finished run of this pipeline",
            remedy=f"run it first: sysid run {pipeline.config.name}",
        )
