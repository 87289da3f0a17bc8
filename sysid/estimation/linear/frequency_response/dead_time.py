"""The dead time of a measured frequency response, which need be no multiple of any sample time.

A transfer function holds a dead time of so many samples. Of a sampled record that is all there is to know; a response
over frequency shows a time. A 20th of the period of the highest frequency is a turn of 18 degrees there, and poles make
up for what is rounded away. So the sample time of a continuous model, which nobody asked for, is moved until whole
samples of it make the dead time that leaves least; what is then not known of it is part of the intervals.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from sysid.estimation.results.result import FitResult
from sysid.models import TransferFunctionModel

NEAR, APART = 1e-3, 0.05
"""How near the best dead time is searched, and how far from it its curvature is taken, in samples of the first fit."""

WORTH = 4.0
"""Times the variance of the noise by which a dead time between samples has to leave less, to be more than chance."""

NORMAL = 1.959964
"""Standard deviations of half a 95 % interval."""

FitAt = Callable[[float, int, TransferFunctionModel], FitResult]
"""The fit with a sample time in seconds and a dead time in samples, from the poles of a model: of a part of a sample
more or less, no other start has led to less in 36 fits of plants of one to four poles, and all of them took longer than
the search."""


def with_dead_time(first: FitResult, fit_at: FitAt, *, n_residuals: int) -> FitResult:
    """A fit with the dead time in seconds that leaves least, near that in samples.

    Args:
        first: The fit with a dead time in samples.
        fit_at: Fits with others.
        n_residuals: Real numbers that are fitted.

    Returns:
        The fit, its intervals widened by what is not known of the dead time; the first one where that is as good.
    """
    from scipy.optimize import minimize_scalar  # most fits do without

    model = first.model
    assert isinstance(model, TransferFunctionModel)  # noqa: S101 - no other is fitted to a response
    sample, delay, begun = model.sample_time, model.delays[0], model

    def fitted(seconds: float, begin: TransferFunctionModel) -> FitResult:
        count = max(round(seconds / sample), 1)
        return fit_at(float(f"{seconds / count:.7g}"), count, begin)

    def squares(fit: FitResult) -> float:
        return n_residuals * float(fit.history["mse"][-1])

    low, high = max(delay - 1, 0.0) * sample + NEAR * sample, (delay + 1) * sample
    best = float(
        minimize_scalar(
            lambda seconds: squares(fitted(seconds, begun)), bounds=(low, high), method="bounded",
            options={"xatol": NEAR * sample},
        ).x
    )  # fmt: skip
    found = fitted(best, begun)
    least = squares(found)
    variance = least / max(n_residuals - found.model.n_parameters - 1, 1)
    if not squares(first) - least > WORTH * variance:
        return first
    by = min(APART * sample, best / 2.0)
    own = found.model
    assert isinstance(own, TransferFunctionModel)  # noqa: S101 - as above
    sides = [fitted(best + way * by, own) for way in (-1.0, 1.0)]
    curvature = sum(map(squares, sides)) - 2.0 * least
    if not curvature > 0.0:
        return replace(found, notes=(*found.notes, f"Dead time: {best:.4g} s; the response does not tell it well."))
    deviation = by * np.sqrt(2.0 * variance / curvature)
    note = f"Dead time: {best:.4g} ± {NORMAL * deviation:.2g} s (95 %), which is {_samples(found, best)}."
    known = found.uncertainty
    if known is None or any(one.uncertainty is None for one in sides):
        return replace(found, notes=(*found.notes, note))
    below, above = (one.uncertainty.values for one in sides if one.uncertainty is not None)
    moved = (above - below) / (2.0 * by) * deviation
    widened = replace(known, covariance=known.covariance + np.outer(moved, moved))
    return replace(found, uncertainty=widened, notes=(*found.notes, note))


def _samples(fit: FitResult, seconds: float) -> str:
    count = round(seconds / fit.model.sample_time)
    return f"{count} sample{'s' * (count > 1)} of {fit.model.sample_time:.4g} s"
