"""Step responses sample by sample, of a model and of those that its uncertainty allows, and what they come to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid.kernels import linear as kernel
from sysid.models.converting.realisation import Realisation, parted
from sysid.reporting.linear_views import LinearView

Matrix = NDArray[np.float64]

BAND = (2.5, 97.5)
"""Percentiles of a band."""
SETTLED, RISE = 0.02, (0.1, 0.9)
"""Part of the final change within which a response has settled, and between which parts it rises."""


def band(draws: NDArray[np.float64]) -> NDArray[np.float64]:
    """Between which values the next draw lies with 95 %, whatever the number of draws (Weibull's plotting positions).

    Percentiles that reach from the first draw to the last would hold 94 % of 200 draws' successors.

    Args:
        draws: Shape ``(n_draws, n_points)``.

    Returns:
        Shape ``(2, n_points)``.
    """
    return np.asarray(np.percentile(draws, BAND, axis=0, method="weibull"))


def gains(view: LinearView) -> tuple[float, float, float]:
    """The static gain and the ends of its interval; infinite of an integrator, NaN of what is unstable."""
    poles = view.roots(view.F[0])
    unstable = (np.abs(poles) > 1.0 + EDGE) if view.discrete else (poles.real > EDGE)
    if unstable.any():
        return np.nan, np.nan, np.nan
    with np.errstate(divide="ignore", invalid="ignore"):
        found = view.responses(np.zeros(1))[:, 0].real
    edge = np.abs(poles - 1.0) if view.discrete else np.abs(poles)
    if (edge < EDGE).any():
        return np.inf, np.nan, np.nan
    low, high = band(found[1:, np.newaxis])[:, 0] if len(found) > 1 else (np.nan, np.nan)
    return float(found[0]), float(low), float(high)


EDGE = 1e-9
"""Distance from the edge of stability below which a pole stands on it."""


def stepinfo(time: Matrix, y: Matrix, gain: float) -> dict[str, float]:
    """Rise time, settling time and overshoot of one response; NaN where it does not settle within what is shown."""
    none = {"rise_time": np.nan, "settling_time": np.nan, "overshoot": np.nan}
    if not np.isfinite(gain) or gain == 0.0 or not np.isfinite(y).all():
        return none
    share = y / gain
    off = np.flatnonzero(np.abs(share - 1.0) > SETTLED)
    if not len(off) or off[-1] == len(y) - 1:
        return none if len(off) else {**none, "rise_time": 0.0, "settling_time": 0.0, "overshoot": 0.0}
    first, last = (_crossing(time, share, part) for part in RISE)
    settled = _crossing_at(time, np.abs(share - 1.0), int(off[-1]), SETTLED)
    return {
        "rise_time": last - first,
        "settling_time": settled,
        "overshoot": 100.0 * max(float(share.max()) - 1.0, 0.0),
    }


def _crossing(time: Matrix, y: Matrix, level: float) -> float:
    k = int(np.argmax(y >= level))
    return float(time[0]) if k == 0 else _crossing_at(time, y, k - 1, level)


def _crossing_at(time: Matrix, y: Matrix, k: int, level: float) -> float:
    """Where a line through two samples crosses a level."""
    share = (level - y[k]) / (y[k + 1] - y[k])
    return float(time[k] + share * (time[k + 1] - time[k]))


def settling(view: LinearView) -> int:
    """Samples until the slowest pole has settled to a hundredth, 50 to 20,000; 300 where it never does."""
    poles = view.roots(view.F[0])
    rate = poles.real * view.sample_time if not view.discrete else np.log(np.maximum(np.abs(poles), 1e-6))
    slowest = float(rate.max(initial=-1.0))
    return int(np.clip(np.ceil(-5.0 / slowest), 50, 20_000) + np.ceil(view.delay)) if slowest < 0.0 else 300


def step_response(A: Matrix, B: Matrix, C: Matrix, D: Matrix, n: int) -> Matrix:
    """The response of one output to a step of one unit in one input, shape ``(n,)``."""
    response, x = np.empty(n), np.zeros(len(A))
    for t in range(n):
        response[t] = np.dot(C[0], x) + D[0, 0]
        x = np.dot(A, x) + B[:, 0]
    return response


def step_responses(view: LinearView, n: int) -> Matrix:
    """Step responses of the drawn models, shape ``(n_draws, n)``; inputs of continuous ones are held."""
    found = np.zeros((len(view.B) - 1, n))
    with np.errstate(over="ignore", invalid="ignore"):
        if view.discrete:
            filter_step(view.B[1:], view.F[1:], found[:, int(view.delay) :])
        else:
            # To import it takes longer than all these pictures, and few models are continuous.
            from scipy import signal

            k, part = parted(view.delay)
            arrived = (np.arange(n) >= k).astype(np.float64)[:, np.newaxis]
            for row, b, f in zip(found, view.B[1:], view.F[1:], strict=True):
                A, B, C, D = signal.tf2ss(b[::-1], f[::-1])
                one = Realisation(A=A, B=B[:, 0], C=C, D=D[0]).sampled(view.sample_time, late=part)
                y = np.empty((n, 1))
                kernel.state_space(
                    one.A, one.B[:, np.newaxis], one.C, one.D[:, np.newaxis], arrived, np.zeros(len(one.A)), y
                )
                row[:] = y[:, 0]
    return np.nan_to_num(found)


def filter_step(b: Matrix, f: Matrix, y: Matrix) -> None:
    """Pass a step through the filter ``b / f`` of each row, all rows at once, into ``y``, which is zero."""
    forced = np.cumsum(b, axis=1)
    for t in range(y.shape[1]):
        past = y[:, max(t - f.shape[1] + 1, 0) : t][:, ::-1]
        y[:, t] = forced[:, min(t, b.shape[1] - 1)] - np.einsum("ij,ij->i", f[:, 1 : past.shape[1] + 1], past)
        y[:, t] /= f[:, 0]
