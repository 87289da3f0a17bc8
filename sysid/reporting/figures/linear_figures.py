"""Pictures of linear models: Bode and step responses and poles and zeros, with what is uncertain about them."""

from __future__ import annotations

from typing import cast

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sysid.estimation.uncertainty import Uncertainty
from sysid.models import AbstractModel
from sysid.models.to_control import Linear
from sysid.reporting.figures.style import PALETTE, TARGET, new_figure, styled
from sysid.reporting.linear_view import LinearView, linear_views

Matrix = NDArray[np.float64]

BAND = (2.5, 97.5)
"""Percentiles of a band."""
BAND_COLOUR = "#DDDDDD"
CLOUD = 600
"""Poles shown of a cloud: more cannot be told apart, and each costs a hundred characters of the page."""
REACH = 1.5
"""How far from the origin the z plane is shown."""
SHOWN = 400
"""Samples shown of a step response."""


def band(draws: NDArray[np.float64]) -> NDArray[np.float64]:
    """Between which values the next draw lies with 95 %, whatever the number of draws (Weibull's plotting positions).

    Percentiles that reach from the first draw to the last would hold 94 % of 200 draws' successors.

    Args:
        draws: Shape ``(n_draws, n_points)``.

    Returns:
        Shape ``(2, n_points)``.
    """
    return np.asarray(np.percentile(draws, BAND, axis=0, method="weibull"))


def bode_figure(model: AbstractModel, uncertainty: Uncertainty | None, *, seed: int = 0, points: int = 200) -> Figure:
    """Magnitude and phase of every input, with 95 % bands.

    Args:
        model: The model.
        uncertainty: Of its parameters, as its fit gives it; without it there are no bands.
        seed: Of the draws for the bands.
        points: Frequencies, up to the Nyquist frequency.

    Returns:
        One column per input.
    """
    frequency = np.pi / model.sample_time * np.logspace(-4.0, 0.0, points)
    views = linear_views(model, uncertainty, seed)
    with styled():
        figure = new_figure(max(7.6, 2.2 * len(views)), 4.2)
        axes = figure.subplots(2, len(views), sharex=True, squeeze=False)
        for j, view in enumerate(views):
            responses = view.responses(frequency)
            shown, drawn = responses[0], responses[1:]
            above, below = axes[0, j], axes[1, j]
            phase = np.unwrap(np.angle(shown))
            if len(drawn):
                gains = band(np.abs(drawn))
                above.fill_between(frequency, *gains, color=BAND_COLOUR, label="95 %")
                around = band(phase + np.angle(drawn / shown))
                below.fill_between(frequency, *np.degrees(around), color=BAND_COLOUR)
            above.loglog(frequency, np.abs(shown), color=PALETTE[0], label=view.name)
            below.semilogx(frequency, np.degrees(phase), color=PALETTE[0])
            above.set_ylabel(f"gain [{model.ends.output_units[view.target]}/{view.unit}]")
            below.set_ylabel("phase [degrees]")
            below.set_xlabel("frequency [rad/s]")
            above.legend(loc="lower left")
        return figure


