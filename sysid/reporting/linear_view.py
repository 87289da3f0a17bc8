"""ARX models and transfer functions as their pictures see them: one ratio of polynomials and a dead time per input."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.uncertainty import Uncertainty
from sysid.models import ARXModel, Domain, TransferFunctionModel

LinearModel = ARXModel | TransferFunctionModel

DRAWS = 200
"""Parameters drawn from their distribution for a band."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearView:
    """From one input to the output: ``B / F`` after a dead time, polynomials ascending in ``1/z``, or in ``s``.

    Args:
        name: The input.
        unit: Its unit.
        discrete: Whether the polynomials are in ``1/z``.
        sample_time: Seconds.
        delay: Dead time in samples.
        B: Numerators: the model's first, then those drawn from its uncertainty, shape ``(1 + n_draws, n_b)``.
        F: Denominators, shape ``(1 + n_draws, n_f)``.
    """

    name: str
    unit: str
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


def linear_views(model: LinearModel, uncertainty: Uncertainty | None, seed: int = 0) -> list[LinearView]:
    """The model by input, those without any parameter left out.

    Args:
        model: The model.
        uncertainty: Of its parameters, as its fit gives it; ``None`` draws nothing.
        seed: Of the draws.

    Returns:
        One view per input that has parameters.
    """
    views = []
    for j, (name, unit) in enumerate(zip(model.mapping.inputs, model.input_units, strict=True)):
        B, F, delay = _arx(model, j) if isinstance(model, ARXModel) else _ratio(model, j)
        if not len(B):
            continue
        discrete = isinstance(model, ARXModel) or model.orders.domain is Domain.DISCRETE
        Bs, Fs = B[np.newaxis], F[np.newaxis]
        if uncertainty is not None:
            drawn_B, drawn_F = _drawn(uncertainty, name, discrete=discrete, arx=isinstance(model, ARXModel), seed=seed)
            Bs, Fs = np.concatenate([Bs, drawn_B]), np.concatenate([Fs, drawn_F])
        views.append(
            LinearView(name=name, unit=unit, discrete=discrete, sample_time=model.sample_time, delay=delay, B=Bs, F=Fs)
        )
    return views


Ratio = tuple[NDArray[np.float64], NDArray[np.float64], int]


def _arx(model: ARXModel, j: int) -> Ratio:
    return model.b[j], np.concatenate([[1.0], -model.a]), model.orders.nk[j]


def _ratio(model: TransferFunctionModel, j: int) -> Ratio:
    return model.numerator(j), model.denominator(j), model.delays[j]


def _drawn(
    uncertainty: Uncertainty, name: str, *, discrete: bool, arx: bool, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Numerators and denominators of one input drawn from their joint distribution, ascending powers."""
    top, bottom = (f"b({name}, ", "a(") if arx else (f"B({name}, ", f"F({name}, ")
    b = [i for i, text in enumerate(uncertainty.names) if text.startswith(top)]
    f = [i for i, text in enumerate(uncertainty.names) if text.startswith(bottom)]
    chosen = np.array(b + f)
    covariance = np.nan_to_num(uncertainty.covariance[np.ix_(chosen, chosen)])
    draws = np.random.default_rng(seed).multivariate_normal(
        uncertainty.values[chosen], covariance, size=DRAWS, method="eigh"
    )
    ones = np.ones((DRAWS, 1))
    B, rest = draws[:, : len(b)], draws[:, len(b) :]
    # An ARX model's coefficients of past outputs stand on the other side of its equation.
    parts = (ones, -rest if arx else rest) if discrete else (rest, ones)
    return B, np.concatenate(parts, axis=1)
