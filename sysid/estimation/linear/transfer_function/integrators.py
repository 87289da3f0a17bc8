"""Poles at the edge: those that the records do not tell from an integrator, or from a pair that swings undamped.

They are held there, and the others follow.

Each input has integrators of its own. One may be held where another is not: beside an integrator a slow pole may lie as
near to 1 as records of that length can tell, and is none. What is held moves the rest a little, so that each choice
is judged by where the rest comes to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.provider import AbstractProvider, Linearisation
from sysid.estimation.least_squares.termination import Termination
from sysid.estimation.linear import slow_poles
from sysid.estimation.linear.poles import sections_of
from sysid.estimation.linear.transfer_function.runs import End, flat_prior
from sysid.estimation.linear.variable_projection import PoleParameters, Sections
from sysid.models.converting.orthonormal_basis import Domain, section_poles

STEPS = 30
"""Steps of the other poles, once some are held: they begin next to their minimum."""
TOGETHER = 1e-9
"""Relative difference of two distances from 1 that are those of a pair."""

Array = NDArray[np.float64]
Places = NDArray[np.intp]
NONE = np.empty(0, dtype=np.intp)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Free(AbstractProvider):
    """The same problem in those parameters that are not held.

    Args:
        whole: The problem.
        at: All parameters, the held ones where they stay.
        free: Which are free.
    """

    whole: AbstractProvider
    at: Array
    free: NDArray[np.intp]

    @property
    def n_samples(self) -> int:  # type: ignore[override]
        """Samples that count."""
        return self.whole.n_samples

    def full(self, theta: Array) -> Array:
        """All parameters.

        Args:
            theta: The free ones.

        Returns:
            Shape ``(n_parameters,)``.
        """
        full = self.at.copy()
        full[self.free] = theta
        return full

    def loss(self, theta: Array) -> float:
        """Half the weighted sum of squared residuals; see the base class."""
        return self.whole.loss(self.full(theta))

    def linearise(self, theta: Array, *, correlation: bool = True) -> Linearisation:
        """Loss, gradient and Gauss-Newton matrix of the free parameters; see the base class."""
        here = self.whole.linearise(self.full(theta), correlation=correlation)
        normal = here.gauss_newton[np.ix_(self.free, self.free)]
        return replace(here, gradient=here.gradient[self.free], gauss_newton=normal)


def near_ones_put(sections: Sections, domain: Domain, sample_time: float, near: float) -> Sections:
    """Poles that are near 1 put there, while the others stay.

    Args:
        sections: For each input its sections.
        domain: Their domain.
        sample_time: Seconds.
        near: How far from 1, in the z plane.

    Returns:
        For each input its sections.
    """
    reach = near if domain is Domain.DISCRETE else near / sample_time
    return _put(sections, domain, [np.flatnonzero(_distance(part, domain) < reach) for part in sections])


def _put(sections: Sections, domain: Domain, which: Sequence[Places]) -> Sections:
    """Some poles of each input put at 1."""
    moved = []
    for part, places in zip(sections, which, strict=True):
        poles = _poles(part, domain)
        poles[places] = _at(domain)
        moved.append(sections_of(poles, domain))
    return tuple(moved)


def all_at_one(end: End, domain: Domain, sample_time: float, near: float) -> End:
    """An end with all poles at 1 that are near, whatever that costs; see :func:`with_integrators`.

    Args:
        end: The end; its problem lets poles lie anywhere.
        domain: Of its poles.
        sample_time: Seconds.
        near: How far from 1, in the z plane.

    Returns:
        The end; itself where no pole is near.
    """
    reach = near if domain is Domain.DISCRETE else near / sample_time
    found = [_close(part, domain, reach) for part in end.sections]
    return _held(end, domain, found) if any(map(len, found)) else end


def with_edge(end: End, domain: Domain, sample_time: float, near: float) -> End:
    """An end with all poles at 1, and all pairs on the circle, that its records do not tell from there.

    Args:
        end: The end; its problem lets poles lie anywhere.
        domain: Of its poles.
        sample_time: Seconds.
        near: How far from there, in the z plane, a pole may lie to be asked about.

    Returns:
        The end; see :func:`with_integrators`.
    """
    return _undamped(with_integrators(end, domain, sample_time, near), domain, sample_time, near)


def with_integrators(end: End, domain: Domain, sample_time: float, near: float) -> End:
    """An end with all poles at 1 that its records do not tell from there.

    Args:
        end: The end; its problem lets poles lie anywhere.
        domain: Of its poles.
        sample_time: Seconds.
        near: How far from 1, in the z plane, a pole may lie to be asked about.

    Returns:
        The end; no worse than the one that is given by more than chance, which it is itself where no pole is held.
        Two poles that are nearly 1 make a ramp of their beginnings, which two at 1 do not: that counts as a parameter.
    """
    reach = near if domain is Domain.DISCRETE else near / sample_time
    inputs = range(len(end.sections))
    every = all_at_one(end, domain, sample_time, near)
    if every is end or not _worse(every, end):
        return every
    # One after the other, the nearest first; an input whose nearest is told from 1 has no further one.
    reached, left = end, set(inputs)
    while left:
        nearest = {j: _close(reached.sections[j], domain, reach, one=True) for j in left}
        left = {j for j in left if len(nearest[j])}
        if not left:
            break
        j = min(left, key=lambda j: _distance(reached.sections[j], domain)[nearest[j][0]])
        tried = _held(reached, domain, [nearest[j] if i == j else NONE for i in inputs])
        if _worse(tried, end) or _held_count(tried) <= _held_count(reached):
            left -= {j}
        else:
            reached = tried
    return reached


def _distance(part: Sequence[Array], domain: Domain) -> Array:
    """Of the poles of one input from 1, or from 0 in the s plane."""
    return np.asarray(np.abs(_poles(part, domain) - _at(domain)))


def _close(part: Sequence[Array], domain: Domain, reach: float, *, one: bool = False) -> Places:
    """Poles of one input near 1 that are not there; with ``one`` the nearest alone, with its conjugate."""
    away = _distance(part, domain)
    close = np.flatnonzero((away > slow_poles.INTEGRATES * reach) & (away < reach))
    return close[away[close] <= away[close].min() * (1.0 + TOGETHER)] if one and len(close) else close


def _undamped(end: End, domain: Domain, sample_time: float, near: float) -> End:
    """The end with pairs on the circle that are no further from there than its records tell.

    A pair a little outside grows by next to nothing within the record, and by all numbers beyond it.
    """
    reached, left = end, _pairs(end, domain, sample_time, near)
    for at in left:
        theta = reached.theta.copy()
        theta[at] = 1.0 if domain is Domain.DISCRETE else 0.0
        tried = _from(reached, theta)
        reached = reached if _worse(tried, end) else tried
    return reached


def _pairs(end: End, domain: Domain, sample_time: float, near: float) -> list[int]:
    """Parameters that say how a pair of poles near the circle is damped, the nearest first."""
    found, at = list[tuple[float, int]](), 0
    discrete = domain is Domain.DISCRETE
    for order in end.provider.poles.orders:
        if order == 2:
            first, last = end.theta[at : at + 2]
            swings = abs(first) < 1.0 and last > 0.0 if discrete else 4.0 * last > first**2
            away = abs(last - 1.0) / 2.0 if discrete else abs(first) / 2.0 * sample_time
            if swings and 0.0 < away < near:
                found.append((away, at + 1 if discrete else at))
        at += order
    return [at for _, at in sorted(found)]


def _held(end: End, domain: Domain, which: Sequence[Places]) -> End:
    """The end with some poles put at 1, where the others lead to once all that are there are held."""
    return _from(end, end.provider.poles.theta(_put(end.sections, domain, which)))


def _from(end: End, theta: Array) -> End:
    """Where poles lead to once all that are at the edge are held."""
    free = ~_stays(end.provider.poles, theta)
    if free.any() and np.isfinite(end.provider.loss(theta)):
        rest = _Free(whole=end.provider, at=theta, free=np.flatnonzero(free))
        limits = Termination(max_iterations=STEPS, tolerance=1e-7, patience=6)
        engine = LevenbergMarquardt(termination=limits, evidence_after=None)
        theta = rest.full(engine.minimise_within(rest, theta[free], flat_prior(int(free.sum()))).theta)
    held = replace(end, theta=theta)
    return replace(held, curve=(*end.curve[:-1], replace(end.curve[-1], mse=2.0 * held.loss)))


def _worse(held: End, end: End) -> bool:
    """Whether the errors with poles at 1 are larger than those with poles anywhere beyond chance."""
    errors, free = held.errors, end.errors
    if not errors or not free:
        return not errors
    fewer = _held_count(held) - _held_count(end) + _rank(end) - _rank(held)
    return slow_poles.significantly_better(free, errors, parameters=max(fewer - 1, 0), scale=end.power)


def _held_count(end: End) -> int:
    """Parameters that hold poles."""
    return int(np.count_nonzero(_stays(end.provider.poles, end.theta)))


def _rank(end: End) -> int:
    """Of the columns beside the poles: numerators, and what is left of each record's beginning."""
    separated = end.provider.separated(end.theta)
    return 0 if separated is None else separated.span.shape[1]


def _stays(poles: PoleParameters, theta: Array) -> NDArray[np.bool_]:
    """Parameters that hold poles at 1: the first reflection coefficient of a section, or its constant coefficient.

    Where both poles of a section are there, so do both parameters. A pair on the circle is held by the second
    reflection coefficient, or by the damping.
    """
    stays, at = np.zeros(len(theta), dtype=np.bool_), 0
    for order in poles.orders:
        first, last = theta[at], theta[at + order - 1]
        if poles.domain is Domain.DISCRETE:
            stays[at] = first == -1.0
            stays[at + order - 1] |= order > 1 and last == 1.0
        else:
            stays[at + order - 1] = last == 0.0
            stays[at] |= order > 1 and first == 0.0
        at += order
    return stays


def _poles(part: Sequence[Array], domain: Domain) -> NDArray[np.complex128]:
    return np.concatenate([section_poles(d, domain) for d in part]).astype(np.complex128)


def _at(domain: Domain) -> float:
    """Where an integrator is."""
    return 1.0 if domain is Domain.DISCRETE else 0.0
