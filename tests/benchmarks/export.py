"""Run times and sizes of exported surrogates, beside the model's own compiled free run.

    python -m tests.benchmarks export

One NARX 4/4/20 with two inputs and random weights whose free run forgets where it started, 20,000 samples; medians.
C is timed inside a program of its own, everything else from Python with the calls that a user makes. Times are
processor times of all threads together, which other work on the machine hardly changes; only a single step of C, which
is too short for that, is timed by the clock.
"""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from sysid.export import EXPORTERS, Surrogate
from sysid.export.differences import largest_difference
from sysid.export.expected_runs import random_cases
from sysid.models import NARX, Cascade, Mapping, NARXModel, Scaling, parameter_count
from tests.benchmarks._findings import found

SAMPLES = 20_000
RANGES = {"STP": (0.0, 90.0), "BP": (0.0, 90.0), "AR": (50.0, 90.0)}

TIMING = """
#include "NAME.h"
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#define N 20000
#define RUNS 101
static NAME_real in[N * PREFIX_N_INPUTS], out[N * PREFIX_N_OUTPUTS];
static double run[RUNS], single[N];
static double seen(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}
static double now(void) { return seen(CLOCK_MONOTONIC); }
static double spent(void) { return seen(CLOCK_PROCESS_CPUTIME_ID); }
static int order(const void *a, const void *b) { return *(const double *)a > *(const double *)b ? 1 : -1; }
int main(int argc, char **argv)
{
    NAME_state state;
    double number, begin, clock_cost = 1e9;
    int i;
    FILE *file = fopen(argv[argc - 1], "r");
    for (i = 0; i < N * PREFIX_N_INPUTS; i++) {
        if (fscanf(file, "%lf", &number) != 1) return 1;
        in[i] = (NAME_real)number;
    }
    for (i = 0; i < RUNS; i++) {
        NAME_init(&state, in, 0);
        begin = spent();
        NAME_run(&state, N, in, out, 0);
        run[i] = spent() - begin;
    }
    for (i = 0; i < 1000; i++) {
        begin = now();
        number = now() - begin;
        if (number < clock_cost) clock_cost = number;
    }
    NAME_init(&state, in, 0);
    for (i = 0; i < N; i++) {
        begin = now();
        NAME_step(&state, in + i * PREFIX_N_INPUTS, out);
        single[i] = now() - begin - clock_cost;
    }
    qsort(run, RUNS, sizeof *run, order);
    qsort(single, N, sizeof *single, order);
    printf("%.0f %.0f %.0f %.0f %.0f\\n", run[RUNS / 2], run[0], single[N / 2], single[N - N / 1000], single[N - 1]);
    return 0;
}
"""


def build(mapping: str, structure: NARX, seed: int) -> NARXModel:
    """A network with random weights, shrunk until its free run forgets where it started."""
    rng = np.random.default_rng(seed)
    parsed = Mapping.parse(mapping)
    n_inputs = len(parsed.inputs)
    lags = structure.lags(n_inputs)
    theta = rng.normal(size=parameter_count(lags, structure.neurons, linear=True, gated=structure.gated))
    theta *= 0.4 / np.sqrt(len(theta))
    theta[structure.neurons * lags.n_regressors :] *= 2.0
    return NARXModel(
        network=structure,
        theta=theta,
        scaling=Scaling(
            input_offset=(45.0,) * n_inputs, input_scale=(45.0,) * n_inputs, output_offset=38.0, output_scale=40.0
        ),
        mapping=parsed,
        sample_time=0.1,
        input_units=("psi",) * n_inputs,
        output_unit="psi",
        rest_output=0.0,
    )


def cascade() -> Surrogate:
    """The combined brake's wiring with networks as large as published ones, and long spaced lags for the pipe."""
    powers = [0, 1, 2, 4, 8, 16, 32, 64, 128, 256]
    return Surrogate.of(
        Cascade(
            models=(
                build("STP -> BP", NARX(input_delays=powers, output_delays=powers[1:], neurons=15), 1),
                build("BP -> ER", NARX(input_delays=4, output_delays=4, neurons=20), 2),
                build("BP+ER -> AR", NARX(input_delays=4, output_delays=4, neurons=20), 3),
                build("BP+AR+ER -> BC", NARX(input_delays=4, output_delays=4, neurons=20), 4),
            )
        ),
        RANGES,
    )


def median(call: Callable[[], object], repeats: int = 11) -> float:
    """Median time of a call in milliseconds, after one to warm up."""
    call()
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        call()
        times.append(1e3 * (time.process_time() - begin))
    return float(np.median(times))


def excitation(surrogate: Surrogate, cars: int) -> np.ndarray:
    """Inputs ``(SAMPLES, cars, n_inputs)`` within the declared range."""
    drawn = random_cases(surrogate, sequences=cars, samples=SAMPLES)
    return np.stack([case.inputs for case in drawn], axis=1)


def time_c(surrogate: Surrogate, folder: Path, inputs: np.ndarray, *flags: str) -> list[float]:
    """Median and least time of a run of 20,000 samples, and median, 99.9 % and greatest of a single step, in ns."""
    prefix = surrogate.identifier
    EXPORTERS["c"].write(surrogate, folder)
    (folder / "timing.c").write_text(TIMING.replace("NAME", prefix).replace("PREFIX", prefix.upper()))
    np.savetxt(folder / "inputs.txt", inputs)
    command = ["gcc", "-std=gnu99", *flags, "timing.c", f"{prefix}.c", "-lm", "-o", "timing"]
    subprocess.run(command, cwd=folder, check=True)
    done = subprocess.run(["./timing", "inputs.txt"], cwd=folder, check=True, capture_output=True, text=True)
    return [float(number) for number in done.stdout.split()]


