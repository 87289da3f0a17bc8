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
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.correlation import correlation_time
from sysid.estimation.least_squares.provider import AbstractWeighing
from sysid.estimation.networks.basis import RebasedProvider
from sysid.estimation.networks.joint_record import Record
from sysid.estimation.networks.program_provider import ProgramProvider
from sysid.estimation.networks.trained_members import TrainedMembers
from sysid.estimation.records.experiment import Experiment
from sysid.models import Recursion
from sysid.models.lagged.lagged_form import opened, side_by_side
from sysid.models.lagged.vector_recursion import VectorRecursion


@dataclass(frozen=True, kw_only=True, eq=False)
class RecursionProvider(ProgramProvider, AbstractWeighing):
    """Residuals of a recursion of one output or several, in open loop (one step ahead) or closed loop (free run).

    Args:
        template: Lags, neurons, scaling and bounds; its parameters are ignored.
        experiments: The records; each starts from its own history.
        closed: Free run if true, one step ahead otherwise.
        stride: Every so-manieth sample of a record counts.
        output_weights: What a squared residual of each output counts, in scaled numbers; ``None`` for all alike.
    """

    template: Recursion | VectorRecursion
    experiments: tuple[Experiment, ...]
    closed: bool
    stride: int = 1
    output_weights: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "experiments", tuple(self.experiments))
        trained = self._network()
        records = [self._record(one, trained.depth) for one in self.experiments]
        weights = np.array(self.output_weights or (1.0,) * self._n_outputs)
        self._fill(trained, records, trained.program.output_channel.tolist(), 1.0 / np.sqrt(weights))

    @property
    def _n_outputs(self) -> int:
        return len(self.template.columns.lags.inputs) - self.template.n_inputs

    def _network(self) -> TrainedMembers:
        """The network as a cascade of one in scaled numbers."""
        template, n = self.template, self.template.n_inputs
        columns = template.columns if self.closed else opened(template.columns, n)
        read = len(columns.lags.inputs)
        bounds = template.bounds
        alike = bool((bounds == bounds[0]).all())
        low, high = bounds[0].tolist() if alike else (-np.inf, np.inf)
        columns = replace(columns, offset=(0.0,) * read, scale=(1.0,) * read, low=low, high=high)
        limits = () if alike else tuple((low, high) for low, high in bounds.tolist())
        return TrainedMembers.of_program(side_by_side([columns], read - self._n_outputs, limits), [columns], [True])

    def _record(self, experiment: Experiment, depth: int) -> Record:
        """An experiment in scaled numbers: inputs, in the open loop each past output that is read, and the outputs."""
        lags, n = self.template.columns.lags, self.template.n_inputs
        experiment = experiment.from_measured(lags)
        if not self.closed:
            experiment = experiment.one_step(lags)
        u, measured = self.template.extended(experiment.inputs, experiment.history)
        target = self.template.scaling.scale_output(experiment.output).reshape(len(experiment.output), -1)
        measured[depth:] = target
        read = [] if self.closed else [j for j, some in enumerate(lags.inputs[n:]) for _ in some]
        whole = Record(
            values=np.concatenate([u, measured[:, read], measured], axis=1),
            rows=np.arange(len(target)),
            target=np.asfortranarray(target),
            root_weights=_roots(experiment, target.shape[1]),
        )
        if self.stride == 1:
            return whole
        every, roots = slice(None, None, self.stride), whole.root_weights
        return replace(
            whole,
            rows=whole.rows[every],
            target=np.asfortranarray(whole.target[every]),
            root_weights=None if roots is None else np.asfortranarray(roots[every]),
            whole=whole,
        )

    def _news(self, residuals: Sequence[NDArray[np.float64]]) -> float:
        """Of all samples, in those that count; see the base class."""
        each = [[max(1.0, correlation_time(own) / self.stride) for own in one.T] for one in residuals]
        times = [len(one) * float(np.mean(found)) for one, found in zip(residuals, each, strict=True)]
        return sum(times) / sum(map(len, residuals))

    def variances(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean squared residual of each output; see the base class."""
        total, counted = np.zeros(self._n_outputs), np.zeros(self._n_outputs)
        for record, away in zip(self._records, self._all_away(theta), strict=True):
            weights = np.ones_like(away) if record.root_weights is None else record.root_weights**2
            total += np.sum(weights * (away * self._errors) ** 2, axis=0)
            counted += weights.sum(axis=0)
        return total / np.maximum(counted, 1.0)

    def with_output_weights(self, weights: tuple[float, ...]) -> RecursionProvider:
        """The same residuals with other weights; see the base class."""
        return replace(self, output_weights=weights)

    def output_variance(self, theta: NDArray[np.float64], factor: NDArray[np.float64]) -> NDArray[np.float64]:
        """Variance of the scaled outputs that is due to the parameters, to first order.

        Args:
            theta: Flat parameters.
            factor: ``F`` with covariance ``F F^T`` of the parameters, shape ``(n_parameters, n_directions)``.

        Returns:
            Shape ``(n_counted_samples_of_all_records, n_outputs)``, records one after the other. Memory does not grow
            with the Jacobian.
        """
        program, parts = self._trained.program_at(theta), []
        for record in self._records:
            passed, found = self._pass(program.numbers, record, keep=True), np.zeros(record.target.shape)
            for rows, blocks in self._blocks(program, record, passed, len(theta)):
                for j, (moving, block) in enumerate(blocks):
                    moved = block @ factor[: block.shape[1]]
                    found[rows, j][moving] = np.einsum("ij,ij->i", moved, moved)
            parts.append(found)
        return np.concatenate(parts)


@dataclass(frozen=True, kw_only=True, eq=False)
class RebasedRecursion(RebasedProvider, AbstractWeighing):
    """The same, whose parameters stand in another basis."""

    inner: RecursionProvider
    output_weights: tuple[float, ...] | None = field(init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "output_weights", self.inner.output_weights)

    def variances(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean squared residual of each output; see the base class."""
        return self.inner.variances(self.to_plain @ theta)

    def with_output_weights(self, weights: tuple[float, ...]) -> RebasedRecursion:
        """The same residuals with other weights; see the base class."""
        return replace(self, inner=self.inner.with_output_weights(weights))


def _roots(experiment: Experiment, n_outputs: int) -> NDArray[np.float64] | None:
    """Roots of what each sample of each output weighs; ``None`` where all count alike."""
    if experiment.each is not None:
        return np.asfortranarray(np.sqrt(experiment.each))
    if experiment.weights is None:
        return None
    return np.asfortranarray(np.repeat(np.sqrt(experiment.weights)[:, np.newaxis], n_outputs, axis=1))
