"""ARX models and transfer functions as their pictures see them: one ratio of polynomials and a dead time per input."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import AbstractModel
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
        delay: Dead time in samples.
        B: Numerators: the model's first, then those drawn from its uncertainty, shape ``(1 + n_draws, n_b)``.
        F: Denominators, shape ``(1 + n_draws, n_f)``.
    """

    name: str
    unit: str
    source: int
    target: int
    discrete: bool
    sample_time: float
    delay: int
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
    ends, several = model.ends, len(model.mapping.outputs) > 1
    for (o, j), ratio in model.ratios.items():
        if not len(ratio.B):
            continue
        name = f"{ends.outputs[o]} from {ends.inputs[j]}" if several else ends.inputs[j]
        Bs, Fs = ratio.B[np.newaxis], ratio.F[np.newaxis]
        if uncertainty is not None and (drawn := _drawn(uncertainty, ratio, seed)) is not None:
            drawn_B, drawn_F = drawn
            Bs, Fs = np.concatenate([Bs, drawn_B]), np.concatenate([Fs, drawn_F])
        views.append(
            LinearView(
                name=name, unit=ends.input_units[j], source=j, target=o, discrete=ratio.discrete,
                sample_time=model.sample_time, delay=ratio.delay, B=Bs, F=Fs,
            )
        )  # fmt: skip
    return views


def _drawn(uncertainty: Uncertainty, ratio: Ratio, seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Numerators and denominators of one input drawn from their joint distribution, ascending powers.

    ``None`` where the records do not determine one of them: to draw the others alone would say that it is known.
    """
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
