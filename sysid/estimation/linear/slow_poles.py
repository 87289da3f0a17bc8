r"""Poles slower than the records: how slow one may be, when one beyond is taken, and what is said of it.

A drift of the output looks like the response of a plant that nearly integrates, and an output error that is minimised
without bound takes it for one: it fits the record, and its free run leaves on the next. So a pole of a model without
noise stays within a time constant of the longest record; one beyond is taken where it is significantly better. Errors
that hang together tell less than their number: of errors with autocorrelation :math:`\rho` from sample to sample,
:math:`n (1 - \rho^2)/(1 + \rho^2)` independent ones tell as much of their variance (Bayley and Hammersley 1946, "The
'effective' number of independent observations in an autocorrelated time series").
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

NEAR = 0.8
"""Time constant, in lengths of the longest record, from which a pole is one that the record cannot show whole."""
SLOWEST, AT_BOUND = 5.0, 0.02
"""Longest time constant of a stable pole of a transfer function, in lengths of the longest record; and by what share of
a bound a pole that stands there may be off."""
REACH = 5.0
"""Time constants in the longest record up to which a pole is asked about, whether it is one at 1."""
SIGNIFICANT = 6.6
"""Drop of twice the log-likelihood that one more free parameter has by chance in one case of a hundred."""
HANGS_TOGETHER = 0.9
"""Autocorrelation from sample to sample from which errors are told to hang together."""

ROUNDING = 1e-6
"""Root mean square of errors in scaled numbers below which they are rounding, of which nothing is said."""

INTEGRATES, FAR = 1e-9, 1e-6
"""Distance of a pole's magnitude from 1 within which it is one, and beyond which six digits tell it from 1. Above 1 it
is one up to there: of two poles at 1 rounding makes 1.00000002, and no status calls that growth."""

BOUND = (
    "it stands at its bound. The plant may integrate, or a drift of the output is taken for its response, and these "
    "records cannot tell; one that grows, held by a controller, is found by a TransferFunction. The "
    "level of the free run is not to be trusted: measure longer, or with inputs that bring "
    "the output back; where it drifts by itself, take that off first (repairs: {drift: {y: line}})."
)
ONE = (
    "the plant is taken to integrate, or to swing undamped, from which these records do not tell it. A drift of the "
    "output by itself looks the same: take that off first (repairs: {drift: {y: line}})."
)
SEEN = (
    "its interval says how well these records tell it from an integrator, unless the output drifts by itself, which "
    "looks the same: take that off first (repairs: {drift: {y: line}})."
)

Errors = Sequence[NDArray[np.float64]]


def largest_pole(lengths: Sequence[int]) -> float:
    """Magnitude of a pole with the longest time constant.

    Args:
        lengths: Of the records, in samples.

    Returns:
        Below 1.
    """
    return 1.0 - 1.0 / max(*lengths, 2)


def unseen(radius: float, lengths: Sequence[int]) -> bool:
    """Whether a pole of some magnitude is as slow as every record, or does not decay.

    Args:
        radius: The magnitude.
        lengths: Of the records, in samples.

    Returns:
        Whether it is.
    """
    return radius >= 1.0 - 1.0 / max(NEAR * max(lengths), 2.0)


def undecided(radius: float, lengths: Sequence[int]) -> bool:
    """Whether a pole stands at a bound, which holds it back: no record says where it is.

    One between the bounds and 1 is where the records put it, beyond chance.

    Args:
        radius: Magnitude of the slowest pole.
        lengths: Of the records, in samples.

    Returns:
        Whether it does.
    """
    constants = (1.0 - radius) * max(*lengths, 2)  # records in a time constant
    return any(abs(times * constants - 1.0) < AT_BOUND for times in (1.0, SLOWEST))


def stability(radius: float) -> str:
    """Whether a free run is stable, as a sentence.

    Args:
        radius: Magnitude of the largest pole.

    Returns:
        The sentence.

    Example:
        >>> stability(0.5)
        'The free run is stable: the largest pole has magnitude 0.500000.'
        >>> stability(1.0 - 1e-12)
        'The free run neither settles nor grows: the largest pole has magnitude 1, so that an error of it stays.'
        >>> stability(1.0 + 2e-8) == stability(1.0)
        True
    """
    if -INTEGRATES <= radius - 1.0 <= FAR:
        return "The free run neither settles nor grows: the largest pole has magnitude 1, so that an error of it stays."
    digits = 6 if abs(radius - 1.0) > FAR else 9
    verdict = "stable" if radius < 1.0 else "not stable"
    return f"The free run is {verdict}: the largest pole has magnitude {radius:.{digits}f}."


def _of(radius: float, lengths: Sequence[int]) -> str:
    """What is to be said of a slow pole by where it stands."""
    if undecided(radius, lengths):
        return BOUND
    return ONE if abs(radius - 1.0) <= FAR else SEEN


def warnings(radius: float, lengths: Sequence[int], told: tuple[str, ...]) -> tuple[str, ...]:
    """Which of :func:`notes` say what is wrong: that of a pole at its bound.

    Args:
        radius: Magnitude of the slowest pole.
        lengths: Of the records, in samples.
        told: The notes.

    Returns:
        One or none.
    """
    return told[:1] if undecided(radius, lengths) else ()


def _autocorrelation(errors: Errors) -> float:
    """From one sample to the next, the mean over outputs, from -1 to 1; samples that are 0 do not count."""
    together = sum((np.sum(e[1:] * e[:-1], axis=0) for e in errors), np.zeros(errors[0].shape[1]))
    alone = sum((np.sum(e * e, axis=0) for e in errors), np.zeros(errors[0].shape[1]))
    known = alone > 0.0
    return float(np.clip(np.mean(together[known] / alone[known]), -1.0, 1.0)) if known.any() else 0.0


def significantly_better(errors: Errors, than: Errors, *, parameters: int, scale: float) -> bool:
    """Whether errors are smaller than others beyond what chance and the number of parameters explain.

    Args:
        errors: The smaller ones, of each record.
        than: The others, likewise.
        parameters: That were fitted.
        scale: Mean square of the output, beside which both may be rounding.

    Returns:
        Whether they are.
    """
    n = sum(len(e) for e in errors)
    rho = max(abs(_autocorrelation(errors)), abs(_autocorrelation(than)))
    independent = n * (1.0 - rho**2) / (1.0 + rho**2)
    floor = 1e-20 * max(scale, np.finfo(np.float64).tiny)
    less, more = (sum(float(np.sum(e**2)) for e in some) / n + floor for some in (errors, than))
    return bool(independent * np.log(more / less) > SIGNIFICANT + parameters * np.log(max(independent, 2.0)))


def notes(radius: float, lengths: Sequence[int], errors: Errors | None) -> tuple[str, ...]:
    """What a reader should know of slow poles, and of errors that hang together.

    Args:
        radius: Magnitude of the slowest pole.
        lengths: Of the records, in samples.
        errors: Of a model without noise, in scaled numbers; ``None`` where the noise is modelled.

    Returns:
        None, one or two.
    """
    told = []
    # One that grows within the record is no slow one: the sentence on stability tells of it.
    if unseen(min(radius, 2.0 - radius), lengths):
        told.append(
            f"The slowest pole, of magnitude {radius:.6f}, is as slow as the longest record of {max(lengths)} samples, "
            f"or slower: {_of(radius, lengths)}"
        )
    return (*told, *_together(errors or []))


def _together(errors: Errors) -> tuple[str, ...]:
    square = sum(float(np.sum(e**2)) for e in errors) / max(sum(map(len, errors)), 1)
    rho = _autocorrelation(errors) if square > ROUNDING**2 else 0.0
    if rho <= HANGS_TOGETHER:
        return ()
    return (
        f"The errors hang together: their autocorrelation from sample to sample is {rho:.3f}, as of a drift, or of "
        "dynamics that are not in the structure. Its level may follow a drift, and its intervals are too narrow: try "
        "more poles, or a structure with noise: BJ, or ARMAX with integrated: true.",
    )
