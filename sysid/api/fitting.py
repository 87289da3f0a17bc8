"""Data in, fits out: load a data set, fit a structure to it."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from pathlib import Path
from typing import Any

from sysid.api.fits import Fit
from sysid.api.given import ESTIMATED, TracesLike, check_order, path_of, traces_of
from sysid.api.system_fit import SystemFit
from sysid.estimation import FitResult, StabilityOptions, estimators, fitting
from sysid.estimation.estimator import Options
from sysid.ingest import load_dataset
from sysid.ingest.inspecting.undescribed import load_file
from sysid.ingest.reading import is_file_of_traces
from sysid.models import AbstractStructure, Mapping, Start, StartLike
from sysid.models.channels.rest_levels import levels_at_rest
from sysid.traces import Role, TraceSet


def load(source: str | Path) -> TraceSet:
    """Load a data set by name or path, or a single file with traces.

    Args:
        source: A data set's name, its folder or ``dataset.yaml``; or a file (CSV, Parquet, MATLAB, HDF5, MDF4, TDMS),
            which becomes a set of one trace for estimation, or of the records that it holds. What it does not say, such
            as a unit, is guessed as ``sysid ingest --propose`` would write it down.

    Returns:
        The traces with their roles.

    Raises:
        UserError: If it cannot be read: what, where, and what to do.

    Warns:
        GuessedWarning: If a file leaves out what had to be guessed.

    Example:
        >>> from sysid.testing import first_order_record
        >>> traces = load(first_order_record())
        >>> traces.names, traces.sample_time, len(traces.traces[0])
        (('record',), 0.5, 200)
    """
    path = path_of(source, word="load")
    if not is_file_of_traces(path):
        return load_dataset(source)
    return load_file(path)


def fit(
    traces: TracesLike,
    mapping: str | Mapping | Dict[str, Any],
    structure: AbstractStructure,
    training: Options | None = None,
    *,
    start: StartLike = ESTIMATED,
    rest_output: float | Dict[str, float] | None = None,
    initial: FitResult | None = None,
    stability: StabilityOptions = StabilityOptions(),  # noqa: B008 - frozen
) -> Fit | SystemFit:
    """Fit one structure to the traces whose role is estimation; those for selection choose between starts.

    Args:
        traces: The data set; a :class:`~sysid.traces.Trace` or a list of them is one whose records are all for
            estimation.
        mapping: Which channels go in, which come out: ``"u1+u2 -> y"``, or ``"u1+u2 -> y1+y2"``. A structure with
            several outputs of its own, such as :class:`~sysid.VectorNARX` or a state space, gives one model of all; of
            any other, each output gets a model, and all of them are run as one. As lists,
            ``{"inputs": ["P+"], "output": "V->C"}``, names may hold anything.
        structure: What is fitted.
        training: How a network is trained, or a transfer function; an ARX model has nothing to choose.
        start: How each free run begins: ``"estimated"``, ``"rest"``, ``"first-sample"``, ``{"measured": 50}`` after 50
            measured samples, or a :class:`~sysid.Start`.
        rest_output: The output's value at rest, in its unit, or by name of several; needed where ``start`` is rest.
        initial: A fit to begin with: of the same network, whose loop is to be closed, of a smaller one, or of an ARX
            model over its lags.
        stability: How the free run is checked: by default over 1,000 random sequences, in some seconds;
            ``StabilityOptions(count=0)`` asks nothing.

    Returns:
        The fit: its model, how it ended, its history; its status is ``UNSTABLE`` where its free run is.

    Raises:
        ConfigError: If no trace is for estimation, no estimator belongs to the structure, or what is given does not
            apply to it.
        ChannelError: If a channel of the mapping is missing, or ``rest_output`` names no output.
    """
    traces = traces_of(traces, word="fit")
    check_order(mapping, structure)
    mapped, start = Mapping.of(mapping), Start.of(start)
    estimators.estimator_of(structure)
    fitting.check_given(initial, stability)
    rest = levels_at_rest(rest_output, mapped.outputs)
    estimation, selection = traces.estimation, traces.with_role(Role.SELECTION)
    for trace in estimation:  # before the structure: "u1, u2" as one name would be told as orders that do not match
        trace.require(mapped.channels)
    structure = structure.for_outputs(len(mapped.outputs))
    chosen = structure.mappings(mapped)
    structure.check_records([one.name for one in estimation], traces.names, start)
    fits: list[Fit] = []
    for one in chosen:
        found = fitting.fit(
            estimation,
            one,
            structure,
            training,
            start=start,
            rest_output=rest,
            selection=selection,
            initial=initial,
            stability=stability,
        )
        fits.append(Fit.of(found, traces, start))
    return SystemFit.of({fit.model.mapping.output: fit for fit in fits}) if len(fits) > 1 else fits[0]
