r"""Providers: where residuals and Jacobians come from. Open and closed loop differ here and nowhere else.

Record :math:`r` has inputs ``u``, measured outputs ``target`` and weights :math:`w_t` (``root_weights`` squared; zero
where a sample is masked), all in scaled numbers. With :math:`x_t` the lagged inputs and outputs at step :math:`t`, the
model's output is

.. math::
    \hat y_t(\theta) = f(x_t; \theta), \qquad e_t = \hat y_t - \text{target}_t, \qquad
    E(\theta) = \tfrac12 \sum_r \sum_t w_t e_t^2.

What stands in :math:`x_t` for the past outputs is all that tells the loops apart. In the open loop they are measured,
so that :math:`J_t = \partial f / \partial\theta` and the rows do not depend on each other. In the closed loop, the free
run, only those of the record's ``history`` are, and

.. math::
    J_t = \frac{d \hat y_t}{d\theta} = \frac{\partial f}{\partial\theta} + \sum_{l \le t} c_{t,l} J_{t-l},
    \qquad c_{t,l} = \frac{\partial f}{\partial x_{t,l}}.

Records are never concatenated. The rows :math:`J_t` are exact: the network is a cascade of one, of which the past
outputs are an input in the open loop (``sysid/kernels/cascade_sensitivities.py``). None of them is kept beyond its
block of ``BLOCK`` rows, because a Gauss-Newton method needs

.. math:: \text{gradient} = \sum_t w_t e_t J_t, \qquad \text{gauss\_newton} = \sum_t w_t J_t^T J_t

and no more. Their cost is :math:`N p (1 + n_l)` multiply-adds for the rows, of :math:`n_l` output lags, and
:math:`N p^2` for the products, which dominate from some ten parameters on.

Limits: the second derivatives :math:`\sum w_t e_t\, d^2 \hat y_t / d\theta^2` are left out, as in every Gauss-Newton
method, which is right where the residuals are small or change sign often. A free run that is unstable has rows that
grow without bound (:attr:`Linearisation.finite`; outputs are clipped, and a clipped sample has a zero row). A masked
sample is nobody's past: one step ahead the rows that look at it do not count; the inputs of a free run go on through
the mask as they stand in the record.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.experiment import Experiment
from sysid.estimation.least_squares.correlation import correlation_time
from sysid.estimation.least_squares.provider import AbstractProvider, Linearisation
from sysid.kernels import cascade as kernel
from sysid.kernels.arrays import read_only
from sysid.kernels.cascade_layout import Program
from sysid.kernels.cascade_plan import Plan
from sysid.kernels.cascade_sensitivities import rows_for, sensitivities
from sysid.models import Recursion
from sysid.models.lagged_form import NOT_KEPT, opened, side_by_side

BLOCK = 1024
"""Rows of the Jacobian that are alive at a time: 1024 rows of 300 parameters are 2.4 MB, which the second-level
cache holds until the normal equations have used them. Memory does not grow with the length of the records."""


@dataclass(frozen=True, eq=False)
class _Record:
    """An experiment in scaled numbers.

    ``values`` are inputs, in the open loop a column for each past output that is read, and the output after its
    history. The pass writes into a copy: starts that train side by side share the provider.
    """

    values: NDArray[np.float64]
    target: NDArray[np.float64]
    root_weights: NDArray[np.float64] | None


@dataclass(frozen=True, eq=False)
class _Pass:
    """What one run over a record leaves for the sensitivities."""

    values: NDArray[np.float64]
    kept: NDArray[np.float64]
    held: NDArray[np.int8]


@dataclass(frozen=True, kw_only=True, eq=False)
class RecursionProvider(AbstractProvider):
    """Residuals of a :class:`Recursion`, in open loop (one step ahead) or closed loop (free run).

    Args:
        template: Lags, neurons, scaling and bounds; its parameters are ignored.
        experiments: The records; each starts from its own history.
        closed: Free run if true, one step ahead otherwise.
        stride: Every so-manieth sample of a record counts.
    """

    template: Recursion
    experiments: tuple[Experiment, ...]
    closed: bool
    stride: int = 1
    n_samples: int = field(init=False)
    _records: tuple[_Record, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "experiments", tuple(self.experiments))
        object.__setattr__(self, "_records", tuple(self._record(e) for e in self.experiments))
        counted = [
            len(r.target[:: self.stride])
            if r.root_weights is None
            else np.count_nonzero(r.root_weights[:: self.stride])
            for r in self._records
        ]
        object.__setattr__(self, "n_samples", int(sum(counted)))

    def _record(self, experiment: Experiment) -> _Record:
        experiment = experiment.from_measured(self.template.lags)
        if not self.closed:
            experiment = experiment.one_step(self.template.lags)
        u, measured = self.template.extended(experiment.inputs, experiment.history)
        target = self.template.scaling.scale_output(experiment.output)
        measured[self.template.lags.depth :] = target
        read = 1 if self.closed else 1 + len(self.template.lags.output)
        roots = None if experiment.weights is None else np.sqrt(experiment.weights)
        return _Record(np.column_stack([u, *[measured] * read]), target, roots)

    def loss(self, theta: NDArray[np.float64]) -> float:
        """Half the weighted sum of squared residuals; see the base class."""
        total = 0.0
        for record in self._records:
            residual = self._residual(record, self._pass(record, theta, keep=False))
            residual = residual if record.root_weights is None else residual * record.root_weights
            residual = residual[:: self.stride]
            total += 0.5 * float(residual @ residual)
        return total if np.isfinite(total) else np.inf

    def linearise(self, theta: NDArray[np.float64]) -> Linearisation:
        """Loss, gradient and Gauss-Newton matrix; see the base class."""
        return self._linearised(theta, correlation=True)

    def without_news(self, theta: NDArray[np.float64]) -> Linearisation:
        """The same without the correlation time; see the base class."""
        return self._linearised(theta, correlation=False)

    def _linearised(self, theta: NDArray[np.float64], *, correlation: bool) -> Linearisation:
        n_p = len(theta)
        gradient = np.zeros(n_p)
        matrix = np.zeros((n_p, n_p))
        loss, correlated = 0.0, 0.0
        for record in self._records:
            passed = self._pass(record, theta)
            residual = self._residual(record, passed)
            residual = residual if record.root_weights is None else residual * record.root_weights
            if correlation:
                correlated += len(residual) * max(1.0, correlation_time(residual) / self.stride)
            counted = residual[:: self.stride]
            loss += 0.5 * float(counted @ counted)
            for first, block in self._blocks(record, theta, passed):
                rows = slice(first, first + len(block))
                weighted = block if record.root_weights is None else block * record.root_weights[rows, None]
                some = slice(-first % self.stride, None, self.stride)
                # A copy only where rows are left out: products of strided arrays are not done by BLAS.
                weighted = weighted if self.stride == 1 else np.ascontiguousarray(weighted[some])
                gradient += weighted.T @ residual[rows][some]
                # NumPy sees that both factors are one array and calls syrk, half the flops of a general product; unlike
                # SciPy's wrapper of it, it lets the other starts' threads run meanwhile.
                matrix += weighted.T @ weighted
        return Linearisation(
            loss=loss,
            gradient=gradient,
            gauss_newton=matrix,
            correlation_time=correlated / sum(len(record.target) for record in self._records)
            if correlation
            else np.nan,
        )

    def jacobian(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """The whole Jacobian of the scaled output, unweighted, records one after the other.

        Args:
            theta: Flat parameters.

        Returns:
            Shape ``(n_samples_of_all_records, n_parameters)``.
        """
        blocks = []
        for record in self._records:
            passed = self._pass(record, theta)
            blocks += [block.copy() for _, block in self._blocks(record, theta, passed)]
        return np.concatenate(blocks)

    def output_variance(self, theta: NDArray[np.float64], factor: NDArray[np.float64]) -> NDArray[np.float64]:
        """Variance of the scaled output that is due to the parameters, to first order.

        Args:
            theta: Flat parameters.
            factor: ``F`` with covariance ``F F^T`` of the parameters, shape ``(n_parameters, n_directions)``.

        Returns:
            Shape ``(n_samples_of_all_records,)``, records one after the other. Memory does not grow with the Jacobian.
        """
        parts = []
        for record in self._records:
            passed = self._pass(record, theta)
            for _, block in self._blocks(record, theta, passed):
                moved = block @ factor
                parts.append(np.einsum("ij,ij->i", moved, moved))
        return np.concatenate(parts)

    def _blocks(
        self, record: _Record, theta: NDArray[np.float64], passed: _Pass
    ) -> Iterator[tuple[int, NDArray[np.float64]]]:
        n, n_p, depth = len(record.target), len(theta), self.template.lags.depth
        reads = max(self.template.lags.output, default=0) if self.closed else 0
        room = rows_for(np.array([reads + BLOCK]), n_p)
        program = self._program._replace(theta=theta.copy())
        own, extent = np.zeros(1, dtype=np.int64), np.array([n_p])
        for first in range(0, n, BLOCK):
            rows = min(BLOCK, n - first)
            sensitivities(
                program, depth, first, rows, passed.values, passed.kept, passed.held, own, extent, self._source, room
            )
            place = first & int(room.mask[0])
            block, moves = room.J[place : place + rows], room.moves[place : place + rows]
            if not moves.all():
                block[~moves] = 0.0
            yield first, block

    def _residual(self, record: _Record, passed: _Pass) -> NDArray[np.float64]:
        return passed.values[self.template.lags.depth :, -1] - record.target

    def _pass(self, record: _Record, theta: NDArray[np.float64], *, keep: bool = True) -> _Pass:
        """One run; in the closed loop the network reads what it has written itself."""
        n = len(record.target)
        kept = np.empty((n, self.template.neurons)) if keep else NOT_KEPT
        passed = _Pass(record.values.copy(), kept, np.empty((n, 1), dtype=np.int8))
        kernel.go_on(*self._plan, read_only(theta), self.template.lags.depth, passed.values, kept, passed.held)
        return passed

    @cached_property
    def _program(self) -> Program:
        """The network as a cascade of one in scaled numbers."""
        template, n = self.template, self.template.lags.n_inputs
        columns = template.columns if self.closed else opened(template.columns, n)
        read = len(columns.lags.inputs)
        low, high = template.bounds
        columns = replace(columns, offset=(0.0,) * read, scale=(1.0,) * read, low=low, high=high)
        return side_by_side([columns], read - 1)

    @cached_property
    def _plan(self) -> Plan:
        return Plan.of(self._program)

    @cached_property
    def _source(self) -> NDArray[np.int64]:
        """For each regressor whether it is the network's own output, 0, or an input, -1."""
        return np.where(self._program.regressor_channel == self._program.output_channel[0], 0, -1)

    def at(self, theta: NDArray[np.float64]) -> Recursion:
        """The recursion with these parameters.

        Args:
            theta: Flat parameters.

        Returns:
            The recursion.
        """
        return replace(self.template, theta=theta)
