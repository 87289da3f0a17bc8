"""Residuals and Jacobians of a whole cascade: several members trained together through each other, in free run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from collections.abc import Mapping as Dict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError
from sysid.estimation.experiment import Experiment
from sysid.estimation.least_squares.correlation import correlation_time
from sysid.estimation.least_squares.counted_rows import counted_rows
from sysid.estimation.least_squares.leverage import leverage_roots
from sysid.estimation.least_squares.provider import AbstractProvider, Linearisation
from sysid.estimation.least_squares.robust_loss import counted
from sysid.estimation.networks.joint_record import Record, windows_of
from sysid.estimation.networks.trained_members import TrainedMembers
from sysid.kernels import cascade as kernel
from sysid.kernels.cascade_layout import Program
from sysid.kernels.cascade_sensitivities import rows_for, sensitivities
from sysid.models import Cascade, Member
from sysid.traces import Trace

_Found = TypeVar("_Found")
_Rows = tuple[NDArray[Any], NDArray[np.float64]]
_Moving = tuple[NDArray[np.bool_] | slice, NDArray[np.float64]]
_EVERY = slice(None)
"""All rows of a block: they are taken as they stand."""

BLOCK, MOST = 256, 1024
"""Rows of each target's Jacobian that are alive at a time at least, and at most: powers of two."""

ALIVE = 256 * 1500 * 4
"""Numbers of all targets' rows together up to which there are more than the least: 12 MB."""

GATHERED = 1024
"""Rows at most that are gathered before they are squared, where there are fewer than parameters: adding a matrix of
1,500 by 1,500 costs as much as some 500 rows."""


@dataclass(frozen=True, eq=False)
class _Passed:
    """What one pass leaves for the sensitivities."""

    values: NDArray[np.float64]
    kept: NDArray[np.float64]
    held: NDArray[np.int8]


