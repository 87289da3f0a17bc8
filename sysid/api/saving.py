"""Fits as files that run elsewhere."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from sysid.api.given import TracesLike, path_of, traces_of
from sysid.api.several import Several
from sysid.estimation import FitResult
from sysid.models import Start, StartLike
from sysid.traces import Role, TraceSet

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
        traces: The cases that the files are run on, and that the model card has figures of. A fit of
            :func:`~sysid.fit` knows those that it was made of: further ones stand beside them, for validation.
        folder: Where the bundle goes: new, empty, or an earlier bundle.
        formats: Among ``onnx``, ``c``, ``fmi2``, ``fmi3`` and ``torchscript``; by default ONNX and C, as far as
            they can be written here.
        start: How each free run begins; as the fit was made by default.

    Returns:
        The bundle.

    Raises:
        ParityError: If a file differs from its model; nothing is published then.
    """
    from sysid.export import export_bundle

    traces = _cases(fit, traces_of(traces, word="save"))
    begun = getattr(fit, "start", Start()) if start is None else Start.of(start)
    if isinstance(fit, FitResult):
        return export_bundle(fit, traces, Path(folder), start=begun, formats=formats)
    fits = {str(one.model.mapping): one for one in fit.fits.values()}
    return export_bundle(
        fit.model, traces, Path(folder), start=begun, outputs=fit.outputs, formats=formats, fits=dict(fits)
    )


def _cases(fit: FitResult | Several, traces: TraceSet) -> TraceSet:
    """The records of a fit, which say what its inputs are declared for, and further ones, which were not fitted."""
    known: TraceSet | None = getattr(fit, "traces", None)
    if known is None or traces is known:
        return traces
    # A record that the fit has keeps its role there.
    mine = {trace.digest for trace in known}
    further = [trace for trace in traces if trace.digest not in mine]
    taken, cases = set(known.names), []
    for trace in further:
        name, number = trace.name, 2
        while name in taken:
            name, number = f"{trace.name} ({number})", number + 1
        taken.add(name)
        cases.append(replace(trace, name=name))
    roles = {**known.roles, **{trace.name: Role.VALIDATION for trace in cases}}
    return replace(known, traces=(*known.traces, *cases), roles=roles)


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
