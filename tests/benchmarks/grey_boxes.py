"""Grey boxes: coverage of their intervals on simulated systems, time beside SciPy, and the Cascaded Tanks.

    [SYSID_DATA=<folder>] python -m tests.benchmarks grey_boxes [--seeds=20] [--only=coverage,time,tanks]
    python -m tests.benchmarks grey_boxes --only=profile [--seeds=20] [--systems="two tanks,DC motor"]
    python -m tests.benchmarks grey_boxes --only=cases [--seeds=20]

Coverage: each system is run at known parameters, with white noise of 2 % of the output's range; the fit starts at
parameters that are off by up to 40 %; how often the 95 % interval of a parameter holds the true one is counted over
parameters and seeds; with ``profile``, which is no default, from the curvature and by profile likelihood side by side,
and with ``cases`` of a parameter that differs by case.
Time: two tanks, beside ``scipy.optimize.least_squares`` over ``solve_ivp`` (RK45, held inputs,
finite differences), both from the same start to the same cost. Tanks: ``cascaded_tanks/dataBenchmark.csv`` (4TU
10.4121/12960104): equations are tried on the first part of the estimation record and chosen by the rest of it, then
fitted to all of it; the first 50 samples of the validation record give its state, and the samples after them count.
"""

from __future__ import annotations

import os
import re
import sys
import time
from dataclasses import dataclass, replace
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import scipy

from sysid.errors import TraceError
from sysid.estimation import FitResult, Training
from sysid.estimation.grey_box.fit import fit_grey_box
from sysid.models import GreyBox, GreyBoxModel, History, Mapping, Scaling, Start, StartKind, beginning
from sysid.traces import Trace
from tests.benchmarks._findings import found
from tests.benchmarks._public import checked
from tests.traces.made import trace_of

MAPPING = Mapping.parse("u -> y")
ESTIMATED = Start(kind=StartKind.ESTIMATED)
SAMPLES, NOISE = 400, 0.02


@dataclass(frozen=True, kw_only=True)
class System:
    """Equations, their true parameters, the state they begin at, and the range of their input."""

    equations: str
    true: dict[str, float]
    begin: dict[str, float]
    inputs: tuple[float, float]
    sample_time: float
    fixed: dict[str, float] | None = None

    def grey(self, parameters: dict[str, float]) -> GreyBox:
        named: dict[str, Any] = {name: {"start": value, "low": 0.0} for name, value in parameters.items()}
        named |= {name: {"start": value, "fixed": True} for name, value in (self.fixed or {}).items()}
        return GreyBox(equations=self.equations, parameters=named, initial=dict(self.begin))


SYSTEMS = {
    "two tanks": System(
        equations="out = k1*sqrt(x1); dx1/dt = k4*u - out; dx2/dt = out - k2*sqrt(x2); y = x2",
        true={"k1": 0.05, "k2": 0.045, "k4": 0.04}, begin={"x1": 4.0, "x2": 3.0}, inputs=(1.0, 4.0), sample_time=4.0,
    ),
    "DC motor": System(
        equations="di/dt = (u - r*i - k*w)/l; dw/dt = (k*i - b*w)/j; y = w",
        true={"r": 1.2, "k": 0.4, "b": 0.02}, begin={"i": 0.0, "w": 0.0}, inputs=(-5.0, 5.0), sample_time=0.05,
        fixed={"l": 0.1, "j": 0.05},
    ),
    "pendulum": System(
        equations="dq/dt = w; dw/dt = -g*sin(q) - d*w + k*u; y = q",
        true={"g": 9.0, "d": 0.5, "k": 3.0}, begin={"q": 0.3, "w": 0.0}, inputs=(-1.0, 1.0), sample_time=0.05,
    ),
    "two masses with friction": System(
        equations="dw1/dt = (u - c*phi - d*(w1 - w2) - f*tanh(w1/0.2))/j; dphi/dt = w1 - w2; "
        "dw2/dt = (c*phi + d*(w1 - w2))/j2; y = w1",
        true={"c": 20.0, "d": 0.4, "f": 0.5, "j": 0.3}, begin={"w1": 0.0, "phi": 0.0, "w2": 0.0}, inputs=(-2.0, 2.0),
        sample_time=0.03, fixed={"j2": 0.5},
    ),
    "heat exchanger": System(
        equations="da/dt = u*(20 - a)/m + h*(b - a); db/dt = 3 - h*(b - a); y = a",
        true={"m": 8.0, "h": 0.15}, begin={"a": 40.0, "b": 60.0}, inputs=(0.4, 2.0), sample_time=1.0,
    ),
    "predator and prey": System(
        equations="da/dt = g*a - e*a*b + u; db/dt = -d*b + c*a*b; y = a",
        true={"g": 0.6, "e": 0.3, "d": 0.5, "c": 0.2}, begin={"a": 3.0, "b": 2.0}, inputs=(0.0, 0.4), sample_time=0.2,
    ),
}  # fmt: skip


