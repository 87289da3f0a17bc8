"""The scenarios of the consequence report: stops, a release, both ends, and a driver on a falling line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from sysid.airbrake.command import EMERGENCY, Command
from sysid.rail.constants import KMH
from sysid.rail.dynamics.track import TrackProfile
from sysid.rail.dynamics.train import Train
from sysid.rail.judging.scenarios import Scenario
from sysid.rail.traces.cycles import HabitSettings, NotchAndBrakeDriver, rolling_line

FULL_SERVICE, HALF_SERVICE, RUNNING = 64.2, 77.0, 90.0
"""Handle positions in psi gauge: the dissertation's full service, half of its reduction, released."""

LINE_SEED, LINE_TIME = 1, 600.0
"""Which falling line the driver has, and for how many seconds he is watched (ours)."""


def _command(*rows: tuple[float, float], duration: float) -> Command:
    return Command.from_rows([list(row) for row in rows], duration=duration)


FULL = _command((0.0, RUNNING), (5.0, FULL_SERVICE), duration=400.0)
HALF = _command((0.0, RUNNING), (5.0, HALF_SERVICE), duration=600.0)
DUMP = _command((0.0, RUNNING), (5.0, EMERGENCY), duration=400.0)
AGAIN = _command((0.0, RUNNING), (5.0, HALF_SERVICE), (35.0, RUNNING), (95.0, FULL_SERVICE), duration=600.0)


def standard_scenarios(train: Train, *, speed: float = 80.0 * KMH) -> Mapping[str, Scenario]:
    """Stops of a train: on the level, over a crest, through a sag, in a curve, and one released and made again.

    All begin five seconds after the record.

    Args:
        train: The vehicles.
        speed: At the beginning in m/s.

    Returns:
        Scenarios by name.

    Example:
        >>> from sysid.rail.dynamics.train import heavy_haul
        >>> sorted(standard_scenarios(heavy_haul(pairs=1)))[:3]
        ['crest, full service', 'curve, full service', 'emergency']
    """
    level, start = TrackProfile.level(), 0.25 * train.length
    crest = TrackProfile.from_steps("crest", grade=[(-4000.0, 0.008), (0.0, -0.008)])
    sag = TrackProfile.from_steps("sag", grade=[(-4000.0, -0.008), (0.0, 0.008)])
    curve = TrackProfile.from_steps("curve", curvature=[(0.0, 1.0 / 300.0), (600.0, 0.0)])
    made = [
        Scenario(name="full service", train=train, track=level, command=FULL, speed=speed),
        Scenario(name="emergency", train=train, track=level, command=DUMP, speed=speed),
        Scenario(name="half service", train=train, track=level, command=HALF, speed=speed),
        Scenario(name="release and reapply", train=train, track=level, command=AGAIN, speed=speed),
        Scenario(name="crest, full service", train=train, track=crest, command=FULL, speed=speed, position=start),
        Scenario(name="sag, full service", train=train, track=sag, command=FULL, speed=speed, position=start),
        Scenario(name="curve, full service", train=train, track=curve, command=FULL, speed=speed),
    ]
    return {scenario.name: scenario for scenario in made}


def all_scenarios(train: Train, *, speed: float = 80.0 * KMH) -> Mapping[str, Scenario]:
    """The standard scenarios, the same stops braked from both ends, and a driver on a falling line.

    Args:
        train: The vehicles.
        speed: At the beginning in m/s; the driver holds a speed of his own.

    Returns:
        Scenarios by name.
    """
    standard = dict(standard_scenarios(train, speed=speed))
    both = [
        replace(standard[name], name=f"{name}, both ends", two_ended=True) for name in ("full service", "emergency")
    ]
    habits, line = HabitSettings(), rolling_line(LINE_SEED)
    driven = Scenario(
        name="driver on a falling line",
        train=train,
        track=line,
        command=_command((0.0, RUNNING), duration=LINE_TIME),
        speed=habits.target,
        driver=lambda: NotchAndBrakeDriver(train=train, track=line, settings=habits, seed=LINE_SEED),
        until_still=False,
    )
    return standard | {scenario.name: scenario for scenario in (*both, driven)}
