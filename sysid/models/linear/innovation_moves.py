"""How predictions of linear models move with their parameters, and what innovations add to them over some steps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sysid.models.channels.history import History
from sysid.models.contract.base import AbstractModel
from sysid.models.contract.moves import moves_of
from sysid.models.linear.innovations import Innovations

LARGEST = 1e-4
"""Step of an entry of a scaled system: poles near the unit circle do not follow a line much farther."""


class InnovationModel(AbstractModel):
    """A linear model whose state space has, or may have, a gain for innovations."""

    if TYPE_CHECKING:  # fields of the dataclasses

        @property
        def orders(self) -> Any:
            """Its structure, which says whether it has a model of the noise."""

        @property
        def system(self) -> Innovations:
            """The matrices, in scaled numbers."""

        @property
        def scaling(self) -> Any:
            """Between units and scaled numbers."""

    def output_moves(
        self,
        factor: NDArray[np.float64],
        inputs: NDArray[np.float64],
        history: History,
        measured: NDArray[np.float64] | None = None,
    ) -> NDArray[np.float64]:
        """How free run and prediction move with its numbers; see the base class."""
        return prediction_moves(self, factor, inputs, history, measured)

    def innovation_responses(self, steps: int) -> NDArray[np.float64] | None:
        """Of the outputs to innovations over some steps; see the base class."""
        if not self.orders.noise:
            return None
        scale = np.atleast_1d(self.scaling.output_scale)
        found = responses_to_innovations(self.system.A, self.system.C, self.system.K, steps)
        return np.asarray(scale[:, np.newaxis] * found / scale)


def prediction_moves(
    model: AbstractModel,
    factor: NDArray[np.float64],
    inputs: NDArray[np.float64],
    history: History,
    measured: NDArray[np.float64] | None,
    *,
    steps: int = 1,
) -> NDArray[np.float64]:
    """Derivatives of a model's output along directions of its flat parameters, the state before found anew for each.

    Args:
        model: A model with :attr:`~sysid.models.contract.base.AbstractModel.vector` and ``with_theta``.
        factor: The directions, shape ``(n_parameters, n_directions)``.
        inputs: Shape ``(n_samples, n_inputs)``.
        history: The samples before.
        measured: Output from which it is predicted, of its shape; ``None`` for the free run.
        steps: How far ahead.

    Returns:
        Shape ``(n_samples, n_directions)``, of several outputs ``(n_samples, n_outputs, n_directions)``.
    """
    theta = model.vector
    assert theta is not None  # noqa: S101 - of such models alone

    def run(moved: NDArray[np.float64]) -> NDArray[np.float64]:
        other = model.with_theta(moved)
        assert other is not None  # noqa: S101
        if measured is None:
            return other.simulate(inputs, history)
        return other.predict(inputs, measured, history, steps=steps)

    outputs = (len(model.mapping.outputs),) if model.structure.several_outputs else ()
    return moves_of(run, theta, factor, (len(inputs), *outputs), largest=LARGEST)


def responses_to_innovations(
    A: NDArray[np.float64], C: NDArray[np.float64], K: NDArray[np.float64], steps: int
) -> NDArray[np.float64]:
    r"""What an innovation does to the outputs now and later: :math:`I, CK, CAK, CA^2K, \dots`.

    Args:
        A: Shape ``(n_state, n_state)``.
        C: Shape ``(n_outputs, n_state)``.
        K: Shape ``(n_state, n_outputs)``.
        steps: How many.

    Returns:
        Shape ``(steps, n_outputs, n_outputs)``. The variance of a prediction ``k`` steps ahead is that of the first
        ``k`` of them (Ljung 1999, "System Identification", section 3.2).

    Example:
        >>> responses_to_innovations(np.array([[0.5]]), np.eye(1), np.array([[0.5]]), 3).ravel().tolist()
        [1.0, 0.5, 0.25]
    """
    found, state = [np.eye(len(C))], K
    for _ in range(steps - 1):
        found.append(C @ state)
        state = A @ state
    return np.array(found)
