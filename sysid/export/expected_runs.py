"""Free runs of a model that its exported files have to reproduce: over traces, and over random inputs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.export.differences import differences
from sysid.export.surrogate import Surrogate
from sysid.models import AbstractModel, History, Start, beginning
from sysid.traces import Trace, TraceSet

RANDOM_SEQUENCES = 100
RANDOM_SAMPLES = 400
RANDOM_SEED = 7
DISTURBANCE = 1e-6
"""Change of the output before the first sample, as a share of its scale, by which amplification is measured: far
above rounding, far below what would reach a network's bends."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ParityCase:
    """A free run of the model that an exported file has to reproduce.

    Args:
        name: Name of the trace, or of the random sequence.
        inputs: In their units, shape ``(n_samples, n_inputs)``.
        state: Before the first sample, shape ``(n_state,)``.
        output: The model's outputs, shape ``(n_samples, n_outputs)``.
        amplification: Largest change of an output in the run over the change before its first sample that caused it.
        reached: The sample at which it is reached.
        rests: Whether its state is that at rest at its first inputs, to which files may come by themselves.
        searched: Whether that state is searched for, and found by a file as finely as it searches.
        itself: Whether a file has to begin the run by itself.
    """

    name: str
    inputs: NDArray[np.float64]
    state: NDArray[np.float64]
    output: NDArray[np.float64]
    amplification: float
    reached: int = 0
    rests: bool = False
    searched: bool = False
    itself: bool = False


def parity_cases(surrogate: Surrogate, traces: TraceSet, start: Start) -> tuple[ParityCase, ...]:
    """The free run of the model or cascade on every trace.

    Args:
        surrogate: What is exported.
        traces: The cases; a cascade's need its inputs alone.
        start: How each free run of a single model begins; a cascade begins at rest.

    Returns:
        One case per trace.

    Raises:
        ChannelError: If a trace lacks a channel.
        TraceError: If a trace is not longer than its measured start.
    """
    model = surrogate.source.single
    if model is None:
        return tuple(case_from_rest(surrogate, trace.name, surrogate.inputs_of(trace)) for trace in traces)
    return tuple(_from_history(surrogate, model, trace, start) for trace in traces)


def _from_history(surrogate: Surrogate, model: AbstractModel, trace: Trace, start: Start) -> ParityCase:
    inputs, target = trace.columns(model.mapping.inputs), model.measured(trace)
    begun = beginning(model, inputs, target, start, trace.usable_of(model.mapping.channels))
    history, inputs = begun.history, inputs[begun.first :]
    output, change = model.simulate(inputs, history).reshape(len(inputs), -1), _disturbances(surrogate)
    moved = history.output + (change if model.structure.several_outputs else change[0])
    disturbed = model.simulate(inputs, History(inputs=history.inputs, output=moved)).reshape(len(inputs), -1)
    grown, reached = _growth(disturbed / change, output / change)
    return ParityCase(
        name=trace.name,
        inputs=surrogate.inputs_of(trace)[begun.first :],
        state=surrogate.stages[0].state.from_history(history),
        output=output,
        amplification=grown,
        reached=reached,
    )


def case_from_rest(
    surrogate: Surrogate, name: str, inputs: NDArray[np.float64], begun: NDArray[np.float64] | None = None
) -> ParityCase:
    """The free run over some inputs, from rest.

    Args:
        surrogate: What is exported.
        name: Of the case.
        inputs: In their units, shape ``(n_samples, n_inputs)``.
        begun: What is computed before the first sample, shape ``(n_computed,)``; at rest by default.

    Returns:
        The case.
    """
    change, rest = _disturbances(surrogate), surrogate.rest(inputs[0]) if begun is None else begun
    computed = surrogate.compute(inputs, rest)
    disturbed = surrogate.compute(inputs, rest + change)
    grown, reached = _growth(surrogate.chosen(disturbed / change), surrogate.chosen(computed / change))
    return ParityCase(
        name=name,
        inputs=inputs,
        state=surrogate.at_rest(inputs[0], rest),
        output=surrogate.chosen(computed),
        amplification=grown,
        reached=reached,
        rests=begun is None,
        searched=any(stage.searched for stage in surrogate.stages),
    )