def stack_bytes(surrogate: Surrogate, folder: Path, *flags: str) -> int:
    """Stack of a step: its own frame and the largest beneath it, as the compiler counts them."""
    prefix = surrogate.identifier
    command = ["gcc", "-std=c99", "-O2", *flags, "-fno-inline", "-fstack-usage", "-c", f"{prefix}.c"]
    subprocess.run(command, cwd=folder, check=True)
    usage = re.findall(r":(\w+)\t(\d+)\t", (folder / f"{prefix}.su").read_text())
    frames = {name: int(size) for name, size in usage}
    beneath = max((size for name, size in frames.items() if name.startswith("stage")), default=0)
    leaf = max((frames.get(name, 0) for name in ("dot", "tanh_near")), default=0)
    return frames[f"{prefix}_step"] + beneath + leaf


def timed(label: str, milliseconds: float, own: float, *, target: float | None = None, note: str = "") -> None:
    """A run time, beside the model's own."""
    ratio = f"{milliseconds / own:.2f} x our own free run"
    found(label, milliseconds, "ms", target=target, note="; ".join(filter(None, (ratio, note))))


def run_times(folder: Path) -> None:
    """Every runner on 20,000 samples."""
    surrogate = Surrogate.of(build("BP+AR -> BC", NARX(input_delays=4, output_delays=4, neurons=20), 2), RANGES)
    many = excitation(surrogate, 100)
    one, rest = many[:, :1], np.stack([surrogate.at_rest(many[0, i]) for i in range(100)])
    own = median(lambda: surrogate.simulate(one[:, 0]))
    expected = surrogate.simulate(one[:, 0])
    found("own compiled free run (numba)", own, "ms")
    for label, flags in {
        "C, double, -O2": ["-O2"],
        "C, double, -O2, tanh of libm": ["-O2", "-DBP_AR_TO_BC_LIBM_TANH"],
        "C, double, -O3 -march=native": ["-O3", "-march=native"],
        "C, float, -O2": ["-O2", "-DBP_AR_TO_BC_FLOAT"],
    }.items():
        middle, least, step, late, worst = time_c(surrogate, folder, one[:, 0], *flags)
        judged = label == "C, double, -O2"
        timed(label, middle / 1e6, own, target=5.0 if judged else None, note=f"least {least / 1e6:.1f} ms")
        note = f"timed alone: median {step:.0f} ns, 99.9 % {late:.0f} ns, most {worst:.0f} ns"
        found(f"{label}, one step of the run", middle / 1e3 / SAMPLES, "µs", target=0.25 if judged else None, note=note)
    for name, exporter in EXPORTERS.items():
        for file in exporter.write(surrogate, folder):
            runner = exporter.load(file, folder)
            difference = largest_difference(runner(one, rest[:1]).output[:, 0], expected)
            took = median(lambda runner=runner: runner(one, rest[:1]), repeats=5)
            label = f"{name}: {file.name} {file.dtype}"
            judged = name.startswith("onnx") and file.name.startswith("sequence")
            note = f"largest difference {difference:.1e} psi"
            timed(f"{label}, one car", took, own, target=80.0 if judged else None, note=note)
            if file.name.startswith("sequence") and file.name.endswith(".onnx"):
                took = median(lambda runner=runner: runner(many, rest), repeats=3)
                goal, each = 200.0 if file.dtype == "float32" else None, f"{took / own / 100:.2f} x a car"
                found(f"{label}, 100 cars", took, "ms", target=goal, note=each)
                pieces = [(first, first + 500) for first in range(0, SAMPLES, 500)]
                took = median(lambda r=runner, p=pieces: [r(many[a:b], rest) for a, b in p], repeats=3)
                note = f"{took / own / 100:.2f} x a car"
                found(f"{label}, 100 cars, 500 samples a call", took, "ms", note=note)


def sizes(folder: Path) -> None:
    """Sizes and stack of a single model and of a whole cascade."""
    single = Surrogate.of(build("BP+AR -> BC", NARX(input_delays=4, output_delays=4, neurons=20), 2), RANGES)
    for label, surrogate in {"NARX 4/4/20": single, "combined cascade, 4 models": cascade()}.items():
        for name in ("c", "fmi2", "fmi3", "onnx"):
            for file in EXPORTERS[name].write(surrogate, folder):
                goal = 100.0 if name == "c" and surrogate is not single else None
                found(f"{label}: {file.name}", (folder / file.name).stat().st_size / 1e3, "kB", target=goal)
                if name == "c":
                    macro = f"-D{surrogate.identifier.upper()}_FLOAT"
                    note = f"{stack_bytes(surrogate, folder, macro)} bytes in float"
                    found(f"{label}: stack of a step in C", stack_bytes(surrogate, folder), "bytes", note=note)
    middle, _, _, _, worst = time_c(cascade(), folder, excitation(cascade(), 1)[:, 0], "-O2")
    note = f"most {worst / 1e3:.1f} µs"
    found("combined cascade, C -O2, one step", middle / 1e3 / SAMPLES, "µs", note=note)


def main() -> None:
    """Run times, then sizes."""
    with tempfile.TemporaryDirectory() as folder:
        run_times(Path(folder))
        sizes(Path(folder))


if __name__ == "__main__":
    main()
