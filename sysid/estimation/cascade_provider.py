"""Residuals and Jacobians of a whole cascade: several members trained together through each other, in free run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from collections.abc import Mapping as Dict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError, ConfigError
from sysid.estimation.correlation import correlation_time
from sysid.estimation.provider import AbstractProvider, Linearisation
from sysid.estimation.soft_margin import counted
from sysid.kernels import cascade as kernel
from sysid.kernels.cascade_sensitivities import sensitivities
from sysid.models import Cascade, Ends, Member, VectorNARXModel
from sysid.models.arx import ARXModel
from sysid.models.cascade_program import Part, program_of
from sysid.models.narx import NARXModel
from sysid.traces import Trace

_Found = TypeVar("_Found")

BLOCK = 256
"""Rows of each output's Jacobian that are alive at a time: 256 rows of 1,500 parameters for four outputs are 12 MB."""


GATHERED = 1024
"""Rows that are gathered before they are squared: adding a matrix of 1,500 by 1,500 costs as much as some 500 rows."""


@dataclass(frozen=True, eq=False)
class _Record:
    """One trace: every channel in a first run, and its level at rest; the targets at the samples that count.

    Inputs, and outputs of members that come before any trained one, keep the values of the first run.
    """

    values: NDArray[np.float64]
    levels: NDArray[np.float64]
    rows: NDArray[np.int64]
    target: NDArray[np.float64]
    root_weights: NDArray[np.float64] | None


@dataclass(frozen=True, eq=False)
class _Passed:
    """What one pass leaves for the sensitivities."""

    z: NDArray[np.float64]
    kept: NDArray[np.float64]
    held: NDArray[np.int8]