def step_figure(
    model: AbstractModel, uncertainty: Uncertainty | None = None, *, samples: int | None = None, seed: int = 0
) -> Figure:
    """Response of the output to a step of one unit in every input, with 95 % bands.

    Args:
        model: The model.
        uncertainty: Of its parameters; without it there are no bands.
        samples: Length; by default until the slowest pole has settled, 3000 at most.
        seed: Of the draws for the bands.

    Returns:
        One panel per input.
    """
    (A, B, C, D), ends = cast("Linear", model).matrices, model.ends
    views = linear_views(model, uncertainty, seed)
    with styled():
        figure = new_figure(max(7.6, 2.2 * len(views)), 2.8)
        axes = figure.subplots(1, len(views), squeeze=False)[0]
        for place, view in zip(axes, views, strict=True):
            n = samples or _settling(view)
            time = np.arange(n) * model.sample_time
            at, of = slice(view.source, view.source + 1), slice(view.target, view.target + 1)
            y = _step_response(A, B[:, at], C[of], D[of, at], n)
            every = -(-n // SHOWN)
            if len(view.B) > 1:
                # A draw that is not stable must not take the picture with it.
                room = max(float(np.ptp(y)), 1e-12)
                drawn = band(_step_responses(view, n))[:, ::every]
                low, high = np.clip(drawn, y.min() - room, y.max() + room)
                place.fill_between(time[::every], low, high, color=BAND_COLOUR, label="95 %")
            shape = "steps-post" if every == 1 else "default"
            place.plot(
                time[::every], y[::every], drawstyle=shape, color=PALETTE[0], label=f"{view.name}, 1 {view.unit}"
            )
            place.set_xlabel("time [s]")
            place.set_ylabel(f"{ends.outputs[view.target]} [{ends.output_units[view.target]}]")
            place.legend()
        return figure


def pole_zero_figure(model: AbstractModel, uncertainty: Uncertainty | None, *, seed: int = 0) -> Figure:
    """Poles and zeros of every input, with the cloud of poles that the uncertainty allows.

    Args:
        model: The model.
        uncertainty: Of its parameters; without it there is no cloud.
        seed: Of the draws.

    Returns:
        One panel per input.
    """
    views = linear_views(model, uncertainty, seed)
    with styled():
        figure = new_figure(max(7.6, 2.2 * len(views)), 3.8)
        axes = figure.subplots(1, len(views), squeeze=False)[0]
        for place, view in zip(axes, views, strict=True):
            poles, zeros = view.roots(view.F[0]), view.roots(view.B[0])
            draws = view.F[1 : 1 + CLOUD // max(len(poles), 1)]
            if len(draws):
                cloud = np.concatenate([view.roots(f) for f in draws])
                place.plot(cloud.real, cloud.imag, ".", color="#BBBBBB", markersize=2, label=f"{len(draws)} draws")
            for roots, marker, kind in ((poles, "x", "poles"), (zeros, "o", "zeros")):
                far = int(np.count_nonzero(np.abs(roots) > REACH)) if view.discrete else 0
                label = f"{kind} ({far} outside)" if far else kind
                place.plot(roots.real, roots.imag, marker, color=PALETTE[0], fillstyle="none", label=label)
            if view.discrete:
                angle = np.linspace(0.0, 2.0 * np.pi, 200)
                place.plot(np.cos(angle), np.sin(angle), color=TARGET, linewidth=0.6)
                place.set_aspect("equal")
                # A zero of fast sampling may lie a hundred units off, and would shrink the circle to a dot.
                place.set_xlim(-REACH, REACH)
                place.set_ylim(-REACH, REACH)
            else:
                place.axvline(0.0, color=TARGET, linewidth=0.6)
            place.set_title(view.name)
            place.legend(loc="lower left")
        return figure


def _settling(view: LinearView) -> int:
    """Samples until the slowest pole has settled to a hundredth, 50 to 3000; 300 where it never does."""
    poles = view.roots(view.F[0])
    rate = poles.real * view.sample_time if not view.discrete else np.log(np.maximum(np.abs(poles), 1e-6))
    slowest = float(rate.max(initial=-1.0))
    return int(np.clip(np.ceil(-5.0 / slowest), 50, 3000)) + view.delay if slowest < 0.0 else 300


def _step_response(A: Matrix, B: Matrix, C: Matrix, D: Matrix, n: int) -> NDArray[np.float64]:
    """The response of one output to a step of one unit in one input, shape ``(n,)``."""
    response, x = np.empty(n), np.zeros(len(A))
    for t in range(n):
        response[t] = np.dot(C[0], x) + D[0, 0]
        x = np.dot(A, x) + B[:, 0]
    return response


def _step_responses(view: LinearView, n: int) -> NDArray[np.float64]:
    """Step responses of the drawn models, shape ``(n_draws, n)``; inputs of continuous ones are held."""
    found = np.zeros((len(view.B) - 1, n))
    with np.errstate(over="ignore", invalid="ignore"):
        if view.discrete:
            _filter_step(view.B[1:], view.F[1:], found[:, view.delay :])
        else:
            # To import it takes longer than all these pictures, and few models are continuous.
            from scipy import signal

            time = np.arange(max(n - view.delay, 0)) * view.sample_time
            for row, b, f in zip(found, view.B[1:], view.F[1:], strict=True):
                row[view.delay :] = signal.step((b[::-1], f[::-1]), T=time)[1]
    return np.nan_to_num(found)


def _filter_step(b: Matrix, f: Matrix, y: Matrix) -> None:
    """Pass a step through the filter ``b / f`` of each row, all rows at once, into ``y``, which is zero."""
    forced = np.cumsum(b, axis=1)
    for t in range(y.shape[1]):
        past = y[:, max(t - f.shape[1] + 1, 0) : t][:, ::-1]
        y[:, t] = forced[:, min(t, b.shape[1] - 1)] - np.einsum("ij,ij->i", f[:, 1 : past.shape[1] + 1], past)
        y[:, t] /= f[:, 0]
