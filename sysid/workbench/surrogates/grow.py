"""Experiments added where a surrogate needs them, in rounds: run, look, add, train on from the former model.

What is added comes from new random experiments that are scored nowhere else. What a round has brought is judged on the
selection runs, which also choose the round whose model is taken; the proof's experiments have no say in anything.
Beside it goes the control: as many experiments added as they come, to a model of its own.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.composite.growth import in_rounds, worst_of
from sysid.errors import ConfigError
from sysid.estimation import FitResult, StabilityOptions, Training, fitting
from sysid.estimation.estimators import estimator_of
from sysid.estimation.results.tolerance import outside, spans_of
from sysid.models import Start
from sysid.references.candidates import Candidates
from sysid.references.config import ReferenceConfig
from sysid.references.design import Design
from sysid.references.runs import Case, Outcome, ReferenceRuns
from sysid.reporting.growth import GrowthRecord, RoundRecord
from sysid.traces import Role, Trace, TraceSet
from sysid.workbench.experiments.config import GrowConfig
from sysid.workbench.fits.record import read_fit, write_fit
from sysid.workbench.fits.steps import fit_code
from sysid.workbench.runner.store import digest, strict
from sysid.workbench.surrogates.proof import rms_shares, surrogate_inputs

PATIENCE, GAIN = 2, 0.02
"""Rounds without a gain after which it ends, and the part of the error by which a round has to better it."""
MEMBERS = 2
"""Models of other starts beside the surrogate whose spread says how uncertain it is."""
TRAINING = {"max_iterations": 200, "starts": 2}
"""How a network is trained in a round: from the former model, and from one other start."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Stand:
    """A surrogate after a round.

    Args:
        fits: Its fits, one a model.
        added: Experiments that were added to what was fitted first.
        error: The error quantile on the selection runs, as a share of the range.
        outside: Selection runs on which it leaves what it is to stay under.
    """

    fits: Sequence[FitResult]
    added: Sequence[Outcome]
    error: float
    outside: int = 0


@dataclass(frozen=True, kw_only=True, eq=False)
class Grown:
    """What came of the rounds.

    Args:
        best: The surrogate that is taken, by the selection runs.
        record: What each round brought.
    """

    best: Stand
    record: GrowthRecord


