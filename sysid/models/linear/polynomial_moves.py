"""How far the free run of a transfer function moves with its numerators and denominators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.models.converting.realisation import Realisation, parted

APART = 1e-4
"""Step of a difference, in standard deviations, where those are no larger than the coefficients."""
NOTHING = 1e-14
"""Part of the largest coefficient of a numerator below which one is a rounding."""
AT_ONE = 1e-6
"""Distance of a denominator's sum from 0 below which its response to a constant is not told from an integrator's."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Polynomials:
    """A transfer function in the channels' units.

    Args:
        numerators: ``B`` of each input, ascending powers.
        denominators: ``F`` of each input, ascending powers; the first (discrete) or the last is 1.
        constant: Output without inputs.
        delays: Dead times in samples.
        sample_time: Seconds; ``None`` where the powers are of ``1/q`` and not of ``s``.
        moving: By input, whether it goes straight from sample to sample; it is held otherwise.
    """

    numerators: Sequence[NDArray[np.float64]]
    denominators: Sequence[NDArray[np.float64]]
    constant: float
    delays: Sequence[float]
    sample_time: float | None
    moving: Sequence[bool]

    @property
    def vector(self) -> NDArray[np.float64]:
        """Numerator and denominator but for its 1, input by input; the constant; dead times between samples in s."""
        parts = [
            part
            for B, F in zip(self.numerators, self.denominators, strict=True)
            for part in (B, F[1:] if self.sample_time is None else F[:-1])
        ]
        return np.concatenate([*parts, [self.constant], self._late_times()])

    @property
    def late(self) -> tuple[int, ...]:
        """Inputs whose dead time ends between samples: it is a number among the others."""
        return tuple(j for j, delay in enumerate(self.delays) if parted(delay)[1])

    def _late_times(self) -> NDArray[np.float64]:
        return (self.sample_time or 1.0) * np.array([self.delays[j] for j in self.late])

    def at(self, vector: NDArray[np.float64]) -> Polynomials:
        """The same with other numbers.

        Args:
            vector: As :attr:`vector`.

        Returns:
            The transfer function.
        """
        numerators, denominators, at = [], [], 0
        for B, F in zip(self.numerators, self.denominators, strict=True):
            numerators.append(vector[at : at + len(B)])
            free = vector[at + len(B) : at + len(B) + len(F) - 1]
            denominators.append(np.concatenate([[1.0], free] if self.sample_time is None else [free, [1.0]]))
            at += len(B) + len(F) - 1
        delays = list(self.delays)
        for j, delay in zip(self.late, vector[at + 1 :].tolist(), strict=True):
            delays[j] = max(delay / (self.sample_time or 1.0), 0.0)
        return Polynomials(
            numerators=numerators, denominators=denominators, constant=float(vector[at]), delays=delays,
            sample_time=self.sample_time, moving=self.moving,
        )  # fmt: skip

    def moves(self, factor: NDArray[np.float64], inputs: NDArray[np.float64], *, known: bool) -> NDArray[np.float64]:
        """Derivatives of the free run along some directions.

        Args:
            factor: Directions of :attr:`vector`, shape ``(n_parameters, n_directions)``.
            inputs: Shape ``(n_samples, n_inputs)``; held at their first sample before.
            known: Whether the output before the first sample is known, so that it does not move with the parameters.

        Returns:
            Shape ``(n_samples, n_directions)``.
        """
        begun = self._levels(inputs[0]) if known else None
        base, columns = self.vector, []
        for column in factor.T:
            larger = float(np.max(np.abs(column) / (np.abs(base) + np.abs(base).max() * 1e-3 + 1e-300), initial=0.0))
            h = APART / max(1.0, larger)
            there, back = (self.at(base + sign * h * column)._run(inputs, begun) for sign in (1.0, -1.0))
            columns.append((there - back) / (2.0 * h))
        return np.column_stack(columns) if columns else np.zeros((len(inputs), 0))

    def _discrete(self, j: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        B, F = self.numerators[j], self.denominators[j]
        if self.sample_time is None:
            return B, F
        late = parted(self.delays[j])[1]
        # With the sample time as the unit of time and the numerator's size as that of the output: coefficients below
        # 1e-14 would be taken for zeros.
        powers = self.sample_time ** (len(F) - 1.0 - np.arange(len(F)))
        top, size = B * powers[: len(B)], float(np.abs(B * powers[: len(B)]).max(initial=0.0))
        leading = np.trim_zeros(np.where(np.abs(top) > NOTHING * size, top, 0.0), "b")
        if not len(leading):
            return np.zeros(1), np.asarray(scipy.signal.cont2discrete(([1.0], (F * powers)[::-1]), 1.0)[1])
        A, B, C, D = scipy.signal.tf2ss(leading[::-1] / size, (F * powers)[::-1])
        plant = Realisation(A=A, B=B[:, 0], C=C, D=D[0]).sampled(1.0, moving=self.moving[j], late=late)
        num, den = scipy.signal.ss2tf(plant.A, plant.B[:, np.newaxis], plant.C, plant.D[:, np.newaxis])
        return size * num[0], np.asarray(den)

    def _levels(self, first: NDArray[np.float64]) -> NDArray[np.float64]:
        """What each input holds the output at; 0 where it would hold it nowhere."""
        found = np.zeros(len(first))
        for j, u in enumerate(first):
            b, a = self._discrete(j)
            found[j] = u * b.sum() / a.sum() if abs(a.sum()) > AT_ONE * np.abs(a).sum() else 0.0
        return found

    def _run(self, inputs: NDArray[np.float64], begun: NDArray[np.float64] | None) -> NDArray[np.float64]:
        levels = self._levels(inputs[0]) if begun is None else begun
        y = np.full(len(inputs), self.constant)
        for j, (delay, _) in enumerate(map(parted, self.delays)):
            b, a = self._discrete(j)
            u = np.concatenate(
                [np.full(min(delay, len(inputs)), inputs[0, j]), inputs[: max(len(inputs) - delay, 0), j]]
            )
            state = scipy.signal.lfiltic(b, a, np.full(len(a) - 1, levels[j]), np.full(len(b), inputs[0, j]))
            y = y + scipy.signal.lfilter(b, a, u, zi=state)[0]
        return np.asarray(y)
