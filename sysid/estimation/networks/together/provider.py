"""Residuals and Jacobians of a whole cascade: several members trained together through each other, in free run."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError
from sysid.estimation.least_squares.counted_rows import counted_rows
from sysid.estimation.networks.joint_record import Record, windows_of
from sysid.estimation.networks.program_provider import ProgramProvider
from sysid.estimation.networks.trained_members import TrainedMembers
from sysid.models import Cascade, Member
from sysid.traces import Trace


@dataclass(frozen=True, kw_only=True, eq=False)
class CascadeProvider(ProgramProvider):
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
    window: int | None = None

    def __post_init__(self) -> None:
        cascade, put = self.cascade, object.__setattr__
        put(self, "traces", tuple(self.traces))
        strangers = [n for n in (*self.errors, *(self.trained or ())) if n not in cascade.outputs]
        if strangers or not self.errors:
            raise ChannelError(strangers or ["(none)"], cascade.outputs, where="targets and trained members")
        trained = TrainedMembers.of(cascade, self.trained)
        records = [part for trace in self.traces for part in self._in_windows(trace, trained.depth)]
        columns = [cascade.wiring.channels.index(name) for name in self.errors]
        self._fill(trained, records, columns, np.array(list(self.errors.values()), dtype=np.float64))
        if not np.isinf(self.leverage):
            put(self, "_longest", self.leverage * self._median_row())

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
        away = self._all_away(theta)
        with np.errstate(over="ignore", invalid="ignore"):
            found = [np.mean(one**2) if len(one) else 0.0 for one in self._by_target(away)]
        return np.array(found, dtype=np.float64)

    def _by_target(self, columns: Sequence[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
        """What counts of each target, record after record."""
        counts = [np.ones(r.target.shape) if r.root_weights is None else r.root_weights for r in self._records]
        parts = list(zip(columns, counts, strict=True))
        return [np.concatenate([own[some[:, j] > 0.0, j] for own, some in parts]) for j in range(len(self.errors))]

    def _in_windows(self, trace: Trace, depth: int) -> list[Record]:
        """The record of a trace; or its windows, each but the first begun with what is measured."""
        whole = self._record(trace, depth)
        if self.window is None:
            return [whole]
        known = whole.values.copy()
        for column, name in enumerate(self.cascade.wiring.channels):
            if name in trace.channel_names:
                seen, own = trace.usable_of([name]), known[depth:, column]
                own[seen] = trace[name][seen]
        return list(windows_of(whole, known, self.window, depth))

    def _record(self, trace: Trace, depth: int) -> Record:
        cascade = self.cascade
        inputs, target = trace.columns(cascade.inputs), trace.columns(list(self.errors))
        run = cascade.simulate_trace(trace)
        counts = trace.counted(cascade.inputs, self.errors)
        rows = self._rows(target, counts)
        return Record(
            values=np.concatenate([np.tile(cascade.levels(inputs[0]), (depth, 1)), run.values]),
            rows=rows,
            target=np.asfortranarray(target[rows]),
            root_weights=_roots(counts[rows]),
        )

    def _rows(self, target: NDArray[np.float64], counts: NDArray[np.bool_]) -> NDArray[np.int64]:
        """The rows that count; where a target is masked, it is not known whether it moves."""
        over = np.where(counts, target / np.array(list(self.errors.values())), np.nan)
        return counted_rows(over, self.stride, self.moves)

    def _news(self, residuals: Sequence[NDArray[np.float64]]) -> float:
        """See the base class; windows follow one another: one by one, each would take as long as its matrix."""
        return super()._news(residuals if self.window is None else [np.concatenate(residuals)])

    def _median_row(self) -> float:
        """Median length of the rows of the Jacobian that move, at the start."""
        program, n = self._trained.program, len(self.theta)
        per_error = self._per_error(program)

        def one(record: Record) -> NDArray[np.float64]:
            blocks = self._blocks(program, record, self._pass(program.numbers, record, keep=True), n)
            return np.concatenate(
                [
                    np.linalg.norm(block, axis=1) * per_error[j]
                    for _, some in blocks
                    for j, (_, block) in enumerate(some)
                ]
            )

        lengths = np.concatenate(list(self._each(one)))
        return float(np.median(lengths[lengths > 0.0])) if lengths.any() else 1.0


def _roots(counts: NDArray[np.bool_]) -> NDArray[np.float64] | None:
    """Weights of the rows for each target; nothing where all count."""
    return None if counts.all() else np.asfortranarray(counts, dtype=np.float64)
