"""Where the parameters of a neural state space stand, what draws them, and the starts around its linear model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.least_squares.evidence import Group, Prior
from sysid.estimation.networks.initialise import AbstractLayout, spread
from sysid.estimation.networks.neural.start import FLAT_ALPHA, LARGEST_POLE
from sysid.models.networks.neural_sizes import Sizes

READOUT_SPREAD = 1e-4
"""Standard deviation of the readouts of the first start: so small that its free run is the linear model's, even where a
state sums up what it is given over thousands of samples."""


LOUD_SPREAD = 0.5
"""Standard deviation of the readouts of the other starts, for a state that forgets at once; of a slower one, what
makes its neurons move it as far. A system that switches has a linear model from which small neurons do not lead away;
``python -m tests.benchmarks state_space_peers`` fits a pneumatic cylinder from it alone, and from these too."""


LOST, QUIETER = 4.0, 12
"""Times the loss of a start without its neurons from which they are too loud for it, and how often they are halved
then: those that grow without bound lead a resonance away for good, from where no gradient leads back."""


FASTEST_TURN = 3.0
"""Radians a sample that a pair turns at most: beyond a half turn it would be another pair."""


TIME_CONSTANTS = (100.0, 5.0, 0.5)
"""How many times faster than the slowest of the random time constants the fastest one is; fewest samples of the
fastest; and the spread of each around its place between the two, as a natural logarithm."""


@dataclass(frozen=True, kw_only=True, eq=False)
class NeuralLayout(AbstractLayout):
    """Where the parameters of one fit stand, and where they start.

    Args:
        sizes: States, inputs, neurons.
        base: The linear model with neurons that do nothing, the records' initial states behind it, shape
            ``(n_parameters,)``.
        longest: Samples of the longest record: no time constant can be known that is longer.
        loss: Of a free run over the records, where neurons can lead it away for good; ``None`` where they are bounded.
    """

    sizes: Sizes
    base: NDArray[np.float64]
    longest: int
    loss: Callable[[NDArray[np.float64]], float] | None = None

    def centre(self) -> NDArray[np.float64]:
        """What the prior draws the model's parameters to: the linear model, and neurons that do nothing."""
        return self.base[: self.sizes.count].copy()

    def prior(self, centre: NDArray[np.float64], *, alpha: float, beta: float) -> Prior:
        """The prior a fit begins with; one group for each column of the hidden weights, as for NARX.

        The precision of initial states is its own: they are nearly free. See the base class.
        """
        s = self.sizes
        places = np.arange(len(centre))
        places[s.held] = -1
        members = {"linear": places[s.linear], "readout": places[s.readout], "output": places[s.output_linear]}
        parts = {
            "hidden": places[s.hidden].reshape(-1, s.row),
            "output hidden": places[s.output_hidden].reshape(-1, s.row),
        }
        if s.directions is not None:
            # They share what they read. Drawn to nothing alike they keep their rank: no step is drawn out of it.
            parts = {"hidden": np.concatenate([*parts.values()])}
        for name, columns in parts.items():
            members |= {f"{name} {i}": columns[:, i] for i in range(s.row)}
        members |= {"output readout": places[s.output_readout], "start": places[s.start], "records": places[s.count :]}
        members = {name: where[where >= 0] for name, where in members.items()} | {"held": s.held}
        groups = tuple(Group(name=name, members=where) for name, where in members.items() if len(where))
        alphas = [
            FLAT_ALPHA * beta if name in {"start", "records"} else alpha for name in members if len(members[name])
        ]
        return Prior(centre=centre, groups=groups, alphas=np.array(alphas), beta=beta)

    def start(
        self,
        number: int,
        rng: np.random.Generator,
        centre: NDArray[np.float64],  # noqa: ARG002 - each start is drawn to its own
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The linear model for the first start; in turn random dynamics, and the linear model with loud neurons, after.

        Each is drawn to its own linear model; see the base class.
        """
        if number == 0:
            return self.draw(rng, self.base), self.base
        s = self.sizes
        # Behind sums alone there is nothing to draw, and without inputs nothing that says how sums are fed.
        drawn = number % 2 and (not s.integrators or (s.sums.start > 0 and s.inputs > 0))
        base = self._random_dynamics(rng) if drawn else self.base
        forgets = 1.0 - np.minimum(np.abs(np.diag(base[s.linear].reshape(s.states, -1))), LARGEST_POLE)
        theta = self.draw(rng, base)
        theta[s.readout] = (LOUD_SPREAD * forgets[:, None] * rng.standard_normal((s.states, s.neurons))).ravel()
        return self._quietened(s.hold(theta), base), base

    def _quietened(self, theta: NDArray[np.float64], base: NDArray[np.float64]) -> NDArray[np.float64]:
        """The same start, its neurons so quiet that they do not lead its free run away from all that is measured."""
        if self.loss is None:
            return theta
        theta, most = theta.copy(), LOST * self.loss(base)
        for _ in range(QUIETER):
            if self.loss(theta) <= most:
                break
            theta[self.sizes.readout] *= 0.5
        return theta

    def _random_dynamics(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """States of their own time constants, from the slowest that the linear model has down to fast ones.

        As many pairs as swing in the linear model swing here, near its frequencies. Each state is driven by the inputs
        so that it ranges as far as they do; each output is a random sum of them.
        """
        s, n = self.sizes, self.sizes.sums.start
        linear = linalg.eigvals(self.base[s.linear].reshape(s.states, -1)[:n, :n])
        radius = min(float(np.abs(linear).max()), 1.0)
        ratio, least, spread = TIME_CONSTANTS
        slowest = min(max(-1.0 / np.log(max(radius, 1e-3)) if radius < 1.0 else np.inf, least), max(self.longest, 1))
        fastest = min(max(slowest / ratio, least), slowest)
        places = np.linspace(np.log(fastest), np.log(slowest), n) if n > 1 else np.log([slowest])
        poles = np.exp(-np.exp(-(places + spread * rng.standard_normal(n))))
        gains = rng.standard_normal((n, s.inputs))
        base = np.zeros(len(self.base))
        M, L, E = (base[part].reshape(rows, -1) for part, rows in self._parts)
        M[:n, :n] = _swinging(poles, linear, spread, rng)
        M[:n, s.states : -1] = gains * (1.0 - poles)[:, None]
        L[:, :n] = 0.5 * rng.standard_normal((s.outputs, n))
        E[:n, : s.inputs] = gains
        return self._with_sums(base, rng) if s.integrators else base

    @property
    def _parts(self) -> tuple[tuple[slice, int], ...]:
        s = self.sizes
        return (s.linear, s.states), (s.output_linear, s.outputs), (s.start, s.states)

    def _with_sums(self, base: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
        """Random dynamics before the sums of the linear model.

        Dynamics that are random would add up to anything in a sum. At inputs that stay, they give sums and outputs what
        those of the linear model do.
        """
        s, n = self.sizes, self.sizes.sums.start
        (M, L, E), (M0, L0, E0) = (
            [theta[part].reshape(rows, -1) for part, rows in self._parts] for theta in (base, self.base)
        )
        random, linear = (
            np.linalg.lstsq(np.eye(n) - one[:n, :n], one[:n, s.states :], rcond=None)[0] for one in (M, M0)
        )
        M[n:], L[:, n:], E[n:] = M0[n:], L0[:, n:], E0[n:]
        fed = M0[n:, :n] @ linear + M0[n:, s.states :]
        M[n:, :n] = rng.standard_normal((s.integrators, n)) * np.linalg.norm(fed, axis=1)[:, None] / np.sqrt(n)
        M[n:, s.states :] = fed - M[n:, :n] @ random
        L[:, s.states :] += L0[:, :n] @ linear - L[:, :n] @ random
        base[s.count :].reshape(-1, s.states)[:, n:] = self.base[s.count :].reshape(-1, s.states)[:, n:]
        return base

    def draw(self, rng: np.random.Generator, centre: NDArray[np.float64]) -> NDArray[np.float64]:
        """The linear model with neurons that hardly do anything; see the base class.

        States and inputs are taken to have the range 1.
        """
        s = self.sizes
        theta = centre.copy()
        read = self._read(rng, centre)
        n = len(read)
        for hidden, readout, k in (
            (s.hidden, s.readout, s.neurons),
            (s.output_hidden, s.output_readout, s.output_neurons),
        ):
            if k == 0:
                continue
            weights, biases = spread(rng.uniform(-1.0, 1.0, (k, n)) @ read, n)
            theta[hidden] = np.column_stack([weights, biases]).ravel()
            theta[readout] = READOUT_SPREAD * rng.standard_normal(readout.stop - readout.start)
        return s.hold(theta)

    def _read(self, rng: np.random.Generator, centre: NDArray[np.float64]) -> NDArray[np.float64]:
        """What neurons read of states and inputs, shape ``(n_read, n_states + n_inputs)``.

        Of a few directions the first are those of the outputs, by which much that bends goes; the others are random.
        """
        s = self.sizes
        if s.directions is None:
            return np.eye(s.row - 1)
        outputs = centre[s.output_linear].reshape(s.outputs, s.row)[: s.directions, :-1]
        more = rng.standard_normal((s.directions - len(outputs), s.row - 1))
        return np.concatenate([outputs, more / np.linalg.norm(more, axis=1, keepdims=True)])


def _swinging(
    poles: NDArray[np.float64], linear: NDArray[np.complex128], spread: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Real poles, as many pairs of which swing as do in a linear model: those that turn by more than they die away."""
    turns, dies = np.angle(linear), -np.log(np.clip(np.abs(linear), 1e-12, 1.0))
    swings = turns[(turns > dies) & (turns < np.pi)]
    A = np.diag(poles)
    for pair, turn in enumerate(np.sort(swings)):
        both = slice(len(A) - 2 * pair - 2, len(A) - 2 * pair)
        radius = float(np.sqrt(np.prod(poles[both])))
        angle = min(turn * np.exp(spread * rng.standard_normal()), FASTEST_TURN)
        A[both, both] = radius * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return A
