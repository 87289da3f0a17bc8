r"""Residuals of what runs over records, and the normal equations of their squares: of one network and of a whole.

A network is a program of one member in its scaled numbers (``provider.py``), a whole is one of several in the units of
its channels (``joint_provider.py``). With :math:`e_{j,t}` the residual of target :math:`j`, over the error that counts
as one, and :math:`J_{j,t}` its row of the Jacobian (``sysid/kernels/cascade_sensitivities.py``), a Gauss-Newton method
needs

.. math:: \sum_{j,t} w_{j,t} e_{j,t} J_{j,t}, \qquad \sum_{j,t} w_{j,t} J_{j,t}^T J_{j,t}

and no more: rows live a block at a time, and memory does not grow with the length of the records.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.correlation import correlation_time
from sysid.estimation.least_squares.leverage import leverage_roots
from sysid.estimation.least_squares.provider import AbstractProvider, Linearisation
from sysid.estimation.least_squares.robust_loss import counted
from sysid.estimation.networks.joint_record import Record
from sysid.estimation.networks.trained_members import TrainedMembers
from sysid.kernels import cascade as kernel
from sysid.kernels.cascade_layout import Program
from sysid.kernels.cascade_sensitivities import rows_for, sensitivities
from sysid.models.lagged.lagged_form import NOT_KEPT

Array = NDArray[np.float64]
_Found = TypeVar("_Found")
_Rows = tuple[NDArray[Any], Array]
_Moving = tuple[NDArray[np.bool_] | slice, Array]
_EVERY = slice(None)
"""All rows of a block: they are taken as they stand."""

LEAST, BLOCK = 256, 1024
"""Rows of each target's Jacobian that are alive at a time at least, and at most: powers of two. 1,024 rows of 300
parameters are 2.4 MB, which the second-level cache holds until the normal equations have used them."""

ALIVE = 256 * 1500 * 4
"""Numbers of all targets' rows together up to which there are more than the least: 12 MB."""

GATHERED = 1024
"""Rows at most that are gathered before they are squared, where there are fewer than parameters: adding a matrix of
1,500 by 1,500 costs as much as some 500 rows."""


class Passed(NamedTuple):
    """What one pass over a record leaves for the sensitivities."""

    values: Array
    kept: Array
    held: NDArray[np.int8]


