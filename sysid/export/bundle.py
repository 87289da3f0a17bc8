"""A bundle on disk: a folder that holds a surrogate and everything its receiver needs to run and to judge it."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Sequence
from collections.abc import Mapping as Dict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.export.forecast import check_forecasts, forecast
from sysid.export.measured_run import Initial, check_able, check_one_start, run_measured, run_with
from sysid.export.ranges import taking_rounding
from sysid.export.surrogate import Surrogate
from sysid.ingest.cells.headers import parse_header
from sysid.ingest.memory.run_inputs import inputs_of
from sysid.ingest.memory.run_records import before_a_run, check_past, past_of, record_of
from sysid.ingest.tables.frames import columns_by_name
from sysid.models import AbstractModel, Cascade, Start, StartKind, StartLike
from sysid.traces import Channel, Trace, check_units
from sysid.units import Reference, in_unit


@dataclass(frozen=True, kw_only=True)
class BundleFile:
    """An exported file in a bundle.

    Args:
        name: File name.
        format: Name of the exporter, such as ``"onnx"``.
        kind: ``"step"`` or ``"sequence"``.
        dtype: Of the numbers.
        sha256: Of the bytes.
        largest_difference: From the model, over all cases and random sequences, in the output's unit.
        case: The case with the largest difference.
        tolerance: What was allowed.
    """

    name: str
    format: str
    kind: str
    dtype: str
    sha256: str
    largest_difference: float
    case: str
    tolerance: float


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Bundle:
    """A bundle on disk.

    Args:
        folder: Where it lies.
        model: The model or cascade, built from ``model.json``.
        metadata: Everything that ``model.json`` says.
        files: The exported files.
    """

    folder: Path
    model: AbstractModel | Cascade
    metadata: dict[str, Any]
    files: tuple[BundleFile, ...]

    def __repr__(self) -> str:
        files = ", ".join(file.name for file in self.files) or "no files"
        return f"<Bundle of {self.metadata.get('label', 'a model')} in {self.folder}: {files}>"

    @property
    def inputs(self) -> tuple[dict[str, Any], ...]:
        """What ``model.json`` says of each input: name, unit, reference, range."""
        return tuple(self.metadata["inputs"])

    @property
    def outputs(self) -> tuple[dict[str, Any], ...]:
        """The same of each output; before version 3 there was one."""
        return tuple(self.metadata.get("outputs") or [self.metadata["output"]])

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Least and greatest value of each input in the traces that it was fitted on, where that is known."""
        return ranges_of(self.inputs)

    def simulate(self, u: Any, *, initial: Initial = None, start: StartLike | None = None, warn: bool = True) -> Any:
        """Free run of the model over inputs that are in memory.

        Args:
            u: Inputs: an array of shape ``(n_samples,)`` or ``(n_samples, n_inputs)`` in the bundle's order, a frame or
                dict with columns by name, in the bundle's units, or a trace; for a model without input the number of
                samples.
            initial: What stands before the first sample, as for the fit that was saved: the output in its unit, or one
                for each output by name; or a pair ``(u, y)`` of the samples before, oldest first. The declared levels
                where nothing is said.
            start: How the run begins by outputs that were measured, which stand beside the inputs in a frame, dict or
                trace: ``"estimated"``, ``"first-sample"`` or ``{"measured": 50}``, as for :func:`sysid.fit`. They are
                not read where nothing is said, or ``"rest"``. (``sysid simulate`` and :func:`simulate_bundle` begin by
                them unless told otherwise, and score the run.)
            warn: Whether inputs beyond their declared ranges are told, by an :class:`OutsideRangeWarning`, and measured
                outputs that nothing is said of, by an :class:`UnreadOutputWarning`.

        Returns:
            For a pandas frame a frame of the outputs with the same index, where a fit's own ``simulate`` gives an
            array; else an array of shape ``(n_samples,)``, or ``(n_samples, n_outputs)`` where there are several.

        Raises:
            ChannelError: If an input is missing, or ``initial`` names no output.
            ConfigError: If an array has another number of columns, its samples are at another distance, a trace is in
                other units, ``initial`` is no finite number or says nothing to the model, or the run cannot begin as
                ``start`` says.
        """
        names = tuple(str(entry["name"]) for entry in self.outputs)
        surrogate = Surrogate.of(self.model, {}, outputs=names)
        if surrogate.ticks:
            inputs = np.zeros((len(inputs_of(u, ())), 1))
        else:
            units = {str(entry["name"]): str(entry["unit"]) for entry in self.inputs}
            inputs = inputs_of(u, tuple(units), sample_time=self.model.sample_time, units=units)
            told = said_outside(inputs, units, self.ranges) if warn else ""
            if told:
                warnings.warn(told, OutsideRangeWarning, stacklevel=2)
        begin = None if start is None else Start.of(start)
        unread = self._measured(u) if warn and begin is None and initial is None else ()
        if unread:
            told = f'what was measured of {", ".join(unread)} is not read: start="estimated" begins by it, and '
            warnings.warn(f'{told}start="rest" at rest', UnreadOutputWarning, stacklevel=2)
        if begin is None or begin.kind is StartKind.REST:
            found = surrogate.chosen(run_with(surrogate, inputs, initial))
        else:
            found = surrogate.chosen(self._from_measured(surrogate, u, inputs, initial, begin))
        if hasattr(u, "columns") and hasattr(u, "index") and not isinstance(u, Trace):
            return type(u)(found, index=u.index, columns=list(names))
        return found[:, 0] if len(names) == 1 else found

    def forecast(self, u: Any, *, initial: Any) -> NDArray[np.float64]:
        """What is to be expected after measured samples: the free run, with what is known of the noise carried on.

        Args:
            u: Inputs to come, as for :meth:`simulate`.
            initial: The samples before, oldest first: a record (a trace, a data set of one, a frame), or a pair
                ``(u, y)``.

        Returns:
            Shape ``(n_samples,)``, or ``(n_samples, n_outputs)`` where there are several.

        Raises:
            ChannelError: If an input or an output is missing.
            ConfigError: If no samples are given, samples are at another distance than the model's, or the bundle is a
                whole of models that read each other.
            TraceError: If inputs and outputs have not as many samples, or one is missing.
        """
        models, past = check_forecasts(self.model), past_of(initial)
        check_past(past)
        units = {str(entry["name"]): str(entry["unit"]) for entry in self.inputs} if self.model.inputs else {}
        outputs = {str(entry["name"]): str(entry["unit"]) for entry in self.outputs}
        step = self.model.sample_time
        inputs = inputs_of(u, tuple(units), sample_time=step, units=units)
        before, output = before_a_run(past, tuple(units), tuple(outputs), units | outputs, sample_time=step)
        known = {**dict(zip(units, before.T, strict=True)), **dict(zip(outputs, output.T, strict=True))}
        to_come = dict(zip(units, inputs.T, strict=True)) or {"": np.zeros(len(inputs))}
        found = forecast(models, tuple(outputs), known, to_come)
        return found[:, 0] if len(outputs) == 1 else found

    def _measured(self, u: Any) -> tuple[str, ...]:
        """The outputs that stand beside the inputs."""
        if isinstance(u, Trace):
            there: Collection[str] = u.channel_names
        else:
            named = None if isinstance(u, int) else columns_by_name(u)
            single = hasattr(u, "to_frame")  # a series is the input, whatever it is called
            there = () if named is None or single else [parse_header(key).name for key in named]
        return tuple(str(entry["name"]) for entry in self.outputs if entry["name"] in there)

    def _from_measured(
        self, surrogate: Surrogate, u: Any, inputs: NDArray[np.float64], initial: Initial, start: Start
    ) -> NDArray[np.float64]:
        """Everything that is computed in a run that begins by what was measured."""
        check_one_start(initial, start)
        measured = self._measured(u)
        check_able(self.model, measured, start, where="the record")
        inputs_, outputs = (tuple(map(channel_of, entries)) for entries in (self.inputs, self.outputs))
        record = record_of(u, () if surrogate.ticks else inputs_, outputs, sample_time=self.model.sample_time)
        check_units({channel.name: channel.unit for channel in outputs}, record)
        columns = {name: record[name] for name in measured}
        return run_measured(surrogate, inputs, columns, start, record.usable_samples).computed


