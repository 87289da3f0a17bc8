"""Fits as files that run elsewhere."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sysid.api.given import TracesLike, path_of, traces_of
from sysid.api.several import Several
from sysid.estimation import FitResult
from sysid.models import Start, StartLike

if TYPE_CHECKING:
    from sysid.export import Bundle


def save(
    fit: FitResult | Several,
    traces: TracesLike,
    folder: str | Path,
    *,
    formats: tuple[str, ...] | None = None,
    start: StartLike | None = None,
) -> Bundle:
    """Write a fit as files that run elsewhere, each checked against its model on every case before it is published.

    Args:
        fit: The fit; one of several outputs becomes one file of several outputs.
        traces: The cases that the files are run on.
        folder: Where the bundle goes: new, empty, or an earlier bundle.
        formats: Among ``onnx``, ``c``, ``fmi2``, ``fmi3`` and ``torchscript``; by default ONNX and C, as far as
            they can be written here.
        start: How each free run begins; as the fit was made by default, and at rest for several outputs.

    Returns:
        The bundle.

    Raises:
        ParityError: If a file differs from its model; nothing is published then.
    """
    from sysid.export import export_bundle

    traces = traces_of(traces, word="save")
    if not isinstance(fit, FitResult):
        fits = {str(one.model.mapping): one for one in fit.fits.values()}
        return export_bundle(fit.model, traces, Path(folder), outputs=fit.outputs, formats=formats, fits=dict(fits))
    begun = getattr(fit, "start", Start()) if start is None else Start.of(start)
    return export_bundle(fit, traces, Path(folder), start=begun, formats=formats)


def read_bundle(folder: str | Path) -> Bundle:
    """Read a bundle: what :func:`save` wrote, or ``sysid run``.

    Args:
        folder: The folder, or its zip.

    Returns:
        The bundle; ``bundle.simulate(u)`` runs it over an array or a frame.

    Raises:
        BundleError: If it is damaged or incomplete.
    """
    from sysid.export import read_bundle as read

    return read(path_of(folder, word="read_bundle"))
