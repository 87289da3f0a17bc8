"""Run time of cascades against the compiled reference: one car and fifty, 3 and 101 vehicles, warm and cold.

    python -m tests.benchmarks assembly
    python -m tests.benchmarks assembly --whole=runs/combined-brake --line=runs/whole-train

* The fitted whole of one car, of a bundle or a run folder (``--whole=``; without it the published
  ``reports/combined-brake-grown/bundle``): 2,000 s of a designed command, and each case of ``abdx-service`` and of
  ``abdx-combined`` (``--cases=`` takes one of them), beside the reference of 3 and of 101 vehicles on the same command,
  every cylinder recorded. What is aimed at is for 2,000 s: a short case bears the fixed share of a call. The surrogate
  stands for the first valve of 101 vehicles; its run time is the same for any train. Beside it what it exports as C,
  called from Python once for the whole record.
* Every brake cylinder of 101 vehicles, on two threads: fifty copies of the fitted whole, which is what a whole for each
  car would take; cascades of the dissertation's size, with random weights of the size of fitted ones (their run time
  does not depend on the values), as one model that reads its place and as a model for each car; and, with ``--line=``,
  the fitted line of a run folder at every place.
* Cold: a process of its own, with kernels that were compiled before, and as on a machine that has never run any.

Medians of repeats after one run that warms up (``--repeats=`` takes fewer). Times on one core are processor times, as
other work on the machine hardly changes them; what a clock shows stands beside them. Times on two threads and cold ones
are what a clock shows, and hold on a machine that is otherwise idle.

The published figures are a footnote: MATLAB 2019b on a quad-core laptop of 2015, the reference being 3 vehicles
interpreted in Simulink, on traces that are not public.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from sysid.airbrake.command import Command
from sysid.export import Surrogate, exporter
from sysid.ingest import load_dataset
from sysid.models import Cascade, simulate_family
from sysid.reporting import read_published
from sysid.reporting.numbers import number
from sysid.traces import Trace
from sysid.workbench.assembly.runner import read_interpolation
from tests.benchmarks._cascades import COMBINED, DESIGNED, SERVICE, Fitted, cascade, fitted
from tests.benchmarks._findings import FILE_VARIABLE, found, read
from tests.benchmarks._timing import Taken, handle, reference, say, say_faster, taken

DURATION, CARS, WORKERS = DESIGNED.duration, 50, 2
PUBLISHED_WHOLE = "reports/combined-brake-grown/bundle"
TRAINS = {3: 1, 101: 50}
"""Wagon pairs, by vehicles."""
ONE_CAR, FASTER, ALL_CARS, ALL_FASTER = 25.0, {3: 4.0, 101: 100.0}, 0.5, 8.0
"""What is aimed at: ms, times by vehicles, s, times."""


@dataclass(frozen=True)
class Theirs:
    """Where the published run times of a data set's cases stand."""

    figures: str
    table: str
    variant: str
    per_second: str = ""
    reference: tuple[str, ...] = ()
    """Cases on which their reference ran the same command."""

    def beside(self, case: str) -> str:
        """What is published of a case, in words."""
        words = [f"{self._span(self.table, case, self.variant)} s ({self.table})"]
        if self.per_second:
            words.append(f"{self._span(self.per_second, case, self.variant)} ms per simulated s ({self.per_second})")
        if case in self.reference:
            words.append(f"the reference {self._span(self.table, case, 'original model')} s")
        return "; ".join(words)

    def _span(self, *where: str) -> str:
        """An interval as it is printed: seconds, or thousandths by simulated second."""
        ends = [
            f"{one.value * (1e3 if one.unit == 's/s' else 1.0):.2f}"
            for one in read_published(self.figures).figures
            if (one.source, one.case, one.variant) == where and one.quantity.endswith(("_low", "_high"))
        ]
        return " to ".join(ends)


# EST01 and VAL01 of Table 7.7 are longer than those that its reference ran.
SETS = {
    "abdx-service": Theirs(
        "lopes-2021", "Table 6.4", "proposed model", "Table 6.5", ("EST01", "VAL01", "VAL02", "VAL03", "VAL04")
    ),
    "abdx-combined": Theirs(
        "lopes-2021-combined", "Table 7.7", "combined model", reference=("VAL02", "VAL03", "VAL04")
    ),
}


