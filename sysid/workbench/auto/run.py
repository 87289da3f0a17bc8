"""A search for a model as steps: its trials, which keep themselves, then what was chosen as a pipeline of fits."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sysid.estimation import FitResult
from sysid.models.store import structure_from_dict
from sysid.reporting.results import Results
from sysid.reporting.sweep_record import SweepRecord, write_sweep
from sysid.workbench.auto.config import AutoConfig
from sysid.workbench.auto.found import FOUND, Found
from sysid.workbench.auto.look import is_suggested, seen_of
from sysid.workbench.auto.parts import FURTHER, LAST
from sysid.workbench.auto.race import trains_on
from sysid.workbench.auto.refit import refitted
from sysid.workbench.auto.search import TITLE, Hire, Search, stand_in
from sysid.workbench.auto.table import table_of_front
from sysid.workbench.fits import steps
from sysid.workbench.fits.choice import Choice
from sysid.workbench.fits.config import FitConfig, Pipeline
from sysid.workbench.fits.data import Data
from sysid.workbench.fits.fit_steps import FitSteps, GivenFit
from sysid.workbench.fits.outputs import FitModel, models_of
from sysid.workbench.fits.table import table_of_fits, told_of_fits
from sysid.workbench.runner import events
from sysid.workbench.runner.program import Closing, Program, carry_out
from sysid.workbench.runner.run import Run
from sysid.workbench.runner.steps import NOT_KNOWN, Done, Estimate, Outlined, Step, Work
from sysid.workbench.runner.store import digest, strict
from sysid.workbench.sweep.store import TRIALS, TrialStore
from sysid.workbench.sweep.trial import Bench
from sysid.workbench.sweep.workers import AbstractWorkers, InThisProcess, LocalWorkers, NoWorkers
from sysid.workbench.written import Written
from sysid.yaml_files import yaml_text

if TYPE_CHECKING:
    from sysid.workbench.kinds import RunRequest


NO_TIME = "No time was left to fit {}, {}, once more to all that is fitted: it is as its trial had it."
"""What is said where the last fit was left out."""


def hire(bench: Bench, workers: int) -> AbstractWorkers:
    """Who trains.

    Args:
        bench: What they share.
        workers: How many.

    Returns:
        Processes of this machine; for one, this process itself.
    """
    return LocalWorkers(bench, workers) if workers > 1 else InThisProcess(bench)


@dataclass(frozen=True, kw_only=True, eq=False)
class Auto(Written[AutoConfig]):
    """A search and where it was read from.

    Args:
        load: Gives the traces where they are at hand; by default they are loaded as the YAML says.
        page: Whether a page is made of the results.
        before_page: Writes what the page shows beside the results of the search.
    """

    load: Callable[[], Data] | None = None
    page: bool = True
    before_page: Callable[[], object] | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Searched:
    """What came of a search.

    Args:
        record: Every trial.
        results: The contents of ``results.json``: what was chosen, and the best linear model beside it.
        told: What a reader has to know: what chose, and what is wrong with the record.
        hurried: Of that, that there was no search, as the time was up before structures were compared; empty elsewhere.
        needs_s: Seconds that a search takes at least, where there was no time for one; 0 elsewhere.
        spent: Whether it ended as its budget was spent, before it had tried all that it wanted.
    """

    record: SweepRecord
    results: Results
    told: tuple[str, ...]
    hurried: str
    needs_s: float = 0.0
    spent: bool = False


def auto_of(config: AutoConfig, *, load: Callable[[], Data] | None = None, page: bool = True) -> Auto:
    """A search that is in no file.

    Args:
        config: Its fields.
        load: Gives the traces.
        page: Whether a page is made of the results.

    Returns:
        The search, with the YAML that makes it again.
    """
    fields = {"kind": config.kind, **config.model_dump(mode="json", exclude_defaults=True)}
    return Auto(config=config, text=yaml_text(fields), path=Path.cwd() / f"{config.name}.yaml", load=load, page=page)


def program(request: RunRequest) -> Program[Searched]:
    """What ``sysid run`` does of a pipeline of kind ``auto``.

    Args:
        request: What was asked.

    Returns:
        The program.

    Raises:
        ConfigError: If the pipeline cannot be used.
    """
    return program_of(Auto.read(AutoConfig, request.path))


def program_of(auto: Auto, *, find_workers: Hire = hire, verb: str = "run") -> Program[Searched]:
    """A search as a program.

    Args:
        auto: What to do.
        find_workers: Finds who trains.
        verb: The command that runs it.

    Returns:
        The program.
    """
    work = _AutoSteps(auto=auto, find_workers=find_workers)
    return Program(
        name=auto.config.name,
        keep=auto.keep,
        steps=work.run,
        outline=work.outline,
        closing=closing,
        verb=verb,
    )


def run_auto(
    auto: Auto,
    folder: Path,
    *,
    command: str,
    fresh: bool = False,
    watchers: Sequence[events.Watcher] = (),
    find_workers: Hire = hire,
) -> Searched:
    """Search; what an earlier session has finished is not done again, however that session ended.

    Args:
        auto: What to do.
        folder: The run folder.
        command: The command that makes the run again, for the report.
        fresh: Do everything again.
        watchers: Told everything that happens, in order.
        find_workers: Finds who trains.

    Returns:
        Every trial, and what was chosen.

    Raises:
        BusyError: If another run is at work in the folder.
        UserError: If data or options cannot be used as they are, or nothing that was tried can.
        ParityError: If an exported file differs from its model.
    """
    done = program_of(auto, find_workers=find_workers)
    return carry_out(done, folder, command=command, fresh=fresh, watchers=watchers)


def warned(given: GivenFit, found: Found) -> GivenFit:
    """A fit with the warning of the search that found it, which then stands wherever those of fits do, the card too.

    Args:
        given: The fit.
        found: What came of the search.

    Returns:
        The fit.
    """

    def made(fit: FitResult) -> FitResult:
        warning = found.warning(fit.model)
        return replace(fit, notes=(*fit.notes, warning), warnings=(warning, *fit.warnings)) if warning else fit

    bare = given.bare
    return GivenFit(
        key=digest(strict({"fit": given.key, **found.judged_by})),
        make=lambda work: made(given.make(work)),
        bare=None if bare is None else lambda: made(bare()),
    )


def closing(searched: Searched, folder: Path) -> Closing:
    """What is said at the end: the front, the fits by case, why this one, and what to look at.

    Args:
        searched: What came of the search.
        folder: The run folder.

    Returns:
        The lines and files.
    """
    notes = [f"note: {one}" for one in searched.told if one not in searched.record.chosen_by]
    return Closing(
        lines=[
            table_of_front(searched.record),
            table_of_fits(searched.results),
            *told_of_fits(searched.results),
            f"Why this one: {searched.record.chosen_by}",
            *notes,
        ],
        files={
            "Report": folder / "report" / "index.html",
            "Bundle": folder / "bundle",
            "Trials": folder / "sweep.json",
            "Results": folder / "results.json",
        },
        compare=True,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _AutoSteps:
    """The steps of a search: its trials, which keep themselves, and those of a pipeline of fits for what was found."""

    auto: Auto
    find_workers: Hire

    @property
    def config(self) -> AutoConfig:
        """The checked fields."""
        return self.auto.config

    def outline(self) -> list[Outlined]:
        """All steps, as far as they are known before a trial is."""
        trials = Outlined(name=TRIALS, title=TITLE, estimate=self._estimate)
        return FitSteps(pipeline=self._first).outline_around(trials)

    def run(self, run: Run) -> Searched:
        """Every step, in order."""
        loaded = run.do(self._loading())
        found = run.do(self._searching(run, loaded)).value
        spent_s = TrialStore(path=run.store.path / TRIALS).seconds
        seconds = found.last_fits_s(spent_s, sum(map(len, loaded.value.estimation)))
        fits = [self._fit(name, found, seconds[name]) for name in found.shown]
        pipeline, given, parts, told = self._pipeline(fits), dict[str, GivenFit](), found.parts, list(found.told)
        for fit in fits:
            for model, made in zip(models_of(fit, pipeline.config), found.fits[fit.name], strict=True):
                further = parts.trained_on and trains_on(model.fit.structure)
                last = (parts.partial or further) and seconds[fit.name] > 0.0
                if (parts.partial or further) and not last:
                    told.append(NO_TIME.format(fit.name, model.fit.structure.label))
                judge = found if fit.name == FOUND else None
                fitted = self._again(model, made, loaded.value, further=further, judge=judge) if last else made
                given[model.fit.name] = fitted if judge is None else warned(fitted, judge)
        choice = Choice(name=FOUND, chosen_by=found.record.chosen_by)
        work = FitSteps(
            pipeline=pipeline, given=given, chosen=choice, page=self.auto.page, before_page=self.auto.before_page,
            suggest=is_suggested(self.config.mapping),
            seen=partial(seen_of, exact=True) if self.config.tolerance is not None else lambda data: data,
        )  # fmt: skip
        results = work.run(run, loaded)
        ready = events.SweepReady(
            record=found.record, folder=run.store.path, command=run.command, data=self.config.data,
            seed=self.config.seed,
        )  # fmt: skip
        run.then(lambda: run.tell(ready))
        told = list(dict.fromkeys(told))
        return Searched(
            record=found.record, results=results, told=tuple(told), hurried=found.hurried, needs_s=found.needs_s,
            spent=found.spent,
        )  # fmt: skip

    @property
    def _estimate(self) -> Estimate:
        wall = self.config.wall_s
        return NOT_KNOWN if wall is None else Estimate(seconds=wall, basis="at most; it stops when nothing is gained")

    @property
    def _first(self) -> Pipeline:
        """A pipeline that stands for what comes of the search."""
        return self._pipeline([FitConfig(name=FOUND, structure=stand_in(self.config))])

    def _pipeline(self, fits: list[FitConfig]) -> Pipeline:
        config = self.config.sweep(stand_in(self.config)).pipeline(fits)
        return Pipeline(config=config, text=self.auto.text, path=self.auto.path)

    def _loading(self) -> Step[Data]:
        step, load = FitSteps(pipeline=self._first).loading(), self.auto.load
        return step if load is None else replace(step, make=lambda _: load(), at_hand=lambda: True)

    def _searching(self, run: Run, loaded: Done[Data]) -> Step[Found]:
        return Step(
            name=TRIALS,
            title=TITLE,
            make=lambda work: self._searched(run, work, loaded.value),
            peek=lambda: self._stored(run, loaded.value),
            outcome=lambda found: f"{found.shown[FOUND].label} of {len(found.record.trials)} tried",
            was_found=lambda found: found.done_now == 0,
            how_long=lambda: self._estimate,
        )

    def _stored(self, run: Run, data: Data) -> Found:
        """What came of the trials, if all of them are there."""
        search = Search.of(self.config, data, run)
        return search.go(NoWorkers(), search.store.stopped_clock())

    def _searched(self, run: Run, work: Work, data: Data) -> Found:
        if run.fresh:
            shutil.rmtree(run.store.path / TRIALS, ignore_errors=True)
        work.say("looking at the traces")
        with TrialStore(path=run.store.path / TRIALS).clock() as clock:  # a look takes time, too
            search = Search.of(self.config, data, run)
            workers = self.find_workers(search.bench, self.config.workers)
            try:
                found = search.go(workers, clock)
            finally:
                workers.close()
        write_sweep(run.store.path, found.record)
        return found

    def _fit(self, name: str, found: Found, seconds: float) -> FitConfig:
        """A trial as a fit of a pipeline; one that is fitted once more has more starts, and the time that is left."""
        options, share = dict[str, Any](found.training[name]), found.kept
        structure: Mapping[str, Any] = found.shown[name].structure
        if found.parts.trained_on and trains_on(structure_from_dict(structure)):
            options |= FURTHER
            if self.config.iterations is not None:
                options["max_iterations"] = min(
                    FURTHER["max_iterations"], max(1, round(share * self.config.iterations))
                )
        elif found.parts.partial and "starts" in {*options} - {*found.shown[name].values} and "ensemble" not in options:
            options |= LAST
        if "max_time_s" in options and 0.0 < seconds < math.inf:
            options["max_time_s"] = round(seconds / len(found.fits[name]), 3)
        return FitConfig.model_validate({"name": name, "structure": dict(structure), "training": options or None})

    def _again(self, model: FitModel, made: GivenFit, data: Data, *, further: bool, judge: Found | None) -> GivenFit:
        """A model that was chosen on parts of the record, or after few iterations, fitted once more."""
        how, tolerance = "further" if further else "again", self.config.tolerance
        key = {"chosen": made.key, how: steps.fit_key(model.fit, model.config, data, None), "tolerance": tolerance}
        judged: dict[str, Any] = {} if judge is None else {"alone": judge.alone}
        key |= {} if judge is None else judge.judged_by

        def make(work: Work) -> FitResult:
            whole = partial(made.make, work)
            return refitted(
                work, model.fit, model.config, data, chosen=made.bare() if made.bare else whole(), whole=whole,
                further=further, tolerance=tolerance, **judged,
            )  # fmt: skip

        return GivenFit(key=digest(strict(key)), make=make)
