"""The best trials of a sweep as fits: with all that a fit has, and their free run checked as any fit's is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from sysid.errors import ConfigError
from sysid.estimation import FitResult, Loop, Status, Training
from sysid.estimation.estimators import estimator_of
from sysid.estimation.fitting import with_stability
from sysid.estimation.networks.starts.choosing import NEAR, VETTED
from sysid.reporting.sweep_record import Trial
from sysid.traces import Role, Trace
from sysid.workbench.fits.fit_steps import GivenFit
from sysid.workbench.runner.steps import Work
from sysid.workbench.runner.store import digest, strict
from sysid.workbench.sweep.driver import Driver
from sysid.workbench.sweep.store import TrialStore
from sysid.workbench.sweep.trial import Bench, fit_of, stored_models, train

if TYPE_CHECKING:
    from sysid.estimation.networks.posterior import Posterior

FOLDER = "checked"
"""Beside the trials: those whose free run was checked."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Checks:
    """Checks trials of one sweep, each once.

    Args:
        driver: Has the trials.
        bench: Traces and conditions.
        whole: The estimation traces where trials have seen pieces of them alone: sequences that are made of pieces are
            too short for a run to lose its way on them.
        tolerance: Share of an output's range: one that stays within it on fewer of what chooses is none of those alike.
    """

    driver: Driver
    bench: Bench
    whole: Sequence[Trace] = ()
    tolerance: float | None = None
    found: dict[int, list[FitResult]] = field(default_factory=dict)
    """Fits that were checked, by the trial's number."""

    def first_stable(self, ranked: Sequence[Trial]) -> tuple[Trial, int]:
        """The best trial, or the best stable one among the best; of those alike one that forgets where it began.

        Args:
            ranked: Trials that can be used, the best first.

        Returns:
            The trial, and how many that ranked higher were passed over. Of fits of the open loop the best is taken as
            it is, and so it is where none that was looked at is stable.
        """
        for refused, trial in enumerate(ranked[:VETTED]):
            asks = self.bench.stability.choose and self._stored(trial)[0].loop is Loop.CLOSED
            if not asks:
                return trial, refused
            if all(fit.status is not Status.UNSTABLE for fit in self.checked(trial)):
                return self._that_forgets(ranked[refused:VETTED]), refused
        return ranked[0], 0

    def _that_forgets(self, ranked: Sequence[Trial]) -> Trial:
        """The first of some trials, or of those alike the first whose free run is stable and forgets where it began."""
        first = ranked[0]
        limit = (1.0 + NEAR) ** 2 * (first.selection_free_run_mse or 0.0)
        for trial in ranked:
            fewer = self.tolerance is not None and trial.within(self.tolerance) < first.within(self.tolerance)
            if fewer or not (trial.selection_free_run_mse or math.inf) <= limit:
                continue
            fits = self.checked(trial)
            if all(fit.status is not Status.UNSTABLE and not (fit.stability or {}).get("apart") for fit in fits):
                return trial
        return first

    def given(self, trial: Trial) -> list[GivenFit]:
        """A trial as fits that were made elsewhere.

        Args:
            trial: The trial.

        Returns:
            One for each of its models.
        """
        job, stability = self.driver.last[trial.number], self.bench.stability
        terms = {"job": job.key, "stability": stability.terms}
        count = len(self._stored(trial))

        def make(number: int, _: Work) -> FitResult:
            fit = self._whole(trial, self.checked(trial), number)
            return replace(fit, train_time_s=float(trial.seconds) / count)

        def bare(number: int) -> FitResult:
            return replace(self.checked(trial)[number], train_time_s=float(trial.seconds) / count)

        keys = [digest(strict(terms if count == 1 else {**terms, "model": number})) for number in range(count)]
        return [
            GivenFit(key=key, make=partial(make, number), bare=partial(bare, number)) for number, key in enumerate(keys)
        ]

    def _stored(self, trial: Trial) -> list[FitResult]:
        return [FitResult.from_dict(one["fit"]) for one in stored_models(self._outcome(trial))]

    def _outcome(self, trial: Trial) -> dict[str, Any]:
        key = self.driver.last[trial.number].key
        outcome = self.driver.store.read(key)
        if outcome is None:
            raise ConfigError(
                "a trial has gone from the run folder",
                where=self.driver.store.file(key),
                remedy="run the sweep again: the trial is done anew",
            )
        return outcome

    def checked(self, trial: Trial) -> list[FitResult]:
        """The trial's fits with what their check found, from the disk where it was made before.

        Args:
            trial: The trial.

        Returns:
            One fit, or one an output.
        """
        if trial.number not in self.found:
            store = TrialStore(path=self.driver.store.path / FOLDER)
            terms = {
                "job": self.driver.last[trial.number].key,
                "stability": self.bench.stability.terms,
                **({"whole": [trace.digest for trace in self.whole]} if self.whole else {}),
            }
            key = digest(strict(terms))
            outcome = store.read(key)
            if outcome is None:
                estimation = self.whole or self.bench.traces.with_role(Role.ESTIMATION)
                # A trial that chose between starts was checked as it did.
                first, *further = [
                    fit
                    if fit.stability is not None and not self.whole
                    else with_stability(fit, estimation, self.bench.stability)
                    for fit in self._stored(trial)
                ]
                outcome = {
                    "key": key,
                    "fit": first.to_dict(),
                    "further": [{"fit": fit.to_dict()} for fit in further],
                }
                store.write(outcome)
            self.found[trial.number] = [FitResult.from_dict(one["fit"]) for one in stored_models(outcome)]
        return self.found[trial.number]

    def _whole(self, trial: Trial, fits: Sequence[FitResult], number: int) -> FitResult:
        """The fit with its posterior, which is too large to be kept of every trial, and with what is told of it."""
        job, fit = self.driver.last[trial.number], fits[number]
        row, mapping, bench = estimator_of(fit.model.structure), fit.model.mapping, self.bench
        if row.training is Training:
            fit = replace(fit, posterior=self._posterior(trial, fit, number))
        options = fit_of(job).training_options(bench.seed)
        estimation = bench.traces.with_role(Role.ESTIMATION)
        return row.remarked(fit, estimation, mapping, options, start=bench.start, selection=bench.selection)

    def _posterior(self, trial: Trial, fit: FitResult, number: int) -> Posterior | None:
        """What training knew of a network's parameters: made from where it ended."""
        job, outcome = self.driver.last[trial.number], self._outcome(trial)
        again = None
        if all(one["checkpoint"] is not None for one in stored_models(outcome)):
            training = {**job.training, "starts": 1, "ensemble": 1, "input_subsets": ()}
            again, _ = train(self.bench, replace(job, after=job.key, resume=True, training=training), outcome)[number]
        if again is None or not np.array_equal(again.model.recursion.numbers, fit.model.recursion.numbers):
            # Hidden states have no checkpoint, and an ensemble is no single start's: all of the trial is done again.
            before = None if job.after is None else self.driver.store.read(job.after)
            again, _ = train(self.bench, job, before)[number]
        return again.posterior