@dataclass(frozen=True, kw_only=True, eq=False)
class CascadeProvider(AbstractProvider):
    """Residuals of the free run of a cascade over its target outputs, as a function of its trained members' parameters.

    The parameters are those of the trained members, one after the other in the order in which they run. Members that
    neither are trained nor read a trained one are run once, at the beginning.

    Args:
        cascade: The whole; its own parameters are the start.
        traces: The records; each begins at rest.
        errors: For each target output the error in its unit that counts as one.
        trained: Outputs of the members that are trained; all members by default.
        stride: Every so-manieth sample counts. Residuals of a free run are correlated over tens of samples: a few of
            them say nearly as much as all, and the price of the normal equations falls with them.
        moves: A sample counts as well where a target has moved by more than so many of its errors since the last that
            counted, and so does the one before it (``counted_rows.py``).
        leverage: How many times as long as their median, at the start, a row of the Jacobian may be before it counts
            less in gradient and Gauss-Newton matrix (``leverage.py``); infinity for all alike.
        robust_scale: Root mean squared residual of a trace from which on it counts by its logarithm
            (``robust_scale.py``); infinity for plain squares.
        workers: Records that are worked on at the same time.
        begins: From a trace the levels at rest before it, where they are its own and not the cascade's.
        measured: From a trace its record, of all channels in the wiring's order, where it begins with measured samples:
            what came before is then not known.
        window: Samples after which the free run of a trace begins anew from what is measured (``joint_record.py``);
            ``None`` for one run over the whole trace.

    Raises:
        ChannelError: If a trace lacks an input or a target, or a name is no output of the cascade.
        ConfigError: If a member that would have to pass on sensitivities cannot.
    """

    cascade: Cascade
    traces: tuple[Trace, ...]
    errors: Dict[str, float]
    trained: tuple[str, ...] | None = None
    stride: int = 1
    moves: float = np.inf
    leverage: float = np.inf
    robust_scale: float = np.inf
    workers: int = 1
    begins: Callable[[Trace], Dict[str, float]] = lambda _: {}
    measured: Callable[[Trace], Experiment] | None = None
    window: int | None = None
    n_samples: int = field(init=False)
    _trained: TrainedMembers = field(init=False, repr=False)
    _records: tuple[Record, ...] = field(init=False, repr=False)
    _longest: float = field(init=False, repr=False)

    def __post_init__(self) -> None:
        cascade, put = self.cascade, object.__setattr__
        put(self, "traces", tuple(self.traces))
        strangers = [n for n in (*self.errors, *(self.trained or ())) if n not in cascade.outputs]
        if strangers or not self.errors:
            raise ChannelError(strangers or ["(none)"], cascade.outputs, where="targets and trained members")
        put(self, "_trained", TrainedMembers.of(cascade, self.trained))
        put(self, "_records", tuple(part for trace in self.traces for part in self._in_windows(trace)))
        put(self, "n_samples", int(sum(_counted(record).sum() for record in self._records)))
        put(self, "_longest", np.inf if np.isinf(self.leverage) else self.leverage * self._median_row())

    @property
    def theta(self) -> NDArray[np.float64]:
        """The parameters that the trained members have, shape ``(n_parameters,)``."""
        return self._trained.theta

    @property
    def members(self) -> tuple[Member, ...]:
        """The trained members, in the order of the parameters."""
        return self._trained.members

    def at(self, theta: NDArray[np.float64]) -> Cascade:
        """The cascade with these parameters.

        Args:
            theta: Flat parameters of the trained members.

        Returns:
            The cascade.
        """
        return self._trained.put(self.cascade, theta)

    def loss(self, theta: NDArray[np.float64]) -> float:
        """Half the weighted sum of squared residuals; see the base class."""
        program = self._trained.program_at(theta)

        def one(record: Record) -> float:
            passed = self._pass(program, record, keep=False)
            return counted(self._residual(record, passed.values), self.robust_scale, _counted(record))[0]

        total = sum(self._each(one))
        return total if np.isfinite(total) else np.inf

    def linearise(self, theta: NDArray[np.float64]) -> Linearisation:
        """Loss, gradient and Gauss-Newton matrix; see the base class."""
        return self._linearised(theta, correlation=True)

    def without_news(self, theta: NDArray[np.float64]) -> Linearisation:
        """The same without the correlation time; see the base class."""
        return self._linearised(theta, correlation=False)

    def _linearised(self, theta: NDArray[np.float64], *, correlation: bool) -> Linearisation:
        program = self._trained.program_at(theta)
        n = len(theta)
        gradient, matrix, loss, correlated, rows = np.zeros(n), np.zeros((n, n)), 0.0, 0.0, 0

        def one(record: Record) -> tuple[float, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
            return self._normal_equations(program, record, n)

        residuals: list[NDArray[np.float64]] = []
        with np.errstate(invalid="ignore"):  # infinities of two records may cancel
            for own, part, square, residual in self._each(one):
                loss += own
                gradient += part
                matrix += square
                residuals.append(residual)
        # Windows follow one another: looked at one by one, each would take as long as its normal equations.
        for residual in residuals if self.window is None else [np.concatenate(residuals)]:
            with np.errstate(over="ignore", invalid="ignore"):
                news = np.mean([correlation_time(column) for column in residual.T]) if correlation else np.nan
            correlated += len(residual) * float(news)
            rows += len(residual)
        return Linearisation(loss=loss, gradient=gradient, gauss_newton=matrix, correlation_time=correlated / rows)

    def jacobian(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """The whole Jacobian of the targets over their errors, unweighted: for each record target after target.

        Args:
            theta: Flat parameters.

        Returns:
            Shape ``(n_records x n_targets x n_counted_samples, n_parameters)``.
        """
        program = self._trained.program_at(theta)
        found: list[NDArray[np.float64]] = []
        for record in self._records:
            passed = self._pass(program, record, keep=True)
            rows = np.zeros((len(self.errors), len(record.rows), len(theta)))
            for own, blocks in self._blocks(program, record, passed, len(theta)):
                for j, (moving, block) in enumerate(blocks):
                    rows[j, own, : block.shape[1]][moving] = self._per_error(program)[j] * block
            found += list(rows)
        return np.concatenate(found)

    def residuals(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """The residuals over their errors, unweighted, in the order of :meth:`jacobian`'s rows.

        Args:
            theta: Flat parameters.

        Returns:
            Shape ``(n_records x n_targets x n_counted_samples,)``.
        """
        program = self._trained.program_at(theta)
        passed = ((one, self._pass(program, one, keep=False).values) for one in self._records)
        return np.concatenate([self._away(record, values).T.ravel() for record, values in passed])

    @property
    def variances(self) -> NDArray[np.float64]:
        """Variance of each target where it counts, over the square of its error, shape ``(n_targets,)``."""
        own = self._by_target([record.target for record in self._records])
        found = [
            np.var(one) / error**2 if len(one) else 0.0 for one, error in zip(own, self.errors.values(), strict=True)
        ]
        return np.array(found, dtype=np.float64)

    def mean_squares(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean squared error of each target's free run where it counts, over the square of its error.

        Args:
            theta: Flat parameters.

        Returns:
            Shape ``(n_targets,)``.
        """
        program = self._trained.program_at(theta)
        away = list(self._each(lambda one: self._away(one, self._pass(program, one, keep=False).values)))
        with np.errstate(over="ignore", invalid="ignore"):
            found = [np.mean(one**2) if len(one) else 0.0 for one in self._by_target(away)]
        return np.array(found, dtype=np.float64)

    def _by_target(self, columns: Sequence[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
        """What counts of each target, record after record."""
        counts = [np.ones(r.target.shape) if r.root_weights is None else r.root_weights for r in self._records]
        parts = list(zip(columns, counts, strict=True))
        return [np.concatenate([own[some[:, j] > 0.0, j] for own, some in parts]) for j in range(len(self.errors))]

    @property
    def _columns(self) -> list[int]:
        return [self.cascade.wiring.channels.index(name) for name in self.errors]

    @property
    def _outputs(self) -> list[int]:
        """Positions of the targets among the outputs of the members that are run; -1 for one that never changes."""
        written = list(self._trained.program.output_channel)
        return [written.index(column) if column in written else -1 for column in self._columns]

    def _in_windows(self, trace: Trace) -> list[Record]:
        """The record of a trace; or its windows, each but the first begun with what is measured."""
        whole = self._record(trace)
        if self.window is None:
            return [whole]
        known = whole.values.copy()
        if self.measured is not None:  # it holds nothing else
            return list(windows_of(whole, known, self.window, self._trained.depth))
        for column, name in enumerate(self.cascade.wiring.channels):
            if name in trace.channel_names:
                seen, own = trace.usable_of([name]), known[self._trained.depth :, column]
                own[seen] = trace[name][seen]
        return list(windows_of(whole, known, self.window, self._trained.depth))

    def _record(self, trace: Trace) -> Record:
        cascade = self.cascade
        inputs, target = trace.columns(cascade.inputs), trace.columns(list(self.errors))
        rest = self.begins(trace)
        if self.measured is not None:
            return self._begun(self.measured(trace))
        run = cascade.simulate_trace(trace, rest=rest)
        counts = trace.counted(cascade.inputs, self.errors)
        rows = self._rows(target, counts)
        return Record(
            values=np.concatenate([np.tile(cascade.levels(inputs[0], rest), (self._trained.depth, 1)), run.values]),
            rows=rows,
            target=np.asfortranarray(target[rows]),
            root_weights=_roots(counts[rows]),
        )

    def _begun(self, experiment: Experiment) -> Record:
        """A record whose first samples are measured, the oldest held where the lags reach further back."""
        names = (*self.cascade.inputs, *self.errors)
        order = [names.index(name) for name in self.cascade.wiring.channels]
        depth = self._trained.depth
        before = np.concatenate(experiment.history.padded(depth), axis=1)
        values = np.concatenate([before, np.concatenate([experiment.inputs, experiment.output], axis=1)])[:, order]
        counts = np.ones(experiment.output.shape, dtype=np.bool_)
        if experiment.each is not None:
            counts = experiment.each.astype(np.bool_)
        elif experiment.usable is not None:
            counts &= experiment.usable[:, np.newaxis]
        rows = self._rows(experiment.output, counts)
        return Record(
            values=values,
            rows=rows,
            target=np.asfortranarray(experiment.output[rows]),
            root_weights=_roots(counts[rows]),
        )

    def _rows(self, target: NDArray[np.float64], counts: NDArray[np.bool_]) -> NDArray[np.int64]:
        """The rows that count; where a target is masked, it is not known whether it moves."""
        over = np.where(counts, target / np.array(list(self.errors.values())), np.nan)
        return counted_rows(over, self.stride, self.moves)

    def _each(self, work: Callable[[Record], _Found]) -> Iterator[_Found]:
        def quietly(record: Record) -> _Found:
            # A start that runs away has sensitivities beyond the largest number; its step is then not taken.
            with np.errstate(over="ignore", invalid="ignore"):
                return work(record)

        if self.workers <= 1 or len(self._records) <= 1:
            yield from map(quietly, self._records)
            return
        with ThreadPoolExecutor(self.workers) as pool:  # results come in the order of the records: sums do not depend
            yield from pool.map(quietly, self._records)  # on which thread was first

    def _pass(self, program: Program, record: Record, *, keep: bool) -> _Passed:
        depth = self._trained.depth
        n = len(record.values) - depth
        passed = _Passed(
            record.values.copy(),
            np.empty((n, int(program.neurons.sum()))) if keep else np.empty((0, 0)),
            np.empty((n, len(program.output_channel)), dtype=np.int8),
        )
        kernel.go_on(*self._trained.plan, program.numbers, depth, passed.values, passed.kept, passed.held)
        return passed

    def _away(self, record: Record, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Residuals over their errors where they count, unweighted, shape ``(n_counted, n_targets)``."""
        ran, found = values[self._trained.depth :], np.empty_like(record.target)
        for j, column in enumerate(self._columns):  # column by column, as they stand in memory: five times as fast
            now = ran[:, column] if len(record.rows) == len(ran) else ran[record.rows, column]
            np.subtract(now, record.target[:, j], out=found[:, j])
        found /= list(self.errors.values())
        return found

    def _residual(self, record: Record, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Weighted residuals over their errors, shape ``(n_counted, n_targets)``."""
        residual = self._away(record, values)
        return residual if record.root_weights is None else residual * record.root_weights

    def _normal_equations(
        self, program: Program, record: Record, n: int
    ) -> tuple[float, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        passed = self._pass(program, record, keep=True)
        residual = self._residual(record, passed.values)
        loss, weights = counted(residual, self.robust_scale, _counted(record))
        gradient, matrix = np.zeros(n), np.zeros((n, n))
        per_error, waiting = self._per_error(program), tuple[list[_Rows], ...]([] for _ in self.errors)
        # The matrix is summed in the first target's measure: to multiply it is to go through memory once more.
        measure, gathered = weights * per_error**2, 0
        for rows, blocks in self._blocks(program, record, passed, n):
            gathered += rows.stop - rows.start
            wait = gathered < min(GATHERED, n) and rows.stop < len(record.rows)
            for j, (moving, block) in enumerate(blocks):
                roots = None if record.root_weights is None else record.root_weights[rows, j][moving]
                weighted, errors = self._counting(block, residual[rows, j][moving], roots, per_error[j])
                waiting[j].append((weighted.copy() if wait else weighted, errors))
            if wait:
                continue
            gathered = 0
            for j, held in enumerate(waiting):
                weighted, errors = (
                    np.concatenate(some) if len(some) > 1 else some[0] for some in zip(*held, strict=True)
                )
                reach = weighted.shape[1]
                gradient[:reach] += measure[j] / per_error[j] * (weighted.T @ errors)
                # NumPy sees that both factors are one array and calls syrk, half the flops of a general product; unlike
                # SciPy's wrapper of it, it lets the other threads run meanwhile.
                square = weighted.T @ weighted
                if measure[j] != measure[0]:
                    square *= measure[j] / measure[0]
                matrix[:reach, :reach] += square
                del square  # so that the next one stands where it stood: fresh memory is slower than the sum itself
                held.clear()
        matrix *= measure[0]
        return loss, gradient, matrix, residual

    def _per_error(self, program: Program) -> NDArray[np.float64]:
        """What a change of each target by one in its scaled numbers is over its error, shape ``(n_targets,)``."""
        scales = [1.0 if output < 0 else program.output_scale[output] for output in self._outputs]
        return np.array(scales) / list(self.errors.values())

    def _counting(
        self,
        block: NDArray[np.float64],
        residual: NDArray[np.float64],
        roots: NDArray[np.float64] | None,
        per_error: float,
    ) -> _Rows:
        """Rows of a target's Jacobian as they count, and their residuals; what counts as it is is not copied.

        Args:
            block: The rows, in the target's scaled numbers, shape ``(n_rows, n_parameters)``.
            residual: Weighted residuals, shape ``(n_rows,)``.
            roots: Square roots of the samples' weights, shape ``(n_rows,)``; ``None`` where all count alike.
            per_error: The target's scale over its error.
        """
        weighted = block if roots is None else block * roots[:, None]
        if np.isinf(self._longest):
            return weighted, residual
        bounded = leverage_roots(weighted, self._longest / per_error)
        return weighted * bounded[:, None], residual * bounded

    def _median_row(self) -> float:
        """Median length of the rows of the Jacobian that move, at the start."""
        program, n = self._trained.program, len(self.theta)
        per_error = self._per_error(program)

        def one(record: Record) -> NDArray[np.float64]:
            blocks = self._blocks(program, record, self._pass(program, record, keep=True), n)
            return np.concatenate(
                [
                    np.linalg.norm(block, axis=1) * per_error[j]
                    for _, some in blocks
                    for j, (_, block) in enumerate(some)
                ]
            )

        lengths = np.concatenate(list(self._each(one)))
        return float(np.median(lengths[lengths > 0.0])) if lengths.any() else 1.0

    def _blocks(
        self, program: Program, record: Record, passed: _Passed, n: int
    ) -> Iterator[tuple[slice, list[_Moving]]]:
        """Block by block which counted rows of every target's Jacobian move, and these, in its scaled numbers.

        They go up to where all are zero, and stand there until the next block.
        """
        trained, samples = self._trained, len(record.values) - self._trained.depth
        kept = 1 + trained.carry
        size = min(MOST, max(BLOCK, 1 << (ALIVE // max(1, n * len(self.errors))).bit_length() - 1))
        kept[[output for output in self._outputs if output >= 0]] += size - 1
        room, outputs, at = rows_for(kept, n), self._outputs, 0
        every = len(record.rows) == samples
        for first in range(0, samples, size):
            rows = min(size, samples - first)
            sensitivities(
                program, trained.depth, first, rows, passed.values, passed.kept, passed.held,
                trained.own_first, trained.extent, trained.source, room,
            )  # fmt: skip
            own_rows = (first, first + rows) if every else np.searchsorted(record.rows, (first, first + rows))
            picked = record.rows[slice(*own_rows)]
            blocks: list[_Moving] = []
            for output in outputs:
                if output < 0:
                    blocks.append((np.zeros(len(picked), dtype=np.bool_), np.zeros((0, 0))))
                    continue
                reach, own = trained.extent[output], room.first[output] + (first & room.mask[output])
                # A block stands in one piece: both its length and that of the room are powers of two.
                if len(picked) == rows and room.moves[own : own + rows].all():
                    blocks.append((_EVERY, room.J[own : own + rows, :reach]))
                    continue
                places = room.first[output] + (picked & room.mask[output])
                moving = room.moves[places]
                blocks.append((moving, room.J[places[moving], :reach]))
            yield slice(at, at + len(picked)), blocks
            at += len(picked)


def _roots(counts: NDArray[np.bool_]) -> NDArray[np.float64] | None:
    """Weights of the rows for each target; nothing where all count."""
    return None if counts.all() else np.asfortranarray(counts, dtype=np.float64)


def _counted(record: Record) -> NDArray[np.int64]:
    """Rows that count for each target, shape ``(n_targets,)``."""
    if record.root_weights is None:
        return np.full(record.target.shape[1], len(record.rows), dtype=np.int64)
    return np.asarray(np.count_nonzero(record.root_weights, axis=0), dtype=np.int64)
