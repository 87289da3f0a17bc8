r"""Providers: where residuals and Jacobians come from. Open and closed loop differ here and nowhere else.

Record :math:`r` has inputs ``u``, measured outputs ``target`` and weights :math:`w_t` (``root_weights`` squared; zero
where a sample is masked), all in scaled numbers. With :math:`x_t` the lagged inputs and outputs at step :math:`t`, the
model's output is

.. math::
    \hat y_t(\theta) = f(x_t; \theta), \qquad e_t = \hat y_t - \text{target}_t, \qquad
    E(\theta) = \tfrac12 \sum_r \sum_t w_t e_t^2.

What stands in :math:`x_t` for the past outputs is all that tells the loops apart. Let :math:`s_t = k \lfloor t / k
\rfloor` be the first step of the window of ``horizon`` :math:`k` that :math:`t` lies in; the output at lag :math:`l` is

.. math::
    x_{t,l} = \begin{cases} \hat y_{t-l} & t - l \ge s_t \\ \text{measured}_{t-l} & t - l < s_t \end{cases}
    \qquad\Rightarrow\qquad
    J_t = \frac{d \hat y_t}{d\theta} = \frac{\partial f}{\partial\theta}
      + \sum_{l:\, t - l \ge s_t} c_{t,l} J_{t-l}, \qquad c_{t,l} = \frac{\partial f}{\partial x_{t,l}}.

With :math:`k = 1` no past output is the model's own: the open loop, whose rows do not depend on each other. With
:math:`k` as long as the record only the history is measured: the closed loop, the free run. Each record starts from its
own ``history``, so that records are never concatenated. The rows :math:`J_t` are exact (``sysid/kernels/recursion.py``
runs the recursion and derives it for the network); none of them is kept beyond its block of ``BLOCK`` rows, because a
Gauss-Newton method needs

.. math:: \text{gradient} = \sum_t w_t e_t J_t, \qquad \text{gauss\_newton} = \sum_t w_t J_t^T J_t

and no more. Their cost is :math:`N p (1 + n_l)` multiply-adds for the rows, of :math:`n_l` output lags, and
:math:`N p^2` for the products, which dominate from some ten parameters on.

Limits: the second derivatives :math:`\sum w_t e_t\, d^2 \hat y_t / d\theta^2` are left out, as in every Gauss-Newton
method, which is right where the residuals are small or change sign often. A free run that is unstable has rows that
grow without bound (:attr:`Linearisation.finite`; outputs are clipped, and a clipped sample has a zero row). A masked
sample is nobody's past: one step ahead the rows that look at it do not count, nor, over a horizon, the run that would
begin at it; the inputs of a free run go on through the mask as they stand in the record.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.experiment import Experiment
from sysid.estimation.least_squares.correlation import correlation_time
from sysid.estimation.least_squares.provider import AbstractProvider, Linearisation
from sysid.kernels import recursion as kernel
from sysid.kernels.arrays import read_only
from sysid.kernels.neurons import code_of
from sysid.models import (
    Recursion,
)

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
    """What one run over a record leaves for the sensitivities (see the kernel)."""

    y: NDArray[np.float64]
    out: NDArray[np.float64]
    h: NDArray[np.float64]
    c: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class RecursionProvider(AbstractProvider):
    """Residuals of a :class:`Recursion`, in open loop (one step ahead), closed loop (free run) or in between.

    Args:
        template: Lags, neurons, scaling and bounds; its parameters are ignored.
        experiments: The records; each starts from its own history.
        closed: Free run if true, one step ahead otherwise.
        horizon: Samples after which a free run begins anew from measured output; ``None`` for the whole record. Every
            sample is then predicted between 1 and ``horizon`` steps ahead.
        stride: Every so-manieth sample of a record counts.
    """

    template: Recursion
    experiments: tuple[Experiment, ...]
    closed: bool
    horizon: int | None = None
    stride: int = 1
    n_samples: int = field(init=False)
    _records: tuple[_Record, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "experiments", tuple(self.experiments))
        object.__setattr__(self, "_records", tuple(self._record(e) for e in self.experiments))
        counted = [
            len(r.target[self._first :: self.stride])
            if r.root_weights is None
            else np.count_nonzero(r.root_weights[self._first :: self.stride])
            for r in self._records
        ]
        object.__setattr__(self, "n_samples", int(sum(counted)))

    def _record(self, experiment: Experiment) -> _Record:
        experiment = experiment.from_measured(self.template.lags)
        if not self.closed:
            experiment = experiment.one_step(self.template.lags)
        elif self.horizon is not None:
            experiment = experiment.within(self.horizon, self.template.lags)
        u, measured = self.template.extended(experiment.inputs, experiment.history)
        target = self.template.scaling.scale_output(experiment.output)
        measured[self.template.lags.depth :] = target
        roots = None if experiment.weights is None else np.sqrt(experiment.weights)
        return _Record(u, measured, target, roots)

    @property
    def _first(self) -> int:
        """The first sample that counts.

        Over a horizon it is the last of a window or of a stride: were it the first, a horizon that divides the stride
        would be judged one step ahead alone.
        """
        return min(self.horizon, self.stride) - 1 if self.closed and self.horizon is not None else 0

    def _steps(self, record: _Record) -> int:
        """The horizon as the kernel wants it."""
        if not self.closed:
            return 1
        return len(record.target) if self.horizon is None else self.horizon

    def loss(self, theta: NDArray[np.float64]) -> float:
        """Half the weighted sum of squared residuals; see the base class."""
        total = 0.0
        for record in self._records:
            if self.closed and self.horizon is None:
                y = record.measured.copy()  # of which the free run reads what it has written itself
                kernel.free_run(record.u, y, *self._arguments(record, theta))
                residual = y[self.template.lags.depth :] - record.target
            else:
                residual = self._pass(record, theta).out - record.target
            residual = residual if record.root_weights is None else residual * record.root_weights
            residual = residual[self._first :: self.stride]
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
            counted = residual[self._first :: self.stride]
            loss += 0.5 * float(counted @ counted)
            for first, block in self._blocks(record, theta, passed):
                rows = slice(first, first + len(block))
                weighted = block if record.root_weights is None else block * record.root_weights[rows, None]
                some = slice((self._first - first) % self.stride, None, self.stride)
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
        lags = self.template.lags
        carry = max(lags.output, default=0) if self.closed else 0
        n = len(record.target)
        J = np.empty((carry + BLOCK, len(theta)))
        for first in range(0, n, BLOCK):
            rows = min(BLOCK, n - first)
            if first:
                J[:carry] = J[BLOCK : BLOCK + carry]
            kernel.sensitivities(
                record.u, passed.y, record.measured, lags.depth, first, rows, *self._tables(), read_only(theta),
                self.template.neurons, code_of(self.template.activation), self._steps(record), passed.h, passed.c,
                carry, J,
            )  # fmt: skip
            yield first, J[carry : carry + rows]

    def _pass(self, record: _Record, theta: NDArray[np.float64]) -> _Pass:
        n = len(record.target)
        passed = _Pass(
            y=record.measured.copy(),
            out=np.empty(n),
            h=np.empty((n, self.template.neurons)),
            c=np.empty((n, len(self.template.lags.output) + 1)),
        )
        arguments = (*self._arguments(record, theta), self._steps(record))
        kernel.activations(record.u, passed.y, record.measured, *arguments, passed.out, passed.h, passed.c)
        return passed

    def _tables(self) -> tuple[NDArray[np.int64], ...]:
        lags = self.template.lags
        return lags.input_channel, lags.input_lag, lags.output_lag

    def _arguments(self, record: _Record, theta: NDArray[np.float64]) -> tuple[object, ...]:
        template = self.template
        n = len(record.target)
        kind, bounds = code_of(template.activation), template.bounds
        return (template.lags.depth, n, *self._tables(), read_only(theta), template.neurons, kind, *bounds)

    def at(self, theta: NDArray[np.float64]) -> Recursion:
        """The recursion with these parameters.

        Args:
            theta: Flat parameters.

        Returns:
            The recursion.
        """
        return replace(self.template, theta=theta)
