"""Residuals and Jacobians of a whole cascade: several members trained together through each other, in free run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from collections.abc import Mapping as Dict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError
from sysid.estimation.experiment import Experiment
from sysid.estimation.least_squares.correlation import correlation_time
from sysid.estimation.least_squares.counted_rows import counted_rows
from sysid.estimation.least_squares.leverage import leverage_roots
from sysid.estimation.least_squares.provider import AbstractProvider, Linearisation
from sysid.estimation.least_squares.robust_loss import counted
from sysid.estimation.networks.trained_members import TrainedMembers
from sysid.kernels import cascade as kernel
from sysid.kernels.cascade_layout import Program
from sysid.kernels.cascade_sensitivities import rows_for, sensitivities
from sysid.models import Cascade, Member
from sysid.traces import Trace

_Found = TypeVar("_Found")

BLOCK = 256
"""Rows of each target's Jacobian that are alive at a time: 256 rows of 1,500 parameters for four outputs are 12 MB."""


GATHERED = 1024
"""Rows that are gathered before they are squared: adding a matrix of 1,500 by 1,500 costs as much as some 500 rows."""


@dataclass(frozen=True, eq=False)
class _Record:
    """One trace: every channel in a first run, and its level at rest; the targets at the samples that count.

    Inputs, and outputs of members that come before any trained one, keep the values of the first run. The first
    ``past`` rows are measured and not run; where there are none, the levels stand before the first sample.
    """

    values: NDArray[np.float64]
    levels: NDArray[np.float64]
    rows: NDArray[np.int64]
    target: NDArray[np.float64]
    root_weights: NDArray[np.float64] | None
    past: int = 0


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
    n_samples: int = field(init=False)
    _trained: TrainedMembers = field(init=False, repr=False)
    _records: tuple[_Record, ...] = field(init=False, repr=False)
    _longest: float = field(init=False, repr=False)

    def __post_init__(self) -> None:
        cascade, put = self.cascade, object.__setattr__
        put(self, "traces", tuple(self.traces))
        strangers = [n for n in (*self.errors, *(self.trained or ())) if n not in cascade.outputs]
        if strangers or not self.errors:
            raise ChannelError(strangers or ["(none)"], cascade.outputs, where="targets and trained members")
        put(self, "_trained", TrainedMembers.of(cascade, self.trained))
        put(self, "_records", tuple(self._record(trace) for trace in self.traces))
        counted = sum(_counted(record) for record in self._records)
        put(self, "n_samples", counted * len(self.errors))
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

        def one(record: _Record) -> float:
            passed = self._pass(program, record, keep=False)
            return counted(self._residual(record, passed.values), self.robust_scale, _counted(record))[0]

        total = sum(self._each(one))
        return total if np.isfinite(total) else np.inf

    def linearise(self, theta: NDArray[np.float64]) -> Linearisation:
        """Loss, gradient and Gauss-Newton matrix; see the base class."""
        program = self._trained.program_at(theta)
        n = len(theta)
        gradient, matrix, loss, correlated, rows = np.zeros(n), np.zeros((n, n)), 0.0, 0.0, 0

        def one(record: _Record) -> tuple[float, NDArray[np.float64], NDArray[np.float64], int, float]:
            own, part, square, residual = self._normal_equations(program, record, n)
            return own, part, square, len(residual), float(np.mean([correlation_time(column) for column in residual.T]))

        with np.errstate(invalid="ignore"):  # infinities of two records may cancel
            for own, part, square, length, correlation in self._each(one):
                loss += own
                gradient += part
                matrix += square
                correlated += length * correlation
                rows += length
        return Linearisation(loss=loss, gradient=gradient, gauss_newton=matrix, correlation_time=correlated / rows)

    def jacobian(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """The whole Jacobian of the targets over their errors, unweighted: for each record target after target.

        Args:
            theta: Flat parameters.

        Returns:
            Shape ``(n_records x n_targets x n_counted_samples, n_parameters)``.
        """
        program, found = self._trained.program_at(theta), []
        for record in self._records:
            passed = self._pass(program, record, keep=True)
            columns: list[list[NDArray[np.float64]]] = [[] for _ in self.errors]
            for _, blocks in self._blocks(program, record, passed, len(theta)):
                for column, block in zip(columns, blocks, strict=True):
                    column.append(np.pad(block, ((0, 0), (0, len(theta) - block.shape[1]))))
            found += [np.concatenate(column) for column in columns]
        return np.concatenate(found)

    def residuals(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """The residuals over their errors, unweighted, in the order of :meth:`jacobian`'s rows.

        Args:
            theta: Flat parameters.

        Returns:
            Shape ``(n_records x n_targets x n_counted_samples,)``.
        """
        program, sizes = self._trained.program_at(theta), np.array(list(self.errors.values()))
        found = []
        for record in self._records:
            values = self._pass(program, record, keep=False).values
            found.append(((values[record.rows][:, self._columns] - record.target) / sizes).T.ravel())
        return np.concatenate(found)

    @property
    def _columns(self) -> list[int]:
        return [self.cascade.wiring.channels.index(name) for name in self.errors]

    @property
    def _outputs(self) -> list[int]:
        """Positions of the targets among the outputs of the members that are run; -1 for one that never changes."""
        written = list(self._trained.program.output_channel)
        return [written.index(column) if column in written else -1 for column in self._columns]

    def _record(self, trace: Trace) -> _Record:
        cascade = self.cascade
        inputs, target = trace.columns(cascade.inputs), trace.columns(list(self.errors))
        rest = self.begins(trace)
        if self.measured is not None:
            return self._begun(self.measured(trace))
        run = cascade.simulate_trace(trace, rest=rest)
        rows = counted_rows(target / np.array(list(self.errors.values())), self.stride, self.moves)
        usable = trace.usable_samples[rows]
        return _Record(
            values=run.values,
            levels=cascade.levels(inputs[0], rest),
            rows=rows,
            target=target[rows],
            root_weights=None if usable.all() else usable.astype(np.float64),
        )

    def _begun(self, experiment: Experiment) -> _Record:
        """A record whose first samples are measured, the oldest held where the lags reach further back."""
        names = (*self.cascade.inputs, *self.errors)
        order = [names.index(name) for name in self.cascade.wiring.channels]
        depth = self._trained.depth
        before = np.concatenate(experiment.history.padded(depth), axis=1)
        values = np.concatenate([before, np.concatenate([experiment.inputs, experiment.output], axis=1)])[:, order]
        rows = counted_rows(experiment.output / np.array(list(self.errors.values())), self.stride, self.moves)
        usable = np.ones(len(rows), dtype=np.bool_) if experiment.usable is None else experiment.usable[rows]
        return _Record(
            values=values,
            levels=values[0],
            rows=rows + depth,
            target=experiment.output[rows],
            root_weights=None if usable.all() else usable.astype(np.float64),
            past=depth,
        )

    def _each(self, work: Callable[[_Record], _Found]) -> Iterator[_Found]:
        def quietly(record: _Record) -> _Found:
            # A start that runs away has sensitivities beyond the largest number; its step is then not taken.
            with np.errstate(over="ignore", invalid="ignore"):
                return work(record)

        if self.workers <= 1 or len(self._records) <= 1:
            yield from map(quietly, self._records)
            return
        with ThreadPoolExecutor(self.workers) as pool:  # results come in the order of the records: sums do not depend
            yield from pool.map(quietly, self._records)  # on which thread was first

    def _pass(self, program: Program, record: _Record, *, keep: bool) -> _Passed:
        n = len(record.values)
        passed = _Passed(
            record.values.copy(),
            np.empty((n, int(program.neurons.sum()))) if keep else np.empty((0, 0)),
            np.empty((n, len(program.output_channel)), dtype=np.int8),
        )
        past = record.past
        if past:
            kernel.go_on(program, past, passed.values, passed.kept[past:], passed.held[past:])
        else:
            kernel.run(program, self._trained.depth, record.levels, passed.values, passed.kept, passed.held)
        return passed

    def _residual(self, record: _Record, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Weighted residuals over their errors, shape ``(n_counted, n_targets)``."""
        sizes = np.array(list(self.errors.values()))
        residual: NDArray[np.float64] = (values[record.rows][:, self._columns] - record.target) / sizes
        return residual if record.root_weights is None else residual * record.root_weights[:, None]

    def _normal_equations(
        self, program: Program, record: _Record, n: int
    ) -> tuple[float, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        passed = self._pass(program, record, keep=True)
        residual = self._residual(record, passed.values)
        loss, weights = counted(residual, self.robust_scale, _counted(record))
        gradient, matrix = np.zeros(n), np.zeros((n, n))
        waiting: list[list[tuple[NDArray[np.float64], NDArray[np.float64]]]] = [[] for _ in self.errors]
        gathered = 0
        for rows, blocks in self._blocks(program, record, passed, n):
            roots = None if record.root_weights is None else record.root_weights[rows]
            for j, (held, block) in enumerate(zip(waiting, blocks, strict=True)):
                held.append(self._counting(block, residual[rows, j], roots))
            gathered += rows.stop - rows.start
            if gathered < GATHERED and rows.stop < len(record.rows):
                continue
            gathered = 0
            for j, held in enumerate(waiting):
                weighted, errors = (
                    np.concatenate(some) if len(some) > 1 else some[0] for some in zip(*held, strict=True)
                )
                reach = weighted.shape[1]
                gradient[:reach] += weights[j] * (weighted.T @ errors)
                matrix[:reach, :reach] += weights[j] * (weighted.T @ weighted)
                held.clear()
        return loss, gradient, matrix, residual

    def _counting(
        self, block: NDArray[np.float64], residual: NDArray[np.float64], roots: NDArray[np.float64] | None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Rows of a target's Jacobian as they count, and their residuals; what counts as it is is not copied.

        Args:
            block: The rows, over their error, shape ``(n_rows, n_parameters)``.
            residual: Weighted residuals, shape ``(n_rows,)``.
            roots: Square roots of the samples' weights, shape ``(n_rows,)``; ``None`` where all count alike.
        """
        weighted = block if roots is None else block * roots[:, None]
        moving = weighted.any(axis=1)  # a target that is held adds nothing
        if not moving.all():
            weighted, residual = weighted[moving], residual[moving]
        if np.isinf(self._longest):
            return weighted, residual
        bounded = leverage_roots(weighted, self._longest)
        return weighted * bounded[:, None], residual * bounded

    def _median_row(self) -> float:
        """Median length of the rows of the Jacobian that move, at the start."""
        theta = self.theta

        def one(record: _Record) -> NDArray[np.float64]:
            passed = self._pass(self._trained.program, record, keep=True)
            blocks = self._blocks(self._trained.program, record, passed, len(theta))
            return np.concatenate([np.linalg.norm(block, axis=1) for _, some in blocks for block in some])

        lengths = np.concatenate(list(self._each(one)))
        return float(np.median(lengths[lengths > 0.0])) if lengths.any() else 1.0

    def _blocks(
        self, program: Program, record: _Record, passed: _Passed, n: int
    ) -> Iterator[tuple[slice, list[NDArray[np.float64]]]]:
        """Block by block the counted rows of every target's Jacobian over its error, up to where they are zero."""
        trained, samples = self._trained, len(record.values)
        kept = 1 + trained.carry
        kept[[output for output in self._outputs if output >= 0]] += BLOCK - 1
        room = rows_for(kept, n)
        at = 0
        for first in range(record.past, samples, BLOCK):
            rows = min(BLOCK, samples - first)
            sensitivities(
                program, record.levels, first, rows, passed.values, passed.kept, passed.held,
                trained.own_first, trained.extent, trained.source, room,
            )  # fmt: skip
            picked = record.rows[slice(*np.searchsorted(record.rows, (first, first + rows)))]
            blocks = []
            for output, error in zip(self._outputs, self.errors.values(), strict=True):
                if output < 0:
                    blocks.append(np.zeros((len(picked), 0)))
                    continue
                places = room.first[output] + (picked & room.mask[output])
                block = room.J[places, : trained.extent[output]]
                block[~room.moves[places]] = 0.0
                block *= program.output_scale[output] / error
                blocks.append(block)
            yield slice(at, at + len(picked)), blocks
            at += len(picked)


def _counted(record: _Record) -> int:
    return len(record.rows) if record.root_weights is None else int(np.count_nonzero(record.root_weights))
