"""What a fit says of the parameters of equations: their intervals, and what the records leave open."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.evidence import settled
from sysid.estimation.least_squares.state import Solution
from sysid.estimation.parameters.named import Named
from sysid.estimation.results.uncertainty import Uncertainty

if TYPE_CHECKING:
    from sysid.estimation.grey_box.profile import Profile

Array = NDArray[np.float64]

OPEN = 0.5
"""Share of its prior's variance that a parameter keeps where the records do not determine it."""

ROUNDING = 1e-14
"""Curvature along a direction, with 1 along each parameter, that may be nothing."""

ALL_BUT_NOTHING = 0.99
"""Share of a parameter's variance that its prior alone makes where the records say nothing of it."""

TOGETHER = 0.99
"""Correlation above which two parameters cannot be told apart."""

MOST_NAMES = 4
"""Parameters that a sentence names."""

ALIKE = 0.9999
"""The same of parameters that nobody named: coefficients of one smooth response are nearly as correlated as a rule."""

MUCH_WIDER = 2.0
"""Times that an interval is wider with nothing held at a bound, from which on that is told."""

NORMAL = 1.959964
"""Standard deviations of half a 95 % interval."""

UNLIKE = 0.2
"""Share of half an interval by which the end of another may differ and not be told."""

WITHIN = re.compile(r"_at?\d")
"""Names, in equations that nobody wrote, of what lies within the range of its signal: breakpoints, and poles."""


class Scaled(Protocol):
    """What is trained: in which scales, and between which bounds."""

    @property
    def scale(self) -> Array:
        """Of each parameter, in its unit."""

    @property
    def bounds(self) -> tuple[Array, Array] | None:
        """Of each, over its scale."""


def with_evidence(solution: Solution, n_samples: int) -> Solution:
    """A solution with its evidence, where it converged before there was any.

    Args:
        solution: Where the fit ended.
        n_samples: How many residuals there are.

    Returns:
        The solution.
    """
    if solution.evidence is not None or not solution.at.finite:
        return solution
    state = solution.state
    prior, evidence = settled(state.prior, state.theta, state.at, n_samples)
    return replace(solution, state=replace(state, prior=prior, evidence=evidence))


