"""The least-squares problem of a process model: errors of the free run and their derivatives, in scaled numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.linear.begun_at_rest import at_rest, moving
from sysid.estimation.records.experiment import Experiment
from sysid.models import Scaling
from sysid.models.converting.realisation import parted
from sysid.models.process.process_run import ProcessRun, run
from sysid.models.process.process_type import DAMPING, DEAD_TIME, GAIN, ZERO, ProcessType
from sysid.models.process.structure import ProcessModel

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

FASTEST, SLOWEST = 0.05, 5.0
"""Shortest time constant in samples, and longest in lengths of the longest record: none beyond is shown."""
LEAST_DAMPING, MOST_DAMPING = 1e-3, 1.0
"""Above 1 the pair is two real poles, which types without ``U`` tell apart."""
LATEST = 3
"""A dead time is no longer than the longest record over this."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ProcessRecord:
    """A record in scaled numbers.

    Args:
        inputs: Shape ``(n_samples, n_inputs)``.
        past: What each input was before, shape ``(n_inputs,)``.
        target: Shape ``(n_samples,)``.
        roots: Square root of each sample's weight, shape ``(n_samples,)``.
        free: Whether the state before the first row is fitted.
        rests: Whether it begins at rest: what came before was no different.
        first: Rows before it are not counted, since an input of theirs came before the record.
    """

    inputs: Array
    past: Array
    target: Array
    roots: Array
    free: bool
    rests: bool
    first: int = 0

    @classmethod
    def of(cls, experiment: Experiment, scaling: Scaling) -> ProcessRecord:
        """A record with its measured history put before it.

        Args:
            experiment: The record.
            scaling: Between units and scaled numbers.

        Returns:
            The record.
        """
        inputs, output, past = experiment.inputs, experiment.output, experiment.history.inputs[0]
        weights = np.ones(len(output)) if experiment.weights is None else experiment.weights
        if experiment.past is not None and experiment.past.any():
            inputs = np.concatenate([experiment.history.inputs, inputs])
            output = np.concatenate([experiment.history.output, output])
            weights = np.concatenate([experiment.past_weights, weights])
        return cls(
            inputs=np.asfortranarray(scaling.scale_inputs(inputs)),
            past=scaling.scale_inputs(past[np.newaxis])[0],
            target=scaling.scale_output(output),
            roots=np.sqrt(weights),
            free=experiment.free,
            rests=bool(at_rest((inputs, output[:, np.newaxis], None if weights.all() else weights > 0.0), 0)),
        )

    @property
    def counted(self) -> Flags:
        """Which of its rows count."""
        return self.roots[self.first :] > 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Bounds:
    """What is known of all parameters, input by input, in scaled numbers.

    Args:
        start: Where it was said to start; NaN where nothing was.
        low: Least values.
        high: Greatest values.
        fixed: Which are given.
    """

    start: Array
    low: Array
    high: Array
    fixed: Flags

    @classmethod
    def of(
        cls, process: ProcessModel, inputs: Sequence[str], scaling: Scaling, sample_time: float, longest: int
    ) -> Bounds:
        """Those that were said, within those that records of a length can show.

        Args:
            process: The structure, a type for each input.
            inputs: The inputs.
            scaling: Between units and scaled numbers.
            sample_time: Seconds.
            longest: Samples of the longest record.

        Returns:
            The bounds.
        """
        rows = []
        lag = FASTEST * sample_time, SLOWEST * longest * sample_time
        usual = {
            GAIN: (-np.inf, np.inf), ZERO: (-np.inf, np.inf), DAMPING: (LEAST_DAMPING, MOST_DAMPING),
            DEAD_TIME: (0.0, longest * sample_time / LATEST),
        }  # fmt: skip
        for j, (kind, of) in enumerate(zip(process.types, inputs, strict=True)):
            for name in kind.names:
                low, high = usual.get(name, lag)
                known, unit = process.known(name, of), 1.0
                if known is None:
                    rows.append((np.nan, low, high, False))
                    continue
                if name == GAIN:
                    unit = scaling.input_scale[j] / scaling.output_scale
                said = (known.low, known.high)
                floor = 0.0 if name == DEAD_TIME else -np.inf if name in {GAIN, ZERO} else 1e-3 * low
                low = max(said[0], floor) * unit if np.isfinite(said[0]) else min(low, known.start * unit)
                high = said[1] * unit if np.isfinite(said[1]) else max(high, known.start * unit)
                rows.append((known.start * unit, low, high, known.fixed))
        start, low_, high_, fixed = zip(*rows, strict=True)
        return cls(start=np.array(start), low=np.array(low_), high=np.array(high_), fixed=np.array(fixed))

    def within(self, values: Array) -> Array:
        """Values, those that are given in their places and the others between their bounds."""
        return np.where(self.fixed, self.start, np.clip(values, self.low, self.high))


