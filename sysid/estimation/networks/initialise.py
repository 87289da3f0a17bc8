"""Where a network's fit starts: random hidden layer, and a linear part that repeats the last output."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.evidence import Group, Prior
from sysid.models import NARX, Ends, Lags, Member, VectorNARX
from sysid.models.contract.column_recursion import ColumnRecursion

READOUT_SPREAD = 1e-3
"""Standard deviation of the initial readout. Small, so that the first free run is the linear part's: bounded, and
with gradients that mean something."""


def spread(directions: NDArray[np.float64], reads: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A hidden layer after Nguyen and Widrow 1990: its active regions tile the unit cube of what it reads.

    Args:
        directions: Of the weights of each neuron, shape ``(neurons, n)``; of any length.
        reads: Dimensions of the cube.

    Returns:
        Weights of length ``0.7 * neurons ** (1 / reads)``, of the same shape, and the biases, spread over it.
    """
    neurons = len(directions)
    length = 0.7 * neurons ** (1.0 / reads)
    weights = length * directions / np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), 1e-12)
    biases = length * np.linspace(-1.0, 1.0, neurons) * np.sign(weights[:, 0]) if neurons > 1 else np.zeros(1)
    return weights, biases


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
    """Where each part of the flat parameter vector ``[W | b | readouts | constants | linear parts | gates]`` stands.

    Of a network that is fitted alone, or of a member of a cascade; of one output, or of several.

    Args:
        inputs: Lags of each input.
        outputs: Lags of each output.
        neurons: Number of neurons.
        linear: Whether there is a linear part.
        gated: Whether the neurons have gates; of a network with one output.
        name: What groups of parameters are named after; empty for a network that is fitted alone.
    """

    inputs: tuple[tuple[int, ...], ...]
    outputs: tuple[tuple[int, ...], ...]
    neurons: int
    linear: bool
    gated: bool = False
    name: str = ""

    @classmethod
    def of(cls, network: NARX | VectorNARX, n_inputs: int, n_outputs: int = 1) -> Layout:
        """The layout of a network that is fitted alone.

        Args:
            network: The structure.
            n_inputs: Inputs of the mapping.
            n_outputs: Outputs of the mapping.

        Returns:
            The layout.
        """
        if isinstance(network, VectorNARX):
            channels, gated = network.lags(n_inputs, n_outputs).inputs, False
        else:
            channels, gated = (*network.lags(n_inputs).inputs, network.output_delays), network.gated
        return cls(
            inputs=channels[:n_inputs],
            outputs=channels[n_inputs:],
            neurons=network.neurons,
            linear=network.feedthrough,
            gated=gated,
        )

    @classmethod
    def of_member(cls, model: Member, columns: ColumnRecursion) -> Layout:
        """The layout of a member of a cascade.

        Args:
            model: The member.
            columns: What it lowers to.

        Returns:
            The layout.
        """
        ends = Ends.of(model)
        return replace(cls.of_columns(columns, len(ends.inputs)), name="+".join(ends.outputs))

    @classmethod
    def of_columns(cls, columns: ColumnRecursion, n_inputs: int) -> Layout:
        """The layout of what runs.

        Args:
            columns: It.
            n_inputs: How many of its columns it does not write.

        Returns:
            The layout.
        """
        return cls(
            inputs=columns.lags.inputs[:n_inputs],
            outputs=columns.lags.inputs[n_inputs:],
            neurons=columns.neurons,
            linear=columns.linear,
            gated=columns.gated,
        )

    @cached_property
    def lags(self) -> Lags:
        """The regressors in order; the lags of all outputs, one output after the other, stand as those of one."""
        return Lags(inputs=self.inputs, output=tuple(lag for lags in self.outputs for lag in lags))

    @cached_property
    def columns(self) -> Lags:
        """The same regressors, each output as a channel of its own."""
        return Lags(inputs=(*self.inputs, *self.outputs), output=())

    @property
    def n_parameters(self) -> int:
        """Length of the vector."""
        return int(self.gates.stop)

    @property
    def hidden(self) -> slice:
        """Weights and biases of the neurons."""
        return slice(0, self.neurons * (self.lags.n_regressors + 1))

    @property
    def readout(self) -> slice:
        """Weights from the neurons to each output."""
        return slice(self.hidden.stop, self.hidden.stop + len(self.outputs) * self.neurons)

    @property
    def affine(self) -> slice:
        """Constants of all outputs, then the linear part of each."""
        each = 1 + (self.lags.n_regressors if self.linear else 0)
        return slice(self.readout.stop, self.readout.stop + len(self.outputs) * each)

    @property
    def gates(self) -> slice:
        """Weights of the gates, neuron by neuron."""
        return slice(self.affine.stop, self.affine.stop + (self.neurons * self.lags.n_regressors if self.gated else 0))

    def linear_part(self, output: int) -> slice:
        """Weights from the regressors to an output; none without a linear part.

        Args:
            output: Which output, from 0 on.

        Returns:
            Where they stand.
        """
        each = self.lags.n_regressors if self.linear else 0
        first = self.affine.start + len(self.outputs) + output * each
        return slice(first, first + each)

    def centre(self) -> NDArray[np.float64]:
        """What the prior draws the parameters to: "every output stays as it is", zero for everything else.

        Sampled fast, a system's next output is close to its last; drawing the weight of ``y(t-1)`` to 1 instead
        of 0 lets the regularisation shrink towards a model that holds, not one that collapses.
        """
        centre = np.zeros(self.n_parameters)
        column = len(self.lags.input_lag)
        for output, lags in enumerate(self.outputs):
            if self.linear and 1 in lags:
                centre[self.linear_part(output).start + column + lags.index(1)] = 1.0
            column += len(lags)
        return centre

    def prior(self, centre: NDArray[np.float64], *, alpha: float, beta: float) -> Prior:
        """The prior a fit begins with, its groups those of :meth:`groups`; see the base class."""
        groups = self.groups()
        return Prior(centre=centre, groups=groups, alphas=np.full(len(groups), alpha), beta=beta)

    def groups(self, first: int = 0) -> tuple[Group, ...]:
        """Groups of parameters that share a prior.

        The hidden weights of each regressor are a group of their own, and so are its gates, so that the evidence can
        find a regressor unimportant (automatic relevance determination, MacKay 1994); the biases are a group too, and
        each output's readout and linear part.

        Args:
            first: Where the network's parameters begin among those of all that are trained together.

        Returns:
            The groups, their members counted over all.
        """
        r, k, m = self.lags.n_regressors, self.neurons, len(self.outputs)
        by_regressor = np.arange(k * r).reshape(k, r)
        members = {f"hidden {i}": by_regressor[:, i] for i in range(r)} | {"bias": np.arange(k * r, k * (r + 1))}
        for j in range(m):
            suffix, linear = f" {j}" if m > 1 else "", self.linear_part(j)
            members[f"readout{suffix}"] = self.readout.start + np.arange(j * k, (j + 1) * k)
            members[f"linear{suffix}"] = np.array([self.affine.start + j, *range(linear.start, linear.stop)])
        if self.gated:
            members |= {f"gate {i}": self.gates.start + by_regressor[:, i] for i in range(r)}
        before = f"{self.name}: " if self.name else ""
        return tuple(Group(name=before + name, members=first + at) for name, at in members.items() if len(at))

    def draw(self, rng: np.random.Generator, centre: NDArray[np.float64]) -> NDArray[np.float64]:
        """A random start, the linear part where it is; see the base class."""
        r, k = self.lags.n_regressors, self.neurons
        theta = centre.copy()
        if k:
            weights, biases = spread(rng.uniform(-1.0, 1.0, (k, r)), r)
            theta[self.hidden] = np.concatenate([weights.ravel(), biases])
            theta[self.readout] = READOUT_SPREAD * rng.standard_normal(k * len(self.outputs))
            theta[self.gates] = READOUT_SPREAD * rng.standard_normal(self.gates.stop - self.gates.start)
        return theta
