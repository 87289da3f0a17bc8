"""The steps of a sweep: its trials and a record of them, then the winner through the same steps as any fit."""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from sysid.errors import ConfigError
from sysid.reporting.numbers import quantity
from sysid.reporting.results import Results
from sysid.reporting.sweep_record import FIGURES, TRACES, SweepRecord, Trial, write_sweep
from sysid.units import squared
from sysid.workbench.fits.choice import Choice, against
from sysid.workbench.fits.config import FitConfig, Pipeline
from sysid.workbench.fits.data import Data
from sysid.workbench.fits.estimates import how_long
from sysid.workbench.fits.fit_steps import FitSteps, GivenFit
from sysid.workbench.fits.outputs import models_of
from sysid.workbench.runner import events
from sysid.workbench.runner.run import Run
from sysid.workbench.runner.steps import Done, Estimate, Outlined, Step
from sysid.workbench.sweep.checks import Checks
from sysid.workbench.sweep.config import WINNER, SweepConfig
from sysid.workbench.sweep.driver import Driver
from sysid.workbench.sweep.sampler import publish, strategy
from sysid.workbench.sweep.search_space import Space, parse_space, trained_rows
from sysid.workbench.sweep.store import TRIALS, Clock, TrialStore
from sysid.workbench.sweep.trial import Bench
from sysid.workbench.sweep.workers import AbstractWorkers, NoWorkers
from sysid.workbench.written import Written