def trace(u: np.ndarray, y: np.ndarray, sample_time: float, name: str = "record") -> Trace:
    return trace_of({"u": u, "y": y}, name=name, sample_time=sample_time)


def model_of(grey: GreyBox, true: dict[str, float], sample_time: float) -> GreyBoxModel:
    """Equations at their true parameters, in the units of their states."""
    states = len(grey.system.states)
    return GreyBoxModel(
        grey=grey, theta=np.array(list(true.values())), norms=(), levels=(0.0,) * states, spans=(1.0,) * states,
        substeps=50, scaling=Scaling.identity(1), mapping=MAPPING, sample_time=sample_time, input_units=("V",),
        output_unit="V", rest_output=0.0,
    )  # fmt: skip


def record(system: System, rng: np.random.Generator) -> Trace:
    """The system at its true parameters, from where it begins."""
    u = np.repeat(rng.uniform(*system.inputs, SAMPLES // 20), 20)
    model = model_of(system.grey(system.true), system.true, system.sample_time)
    y = model.simulate(u[:, None])
    return trace(u, y + NOISE * np.ptp(y) * rng.standard_normal(SAMPLES), system.sample_time)


def started(system: System, rng: np.random.Generator) -> GreyBox:
    return system.grey({name: value * rng.uniform(0.6, 1.4) for name, value in system.true.items()})


def profiles(seeds: int, systems: list[str]) -> None:
    """Coverage of both kinds of intervals on the same fits, of two starts."""
    for name in systems:
        system, began = SYSTEMS[name], time.perf_counter()
        inside, widths, endless = np.zeros((2, len(system.true))), np.zeros((2, len(system.true))), 0
        true = np.array(list(system.true.values()))
        for seed in range(seeds):
            rng = np.random.default_rng([seed, len(name)])
            data, grey = record(system, rng), started(system, rng)
            fit = fit_grey_box(
                [data], MAPPING, replace(grey, intervals="profile"), Training(starts=2), start=ESTIMATED
            )  # fmt: skip
            known = fit.uncertainty
            assert known is not None
            assert known.profile is not None
            for row, ends in enumerate((known.interval(0.95), known.profile)):
                inside[row] += (ends[:, 0] <= true) & (true <= ends[:, 1])
                width = ends[:, 1] - ends[:, 0]
                widths[row] += np.where(np.isfinite(width), width, 0.0)
            endless += int(np.count_nonzero(~np.isfinite(known.profile).all(axis=1)))
        seconds = (time.perf_counter() - began) / seeds
        for row, kind in enumerate(("the curvature", "profile likelihood")):
            each = ", ".join(f"{key} {100 * n / seeds:.0f} %" for key, n in zip(system.true, inside[row], strict=True))
            note = (
                f"{each}; {endless} without an end by profile; {seconds:.1f} s a record with fit and profiles, 2 starts"
            )
            share = 100.0 * inside[row].sum() / (seeds * len(true))
            found(f"{name}: true parameters within 95 % intervals by {kind}", share, "%", note=note)


def cases(seeds: int) -> None:
    """Two tanks of three records, the pump's gain of each its own; and a fourth that was not fitted."""
    system, names = SYSTEMS["two tanks"], ("day1", "day2", "day3", "day4")
    held, counted, off, expected, refused = [0, 0], 0, [], [], 0
    for seed in range(seeds):
        rng = np.random.default_rng([seed, 46])
        gains = dict(zip(names, 0.04 * rng.uniform(0.8, 1.2, len(names)), strict=True))
        records = [
            replace(record(replace(system, true=system.true | {"k4": gain}), rng), name=name)
            for name, gain in gains.items()
        ]  # fmt: skip
        given: dict[str, Any] = {name: {"start": value, "low": 0.0} for name, value in system.true.items()}
        given["k4"]["per"] = "case"
        given["k1"] = {"start": system.true["k1"], "fixed": True}  # from which the gain can hardly be told apart
        grey = GreyBox(
            equations=system.equations, parameters=given, initial=dict(system.begin), intervals="profile"
        )  # fmt: skip
        fit = fit_grey_box(records[:3], MAPPING, grey, Training(starts=2), start=ESTIMATED)
        assert fit.uncertainty is not None
        true = np.array([system.true["k2"], *(gains[name] for name in names[:3])])
        assert fit.uncertainty.profile is not None
        order = [fit.uncertainty.names.index("k2"), *(fit.uncertainty.names.index(f"k4 of {n}") for n in names[:3])]
        for kind, ends in enumerate((fit.uncertainty.interval(0.95)[order], fit.uncertainty.profile[order])):
            held[kind] += int(np.count_nonzero((ends[:, 0] <= true) & (true <= ends[:, 1])))
        counted += len(true)
        model = fit.model
        assert isinstance(model, GreyBoxModel)
        try:
            begun = beginning(model, records[3].columns(["u"]), records[3]["y"], ESTIMATED, case="day4")
        except TraceError:
            refused += 1
            continue
        off.append(begun.history.constants[0] / gains["day4"] - 1.0)
        expected.append(float(np.mean(list(model.by_case["k4"].values()))) / gains["day4"] - 1.0)
    for inside, kind in zip(held, ("the curvature", "profile likelihood"), strict=True):
        found(f"two tanks, gain by case: true parameters within 95 % intervals by {kind}", 100.0 * inside / counted,
              "%", note=f"{counted} intervals of {seeds} fits")  # fmt: skip
    found("two tanks, gain of a case that was not fitted from 50 samples: root mean square off",
          100.0 * float(np.sqrt(np.mean(np.square(off)))), "%",
          note=f"{refused} of {seeds} refused; the mean of the fitted cases would be "
          f"{100.0 * float(np.sqrt(np.mean(np.square(expected)))):.1f} % off")  # fmt: skip


def coverage(seeds: int) -> None:
    for name, system in SYSTEMS.items():
        began, held, counted, missed, apart = time.perf_counter(), 0, 0, 0, [0, 0]
        for seed in range(seeds):
            rng = np.random.default_rng([seed, len(name)])
            fit = fit_grey_box([record(system, rng)], MAPPING, started(system, rng), Training(), start=ESTIMATED)
            assert fit.uncertainty is not None
            low, high = fit.uncertainty.interval(0.95).T
            true = np.array(list(system.true.values()))
            known = np.isfinite(low)
            missed += int(np.count_nonzero(~known))
            inside = (low <= true) & (true <= high)
            held += int(np.count_nonzero(inside[known]))
            told = [one for one in fit.warnings if "hardly be told apart" in one]
            clear = known & ~np.array([any(name in one.split("(")[0].split() for one in told) for name in system.true])
            apart[0] += int(np.count_nonzero(inside[clear]))
            apart[1] += int(np.count_nonzero(clear))
            counted += int(np.count_nonzero(known))
        seconds = (time.perf_counter() - began) / seeds
        share = f"{100.0 * apart[0] / apart[1]:.1f} %" if apart[1] else "none"
        note = (
            f"{counted} intervals, {missed} parameters without one, {seconds:.2f} s a record and fit; "
            f"of {apart[1]} that no warning says can hardly be told apart from another {share}"
        )
        found(f"{name}: true parameters within their 95 % intervals", 100.0 * held / max(counted, 1), "%", note=note)


def beside_scipy() -> None:
    system = SYSTEMS["two tanks"]
    rng = np.random.default_rng(1)
    data = record(system, rng)
    u, y = data["u"], data["y"]
    begin = {name: value * 1.3 for name, value in system.true.items()}
    fit_grey_box([data], MAPPING, system.grey(begin), Training(starts=1), start=ESTIMATED)  # loads what is compiled
    began = time.perf_counter()
    ours = fit_grey_box([data], MAPPING, system.grey(begin), Training(starts=1), start=ESTIMATED)
    seconds = time.perf_counter() - began

    def run(p: np.ndarray) -> np.ndarray:
        k1, k2, k4, *x = p
        levels = []
        for value in u:
            levels.append(x[1])

            def rates(_: float, x: np.ndarray, value: float = value) -> list[float]:
                out = k1 * max(x[0], 0.0) ** 0.5
                return [k4 * value - out, out - k2 * max(x[1], 0.0) ** 0.5]

            x = scipy.integrate.solve_ivp(rates, (0.0, system.sample_time), x, rtol=1e-6, atol=1e-8).y[:, -1]
        return np.array(levels) - y

    began = time.perf_counter()
    first = np.array([*begin.values(), *system.begin.values()])
    theirs = scipy.optimize.least_squares(run, first, x_scale=np.abs(first))
    peer = time.perf_counter() - began
    note = (
        f"{seconds:.2f} s and {peer:.1f} s; mean squares {ours.history['mse'][-1]:.4g} and {np.mean(theirs.fun**2):.4g}"
    )
    found("two tanks: times faster than SciPy's least_squares with solve_ivp", peer / seconds, "", note=note)


TANKS = {
    "Bernoulli": """
        over = max(x1 - 10, 0)/2
        spill = max(x2 - 10, 0)/2
        dx1/dt = -k1*sqrt(x1) + k4*u - over {first}
        dx2/dt = k2*sqrt(x1) - k3*sqrt(x2) + k5*over - spill {second}
        y = x2
    """,
    "Bernoulli with losses, an edge and a pump that are found": """
        over = max(x1 - top, 0)/2
        spill = max(x2 - 10, 0)/2
        out = k1*sqrt(x1) + c1*x1
        dx1/dt = k4*max(u - u0, 0) - out - over {first}
        dx2/dt = k2*out - k3*sqrt(x2) - c2*x2 + k5*over - spill {second}
        y = x2
    """,
}
TANKS["the same, its level read with play"] = TANKS["Bernoulli with losses, an edge and a pump that are found"].replace(
    "y = x2", "y = min(max(kept, x2 - width), x2 + width)\n        kept[k+1] = y"
)
NETWORKS = {
    "alone": ("", ""),
    "with two networks of 2 neurons": ("+ net(x1, u; neurons=2)", "+ net(x1, x2; neurons=2)"),
    "with a network of 3 neurons": ("", "+ net(x2; neurons=3)"),
}
START = {name: {"start": 0.05, "low": 0.0} for name in ("k1", "k2", "k3", "k4")} | {
    "k5": {"start": 0.3, "low": 0.0, "high": 5.0},
    "c1": {"start": 0.001, "low": -1.0, "high": 1.0},
    "c2": {"start": 0.001, "low": -1.0, "high": 1.0},
    "u0": {"start": 0.0, "low": -2.0, "high": 2.0},
    "top": {"start": 10.0, "low": 3.0, "high": 20.0},
    "width": {"start": 0.1, "low": 0.0, "high": 0.5},
}
TRIED, SEEN = 768, 200
"""Samples of the estimation record that equations are tried on, the rest choosing between them; and how many before the
rest give its state."""


def tank_structure(name: str, networks: tuple[str, str]) -> GreyBox:
    text = TANKS[name].format(first=networks[0], second=networks[1])
    parameters = {key: value for key, value in START.items() if re.search(rf"\b{key}\b", text)}
    if "k2*out" in text:
        parameters["k2"] = {"start": 1.0, "low": 0.0}
    levels: dict[str, Any] = {one: {"start": 5.0, "low": 0.0, "high": 15.0} for one in ("x1", "x2")}
    levels |= {"kept": 5.0} if "kept" in text else {}
    return GreyBox(equations=text, parameters=parameters, initial=levels)


def tanks() -> None:
    data = np.genfromtxt(checked("cascaded_tanks/dataBenchmark.csv"), delimiter=",", names=True)
    u, y = data["uEst"], data["yEst"]
    training = Training(max_iterations=150)
    for title, networks in NETWORKS.items():
        began, held = time.perf_counter(), {}
        for name in TANKS:
            tried = trace(u[:TRIED], y[:TRIED], 4.0, "first part")
            fit = fit_grey_box([tried], MAPPING, tank_structure(name, networks), training, start=ESTIMATED)
            held[name] = after(fit, u[TRIED - SEEN :], y[TRIED - SEEN :], SEEN)
        chosen = min(held, key=lambda name: held[name])
        whole = trace(u, y, 4.0, "estimation")
        fit = fit_grey_box([whole], MAPPING, tank_structure(chosen, networks), training, start=ESTIMATED)
        seconds = time.perf_counter() - began
        left = ", ".join(f"{value:.4f} V {name}" for name, value in held.items())
        note = (
            f"{seconds:.1f} s, {fit.model.n_parameters} parameters, {chosen}; last part of the estimation record, "
            f"which chose: {left}; best published grey box 0.191 V, over all samples"
        )
        error = after(fit, data["uVal"], data["yVal"], 50)
        found(f"Cascaded Tanks, equations {title}: free run on the validation record", error, "V", note=note)


def after(fit: FitResult, u: np.ndarray, y: np.ndarray, n: int) -> float:
    """Error after the first samples, which give the state."""
    run = fit.model.simulate(u[n:, None], History(inputs=u[:n, None], output=y[:n]))
    return float(np.sqrt(np.mean((run - y[n:]) ** 2)))


def main() -> None:
    """Measure."""
    given = dict(option.removeprefix("--").split("=") for option in sys.argv[1:] if option.startswith("--"))
    asked = given.get("only", "coverage,time,tanks").split(",")
    if "coverage" in asked:
        coverage(int(given.get("seeds", 20)))
    if "cases" in asked:
        cases(int(given.get("seeds", 20)))
    if "profile" in asked:
        profiles(int(given.get("seeds", 20)), given.get("systems", "two tanks").split(","))
    if "time" in asked:
        beside_scipy()
    if "tanks" in asked and "SYSID_DATA" in os.environ:
        tanks()


if __name__ == "__main__":
    main()
