"""What a free run is given from memory beside its inputs: outputs that were measured, and what was before it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, TraceError
from sysid.ingest.arrays import data
from sysid.ingest.frames import as_array, columns_by_name
from sysid.ingest.headers import parse_header
from sysid.ingest.run_inputs import inputs_of
from sysid.traces import Channel, Trace


def before_a_run(
    pair: tuple[Any, Any], inputs: tuple[str, ...], outputs: tuple[str, ...], units: Mapping[str, str]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The samples before a run, from which it goes on.

    Args:
        pair: Inputs, as for :func:`sysid.ingest.run_inputs.inputs_of`, and the outputs that were measured with them.
        inputs: Names of the inputs.
        outputs: Names of the outputs.
        units: Of both, as for :func:`sysid.ingest.run_inputs.inputs_of`.

    Returns:
        Shapes ``(n_past, n_inputs)`` and ``(n_past, n_outputs)``, oldest first.

    Raises:
        ChannelError: If a table lacks a channel.
        TraceError: If a sample is missing, or they are not as many.
    """
    if len(pair) != 2:
        raise _not_before(f"{len(pair)} values", outputs)
    named = columns_by_name(pair[1], where="initial") if not isinstance(pair[1], Trace) else {}
    if named is not None and not hasattr(pair[1], "to_frame"):
        output = inputs_of(pair[1], outputs, units=units)
    else:
        output = np.asarray(as_array(pair[1]), dtype=np.float64)
        output = output.reshape(len(output), -1) if output.ndim else output
    before = inputs_of(pair[0], inputs, units=units)
    if output.ndim != 2 or output.shape != (len(before), len(outputs)) or not len(output):
        raise _not_before(f"{len(before)} samples of inputs and an output of shape {np.shape(pair[1])}", outputs)
    if not np.isfinite(output).all():
        raise TraceError(
            "a sample before the first is missing",
            where="initial",
            expected="finite numbers: a run goes on from them",
            got="nan or infinity",
            remedy="give the samples after the last one that is missing, or one number",
        )
    return before, output


def _not_before(got: str, outputs: tuple[str, ...]) -> TraceError:
    return TraceError(
        "these are no samples before a run",
        where="initial",
        expected=f"a pair (u, y) of as many samples each, y with a column for each of {', '.join(outputs)}",
        got=got,
        remedy="give both over the same samples: initial=(u_before, y_before)",
    )


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