def ranges_of(channels: Sequence[Dict[str, Any]]) -> dict[str, tuple[float, float]]:
    """Least and greatest value of channels as a bundle or a line stores them.

    Args:
        channels: What is said of each; ``range`` is left out or null where it is not known.

    Returns:
        By name, of those that have one.
    """
    return {str(one["name"]): (one["range"][0], one["range"][1]) for one in channels if one.get("range")}


def said_outside(inputs: NDArray[np.float64], units: Dict[str, str], ranges: Dict[str, tuple[float, float]]) -> str:
    """A sentence on the inputs that are beyond what was fitted.

    Args:
        inputs: Shape ``(n_samples, n_inputs)``.
        units: Of each input, in their order.
        ranges: Least and greatest value of each that was fitted, where that is known.

    Returns:
        The sentence; empty where none is.

    Example:
        >>> said_outside(np.array([[90.0], [0.0]]), {"STP": "psi"}, {"STP": (64.2, 90.0)})[:49]
        'STP is beyond 64.2 to 90 psi in 50 % of the sampl'
    """
    told, wide = [], taking_rounding(ranges)
    for column, (name, unit) in zip(inputs.T, units.items(), strict=True):
        least, most = wide.get(name, (-np.inf, np.inf))
        if share := float(np.mean((column < least) | (column > most))):
            low, high = ranges[name]
            of = in_unit(f"{low:g} to {high:g}", unit)
            told.append(f"{name} is beyond {of} in {100.0 * share:.3g} % of the samples")
    return f"{'; '.join(told)}: nothing there was fitted, and the accuracy is unknown" if told else ""


class OutsideRangeWarning(UserWarning):
    """Inputs that are beyond what a bundle was made from, so that nobody knows how accurate its answer is."""


class UnreadOutputWarning(UserWarning):
    """Outputs that were measured stand beside the inputs of a run that begins at rest, and nothing was said of them."""


def bundle_files(manifest: Dict[str, Any]) -> tuple[BundleFile, ...]:
    """The exported files that a manifest lists.

    Args:
        manifest: Content of ``model.json``.

    Returns:
        One entry per file.
    """
    return tuple(
        BundleFile(
            name=entry["name"],
            format=entry["format"],
            kind=entry["kind"],
            dtype=entry["dtype"],
            sha256=entry["sha256"],
            largest_difference=max(
                entry["parity"]["largest_difference"], entry["parity"].get("random_difference", 0.0)
            ),
            case=entry["parity"]["case"],
            tolerance=entry["parity"]["tolerance"],
        )
        for entry in manifest["files"]
    )


def channel_of(entry: Dict[str, object]) -> Channel:
    """A channel as a bundle describes it."""
    reference = Reference(entry.get("reference", "none"))
    return Channel(name=str(entry["name"]), unit=str(entry["unit"]), reference=reference)
