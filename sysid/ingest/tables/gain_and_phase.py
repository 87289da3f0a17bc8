"""Whether gain and phase of a frequency response go together: what a file does not say of their units and their sign.

Of a plant that is stable, and no faster one way than the other, the phase follows from the gain (Bode 1945, "Network
analysis and feedback amplifier design", chapter XIV):

    phase(w0) = 1/pi * integral of d ln(gain)/du * ln coth(|u|/2) du,    u = ln(w/w0)

A dead time turns it further in proportion to the frequency, and a negative gain by half a turn. So the measured phase
over that of the gain is 1: 57 where degrees are read as radians, -1 where a lag is written as a positive number, and
neither of them where decibels are read as ratios. Zeros in the right half plane, and unstable poles, keep no such law:
then there is no word of theirs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FEWEST = 8
"""Points from which a phase is compared."""
MOVES = 0.3
"""Radians that the phase of the gain has to move over, root mean square, to tell anything."""
ALIKE = 0.75, 1.35
"""Measured phase over that of the gain which is taken for 1."""
CLOSE, CLOSE_SHARE = 0.15, 0.15
"""Root mean square of what is left in radians, and as a share of how far the phase moves, up to which it follows."""
ENDS = 0.5
"""Part of a decade over which the slope at either end is taken."""


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """How a measured phase goes with a gain.

    Args:
        ratio: Measured phase over that of the gain; near 1 where they are of one plant.
        left: Root mean square of what is left, in radians.
        moves: How far the phase moves, root mean square, in radians.
        opposite: Whether the gain is negative: the phase stands half a turn off.
    """

    ratio: float
    left: float
    moves: float
    opposite: bool

    @property
    def follows(self) -> bool:
        """Whether the phase is that of the gain, whatever its sign."""
        low, high = ALIKE
        return low < abs(self.ratio) < high and self.left < max(CLOSE, CLOSE_SHARE * self.moves)

    @property
    def agrees(self) -> bool:
        """Whether it is, sign and all."""
        return self.follows and self.ratio > 0.0

    @property
    def turned(self) -> bool:
        """Whether it is that of the gain with its sign turned."""
        return self.follows and self.ratio < 0.0


def agreement(frequency: Array, log_gain: Array, phase: Array) -> Agreement | None:
    """How a measured phase goes with a gain.

    Args:
        frequency: In any unit, above 0 and rising, shape ``(n_points,)``.
        log_gain: Natural logarithm of the gain, shape ``(n_points,)``.
        phase: In radians, shape ``(n_points,)``.

    Returns:
        It; ``None`` where there are too few points, or the gain moves too little to tell.

    Example:
        >>> w = np.geomspace(0.01, 100.0, 60)
        >>> response = 3.0 / (1.0 + 1j * w)
        >>> found = agreement(w, np.log(np.abs(response)), np.angle(response))
        >>> found.agrees, round(found.ratio, 1)
        (True, 1.0)
        >>> agreement(w, np.log(np.abs(response)), np.degrees(np.angle(response))).agrees
        False
    """
    if len(frequency) < FEWEST or not np.isfinite(log_gain).all():
        return None
    expected, measured = phase_of_gain(frequency, log_gain), np.unwrap(phase)
    if np.std(expected) < MOVES:
        return None
    columns = np.column_stack([expected, np.ones_like(frequency)])
    first = _fitted(columns, measured)
    # A dead time explains whatever turns in proportion: it is asked only where nothing else does.
    return first if first.follows else _fitted(np.column_stack([columns, frequency / frequency[-1]]), measured)


def _fitted(columns: Array, measured: Array) -> Agreement:
    found = np.linalg.lstsq(columns, measured, rcond=None)[0]
    left = float(np.sqrt(np.mean((measured - columns @ found) ** 2)))
    half_turns = round(float(found[1]) / np.pi)
    late = len(found) < 3 or found[0] * found[2] <= 0.0  # a dead time turns as a lag does
    return Agreement(
        ratio=float(found[0]) if late else float("nan"), left=left, moves=float(np.std(measured)),
        opposite=half_turns % 2 == 1,
    )  # fmt: skip


def phase_of_gain(frequency: Array, log_gain: Array) -> Array:
    """The phase that goes with a gain, by Bode's relation; beyond either end the gain goes on as it does there.

    Args:
        frequency: Above 0 and rising, shape ``(n_points,)``.
        log_gain: Natural logarithm of the gain, shape ``(n_points,)``.

    Returns:
        In radians, shape ``(n_points,)``.
    """
    u = np.log(frequency)
    slopes = np.concatenate([[_slope(u - u[0], log_gain)], np.diff(log_gain) / np.diff(u)])
    slopes = np.append(slopes, _slope(u[-1] - u, log_gain, sign=-1.0))
    weights = np.diff(_kernel(u[np.newaxis, :] - u[:, np.newaxis]), axis=1, prepend=0.0, append=np.pi**2 / 2.0)
    return np.asarray(weights @ slopes / np.pi)


def _slope(away: Array, log_gain: Array, sign: float = 1.0) -> float:
    """The slope at an end, over the points that are not far from it."""
    near = away <= max(ENDS * np.log(10.0), float(np.sort(away)[2]))
    return sign * float(np.polyfit(away[near], log_gain[near], 1)[0])


def _kernel(u: Array) -> Array:
    """The integral of ln coth(|v|/2) from below up to ``u``; pi^2/2 in all."""
    at, values = _table()
    half = np.interp(np.abs(u), at, values)
    return np.asarray(np.pi**2 / 4.0 + np.sign(u) * half)


@cache
def _table() -> tuple[Array, Array]:
    """The integral from 0 on, close to 0 by its series: ln coth(v/2) is -ln(v/2) there."""
    at = np.concatenate([[0.0], np.geomspace(1e-9, 40.0, 4000)])
    middle = np.sqrt(at[1:-1] * at[2:])
    with np.errstate(divide="ignore"):
        steps = -np.log(np.tanh(middle / 2.0)) * np.diff(at[1:])
    first = at[1] * (1.0 - np.log(at[1] / 2.0))
    values = np.concatenate([[0.0, first], first + np.cumsum(steps)])
    return at, values * (np.pi**2 / 4.0 / values[-1])
