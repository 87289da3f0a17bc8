"""Step responses, Bode diagrams and poles of linear fits, with their intervals, in the words that people know."""

from __future__ import annotations

import datetime
from typing import Any

import numpy as np

from sysid.errors import ConfigError
from sysid.estimation import FitResult
from sysid.export.own_figures import side_by_side
from sysid.ingest.tables.durations import length_of_time
from sysid.models import AbstractModel, Cascade
from sysid.models.orders.typed_fields import plain_values
from sysid.reporting.linear.computing import bode_of, check_linear, poles_of, step_of
from sysid.reporting.linear.responses import Bode, Known, Poles, StepResponse


def step(fit: Any, *, seconds: float | datetime.timedelta | None = None) -> StepResponse:
    """Change of the outputs after a step of one unit in each input, with 95 % intervals.

    Args:
        fit: A linear fit, of one output or of several; a bundle or a model, which have no intervals.
        seconds: Length, a number or a duration; by default until the slowest pole has settled.

    Returns:
        The responses: printed they say gain, rise time, settling time and overshoot, ``plot()`` draws them,
        ``to_frame()`` and ``info()`` give the numbers.

    Raises:
        ConfigError: If it is not linear, no input moves it, or the length is none.
    """
    known = _known_of(fit)
    check_linear(known)
    if seconds is None:
        return step_of(known)
    T = known[0][0].sample_time
    seconds = float(plain_values(length_of_time(seconds, where="seconds")))
    if not T <= seconds <= LONGEST * T:
        raise ConfigError(
            "not a length of a step response",
            where="seconds",
            expected=f"a number from {T:g} to {LONGEST * T:g}, as of 1 to {LONGEST:,} samples",
            got=seconds,
            remedy="leave it out for the time until the slowest pole has settled",
        )
    samples = int(np.floor(seconds / T * (1.0 + 1e-12))) + 1
    return step_of(known, samples=samples)


LONGEST = 100_000
"""Samples of a step response at most."""


def bode(fit: Any, *, frequency: Any = None) -> Bode:
    """Gain and phase from each input to each output, with 95 % intervals.

    Args:
        fit: As for :func:`step`.
        frequency: In rad/s; by default four decades up to the Nyquist frequency.

    Returns:
        The responses: ``plot()`` draws them, ``to_frame()`` gives the numbers.

    Raises:
        ConfigError: If it is not linear, no input moves it, or a frequency is none.
    """
    return bode_of(_known_of(fit), frequency=frequency)


def poles(fit: Any) -> Poles:
    """The poles with time constants, natural frequencies and damping, and 95 % intervals of these.

    Args:
        fit: As for :func:`step`.

    Returns:
        The poles, the slowest first: they are printed, iterated, drawn, or made a frame.

    Raises:
        ConfigError: If it is not linear.
    """
    return poles_of(_known_of(fit))


def _known_of(fit: Any) -> Known:
    """The models of what was given, each with the uncertainty of its parameters.

    Refuses what is neither fit, bundle nor model, and a chain of models that read each other.
    """
    if isinstance(fit, FitResult):
        return [(fit.model, fit.uncertainty)]
    fits = list(getattr(fit, "fits", {}).values()) or fit
    if isinstance(fits, list) and fits and all(isinstance(one, FitResult) for one in fits):
        return [(one.model, one.uncertainty) for one in fits]
    model = getattr(fit, "model", fit)
    if isinstance(model, Cascade) and side_by_side(model):
        return [(one, None) for one in model.models]
    if isinstance(model, AbstractModel):
        return [(model, None)]
    raise ConfigError(
        "there is nothing here that responds to a step",
        where="fit",
        expected="a linear fit, a bundle of one, or a model",
        got=type(fit).__name__,
        remedy="of models that read each other, model.to_control() is the whole"
        if isinstance(model, Cascade)
        else "give what sysid.fit or sysid.read_bundle gives",
    )