@dataclass(frozen=True, eq=False)
class _Tables:
    """Where sensitivities stand and how far they reach (see the kernel)."""

    own_first: NDArray[np.int64]
    extent: NDArray[np.int64]
    source: NDArray[np.int64]
    carry: int


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
        soft_margin: Root mean squared residual of a trace from which on it counts by its logarithm
            (``soft_margin.py``); infinity for plain squares.
        workers: Records that are worked on at the same time.

    Raises:
        ChannelError: If a trace lacks an input or a target, or a name is no output of the cascade.
        ConfigError: If a member that would have to pass on sensitivities cannot.
    """

    cascade: Cascade
    traces: tuple[Trace, ...]
    errors: Dict[str, float]
    trained: tuple[str, ...] | None = None
    stride: int = 1
    soft_margin: float = np.inf
    workers: int = 1
    n_samples: int = field(init=False)
    members: tuple[Member, ...] = field(init=False)
    """The trained members, in the order of the parameters."""
    _program: kernel.Program = field(init=False, repr=False)
    _depth: int = field(init=False, repr=False)
    _tables: _Tables = field(init=False, repr=False)
    _records: tuple[_Record, ...] = field(init=False, repr=False)
    _slices: tuple[tuple[slice, slice], ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        cascade, put = self.cascade, object.__setattr__
        put(self, "traces", tuple(self.traces))
        strangers = [n for n in (*self.errors, *(self.trained or ())) if n not in cascade.outputs]
        if strangers or not self.errors:
            raise ChannelError(strangers or ["(none)"], cascade.outputs, where="targets and trained members")
        run, trained = _to_run(cascade, self.trained)
        parts = [_part(model) for model in run]
        ends = [Ends.of(model) for model in run]
        put(self, "members", tuple(m for m, yes in zip(run, trained, strict=True) if yes))
        put(self, "_program", program_of(parts, ends, cascade.wiring.channels, cascade.limits))
        put(self, "_depth", max(part.lags.depth for part in parts))
        put(self, "_slices", _slices(parts, trained))
        put(self, "_tables", _tables(self._program, trained, [own for _, own in self._slices]))
        put(self, "_records", tuple(self._record(trace) for trace in self.traces))
        counted = sum(_counted(record) for record in self._records)
        put(self, "n_samples", counted * len(self.errors))

    @property
    def theta(self) -> NDArray[np.float64]:
        """The parameters that the trained members have, shape ``(n_parameters,)``."""
        return np.concatenate([self._program.theta[whole] for whole, _ in self._slices])

    def at(self, theta: NDArray[np.float64]) -> Cascade:
        """The cascade with these parameters.

        Args:
            theta: Flat parameters of the trained members.

        Returns:
            The cascade.
        """
        cascade = self.cascade
        for member, (_, own) in zip(self.members, self._slices, strict=True):
            cascade = cascade.with_member(with_theta(member, theta[own]))
        return cascade

    def loss(self, theta: NDArray[np.float64]) -> float:
        """Half the weighted sum of squared residuals; see the base class."""
        program = self._at(theta)

        def one(record: _Record) -> float:
            values, _ = self._pass(program, record, keep=False)
            return counted(self._residual(record, values), self.soft_margin, _counted(record))[0]

        total = sum(self._each(one))
        return total if np.isfinite(total) else np.inf

    def linearise(self, theta: NDArray[np.float64]) -> Linearisation:
        """Loss, gradient and Gauss-Newton matrix; see the base class."""
        program = self._at(theta)
        n = len(theta)
        gradient, matrix, loss, correlated, rows = np.zeros(n), np.zeros((n, n)), 0.0, 0.0, 0

        def one(record: _Record) -> tuple[float, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
            return self._normal_equations(program, record, n)

        for own, part, square, residual in self._each(one):
            loss += own
            gradient += part
            matrix += square
            correlated += len(residual) * float(np.mean([correlation_time(column) for column in residual.T]))
            rows += len(residual)
        return Linearisation(loss=loss, gradient=gradient, gauss_newton=matrix, correlation_time=correlated / rows)

    def jacobian(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """The whole Jacobian of the targets over their errors, unweighted: for each record target after target.

        Args:
            theta: Flat parameters.

        Returns:
            Shape ``(n_records x n_targets x n_counted_samples, n_parameters)``.
        """
        program, found = self._at(theta), []
        for record in self._records:
            _, passed = self._pass(program, record, keep=True)
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
        program, sizes = self._at(theta), np.array(list(self.errors.values()))
        found = []
        for record in self._records:
            values, _ = self._pass(program, record, keep=False)
            found.append(((values[record.rows][:, self._columns] - record.target) / sizes).T.ravel())
        return np.concatenate(found)

    @property
    def _columns(self) -> list[int]:
        return [self.cascade.wiring.channels.index(name) for name in self.errors]

    @property
    def _outputs(self) -> list[int]:
        """Positions of the targets among the outputs of the members that are run; -1 for one that never changes."""
        written = list(self._program.output_channel)
        return [written.index(column) if column in written else -1 for column in self._columns]

    def _record(self, trace: Trace) -> _Record:
        cascade = self.cascade
        inputs, target = trace.columns(cascade.inputs), trace.columns(list(self.errors))
        run = cascade.simulate_trace(trace)
        rows = np.arange(0, len(trace), self.stride)
        usable = trace.usable_samples[rows]
        return _Record(
            values=run.values,
            levels=cascade.levels(inputs[0]),
            rows=rows,
            target=target[rows],
            root_weights=None if usable.all() else usable.astype(np.float64),
        )

    def _each(self, work: Callable[[_Record], _Found]) -> Iterator[_Found]:
        if self.workers <= 1 or len(self._records) <= 1:
            yield from map(work, self._records)
            return
        with ThreadPoolExecutor(self.workers) as pool:  # results come in the order of the records: sums do not depend
            yield from pool.map(work, self._records)  # on which thread was first

    def _at(self, theta: NDArray[np.float64]) -> kernel.Program:
        whole = self._program.theta.copy()
        for place, own in self._slices:
            whole[place] = theta[own]
        return self._program._replace(theta=whole)

    def _pass(self, program: kernel.Program, record: _Record, *, keep: bool) -> tuple[NDArray[np.float64], _Passed]:
        n = len(record.values)
        values = record.values.copy()
        passed = _Passed(
            np.empty((self._depth + n, len(program.column_channel))),
            np.empty((n, int(program.neurons.sum()))) if keep else np.empty((0, 0)),
            np.empty((n, len(program.output_channel)), dtype=np.int8),
        )
        kernel.run(program, self._depth, record.levels, values, passed.z, passed.kept, passed.held)
        return values, passed

    def _residual(self, record: _Record, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Weighted residuals over their errors, shape ``(n_counted, n_targets)``."""
        sizes = np.array(list(self.errors.values()))
        residual: NDArray[np.float64] = (values[record.rows][:, self._columns] - record.target) / sizes
        return residual if record.root_weights is None else residual * record.root_weights[:, None]

    def _normal_equations(
        self, program: kernel.Program, record: _Record, n: int
    ) -> tuple[float, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        values, passed = self._pass(program, record, keep=True)
        residual = self._residual(record, values)
        loss, weights = counted(residual, self.soft_margin, _counted(record))
        gradient, matrix = np.zeros(n), np.zeros((n, n))
        waiting: list[list[NDArray[np.float64]]] = [[] for _ in self.errors]
        first = 0
        for rows, blocks in self._blocks(program, record, passed, n):
            for held, block in zip(waiting, blocks, strict=True):
                held.append(block if record.root_weights is None else block * record.root_weights[rows, None])
            if rows.stop - first < GATHERED and rows.stop < len(record.rows):
                continue
            for j, held in enumerate(waiting):
                weighted = np.concatenate(held)
                reach = weighted.shape[1]
                gradient[:reach] += weights[j] * (weighted.T @ residual[first : rows.stop, j])
                matrix[:reach, :reach] += weights[j] * (weighted.T @ weighted)
                held.clear()
            first = rows.stop
        return loss, gradient, matrix, residual

    def _blocks(
        self, program: kernel.Program, record: _Record, passed: _Passed, n: int
    ) -> Iterator[tuple[slice, list[NDArray[np.float64]]]]:
        """Block by block the counted rows of every target's Jacobian over its error, up to where they are zero."""
        tables, samples = self._tables, len(record.values)
        carry = tables.carry
        J = np.empty((len(program.output_channel), carry + BLOCK, n))
        at = 0
        for first in range(0, samples, BLOCK):
            rows = min(BLOCK, samples - first)
            if first:
                J[:, :carry] = J[:, BLOCK : BLOCK + carry]
            sensitivities(
                program, self._depth, first, rows, passed.z, passed.kept, passed.held,
                tables.own_first, tables.extent, tables.source, carry, J,
            )  # fmt: skip
            picked = np.arange(-first % self.stride, rows, self.stride) + carry
            blocks = []
            for output, error in zip(self._outputs, self.errors.values(), strict=True):
                if output < 0:
                    blocks.append(np.zeros((len(picked), 0)))
                    continue
                scale = program.column_scale[program.output_column[output]] / error
                blocks.append(J[output, picked, : tables.extent[output]] * scale)
            yield slice(at, at + len(picked)), blocks
            at += len(picked)


def with_theta(member: Member, theta: NDArray[np.float64]) -> Member:
    """A member with other parameters.

    Args:
        member: An ARX model or a network of one or several outputs.
        theta: Its flat parameters, as its recursion has them.

    Returns:
        The member.

    Raises:
        ConfigError: If it has no flat parameters.
    """
    if isinstance(member, ARXModel):
        return replace(member, intercept=float(theta[0]), coefficients=theta[1:])
    if isinstance(member, (NARXModel, VectorNARXModel)):
        return replace(member, theta=theta)
    raise _cannot(member)


def _to_run(cascade: Cascade, trained: Sequence[str] | None) -> tuple[list[Member], list[bool]]:
    """Members that change while the trained ones do, and which of them are trained."""
    if any(cascade.wiring.feeds_back(Ends.of(model)) for model in cascade.models):
        return list(cascade.models), [
            trained is None or bool(set(Ends.of(model).outputs) & set(trained)) for model in cascade.models
        ]
    changing: set[str] = set()
    run, flags = [], []
    for model in cascade.models:
        ends = Ends.of(model)
        own = trained is None or bool(set(ends.outputs) & set(trained))
        reads = {*ends.inputs, *(c for n in ends.outputs if n in cascade.limits for c in cascade.limits[n].channels)}
        if own or reads & changing:
            changing |= set(ends.outputs)
            run.append(model)
            flags.append(own)
    return run, flags


def _part(model: Member) -> Part:
    part = Part.of(model)
    if part is None:
        raise _cannot(model)
    return part


def _cannot(model: Member) -> ConfigError:
    return ConfigError(
        "a member cannot be trained with the others, or lies between trained members and a target",
        where=str(model.mapping),
        expected="ARX or NARX models from the first trained member on",
        got=model.structure.label,
        remedy="train only members downstream of it, or fit it as ARX or NARX",
    )


def _slices(parts: Sequence[Part], trained: Sequence[bool]) -> tuple[tuple[slice, slice], ...]:
    """For each trained member where its parameters stand among those of all, and among those that are trained."""
    slices, first, own = [], 0, 0
    for part, yes in zip(parts, trained, strict=True):
        n = len(part.theta)
        if yes:
            slices.append((slice(first, first + n), slice(own, own + n)))
            own += n
        first += n
    return tuple(slices)


def _tables(program: kernel.Program, trained: Sequence[bool], own: Sequence[slice]) -> _Tables:
    output_of = {int(channel): i for i, channel in enumerate(program.output_channel)}
    source = np.array([output_of.get(int(channel), -1) for channel in program.column_channel], dtype=np.int64)
    own_first = np.full(len(trained), -1, dtype=np.int64)
    own_first[np.flatnonzero(trained)] = [place.start for place in own]
    extent = np.zeros(len(program.output_channel), dtype=np.int64)
    # Members run in order and parameters stand in that order: a row ends with the last trained member so far, unless
    # members read the past of later ones.
    ends = iter(own)
    reach = 0
    for m, yes in enumerate(trained):
        reach = next(ends).stop if yes else reach
        extent[program.output_first[m] : program.output_first[m + 1]] = reach
    if program.column_late.any() and own:
        extent[:] = own[-1].stop
    feeds = source[program.regressor_column] >= 0
    carry = int(program.regressor_lag[feeds].max(initial=0))
    return _Tables(own_first, extent, source, carry)


def _counted(record: _Record) -> int:
    return len(record.rows) if record.root_weights is None else int(np.count_nonzero(record.root_weights))
