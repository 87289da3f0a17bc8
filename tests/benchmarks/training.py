"""The compiled reference and the training epoch, against their limits, on the machine at hand.

    python -m tests.benchmarks training

Medians of seven after one run that warms up; one BLAS thread. Times are processor times, which other work on the
machine hardly changes; on an idle machine they are what a clock shows, which stands beside them.

* The reference: 2,000 s of EST01's command, 3 and 101 vehicles, the first valve's pressures recorded.
* One closed-loop epoch: 20,000 samples, 4/4/20 without feed-through, 281 parameters: free run, exact sensitivities and
  normal equations. Beside it the machine's own rates: a matrix product of the same shape, and the same recursion in C
  (``cc -O2`` and ``-O3 -march=native``) where a compiler is found.
"""

from __future__ import annotations

import ctypes
import shutil
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from sysid.airbrake.command import Command
from sysid.airbrake.consist import Consist
from sysid.airbrake.simulate import Probe, simulate
from sysid.estimation.networks.provider import RecursionProvider
from sysid.estimation.records.experiment import Experiment
from sysid.models import NARX, History, Recursion, Scaling, parameter_count
from sysid.reporting.numbers import number
from tests.benchmarks._findings import found

EST01 = [
    [0, 90], [100, 84.2], [500, 64.2], [1100, 90], [4100, 84.2], [4500, 70], [4800, 64.2], [5300, 90], [7800, 84.2],
    [8300, 90], [10000, 64.2], [10700, 90], [13500, 74], [14100, 90], [20000, 90],
]  # fmt: skip
SAMPLES, NEURONS = 20_000, 20

C_LOOP = """
#include <math.h>
void run(const double *u, double *y, int n, const double *W, const double *b, const double *v, double c) {
  for (int t = 4; t < n + 4; ++t) {
    double x[12];
    for (int i = 0; i < 4; ++i) { x[i] = u[2*(t-1-i)]; x[4+i] = u[2*(t-1-i)+1]; x[8+i] = y[t-1-i]; }
    double s = c;
    for (int k = 0; k < 20; ++k) {
      double a = b[k];
      for (int i = 0; i < 12; ++i) a += W[12*k+i] * x[i];
      s += v[k] * tanh(a);
    }
    y[t] = s < -3.0 ? -3.0 : s > 3.0 ? 3.0 : s;
  }
}
"""


@dataclass(frozen=True)
class Took:
    """Medians in milliseconds."""

    wall: float
    processor: float

    @property
    def note(self) -> str:
        """What a clock showed meanwhile."""
        return f"by the clock {number(self.wall)} ms"


def median_ms(call: Callable[[], object], repeats: int = 7) -> Took:
    """Median times of a call, after one that warms up."""
    call()
    seconds = []
    for _ in range(repeats):
        wall, processor = time.perf_counter(), time.process_time()
        call()
        seconds.append((time.perf_counter() - wall, time.process_time() - processor))
    return Took(*(1e3 * statistics.median(column) for column in zip(*seconds, strict=True)))


def reference() -> None:
    """Run time of the compiled reference."""
    command = Command.from_rows(EST01, time_unit="ds")
    probes = tuple(Probe(quantity=q, node=3) for q in ("pipe", "auxiliary", "cylinder"))
    for pairs, target in ((1, 0.2), (50, 5.0)):
        took = median_ms(lambda n=pairs: simulate(command, consist=Consist(pairs=n), probes=probes))
        found(f"reference, {2 * pairs + 1} vehicles, 2,000 s", took.processor / 1e3, "s", target=target, note=took.note)


def provider() -> RecursionProvider:
    """A 4/4/20 network over a random record."""
    rng = np.random.default_rng(0)
    lags = NARX(input_delays=4, output_delays=4, neurons=NEURONS).lags(2)
    template = Recursion(
        lags=lags,
        neurons=NEURONS,
        theta=np.zeros(parameter_count(lags, NEURONS, linear=False)),
        scaling=Scaling.identity(2),
        low=-3.0,
        high=3.0,
    )
    record = Experiment(
        inputs=rng.uniform(-1, 1, (SAMPLES, 2)),
        output=rng.uniform(-1, 1, SAMPLES),
        history=History.at_rest(inputs=[0.0, 0.0], output=0.0),
    )
    return RecursionProvider(template=template, experiments=(record,), closed=True)


def c_loop(form: Recursion, inputs: np.ndarray, flags: list[str]) -> Callable[[], np.ndarray] | None:
    """The free run in C, or nothing without a compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        return None
    folder = Path(tempfile.mkdtemp())
    (folder / "loop.c").write_text(C_LOOP, encoding="utf-8")
    subprocess.run([compiler, *flags, "-shared", "-fPIC", "loop.c", "-o", "loop.so", "-lm"], cwd=folder, check=True)
    run = ctypes.CDLL(str(folder / "loop.so")).run
    u = np.concatenate([np.zeros((4, 2)), inputs])
    y = np.zeros(SAMPLES + 4)
    parts = [np.ascontiguousarray(a) for a in (form.hidden_weights, form.hidden_bias, form.readout)]

    def call() -> np.ndarray:
        pointers = [ctypes.c_void_p(a.ctypes.data) for a in (u, y)]
        weights = [ctypes.c_void_p(a.ctypes.data) for a in parts]
        run(*pointers, ctypes.c_int(SAMPLES), *weights, ctypes.c_double(form.constant))
        return y[4:]

    return call


def epoch() -> None:
    """One closed-loop epoch and its parts, beside what the machine can do."""
    source = provider()
    theta = 0.1 * np.random.default_rng(1).standard_normal(len(source.template.theta))
    whole, loss = median_ms(lambda: source.linearise(theta)), median_ms(lambda: source.loss(theta))
    J = source.jacobian(theta)
    product = median_ms(lambda: J.T @ J)
    square = np.random.default_rng(2).standard_normal((1500, 1500))
    machine = median_ms(lambda: square @ square)
    found(f"epoch, {SAMPLES} samples, {len(theta)} parameters", whole.processor, "ms", target=60.0, note=whole.note)
    rates = SAMPLES * len(theta) ** 2 / product.processor / 1e6, 2 * 1500**3 / machine.processor / 1e6
    note = f"{rates[0]:.0f} of {rates[1]:.0f} Gflop/s; normal equations {product.processor:.1f} ms"
    share = rates[0] / rates[1]
    found("the normal equations' share of the machine's rate in a matrix product", 100.0 * share, "%", note=note)
    found("free run alone", loss.processor, "ms", note=loss.note)
    form, inputs = source.at(theta), source.experiments[0].inputs
    for flags in (["-O2"], ["-O3", "-march=native"]):
        call = c_loop(form, inputs, flags)
        if call is None:
            print("  no C compiler found")
            return
        largest = np.abs(call() - form.simulate(inputs, source.experiments[0].history)).max()
        took = median_ms(call)
        note = f"C {took.processor:.2f} ms, largest difference {largest:.1e}"
        found(
            f"free run, divided by a C loop ({' '.join(flags)})",
            loss.processor / took.processor,
            "x",
            target=1.5,
            note=note,
        )


if __name__ == "__main__":
    reference()
    with threadpool_limits(1, "blas"):
        epoch()
