"""Where the bundle lies that somebody means: itself, its zip, or the folder of the run that exported it."""

from __future__ import annotations

from pathlib import Path

from sysid.content import nearest_name
from sysid.errors import BundleError
from sysid.export.manifest import MANIFEST

BUNDLE = "bundle"
"""What a run calls its bundle; ``sysid export`` calls those of single fits ``bundle-NAME``."""
RUN = "pipeline.yaml"
"""What every run folder holds."""


def find_bundle(path: Path) -> Path:
    """The bundle that is meant by a path.

    Args:
        path: A bundle's folder or zip; the folder of a run that exported one, or a folder within it, such as ``fits``.

    Returns:
        The folder or zip.

    Raises:
        BundleError: If there is none, or the run has several and none is its own.
    """
    path = Path(path)
    if path.is_file() or (path / MANIFEST).is_file():
        return path
    run = next((folder for folder in (path, *list(path.parents)[:2]) if (folder / RUN).is_file()), None)
    if run is None:
        return _beside(path)
    single = run / f"{BUNDLE}-{path.name}" if path.parent.name == "fits" else None
    if single is not None:
        if (single / MANIFEST).is_file():
            return single
        raise _not_exported(run, fit=path.name)
    if (run / BUNDLE / MANIFEST).is_file():
        return run / BUNDLE
    others = sorted(folder for folder in run.glob(f"{BUNDLE}-*") if (folder / MANIFEST).is_file())
    if len(others) == 1:
        return others[0]
    if others:
        raise BundleError(
            "the run has several bundles, and none is its own",
            where=str(run),
            expected=f"one of {', '.join(folder.name for folder in others)}",
            remedy=f"name one: {others[0]}",
        )
    raise _not_exported(run)


def _beside(path: Path) -> Path:
    """A folder that holds a bundle and is no run's, such as a published page's; refused where there is none."""
    if (path / BUNDLE / MANIFEST).is_file():
        return path / BUNDLE
    if path.is_dir():
        raise BundleError(
            f"there is no {MANIFEST}",
            where=str(path),
            expected="the folder of a bundle, its zip, or the folder of a run that exported one",
            got="a folder of something else",
            remedy="name the folder that holds the bundle, as runs/NAME",
        )
    parent = path.parent
    near = nearest_name(path.name, [sorted(one.name for one in parent.iterdir())]) if parent.is_dir() else None
    raise BundleError(
        f"there is no {MANIFEST}",
        where=str(path),
        expected="the folder of a bundle, its zip, or the folder of a run that exported one",
        got="nothing at this path",
        remedy=f"did you mean {parent / near}?" if near else "run a pipeline that exports, or check the path",
    )


def _not_exported(run: Path, fit: str = "NAME") -> BundleError:
    return BundleError(
        "nothing of this run was exported" if fit == "NAME" else f"the fit {fit} was not exported by itself",
        where=str(run),
        expected=f"a folder {BUNDLE} within it",
        remedy=f"sysid export {run.name} --fit {fit}",
    )
