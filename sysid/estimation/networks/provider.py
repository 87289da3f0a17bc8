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
outputs are an input in the open loop. Their cost is :math:`N p (1 + n_l)` multiply-adds for the rows, of :math:`n_l`
output lags, and :math:`N p^2` for the products, which dominate from some ten parameters on.

Limits: the second derivatives :math:`\sum w_t e_t\, d^2 \hat y_t / d\theta^2` are left out, as in every Gauss-Newton
method, which is right where the residuals are small or change sign often. A free run that is unstable has rows that
grow without bound (:attr:`Linearisation.finite`; outputs are clipped, and a clipped sample has a zero row). A masked
sample is nobody's past: one step ahead the rows that look at it do not count; the inputs of a free run go on through
the mask as they stand in the record.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.correlation import correlation_time
from sysid.estimation.networks.joint_record import Record
from sysid.estimation.networks.program_provider import ProgramProvider
from sysid.estimation.networks.trained_members import TrainedMembers
from sysid.estimation.records.experiment import Experiment
from sysid.models import Recursion
from sysid.models.lagged.lagged_form import opened, side_by_side


@dataclass(frozen=True, kw_only=True, eq=False)
class RecursionProvider(ProgramProvider):
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

    def __post_init__(self) -> None:
        object.__setattr__(self, "experiments", tuple(self.experiments))
        trained = self._network()
        records = [self._record(one, trained.depth) for one in self.experiments]
        self._fill(trained, records, trained.program.output_channel.tolist(), np.ones(1))

    def _network(self) -> TrainedMembers:
        """The network as a cascade of one in scaled numbers."""
        template, n = self.template, self.template.lags.n_inputs
        columns = template.columns if self.closed else opened(template.columns, n)
        read = len(columns.lags.inputs)
        low, high = template.bounds
        columns = replace(columns, offset=(0.0,) * read, scale=(1.0,) * read, low=low, high=high)
        return TrainedMembers.of_program(side_by_side([columns], read - 1), [columns], [True])

    def _record(self, experiment: Experiment, depth: int) -> Record:
        """An experiment in scaled numbers: inputs, in the open loop each past output that is read, and the output."""
        experiment = experiment.from_measured(self.template.lags)
        if not self.closed:
            experiment = experiment.one_step(self.template.lags)
        u, measured = self.template.extended(experiment.inputs, experiment.history)
        target = self.template.scaling.scale_output(experiment.output)
        measured[depth:] = target
        read = 1 if self.closed else 1 + len(self.template.lags.output)
        whole = Record(
            values=np.column_stack([u, *[measured] * read]),
            rows=np.arange(len(target)),
            target=target[:, np.newaxis],
            root_weights=None if experiment.weights is None else np.sqrt(experiment.weights)[:, np.newaxis],
        )
        if self.stride == 1:
            return whole
        every, roots = slice(None, None, self.stride), whole.root_weights
        return replace(
            whole,
            rows=whole.rows[every],
            target=np.ascontiguousarray(whole.target[every]),
            root_weights=None if roots is None else np.ascontiguousarray(roots[every]),
            whole=whole,
        )

    def _news(self, residuals: Sequence[NDArray[np.float64]]) -> float:
        """Of all samples, in those that count; see the base class."""
        times = [len(one) * max(1.0, correlation_time(one[:, 0]) / self.stride) for one in residuals]
        return sum(times) / sum(map(len, residuals))

    def output_variance(self, theta: NDArray[np.float64], factor: NDArray[np.float64]) -> NDArray[np.float64]:
        """Variance of the scaled output that is due to the parameters, to first order.

        Args:
            theta: Flat parameters.
            factor: ``F`` with covariance ``F F^T`` of the parameters, shape ``(n_parameters, n_directions)``.

        Returns:
            Shape ``(n_counted_samples_of_all_records,)``, records one after the other. Memory does not grow with the
            Jacobian.
        """
        program, parts = self._trained.program_at(theta), []
        for record in self._records:
            passed, found = self._pass(program.numbers, record, keep=True), np.zeros(len(record.rows))
            for rows, [(moving, block)] in self._blocks(program, record, passed, len(theta)):
                moved = block @ factor
                found[rows][moving] = np.einsum("ij,ij->i", moved, moved)
            parts.append(found)
        return np.concatenate(parts)

    def at(self, theta: NDArray[np.float64]) -> Recursion:
        """The recursion with these parameters.

        Args:
            theta: Flat parameters.

        Returns:
            The recursion.
        """
        return replace(self.template, theta=theta)