def _growth(disturbed: NDArray[np.float64], output: NDArray[np.float64]) -> tuple[float, int]:
    """The largest difference of two runs, and the sample at which it is reached."""
    each = differences(disturbed, output).max(axis=1, initial=0.0)
    return (float(each.max()), int(each.argmax())) if len(each) else (0.0, 0)


def _somewhere(rng: np.random.Generator, surrogate: Surrogate) -> NDArray[np.float64]:
    """What is computed before the first sample, within its scaling's range, in numbers that float32 can hold."""
    forms = [(stage.form, stage.form.n_inputs) for stage in surrogate.stages]
    offset = np.concatenate([np.array(form.offset[n:]) for form, n in forms])
    scale = np.concatenate([np.array(form.scale[n:]) for form, n in forms])
    return (offset + scale * rng.uniform(-1.0, 1.0, len(offset))).astype(np.float32).astype(np.float64)


def _disturbances(surrogate: Surrogate) -> NDArray[np.float64]:
    scales = [scale for stage in surrogate.stages for scale in stage.form.scale[stage.form.n_inputs :]]
    return DISTURBANCE * np.array(scales)


def random_cases(
    surrogate: Surrogate, *, sequences: int = RANDOM_SEQUENCES, samples: int = RANDOM_SAMPLES, seed: int = RANDOM_SEED
) -> tuple[ParityCase, ...]:
    """The models' free runs from rest on random inputs within the declared ranges: steps, ramps and noise.

    The inputs are numbers that float32 can hold, so that a difference is the file's doing: a network that follows
    rates a thousand times as strongly as levels makes more of the rounding of its inputs alone than is allowed here.

    Args:
        surrogate: What is exported. An input without a declared range moves over its scaling's (offset plus and
            minus scale).
        sequences: How many.
        samples: Length of each.
        seed: Of the random numbers.

    Returns:
        One case per sequence.
    """
    rng = np.random.default_rng(seed)
    low, high = _ranges(surrogate)
    # A bound of the range that float32 cannot hold must not be overstepped by its rounding.
    least, most = (np.asarray(bound, dtype=np.float32) for bound in (low, high))
    least, most = (
        np.where(least < low, np.nextafter(least, np.float32(np.inf)), least),
        np.where(most > high, np.nextafter(most, np.float32(-np.inf)), most),
    )
    cases = []
    for number in range(sequences):
        drawn = (low + (high - low) * _excitation(rng, samples, len(low))).astype(np.float32)
        inputs = np.clip(drawn, least, most).astype(np.float64)
        # What nothing goes into differs by where it begins.
        begun = None if not surrogate.ticks else _somewhere(rng, surrogate)
        cases.append(case_from_rest(surrogate, f"random {number + 1}", inputs, begun))
    return tuple(cases)


def _ranges(surrogate: Surrogate) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    scale: dict[int, tuple[float, float]] = {}
    for stage in surrogate.stages:
        form = stage.form
        for column, offset, half in zip(stage.sources, form.offset, form.scale, strict=False):
            scale.setdefault(column, (offset - half, offset + half))
    ranges = [port.range or scale.get(i, (0.0, 1.0)) for i, port in enumerate(surrogate.inputs)]
    return np.array([low for low, _ in ranges]), np.array([high for _, high in ranges])


def _excitation(rng: np.random.Generator, samples: int, n_inputs: int) -> NDArray[np.float64]:
    """Between 0 and 1, both reached now and then: levels held for a random time, with ramps between some of them."""
    columns = []
    for _ in range(n_inputs):
        count = int(rng.integers(2, 20))
        corners = np.sort(rng.choice(np.arange(1, samples), size=count - 1, replace=False))
        levels = np.clip(rng.uniform(-0.1, 1.1, count + 1), 0.0, 1.0)
        held = np.repeat(levels[:-1], np.diff([0, *corners, samples]))
        ramped = np.interp(np.arange(samples), [0, *corners, samples], levels)
        noise = 0.01 * rng.uniform(-1.0, 1.0, samples)
        columns.append(np.clip((held if rng.random() < 0.5 else ramped) + noise, 0.0, 1.0))
    return np.column_stack(columns) if columns else np.zeros((samples, 0))
