"""Linear blocks as sections of first and second order in a row, which is how their equations are written.

A block is ``x(k+1) = A x + B w``, ``y = C x + D w`` in a form that any poles have, repeated ones too: the output is the
first state of the first section, and each section is fed the output of the next (observable form). It has as many
numbers as a transfer function, and poles close to 1 move little where one of them does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]
Poles = NDArray[np.complex128]

LARGEST_POLE, INTEGRATOR = 0.9999, 1.0
"""Poles of a start lie inside this radius, but for that of an integrator, which is 1 exactly."""
FARTHEST = 3.0
"""How far from 0 a block may have stood, in what it moves over a record: a slow one may have stood anywhere."""
RESPONSE = (50, 2_000)
"""Samples of an impulse response, at least and at most: five time constants of the slowest pole between."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Block:
    """A linear block.

    Args:
        sections: Of each section its coefficients: ``(p,)`` of ``z - p``, ``(a1, a2)`` of ``z^2 + a1 z + a2``.
        gains: ``B``, shape ``(n_states, n_inputs)``.
        direct: ``D``, shape ``(n_inputs,)``.
    """

    sections: tuple[tuple[float, ...], ...]
    gains: Array
    direct: Array

    @property
    def states(self) -> int:
        """Number of states."""
        return len(self.gains)

    @property
    def stillness(self) -> float:
        """What has to go into the last state at every sample for an output of 1; 0 where a pole is 1."""
        return math.prod(1.0 - one[0] if len(one) == 1 else 1.0 + sum(one) for one in self.sections)

    def filtered(self, w: Array) -> Array:
        """Its output over some inputs, from 0.

        Args:
            w: Shape ``(n_samples, n_inputs)``.

        Returns:
            Shape ``(n_samples,)``.
        """
        numerators, denominator = self._polynomials
        y = w @ self.direct
        for numerator, column in zip(numerators, w.T, strict=True):
            y += scipy.signal.lfilter(numerator, denominator, column)
        return np.asarray(y)

    def from_rest(self, w: Array) -> Array:
        """Its output over some inputs, from where it has settled at the first; from 0 where it all but integrates.

        Args:
            w: Shape ``(n_samples, n_inputs)``.

        Returns:
            Shape ``(n_samples,)``.
        """
        moved, (numerators, denominator) = self.filtered(w - w[0]), self._polynomials
        still = float(denominator.sum())
        stood = 0.0 if still <= 0.0 else float((self.direct + np.sum(numerators, axis=1) / still) @ w[0])
        return moved + stood if abs(stood) <= FARTHEST * np.abs(moved).max(initial=0.0) else moved

    @property
    def _polynomials(self) -> tuple[list[Array], Array]:
        """Numerators from each input, without what is direct, and the denominator."""
        basis, denominator = responses(self.sections, self.states + 1), np.array([1.0])
        for one in self.sections:
            denominator = np.convolve(denominator, [1.0, -one[0]] if len(one) == 1 else [1.0, *one])
        return [np.convolve(denominator, basis @ gains)[: self.states + 1] for gains in self.gains.T], denominator


@dataclass(frozen=True, kw_only=True, eq=False)
class Pair:
    """Two blocks around a curve.

    Args:
        before: The first, whose output ranges over -1 to 1.
        behind: The second, as it is behind the curve.
        x: What the curve is given, shape ``(n,)``.
        y: What it gives, as large as it is on the whole, shape ``(n,)``.
    """

    before: Block
    behind: Block
    x: Array
    y: Array


def sections_of(poles: Poles) -> tuple[tuple[float, ...], ...]:
    """Sections of first and second order with some poles, complex ones in pairs.

    Args:
        poles: The poles.

    Returns:
        The sections.

    Example:
        >>> sections_of(np.array([0.5, 0.8, 0.5 + 0.5j, 0.5 - 0.5j]))
        ((-1.0, 0.5), (-1.3, 0.4))
    """
    size = np.abs(poles)
    inside = np.where(
        (size > LARGEST_POLE) & (poles != INTEGRATOR), poles * LARGEST_POLE / np.maximum(size, 1e-12), poles
    )
    pairs = [p for p in inside if p.imag > 0.0]
    real = sorted(float(p.real) for p in inside if p.imag == 0.0)
    found: list[tuple[float, ...]] = [(float(-2.0 * p.real), float(p.real**2 + p.imag**2)) for p in pairs]
    while len(real) > 1:
        p, q = real.pop(), real.pop()
        found.append((-(p + q), p * q))
    return (*found, *((p,) for p in real))


def responses(sections: Sequence[tuple[float, ...]], n: int) -> Array:
    """What an impulse into each state makes of the output.

    Args:
        sections: The sections.
        n: Samples; the first is 0, as the state answers a sample later.

    Returns:
        Shape ``(n, n_states)``.
    """
    size = sum(map(len, sections))
    A, at = np.zeros((size, size)), 0
    for one in sections:
        last = at + len(one) - 1
        A[at : last + 1, at] = one if len(one) == 1 else [-one[0], -one[1]]
        if len(one) > 1:
            A[at, last] = 1.0
        if last + 1 < size:
            A[last, last + 1] = 1.0
        at = last + 1
    found, row = np.zeros((n, size)), np.eye(1, size)[0]
    for k in range(1, n if size else 0):
        found[k] = row
        row = row @ A
    return found


def samples_for(poles: Poles) -> int:
    """How long an impulse response has to be to tell everything."""
    slowest = min(float(np.abs(poles).max(initial=0.0)), LARGEST_POLE)
    return int(np.clip(-5.0 / np.log(slowest) if slowest > 0.0 else 0.0, *RESPONSE))


def block_of(poles: Poles, target: Array, *, direct: bool) -> Block:
    """The block of some poles that is closest to an impulse response.

    Args:
        poles: The poles.
        target: Impulse response to each input, from lag 0 on, shape ``(n_samples, n_inputs)``.
        direct: Whether it answers within the sample.

    Returns:
        The block.
    """
    sections = sections_of(poles)
    basis = responses(sections, len(target))
    scale = np.linalg.norm(basis, axis=0)
    gains = np.linalg.lstsq(basis / scale, target, rcond=1e-12)[0] / scale[:, None]
    D = target[0] if direct else np.zeros(target.shape[1])
    return Block(sections=sections, gains=gains, direct=D)
