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
from sysid.kernels import recursion as kernel
from sysid.kernels.arrays import read_only
from sysid.kernels.cascade_layout import Program
from sysid.kernels.cascade_sensitivities import rows_for, sensitivities
from sysid.kernels.neurons import code_of
from sysid.models import Ends, Recursion
from sysid.models.cascade_program import program_of
from sysid.models.recursion import NOT_KEPT

BLOCK = 1024
"""Rows of the Jacobian that are alive at a time: 1024 rows of 300 parameters are 2.4 MB, which the second-level
cache holds until the normal equations have used them. Memory does not grow with the length of the records."""


@dataclass(frozen=True, eq=False)
class _Record:
    """An experiment in scaled numbers.

    ``measured`` is the output with its history. Kernels write outputs into a copy: starts that train side by side
    share the provider.
    """

    u: NDArray[np.float64]
    measured: NDArray[np.float64]
    target: NDArray[np.float64]
    root_weights: NDArray[np.float64] | None


@dataclass(frozen=True, eq=False)
class _Pass:
    """What one run over a record leaves for the sensitivities; ``values`` are inputs and the output that was read."""

    values: NDArray[np.float64]
    out: NDArray[np.float64]
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
        roots = None if experiment.weights is None else np.sqrt(experiment.weights)
        return _Record(u, measured, target, roots)

    def loss(self, theta: NDArray[np.float64]) -> float:
        """Half the weighted sum of squared residuals; see the base class."""
        total = 0.0
        for record in self._records:
            residual = self._out(record, theta) - record.target
            residual = residual if record.root_weights is None else residual * record.root_weights
            residual = residual[:: self.stride]
            total += 0.5 * float(residual @ residual)
        return total if np.isfinite(total) else np.inf

    def linearise(self, theta: NDArray[np.float64]) -> Linearisation:
        """Loss, gradient and Gauss-Newton matrix; see the base class."""
        n_p = len(theta)
        gradient = np.zeros(n_p)
        matrix = np.zeros((n_p, n_p))
        loss, correlated = 0.0, 0.0
        for record in self._records:
            passed = self._pass(record, theta)
            residual = passed.out - record.target
            residual = residual if record.root_weights is None else residual * record.root_weights
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
            correlation_time=correlated / sum(len(record.target) for record in self._records),
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
            block[~moves] = 0.0
            yield first, block

    def _out(
        self,
        record: _Record,
        theta: NDArray[np.float64],
        kept: tuple[NDArray[np.float64], NDArray[np.int8]] = NOT_KEPT,
    ) -> NDArray[np.float64]:
        """The output after its history; in closed loop the network reads what it has written itself."""
        template, y = self.template, record.measured.copy()
        lags = template.lags
        kernel.free_run(
            record.u, y if self.closed else record.measured, y, lags.depth, len(record.target), lags.input_channel,
            lags.input_lag, lags.output_lag, read_only(theta), template.neurons, code_of(template.activation),
            *template.bounds, *kept,
        )  # fmt: skip
        return y[lags.depth :]

    def _pass(self, record: _Record, theta: NDArray[np.float64]) -> _Pass:
        n = len(record.target)
        kept, held = np.empty((n, self.template.neurons)), np.empty((n, 1), dtype=np.int8)
        out = self._out(record, theta, (kept, held))
        read = np.concatenate([record.measured[:-n], out]) if self.closed else record.measured
        return _Pass(np.column_stack([record.u, read]), out, kept, held)

    @cached_property
    def _program(self) -> Program:
        """The network as a cascade of one in scaled numbers."""
        lags = self.template.lags
        names = tuple(f"u{i}" for i in range(lags.n_inputs))
        columns = replace(self.template.columns, offset=(0.0,) * (len(names) + 1), scale=(1.0,) * (len(names) + 1))
        ends = Ends(
            inputs=names, outputs=("y",), input_units=("",) * len(names), output_units=("",), rest_outputs=(0.0,),
            direct=frozenset(),
        )  # fmt: skip
        return program_of([columns], [ends], (*names, "y"), {})

    @cached_property
    def _source(self) -> NDArray[np.int64]:
        """For each regressor whether it is the network's own output, 0, or an input, -1."""
        own = self._program.regressor_channel == self.template.lags.n_inputs
        return np.where(own, 0, -1) if self.closed else np.full(len(own), -1)

    def at(self, theta: NDArray[np.float64]) -> Recursion:
        """The recursion with these parameters.

        Args:
            theta: Flat parameters.

        Returns:
            The recursion.
        """
        return replace(self.template, theta=theta)
