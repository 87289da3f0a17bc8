"""How often regions of 95 % hold the truth: every linear structure, many records of a known system.

    python -m tests.benchmarks coverage [--runs=200] [--only=NAME,NAME]

A record has 1,000 samples of random signs and goes on before it, so that its initial state is estimated. Counted are
the intervals of single parameters, the region of all of them together (Wald), the intervals of time constants, natural
frequencies and damping, and the bands of Bode magnitude and step response as the report draws them. Of estimates
without parameters: the bands of the impulse response, and the discs of the frequency response. 92 to 98 % are asked.
"""

from __future__ import annotations

import os
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy import signal, stats

from sysid.estimation import FitResult, fit_iv4, modes
from sysid.estimation.fitting import fit
from sysid.estimation.linear.transfer_function.training import TransferFunctionTraining
from sysid.estimation.nonparametric.impulse import estimate_impulse_response
from sysid.estimation.nonparametric.response import estimate_frequency_response
from sysid.models import (
    ARMAX,
    ARX,
    BJ,
    OE,
    AbstractStructure,
    LinearStateSpace,
    Mapping,
    Start,
    TransferFunction,
    VectorARX,
    VectorARXModel,
    VectorStateSpace,
)
from sysid.models.contract.ratio import Ratio
from sysid.models.linear.innovations import Innovations
from sysid.models.linear.polynomial_orders import AbstractPolynomial
from sysid.models.linear.state_space_polynomials import polynomials
from sysid.reporting.linear.step_responses import band
from sysid.reporting.linear_views import LinearView, linear_views
from sysid.traces import Channel, Trace
from tests.benchmarks._findings import found

FREE = Start(kind="estimated")
T, SAMPLES, BEFORE, DEVIATION = 0.1, 1_000, 200, 0.5
FREQUENCIES = np.pi / T * np.array([0.01, 0.03, 0.1, 0.15, 0.2, 0.3, 0.5, 0.8])
INSTANTS = np.array([3, 5, 10, 15, 20, 30, 40])
Held = dict[str, np.ndarray]
"""By kind of region which ones held the truth."""


def fit_any(traces: list[Trace], mapping: Mapping, structure: AbstractStructure, *, start: Start) -> FitResult:
    """By the table of estimators; a transfer function of one pair of poles needs no random starts."""
    few = TransferFunctionTraining(scattered_starts=0) if isinstance(structure, TransferFunction) else None
    return fit(traces, mapping, structure, few, start=start, stability=None)


@dataclass(frozen=True, kw_only=True)
class Known:
    """What is fitted to what.

    Args:
        structure: What is fitted.
        record: From a seed to a record.
        truth: Parameters without constants, in the order of the fit's uncertainty.
        estimate: How it is fitted.
    """

    structure: AbstractStructure
    record: Callable[[int], tuple[Trace, Mapping]]
    truth: list[float]
    estimate: Callable[..., FitResult] = fit_any


def trace_of(u: np.ndarray, y: np.ndarray) -> tuple[Trace, Mapping]:
    """A record, and the mapping of its channels."""
    ins, outs = [f"u{j}" for j in range(u.shape[1])], [f"y{j}" for j in range(y.shape[1])]
    channels = tuple(Channel(name=name, unit="1") for name in (*ins, *outs))
    trace = Trace(name="t", sample_time=T, channels=channels, values=np.column_stack([u, y])[BEFORE:])
    return trace, Mapping(inputs=ins, outputs=outs)


def _drawn(seed: int, n_inputs: int, n_outputs: int = 1) -> tuple[np.ndarray, np.ndarray]:
    rng, n = np.random.default_rng(seed), SAMPLES + BEFORE
    return np.sign(rng.normal(size=(n, n_inputs))), DEVIATION * rng.normal(size=(n, n_outputs))


