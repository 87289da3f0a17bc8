"""Where the parameters of a grey box stand, what draws them, and where its fits start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid.equations import Net
from sysid.estimation.grey_box.preparing import WINDOW
from sysid.estimation.grey_box.provider import EquationProvider
from sysid.estimation.least_squares.evidence import Group, Prior
from sysid.estimation.networks.initialise import AbstractLayout, spread
from sysid.estimation.parameters.named import FLAT_ALPHA, Named, precision_of

Array = NDArray[np.float64]

READOUT_SPREAD = 1e-3
"""Standard deviation of the readouts where a fit starts: the equations are then as they were written."""

APART = 0.7
"""Standard deviation of the starts after the first: of the logarithm of a parameter that has a sign, of one that
has none over its scale."""

TRIES = 20
"""Draws after which a start whose free run explodes is taken as it is."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Begun:
    """Where a start begins that is not drawn.

    Args:
        parameters: Those that are estimated.
        weights: Of the networks; empty for networks that do nothing.
        norms: Levels and scales of what networks with these weights see and give.
    """

    parameters: Array
    weights: Array = field(default_factory=lambda: np.zeros(0))
    norms: Sequence[float] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class EquationLayout(AbstractLayout):
    """Where the parameters of one fit stand, and where they start.

    Args:
        named: The parameters, those by case once for each case.
        first_weight: Where the networks' weights begin.
        nets: The networks.
        provider: The records.
        begun: What is trained where the fit starts: declared starts, networks that do nothing, and initial states.
        norms: Levels and scales of what the networks see and give in these fits.
        begins: Where the first starts begin, in place of the declared one.
        scattered: Names of the parameters around which the starts after these are drawn; ``None`` for all.
        declared: Starts at the declared one.
    """

    named: tuple[Named, ...]
    first_weight: int
    nets: tuple[Net, ...]
    provider: EquationProvider
    begun: Array
    norms: tuple[float, ...] = ()
    begins: tuple[Begun, ...] = ()
    scattered: frozenset[str] | None = None
    declared: int = 1

    def centre(self) -> Array:
        """What the prior draws the model's parameters to: the declared starts, and networks that do nothing."""
        p = len(self.provider.scale)
        return np.asarray(self.begun[:p] * self.provider.scale)

    def prior(self, centre: Array, *, alpha: float, beta: float) -> Prior:
        """The prior a fit begins with; see the base class.

        What is declared of a parameter is known, of the others and of initial states nothing is, and the networks'
        weights are the evidence's.
        """
        p, w = len(self.provider.scale), self.first_weight
        vague = [one.place for one in self.named if one.parameter.prior is None]
        entries: list[tuple[str, NDArray[np.int64], bool, float]] = [
            ("parameters", np.array(vague, dtype=np.int64), True, FLAT_ALPHA)
        ]
        known = [one for one in self.named if one.parameter.prior is not None]
        entries += [(one.name, np.array([one.place]), True, precision_of(one.parameter)) for one in known]
        for number, net in enumerate(self.nets, start=1):
            hidden = w + np.arange(net.hidden.start, net.hidden.stop).reshape(net.neurons, -1)
            parts = {f"hidden {j}": hidden[:, j] for j in range(net.arguments + 1)}
            parts |= {"readout": w + np.arange(net.readout.start, net.readout.stop)}
            parts |= {"linear": w + np.arange(net.linear.start, net.linear.stop)}
            entries += [(f"net {number} {name}", members, False, alpha) for name, members in parts.items()]
        entries.append(("records", np.arange(p, len(centre)), True, FLAT_ALPHA))
        entries = [entry for entry in entries if len(entry[1])]
        del beta
        return Prior(
            centre=centre,
            groups=tuple(Group(name=name, members=members, known=known) for name, members, known, _ in entries),
            alphas=np.array([precision for *_, precision in entries]),
            beta=1.0,
        )

    def draw(self, rng: np.random.Generator, centre: Array) -> Array:
        """Networks that hardly do anything, the rest as it is; see the base class."""
        theta, w = centre.copy(), self.first_weight
        for net in self.nets:
            k, n = net.neurons, net.arguments
            weights, biases = spread(rng.uniform(-1.0, 1.0, (k, n)), n)
            theta[w + net.hidden.start : w + net.hidden.stop] = np.column_stack([weights, biases]).ravel()
            theta[w + net.readout.start : w + net.readout.stop] = READOUT_SPREAD * rng.standard_normal(k)
        return theta

    def start(self, number: int, rng: np.random.Generator, centre: Array) -> tuple[Array, Array]:
        """The declared start first, and parameters around it after; initial states suit each. See the base class."""
        del centre
        begun = self.draw(rng, self.begun)
        if number < len(self.begins):
            return self._begun(self.begins[number], begun)
        if number < self.declared:
            return begun, self.begun
        for _ in range(TRIES):
            theta = self._scattered(begun, rng)
            theta = self.provider.with_states(theta, self.provider.states(theta, WINDOW))
            if np.isfinite(self.provider.loss(theta)):
                return theta, self.begun
        return begun, self.begun

    def _begun(self, given: Begun, drawn: Array) -> tuple[Array, Array]:
        """A start as it is given; networks are drawn to what does nothing, whatever they begin as."""
        theta, w = drawn.copy(), self.first_weight
        theta[:w] = given.parameters / self.provider.scale[:w]
        if len(given.weights):
            theta[w : w + len(given.weights)] = renormed(self.nets, given.weights, given.norms, self.norms)
        theta = self.provider.with_states(theta, self.provider.states(theta, WINDOW))
        centre = theta.copy()
        centre[w : len(self.provider.scale)] = self.begun[w : len(self.provider.scale)]
        return theta, centre

    def _scattered(self, theta: Array, rng: np.random.Generator) -> Array:
        """Parameters around the declared ones, within their bounds."""
        moved, (low, high) = theta.copy(), self.provider.bounds
        drawn: dict[str, float] = {}  # the cases begin alike: none is known to differ from the others
        for entry in self.named:
            one, i = entry.parameter, entry.place
            z = drawn[one.name] if one.name in drawn else APART * rng.standard_normal()
            drawn[one.name] = z
            if self.scattered is not None and one.name not in self.scattered:
                continue
            if one.prior is not None:
                moved[i] += z
            elif one.start != 0.0:
                moved[i] *= np.exp(z)
            else:
                moved[i] += z
        return np.clip(moved, low, high)


def renormed(nets: Sequence[Net], weights: Array, before: Sequence[float], norms: Sequence[float]) -> Array:
    """The weights of the same functions, where what networks see and give is scaled otherwise.

    Args:
        nets: The networks.
        weights: Their weights.
        before: Levels and scales that go with them.
        norms: Those that shall.

    Returns:
        The weights with these.
    """
    found = weights.copy()
    for net in nets:
        m = net.arguments
        old, new = (np.asarray(one)[net.norm : net.norm + 2 * m + 1] for one in (before, norms))
        ratio, shift = old[1:-1:2] / new[1:-1:2], (new[:-1:2] - old[:-1:2]) * old[1:-1:2]
        hidden, linear = weights[net.hidden].reshape(net.neurons, m + 1), weights[net.linear]
        own = old[-1] / new[-1]
        found[net.hidden] = np.column_stack([hidden[:, :m] * ratio, hidden[:, m] + hidden[:, :m] @ shift]).ravel()
        found[net.readout] = own * weights[net.readout]
        found[net.linear] = own * np.append(linear[:m] * ratio, linear[m] + linear[:m] @ shift)
    return found