@dataclass(frozen=True)
class Case:
    """A command with the reference's times on it, by vehicles."""

    name: str
    command: Command
    references: dict[int, Taken]
    published: str = ""


def option(name: str) -> list[str]:
    """What was said to an option, each time that it was."""
    return [word.removeprefix(f"--{name}=") for word in sys.argv[1:] if word.startswith(f"--{name}=")]


def timed(work: Callable[[], object], repeats: int, duration: float = DURATION, cores: int = 1) -> Taken:
    """Medians over so many repeats, or fewer where ``--repeats=`` says so."""
    return taken(work, min([repeats, *map(int, option("repeats"))]), duration, cores)


def timed_case(name: str, command: Command, published: str = "") -> Case:
    """A command, run by the reference."""
    references = {
        vehicles: timed(reference(command, pairs), 5 if pairs == 1 else 3, command.duration)
        for vehicles, pairs in TRAINS.items()
    }
    return Case(name, command, references, published)


def held(trace: Trace) -> Command:
    """The command of a trace, by where its handle moves."""
    values = trace["STP"]
    moves = np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1])
    duration = len(values) * trace.sample_time
    return Command(times=tuple(moves * trace.sample_time), pressures=tuple(values[moves]), duration=duration)


def cases_of(name: str) -> list[Case]:
    """The cases of a data set."""
    traces = load_dataset(name)
    read(name, traces.digest)
    return [timed_case(one.name, held(one), SETS[name].beside(one.name)) for one in traces.traces]


def exported(one: Fitted, u: np.ndarray, folder: Path) -> Callable[[], object]:
    """What a train simulator embeds: the exported source, built by the compiler that is here."""
    writer, surrogate = exporter("c"), Surrogate.of(one.whole, outputs=one.outputs)
    (file,) = writer.write(surrogate, folder)
    run, state = writer.load(file, folder), surrogate.at_rest(u[0])[np.newaxis]
    return lambda: run(u[:, np.newaxis], state)


def one_car(name: str, whole: Cascade, designed: Case) -> Taken:
    """The whole of one car over the designed command, beside its targets."""
    u = handle(designed.command)
    single = timed(lambda: whole.simulate(u), 15)
    say(f"{name}, one car, 2,000 s", single, target=ONE_CAR)
    for vehicles, target in FASTER.items():
        say_faster(f"{name}, against the reference of {vehicles}", designed.references[vehicles], single, target)
    return single


def over(one: Fitted, name: str, cases: list[Case]) -> None:
    """The whole of one car over the cases of a data set, and the case where it gains least."""
    taken_by = {}
    for case in cases:
        u = handle(case.command)
        taken_by[case.name] = timed(lambda u=u: one.whole.simulate(u), 15, case.command.duration)
        ratios = [
            f"the reference of {vehicles} vehicles {number(1e3 * slow.seconds)} ms, "
            f"{number(slow.seconds / taken_by[case.name].seconds)} times as long"
            for vehicles, slow in case.references.items()
        ]
        say(
            f"{one.name}, {name}: {case.name}, {case.command.duration:,.0f} s",
            taken_by[case.name],
            published=case.published,
            more="; ".join(ratios),
        )
    for vehicles in FASTER:
        least = min(cases, key=lambda case: case.references[vehicles].seconds / taken_by[case.name].seconds)
        what = f"{one.name}, {name}: against the reference of {vehicles}, least in {least.name}"
        say_faster(what, least.references[vehicles], taken_by[least.name])


def all_cars(name: str, work: Callable[[], object], large: Taken, repeats: int = 5, *, aimed: bool = True) -> None:
    """Every brake cylinder of a train of 101 vehicles, beside its targets where it is meant for a whole train."""
    batch = timed(work, repeats, cores=WORKERS)
    say(f"{name}, {CARS} cars, 2,000 s, {WORKERS} threads", batch, target=ALL_CARS if aimed else None)
    say_faster(f"{name}, {CARS} cars, against the reference of 101", large, batch, ALL_FASTER if aimed else None)


