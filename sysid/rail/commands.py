"""``sysid rail``: terrain, automatic operation by a track card, the end of a train, and stops that teach.

Named in the entry-point group ``sysid.commands``, so that no other room knows of it.
"""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sysid.errors import ConfigError
from sysid.rail.written import write_table_and_picture

if TYPE_CHECKING:
    from sysid.rail.dynamics.track import TrackProfile
    from sysid.rail.dynamics.train import Train
    from sysid.rail.track.features import Feature
    from sysid.rail.track.terrain import Shape

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="rich",
    help="Trains: terrain and handling, automatic operation, end of train, stops.",
)

Out = Annotated[Path | None, typer.Option(help="Folder for the table (.csv) and the picture (.svg).")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Read everything, say what would be done, and do nothing.")]


MISSED = 10.0
"""Metres from a stop beyond which a train has not stopped there (ours)."""

FARTHEST = 100_000.0
"""Metres ahead that anything here is asked for."""


class Combination(Enum):
    """How the correlations with several patterns make one."""

    CREST = "crest"
    MAX = "max"
    MIN = "min"
    MEDIAN = "median"
    MEAN = "mean"


class Operation(Enum):
    """Who drives."""

    CARD = "card"
    FULL_NOTCH = "full-notch"


@app.command(
    epilog="Example: sysid rail terrain datasets/rail-example/crest.yaml datasets/rail-example/heavy-haul-101.yaml"
)
def terrain(
    track: Annotated[Path, typer.Argument(help="Line: a YAML file, or a track card (.csv) with --section.")],
    train: Annotated[Path, typer.Argument(help="Train: a YAML file.")],
    *,
    step: Annotated[float, typer.Option(help="Metres between two places.")] = 25.0,
    look_ahead: Annotated[float, typer.Option(help="How far ahead of the train in m.")] = 0.0,
    pattern: Annotated[
        Combination, typer.Option(help="The crest's pattern, or a combination of three.")
    ] = Combination.CREST,
    section: Annotated[str | None, typer.Option(help="Section of a track card.")] = None,
    out: Out = None,
    dry_run: DryRun = False,
) -> None:
    """Crests and sags along a line as a train feels them, how severe they are, and how they want to be handled."""
    import numpy as np

    from sysid.rail.dynamics.train import read_train
    from sysid.rail.track.features import features
    from sysid.rail.track.terrain import CREST, PATTERNS, Shape, combined, correlation, effective_grade

    line, consist = _line(track, section), read_train(train)
    if not 0.0 < step <= 1000.0:
        raise ConfigError("step is out of range", where="--step", expected="metres, up to 1000", got=step)
    if not -FARTHEST <= look_ahead <= FARTHEST:
        raise ConfigError(
            "it looks too far ahead", where="--look-ahead", expected="metres, up to 100 km either way", got=look_ahead
        )
    shape = Shape.of(consist)
    x = np.arange(line.starts[0] - shape.length, line.starts[-1] + 2.0 * shape.length + step, step)
    if len(x) > 1_000_000:
        raise ConfigError(
            "the line has too many places", where="--step", expected="a million at most", got=f"{len(x)}",
            remedy="take a longer step",
        )  # fmt: skip
    typer.echo(f"{line.name}: {len(x)} places from {x[0]:.0f} to {x[-1]:.0f} m; {consist.name}, {shape.length:.0f} m")
    if _only_said(dry_run, out, "terrain"):
        return
    patterns = (CREST,) if pattern is Combination.CREST else PATTERNS
    each = [correlation(line, shape, x, pattern=one, look_ahead=look_ahead) for one in patterns]
    felt = each[0] if len(each) == 1 else combined(each, pattern.value)
    found = features(x, felt)
    for one in found:
        _tell_feature(one, line, consist, shape)
    if not found:
        typer.echo("neither crest nor sag")
    if out is not None:
        grades = effective_grade(line, shape, x)
        columns = {
            "position_m": x, "elevation_m": line.elevation(x), "grade": line.grade(x),
            "effective_grade": grades, "correlation": felt,
        }  # fmt: skip
        spans = [(one.start / 1000.0, one.end / 1000.0, f"{one.kind}, {one.severity.value}") for one in found]
        write_table_and_picture(out, "terrain", columns, x=x / 1000.0, label="position of the leading end [km]", rows=[
            ("elevation [m]", columns["elevation_m"]), ("correlation [per mille]", 1000.0 * felt),
            ("effective grade [per mille]", 1000.0 * grades),
        ], spans=spans)  # fmt: skip


def _tell_feature(one: Feature, line: TrackProfile, consist: Train, shape: Shape) -> None:
    """Where a crest or a sag lies, how severe it is, how to handle it and what couplers feel; and in curves, L/V."""
    import numpy as np

    from sysid.rail.track.handling import SPEED_GAINS, lateral_ratio, passage, peak_force, quadrant, sag_acceleration

    over = passage(one, consist)
    force = peak_force(line, consist, over)
    if one.kind == "crest":
        handling = f"no power until half the train is past; gain at most {3.6 * SPEED_GAINS[one.severity]:.0f} km/h"
    else:
        handling = f"hold {sag_acceleration(line, shape, one.apex):+.3f} m/s2"
    pulls = f"{'draft' if force.force >= 0.0 else 'buff'} {abs(force.force) / 1000.0:.0f} kN at {force.at:.0f} m"
    typer.echo(
        f"{one.kind:<6} {one.severity.value:<7} {one.start:8.0f} to {one.end:8.0f} m, strongest at {one.apex:8.0f} "
        f"m ({1000.0 * one.correlation:+.1f} per mille): {handling}"
        + (f"; coupler {force.coupler} {pulls}" if force.coupler else "")
    )
    if line.curvatures.any():
        ratios = np.stack([lateral_ratio(line, consist, float(place)) for place in over])
        place, worst = np.unravel_index(np.argmax(np.abs(ratios)), ratios.shape)
        typer.echo(
            f"       {quadrant(one, line, shape).value}; at a crawl L/V {ratios[place, worst]:+.3f} at vehicle "
            f"{worst + 1} at {over[place]:.0f} m"
        )


@app.command(epilog="Example: sysid rail drive card.csv train.yaml --section A --stop 1000 --point 700")
def drive(
    card: Annotated[Path, typer.Argument(help="Track card: CSV with section, distance_km, code, value.")],
    train: Annotated[Path, typer.Argument(help="Train with notches: a YAML file.")],
    *,
    section: Annotated[str, typer.Option(help="Section that the train departs into.")],
    stop: Annotated[float, typer.Option(help="Where it shall stop, in m from the section's station.")],
    point: Annotated[
        float | None, typer.Option(help="Where the automatic stop begins, in m; 300 m before the stop.")
    ] = None,
    operation: Annotated[Operation, typer.Option(help="By the card, or full notch and brake.")] = Operation.CARD,
    longest: Annotated[float, typer.Option(help="Seconds after which the run is broken off.")] = 600.0,
    out: Out = None,
    dry_run: DryRun = False,
) -> None:
    """Drive a train from a station to a stop by a track card: constant speed, limits, automatic stop."""
    from sysid.rail.dynamics.brake import no_brake
    from sysid.rail.dynamics.drive import STILL, Limits
    from sysid.rail.dynamics.drive import drive as driven
    from sysid.rail.dynamics.motion import MovingTrain
    from sysid.rail.dynamics.train import read_train
    from sysid.rail.track.card import read_card
    from sysid.rail.transit.ato import CardDriver, FullNotchDriver

    rows, consist = read_card(card), read_train(train)
    line, begins = rows.profile(section), max(0.0, stop - 300.0) if point is None else point
    if not 0.0 < stop <= FARTHEST or not 0.0 <= begins < stop or not 0.0 < longest <= 7200.0:
        raise ConfigError(
            "the run cannot be made", where="--stop, --point, --longest",
            expected="a stop up to 100 km ahead, a point before it, and up to 7200 s",
            got=f"stop {stop:g} m, point {begins:g} m, {longest:g} s",
        )  # fmt: skip
    typer.echo(
        f"section {section}: {consist.name}, stop at {stop:g} m, automatic from {begins:g} m, by {operation.value}"
    )
    if operation is Operation.CARD:
        driver: Any = CardDriver(train=consist, card=rows, section=section, stop=stop, point=begins)
    else:
        driver = FullNotchDriver(train=consist, limits=line, stop=stop, point=begins)
    if _only_said(dry_run, out, "drive"):
        return
    moving = MovingTrain(train=consist, track=line)
    run = driven(moving, no_brake(len(consist.vehicles)), driver, Limits(duration=longest, block=1, back=MISSED))
    import numpy as np

    limits = np.array([line.lowest_limit(at - consist.length, at) for at in run.position])
    over = float((run.speed - limits).max())
    stands = "stands" if abs(run.speed[-1]) <= STILL else "is"
    typer.echo(
        f"{stands} at {run.position[-1]:.2f} m after {run.motion.time[-1]:.1f} s; "
        f"{run.notch_changes} {'change' if run.notch_changes == 1 else 'changes'} of notch, "
        f"{run.traction_work / 3.6e6:.2f} kWh of traction, "
        + (f"{3.6 * over:.1f} km/h over a limit" if over > 0.0 else "no limit passed")
    )
    if run.position[-1] < -MISSED:
        typer.echo("note: it rolls back, and the run ends there: its traction does not hold it on this grade")
    elif stands == "is":
        typer.echo(f"note: it has not stopped within {longest:g} s")
    elif abs(missed := float(run.position[-1]) - stop) > MISSED:
        typer.echo(
            f"note: it stands {abs(missed):.0f} m {'past' if missed > 0.0 else 'before'} the stop"
            + (": begin the automatic stop earlier (--point)" if missed > 0.0 else "")
            + ": its traction does not start it" * bool(run.speed.max() <= STILL)
        )
    if out is not None:
        columns = {
            "time_s": run.motion.time, "position_m": run.position, "speed_m_s": run.speed, "limit_m_s": limits,
            "notch": run.notch.astype(float),
        }  # fmt: skip
        write_table_and_picture(out, "drive", columns, x=run.position / 1000.0, label="distance [km]", rows=[
            ("speed [km/h]", 3.6 * run.speed), ("limit [km/h]", np.where(np.isfinite(limits), 3.6 * limits, np.nan)),
            ("notch", columns["notch"]), ("elevation [m]", line.elevation(run.position)),
        ])  # fmt: skip


@app.command(epilog="Example: sysid rail eot --pairs 75 --handle 0 --leak 1")
def eot(
    *,
    pairs: Annotated[int, typer.Option(help="Wagon pairs of the train.")] = 50,
    handle: Annotated[float, typer.Option(help="Where the handle goes in psi; 0 is the emergency.")] = 84.2,
    seconds: Annotated[float, typer.Option(help="How long the train is looked at.")] = 150.0,
    leak: Annotated[float, typer.Option(help="Self-test: what the closed device loses in psi a minute.")] = 0.0,
    valve_leak: Annotated[float, typer.Option(help="Self-test: what its supply valve loses beside that.")] = 0.0,
    out: Out = None,
    dry_run: DryRun = False,
) -> None:
    """The end-of-train device on its bench: the self-test, then an application from both ends of a train."""
    import numpy as np

    from sysid.airbrake.consist import Consist
    from sysid.rail.end_of_train.bench import LeakingBench, check_application, from_both_ends
    from sysid.rail.end_of_train.tail_unit import self_test

    consist, bench = Consist(pairs=pairs), LeakingBench(leak=leak, valve_leak=valve_leak)
    check_application(consist, handle, seconds=seconds)
    outcome = self_test(bench)
    typer.echo(f"self-test, leaks of {leak:g} and {valve_leak:g} psi a minute: {outcome.value}")
    for at, done, psi in bench.readings:
        typer.echo(f"{at:6.1f} s  {psi:6.2f} psi  {done}")
    typer.echo(f"{consist.vehicles} vehicles, handle to {handle:g} psi after 5 s, {seconds:g} s")
    if _only_said(dry_run, out, "eot"):
        return
    found = from_both_ends(consist, handle, seconds=seconds)
    for message, answer in found.log[:1]:
        typer.echo(f"{message.order.name.lower()} ordered at {message.time:.1f} s: {answer.value}")
    opened = f"open from {found.opened:.1f} s, for {found.open_for:.1f} s in all" if found.open_for else "never open"
    typer.echo(f"valve {opened}; {len(found.log)} orders")
    places = {"first": consist.valve_nodes[0], "middle": consist.valve_nodes[pairs // 2], "last": consist.vehicles}
    for name, values, took in (("both ends", found.both, found.braked[0]), ("one end", found.one, found.braked[1])):
        held = ", ".join(f"{place} {values[-1, node - 1]:.1f}" for place, node in places.items())
        braked = f"at nine tenths after {took:5.1f} s" if np.isfinite(took) else "have no pressure"
        typer.echo(f"{name:<9} cylinders {braked}; at the end {held} psi")
    if any(found.rising):
        opened = ", the valve is open" if found.still_open else ""
        typer.echo(
            f"note: at {seconds:g} s cylinders still rise{opened}; nine tenths are of what they have by then: look "
            "longer (--seconds)"
        )
    if out is not None:
        columns = {"time_s": found.time} | {
            f"{place}_{ends}_psi": values[:, node - 1]
            for ends, values in (("both", found.both), ("one", found.one))
            for place, node in places.items()
        }
        write_table_and_picture(out, "eot", columns, x=found.time, label="time [s]")


@app.command(epilog="Example: sysid rail stops --friction 0.7 --grade -0.01")
def stops(
    *,
    friction: Annotated[float, typer.Option(help="Of the vehicle's shoes, 1 being nominal.")] = 1.0,
    grade: Annotated[float, typer.Option(help="Rise over run.")] = 0.0,
    count: Annotated[int, typer.Option(help="How many stops.")] = 5,
    trace: Annotated[
        Path | None,
        typer.Option(help=r"Slow application of the real plant, with P \[mA] and A \[m/s^2]; else nominal."),
    ] = None,
    record: Annotated[
        Path | None, typer.Option(help="Write such a trace of the vehicle with this friction (CSV).")
    ] = None,
    out: Out = None,
    dry_run: DryRun = False,
) -> None:
    """Stops by the deceleration controller, which learns from each: error, jerk and modifier, stop after stop."""
    import numpy as np

    from sysid.ingest import read_trace, write_csv
    from sysid.rail.constants import MPH
    from sysid.rail.traces.stop_cycles import characteristic_of, check_stops, learning_stops, servo, slow_application
    from sysid.rail.transit.deceleration import identify_characteristic
    from sysid.rail.transit.transit import TransitVehicle

    check_stops(friction=friction, grade=grade, count=count)
    known = characteristic_of(servo()) if trace is None else identify_characteristic(read_trace(trace))
    knots = ", ".join(f"{a / MPH:.2f} at {p:.1f}" for p, a in zip(known.signals, known.decelerations, strict=True))
    typer.echo(f"characteristic from {trace or 'the nominal vehicle'}: {knots} (mph/s at mA)")
    if _only_said(dry_run, out, "stops", record):
        return
    if record is not None:
        write_csv(slow_application(TransitVehicle(model=servo(), friction=friction, speed=2000.0)), record)
        typer.echo(f"written: {record}")
    found = learning_stops(known, friction=friction, grade=grade, count=count)
    typer.echo(f"40 to 20 mph, friction {friction:g}, grade {100.0 * grade:g} %")
    for number, one in enumerate(found, start=1):
        typer.echo(
            f"stop {number:>2}: mean error {100.0 * one.error:+6.2f} % of the rate, largest jerk {one.jerk:.2f} of the "
            f"limit, modifier {one.modifier:+.3f}"
        )
    if out is not None:
        each = [one.trace for one in found]
        columns = {"time_s": each[0].sample_time * np.arange(sum(map(len, each)), dtype=np.float64)} | {
            name: np.concatenate([part[channel] for part in each])
            for name, channel in (("wanted_m_s", "V_REF"), ("speed_m_s", "V"), ("deceleration_m_s2", "A"),
                                  ("signal_mA", "P"), ("modifier", "M"))
        }  # fmt: skip
        write_table_and_picture(out, "stops", columns, x=columns["time_s"], label="time of all stops [s]")


def _line(path: Path, section: str | None) -> Any:
    """A track from YAML, or a section of a card."""
    from sysid.rail.dynamics.track import read_track
    from sysid.rail.track.card import read_card

    if path.suffix.lower() != ".csv":
        if section is not None:
            raise ConfigError(
                "a line of YAML has no sections", where="--section", expected="a track card (.csv)", got=path,
                remedy="leave --section out",
            )  # fmt: skip
        return read_track(path)
    card = read_card(path)
    if section is None and len(card.sections) > 1:
        raise ConfigError(
            "the card has several sections", where=path, expected=f"one of {', '.join(card.sections)}", got="none",
            remedy=f"say which: --section {card.sections[0]}",
        )  # fmt: skip
    return card.profile(section or card.sections[0])


def _only_said(dry_run: bool, out: Path | None, name: str, record: Path | None = None) -> bool:
    """Whether nothing shall be done; then it is said what would be written."""
    if dry_run:
        files = [str(record)] * (record is not None) + [f"{out}/{name}.csv and .svg"] * (out is not None)
        typer.echo("nothing is done: --dry-run" + (f"; it would write {', '.join(files)}" if files else ""))
    return dry_run
