"""Where a curve begins that has some values whatever its slope: one that turns back, as a square or a magnitude, too.

Learnt curves are written with a slope of 1 where they are straight. At a scale and a level of what they see they have
any slope: the first piece of a piecewise curve ends where its range begins, and a polynomial is written around a place
at which it is 0 and steep.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid.models.blocks.curves import WIDTH, Curve

Array = NDArray[np.float64]

TURNS = ("polynomial", "piecewise", "rounded", "network")
"""Kinds of curves that are learnt and may turn back."""
REAL = 1e-9
"""Imaginary part of a root that is none."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CurveStart:
    """Where a curve begins: its values are those at ``scale * x + level``.

    Args:
        scale: Of what it sees.
        level: Likewise.
        bends: Where its parameters begin, by the ends of their names.
        weights: Of a network; none of other curves.
    """

    scale: float = 1.0
    level: float = 0.0
    bends: dict[str, float] = field(default_factory=dict)
    weights: Array = field(default_factory=lambda: np.zeros(0))


def curve_start(curve: Curve, x: Array, y: Array) -> CurveStart | None:
    """Where a learnt curve begins that comes close to some values.

    Args:
        curve: The curve.
        x: Shape ``(n,)``, from -1 to 1.
        y: Shape ``(n,)``.

    Returns:
        The start; ``None`` for a curve with limits, or a polynomial that is 0 nowhere in the range.
    """
    if curve.kind == "polynomial":
        return _polynomial(curve.size, x, y)
    if curve.kind in {"piecewise", "rounded"}:
        return _pieces(curve, x, y)
    return _network(curve, x, y) if curve.kind == "network" else None


def _polynomial(degree: int, x: Array, y: Array) -> CurveStart | None:
    whole = np.polynomial.Polynomial.fit(x, y, degree, domain=[-1.0, 1.0])
    roots = [float(one.real) for one in np.atleast_1d(whole.roots()) if abs(one.imag) < REAL]
    at = max((one for one in roots if abs(one) <= 1.0), key=lambda one: abs(float(whole.deriv()(one))), default=None)
    slope = 0.0 if at is None else float(whole.deriv()(at))
    if at is None or slope == 0.0:
        return None
    orders = range(2, degree + 1)
    bends = {f"c{n}": float(whole.deriv(n)(at)) / math.factorial(n) / slope**n for n in orders}
    return CurveStart(scale=slope, level=-slope * at, bends=bends)


def _pieces(curve: Curve, x: Array, y: Array) -> CurveStart:
    places = np.linspace(-1.0, 1.0, curve.size + 1)[:-1]
    ahead = np.subtract.outer(x, places)
    bends = np.maximum(ahead, 0.0) if curve.kind == "piecewise" else WIDTH * np.logaddexp(0.0, ahead / WIDTH)
    *slopes, level = np.linalg.lstsq(np.column_stack([bends, np.ones(len(x))]), y - x, rcond=None)[0].tolist()
    begun = {f"slope{n}": slope for n, slope in enumerate(slopes, start=1)}
    return CurveStart(
        level=level, bends=begun | {f"at{n}": at + level for n, at in enumerate(places.tolist(), start=1)}
    )


def _network(curve: Curve, x: Array, y: Array) -> CurveStart:
    weights, k = curve.weights(x, y), curve.size
    hidden = np.tanh(np.outer(x, weights[: 2 * k : 2]) + weights[1 : 2 * k : 2])
    weights[-1] = np.mean(y - x - hidden @ weights[2 * k : -2] - weights[-2] * x)
    return CurveStart(weights=weights)
