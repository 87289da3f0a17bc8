"""The trials of a search, from the look at the data to the choice."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from sysid.errors import ConfigError
from sysid.estimation import Status
from sysid.models import ARX, AbstractStructure
from sysid.models.store import structure_from_dict
from sysid.reporting.sweep_record import SweepRecord, Trial
from sysid.workbench.auto import told
from sysid.workbench.auto.beyond import Beyond, look_beyond
from sysid.workbench.auto.budget import FINAL, RACE, TRIAL, TRIAL_OF_MANY, Budget
from sysid.workbench.auto.config import OBJECTIVES, AutoConfig
from sysid.workbench.auto.finish import finish_s
from sysid.workbench.auto.found import FOUND, LINEAR, Found
from sysid.workbench.auto.last_fit import LastFit, refit_share
from sysid.workbench.auto.look import Looked, look
from sysid.workbench.auto.parts import Parts, part
from sysid.workbench.auto.plan import AGAIN, SPENT, Plan
from sysid.workbench.auto.race import Race, as_far, as_rival, trains_on
from sysid.workbench.auto.ripe import Ripening, young_told
from sysid.workbench.auto.trials import Trials
from sysid.workbench.auto.words import Choice, Error, choose, sentence
from sysid.workbench.auto.worth import Rank, error, ranked_by
from sysid.workbench.fits import steps
from sysid.workbench.fits.config import FitConfig
from sysid.workbench.fits.data import Data
from sysid.workbench.runner import events
from sysid.workbench.runner.run import Run
from sysid.workbench.sweep.checks import Checks
from sysid.workbench.sweep.driver import Driver
from sysid.workbench.sweep.store import TRIALS, Clock, TrialStore
from sysid.workbench.sweep.trial import Bench
from sysid.workbench.sweep.workers import AbstractWorkers

TITLE = "Searching for a model"
CHECKED = 50
"""Sequences over which a trial's free run is checked, or one for each second of the search where that is more: all of
them took longer than the training of a short search. The last fit is checked over all."""


def stand_in(config: AutoConfig) -> AbstractStructure:
    """Stands for what is tried where only what all trials share matters.

    Args:
        config: The search.

    Returns:
        A structure for its inputs.
    """
    m = len(config.mapping.inputs)
    return ARX(na=1, nb=(1,) * m, nk=(1,) * m)


@dataclass(frozen=True, kw_only=True, eq=False)
class Search:
    """A search over the traces of one pipeline.

    Args:
        config: What is searched, and how much may be spent.
        data: The traces.
        run: Is told how it goes, and has the folder.
        parts: What is fitted and what chooses.
        bench: What all trials share.
        looked: What is in the record.
    """

    config: AutoConfig
    data: Data
    run: Run
    parts: Parts
    bench: Bench
    looked: Looked

    @classmethod
    def of(cls, config: AutoConfig, data: Data, run: Run) -> Search:
        """Look at the traces, and part them.

        Args:
            config: What is searched.
            data: The traces.
            run: Has the folder.

        Returns:
            The search, before its first trial.

        Raises:
            ConfigError: If the record is too short.
        """
        exact = config.tolerance is not None
        looked = look(data, config.mapping, config.start, exact=exact)
        parts = part(data, config.mapping, config.start, config.wall_s, in_turn=looked.integrators > 0, exact=exact)
        structure = stand_in(config)
        pipeline = config.sweep(structure).pipeline([FitConfig(name=FOUND, structure=structure)])
        if config.wall_s is not None:
            count = min(config.stability.count, max(CHECKED, round(config.wall_s)))
            stability = pipeline.stability.model_copy(update={"count": count})
            pipeline = pipeline.model_copy(update={"stability": stability})
        first = parts.folds[0]
        bench = Bench(
            folder=run.store.path,
            pipeline=pipeline.model_dump(mode="json"),
            traces=first.fitted,
            selection=first.chooses,
            sequences=data.sequences,
            folds=tuple((fold.fitted, fold.chooses) for fold in parts.folds),
            processor_time=True,
        )
        return cls(config=config, data=data, run=run, parts=parts, bench=bench, looked=looked)

    @property
    def store(self) -> TrialStore:
        """Where trials lie."""
        return TrialStore(path=self.run.store.path / TRIALS)

    def go(self, workers: AbstractWorkers, clock: Clock) -> Found:
        """Try what there is to try, and choose.

        Args:
            workers: Who trains.
            clock: The time that it takes, over all sessions.

        Returns:
            What was found.

        Raises:
            ConfigError: If nothing that was tried can be used.
        """
        driver = Driver(
            config=self.config.sweep(stand_in(self.config)),
            bench=self.bench,
            store=self.store,
            workers=workers,
            clock=clock,
            step=TITLE,
            tell=lambda event: self.run.tell(_progress(event, plan)),
            late=lambda: budget.is_late() and math.isfinite(plan.least()),
        )
        trials = Trials.of(driver)
        again = 0 if self.parts.trained_on else AGAIN
        budget = Budget(
            wall_s=self.config.wall_s,
            iterations=self.config.iterations,
            clock=lambda: clock.total,
            is_stored=trials.is_stored,
            side_by_side=self.config.workers,
            folds=len(self.parts.folds),
            refit=refit_share(self.parts),
            trial=TRIAL_OF_MANY if self.parts.trained_on else TRIAL,
            kept=FINAL if again else 0.0,
            finishing_s=self._finishing_s,
        )
        training = {**self.parts.training, **budget.limits(budget.trial / len(self.parts.folds))}
        if self.parts.trained_on and self.config.tolerance is not None:
            training["within"] = self.config.tolerance
        plan = Plan(
            looked=self.looked, budget=budget, error=self._rival, training=training, seed=self.config.seed, again=again,
            tolerance=self.config.tolerance,
        )  # fmt: skip
        # What was held out of a fold is fitted in the end by another training: its trials are not trained on.
        ripening = Ripening(driver=trials.drivers[0], budget=budget, rank=self._rank, n_outputs=self._n_outputs)
        while points := plan.ask():
            found = trials.run(points)
            plan.tell(ripening(points, found) if self.parts.trained_on else found)
            budget.refit = self._last.kept(plan)
        if not math.isfinite(plan.least()):
            raise ConfigError(
                "nothing that was tried can be used",
                where=f"data set {self.data.traces.name}",
                expected="a fit that is stable and improves on where it started",
                got=", ".join(sorted({trial.status for trial in plan.trials})) or "no trial within the budget",
                remedy="allow more minutes, and look at the record with sysid advise",
            )
        return self._chosen(plan, trials, clock)

    def _chosen(self, plan: Plan, trials: Trials, clock: Clock) -> Found:
        first, kept, raced = trials.drivers[0], refit_share(self.parts), 0
        if self.parts.trained_on:
            race = Race(
                driver=first, points=plan.points, rank=self._rank, n_outputs=self._n_outputs,
                wall_s=None if self.config.wall_s is None else min(self.config.wall_s, plan.budget.ends_s),
                iterations=self.config.iterations, workers=self.config.workers, clock=lambda: clock.total,
                kept=kept - sum(RACE), ends_s=plan.budget.ends_s,
                slowed=1.0 if self.config.wall_s is None else plan.budget.slowed,
            )  # fmt: skip
            plan.trials[:], spent = race.run(plan.trials)
            kept, raced = kept - spent, len(race.in_it)
        whole = () if self.data.selection else self.data.estimation
        checks = Checks(driver=first, bench=self.bench.fold(0), whole=whole, tolerance=self.config.tolerance)
        beyond = self._beyond(plan, trials)
        choice = choose(
            plan.candidates, self._error, checks.first_stable, tolerance=self.config.tolerance, beyond=beyond.of,
            goes_on=lambda trial: self.parts.trained_on and trains_on(structure_from_dict(trial.structure)),
        )  # fmt: skip
        needs_s = told.needs_s(plan, clock.total)
        shown, hurried = {FOUND: choice.chosen}, told.hurried(plan, choice.chosen, clock.total, needs_s)
        united = self._last.united(plan, choice.chosen, clock.total, beyond)
        if choice.linear is not None and choice.linear.number != choice.chosen.number:
            shown[LINEAR] = choice.linear
        return Found(
            record=self._record(plan, choice, beyond, clock.total, raced, united=bool(united)),
            shown=shown,
            fits={
                name: (self._nearest(checks, trials, trial, beyond) if name == FOUND else checks).given(trial)
                for name, trial in shown.items()
            },
            training={
                name: {**first.last[trial.number].training, **(united if name == FOUND else {})}
                for name, trial in shown.items()
            },
            parts=self.parts,
            kept=kept,
            ends_s=plan.budget.ends_s,
            slowed=1.0 if self.config.wall_s is None else plan.budget.slowed,
            told=(
                *self.parts.told,
                *([hurried] if hurried else []),
                *([f"{choice.chosen.label} was {choice.chosen.reason}."] if choice.chosen.reason else []),
                *told.busy(plan),
                *told.left_out(plan),
                *(f"Look at the data: {one}" for one in self.looked.cautions),
            ),
            beyond=beyond,
            unit=self._unit,
            hurried=hurried,
            needs_s=needs_s,
            spent=plan.ended == SPENT,
            done_now=trials.done_now,
        )

    @property
    def _last(self) -> LastFit:
        return LastFit(config=self.config, data=self.data, parts=self.parts)

    @property
    def _rank(self) -> Rank:
        return ranked_by(self._rival, self.config.tolerance)

    @property
    def _error(self) -> Error:
        """What chooses: of records without noise also of what is not stable yet, where its training goes on."""
        return as_far if self.looked.exact and self.parts.trained_on else error

    @property
    def _rival(self) -> Error:
        return as_rival if self.looked.exact and self.parts.trained_on else error

    @property
    def _finishing_s(self) -> float:
        """Processor seconds of what follows; nobody asks for them where iterations are counted."""
        wall_s = self.config.wall_s
        if wall_s is None:
            return 0.0
        return finish_s(len(self.data.traces), self._n_outputs, wall_s, drawn=self.config.report.drawn, slowed=1.0)

    @property
    def _n_outputs(self) -> int:
        return len(self.config.mapping.outputs)

    def _beyond(self, plan: Plan, trials: Trials) -> Beyond:
        """How far what may be chosen is apart on other commands; not asked where training goes on after the choice."""
        if self.parts.trained_on:
            return Beyond()
        sizes = steps.output_sizes(self.data, self.config.mapping.outputs)
        return look_beyond(
            plan.candidates, error, lambda one: [m for n in plan.starts_of(one) for m in trials.fitted(n)],
            self.data.estimation, sizes, seed=self.config.seed,
        )  # fmt: skip

    def _nearest(self, checks: Checks, trials: Trials, trial: Trial, beyond: Beyond) -> Checks:
        """Of the parts that a trial was fitted to, the stable one nearest to the middle of all on other commands.

        Its fit is what is kept where no start of the last one is stable, or all of them stand alone.
        """
        if beyond.middle is None:
            return checks
        others = [
            replace(checks, driver=trials.drivers[k], bench=self.bench.fold(k), found={})
            for k in trials.folds_of(trial.number)
            if k
        ]
        away = {one: beyond.middle.away([fit.model for fit in one.checked(trial)]) for one in (checks, *others)}
        stable = [one for one in away if all(fit.status is not Status.UNSTABLE for fit in one.checked(trial))]
        return min(stable, key=lambda one: away[one], default=checks)

    @property
    def _unit(self) -> str:
        """Of errors: those of several outputs count over their variances, in standard deviations."""
        outputs = self.config.mapping.outputs
        return self.bench.traces.traces[0].channel(outputs[0]).unit if len(outputs) == 1 else "σ"

    def _record(
        self, plan: Plan, choice: Choice, beyond: Beyond, wall_s: float, raced: int, *, united: bool
    ) -> SweepRecord:
        said = sentence(
            choice, len(plan.trials), again=plan.n_again, raced=raced, unit=self._unit, ended=plan.ended,
            error=self._error, beyond=beyond.away,
        )  # fmt: skip
        said += told.last_fit(plan, choice.chosen) if united else ""
        young = young_told(plan.trials, self._rank, self._n_outputs, len(self.parts.folds))
        return SweepRecord(
            name=self.config.name,
            mapping=str(self.config.mapping),
            unit=self._unit,
            method="auto",
            loop="closed",
            points=len(plan.trials),
            objectives=list(OBJECTIVES),
            choose_by="free_run_mse",
            choose_on="selection",
            chosen_by=" ".join(one for one in (said, young, *self.parts.told) if one),
            workers=self.config.workers,
            wall_s=wall_s,
            winner=choice.chosen.number,
            trials=list(plan.trials),
        )


def _progress(event: events.Event, plan: Plan) -> events.Event:
    """How far the search is, in place of how far a round is."""
    if not isinstance(event, events.StepProgress):
        return event
    least = plan.least()
    best = f", least error so far {math.sqrt(least):.3g}" if math.isfinite(least) else ""
    detail = f"{len(plan.trials)} tried, {plan.budget.left()}{best}"
    return replace(event, fraction=plan.budget.fraction(), detail=detail)


Hire = Callable[[Bench, int], AbstractWorkers]
"""Finds workers for a number of processes."""