@dataclass(frozen=True, kw_only=True, eq=False)
class Problem:
    """Records, types and bounds.

    The vector that is searched has the parameters that are not given, those above zero as logarithms; then the constant
    or the level; then the states before records that begin anywhere.

    Args:
        types: The type of each input.
        records: The records.
        bounds: Of the parameters.
        sample_time: Seconds.
        constant: Whether a constant, or a level, is fitted.
        middles: The inputs about which the constant is fitted, in their units, shape ``(n_inputs,)``.
    """

    types: tuple[ProcessType, ...]
    records: tuple[ProcessRecord, ...]
    bounds: Bounds
    sample_time: float
    constant: bool
    middles: Array

    @cached_property
    def names(self) -> tuple[tuple[int, str], ...]:
        """The input and the name of each parameter."""
        return tuple((j, name) for j, kind in enumerate(self.types) for name in kind.names)

    @cached_property
    def free(self) -> NDArray[np.intp]:
        """Places of the parameters that are searched."""
        return np.flatnonzero(~self.bounds.fixed)

    @cached_property
    def logarithms(self) -> Flags:
        """Which of those are searched as logarithms."""
        return np.array([self.names[i][1] not in {GAIN, ZERO, DEAD_TIME} for i in self.free], dtype=np.bool_)

    @property
    def order(self) -> int:
        """States of all paths."""
        return sum(kind.order for kind in self.types)

    @property
    def n_offsets(self) -> int:
        """Constants and levels that are fitted."""
        return int(self.constant)

    @property
    def integrates(self) -> bool:
        """Whether a path does."""
        return any(kind.integrates for kind in self.types)

    @cached_property
    def n_counted(self) -> int:
        """Rows that count."""
        return sum(int(record.counted.sum()) for record in self.records)

    @property
    def ends(self) -> tuple[Array, Array]:
        """Bounds of the vector."""
        found = []
        for side, none in ((self.bounds.low, -np.inf), (self.bounds.high, np.inf)):
            own = side[self.free].copy()
            own[self.logarithms] = np.log(own[self.logarithms])
            found.append(np.concatenate([own, np.full(self.width - len(own), none)]))
        return found[0], found[1]

    @property
    def width(self) -> int:
        """Length of the vector."""
        return len(self.free) + self.n_offsets + self.order * sum(record.free for record in self.records)

    def each(self, values: Array) -> list[Array]:
        """Parameters input by input."""
        return np.split(values, np.cumsum([len(kind.names) for kind in self.types])[:-1])

    @property
    def firsts(self) -> list[int]:
        """The first row of each record that counts."""
        return [record.first for record in self.records]

    def criterion(self, loss: float) -> float:
        """Akaike's, but for a constant: a row that is left out counts as a parameter that fits it exactly.

        Without it a long dead time, which leaves out what it does not explain, would look best.

        Args:
            loss: Half the sum of squared errors.

        Returns:
            The criterion, less of what is better.
        """
        whole = sum(int((record.roots > 0.0).sum()) for record in self.records)
        tiny = float(np.finfo(np.float64).tiny)
        return whole * float(np.log(max(loss, tiny) / max(self.n_counted, 1))) + 2.0 * (whole - self.n_counted)

    def rows_for(self, values: Array) -> Problem:
        """The problem whose records begin where all inputs that act are known.

        Of one that begins at rest, all are taken to be: what came before was no different. Where that would leave out
        all that an input does, such as a step with which a record begins, inputs are taken to have stood before at what
        they are at first.

        Args:
            values: Parameters, of which the dead times count.

        Returns:
            The problem.
        """
        late = max((values[i] for i, (_, name) in enumerate(self.names) if name == DEAD_TIME), default=0.0)
        k, part = parted(late / self.sample_time)
        most = k + (part > 0.0)
        lost = [min(most, len(one.target) - 1) * (one.free and not one.rests) for one in self.records]
        moves = np.any([moving(one.inputs) for one in self.records], axis=0)
        rows = zip(self.records, lost, strict=True)
        shown = np.any(
            [moving(one.inputs[max(n - most, 0) : max(len(one.inputs) - most, 1)]) for one, n in rows], axis=0
        )
        if (moves & ~shown).any():
            lost = [0] * len(lost)
        pairs = zip(self.records, lost, strict=True)
        return replace(self, records=tuple(replace(one, first=n) for one, n in pairs))

    def offset(self, theta: Array) -> float:
        """The constant, or the level, of a vector."""
        return float(theta[len(self.free)]) if self.constant else 0.0

    def values(self, theta: Array) -> Array:
        """All parameters at a vector."""
        found, own = self.bounds.start.copy(), theta[: len(self.free)].copy()
        own[self.logarithms] = np.exp(own[self.logarithms])
        found[self.free] = own
        return found

    def theta(self, values: Array, offset: float, states: Sequence[Array]) -> Array:
        """The vector of some parameters, the constant, and the states of records that begin anywhere."""
        own = values[self.free].copy()
        own[self.logarithms] = np.log(own[self.logarithms])
        return np.concatenate([own, [offset] * self.n_offsets, *states])

    def runs(self, record: ProcessRecord, values: Array, level: float, state: Array | None) -> list[ProcessRun]:
        """What each path does over a record."""
        found, at = [], 0
        for j, (kind, own) in enumerate(zip(self.types, self.each(values), strict=True)):
            off = level if j == self.levelled else 0.0
            begun = None if state is None else state[at : at + kind.order]
            inputs, past = (record.inputs[:, j] - off, record.past[j] - off) if off else (
                record.inputs[:, j], record.past[j])  # fmt: skip
            found.append(run(kind, own, inputs, float(past), self.sample_time, first=record.first, state=begun))
            at += kind.order
        return found

    @cached_property
    def levelled(self) -> int | None:
        """The first input that is added up, whose level is fitted in place of a constant."""
        return next((j for j, kind in enumerate(self.types) if kind.integrates), None)

    def ramp(self, record: ProcessRecord, values: Array) -> Array:
        """How the output moves with the level, or with the constant."""
        n = len(record.target) - record.first
        if self.levelled is None:
            return np.ones(n)
        kind, own = self.types[self.levelled], self.each(values)[self.levelled]
        ones = np.ones(len(record.target))
        begun = np.zeros(kind.order)
        return -run(kind, own, ones, 1.0, self.sample_time, first=record.first, state=begun).output

    def errors(self, theta: Array) -> tuple[Array, Array]:
        """Weighted errors, and their derivatives with respect to the vector.

        Args:
            theta: The vector.

        Returns:
            Shapes ``(n_rows,)`` and ``(n_rows, width)``.
        """
        values = self.values(theta)
        n_free, at = len(self.free), len(self.free) + self.n_offsets
        offset = float(theta[n_free]) if self.constant else 0.0
        level, constant = (0.0, offset) if self.levelled is None else (offset, 0.0)
        unit = np.where(self.logarithms, values[self.free], 1.0)
        errors, slopes = [], []
        for record in self.records:
            state = theta[at : at + self.order] if record.free else None
            paths = self.runs(record, values, level, state)
            J = np.zeros((len(record.target) - record.first, self.width))
            J[:, :n_free] = np.concatenate([one.slopes for one in paths], axis=1)[:, self.free] * unit
            if self.constant:
                J[:, n_free] = self.ramp(record, values)
            if record.free:
                J[:, at : at + self.order] = np.concatenate([one.beginnings for one in paths], axis=1)
                at += self.order
            roots = record.roots[record.first :]
            y = np.sum([one.output for one in paths], axis=0) + constant
            errors.append((y - record.target[record.first :]) * roots)
            slopes.append(J * roots[:, np.newaxis])
        return np.concatenate(errors), np.concatenate(slopes)