@dataclass(frozen=True, kw_only=True, eq=False)
class Findings:
    """What is known of the parameters with a name where a fit ended.

    Args:
        named: Those that were estimated, those by case once for each case.
        values: In their units.
        covariance: In their units; NaN of those that the records leave open.
        bound: Of each the bound at which it stands, or ``scale`` where it is held as a scale that no record can tell;
            an empty text for none.
        profiles: Of each, where somebody asked for them.
        widened: How many times as wide each interval would be were no parameter held at a bound; 1 where nothing is.
    """

    named: tuple[Named, ...]
    values: Array
    covariance: Array
    bound: tuple[str, ...]
    profiles: Sequence[Profile] = ()
    widened: Array | None = None

    @classmethod
    def of(cls, solution: Solution, trained: Scaled, named: tuple[Named, ...], *, built: bool = False) -> Findings:
        """What a solution says.

        Args:
            solution: Where the fit ended, with its evidence.
            trained: What is trained.
            named: Those that were estimated.
            built: Whether nobody wrote the equations: what has a prior there is a scale between blocks that no record
                can tell, by construction. The others are told for that scale.

        Returns:
            The findings. A parameter at a bound is taken to be there for the others' sake, and has no interval.
        """
        prior, places = solution.state.prior, np.array([one.place for one in named], dtype=np.int64)
        whole = solution.theta
        bounds = trained.bounds or (np.full(len(whole), -np.inf), np.full(len(whole), np.inf))
        low, high = (side[places] for side in bounds)
        theta, scale = whole[places], trained.scale[places]
        at = ["low" if t <= a else "high" if t >= b else "" for t, a, b in zip(theta, low, high, strict=True)]
        at = ["scale" if built and one.parameter.prior is not None else s for one, s in zip(named, at, strict=True)]
        held = np.zeros(len(solution.theta), dtype=np.bool_)
        held[places] = [bool(side) for side in at]
        if not solution.at.finite:  # sensitivities that explode say nothing of any parameter
            covariance = np.full((len(named), len(named)), np.nan)
            return cls(named=named, values=theta * scale, covariance=covariance, bound=tuple(at))
        H = prior.beta * solution.at.gauss_newton + np.diag(prior.precision)
        free = np.flatnonzero(~held)
        root = np.sqrt(np.diag(H)[free])
        values, vectors = np.linalg.eigh(H[np.ix_(free, free)] / np.outer(root, root))
        half = vectors / np.sqrt(np.maximum(values, 1e-15)) / root[:, None]
        open_ = np.flatnonzero(~held[places])
        rows = half[np.searchsorted(free, places[open_])]
        inner = rows @ rows.T
        vague = np.array([named[i].parameter.prior is None for i in open_], dtype=np.bool_)
        unseen = np.sum(rows[:, values < ROUNDING] ** 2, axis=1)
        lost = _lost(inner, prior.precision[places[open_]], unseen) & vague
        inner[lost, :] = np.nan
        inner[:, lost] = np.nan
        covariance = np.full((len(named), len(named)), np.nan)
        covariance[np.ix_(open_, open_)] = inner
        released = held.copy()
        released[places] = [side == "scale" for side in at]
        return cls(
            named=named,
            values=theta * scale,
            covariance=covariance * np.outer(scale, scale),
            bound=tuple(at),
            widened=_widened(H, held, released)[places],
        )

    def uncertainty(self, noise_variance: float) -> Uncertainty:
        """As a fit keeps it.

        Args:
            noise_variance: Of the residuals.

        Returns:
            The uncertainty; a parameter's unit stands behind its name.
        """
        names = tuple(one.label for one in self.named)
        profile = np.array([[one.low, one.high] for one in self.profiles]) if self.profiles else None
        return Uncertainty(
            names=names,
            values=self.values,
            covariance=self.covariance,
            noise_variance=noise_variance,
            profile=profile,
        )

    @property
    def profiled(self) -> tuple[str, ...]:
        """What the profiles say: intervals without an end, other ends than the curvature's, and better minima."""
        told, half = [], NORMAL * np.sqrt(np.diag(self.covariance))
        for one, wald in zip(self.profiles, half, strict=False):  # none where nobody asked
            between = f"{one.low:.5g} to {one.high:.5g}"
            sides = " and ".join(side for side, end in (("low", one.low), ("high", one.high)) if np.isinf(end))
            apart = (
                np.abs([one.value - one.low - wald, one.high - one.value - wald]) / wald if wald > 0.0 else np.zeros(2)
            )
            if one.gained > 0.0:
                told.append(
                    f"The profile of {one.name} came to parameters that fit better than those of the fit (deviance "
                    f"{one.gained:.3g}): ask for more starts."
                )
            elif sides:
                told.append(
                    f"The records do not end the 95 % interval of {one.name} by profile likelihood, {between}: "
                    f"beyond its {sides} end others make up for it. Bound it, give it a prior, or record what tells it."
                )
            elif apart.max() > UNLIKE:
                told.append(
                    f"The 95 % interval of {one.name} by profile likelihood is {between}; from the curvature it would "
                    f"be {one.value - wald:.5g} to {one.value + wald:.5g}."
                )
        return tuple(told)

    @property
    def open(self) -> tuple[str, ...]:
        """Names of the parameters that the records leave open, or do not tell from one before."""
        deviations = np.sqrt(np.diag(self.covariance))
        with np.errstate(invalid="ignore"):
            correlation = np.abs(self.covariance / np.outer(deviations, deviations))
        named = zip(self.named, deviations, self.bound, strict=True)
        return tuple(
            one.name
            for i, (one, deviation, side) in enumerate(named)
            if (np.isnan(deviation) and not side) or (correlation[i, :i] > ALIKE).any()
        )

    @property
    def left_open(self) -> str:
        """How many of the parameters of equations that nobody wrote the records leave open, with names; or nothing."""
        # Breakpoints and coefficients of poles are of the order of 1: one that may be anything there is not known.
        wide = np.sqrt(np.diag(self.covariance)) > np.maximum(1.0, np.abs(self.values))
        wide &= [WITHIN.search(one.name) is not None for one in self.named]
        open_, n = self.open, len(self.named)
        left = [one.name for one, far in zip(self.named, wide, strict=True) if far or one.name in open_]
        names = ", ".join(left[:MOST_NAMES]) + (", ..." if len(left) > MOST_NAMES else "")
        return f"{len(left)} ({names}) of {n}" if left else ""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Parameters at a bound, that the records leave open, or that cannot be told apart."""
        told = []
        for one, value, side in zip(self.named, self.values, self.bound, strict=True):
            if side:
                told.append(
                    f"The parameter {one.name} stands at its bound, {value:g}: it has no interval. Widen the bound, or "
                    "fix it there."
                )
        told += self._while_held
        deviations = np.sqrt(np.diag(self.covariance))
        for one, deviation, side in zip(self.named, deviations, self.bound, strict=True):
            if np.isnan(deviation) and not side:
                told.append(
                    f"The records do not determine the parameter {one.name}. Fix it, give it a prior, or record "
                    "what it acts on."
                )
        with np.errstate(invalid="ignore"):
            correlation = self.covariance / np.outer(deviations, deviations)
        return (*told, *_together([one.name for one in self.named], np.abs(correlation)))

    @property
    def _while_held(self) -> list[str]:
        """A sentence where intervals are short only because another parameter is held at its bound."""
        if self.widened is None or self.profiles:
            return []
        known = ~np.isnan(np.diag(self.covariance))
        short = [i for i in np.flatnonzero(known) if self.widened[i] > MUCH_WIDER]
        if not short:
            return []
        names, most = ", ".join(self.named[i].name for i in short[:MOST_NAMES]), float(self.widened[short].max())
        return [
            f"{names}{', ...' if len(short) > MOST_NAMES else ''}: these intervals hold only if the parameter at the "
            f"bound is there; beside a free one they would be up to {most:.2g} times as wide. Ask for profiles "
            "(intervals: profile), or measure what tells them apart."
        ]


def _widened(curvature: Array, held: NDArray[np.bool_], released: NDArray[np.bool_]) -> Array:
    """How many times larger each standard deviation is where fewer parameters are held; 1 of those that are held."""
    times = np.ones(len(held))
    if (held == released).all():
        return times
    found = np.ones((2, len(held)))
    for row, fixed in zip(found, (held, released), strict=True):
        free = np.flatnonzero(~fixed)
        root = np.sqrt(np.diag(curvature)[free])
        values, vectors = np.linalg.eigh(curvature[np.ix_(free, free)] / np.outer(root, root))
        row[free] = np.sqrt(np.sum(vectors**2 / np.maximum(values, ROUNDING), axis=1)) / root
    open_ = np.flatnonzero(~held)
    times[open_] = found[1, open_] / found[0, open_]
    return times


def _lost(covariance: Array, precision: Array, unseen: Array) -> NDArray[np.bool_]:
    """Which parameters the records leave open, by what is left of their prior.

    ``unseen`` is the variance along directions whose curvature is nothing but rounding, which stands for the prior's.

    One that keeps most of its prior's variance is. Of five of which the records show three combinations, each may keep
    less: its deviation is its prior's all the same, and is told by no correlation with another one.
    """
    root = np.sqrt(precision)
    kept, directions = np.linalg.eigh(covariance * np.outer(root, root))
    left = np.diag(covariance) * precision
    lost: NDArray[np.bool_] = left > OPEN
    from_prior = np.maximum((directions[:, kept > OPEN] ** 2) @ kept[kept > OPEN], unseen * precision)
    others = np.flatnonzero(~lost)
    deviations = np.sqrt(np.diag(covariance)[others])
    near = np.triu(np.abs(covariance[np.ix_(others, others)]) > TOGETHER * np.outer(deviations, deviations), 1)
    alone = ~(near | near.T).any(axis=1)
    lost[others[alone & (from_prior[others] > ALL_BUT_NOTHING * left[others])]] = True
    return lost


def _together(names: Sequence[str], correlation: Array) -> list[str]:
    """One sentence for each group of parameters that can hardly be told apart, however many pairs it has."""
    near = np.triu(correlation > TOGETHER, 1)
    if not near.any():
        return []
    from scipy.sparse.csgraph import connected_components  # 5 MB that most fits do without

    count, group = connected_components(near, directed=False)
    told = []
    for one in range(count):
        members = np.flatnonzero(group == one)
        if len(members) < 2:
            continue
        most = float(np.max(correlation[np.ix_(members, members)][near[np.ix_(members, members)]]))
        listed = f"{', '.join(names[i] for i in members[:-1])} and {names[members[-1]]}"
        told.append(
            f"The parameters {listed} can hardly be told apart (correlation up to {most:.4f}): the run hardly changes "
            "where they move together, and the interval of each may be too short. Fix some of them, or give priors."
            if len(members) > 2
            else f"The parameters {listed} can hardly be told apart (correlation {most:.4f}): the run hardly changes "
            "where both move, and the interval of each may be too short. Fix one of them, or give it a prior."
        )
    return told
