"""Where a network's fit starts: random hidden layer, and a linear part that repeats the last output."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.evidence import Group, Prior
from sysid.models import NARX, Lags

READOUT_SPREAD = 1e-3
"""Standard deviation of the initial readout. Small, so that the first free run is the linear part's: bounded, and
with gradients that mean something."""


class AbstractLayout(ABC):
    """Where the parameters of a network stand: what draws them, where they start."""

    @abstractmethod
    def centre(self) -> NDArray[np.float64]:
        """What the prior draws the model's parameters to."""

    @abstractmethod
    def prior(self, centre: NDArray[np.float64], *, alpha: float, beta: float) -> Prior:
        """The prior a fit begins with.

        Args:
            centre: What the parameters are drawn to, shape ``(n_parameters,)``.
            alpha: Precision of every group.
            beta: Precision of the residuals.

        Returns:
            The prior.
        """

    @abstractmethod
    def draw(self, rng: np.random.Generator, centre: NDArray[np.float64]) -> NDArray[np.float64]:
        """A random start.

        Args:
            rng: Source of randomness.
            centre: Where the linear part starts, shape ``(n_parameters,)``.

        Returns:
            Flat parameters.
        """

    def start(
        self,
        number: int,  # noqa: ARG002 - all starts of lagged regressors are alike
        rng: np.random.Generator,
        centre: NDArray[np.float64],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where one of several starts begins, and what the prior draws it to.

        Args:
            number: Which start, from 0 on.
            rng: Source of randomness.
            centre: What the prior draws all of them to, shape ``(n_parameters,)``, where they do not differ in it.

        Returns:
            Flat parameters, and what they are drawn to.
        """
        return self.draw(rng, centre), centre


@dataclass(frozen=True, kw_only=True)
class Layout(AbstractLayout):
    """Where each part of the flat parameter vector ``[W | b | v | c | w | V]`` stands.

    Args:
        lags: The regressors.
        neurons: Number of neurons.
        linear: Whether there is a linear part.
        gated: Whether the neurons have gates.
    """

    lags: Lags
    neurons: int
    linear: bool
    gated: bool = False

    @classmethod
    def of(cls, network: NARX, n_inputs: int) -> Layout:
        """The layout of a network.

        Args:
            network: The structure.
            n_inputs: Inputs of the mapping.

        Returns:
            The layout.
        """
        return cls(
            lags=network.lags(n_inputs), neurons=network.neurons, linear=network.feedthrough, gated=network.gated
        )

    @property
    def n_parameters(self) -> int:
        """Length of the vector."""
        return int(self.gates.stop)

    @property
    def hidden(self) -> slice:
        """Weights and biases of the tanh layer."""
        return slice(0, self.neurons * (self.lags.n_regressors + 1))

    @property
    def readout(self) -> slice:
        """Weights from the neurons to the output."""
        return slice(self.hidden.stop, self.hidden.stop + self.neurons)

    @property
    def affine(self) -> slice:
        """Constant and linear part."""
        return slice(self.readout.stop, self.readout.stop + 1 + (self.lags.n_regressors if self.linear else 0))

    @property
    def gates(self) -> slice:
        """Weights of the gates, neuron by neuron."""
        return slice(self.affine.stop, self.affine.stop + (self.neurons * self.lags.n_regressors if self.gated else 0))

    @property
    def last_output(self) -> int | None:
        """Position of the linear weight of ``y(t-1)``; ``None`` if there is none."""
        if not self.linear or 1 not in self.lags.output:
            return None
        return int(self.readout.stop) + 1 + len(self.lags.input_lag) + self.lags.output.index(1)

    def centre(self) -> NDArray[np.float64]:
        """What the prior draws the parameters to: "the output stays as it is", zero for everything else.

        Sampled fast, a system's next output is close to its last; drawing the weight of ``y(t-1)`` to 1 instead
        of 0 lets the regularisation shrink towards a model that holds, not one that collapses.
        """
        centre = np.zeros(self.n_parameters)
        if self.last_output is not None:
            centre[self.last_output] = 1.0
        return centre

    def prior(self, centre: NDArray[np.float64], *, alpha: float, beta: float) -> Prior:
        """The prior a fit begins with.

        The hidden weights of each regressor are a group of their own, and so are its gates, so that the evidence can
        find a regressor unimportant (automatic relevance determination, MacKay 1994); biases, readout and linear part
        are groups too.

        Args:
            centre: What the parameters are drawn to, shape ``(n_parameters,)``.
            alpha: Precision of every group.
            beta: Precision of the residuals.

        Returns:
            The prior.
        """
        r, k = self.lags.n_regressors, self.neurons
        by_regressor = np.arange(k * r).reshape(k, r)
        members = {f"hidden {i}": by_regressor[:, i] for i in range(r)} | {
            "bias": np.arange(k * r, k * (r + 1)),
            "readout": np.arange(self.readout.start, self.readout.stop),
            "linear": np.arange(self.affine.start, self.affine.stop),
        }
        if self.gated:
            members |= {f"gate {i}": self.gates.start + by_regressor[:, i] for i in range(r)}
        groups = tuple(Group(name=name, members=places) for name, places in members.items() if len(places))
        return Prior(centre=centre, groups=groups, alphas=np.full(len(groups), alpha), beta=beta)

    def draw(self, rng: np.random.Generator, centre: NDArray[np.float64]) -> NDArray[np.float64]:
        """A random start after Nguyen and Widrow 1990.

        Directions are random, their length ``0.7 * neurons ** (1 / n_regressors)`` and the biases spread over it,
        so that the active regions of the neurons tile the unit cube in which scaled regressors lie.

        Args:
            rng: Source of randomness.
            centre: Where the linear part starts, shape ``(n_parameters,)``.

        Returns:
            Flat parameters.
        """
        r, k = self.lags.n_regressors, self.neurons
        theta = centre.copy()
        if k:
            directions = rng.uniform(-1.0, 1.0, (k, r))
            length = 0.7 * k ** (1.0 / r)
            weights = length * directions / np.linalg.norm(directions, axis=1, keepdims=True)
            biases = length * np.linspace(-1.0, 1.0, k) * np.sign(weights[:, 0]) if k > 1 else np.zeros(1)
            theta[self.hidden] = np.concatenate([weights.ravel(), biases])
            theta[self.readout] = READOUT_SPREAD * rng.standard_normal(k)
            theta[self.gates] = READOUT_SPREAD * rng.standard_normal(self.gates.stop - self.gates.start)
        return theta