Hire = Callable[[Bench, SweepConfig], AbstractWorkers]
"""Finds workers for a sweep."""
Sweep = Written[SweepConfig]
"""A sweep and where it was read from."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Swept:
    """What came of a sweep.

    Args:
        record: Every trial.
        results: The contents of ``results.json``: the winner and those beside it.
    """

    record: SweepRecord
    results: Results


@dataclass(frozen=True, kw_only=True, eq=False)
class _Found:
    """What the trials came to."""

    record: SweepRecord
    winner: Trial
    beside: list[Trial]
    given: dict[int, list[GivenFit]]
    options: dict[int, Mapping[str, Any]]
    rank: float
    done_now: int

    def fit_of(self, name: str, trial: Trial) -> FitConfig:
        """A trial as a fit of a pipeline."""
        training = dict(self.options[trial.number]) or None
        return FitConfig.model_validate({"name": name, "structure": trial.structure, "training": training})

    @property
    def shown(self) -> list[Trial]:
        """Trials that become fits of the report, the winner first."""
        return [self.winner, *self.beside]


@dataclass(frozen=True, kw_only=True, eq=False)
class SweepSteps:
    """The steps of a sweep: its trials, which keep themselves, and those of a pipeline of fits for what was found."""

    sweep: Sweep
    find_workers: Hire

    @property
    def config(self) -> SweepConfig:
        """The checked fields."""
        return self.sweep.config

    def outline(self) -> list[Outlined]:
        """All steps, as far as they are known before a trial is."""
        return FitSteps(pipeline=self._first()).outline_around(Outlined(name=TRIALS, title=self._title()))

    def run(self, run: Run) -> Swept:
        """Every step, in order."""
        loaded = run.do(FitSteps(pipeline=self._first()).loading())
        found = run.do(self._trials(run, loaded)).value
        fits = [found.fit_of(WINNER, found.winner)] + [found.fit_of(trial.label, trial) for trial in found.beside]
        pipeline = self._pipeline(fits)
        given = {
            model.fit.name: made
            for fit, trial in zip(fits, found.shown, strict=True)
            for model, made in zip(models_of(fit, pipeline.config), found.given[trial.number], strict=True)
        }
        cases_chose = self.config.choose.on == "cases"
        choice = Choice(name=WINNER, chosen_by=found.record.chosen_by, cases_chose=cases_chose)
        results = FitSteps(pipeline=pipeline, given=given, chosen=choice).run(run, loaded)
        ready = events.SweepReady(
            record=found.record, folder=run.store.path, command=run.command, data=self.config.data,
            seed=self.config.seed,
        )  # fmt: skip
        run.then(lambda: run.tell(ready))
        return Swept(record=found.record, results=results)

    def _title(self) -> str:
        points = len(self.config.space().points())
        return f"Sweeping {self.config.method.trials or points} of {points} points by {self.config.method.name}"

    def _trials(self, run: Run, loaded: Done[Data]) -> Step[_Found]:
        """Try what there is to try, and choose; trials keep themselves, each as soon as it is done."""
        by = self.config.choose.by
        return Step(
            name=TRIALS,
            title=self._title(),
            make=lambda _: self._found(run, self._checked(loaded.value)),
            peek=lambda: self._stored(run, loaded.value),
            outcome=lambda found: f"{found.winner.label}, {by} {found.rank:.3g}",
            was_found=lambda found: found.done_now == 0,
            how_long=lambda: self._how_long(run, loaded.value),
        )

    def _how_long(self, run: Run, data: Data) -> Estimate:
        """From the trials that are there, or from one in the middle of the ranges."""
        points = self.config.space().points()
        wanted, store = self.config.method.trials or len(points), TrialStore(path=run.store.path / TRIALS)
        there = 0 if run.fresh else store.count()
        # With pruning a point is several trials, and warm starts are trials too: what is left is at most this.
        left = max(wanted - there, 0)
        if there and store.seconds > 0.0:
            return Estimate(
                seconds=store.seconds * left / there, basis=f"{there} trials are there, and took as long each"
            )
        middle = points[len(points) // 2]
        fit = FitConfig.model_validate(
            {"name": WINNER, "structure": middle.structure.to_dict(), "training": dict(middle.training) or None}
        )
        models = models_of(fit, self.config.pipeline([fit]))
        one = how_long(models[0].fit, models[0].config, data)
        if one.seconds is None:
            return one
        basis = f"{left} trials, each as long as {middle.structure.label}, {self.config.workers} at a time"
        return Estimate(seconds=left * len(models) * one.seconds / self.config.workers, basis=basis)

    def _bench(self, run: Run, data: Data) -> Bench:
        return Bench(
            # Workers of a cluster may have another disk.
            folder=run.store.path if self.config.cluster is None else None,
            pipeline=self._first().config.model_dump(mode="json"),
            traces=data.traces,
            selection=data.selection,
            sequences=data.sequences,
        )

    def _stored(self, run: Run, data: Data) -> _Found:
        """What came of the trials, if all of them are there."""
        trials = TrialStore(path=run.store.path / TRIALS)
        return self._tried(run, self._bench(run, data), trials, NoWorkers(), trials.stopped_clock())

    def _found(self, run: Run, data: Data) -> _Found:
        bench, trials = self._bench(run, data), TrialStore(path=run.store.path / TRIALS)
        if run.fresh:
            shutil.rmtree(trials.path, ignore_errors=True)
        workers = self.find_workers(bench, self.config)
        try:
            with trials.clock() as clock:
                found = self._tried(run, bench, trials, workers, clock)
        finally:
            workers.close()
        write_sweep(run.store.path, found.record)
        if self.config.storage is not None:
            self._publish(run, found.record, self.config.storage)
        return found

    def _tried(self, run: Run, bench: Bench, trials: TrialStore, workers: AbstractWorkers, clock: Clock) -> _Found:
        """Try what there is to try, and choose."""
        space, tried = self.config.space(), list[Trial]()
        driver = Driver(
            config=self.config,
            bench=bench,
            store=trials,
            workers=workers,
            clock=clock,
            step=self._title(),
            tell=run.tell,
        )
        plan = strategy(self.config, space)
        while points := plan.ask():
            batch = driver.run(points)
            plan.tell(batch)
            tried += batch
        beside = self._beside(driver, tried, len(space.points()))
        return self._choose(driver, bench, tried=tried, beside=beside, wall_s=clock.total)

    def _first(self) -> Pipeline:
        """The pipeline of the first point: what all points share."""
        return self._pipeline([FitConfig(name=WINNER, structure=self.config.space().points()[0].structure)])

    def _pipeline(self, fits: list[FitConfig]) -> Pipeline:
        return Pipeline(config=self.config.pipeline(fits), text=self.sweep.text, path=self.sweep.path)

    def _checked(self, data: Data) -> Data:
        """The data, if there is something to choose by."""
        if self.config.choose.on == "selection" and not data.selection:
            raise ConfigError(
                "there are no selection traces to choose by",
                where="choose.on",
                expected="a data set with cases whose role is selection",
                got=f"selection: {self.config.selection}",
                remedy="name one with selection: ..., or choose on estimation, which favours the largest model",
            )
        return data

    def _beside(self, driver: Driver, tried: Sequence[Trial], n_points: int) -> list[Trial]:
        """Structures chosen by hand: the sweep's own trials of them where it tried them in full."""
        found: list[Trial] = []
        fixed = {name: v for name, v in self.config.training.items() if not isinstance(v, dict) and v != "range"}
        for written in self.config.beside:
            options = fixed if written.get("kind") in trained_rows([*self.config.structure, written]) else {}
            for point in parse_space([written], options, len(self.config.mapping.inputs)).points():
                structure = point.structure.to_dict()
                same = next((t for t in tried if t.structure == structure and t.dropped_at is None), None)
                if same is None:
                    own = replace(point, number=n_points + 1 + len(found))
                    same = driver.run([own], keep_all=True)[0]
                found.append(same)
        return found

    def _choose(
        self,
        driver: Driver,
        bench: Bench,
        *,
        tried: Sequence[Trial],
        beside: Sequence[Trial],
        wall_s: float,
    ) -> _Found:
        usable = [trial for trial in tried if trial.in_full]
        if not usable:
            raise ConfigError(
                "no trial of the sweep can be used",
                where=self.sweep.path,
                expected="a fit that is stable and improves on where it started",
                got=", ".join(sorted({trial.status for trial in tried})),
                remedy="allow more iterations, or sweep other structures; the trials' files say how each one failed",
            )
        ranked = sorted(usable, key=lambda trial: (driver.rank(trial), trial.parameters, trial.number))
        checks = Checks(driver=driver, bench=bench)
        winner, refused = checks.first_stable(ranked)
        outputs = self.config.mapping.outputs
        # Errors of several outputs count over their variances: in standard deviations, squared.
        unit = bench.traces.traces[0].channel(outputs[0]).unit if len(outputs) == 1 else "σ"
        n_points = len(self.config.space().points())
        record = self._record(tried, beside, winner, unit=unit, n_points=n_points, wall_s=wall_s, refused=refused)
        others = [trial for trial in beside if trial.number != winner.number]
        shown = [winner, *others]
        return _Found(
            record=record,
            winner=winner,
            beside=others,
            given={trial.number: checks.given(trial) for trial in shown},
            options={trial.number: driver.last[trial.number].training for trial in shown},
            rank=driver.rank(winner)[-1],
            done_now=driver.done_now,
        )

    def _record(
        self,
        tried: Sequence[Trial],
        beside: Sequence[Trial],
        winner: Trial,
        *,
        unit: str,
        n_points: int,
        wall_s: float,
        refused: int,
    ) -> SweepRecord:
        config, choose = self.config, self.config.choose
        sentence = f"Least {FIGURES[choose.by].words} on {TRACES[choose.on]} among {len(tried)} trials"
        sentence += f"{_before(tried, winner, choose.by, choose.on, unit)}."
        if choose.tolerance is not None:
            sentence = (
                f"Over {winner.within(choose.tolerance):.0%} of the selection traces within {choose.tolerance:.3g} of "
                f"the range, the most of {len(tried)} trials, then the least {FIGURES[choose.by].words}."
            )
        if refused:
            sentence += f" {refused} that ranked higher were passed over: their free run is not stable."
        if config.reproduces:
            sentence += f" This sweep repeats {config.reproduces}, which chose on the very cases that it reports."
        return SweepRecord(
            name=config.name,
            mapping=str(config.mapping),
            unit=unit,
            method=config.method.name,
            loop=str(config.training.get("loop", "")),
            points=n_points,
            ranges=_ranges(self.config.space()),
            objectives=list(config.objectives),
            choose_by=choose.by,
            choose_on=choose.on,
            chosen_by=sentence,
            reproduces=config.reproduces,
            published=config.report.published,
            warm_start=config.warm_start,
            rungs=[rung.model_dump() for rung in config.pruning],
            workers=config.workers,
            wall_s=wall_s,
            winner=winner.number,
            beside=list(beside),
            trials=list(tried),
        )

    def _publish(self, run: Run, record: SweepRecord, url: str) -> None:
        """Write the trials where Optuna's tools find them; that this fails costs nobody the sweep."""
        try:
            publish(record, url)
        except Exception as error:  # noqa: BLE001 - a database can fail in any way, and the sweep is on disk
            run.tell(events.Warned(text=f"not written to the Optuna store ({type(error).__name__}: {error})"))


def _before(tried: Sequence[Trial], winner: Trial, by: str, on: str, unit: str) -> str:
    """The figure that chose, and the trials that the winner was chosen before."""
    usable = [trial for trial in tried if trial.in_full]
    labels = Counter(trial.label for trial in usable)
    names = {t.number: t.label if labels[t.label] == 1 else f"{t.label} (trial {t.number})" for t in usable}
    told = (by, on) == ("free_run_mse", "selection")
    of = FIGURES[by].unit.format(unit=unit, squared=squared(unit)) or "1"
    return against(
        names[winner.number],
        {names[trial.number]: FIGURES[by].of(trial, on) for trial in usable},
        partial(quantity, unit=of),
        {names[trial.number]: trial.selection_errors if told else () for trial in usable},
    )


def _ranges(space: Space) -> dict[str, list[Any]]:
    """Every value that a field can take, over all structures that have it."""
    found: dict[str, list[Any]] = {}
    for alternative in space.alternatives:
        for dimension in alternative.dimensions:
            known = found.setdefault(dimension.name, [])
            known += [value for value in dimension.values if value not in known]
    return found