def polynomial_record(seed: int, orders: AbstractPolynomial, truth: list[float]) -> tuple[Trace, Mapping]:
    """A record of a polynomial system."""
    p = orders.polynomials(np.array([*truth, *[0.0] * orders.level]))
    u, e = _drawn(seed, len(p.B))
    y = signal.lfilter(p.C, np.convolve(p.A, p.D), e[:, 0])
    for column, b, f in zip(u.T, p.B, p.F, strict=True):
        y = y + signal.lfilter(b, np.convolve(p.A, f), column)
    return trace_of(u, y[:, np.newaxis])


CONTINUOUS = [3.0, 2.0, 4.0, 1.0]
"""``(2 s + 3)/(s^2 + s + 4)``, ascending."""


def continuous_record(seed: int) -> tuple[Trace, Mapping]:
    """A record of the continuous system, its input held between samples."""
    b, f, _ = signal.cont2discrete((CONTINUOUS[1::-1], [1.0, *CONTINUOUS[:1:-1]]), T, "zoh")
    u, e = _drawn(seed, 1)
    u = np.repeat(u[: len(u) // 5], 5, axis=0)
    return trace_of(u, signal.lfilter(b.ravel(), f, u[:, 0])[:, np.newaxis] + 0.2 * e)


TWO_BY_TWO = Innovations(
    A=np.array([[0.9, 0.2], [-0.2, 0.7]]),
    B=np.array([[0.5, 0.0], [0.2, 0.6]]),
    C=np.array([[1.0, 0.0], [0.3, 1.0]]),
    D=np.zeros((2, 2)),
    K=np.array([[0.3, 0.0], [0.1, 0.2]]),
    constant=np.zeros(2),
)
"""Two inputs, two outputs, two states, noise through the states."""


def record_of_two(seed: int, *, noise: bool = True) -> tuple[Trace, Mapping]:
    """A record of the two by two system; the noise of its outputs hangs together."""
    u, e = _drawn(seed, 2, 2)
    e = e @ np.array([[1.0, 0.4], [0.0, 0.9]])
    x, y = np.zeros(2), np.zeros_like(e)
    for t in range(len(u)):
        y[t] = TWO_BY_TWO.C @ x + e[t]
        x = TWO_BY_TWO.A @ x + TWO_BY_TWO.B @ u[t] + noise * TWO_BY_TWO.K @ e[t]
    return trace_of(u, y)


def _truth_of_two(*, noise: bool = True) -> list[float]:
    F, numerators, C = (np.real(part) for part in polynomials(TWO_BY_TWO))
    return [*numerators[:, :, 1:].ravel(), *F[1:], *(C[:, :, 1:].ravel() if noise else [])]


COUPLED = VectorARX(na=[[1, 1], [1, 2]], nb=[[2, 1], [1, 1]], nk=[[1, 3], [2, 1]])
OF_COUPLED = [1.0, 0.4, 0.8, 0.7, 0.3, 0.6, 1.6, -0.3, 1.1, -0.3]
"""Two outputs that drive each other, and the coefficients in the order of the structure's terms."""


def record_of_coupled(seed: int) -> tuple[Trace, Mapping]:
    """A record of it; the noise of its equations hangs together."""
    u, e = _drawn(seed, 2, 2)
    y = e @ np.array([[1.0, 0.4], [0.0, 0.9]])
    for t in range(3, len(u)):
        for (i, channel, lag), value in zip(COUPLED.terms, OF_COUPLED, strict=True):
            y[t, i] += value * (u[t - lag, channel] if channel < 2 else y[t - lag, channel - 2])
    return trace_of(u, y)


def _polynomial(
    structure: AbstractStructure, orders: AbstractPolynomial, truth: list[float], *, told: list[float] | None = None
) -> Known:
    record = partial(polynomial_record, orders=orders, truth=truth)
    return Known(structure=structure, record=record, truth=truth if told is None else told)


PLANT, PAIR = [1.0, 0.5, -1.5, 0.7], [1.0, 0.5, 0.4, -1.5, 0.7, -0.9]
STATES = [*PLANT, -0.6, 0.3]
WITH_INPUT, OUTPUT_ERROR = ARMAX(na=2, nb=2, nc=0, nk=1), OE(nb=2, nf=2, nk=1)
MISO = OE(nb=(2, 1), nf=(2, 1), nk=(1, 3))
COLOURED, TOLD = BJ(nb=2, nc=1, nd=1, nf=2, nk=1), [*PLANT, 0.5, -0.9]
PAIR_OF_BJ = BJ(nb=(2, 1), nc=1, nd=1, nf=(2, 1), nk=(1, 3))
STRUCTURES: dict[str, Known] = {
    "ARX": _polynomial(ARX(na=2, nb=2, nk=1), WITH_INPUT, PLANT, told=[1.0, 0.5, 1.5, -0.7]),
    "IV4": replace(
        _polynomial(ARX(na=2, nb=2, nk=1), WITH_INPUT, PLANT, told=[1.0, 0.5, 1.5, -0.7]), estimate=fit_iv4
    ),
    "TF discrete": _polynomial(TransferFunction(poles=2, zeros=1, delays=1), OUTPUT_ERROR, PLANT),
    "TF continuous": Known(
        structure=TransferFunction(poles=2, zeros=1, delays=0, domain="continuous"),
        record=continuous_record,
        truth=CONTINUOUS,
    ),
    "OE": _polynomial(OUTPUT_ERROR, OUTPUT_ERROR, PLANT),
    "OE of coloured noise": _polynomial(OUTPUT_ERROR, COLOURED, TOLD, told=PLANT),
    "TF discrete of coloured noise": _polynomial(
        TransferFunction(poles=2, zeros=1, delays=1), COLOURED, TOLD, told=PLANT
    ),
    "SS without noise model of coloured noise": _polynomial(
        LinearStateSpace(states=2, noise=False), COLOURED, TOLD, told=PLANT
    ),
    "BJ of two inputs": _polynomial(PAIR_OF_BJ, PAIR_OF_BJ, [*PAIR, 0.5, -0.6]),
    "BJ of two inputs, plant and noise of one pole": _polynomial(PAIR_OF_BJ, PAIR_OF_BJ, [*PAIR, 0.5, -0.9]),
    "BJ with dead time 6": _polynomial(replace(COLOURED, nk=6), replace(COLOURED, nk=6), TOLD),
    "OE with dead time 6": _polynomial(replace(OUTPUT_ERROR, nk=6), replace(OUTPUT_ERROR, nk=6), PLANT),
    "OE of two inputs": _polynomial(MISO, MISO, PAIR),
    "SS": _polynomial(LinearStateSpace(states=2), ARMAX(na=2, nb=2, nc=2, nk=1), STATES),
    "SS with dead time 6": _polynomial(LinearStateSpace(states=2, nk=6), ARMAX(na=2, nb=2, nc=2, nk=6), STATES),
    "SS without noise model": _polynomial(LinearStateSpace(states=2, noise=False), OUTPUT_ERROR, PLANT),
    "VectorARX": Known(structure=COUPLED, record=record_of_coupled, truth=OF_COUPLED),
    "VectorSS": Known(structure=VectorStateSpace(states=2), record=record_of_two, truth=_truth_of_two()),
    "VectorSS without noise model": Known(
        structure=VectorStateSpace(states=2, noise=False),
        record=partial(record_of_two, noise=False),
        truth=_truth_of_two(noise=False),
    ),
    **{
        name: _polynomial(orders, orders, truth)
        for name, orders, truth in (
            ("ARMAX", ARMAX(na=2, nb=2, nc=1, nk=1), [*PLANT, 0.4]),
            ("ARIX", ARMAX(na=2, nb=2, nc=0, nk=1, integrated=True), PLANT),
            ("ARIMAX", ARMAX(na=2, nb=2, nc=1, nk=1, integrated=True), [*PLANT, 0.4]),
            ("BJ", BJ(nb=2, nc=1, nd=1, nf=2, nk=1), [*PLANT, 0.5, -0.9]),
            ("AR", ARMAX(na=2, nb=(), nc=0, nk=()), [-1.5, 0.7]),
            ("ARMA", ARMAX(na=2, nb=(), nc=1, nk=()), [-1.5, 0.7, 0.4]),
        )
    },
}  # fmt: skip
"""A state space of two states is an ARMAX system; ARX writes past outputs on the other side of the equation."""
OF_RESPONSES = {
    "white noise": (BJ(nb=2, nc=0, nd=0, nf=2, nk=1), PLANT),
    "coloured noise": (BJ(nb=2, nc=1, nd=1, nf=2, nk=1), [*PLANT, 0.5, -0.9]),
}
"""Systems whose impulse and frequency responses are estimated."""


def held(known: Known, seed: int) -> Held:
    """Which regions of a fit hold the truth."""
    trace, mapping = known.record(seed)
    result = known.estimate([trace], mapping, known.structure, start=FREE)
    if result.uncertainty is None:
        raise RuntimeError("the fit tells no uncertainty")
    names, covariance = result.uncertainty.names, result.uncertainty.covariance
    truth = np.array([*known.truth, *[0.0] * (len(names) - len(known.truth))])  # of constants
    low, high = result.uncertainty.interval(0.95).T[:, : len(known.truth)]
    away = (result.uncertainty.values - truth) / np.sqrt(np.diag(covariance))
    sizes, vectors = np.linalg.eigh(covariance / np.sqrt(np.outer(np.diag(covariance), np.diag(covariance))))
    kept = sizes > 1e-9 * sizes[-1]  # of a state space of several outputs coefficients hang together
    distance = float(np.sum((vectors.T @ away)[kept] ** 2 / sizes[kept]))
    inside = {
        "parameters": (low <= known.truth) & (high >= known.truth),
        "all together": np.array([distance <= stats.chi2.ppf(0.95, np.count_nonzero(kept))]),
    }
    ratios = list(result.model.ratios.values())
    if not ratios:
        return inside
    of_truth = _true_ratios(result, truth)
    inside["poles"] = _of_poles(result, of_truth)
    views = linear_views(result.model, result.uncertainty, seed)
    true = [_true_view(view, one) for view, one in zip(views, of_truth, strict=True)]
    inside["gain"] = _in_band(
        [np.abs(view.responses(FREQUENCIES)) for view in views], [np.abs(one.responses(FREQUENCIES)[0]) for one in true]
    )
    inside["step response"] = _in_band([_steps(view) for view in views], [_steps(one)[0] for one in true])
    return inside


def _true_ratios(result: FitResult, truth: np.ndarray) -> list[Ratio]:
    model = result.model
    if isinstance(model, VectorARXModel):
        return list(replace(model, coefficients=truth[: len(model.coefficients)]).ratios.values())
    assert result.uncertainty is not None
    return [_true_ratio(one, result.uncertainty.names, truth) for one in model.ratios.values()]


def _true_ratio(ratio: Ratio, names: tuple[str, ...], truth: np.ndarray) -> Ratio:
    b, f = (
        np.array([value for name, value in zip(names, truth, strict=True) if name.startswith(begin)])
        for begin in (ratio.of_numerator, ratio.of_denominator)
    )
    F = [1.0, *(-f if ratio.past_outputs else f)] if ratio.discrete else [*f, 1.0]
    return Ratio(
        B=b, F=np.array(F), delay=ratio.delay, discrete=ratio.discrete, of_numerator=ratio.of_numerator,
        of_denominator=ratio.of_denominator, past_outputs=ratio.past_outputs,
    )  # fmt: skip


def _true_view(view: LinearView, ratio: Ratio) -> LinearView:
    fields = {name: getattr(view, name) for name in LinearView.__dataclass_fields__}
    return LinearView(**{**fields, "B": ratio.B[np.newaxis], "F": ratio.F[np.newaxis]})


def _of_poles(result: FitResult, ratios: list[Ratio]) -> np.ndarray:
    """A true mode without a fitted one beside it is not held."""
    fitted = modes(result.model, result.uncertainty)
    held: list[bool] = []
    for begin in dict.fromkeys(one.of_denominator for one in ratios):
        ratio = next(one for one in ratios if one.of_denominator == begin)
        for pole in np.roots(ratio.F if ratio.discrete else ratio.F[::-1]):
            if pole.imag < 0.0:
                continue
            s = np.log(complex(pole)) / T if ratio.discrete else complex(pole)
            true = {"time_constant": -1.0 / s.real} if pole.imag == 0.0 else {
                "natural_frequency": abs(s), "damping": -s.real / abs(s)
            }  # fmt: skip
            alike = [m for m in fitted if m.intervals.keys() == true.keys()]
            mode = min(alike, key=lambda m: abs(m.pole - pole), default=None)
            for name, value in true.items():
                low, high = (np.inf, -np.inf) if mode is None else mode.intervals[name]
                held.append(low <= value <= high)
    return np.array(held)


def _steps(view: LinearView) -> np.ndarray:
    found = np.zeros((len(view.B), len(INSTANTS)))
    for row, b, f in zip(found, view.B, view.F, strict=True):
        num, den = (b, f) if view.discrete else signal.cont2discrete((b[::-1], f[::-1]), T, "zoh")[:2]
        taps = [*np.zeros(view.delay), *np.ravel(num)]
        row[:] = signal.lfilter(taps, den, np.ones(INSTANTS[-1] + 1))[INSTANTS]
    return found


def _in_band(drawn: list[np.ndarray], truth: list[np.ndarray]) -> np.ndarray:
    inside = []
    for draws, true in zip(drawn, truth, strict=True):
        low, high = band(draws[1:])
        seen = np.ptp(draws[1:], axis=0) > 0.0  # before the dead time there is nothing to doubt
        inside.append(((low <= true) & (true <= high))[seen])
    return np.concatenate(inside)


def responses_held(orders: AbstractPolynomial, truth: list[float], seed: int) -> Held:
    """Which bands of the estimates without parameters hold the truth, where there is something to see."""
    trace, mapping = polynomial_record(seed, orders, truth)
    p = orders.polynomials(np.array([*truth, 0.0]))
    found = estimate_impulse_response([trace], mapping)
    g = signal.lfilter(p.B[0], p.F[0], np.eye(1, int(found.lags[-1]) + 1)[0])[found.lags]
    seen = np.abs(g) > 0.01 * np.abs(g).max()
    inside = np.abs(found.values[0] - g) <= stats.norm.ppf(0.975) * found.deviation[0]
    spa = estimate_frequency_response([trace], mapping, frequency=FREQUENCIES)
    z = np.exp(-1j * FREQUENCIES * T)
    G = np.polyval(p.B[0][::-1], z) / np.polyval(p.F[0][::-1], z)
    return {
        "impulse response": inside[seen],
        "frequency response (SPA)": np.abs(spa.values[:, 0] - G) <= spa.radius[:, 0],
    }


def main() -> None:
    """Count."""
    given = dict(word.removeprefix("--").split("=", 1) for word in sys.argv[1:] if word.startswith("--"))
    runs = int(given.get("runs", 200))
    counts: dict[str, Callable[[int], Held]] = {name: partial(held, known) for name, known in STRUCTURES.items()}
    counts |= {name: partial(responses_held, *system) for name, system in OF_RESPONSES.items()}
    for name in given["only"].split(",") if "only" in given else counts:
        count = counts[name]
        began, inside = time.process_time(), defaultdict(list)
        for seed in range(runs):
            for what, those in count(seed).items():
                inside[what].append(those)
        note = f"92 to 98 asked; {runs} records, {(time.process_time() - began) / runs:.2f} s each"
        for what, those in inside.items():
            found(
                f"{name}, {what}: regions of 95 % that hold the truth",
                100.0 * float(np.mean(np.concatenate(those))),
                "%",
                note=note,
            )


if __name__ == "__main__":
    main()