@dataclass(frozen=True, kw_only=True, eq=False)
class ProgramProvider(AbstractProvider):
    """Residuals of the free run of a program over its targets, as a function of its trained parameters.

    Who derives from it fills the fields below.

    Args:
        workers: Records that are worked on at the same time.
        robust_scale: Root mean squared residual of a trace from which on it counts by its logarithm
            (``robust_scale.py``); infinity for plain squares.
    """

    workers: int = field(default=1, init=False)
    robust_scale: float = field(default=np.inf, init=False)
    n_samples: int = field(init=False)
    _trained: TrainedMembers = field(init=False, repr=False)
    _records: tuple[Record, ...] = field(init=False, repr=False)
    _columns: tuple[int, ...] = field(init=False, repr=False)
    """Of each target the channel of the program that is it."""
    _errors: Array = field(init=False, repr=False)
    """Of each target the error that counts as one, in the numbers of its channel."""
    _longest: float = field(default=np.inf, init=False, repr=False)
    """Length of a row from which on it counts less; infinity for all alike."""

    def _fill(self, trained: TrainedMembers, records: Sequence[Record], columns: Sequence[int], errors: Array) -> None:
        """Put the fields that every method here reads."""
        put = object.__setattr__
        put(self, "_trained", trained)
        put(self, "_records", tuple(records))
        put(self, "_columns", tuple(columns))
        put(self, "_errors", errors)
        put(self, "n_samples", int(sum(record.counted.sum() for record in records)))

    def loss(self, theta: Array) -> float:
        """Half the weighted sum of squared residuals; see the base class."""
        numbers = self._trained.numbers_at(theta)

        def one(record: Record) -> float:
            residual = self._weighted(record, self._pass(numbers, record, keep=False).values)
            return counted(residual, self.robust_scale, record.counted, self._units)[0]

        total = sum(self._each(one))
        return total if math.isfinite(total) else math.inf

    def linearise(self, theta: Array, *, correlation: bool = True) -> Linearisation:
        """Loss, gradient and Gauss-Newton matrix; see the base class."""
        program = self._trained.program_at(theta)
        found = self._each(lambda record: self._normal_equations(program, record, len(theta)))
        with np.errstate(over="ignore", invalid="ignore"):  # infinities of two records may cancel
            loss, gradient, matrix, residual = next(found)
            residuals = [residual]
            for own, part, square, residual in found:
                loss += own
                gradient += part
                matrix += square
                residuals.append(residual)
            news = self._news(residuals) if correlation else np.nan
        return Linearisation(loss=loss, gradient=gradient, gauss_newton=matrix, correlation_time=news)

    def _news(self, residuals: Sequence[Array]) -> float:
        """The correlation time of the residuals of all records, over their targets and by their lengths."""
        times = [len(one) * float(np.mean([correlation_time(column) for column in one.T])) for one in residuals]
        return sum(times) / sum(map(len, residuals))

    def jacobian(self, theta: Array) -> Array:
        """The whole Jacobian of the targets over their errors, unweighted: for each record target after target.

        Args:
            theta: Flat parameters.

        Returns:
            Shape ``(n_records x n_targets x n_counted_samples, n_parameters)``.
        """
        program = self._trained.program_at(theta)
        found: list[Array] = []
        for record in self._records:
            passed = self._pass(program.numbers, record, keep=True)
            rows = np.zeros((len(self._columns), len(record.rows), len(theta)))
            for own, blocks in self._blocks(program, record, passed, len(theta)):
                for j, (moving, block) in enumerate(blocks):
                    rows[j, own, : block.shape[1]][moving] = self._per_error(program)[j] * block
            found += list(rows)
        return np.concatenate(found)

    def residuals(self, theta: Array) -> Array:
        """The residuals over their errors, unweighted, in the order of :meth:`jacobian`'s rows.

        Args:
            theta: Flat parameters.

        Returns:
            Shape ``(n_records x n_targets x n_counted_samples,)``.
        """
        return np.concatenate([one.T.ravel() for one in self._all_away(theta)]) if self._records else np.empty(0)

    def _all_away(self, theta: Array) -> list[Array]:
        """Of each record the residuals over their errors, unweighted."""
        numbers = self._trained.numbers_at(theta)

        def one(record: Record) -> Array:
            return self._away(record, self._pass(numbers, record, keep=False).values) / self._errors

        return list(self._each(one))

    @property
    def _outputs(self) -> list[int]:
        """Positions of the targets among the outputs of the members that are run; -1 for one that never changes."""
        written = list(self._trained.program.output_channel)
        return [written.index(column) if column in written else -1 for column in self._columns]

    @cached_property
    def _units(self) -> tuple[float, ...]:
        """What of each target's squares counts as one."""
        return tuple(float(error) ** 2 for error in self._errors)

    def _each(self, work: Callable[[Record], _Found]) -> Iterator[_Found]:
        def quietly(record: Record) -> _Found:
            # A start that runs away has sensitivities beyond the largest number; its step is then not taken.
            with np.errstate(over="ignore", invalid="ignore"):
                return work(record)

        if self.workers <= 1 or len(self._records) <= 1:
            return map(quietly, self._records)
        return self._side_by_side(quietly)

    def _side_by_side(self, work: Callable[[Record], _Found]) -> Iterator[_Found]:
        with ThreadPoolExecutor(self.workers) as pool:  # results come in the order of the records: sums do not depend
            yield from pool.map(work, self._records)  # on which thread was first

    def _pass(self, numbers: Array, record: Record, *, keep: bool) -> Passed:
        """One run, into a copy: starts that train side by side share the records."""
        trained = self._trained
        n, program = len(record.values) - trained.depth, trained.program
        kept = np.empty((n, int(program.neurons.sum()))) if keep else NOT_KEPT
        passed = Passed(record.values.copy(), kept, np.empty((n, len(program.output_channel)), dtype=np.int8))
        kernel.go_on(*trained.plan, numbers, trained.depth, passed.values, kept, passed.held)
        return passed

    def _away(self, record: Record, values: Array) -> Array:
        """Residuals where they count, unweighted, in their channels' numbers, shape ``(n_counted, n_targets)``."""
        ran, every = values[self._trained.depth :], len(record.rows) == len(values) - self._trained.depth
        found = np.empty_like(record.target)
        for j, column in enumerate(self._columns):  # column by column, as they stand in memory: five times as fast
            now = ran[:, column] if every else ran[record.rows, column]
            np.subtract(now, record.target[:, j], out=found[:, j])
        return found

    def _weighted(self, record: Record, values: Array) -> Array:
        """The same, weighted."""
        residual = self._away(record, values)
        return residual if record.root_weights is None else residual * record.root_weights

    def _normal_equations(self, program: Program, record: Record, n: int) -> tuple[float, Array, Array, Array]:
        """Loss, gradient and matrix of one record, and the residuals by which their correlation is judged."""
        passed = self._pass(program.numbers, record, keep=True)
        residual = self._weighted(record, passed.values)
        loss, weights = counted(residual, self.robust_scale, record.counted, self._units)
        gradient, matrix = np.zeros(n), np.zeros((n, n))
        per_error, waiting = self._per_error(program), tuple[list[_Rows], ...]([] for _ in self._columns)
        # The matrix is summed in the first target's measure: to multiply it is to go through memory once more.
        measure, toward, gathered = (weights * per_error**2).tolist(), (weights * per_error / self._errors).tolist(), 0
        for rows, blocks in self._blocks(program, record, passed, n):
            gathered += rows.stop - rows.start
            wait = gathered < min(GATHERED, n) and rows.stop < len(record.rows)
            for j, (moving, block) in enumerate(blocks):
                roots = None if record.root_weights is None else record.root_weights[rows, j][moving]
                own = residual[rows, j] if moving is _EVERY else residual[rows, j][moving]
                weighted, away = self._counting(block, own, roots, per_error[j])
                waiting[j].append((weighted.copy() if wait else weighted, away))
            if wait:
                continue
            gathered = 0
            for j, some in enumerate(waiting):
                if len(some) > 1:
                    some[:] = [(np.concatenate([one for one, _ in some]), np.concatenate([one for _, one in some]))]
                weighted, away = some[0]
                reach = weighted.shape[1]
                gradient[:reach] += toward[j] * (weighted.T @ away)
                # NumPy sees that both factors are one array and calls syrk, half the flops of a general product; unlike
                # SciPy's wrapper of it, it lets the other threads run meanwhile.
                square = weighted.T @ weighted
                if measure[j] != measure[0]:
                    square *= measure[j] / measure[0]
                matrix[:reach, :reach] += square
                del square  # so that the next one stands where it stood: fresh memory is slower than the sum itself
                some.clear()
        if measure[0] != 1.0:
            matrix *= measure[0]
        judged = residual if record.whole is None else self._weighted(record.whole, passed.values)
        return loss, gradient, matrix, judged

    def _per_error(self, program: Program) -> Array:
        """What a change of each target by one in its scaled numbers is over its error, shape ``(n_targets,)``."""
        scales = [1.0 if output < 0 else program.output_scale[output] for output in self._outputs]
        return np.array(scales) / self._errors

    def _counting(self, block: Array, residual: Array, roots: Array | None, per_error: float) -> _Rows:
        """Rows of a target's Jacobian as they count, and their residuals; what counts as it is is not copied.

        Args:
            block: The rows, in the target's scaled numbers, shape ``(n_rows, n_parameters)``.
            residual: Weighted residuals, shape ``(n_rows,)``.
            roots: Square roots of the samples' weights, shape ``(n_rows,)``; ``None`` where all count alike.
            per_error: The target's scale over its error.
        """
        weighted = block if roots is None else block * roots[:, None]
        if math.isinf(self._longest):
            return weighted, residual
        bounded = leverage_roots(weighted, self._longest / per_error)
        return weighted * bounded[:, None], residual * bounded

    def _blocks(
        self, program: Program, record: Record, passed: Passed, n: int
    ) -> Iterator[tuple[slice, list[_Moving]]]:
        """Block by block which counted rows of every target's Jacobian move, and these, in its scaled numbers.

        They go up to where all are zero, and stand there until the next block.
        """
        trained, samples = self._trained, len(record.values) - self._trained.depth
        kept, outputs, at = 1 + trained.carry, self._outputs, 0
        size = min(BLOCK, max(LEAST, 1 << (ALIVE // max(1, n * len(outputs))).bit_length() - 1))
        kept[[output for output in outputs if output >= 0]] += size - 1
        room, every = rows_for(kept, n), len(record.rows) == samples
        reaches, begins, masks = (part.tolist() for part in (trained.extent, room.first, room.mask))
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
                reach, own = reaches[output], begins[output] + (first & masks[output])
                # A block stands in one piece: both its length and that of the room are powers of two.
                if len(picked) == rows and room.moves[own : own + rows].all():
                    blocks.append((_EVERY, room.J[own : own + rows, :reach]))
                    continue
                places = begins[output] + (picked & masks[output])
                moving = room.moves[places]
                blocks.append((moving, room.J[places[moving], :reach]))
            yield slice(at, at + len(picked)), blocks
            at += len(picked)
