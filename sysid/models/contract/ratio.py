"""What a linear model is from one input to its output: a ratio of polynomials behind a dead time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Ratio:
    """From one input to the output: ``B / F`` after a dead time, polynomials ascending in ``1/z``, or in ``s``.

    Args:
        B: Numerator; empty for an input without any parameter.
        F: Denominator.
        delay: Dead time in samples; a whole number where the polynomials are in ``1/z``.
        discrete: Whether the polynomials are in ``1/z``.
        of_numerator: How the names of the numerator's parameters begin in the uncertainty of a fit.
        of_denominator: How those of the denominator begin.
        past_outputs: Whether the denominator's parameters are coefficients of past outputs, which stand on the other
            side of the equation.
        asks: How many coefficients of the input a record has to tell apart; ``None`` for those of both polynomials, or
            of the numerator where the other ones are those of past outputs.
    """

    B: NDArray[np.float64]
    F: NDArray[np.float64]
    delay: float
    discrete: bool
    of_numerator: str
    of_denominator: str
    past_outputs: bool = False
    asks: int | None = None