@dataclass(kw_only=True, eq=False)
class Grower:
    """Adds experiments in rounds.

    Args:
        reference: With whole paths.
        design: As experiments are drawn.
        config: How it grows.
        taught: What was run first, with its roles.
        rest: Outputs before the first sample, by name.
        folder: Where fits are kept: what a killed run has trained is found there.
        training: Options of a network's training beside :data:`TRAINING`.
        workers: Processes that run the reference.
        seconds: Wall time of all rounds; ``None`` for no limit.
        stability: How the free run of what a round gives is checked.
        say: Told how it goes.
    """

    reference: ReferenceConfig
    design: Design
    config: GrowConfig
    taught: TraceSet
    rest: Mapping[str, float]
    folder: Path
    training: Mapping[str, Any] = field(default_factory=dict)
    workers: int = 2
    seconds: float | None = None
    stability: StabilityOptions | None = field(default_factory=StabilityOptions)
    say: Callable[[str], None] = lambda _: None
    _began: float = field(default_factory=time.monotonic)
    _rows: list[RoundRecord] = field(default_factory=list)
    _ran: int = 0
    _seen: list[Outcome] = field(default_factory=list)

    @property
    def outputs(self) -> tuple[str, ...]:
        """Of the reference."""
        return tuple(self.reference.outputs)

    @property
    def spans(self) -> NDArray[np.float64]:
        """Range of each output in what was fitted first, shape ``(n_outputs,)``."""
        return spans_of(self.taught.with_role(Role.ESTIMATION), self.outputs)

    def grow(self, first: Sequence[FitResult]) -> Grown:
        """Add experiments until the error quantile holds, nothing gains, or rounds or time are spent.

        Args:
            first: The surrogate's fits, of what was run first; their structures stay.

        Returns:
            The best surrogate, and what each round brought.

        Raises:
            ConfigError: If there are no selection runs to judge by, or the reference cannot be run.
        """
        if not self.taught.with_role(Role.SELECTION):
            raise ConfigError(
                "growth cannot be judged", where="runs", expected="selection runs, which say what a round has brought",
                got="none", remedy="give runs a number for selection",
            )  # fmt: skip
        self._began, self._rows, self._ran, self._seen = time.monotonic(), [], 0, []
        begun = self._stand(first, [])
        self._row(0, "start", begun, 0)
        control = [begun]
        with ReferenceRuns(config=self.reference, workers=self.workers) as runs:

            def train(number: int, former: Stand, added: Sequence[Outcome]) -> Stand:
                stand = self._round(number, former, added, self.config.pick)
                if self.config.control:
                    beside = self._as_they_come(runs, self._candidates.cases(number), added)
                    control.append(self._round(number, control[-1], beside, "random"))
                return stand

            stands, ended = in_rounds(
                begun, look=partial(self._picked, runs), train=train, ended=self._ended,
                nothing=f"none of {self.config.candidates} new experiments is beyond {self.config.until:.2g}",
            )  # fmt: skip
        every = [*stands, *control[1:]]
        chosen = min(range(len(every)), key=lambda k: (every[k].outside, every[k].error, k))
        record = GrowthRecord(
            pick=self.config.pick, candidates=self.config.candidates, until=self.config.until,
            quantile=self.config.quantile, selection=len(self.taught.with_role(Role.SELECTION)), rounds=self._rows,
            ended=ended, chosen_round=chosen if chosen < len(stands) else chosen - len(stands) + 1,
            chosen_by_chance=chosen >= len(stands),
        )  # fmt: skip
        return Grown(best=every[chosen], record=record)

    def _ended(self, stands: Sequence[Stand]) -> str:
        """Why there is no further round; empty where there is one."""
        if len(stands) == 1:
            return ""
        if stands[-1].error <= self.config.until:
            return "the error quantile holds"
        errors, stale = [one.error for one in stands], 0
        while stale < len(errors) - 1 and errors[-1 - stale] >= (1.0 - GAIN) * min(errors[: -1 - stale]):
            stale += 1
        if stale >= PATIENCE:
            return f"the last {PATIENCE} rounds gained less than {GAIN:.0%}"
        if len(stands) > self.config.rounds:
            return "all rounds are done"
        return "the time is spent" if self._left() <= 0.0 else ""

    def _left(self) -> float:
        return float("inf") if self.seconds is None else self.seconds - (time.monotonic() - self._began)

    @property
    def _candidates(self) -> Candidates:
        return Candidates(reference=self.reference, design=self.design, count=self.config.candidates)

    def _picked(self, runs: ReferenceRuns, number: int, stand: Stand) -> list[Outcome]:
        """What a round adds."""
        config, cases = self.config, self._candidates.cases(number)
        if config.pick == "uncertain":
            asked = [cases[k] for k in worst_of(self._doubt(stand, cases), config.keep)]
            return [one for one in self._run(runs, asked) if one.trace is not None]
        # What was run for an earlier round and not added may be what is worst now.
        taken = {one.case.name for one in stand.added}
        self._seen += [one for one in self._run(runs, cases) if one.trace is not None]
        left = [one for one in self._seen if one.case.name not in taken]
        errors = self._errors(stand.fits, [one.trace for one in left if one.trace is not None])
        return [left[k] for k in worst_of(errors, config.keep, beyond=config.until)]

    def _as_they_come(self, runs: ReferenceRuns, cases: Sequence[Case], added: Sequence[Outcome]) -> list[Outcome]:
        """As many of the same candidates, in the order in which they were drawn."""
        found: list[Outcome] = []
        for case in cases:
            if len(found) == len(added):
                break
            found += [one for one in runs.run([case]) if one.trace is not None]
        return found

    def _run(self, runs: ReferenceRuns, cases: Sequence[Case]) -> list[Outcome]:
        self._ran += len(cases)
        return runs.run(cases)

    def _doubt(self, stand: Stand, cases: Sequence[Case]) -> NDArray[np.float64]:
        """How far models of other starts differ on each experiment, root mean square as a share of the range."""
        traces = self.traces(stand.added)
        members = [list(stand.fits)]
        members += [[self._fit(one, traces, seed=1 + k, warm=False) for one in stand.fits] for k in range(MEMBERS)]
        found = []
        for case in cases:
            columns = dict(
                zip(
                    [*self.reference.inputs, *self.reference.parameters],
                    surrogate_inputs(self.reference, case).T,
                    strict=True,
                )
            )
            runs = np.array([self._simulated(fits, columns, len(case.inputs)) for fits in members])
            with np.errstate(all="ignore"):
                spread = np.sqrt(np.mean(np.var(runs, axis=0), axis=0)) / self.spans
            found.append(float(np.nan_to_num(spread, nan=np.inf).max()))
        return np.array(found)

    def _round(self, number: int, former: Stand, added: Sequence[Outcome], how: str) -> Stand:
        began, whole = time.monotonic(), [*former.added, *added]
        traces = self.traces(whole)
        stand = self._stand([self._fit(one, traces, seed=0, warm=True) for one in former.fits], whole)
        self._row(number, how, stand, time.monotonic() - began)
        return stand

    def _stand(self, fits: Sequence[FitResult], added: Sequence[Outcome]) -> Stand:
        errors = self._errors(fits, self.taught.with_role(Role.SELECTION))
        usable = all(fit.status.usable for fit in fits)
        error = float(np.quantile(np.minimum(errors, 1e9), self.config.quantile)) if usable else float("inf")
        left = outside(errors, self.config.until) if usable else len(errors)
        return Stand(fits=fits, added=added, error=error, outside=left)

    def _row(self, number: int, how: str, stand: Stand, seconds: float) -> None:
        fitted = len(self.taught.with_role(Role.ESTIMATION)) + len(stand.added)
        errors = self._errors(stand.fits, self.taught.with_role(Role.SELECTION))
        row = RoundRecord(
            number=number, how=how, fitted=fitted, ran=self._ran, error=stand.error, median=float(np.median(errors)),
            seconds=seconds,
        )  # fmt: skip
        self._rows.append(row)
        self.say(
            f"round {number} ({how}): {fitted} experiments fitted, error {100.0 * stand.error:.3g} % of the range at "
            f"quantile {self.config.quantile:g} of the selection runs"
        )

    def traces(self, added: Sequence[Outcome]) -> TraceSet:
        """What is fitted, chosen on and tested once experiments are added.

        Args:
            added: The experiments; they are fitted.

        Returns:
            The records with their roles.
        """
        more = [one.trace for one in added if one.trace is not None]
        roles = {**self.taught.roles, **{one.name: Role.ESTIMATION for one in more}}
        return replace(self.taught, traces=(*self.taught.traces, *more), roles=roles)

    def _fit(self, former: FitResult, traces: TraceSet, *, seed: int, warm: bool) -> FitResult:
        """The same structure, fitted to more; found where a killed run has left it."""
        model = former.model
        row = estimator_of(model.structure)
        initial = former if warm and row.initial is not None else None
        own = {**TRAINING, "within": self.config.until, "seed": seed}
        given = {**self.training, **own} if row.training is Training else dict(self.training)
        terms = {
            "structure": model.structure.to_dict(), "training": given, "mapping": str(model.mapping),
            "initial": None if initial is None else model.to_dict(), "rest": dict(self.rest),
            "traces": [[one.digest, traces.roles[one.name].value] for one in traces], "code": fit_code(model.structure),
        }  # fmt: skip
        place = self.folder / digest(strict(terms))[:32]
        if (place / "fit.json").is_file():
            return read_fit(place)
        if row.training is Training and self.seconds is not None:
            given["max_time_s"] = max(1.0, self.seconds / (2.0 * self.config.rounds * len(self.outputs)))
        found = fitting.fit(
            traces.with_role(Role.ESTIMATION), model.mapping, model.structure,
            row.options(given or None, seed=seed) if row.training is not None else None,
            start=Start(), rest_output=dict(self.rest), selection=traces.with_role(Role.SELECTION), initial=initial,
            stability=self.stability,
        )  # fmt: skip
        write_fit(place, found)
        return found

    def _errors(self, fits: Sequence[FitResult], traces: Sequence[Trace]) -> NDArray[np.float64]:
        """Root mean square of each free run as a share of the range, the largest of its outputs."""
        found = []
        for trace in traces:
            columns = {name: trace[name] for name in (*self.reference.inputs, *self.reference.parameters)}
            run = self._simulated(fits, columns, len(trace))
            found.append(rms_shares(run, trace.columns(self.outputs), self.spans).max())
        return np.array(found)

    def _simulated(
        self, fits: Sequence[FitResult], columns: Mapping[str, NDArray[np.float64]], samples: int
    ) -> NDArray[np.float64]:
        """Free run of all outputs, shape ``(n_samples, n_outputs)``."""
        found: dict[str, NDArray[np.float64]] = {}
        for model in (fit.model for fit in fits):
            inputs = np.array([columns[name] for name in model.mapping.inputs]).reshape(-1, samples).T
            with np.errstate(all="ignore"):
                run = model.simulate(inputs).reshape(samples, -1)
            found |= dict(zip(model.mapping.outputs, run.T, strict=True))
        return np.column_stack([found[name] for name in self.outputs])
