"""The short way from Python: load, fit, compare, save, with the choices that a pipeline makes where you say nothing.

Everything here is a few lines over the rooms below, which take more options: :mod:`sysid.ingest`,
:mod:`sysid.estimation`, :mod:`sysid.validation` and :mod:`sysid.export`.

Example:
    >>> import sysid
    >>> from sysid.testing import first_order_record
    >>> traces = sysid.load(first_order_record())
    >>> fit = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=(1,), nk=(1,)))
    >>> print(sysid.compare(traces, fit))
    free run, fit in percent   record
    ARX [1; 1; 1]              100.00
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
from sysid.models import ARX, NARX, AbstractStructure, Mapping, NeuralStateSpace, Start, StartKind, TransferFunction
from sysid.traces import Role, TraceSet
from sysid.validation import Evaluation, evaluate
from sysid.validation.metrics import percent

if TYPE_CHECKING:
    from sysid.export import Bundle

__all__ = ["ARX", "NARX", "Comparison", "NeuralStateSpace", "Role", "Start", "Training", "TransferFunction"]
__all__ += ["compare", "fit", "load", "save"]

FROM_FIRST_SAMPLE = Start(kind=StartKind.FIRST_SAMPLE)
"""How a free run begins unless told otherwise: at rest at the first measured output."""

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
    start: Start = FROM_FIRST_SAMPLE,
    rest_output: float | None = None,
    initial: FitResult | None = None,
) -> FitResult:
    """Fit one structure to the traces whose role is estimation; those for selection choose between starts.

    Args:
        traces: The data set.
        mapping: Which channels go in, which comes out: ``"u1+u2 -> y"``.
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
    chosen = Mapping.parse(mapping) if isinstance(mapping, str) else mapping
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


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """Models side by side; printed, it is a table of fits as MATLAB's ``compare`` counts them.

    Args:
        evaluations: By label of the model: what it does on every case, in free run and one step ahead.
    """

    evaluations: dict[str, Evaluation]

    def __str__(self) -> str:
        cases = list(next(iter(self.evaluations.values())).cases) if self.evaluations else []
        head = ["free run, fit in percent", *cases]
        rows = [
            [label, *(percent(found.cases[case].free_run.nrmse_fit) for case in cases)]
            for label, found in self.evaluations.items()
        ]
        widths = [max(len(row[column]) for row in [head, *rows]) for column in range(len(head))]
        lines = [
            f"{row[0]:<{widths[0]}}"
            + "".join(f"   {cell:>{width}}" for cell, width in zip(row[1:], widths[1:], strict=True))
            for row in [head, *rows]
        ]
        return "\n".join(lines)


def compare(traces: TraceSet, *fits: FitResult, start: Start = FROM_FIRST_SAMPLE) -> Comparison:
    """Run fitted models over every case: fed with nothing but inputs and their own past output.

    Args:
        traces: The cases; those for validation count.
        fits: What is compared.
        start: How each free run begins, and from which sample on it is scored.

    Returns:
        The figures; printing them shows a table.
    """
    labels: list[str] = []
    for one in fits:
        label = one.model.structure.label
        labels.append(label if label not in labels else f"{label} ({len(labels) + 1})")
    found = {label: evaluate(one.model, traces, start) for label, one in zip(labels, fits, strict=True)}
    return Comparison(evaluations=found)


def save(
    fit: FitResult,
    traces: TraceSet,
    folder: str | Path,
    *,
    formats: tuple[str, ...] = ("onnx", "torchscript"),
    start: Start = FROM_FIRST_SAMPLE,
) -> Bundle:
    """Write a fit as files that run elsewhere, each checked against its model on every case before it is published.

    Args:
        fit: The fit.
        traces: The cases that the files are run on.
        folder: Where the bundle goes: new, empty, or an earlier bundle.
        formats: Among ``onnx``, ``torchscript``, ``c``, ``fmi2`` and ``fmi3``.
        start: How each free run begins.

    Returns:
        The bundle.

    Raises:
        ParityError: If a file differs from its model; nothing is published then.
    """
    from sysid.export import export_bundle

    return export_bundle(fit, traces, Path(folder), start=start, formats=formats)
