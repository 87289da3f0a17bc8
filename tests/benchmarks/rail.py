"""Run time of a braked train: 101 vehicles, 600 s, on the machine at hand. Not collected by pytest.

Run with ``python -m tests.benchmarks rail``, or ``python tests/benchmarks/rail.py REPEATS``. Each figure is the median
of so many runs (5) after one that warms up, by the clock on the wall and by the processor's, which other jobs on the
machine touch less. The handle makes an application, a release and an emergency; the brake is asked once for each
second, or at every sample.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable

import numpy as np

from sysid.airbrake.consist import Consist
from sysid.models import NARX, Mapping, NARXModel, Scaling, parameter_count
from sysid.rail.dynamics.brake import AbstractBrake, ReferenceBrake, no_brake
from sysid.rail.dynamics.drive import Limits, Schedule, drive
from sysid.rail.dynamics.motion import MovingTrain
from sysid.rail.dynamics.surrogate import Stage, SurrogateBrake, ValveSurrogateBrake
from sysid.rail.dynamics.track import TrackProfile
from sysid.rail.dynamics.train import heavy_haul

DURATION, REPEATS = 600.0, 5
CONSIST = Consist(pairs=50)
TRACK = TrackProfile.from_steps(
    "hills",
    grade=[(0.0, 0.0), (1500.0, 0.008), (3000.0, -0.008), (4500.0, 0.0)],
    curvature=[(2000.0, 1.0 / 600.0), (2500.0, 0.0)],
)


def network(mapping: str, seed: int) -> NARXModel:
    """A network of a published size with small random weights: its run time is that of a fitted one."""
    parsed, structure = Mapping.parse(mapping), NARX(input_delays=4, output_delays=4, neurons=20)
    n = len(parsed.inputs)
    count = parameter_count(structure.lags(n), 20, linear=True)
    return NARXModel(
        network=structure,
        theta=np.random.default_rng(seed).normal(0.0, 0.05, count),
        scaling=Scaling(input_offset=(77.0,) * n, input_scale=(13.0,) * n, output_offset=32.0, output_scale=32.0),
        mapping=parsed,
        sample_time=0.1,
        input_units=("psi",) * n,
        output_unit="psi",
        rest_output=0.0 if parsed.output == "BC" else 90.0,
    )


def cascade() -> SurrogateBrake:
    """Three networks for every valve: handle to pipe, pipe to reservoir, both to cylinder."""
    mappings = ("STP -> BP", "BP -> AR", "BP+AR -> BC")
    stages = [Stage(models=tuple(network(mapping, seed=k) for k in range(CONSIST.pairs))) for mapping in mappings]
    return SurrogateBrake(stages=stages, consist=CONSIST)


def valves() -> ValveSurrogateBrake:
    """One network for every valve, on the reference pipe."""
    return ValveSurrogateBrake(stages=[Stage(models=(network("BP+AR -> BC", seed=1),))], consist=CONSIST)


BRAKES: dict[str, Callable[[], AbstractBrake]] = {
    "no brake (the train alone)": lambda: no_brake(CONSIST.vehicles),
    "compiled reference": lambda: ReferenceBrake(consist=CONSIST),
    "three networks at each of 50 valves": cascade,
    "one network at each of 50 valves, reference pipe": valves,
}


def seconds(make: Callable[[], AbstractBrake], block: int) -> tuple[float, float]:
    """Wall time and processor time of one run."""
    times = 0.1 * np.arange(round(DURATION / 0.1))
    handle = np.select([times < 60.0, times < 150.0, times < 400.0], [90.0, 70.0, 90.0], 0.0)
    notch = np.select([times < 50.0, (times > 160.0) & (times < 400.0)], [6, 8], 0)
    moving = MovingTrain(train=heavy_haul(pairs=50), track=TRACK, speed=20.0)
    schedule = Schedule(handle=handle, notch=notch, sample_time=0.1)
    brake = make()
    began, worked = time.perf_counter(), time.process_time()
    drive(moving, brake, schedule, Limits(duration=DURATION, until_still=False, block=block))
    return time.perf_counter() - began, time.process_time() - worked


def main() -> None:
    """Print a table."""
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else REPEATS
    for block in (10, 1):
        for name, make in BRAKES.items():
            seconds(make, block)
            walls, works = zip(*(seconds(make, block) for _ in range(repeats)), strict=True)
            wall, work = statistics.median(walls), statistics.median(works)
            print(
                f"{name:<52} look every {0.1 * block:g} s: {wall:6.2f} s, {DURATION / wall:5.0f}x real time; "
                f"processor {work:5.2f} s, {DURATION / work:5.0f}x",
                flush=True,
            )


if __name__ == "__main__":
    main()
