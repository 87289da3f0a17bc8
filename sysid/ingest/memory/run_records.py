"""What a free run is given from memory beside its inputs: outputs that were measured, and what was before it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError, ConfigError, TraceError, shortened
from sysid.ingest.cells.headers import parse_header
from sysid.ingest.memory.arrays import data
from sysid.ingest.memory.run_inputs import inputs_of, only_record
from sysid.ingest.tables.frames import check_labels, columns_by_name
from sysid.traces import Channel, Trace, TraceSet

MEASURED, BEFORE = "the measured outputs", "initial, the samples before a run"


def measured_of(
    y: Any, u: Any, outputs: tuple[str, ...], units: Mapping[str, str], *, sample_time: float, where: str = MEASURED
) -> NDArray[np.float64]:
    """Outputs that were measured beside inputs, as a matrix in a mapping's order.

    Args:
        y: As inputs may be, for :func:`sysid.ingest.memory.run_inputs.inputs_of`.
        u: The inputs, whose rows have the same labels where both have some.
        outputs: Names of the outputs.
        units: As for :func:`sysid.ingest.memory.run_inputs.inputs_of`.
        sample_time: Of the model, in seconds.
        where: What they are, for errors.

    Returns:
        Shape ``(n_samples, n_outputs)``.

    Raises:
        ChannelError: If a table lacks an output.
        ConfigError: If rows have other labels than those of the inputs, or columns are not as many as the outputs.
        TraceError: If a sample is missing.
    """
    if not isinstance(y, Trace | TraceSet) and not isinstance(u, Trace | TraceSet):
        check_labels((u, y), ("u", "y"), where=where)
    return inputs_of(y, outputs, sample_time=sample_time, units=units, where=where)


def before_a_run(
    pair: tuple[Any, Any],
    inputs: tuple[str, ...],
    outputs: tuple[str, ...],
    units: Mapping[str, str],
    *,
    sample_time: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The samples before a run, from which it goes on.

    Args:
        pair: Inputs, as for :func:`sysid.ingest.memory.run_inputs.inputs_of`, and the outputs that were measured with
            them.
        inputs: Names of the inputs.
        outputs: Names of the outputs.
        units: Of both, as for :func:`sysid.ingest.memory.run_inputs.inputs_of`.
        sample_time: Of the model, in seconds.

    Returns:
        Shapes ``(n_past, n_inputs)`` and ``(n_past, n_outputs)``, oldest first.

    Raises:
        ChannelError: If a table lacks a channel.
        ConfigError: If columns are not as many as channels, or the rows of both have other labels.
        TraceError: If a sample is missing, or they are not as many.
    """
    if len(pair) != 2 or all(isinstance(part, int | float | np.number) for part in pair):
        raise _not_before(f"{len(pair)} values", outputs)
    before = inputs_of(pair[0], inputs, sample_time=sample_time, units=units, where=BEFORE)
    output = measured_of(pair[1], pair[0], outputs, units, sample_time=sample_time, where=BEFORE)
    if len(output) != len(before):
        raise _not_before(f"{len(before)} samples of inputs and {len(output)} of outputs", outputs)
    return before, output


def _not_before(got: str, outputs: tuple[str, ...]) -> TraceError:
    return TraceError(
        "these are no samples before a run",
        where="initial",
        expected=f"a pair (u, y) of as many samples each, y with a column for each of {', '.join(outputs)}",
        got=got,
        remedy="give both over the same samples: initial=(u_before, y_before); levels are by name: initial={"
        + ", ".join(f'"{name}": ...' for name in outputs)
        + "}",
    )


def past_of(initial: Any) -> Any:
    """The samples before a run as the pair ``(u, y)``: a record, or a frame with columns by name, is both.

    Args:
        initial: What was given.

    Returns:
        The pair; anything else as it is.
    """
    framed = hasattr(initial, "columns") and hasattr(initial, "index")
    return (initial, initial) if isinstance(initial, Trace | TraceSet) or framed else initial


def check_past(initial: Any) -> None:
    """Refuse what is neither the samples before a run nor a history of them."""
    if not isinstance(initial, tuple) and not hasattr(initial, "output"):
        raise ConfigError(
            "a forecast goes on from measured samples",
            where="initial",
            expected="a record of the samples before, or a pair (u, y)",
            got=shortened(initial),
            remedy="give them, as in initial=(u_before, y_before); simulate() begins at a level, or at rest",
        )


def levels_of(initial: Any, outputs: tuple[str, ...]) -> dict[str, float]:
    """Levels that outputs have stood at before a run.

    Args:
        initial: Nothing; a number, which every output has stood at; or numbers by name.
        outputs: Names of the outputs.

    Returns:
        The numbers by name, of those outputs of which something is said.

    Raises:
        ChannelError: If a name is no output's.
        ConfigError: If a level is not one finite number.
    """
    if not isinstance(initial, Mapping):
        return {} if initial is None else dict.fromkeys(outputs, level_of(initial))
    if strangers := [name for name in initial if name not in outputs]:
        raise ChannelError(strangers, outputs, where="initial")
    return {name: level_of(level) for name, level in initial.items()}


def level_of(initial: Any) -> float:
    """A level that an output has stood at before a run.

    Args:
        initial: What was given.

    Returns:
        The number.

    Raises:
        ConfigError: If it is not one finite number.
    """
    if isinstance(initial, int | float | np.number) and not isinstance(initial, bool) and np.isfinite(initial):
        return float(initial)
    raise ConfigError(
        "the output before the first sample is one finite number",
        where="initial",
        expected="a number, in the output's unit",
        got=repr(initial)[:60],
        remedy="samples before the first are a pair: initial=(u_before, y_before); several outputs are a dict by name",
    )


def record_of(values: Any, inputs: Sequence[Channel], outputs: Sequence[Channel], *, sample_time: float) -> Trace:
    """What is in memory as the record of a run: its inputs, and the measured outputs that are among the columns.

    Args:
        values: An array of the inputs, a frame or dict with columns by name, or a trace, which is given back as it is.
        inputs: The model's, with the units that columns without one are in.
        outputs: The same.
        sample_time: Seconds.

    Returns:
        The record; samples at which an output is missing are masked.

    Raises:
        ChannelError: If an input is missing.
        ConfigError: If the samples are at another distance, or an array has another number of columns.
        TraceError: If an input has a sample that is none.
    """
    values = only_record(values)
    if isinstance(values, Trace):
        return values
    names = tuple(channel.name for channel in inputs)
    found = inputs_of(values, names, sample_time=sample_time, units={one.name: one.unit for one in inputs})
    named = columns_by_name(values, where="the record")
    there = [one for one in outputs if named is not None and one.name in {parse_header(key).name for key in named}]
    if not there:
        return Trace(name="record", sample_time=sample_time, channels=tuple(inputs), values=found)
    keys = {parse_header(key).name: key for key in named or {}}
    measured = data(
        values,
        inputs=[],
        outputs=[keys[one.name] for one in there],
        sample_time=sample_time,
        units={keys[one.name]: one.unit for one in there if parse_header(keys[one.name]).unit is None},
        repairs={"nan": "mask"},
    ).traces[0]
    mask = measured.usable
    if mask is not None and mask.ndim == 2:
        mask = np.column_stack([np.ones(found.shape, dtype=np.bool_), mask])
    return Trace(
        name="record",
        sample_time=sample_time,
        start_time=measured.start_time,
        channels=(*inputs, *measured.channels),
        values=np.column_stack([found, measured.values]),
        usable=mask,
    )
