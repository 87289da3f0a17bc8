r"""Profile likelihood: how far a parameter may move while the others, fitted again, keep the error within the noise.

With :math:`F` the penalised loss and :math:`\beta` the precision of the residuals, both as at the end of the fit, the
deviance of a value :math:`v` of parameter :math:`i` is

.. math:: d_i(v) = 2\beta\,\Bigl(\min_{\theta:\,\theta_i = v} F(\theta) - F(\hat\theta)\Bigr),

and the interval of probability :math:`P` is where :math:`d_i(v) \le \chi^2_{1,P}` (Raue et al. 2009, "Structural and
practical identifiability analysis of partially observed dynamical models by exploiting the profile likelihood"; Bates
and Watts 1988, "Nonlinear regression analysis and its applications", section 6.1, where its root with a sign is the
profile t). Were the run linear in the parameters it would be the interval from the curvature, which knows the minimum
alone: where a run saturates in a parameter, that one is too short on one side and too long on the other.

Each end is looked for from the minimum outwards by secants over :math:`\sqrt{d}`, which is nearly straight, and then
between two values that hold it; each fit begins at the last one, moved along its tangent. A bound that comes first is
the end; where the error never rises enough there is no end.

Limits: local, as the fit is: a second minimum beyond a ridge is found only where the way leads there; the number of
independent samples is what the evidence took it to be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.estimation.grey_box.provider import EquationProvider
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.state import Solution, State
from sysid.estimation.least_squares.termination import Termination
from sysid.estimation.parameters.named import Named

Array = NDArray[np.float64]

LEVEL = 0.95
TERMS = Termination(max_iterations=60, tolerance=1e-6, patience=3)
"""When the fit of the others has ended: a millionth of the error of some hundred samples moves no end."""

NEAR = 0.01
"""How near the root of the deviance has to come to its bound."""

STRAIGHT = 3.0
"""Times its bound up to which the root of a deviance is taken for straight."""

MOST_STEPS = 30
"""Fits for each end at most."""

FURTHEST = 1e4
"""Scales of a parameter beyond which nothing ends its interval: from some ten times that on the vague prior would."""

BETTER = 0.02
"""Deviance below that of the fit from which on it was not at its minimum."""

ROUNDS = 3
"""Times that a profile begins anew from a better minimum."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Profile:
    """The profile of one parameter.

    Args:
        name: Of the parameter, and of the case whose value it is.
        value: Where the fit has it, in its unit.
        low: Lower end of its interval; minus infinity where the records do not end it.
        high: Upper end; infinity where they do not.
        level: Probability of the interval.
        bound: Which ends are bounds of the parameter: ``low``, ``high``, both or none.
        values: Where the others were fitted again, rising, shape ``(n,)``.
        deviances: Of each, shape ``(n,)``.
        gained: Deviance by which another minimum, which the profile came to, is better than the fit; 0 for none.
    """

    name: str
    value: float
    low: float
    high: float
    level: float
    bound: tuple[str, ...]
    values: Array
    deviances: Array
    gained: float = 0.0


@dataclass(kw_only=True, eq=False)
class Profiler:
    """Profiles of the parameters of one fit.

    Args:
        provider: The records, as the fit ended on them.
        solution: Where it ended, with its evidence.
        level: Probability of the intervals.
    """

    provider: EquationProvider
    solution: Solution
    level: float = LEVEL
    _gained: float = field(default=0.0, init=False)

    def of(self, named: Named) -> Profile:
        """The profile of one parameter.

        Args:
            named: Which.

        Returns:
            The profile; from a better minimum where it comes to one.
        """
        value = float(self.solution.theta[named.place] * self.provider.scale[named.place])
        state = self.solution.state
        for _ in range(ROUNDS):
            walk = _Walk(provider=self.provider, state=state, place=named.place, level=self.level)
            low, high = walk.end(-1.0), walk.end(1.0)
            better = min(walk.seen.values(), key=lambda one: one[0])
            if better[0] >= -BETTER:
                break
            state = walk.freed(better[1])
            self._gained = max(self._gained, 2.0 * state.prior.beta * (_whole(self.solution.state) - _whole(state)))
        scale, values = self.provider.scale[named.place], np.array(sorted(walk.seen))
        limits = [side[named.place] for side in self.provider.bounds]
        return Profile(
            name=named.name,
            value=value,
            low=float(low * scale),
            high=float(high * scale),
            level=self.level,
            bound=tuple(
                side for side, end, limit in zip(("low", "high"), (low, high), limits, strict=True)
                if np.isfinite(end) and end == limit
            ),
            values=values * scale,
            deviances=np.array([walk.seen[one][0] for one in values.tolist()]),
            gained=self._gained,
        )  # fmt: skip

    def all(self, named: Sequence[Named]) -> list[Profile]:
        """The profiles of some parameters."""
        return [self.of(one) for one in named]


def _whole(state: State) -> float:
    return state.at.loss + state.prior.penalty(state.theta)