def fitted_whole(one: Fitted, designed: Case, sets: dict[str, list[Case]]) -> None:
    """A fitted whole: one car, over the cases, and fifty of them."""
    whole, u = one.whole, handle(designed.command)
    print(f"\n{one.name}, fitted: {len(whole.models)} members, {whole.n_parameters} parameters")
    single = one_car(one.name, whole, designed)
    with tempfile.TemporaryDirectory() as place:
        as_c = timed(exported(one, u, Path(place)), 15)
    say(f"{one.name}, one car, exported as C", as_c, more=f"{number(as_c.seconds / single.seconds)} x our own free run")
    for name, cases in sets.items():
        over(one, name, cases)
    shared = np.repeat(u[np.newaxis], CARS, axis=0)
    copies = [whole] * CARS
    large = designed.references[101]
    run = partial(simulate_family, copies, shared, workers=WORKERS)
    all_cars(f"{one.name}, a copy for each car", run, large, aimed=False)  # fitted for the first car alone


def fitted_line(folder: Path, large: Taken) -> None:
    """A fitted line at every place; its handle never asks for an emergency."""
    line, places = read_interpolation(folder).line, np.arange(1.0, CARS + 1.0)
    inputs = np.maximum(handle(DESIGNED), 64.2)
    print(f"\n{folder.name}, fitted: {line.n_parameters} parameters")
    all_cars(f"{folder.name}, every place", lambda: line.simulate(inputs, places, workers=WORKERS), large, 7)


def random_whole(name: str, members: tuple[tuple[str, int], ...], designed: Case) -> None:
    """A cascade with random weights: one car, one model for all places, a model for each."""
    sizes = ", ".join(f"{text} {neurons}" for text, neurons in members)
    one, u, large = cascade(members), handle(designed.command), designed.references[101]
    print(f"\n{name}, random weights: {sizes} neurons, {one.n_parameters} parameters")
    label = f"{name}, random weights"
    one_car(label, one, designed)
    placed = cascade(members, extra=("POSITION",))
    # Every car reads the same handle and its own place in the train.
    inputs = np.stack([np.column_stack([u, np.full(len(u), float(car))]) for car in range(CARS)])
    order = [("STP", "POSITION").index(channel) for channel in placed.inputs]
    records = np.ascontiguousarray(inputs[:, :, order])
    all_cars(f"{label}, one model", lambda: placed.simulate_batch(records, workers=WORKERS), large)
    family = [cascade(members, seed=10 * car) for car in range(CARS)]
    shared = np.repeat(u[np.newaxis], CARS, axis=0)
    all_cars(f"{label}, a model for each car", lambda: simulate_family(family, shared, workers=WORKERS), large)


COLD = """
import sys, time
from pathlib import Path
began = time.perf_counter()
from tests.benchmarks import _cascades, _timing
loaded = time.perf_counter()
if len(sys.argv) > 1:
    _cascades.fitted(Path(sys.argv[1])).whole.simulate(_timing.handle(_cascades.DESIGNED))
else:
    _timing.reference(_cascades.DESIGNED, 1)()
print(loaded - began, time.perf_counter() - loaded)
"""


def cold(what: str, arguments: list[str]) -> None:
    """First runs in processes of their own."""
    with tempfile.TemporaryDirectory() as empty:
        for when, cache in (("kernels compiled before", None), ("on a machine that has never run it", empty)):
            environment = {name: text for name, text in os.environ.items() if name != FILE_VARIABLE}
            environment |= {"NUMBA_CACHE_DIR": cache} if cache else {}
            words = [sys.executable, "-c", COLD, *arguments]
            done = subprocess.run(words, env=environment, capture_output=True, text=True, check=True)
            imported, ran = (float(word) for word in done.stdout.split()[-2:])
            note = f"{number(imported)} s to import, {number(ran)} s to read and run"
            found(f"cold, {what}, {when}: 2,000 s", imported + ran, "s", note=note)


def main() -> None:
    """Measure everything that was asked for."""
    places = [Path(text) for text in option("whole") or [PUBLISHED_WHOLE]]
    wholes = [fitted(place) for place in places]
    designed = timed_case("designed", DESIGNED)
    for vehicles, one in designed.references.items():
        say(f"compiled reference, {vehicles} vehicles, 2,000 s", one)
    sets = {name: cases_of(name) for name in option("cases") or SETS}
    for one in wholes:
        fitted_whole(one, designed, sets)
    for folder in option("line"):
        fitted_line(Path(folder), designed.references[101])
    for name, members in {"service": SERVICE, "combined": COMBINED}.items():
        random_whole(name, members, designed)
    print()
    cold(wholes[0].name, [str(places[0])])
    cold("compiled reference, 3 vehicles", [])


if __name__ == "__main__":
    main()
