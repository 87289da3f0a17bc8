"""What a measured frequency response leaves open of a transfer function that was fitted to it, and what it may hide.

Of time a record shows what it is long enough for; of frequency a response shows what lies between its lowest and its
highest, and no more finely than its points lie. What stands beyond is the structure's word, and told.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.results.result import FitResult
from sysid.models import Domain, TransferFunctionModel
from sysid.traces.measured_response import MeasuredResponse

MOST_OF_IT = 0.9
"""Share of the weighted squares that stands at few points where these are fewer than the parameters."""
BEYOND = 2.0
"""Times the highest frequency, or of the lowest the part, from which a pole is one that no point shows."""
NORMAL = 1.959964
"""Standard deviations of half a 95 % interval."""
TURNS = 2.5
"""Radians between neighbouring points, where the gain hardly moves, that dead times alone make."""
FLAT, OFTEN = 0.1, 3
"""Change of the gain that is hardly one, and points at which that has to be so."""

Array = NDArray[np.float64]


def measured_response_notes(measured: MeasuredResponse, fit: FitResult, weights: Array) -> tuple[str, ...]:
    """What is to be told of a fit to a response.

    Args:
        measured: The response.
        fit: A transfer function of one input.
        weights: Of each point's squared error, shape ``(n_points,)``.

    Returns:
        Sentences.
    """
    model = fit.model
    assert isinstance(model, TransferFunctionModel)  # noqa: S101 - no other is fitted to a response
    poles = np.asarray(model.poles(0), dtype=np.complex128)
    if model.orders.domain is Domain.DISCRETE:
        with np.errstate(divide="ignore"):
            poles = np.asarray(np.log(np.where(poles == 0.0, 1e-300, poles)) / model.sample_time, dtype=np.complex128)
    return (
        *_few_points(measured, weights, model.n_parameters),
        *_cancelled(model, fit),
        *_narrow(measured.frequency, poles),
        *_beyond(measured.frequency, poles),
        *_turning(measured, late=model.delays[0] > 0),
    )


def _few_points(measured: MeasuredResponse, weights: Array, parameters: int) -> tuple[str, ...]:
    """That a handful of points is nearly all that counts."""
    squares = weights * np.abs(measured.values) ** 2
    largest = np.argsort(squares)[::-1]
    shares = np.cumsum(squares[largest]) / max(float(squares.sum()), 1e-300)
    count = int(np.searchsorted(shares, MOST_OF_IT)) + 1
    if 2 * count >= parameters + 2 or len(measured) < 2 * parameters:
        return ()
    at = measured.frequency[largest[:count]] / (2.0 * np.pi)
    return (
        f"{100 * shares[count - 1]:.0f} % of what counts of the response stands at {_points(count)} of {len(measured)} "
        f"({at.min():.4g} to {at.max():.4g} Hz), fewer than {parameters} parameters need: the others hardly matter. "
        "weighting='relative' counts every point's error over its size.",
    )


def _cancelled(model: TransferFunctionModel, fit: FitResult) -> tuple[str, ...]:
    """Pairs of a pole and a zero that their intervals do not tell apart."""
    known, (top, bottom) = fit.uncertainty, (model.numerator(0), model.denominator(0))
    if known is None or model.orders.domain is Domain.DISCRETE or len(top) < 2:
        return ()
    covariance = known.covariance
    if not np.isfinite(covariance).all():
        return ()
    poles, zeros = model.poles(0), np.roots(np.trim_zeros(top[::-1], "f"))
    told, of_top = list[str](), [i for i, name in enumerate(known.names) if name.startswith("B(")]
    of_bottom = [i for i, name in enumerate(known.names) if name.startswith("F(")]
    for pole in poles[poles.imag >= 0.0]:
        near = zeros[np.argmin(np.abs(zeros - pole))] if len(zeros) else np.inf
        apart, real = pole - near, pole.imag == 0.0
        if not abs(apart) < max(abs(pole), abs(near)) or real != (near.imag == 0.0):
            continue
        slope = np.zeros(len(known.names), dtype=np.complex128)
        slope[of_bottom] = _root_slopes(bottom, pole)[: len(of_bottom)]
        slope[of_top] = -_root_slopes(top, near)[: len(of_top)]
        if not np.isfinite(slope).all():
            continue
        rows = np.stack([slope.real, slope.imag])
        spread = rows @ covariance @ rows.T
        limit = NORMAL**2 if real else 5.991  # chi-square of one and of two numbers
        offset = np.array([apart.real, apart.imag])
        distance = offset[0] ** 2 / spread[0, 0] if real else float(offset @ np.linalg.pinv(spread) @ offset)
        if np.isfinite(distance) and distance < limit:
            told.append(
                f"The pole {_number(pole)} and the zero {_number(near)} rad/s are not told apart by their 95 % "
                "intervals: fit a pole and a zero less."
                if real
                else f"The pair of poles {_number(pole)} and that of zeros {_number(near)} rad/s are not told apart by "
                "their 95 % intervals: fit two poles and two zeros less."
            )
    return tuple(told)


def _root_slopes(polynomial: Array, root: complex) -> NDArray[np.complex128]:
    """Derivatives of a root with respect to the coefficients, those of rising powers."""
    powers = np.arange(len(polynomial))
    own = np.sum(powers[1:] * polynomial[1:] * root ** (powers[1:] - 1))
    with np.errstate(all="ignore"):
        return np.asarray(-(root**powers) / own, dtype=np.complex128)


def _narrow(frequency: Array, poles: NDArray[np.complex128]) -> tuple[str, ...]:
    """Resonances of whose width no two points tell."""
    told = []
    for pole in poles[poles.imag > 0.0]:
        at, half = abs(pole), abs(pole.real)
        inside = int(np.count_nonzero(np.abs(frequency - at) <= half))
        if frequency[0] < at < frequency[-1] and half < 0.5 * at and inside < 2:
            beside = int(np.clip(np.searchsorted(frequency, at), 1, len(frequency) - 1))
            gap = frequency[beside] - frequency[beside - 1]
            told.append(
                f"The resonance at {at / (2.0 * np.pi):.4g} Hz is {2.0 * half / (2.0 * np.pi):.3g} Hz wide, and has "
                f"{_points(inside)} within; frequencies lie {gap / (2.0 * np.pi):.3g} Hz apart there. Its damping, "
                f"{half / at:.3g}, is hardly measured: measure more finely about it."
            )
    return tuple(told)


def _beyond(frequency: Array, poles: NDArray[np.complex128]) -> tuple[str, ...]:
    """Poles that lie where nothing was measured."""
    sizes, told = np.abs(poles), list[str]()
    lowest, highest = float(frequency[frequency > 0.0].min()), float(frequency[-1])
    slow = sizes[(sizes > 1e-9 * lowest) & (sizes < lowest / BEYOND)]
    if len(slow):
        told.append(
            f"The slowest pole, at {slow.min() / (2.0 * np.pi):.3g} Hz, lies below the lowest frequency "
            f"({lowest / (2.0 * np.pi):.3g} Hz): the response does not show the steady state, which is a guess."
        )
    fast = sizes[sizes > BEYOND * highest]
    if len(fast):
        told.append(
            f"The fastest pole, at {fast.max() / (2.0 * np.pi):.3g} Hz, lies beyond the highest frequency "
            f"({highest / (2.0 * np.pi):.3g} Hz): how the plant rolls off is not measured. Fit a pole less, or measure "
            "higher."
        )
    return tuple(told)


def _turning(measured: MeasuredResponse, *, late: bool) -> tuple[str, ...]:
    """That the phase turns so far from point to point that several dead times explain it."""
    sizes, turned = np.abs(measured.values), np.abs(np.angle(measured.values[1:] * measured.values[:-1].conj()))
    with np.errstate(divide="ignore", invalid="ignore"):
        flat = np.abs(np.log(sizes[1:] / sizes[:-1])) < FLAT
    if not late or np.count_nonzero(flat & (turned > TURNS)) < OFTEN:
        return ()
    return (
        "The phase turns by nearly half a turn or more between neighbouring frequencies where the gain hardly moves: "
        "several dead times explain it. Measure more finely, or give the dead time.",
    )


def _points(count: int) -> str:
    return f"{count} point{'s' * (count != 1)}"


def _number(root: complex) -> str:
    return f"{root.real:.4g}" if abs(root.imag) == 0.0 else f"{root.real:.4g} ± {abs(root.imag):.4g}i"
