"""Where a judged model lies: a fit in a run folder, an exported bundle, a registered model."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import sysid
from sysid.errors import ConfigError, did_you_mean
from sysid.export.bundle import ranges_of
from sysid.export.reading import read_bundle
from sysid.models import AbstractModel, Cascade, Interpolation
from sysid.reporting.results import read_results
from sysid.workbench.fits.record import read_fit
from sysid.workbench.judging.config import PartConfig
from sysid.workbench.runner.store import LINE, RunFolder, read_json

Fetch = Callable[[str], "tuple[Path, str]"]
"""From a registered model's address to a folder with its bundle, and the run that tracks it."""


PUBLISHED = Path(sysid.__file__).resolve().parent.parent
"""Where ``reports/...`` of a checkout lies."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Found:
    """A model and what is known of where it comes from.

    Args:
        model: The model.
        said: Where it lies, in words.
        ranges: Of each input in the traces that it was fitted on; nothing of a fit of a run.
        run_folder: The folder of the run that fitted it, where that is known.
        fit_key: Key under which that fit is tracked, where that is known.
        tracked_as: Run of the tracking store, where that is known.
    """

    model: AbstractModel | Cascade | Interpolation
    said: str
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    run_folder: Path | None = None
    fit_key: str | None = None
    tracked_as: str | None = None


def find_model(part: PartConfig, *, workspace: Path, fetch: Fetch) -> Found:
    """Load a model.

    Args:
        part: Where it lies.
        workspace: Folder that relative paths begin at.
        fetch: Brings a registered model.

    Returns:
        The model.

    Raises:
        ConfigError: If there is no such run, fit or model.
        BundleError: If a bundle is damaged.
    """
    if part.run is not None:
        return _of_run(part, workspace)
    if part.line is not None:
        return _of_line(workspace, part.line)
    if part.bundle is not None:
        return _of_bundle(_folder(part.bundle, workspace).resolve(), part.bundle)
    address = str(part.model)
    folder, run_id = fetch(address)
    bundle = read_bundle(folder)
    return Found(model=bundle.model, said=address, ranges=bundle.ranges, tracked_as=run_id)


def run_folder_of(given: str, workspace: Path) -> Path:
    """The folder of a run, whether or not it is there.

    Args:
        given: A folder, or the name of a pipeline.
        workspace: Folder that relative paths begin at.

    Returns:
        The folder.
    """
    folder = _folder(given, workspace)
    return folder if folder.is_dir() else workspace / "runs" / given


def _folder(given: str, workspace: Path) -> Path:
    """A folder of the workspace; where that has none, what is published in the checkout."""
    published = (PUBLISHED / given).resolve()
    inside = not Path(given).is_absolute() and published.is_relative_to(PUBLISHED / "reports")
    folder = workspace / given
    return published if inside and published.is_dir() and not folder.is_dir() else folder


def _of_run(part: PartConfig, workspace: Path) -> Found:
    given = str(part.run)
    folder = run_folder_of(given, workspace)
    if not (folder / "results.json").is_file():
        raise ConfigError(
            f"the run {given} is not there",
            where="subjects",
            expected="the folder of a finished run, or the name of a pipeline that was run here",
            got=folder,
            remedy=f"run it first: sysid run {Path(given).name}",
        )
    results = read_results(folder)
    names = {fit.name: fit for fit in results.fits}
    wanted = part.fit
    if wanted == "best" and results.best is not None:
        wanted = results.best.name
    if wanted not in names:
        raise ConfigError(
            f"the run {given} has no fit {wanted!r}",
            where=folder,
            expected=f"best, or one of {', '.join(names)}",
            got=part.fit,
            remedy=did_you_mean(wanted, names, "correct the name, or let the run finish"),
        )
    fit = names[wanted]
    store = RunFolder(path=folder.resolve())
    return Found(
        model=read_fit(store.fit(fit.model_slug or fit.slug)).model,
        said=f"{fit.name} ({fit.label}, {fit.mapping}) of the run {given}",
        run_folder=store.path,
        fit_key=_key(store, f"scores-{fit.slug}"),
    )


def _of_line(workspace: Path, given: str) -> Found:
    file = run_folder_of(given, workspace) / LINE
    if not file.is_file():
        raise ConfigError(
            f"there is no line {given}",
            where="subjects",
            expected=f"a folder with {LINE}, which an assembly with interpolation leaves",
            got=file.parent,
            remedy="give reports/whole-train, or run such a pipeline first: sysid run whole-train",
        )
    fields = read_json(file)
    known = ranges_of(fields.get("channels", {}).get("inputs", ()))
    return Found(model=Interpolation.from_dict(fields), said=f"line {given}", ranges=known)


def _of_bundle(folder: Path, given: str) -> Found:
    bundle = read_bundle(folder)
    made_from = bundle.metadata.get("provenance", {})
    name = made_from.get("fit") if isinstance(made_from, dict) else None
    store = RunFolder(path=folder.parent)
    key = _key_of_fit(store, str(name), bundle.model) if name is not None else None
    said = f"bundle {given}" + (f", fit {name}" if name else "")
    return Found(
        model=bundle.model, said=said, ranges=bundle.ranges, run_folder=store.path if key else None, fit_key=key
    )


def _key_of_fit(store: RunFolder, name: str, model: AbstractModel | Cascade) -> str | None:
    """The key of the fit that a bundle was exported from; ``None`` where the run beside it has it not, or no longer."""
    try:
        slugs = {fit.name: fit.slug for fit in read_results(store.path).fits}
        same = name in slugs and read_fit(store.fit(slugs[name])).model.to_dict() == model.to_dict()
    except (ConfigError, OSError):
        # A bundle that lies anywhere: nothing is known of a run.
        return None
    return _key(store, f"scores-{slugs[name]}") if same else None


def _key(store: RunFolder, step: str) -> str | None:
    """The key that a step was done under; ``None`` for an unfinished one."""
    try:
        return str(store.facts(step)["key"])
    except (OSError, ValueError, KeyError):
        return None