@dataclass(kw_only=True, eq=False)
class _Walk:
    """The way from the minimum to both ends, in what is trained."""

    provider: EquationProvider
    state: State
    place: int
    level: float
    seen: dict[float, tuple[float, Array]] = field(default_factory=dict)
    """By value its deviance, and what is trained there."""

    def __post_init__(self) -> None:
        self.seen[self.start] = (0.0, self.state.theta)

    @property
    def start(self) -> float:
        return float(self.state.theta[self.place])

    @property
    def bound(self) -> float:
        """The deviance's root at an end."""
        return float(scipy.stats.norm.ppf(0.5 + 0.5 * self.level))

    def end(self, side: float) -> float:
        """The end on one side.

        Args:
            side: 1 for the upper, -1 for the lower.

        Returns:
            The end; infinite where there is none.
        """
        limit = float(self.provider.bounds[0 if side < 0.0 else 1][self.place])
        if side * (limit - self.start) <= 0.0:
            return limit
        inner, outer, slope = (self.start, 0.0), None, 0.0
        step = self._deviation()
        for _ in range(MOST_STEPS):
            ahead = step if outer is None else _share(inner, outer, slope, self.bound)
            value = inner[0] + side * ahead
            value = limit if outer is None and side * (value - limit) >= 0.0 else value
            root = self._root(value, inner[0])
            if abs(root - self.bound) <= NEAR:
                return value
            if root > self.bound:
                outer = (value, root)
                continue
            if value == limit:
                return limit
            if abs(value - self.start) > FURTHEST * max(1.0, abs(self.start)):
                return side * np.inf
            slope = (root - inner[1]) / abs(value - inner[0])
            wanted = 1.1 * (self.bound - root) / slope if slope > 0.0 else np.inf
            step = float(np.clip(wanted, step / 10.0, 4.0 * step))
            inner = (value, root)
        return side * np.inf if outer is None else outer[0]

    def _deviation(self) -> float:
        """A first step: what the curvature says, or a tenth of the scale."""
        H = self._curvature()
        root = np.sqrt(np.diag(H))
        values, vectors = np.linalg.eigh(H / np.outer(root, root))
        spread = vectors[self.place] / np.sqrt(np.maximum(values, 1e-15))
        found = self.bound * float(np.linalg.norm(spread)) / root[self.place]
        return found if 0.0 < found < 10.0 * max(abs(self.start), 1.0) else 0.1

    def _curvature(self) -> Array:
        prior = self.state.prior
        return np.asarray(prior.beta * self.state.at.gauss_newton + np.diag(prior.precision))

    def _root(self, value: float, near: float) -> float:
        """Root of the deviance at a value, from a fit that begins where it was at another."""
        low, high = (side.copy() for side in self.provider.limits)
        low[self.place] = high[self.place] = value * self.provider.scale[self.place]
        held = replace(self.provider, limits=np.stack([low, high]))
        begins = [self._moved(near, value), self.seen[near][1].copy()]
        begins[1][self.place] = value
        loss, begin = min(((held.loss(one), k) for k, one in enumerate(begins)), key=lambda pair: pair[0])
        if not np.isfinite(loss):
            return np.inf
        solution = self._minimised(held, begins[begin])
        found = 2.0 * self.state.prior.beta * (_whole(solution.state) - _whole(self.state))
        self.seen[value] = (found, solution.theta)
        return float(np.sqrt(max(found, 0.0)))

    def _moved(self, near: float, value: float) -> Array:
        """Where the others go as one parameter moves, to first order at the minimum, from where they were last."""
        H, theta = self._curvature(), self.seen[near][1].copy()
        low, high = self.provider.bounds
        others = np.flatnonzero((np.arange(len(theta)) != self.place) & (theta > low) & (theta < high))
        root = np.sqrt(np.diag(H))[others]
        turned = np.linalg.lstsq(
            H[np.ix_(others, others)] / np.outer(root, root), H[others, self.place] / root, rcond=1e-12
        )
        theta[others] -= (value - near) * turned[0] / root
        theta = np.clip(theta, low, high)
        theta[self.place] = value
        return theta

    def _minimised(self, provider: EquationProvider, theta: Array) -> Solution:
        engine = LevenbergMarquardt(termination=TERMS, evidence_after=None)
        return engine.minimise_within(provider, theta, self.state.prior)

    def freed(self, theta: Array) -> State:
        """A better minimum, with nothing held."""
        return self._minimised(self.provider, theta).state


def _share(inner: tuple[float, float], outer: tuple[float, float], slope: float, bound: float) -> float:
    """How far to go from a value within the interval, where another beyond it is known.

    Args:
        inner: The value within, and its root.
        outer: The value beyond, and its root, which may be infinite.
        slope: Of the root on the way to the one within; 0 where there was none yet.
        bound: The root at the end.

    Returns:
        A step: by the straight line between both where that is one, else by the slope, else half of the way.
    """
    whole, missing = abs(outer[0] - inner[0]), bound - inner[1]
    if outer[1] < STRAIGHT * bound:
        return whole * float(np.clip(missing / (outer[1] - inner[1]), 0.05, 0.95))
    wanted = missing / slope if slope > 0.0 else np.inf
    return wanted if wanted < 0.5 * whole else 0.5 * whole
