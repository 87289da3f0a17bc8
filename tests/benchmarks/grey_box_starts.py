"""Grey boxes from starts that are far off: how often the minimum is found, and in what time.

    python -m tests.benchmarks grey_box_starts [--seeds=5] [--off=3,10] [--shooting=auto,single,multiple] [--starts=4]
        [--systems="pendulum,SIR epidemic"]

Each system is run at its true parameters, with white noise of 1.5 % of the output's range. Each parameter starts at the
true one times or over up to ``off`` (log-uniform), each initial state at half to twice the true one and up to a fifth
of what the state ranges over. A fit has found the minimum where its free run's root mean square error over the
record is at most 1.1 times that of the noise. Time is processor time, of all threads.
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from sysid.errors import TraceError
from sysid.estimation import Training
from sysid.estimation.grey_box.fit import fit_grey_box
from sysid.models import GreyBox, Start, StartKind
from sysid.traces import Trace
from tests.benchmarks._findings import found
from tests.benchmarks.grey_boxes import MAPPING, model_of
from tests.traces.made import trace_of

ESTIMATED = Start(kind=StartKind.ESTIMATED)
SAMPLES, NOISE, FOUND = 400, 0.015, 1.1


@dataclass(frozen=True, kw_only=True)
class System:
    """Equations, true parameters, where the record begins, the range of the input, and the samples that it holds."""

    equations: str
    true: dict[str, float]
    begin: dict[str, float]
    inputs: tuple[float, float]
    sample_time: float
    held: int = 20
    fixed: dict[str, float] | None = None

    def grey(self, parameters: dict[str, float], begin: dict[str, float]) -> GreyBox:
        named: dict[str, Any] = {name: {"start": value, "low": 0.0} for name, value in parameters.items()}
        named |= {name: {"start": value, "fixed": True} for name, value in (self.fixed or {}).items()}
        return GreyBox(equations=self.equations, parameters=named, initial=begin)


SYSTEMS = {
    "predator and prey": System(
        equations="da/dt = g*a - e*a*b + u; db/dt = -d*b + c*a*b; y = a",
        true={"g": 0.6, "e": 0.3, "d": 0.5, "c": 0.2}, begin={"a": 3.0, "b": 2.0}, inputs=(0.0, 0.4), sample_time=0.2,
    ),
    "bioreactor": System(
        equations="growth = mu*s/(ks + s)*x; dx/dt = growth - u*x; ds/dt = u*(10 - s) - growth/yield; y = s",
        true={"mu": 0.5, "ks": 1.2, "yield": 0.45}, begin={"x": 1.0, "s": 6.0}, inputs=(0.05, 0.4), sample_time=0.5,
    ),
    "quarter car": System(
        equations="d = zs - zu; stop = ke*(max(d - gap, 0) - max(-d - gap, 0)); f = ks*d + cs*(vs - vu) + stop; "
        "dzs/dt = vs; dvs/dt = -f/300; dzu/dt = vu; dvu/dt = (f - 150000*(zu - u))/40; y = zs",
        true={"ks": 16000.0, "cs": 1000.0, "ke": 80000.0, "gap": 0.03},
        begin={"zs": 0.0, "vs": 0.0, "zu": 0.0, "vu": 0.0}, inputs=(-0.06, 0.06), sample_time=0.01, held=30,
    ),
    "Van der Pol": System(
        equations="dx/dt = v; dv/dt = m*(1 - x^2)*v - w*x + b*u; y = x",
        true={"m": 1.5, "w": 1.0, "b": 0.8}, begin={"x": 1.0, "v": 0.0}, inputs=(-1.0, 1.0), sample_time=0.1,
    ),
    "Duffing": System(
        equations="dx/dt = v; dv/dt = -d*v - a*x - b*x^3 + c*u; y = x",
        true={"d": 0.2, "a": 1.0, "b": 2.0, "c": 1.5}, begin={"x": 0.5, "v": 0.0}, inputs=(-1.0, 1.0), sample_time=0.1,
    ),
    "pendulum": System(
        equations="dq/dt = w; dw/dt = -g*sin(q) - d*w + k*u; y = q",
        true={"g": 9.0, "d": 0.5, "k": 3.0}, begin={"q": 0.3, "w": 0.0}, inputs=(-1.0, 1.0), sample_time=0.05,
    ),
    "DC motor with friction": System(
        equations="di/dt = (u - r*i - k*w)/0.1; dw/dt = (k*i - b*w - c*tanh(w/0.2))/0.05; y = w",
        true={"r": 1.2, "k": 0.4, "b": 0.02, "c": 0.15}, begin={"i": 0.0, "w": 0.0}, inputs=(-5.0, 5.0),
        sample_time=0.05,
    ),
    "stirred tank": System(
        equations="r = k*exp(-e*(1/temp - 1/350)*1000)*c; dc/dt = 1 - c - r; "
        "dtemp/dt = 350 - temp + h*r + ua*(u - temp); y = temp",
        true={"k": 1.0, "e": 8.75, "h": 150.0, "ua": 2.0}, begin={"c": 0.5, "temp": 350.0}, inputs=(295.0, 320.0),
        sample_time=0.05,
    ),
    "heat exchanger": System(
        equations="da/dt = u*(20 - a)/m + h*(b - a); db/dt = 3 - h*(b - a); y = a",
        true={"m": 8.0, "h": 0.15}, begin={"a": 40.0, "b": 60.0}, inputs=(0.4, 2.0), sample_time=1.0,
    ),
    "SIR epidemic": System(
        equations="new = b*(1 - u)*s*i; ds/dt = w*(1 - s - i) - new; di/dt = new - g*i; y = i",
        true={"b": 0.5, "g": 0.15, "w": 0.02}, begin={"s": 0.95, "i": 0.01}, inputs=(0.0, 0.5), sample_time=0.5,
    ),
    "FitzHugh and Nagumo": System(
        equations="dv/dt = c*(v - v^3/3 + r + u); dr/dt = -(v - a + b*r)/c; y = v",
        true={"a": 0.2, "b": 0.2, "c": 3.0}, begin={"v": -1.0, "r": 1.0}, inputs=(-0.2, 0.2), sample_time=0.1,
    ),
    "two masses with friction": System(
        equations="dw1/dt = (u - c*phi - d*(w1 - w2) - f*tanh(w1/0.2))/j; dphi/dt = w1 - w2; "
        "dw2/dt = (c*phi + d*(w1 - w2))/0.5; y = w1",
        true={"c": 20.0, "d": 0.4, "f": 0.5, "j": 0.3}, begin={"w1": 0.0, "phi": 0.0, "w2": 0.0}, inputs=(-2.0, 2.0),
        sample_time=0.03,
    ),
}  # fmt: skip


def record(system: System, rng: np.random.Generator) -> tuple[Trace, float, dict[str, float]]:
    """The system at its true parameters, the mean square of its noise, and what its states range over."""
    u = np.repeat(rng.uniform(*system.inputs, SAMPLES // system.held + 1), system.held)[:SAMPLES]
    model = model_of(system.grey(system.true, system.begin), system.true, system.sample_time)
    form = model.recursion
    begun = np.array([system.begin[name] for name in form.lowered.states])
    path = np.empty((SAMPLES, len(begun)))
    y = form.run(form.given(u[:, None], u[:1, None]), begun, path)[:, 0]
    spans = dict(zip(form.lowered.states, np.ptp(path, axis=0), strict=True))
    noise = NOISE * np.ptp(y) * rng.standard_normal(SAMPLES)
    data = trace_of({"u": u, "y": y + noise}, sample_time=system.sample_time)
    return data, float(np.mean(noise**2)), spans


def started(system: System, off: float, spans: dict[str, float], rng: np.random.Generator) -> GreyBox:
    """The equations with starts that are off."""
    parameters = {name: value * off ** rng.uniform(-1.0, 1.0) for name, value in system.true.items()}
    begin = {
        name: value * 2.0 ** rng.uniform(-1.0, 1.0) + 0.2 * spans[name] * rng.uniform(0.0, 1.0)
        if abs(value) < 5.0 * spans[name]
        else value + 0.5 * spans[name] * rng.uniform(-1.0, 1.0)
        for name, value in system.begin.items()
    }
    return system.grey(parameters, begin)


def measured(name: str, off: float, seeds: int, options: dict[str, Any]) -> tuple[list[float], list[float], list[int]]:
    """Ratios of root mean square errors, seconds and iterations, one of each seed; infinity where there is no fit."""
    system, ratios, seconds, iterations = SYSTEMS[name], [], [], []
    for seed in range(seeds):
        rng = np.random.default_rng([seed, len(name), round(off)])
        data, noise, spans = record(system, rng)
        grey, began = started(system, off, spans, rng), time.process_time()
        try:
            fit = fit_grey_box([data], MAPPING, grey, Training(**options), start=ESTIMATED)
            ratios.append(float((fit.history["mse"][-1] / noise) ** 0.5))
            iterations.append(max(one.iterations for one in fit.attempts))
        except (TraceError, np.linalg.LinAlgError):
            ratios.append(np.inf)
            iterations.append(0)
        seconds.append(time.process_time() - began)
    return ratios, seconds, iterations


def main() -> None:
    """Measure."""
    given = dict(option.removeprefix("--").split("=") for option in sys.argv[1:] if option.startswith("--"))
    seeds = int(given.get("seeds", 5))
    names = given["systems"].split(",") if "systems" in given else list(SYSTEMS)
    for way in given.get("shooting", "auto").split(","):
        options: dict[str, Any] = {} if way == "before" else {"shooting": way}
        options |= {"starts": int(given["starts"])} if "starts" in given else {}
        for off in map(float, given.get("off", "3,10").split(",")):
            every, total = list[float](), 0.0
            for name in names:
                ratios, seconds, iterations = measured(name, off, seeds, options)
                every, total = every + ratios, total + sum(seconds)
                each = ", ".join(f"{one:.3g}" for one in ratios)
                share = 100.0 * float(np.mean(np.array(ratios) <= FOUND))
                found(f"{name}, starts up to {off:g} times off, {way}: found", share, "%",
                      note=f"errors over the noise's {each}; {np.median(seconds):.2f} s, "
                      f"{np.median(iterations):.0f} iterations")  # fmt: skip
            found(f"all systems, starts up to {off:g} times off, {way}: found",
                  100.0 * float(np.mean(np.array(every) <= FOUND)), "%",
                  note=f"{len(every)} fits, {total:.1f} s of processor time")  # fmt: skip


if __name__ == "__main__":
    main()
