"""Data in, fits out: load a data set, fit a structure to it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from sysid.api.comparison import ESTIMATED
from sysid.api.fits import Fit, SystemFit
from sysid.errors import ConfigError
from sysid.estimation import (
    FitResult,
    Training,
    fit_arx,
    fit_narx,
    fit_neural_state_space,
    fit_transfer_function,
)
from sysid.ingest import READERS, load_dataset, read_trace
from sysid.models import ARX, NARX, AbstractStructure, Mapping, NeuralStateSpace, Start, TransferFunction, VectorMapping
from sysid.traces import Role, TraceSet

_NETWORKS: dict[type[AbstractStructure], Callable[..., FitResult]] = {
    NARX: fit_narx,
    NeuralStateSpace: fit_neural_state_space,
}


def load(source: str | Path) -> TraceSet:
    """Load a data set by name or path, or a single file with traces.

    Args:
        source: A data set's name, its folder or ``dataset.yaml``; or a file (CSV, Parquet, MATLAB, HDF5, MDF4, TDMS)
            whose columns name their units, which becomes a set of one trace for estimation.

    Returns:
        The traces with their roles.

    Raises:
        UserError: If it cannot be read: what, where, and what to do.

    Example:
        >>> from sysid.testing import first_order_record
        >>> traces = load(first_order_record())
        >>> traces.names, traces.sample_time, len(traces.traces[0])
        (('record',), 0.5, 200)
    """
    path = Path(source)
    if path.suffix.lower() not in {suffix for reader in READERS for suffix in reader.suffixes}:
        return load_dataset(source)
    trace = read_trace(path)
    return TraceSet(name=path.stem, traces=(trace,), roles={trace.name: Role.ESTIMATION}, source=str(path))


def fit(
    traces: TraceSet,
    mapping: str | Mapping,
    structure: AbstractStructure,
    training: Training | None = None,
    *,
    start: Start = ESTIMATED,
    rest_output: float | None = None,
    initial: FitResult | None = None,
) -> Fit | SystemFit:
    """Fit one structure to the traces whose role is estimation; those for selection choose between starts.

    Args:
        traces: The data set.
        mapping: Which channels go in, which come out: ``"u1+u2 -> y"``, or ``"u1+u2 -> y1+y2"``, where each output gets
            a model of the structure and all of them are run as one.
        structure: What is fitted.
        training: How a network is trained; nothing to choose for a linear model.
        start: How each free run begins.
        rest_output: The output's value at rest, in its unit; needed where ``start`` is rest.
        initial: A network of the same structure to begin with: an open-loop fit whose loop is to be closed.

    Returns:
        The fit: its model, how it ended, its history.

    Raises:
        ConfigError: If no trace is for estimation, or no estimator belongs to the structure.
        ChannelError: If a channel of the mapping is missing.
    """
    chosen = _single(VectorMapping.parse(mapping)) if isinstance(mapping, str) else (mapping,)
    fits = {
        one.output: Fit.of(
            _fit(traces, one, structure, training, start=start, rest_output=rest_output, initial=initial), traces, start
        )
        for one in chosen
    }
    return SystemFit.of(fits) if len(fits) > 1 else next(iter(fits.values()))


def _single(mapping: VectorMapping) -> tuple[Mapping, ...]:
    """One mapping an output, all of the same inputs."""
    return tuple(Mapping(inputs=mapping.inputs, output=output) for output in mapping.outputs)


def _fit(
    traces: TraceSet,
    chosen: Mapping,
    structure: AbstractStructure,
    training: Training | None,
    *,
    start: Start,
    rest_output: float | None,
    initial: FitResult | None,
) -> FitResult:
    estimation = traces.with_role(Role.ESTIMATION)
    common: dict[str, Any] = {"start": start, "rest_output": rest_output}
    if not estimation:
        raise ConfigError(
            "no trace is for estimation",
            where=f"data set {traces.name}",
            expected="a trace with that role",
            got=", ".join(f"{name}: {role.value}" for name, role in traces.roles.items()),
            remedy="give one that role",
        )
    if isinstance(structure, ARX):
        return fit_arx(estimation, chosen, structure, **common)
    selection = traces.with_role(Role.SELECTION)
    if isinstance(structure, TransferFunction):
        return fit_transfer_function(estimation, chosen, structure, selection=selection, **common)
    if initial is not None:
        common["initial"] = initial
    if type(structure) in _NETWORKS:
        return _NETWORKS[type(structure)](estimation, chosen, structure, training, selection=selection, **common)
    raise ConfigError(
        "no estimator belongs to the structure",
        expected="ARX, TransferFunction, NARX or NeuralStateSpace",
        got=type(structure).__name__,
        remedy="see sysid.estimation for more",
    )
