"""ARX models and transfer functions as their pictures see them: one ratio of polynomials and a dead time per input."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.linear.of_polynomials import of_polynomials
from sysid.estimation.linear.process.uncertainty import drawn_polynomials
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import AbstractModel, FittedProcess
from sysid.models.contract.ratio import Ratio

DRAWS = 200
"""Parameters drawn from their distribution for a band."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearView:
    """From one input to the output: ``B / F`` after a dead time, polynomials ascending in ``1/z``, or in ``s``.

    Args:
        name: The input; of several outputs, the output from the input.
        unit: The input's unit.
        source: Which input.
        target: Which output.
        discrete: Whether the polynomials are in ``1/z``.
        sample_time: Seconds.
        delay: Dead time in samples; a whole number of a discrete one.
        B: Numerators: the model's first, then those drawn from its uncertainty, shape ``(1 + n_draws, n_b)``.
        F: Denominators, shape ``(1 + n_draws, n_f)``.
    """

    name: str
    unit: str
    source: int
    target: int
    discrete: bool
    sample_time: float
    delay: float
    B: NDArray[np.float64]
    F: NDArray[np.float64]

    def responses(self, frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Frequency responses, the model's first.

        Args:
            frequency: In rad/s, shape ``(n_points,)``.

        Returns:
            Output unit per input unit, shape ``(1 + n_draws, n_points)``.
        """
        s = 1j * frequency
        x = np.exp(-s * self.sample_time) if self.discrete else s
        powers = x ** np.arange(max(self.B.shape[1], self.F.shape[1]))[:, np.newaxis]
        dead = np.exp(-s * self.sample_time * self.delay)
        top, bottom = self.B @ powers[: self.B.shape[1]], self.F @ powers[: self.F.shape[1]]
        return np.asarray(dead * top / bottom, dtype=np.complex128)

    def phase(self, frequency: NDArray[np.float64]) -> NDArray[np.float64]:
        """Phase of the model's own frequency response, with all the turns that it makes from zero frequency on.

        A dead time turns it more than once between the points of any grid, so the turns are counted root by root.

        Args:
            frequency: In rad/s, shape ``(n_points,)``, in any order.

        Returns:
            In radians, shape ``(n_points,)``.
        """
        if not self.B[0].any():
            return np.zeros(len(frequency))
        lowest = 1e-6 * np.pi / self.sample_time
        w = np.append(np.maximum(frequency, lowest), lowest)
        with np.errstate(divide="ignore", invalid="ignore"):  # at a pole on the circle
            wrapped = np.angle(self.responses(w)[0])
        turned = self._turned(w)
        quarters = sum(int(np.sum(_at_rest(self._roots(one), self.discrete))) * sign for one, sign in self._factors)
        begun = 0.5 * np.pi * quarters
        # Of a negative gain 180 degrees, from which a lag falls, or -180, from which a lead rises.
        opposite = np.pi if turned[-1] <= begun or quarters else -np.pi
        away = np.abs(np.angle(np.exp(1j * (wrapped - turned)))) > 0.5 * np.pi
        turned += opposite if 2 * np.count_nonzero(away) > len(away) else 0.0
        exact = wrapped + 2.0 * np.pi * np.round((turned - wrapped) / (2.0 * np.pi))
        exact = np.where(np.isfinite(exact), exact, turned)
        # A pole and a zero that nearly cancel beside 1 may be taken for different kinds, and be a turn apart.
        further = exact[-1] - begun
        turns = np.sign(further) * np.floor((np.abs(further) + 0.5 * np.pi) / (2.0 * np.pi))
        return np.asarray(exact[:-1] - 2.0 * np.pi * turns)

    def _turned(self, frequency: NDArray[np.float64]) -> NDArray[np.float64]:
        """The phase by roots and dead time, up to the sign of the gain; each root's part never leaves a half turn."""
        w = frequency * self.sample_time
        lead = int(np.flatnonzero(self.B[0])[0]) if self.discrete else 0
        turned = -w * (self.delay + lead)
        for polynomial, sign in self._factors:
            for root in self._roots(polynomial):
                turned = turned + sign * _turned_by(root, w, self.discrete)
        return turned

    @property
    def _factors(self) -> tuple[tuple[NDArray[np.float64], int], ...]:
        """Numerator and denominator, and whether their roots turn forward or back."""
        return (self.B[0], 1), (self.F[0], -1)

    def _roots(self, polynomial: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Roots in the z plane, or in the s plane times the sample time, so that a size says the same in any unit."""
        return self.roots(polynomial) * (1.0 if self.discrete else self.sample_time)

    def roots(self, polynomial: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Roots of a row of ``B`` or ``F`` in the z or the s plane."""
        return np.asarray(np.roots(polynomial if self.discrete else polynomial[::-1]), dtype=np.complex128)


def linear_views(model: AbstractModel, uncertainty: Uncertainty | None, seed: int = 0) -> list[LinearView]:
    """The model by input, those without any parameter left out.

    Args:
        model: The model.
        uncertainty: Of its parameters, as its fit gives it; ``None`` draws nothing.
        seed: Of the draws.

    Returns:
        One view per input that has parameters.
    """
    views = []
    drawn_from = uncertainty if isinstance(model, FittedProcess) else of_polynomials(model, uncertainty)
    ends, several = model.ends, len(model.mapping.outputs) > 1
    for (o, j), ratio in model.ratios.items():
        if not len(ratio.B):
            continue
        name = f"{ends.outputs[o]} from {ends.inputs[j]}" if several else ends.inputs[j]
        Bs, Fs = ratio.B[np.newaxis], ratio.F[np.newaxis]
        if drawn_from is not None and (drawn := _drawn(model, drawn_from, j, ratio, seed)) is not None:
            drawn_B, drawn_F = drawn
            Bs, Fs = np.concatenate([Bs, drawn_B]), np.concatenate([Fs, drawn_F])
        views.append(
            LinearView(
                name=name, unit=ends.input_units[j], source=j, target=o, discrete=ratio.discrete,
                sample_time=model.sample_time, delay=ratio.delay, B=Bs, F=Fs,
            )
        )  # fmt: skip
    return views


def _drawn(
    model: AbstractModel, uncertainty: Uncertainty, j: int, ratio: Ratio, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Numerators and denominators of one input drawn from their joint distribution, ascending powers.

    ``None`` where the records do not determine one of them: to draw the others alone would say that it is known.
    """
    if isinstance(model, FittedProcess):
        return drawn_polynomials(model, uncertainty, j, draws=DRAWS, seed=seed)
    b = [i for i, text in enumerate(uncertainty.names) if text.startswith(ratio.of_numerator)]
    f = [i for i, text in enumerate(uncertainty.names) if text.startswith(ratio.of_denominator)]
    chosen = np.array(b + f, dtype=np.intp)
    covariance = uncertainty.covariance[np.ix_(chosen, chosen)]
    if not b or not np.isfinite(covariance).all():
        return None
    draws = np.random.default_rng(seed).multivariate_normal(
        uncertainty.values[chosen], covariance, size=DRAWS, method="eigh"
    )
    ones = np.ones((DRAWS, 1))
    B, rest = draws[:, : len(b)], draws[:, len(b) :]
    parts = (ones, -rest if ratio.past_outputs else rest) if ratio.discrete else (rest, ones)
    return B, np.concatenate(parts, axis=1)


def _at_rest(roots: NDArray[np.complex128], discrete: bool) -> NDArray[np.bool_]:
    """Which roots are those of a sum or of a difference, to within what roots of higher order are known to."""
    return np.asarray(np.abs(roots - (1.0 if discrete else 0.0)) < 1e-6, dtype=np.bool_)


def _turned_by(root: complex, w: NDArray[np.float64], discrete: bool) -> NDArray[np.float64]:
    """How far a factor with one root has turned between zero frequency and others; of a pair, both together."""
    root = root if not _at_rest(np.array([root]), discrete)[0] else 1.0 if discrete else 0.0
    if not discrete:
        return np.asarray(np.angle(1j * w - root if root.real <= 0.0 else root - 1j * w))
    if abs(root) <= 1.0:
        return np.asarray(np.angle(1.0 - root * np.exp(-1j * w)))
    return np.asarray(np.angle(1.0 - np.exp(1j * w) / root) - w)
