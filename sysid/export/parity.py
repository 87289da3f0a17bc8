"""Parity: every exported file is run against the model that it came from, on every case and on random sequences.

How much a free run makes of a difference is the model's own property, and decides what parity can be had at all: a
number rounded otherwise in its last digit comes out larger by :attr:`ParityCase.amplification`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ParityError
from sysid.export.exporter import ExportedFile, Runner
from sysid.export.exporters import exporter
from sysid.export.forms.stage import Port
from sysid.export.surrogate import Surrogate
from sysid.models import AbstractModel, History, Start, beginning
from sysid.traces import Trace, TraceSet

SHARES: Mapping[str, float] = {"float64": 1e-9, "float32": 1e-5}
"""How far a file may be from its model by default, as a share of an output's size, by the type of its numbers."""
RANDOM_SEQUENCES = 100
RANDOM_SAMPLES = 400
RANDOM_SEED = 7
DISTURBANCE = 1e-6
"""Change of the output before the first sample, as a share of its scale, by which amplification is measured: far
above rounding, far below what would reach a network's bends."""

LOST = 1e6
"""Amplification from which a difference in the last digit may be as large as what is allowed."""

ROUNDINGS = 1e3
"""Roundings of the last digit that add up in a run, of which each is amplified."""

NEAR_0 = 10.0
"""Movements from 0 within which a channel's level makes rounding no coarser than is allowed anyway."""


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
    """

    name: str
    inputs: NDArray[np.float64]
    state: NDArray[np.float64]
    output: NDArray[np.float64]
    amplification: float
    reached: int = 0


@dataclass(frozen=True, kw_only=True)
class Parity:
    """How far an exported file is from its model.

    Args:
        largest_difference: Over all samples of all cases, in the output's unit; of several outputs, of the one that is
            nearest to what is allowed.
        case: Where it occurred.
        random_difference: The same over the random sequences; where their outputs are larger than in all cases, as many
            times less.
        random_sequences: Their number.
        tolerance: What is allowed, in the same unit, in cases and sequences.
        share: The same as a share of the output's size; ``None`` where it was given in the output's unit.
        output: The output's name.
        unit: Its unit.
        samples: Number of samples compared.
    """

    largest_difference: float
    case: str
    random_difference: float
    random_sequences: int
    tolerance: float
    share: float | None
    output: str
    unit: str
    samples: int

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        return {
            "largest_difference": self.largest_difference,
            "case": self.case,
            "random_difference": self.random_difference,
            "random_sequences": self.random_sequences,
            "tolerance": self.tolerance,
            "share": self.share,
            "output": self.output,
            "unit": self.unit,
            "samples": self.samples,
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class Allowed:
    """How far a file may be from its model.

    Args:
        each: Largest difference of each output, in its unit, shape ``(n_outputs,)``.
        share: The same as a share of each output's size; ``None`` where it was given.
        rounding: What rounding at the channels' levels makes of each output, before it is amplified; nothing of
            channels that move about 0.
    """

    each: NDArray[np.float64]
    share: float | None = None
    rounding: NDArray[np.float64] | float = 0.0

    def over(self, run: ParityCase) -> NDArray[np.float64]:
        """What is allowed in a run: more where its outputs are larger than in all cases, as an unstable model's become.

        And where a channel stands far from 0: what moves by 50 Pa about 100 kPa is rounded 2,000 times as coarsely as
        its movement, and so is every output that it moves, also one that stands at 0 itself.

        Args:
            run: The model's.

        Returns:
            Shape ``(n_outputs,)``.
        """
        if self.share is None:
            return self.each
        own = np.maximum(self.each, self.share * np.abs(run.output).max(axis=0, initial=0.0))
        return np.asarray(np.maximum(own, self.rounding * min(run.amplification, LOST)))

    @classmethod
    def of(cls, cases: Sequence[ParityCase], dtype: str, given: float | None = None) -> Allowed:
        """What is allowed.

        A number in an output's unit would ask another thing of pascals than of bars. Rounding is in proportion to what
        is rounded: to the level that an output stands at, as well as to how far it moves.

        Args:
            cases: The model's runs over the cases.
            dtype: Of the file's numbers.
            given: Largest difference in the outputs' unit, where one was asked for.

        Returns:
            It; by default :data:`SHARES` of the largest magnitude that each output has over the cases.
        """
        sizes = np.max([np.abs(case.output).max(axis=0, initial=0.0) for case in cases], axis=0)
        if given is not None:
            return cls(each=np.full(sizes.shape, given))
        # One that is 0 throughout has no size of its own.
        usable = np.isfinite(sizes) & (sizes > 0.0)
        return cls(
            each=SHARES[dtype] * np.where(usable, sizes, 1.0),
            share=SHARES[dtype],
            rounding=ROUNDINGS * np.finfo(dtype).eps * _far_from_0(cases),
        )


def _far_from_0(cases: Sequence[ParityCase]) -> NDArray[np.float64]:
    """How far channels stand from 0, beyond some of their movements, as movements of each output."""
    inputs, outputs = (np.concatenate([getattr(case, name) for case in cases]) for name in ("inputs", "output"))
    with np.errstate(over="ignore", invalid="ignore"):  # of a model that grows without bound
        every = np.column_stack([inputs, outputs])
        moves, levels = every.std(axis=0), np.abs(every.mean(axis=0))
    moving = np.isfinite(moves) & np.isfinite(levels) & (moves > 0.0)
    farthest = float((levels[moving] / moves[moving]).max(initial=0.0))
    return np.where(moving, moves, 0.0)[inputs.shape[1] :] * max(0.0, farthest - NEAR_0)


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
    )


def _growth(disturbed: NDArray[np.float64], output: NDArray[np.float64]) -> tuple[float, int]:
    """The largest difference of two runs, and the sample at which it is reached."""
    each = _differences(disturbed, output).max(axis=1, initial=0.0)
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


def check_parity(
    file: ExportedFile,
    folder: Path,
    cases: tuple[ParityCase, ...],
    sequences: tuple[ParityCase, ...],
    *,
    allowed: Allowed,
    outputs: Sequence[Port],
) -> Parity:
    """Run an exported file on every case and on the random sequences over which its model stays finite.

    Args:
        file: The file.
        folder: Where it lies.
        cases: From :func:`parity_cases`; at least one.
        sequences: From :func:`random_cases`, all of one length; may be empty.
        allowed: Largest difference of each output.
        outputs: The outputs.

    Returns:
        The largest differences, and where they occurred.

    Raises:
        ParityError: If a difference is larger than the tolerance, or not a number.
    """
    runner = exporter(file.format).load(file, folder)
    differences = np.concatenate([_compare(runner, (case,)) for case in cases])
    # Where the model itself grows without bound there is nothing to reproduce: in float32 it does so sooner.
    sequences = tuple(case for case in sequences if np.isfinite(case.output).all())
    drawn = _compare(runner, sequences) if sequences else differences[:0]
    for found, runs in ((differences, cases), (drawn, sequences)):
        larger = np.array([allowed.over(run) for run in runs]).reshape(found.shape) / allowed.each
        np.divide(found, larger, out=found)
        ratios = found / allowed.each
        if (ratios > 1.0).any():
            row, column = divmod(int(ratios.argmax()), ratios.shape[1])
            each, port = float((allowed.each * larger[row])[column]), outputs[column]
            found_there = float(found[row, column] * larger[row, column])
            coarse, grown = file.dtype == "float32", runs[row].amplification
            raise ParityError(
                file.name, runs[row].name, found_there, each, port.unit, coarse=coarse,
                grown=grown if not coarse and grown > LOST else 0.0,
            )  # fmt: skip
    every = np.concatenate([differences, drawn])
    near = int((every / allowed.each).max(axis=0).argmax())
    return Parity(
        largest_difference=float(differences[:, near].max()),
        case=cases[int(differences[:, near].argmax())].name,
        random_difference=float(drawn[:, near].max(initial=0.0)),
        random_sequences=len(sequences),
        tolerance=float(allowed.each[near]),
        share=allowed.share,
        output=outputs[near].name,
        unit=outputs[near].unit,
        samples=sum(len(case.output) for case in (*cases, *sequences)),
    )


def _compare(runner: Runner, cases: tuple[ParityCase, ...]) -> NDArray[np.float64]:
    """The largest difference of each case and output, all run side by side as cars; shape ``(n_cases, n_outputs)``."""
    run = runner(np.stack([case.inputs for case in cases], axis=1), np.stack([case.state for case in cases]))
    found = [_differences(run.output[:, i], case.output).max(axis=0, initial=0.0) for i, case in enumerate(cases)]
    return np.array(found).reshape(len(cases), -1)


def largest_difference(output: NDArray[Any], expected: NDArray[np.float64]) -> float:
    """The largest absolute difference of two records.

    Args:
        output: Any shape.
        expected: The same shape.

    Returns:
        The difference; infinite where one of them is not a number and the other is, or where both are infinite
        with different signs.

    Example:
        >>> largest_difference(np.array([1.0, np.nan]), np.array([1.5, np.nan]))
        0.5
    """
    return float(np.max(_differences(output, expected), initial=0.0))


def _differences(output: NDArray[Any], expected: NDArray[np.float64]) -> NDArray[np.float64]:
    same = (output == expected) | (np.isnan(output) & np.isnan(expected))
    with np.errstate(invalid="ignore"):
        difference = np.where(same, 0.0, np.abs(output - expected))
    return np.asarray(np.nan_to_num(difference, nan=np.inf, posinf=np.inf), dtype=np.float64)
