"""The driver: which jobs there are, in which order they may be done, who is dropped, what is announced.

Nothing here depends on when a result comes in. A trial's seed follows from its point; a trial that begins from another
waits for it; trials are dropped only when all of a rung are in. So the same sweep gives the same trials and the same
winner with any number of workers, killed or not. The driver alone writes: workers compute and answer.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from sysid.code_digest import code_digest
from sysid.estimation import Training
from sysid.estimation.estimators import estimator_of
from sysid.estimation.results.tolerance import outside
from sysid.models import structure_from_dict
from sysid.reporting.sweep_record import FIGURES, Trial
from sysid.workbench.runner.events import StepProgress, Watcher
from sysid.workbench.runner.store import digest, strict
from sysid.workbench.sweep.config import SweepConfig
from sysid.workbench.sweep.progress import Progress, Rung
from sysid.workbench.sweep.search_space import Point
from sysid.workbench.sweep.store import Clock, TrialStore
from sysid.workbench.sweep.trial import Bench, Job, forget_checkpoint, gave_up, run_job
from sysid.workbench.sweep.workers import AbstractWorkers

FORMAT = 2
"""Changes when what a trial stores changes, so that older ones are done again."""

LINEAR = {"loop": "open", "max_iterations": 20, "regularisation": 0.0}
"""How the linear fit is made that networks with the same delays may begin from: least squares, in a few steps."""


LINEAR_COST = 100.0
"""Work of a linear fit, in the units of :meth:`Driver.cost`."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Driver:
    """Goes through points.

    Args:
        config: The sweep.
        bench: What all jobs share.
        store: Where results lie.
        workers: Who does the jobs.
        clock: The time that the sweep takes.
        step: What is being done, for the screen.
        tell: Told how it goes.
        last: The last job of each point that was tried, by its number.
        fold: Which of the bench's folds its jobs are of.
        late: Whether there is no time for what is not done: it is given up, and told so.
    """

    config: SweepConfig
    bench: Bench
    store: TrialStore
    workers: AbstractWorkers
    clock: Clock
    step: str
    tell: Watcher
    _shared: str = field(init=False)
    _progress: Progress = field(init=False)
    last: dict[int, Job] = field(default_factory=dict)
    fold: int = 0
    late: Callable[[], bool] = lambda: False
    _smaller: dict[int, Point] = field(default_factory=dict)

    def __post_init__(self) -> None:
        bench = self.bench.fold(self.fold)
        terms = {
            "format": FORMAT,
            "pipeline": {name: bench.pipeline.get(name) for name in ("mapping", "start", "rest")},
            "traces": bench.traces.digest,
            "selection": [trace.digest for trace in bench.selection],
        }
        object.__setattr__(self, "_shared", digest(terms))
        progress = Progress(
            cost=self.cost, rank=self.rank, by=self.config.choose.by, session_s=lambda: self.clock.session,
            show_at=lambda share, said: self.tell(StepProgress(step=self.step, fraction=share, detail=said)),
        )  # fmt: skip
        object.__setattr__(self, "_progress", progress)

    @property
    def done_now(self) -> int:
        """Jobs that this session has done itself."""
        return self._progress.n_fresh

    def is_stored(self, point: Point) -> bool:
        """Whether a point's training, of a sweep without rungs, is done and on disk.

        Args:
            point: The point.

        Returns:
            Whether it is.
        """
        return self.store.read(self._job(point, self.rungs()[-1], None, {}).key) is not None

    def rungs(self) -> list[Rung]:
        """The rungs, the end of the training last."""
        rungs = [Rung(iterations=r.iterations, record=r.record, keep=r.keep) for r in self.config.pruning]
        return [*rungs, Rung(iterations=self._full, record=1.0, keep=1.0)]

    @property
    def _full(self) -> int:
        return int(self.config.training.get("max_iterations", Training().max_iterations))

    def run(self, points: Sequence[Point], *, keep_all: bool = False) -> list[Trial]:
        """Try some points.

        Args:
            points: The points; a network that begins from a smaller one begins from one of these.
            keep_all: Drop none.

        Returns:
            A trial for each, in their order; those that were dropped say at which rung.
        """
        rungs = [replace(rung, keep=1.0) if keep_all else rung for rung in self.rungs()]
        self._progress.expect(points, rungs)
        self._smaller.clear()
        self._smaller.update(_next_smaller(points) if self.config.warm_start == "smaller" else {})
        jobs: dict[int, Job] = {}
        found: dict[int, Trial] = {}
        alive = list(points)
        for number, rung in enumerate(rungs, start=1):
            shared, jobs = self._jobs(alive, rung, jobs if number > 1 else None)
            self.last.update(jobs)
            trials = self._do([*shared, *jobs.values()])
            for point in alive:
                trial = trials[jobs[point.number].key]
                found[point.number] = _as_trial_of(trial, point, before=found.get(point.number))
            alive, dropped = self._split(alive, found, rung.keep)
            for point in dropped:
                found[point.number] = found[point.number].model_copy(update={"dropped_at": number})
            self._progress.dropped(len(alive), rungs[number:])
        return [found[point.number] for point in points]

    def do_ahead(self, wanted: Sequence[tuple[Driver, Sequence[Point]]]) -> None:
        """Do what several drivers of one bench begin with, side by side: none waits for the last of another's.

        Each then finds its own results stored when it runs.

        Args:
            wanted: Drivers, one a fold, and what each will try.
        """
        begun = [driver._jobs(points, driver.rungs()[0], None) for driver, points in wanted]
        self._do([job for shared, jobs in begun for job in (*shared, *jobs.values())])

    def _jobs(
        self, points: Sequence[Point], rung: Rung, before: Mapping[int, Job] | None
    ) -> tuple[list[Job], dict[int, Job]]:
        """The jobs of points at a rung, by number, and on the first one the linear fits that they begin from."""
        begun: dict[int, Job] = {}
        for point in points:
            begun[point.number] = self._job(point, rung, (before or {}).get(point.number), begun)
        shared = [self._linear(point, rung) for point in points] if before is None else []
        return [job for job in shared if job is not None], begun

    def run_on(
        self, points: Sequence[Point], before: Mapping[int, Trial], options: Callable[[Point], Mapping[str, Any]]
    ) -> list[Trial]:
        """Train points on from where their last job has ended.

        Args:
            points: Networks that were tried.
            before: Their trials so far, by number.
            options: How each is trained on, in place of what its training has of these.

        Returns:
            A trial for each, in their order, with the time and iterations of those before.
        """
        self._progress.expect(points, [Rung(iterations=self._full, record=1.0, keep=1.0)])
        jobs = {point.number: self._job_on(point, options(point)) for point in points}
        done = self._do(jobs.values())
        self.last.update(jobs)
        trials = [_as_trial_of(done[jobs[p.number].key], p, before=before[p.number]) for p in points]
        return [one.model_copy(update={"iterations": one.iterations + before[one.number].iterations}) for one in trials]

    def is_stored_on(self, points: Sequence[Point], options: Callable[[Point], Mapping[str, Any]]) -> bool:
        """Whether all that :meth:`run_on` would do is done and on disk."""
        return all(self.store.read(self._job_on(point, options(point)).key) is not None for point in points)

    def _job_on(self, point: Point, options: Mapping[str, Any]) -> Job:
        training = {**self._training(point), **options}
        return self._keyed(
            Job(
                key="",
                number=point.number,
                structure=point.structure.to_dict(),
                training=training,
                after=self.last[point.number].key,
                cost=self.cost(point, int(training.get("max_iterations", self._full))),
            )
        )

    def _split(self, points: list[Point], found: Mapping[int, Trial], keep: float) -> tuple[list[Point], list[Point]]:
        """Those who go on and those who do not, both in the order of the grid; ties go to the earlier point."""
        if keep >= 1.0:
            return points, []
        n = max(1, math.ceil(keep * len(points)))
        ranked = sorted(points, key=lambda point: (self.rank(found[point.number]), point.number))
        chosen = {point.number for point in ranked[:n]}
        return [p for p in points if p.number in chosen], [p for p in points if p.number not in chosen]

    def rank(self, trial: Trial) -> tuple[bool, int, float]:
        """Sorting key of a trial by what chooses, best first, unusable ones last; its end is the figure."""
        choose = self.config.choose
        value = FIGURES[choose.by].of(trial, choose.on)
        left = outside(trial.selection_rms_shares, choose.tolerance)
        return not trial.usable, left, value if math.isfinite(value) else math.inf

    def _job(self, point: Point, rung: Rung, before: Job | None, begun: Mapping[int, Job]) -> Job:
        """A point's training up to a rung; smaller networks of the same rung are in ``begun`` already."""
        after, resume, done = None, False, 0
        if before is not None:
            # A state of training belongs to its records; with longer ones only the parameters go on.
            after, resume = before.key, before.record == rung.record
            done = (before.iterations or 0) if resume else 0
        elif point.number in self._smaller:
            after = begun[self._smaller[point.number].number].key
        else:
            shared = self._linear(point, rung)
            after = None if shared is None else shared.key
        return self._keyed(
            Job(
                key="",
                number=point.number,
                structure=point.structure.to_dict(),
                training=self._training(point),
                iterations=_reached(point, rung) if estimator_of(point.structure).resumes else None,
                record=rung.record,
                after=after,
                resume=resume,
                cost=self.cost(point, (rung.iterations - done) * rung.record),
            )
        )

    def _training(self, point: Point) -> dict[str, Any]:
        if estimator_of(point.structure).training is not Training and not point.training:
            return {}
        return {"seed": point.seed(self.config.seed), **point.training}

    def _linear(self, point: Point, rung: Rung) -> Job | None:
        """The linear fit that a network begins from, if this sweep begins them so."""
        if self.config.warm_start != "linear" or estimator_of(point.structure).initial is None:
            return None
        lagged = point.structure.lagged(len(self.config.mapping.inputs))
        linear = point.structure.resized(0) if lagged is not None and lagged.linear and lagged.neurons else None
        if linear is None:
            return None
        training = {**LINEAR, "seed": 0}
        return self._keyed(
            Job(key="", number=0, structure=linear.to_dict(), training=training, record=rung.record, cost=LINEAR_COST)
        )

    def cost(self, point: Point, iterations: float) -> float:
        """Work of a piece of training; between linear and quadratic in the parameters, as measured on 20,000 samples.

        Args:
            point: What is trained.
            iterations: How far.

        Returns:
            The work, in units of its own.
        """
        lagged = point.structure.lagged(len(self.config.mapping.inputs))
        if lagged is None or not estimator_of(point.structure).resumes:
            return LINEAR_COST
        return max(1.0, iterations) * (25.0 + lagged.neurons * (lagged.lags.n_regressors + 2))

    def _keyed(self, job: Job) -> Job:
        terms = {
            "shared": self._shared,
            "code": _code(job.structure, len(self.config.mapping.outputs)),
            "structure": job.structure,
            "training": job.training,
            "iterations": job.iterations,
            "record": job.record,
            "after": job.after,
            "resume": job.resume,
        }
        return replace(job, key=digest(strict(terms)), fold=self.fold)

    def _do(self, jobs: Iterable[Job]) -> dict[str, Trial]:
        """Do every job that is not stored, those that others wait for first, then the longest."""
        wanted = {job.key: job for job in jobs}
        done: dict[str, Trial] = {}
        missing: dict[str, Job] = {}
        for key, job in wanted.items():
            stored = self.store.read(key)
            if stored is None:
                missing[key] = job
            else:
                done[key] = self._note(job, stored, fresh=False)
        followers: dict[str, list[Job]] = {}
        ready: list[tuple[bool, float, int, Job]] = []
        waited_for = {job.after for job in missing.values()}
        turn = itertools.count()  # jobs of one cost are done in the order in which they became ready
        for job in missing.values():
            if job.after in missing:
                followers.setdefault(str(job.after), []).append(job)
            else:
                heapq.heappush(ready, (job.key not in waited_for, -job.cost, next(turn), job))
        busy = 0
        while ready or busy:
            if self.late():
                self.workers.give_up()
                return done | {key: self._kept(job, gave_up(job)) for key, job in missing.items() if key not in done}
            while ready and self.workers.free > 0:
                job = heapq.heappop(ready)[3]
                self.workers.submit(job, None if job.after is None else self.store.read(job.after))
                busy += 1
            for job, outcome in self.workers.finished():
                busy -= 1
                done[job.key] = self._kept(job, outcome)
                for follower in followers.pop(job.key, []):
                    heapq.heappush(ready, (follower.key not in waited_for, -follower.cost, next(turn), follower))
            self._progress.show()
        return done

    def _kept(self, job: Job, outcome: dict[str, Any]) -> Trial:
        """A new result, on disk before anybody hears of it."""
        self.store.write(outcome)
        forget_checkpoint(self.bench, job.key)
        self.clock.keep()
        return self._note(job, outcome, fresh=True)

    def _note(self, job: Job, outcome: Mapping[str, Any], *, fresh: bool) -> Trial:
        trial = as_trial(outcome)
        self._progress.done(job, trial, fresh=fresh)
        return trial


def _reached(point: Point, rung: Rung) -> int:
    """How far a point's training is by a rung: not beyond its own end."""
    return min(rung.iterations, int(point.training.get("max_iterations", rung.iterations)))


def _code(structure: Mapping[str, Any], n_outputs: int) -> str:
    """Digest of the code that a job runs: not of the estimators of other structures, or of how YAML is read."""
    choices = ("sysid.estimation.estimators:ESTIMATORS", "sysid.models.store:model_from_dict")
    configuration = ("sysid.workbench.fits.config", "sysid.workbench.fits.data", "sysid.workbench.fields")
    runs = estimator_of(structure_from_dict(structure).for_outputs(n_outputs)).runs
    return code_digest(run_job, *runs, without=(*choices, *configuration))


def as_trial(outcome: Mapping[str, Any]) -> Trial:
    """What is told of a job's result: all but the fit itself.

    Args:
        outcome: What was stored.

    Returns:
        The trial, without a place in the ranges.
    """
    kept = {name: value for name, value in outcome.items() if name not in {"fit", "checkpoint", "further"}}
    label = kept.get("label") or structure_from_dict(outcome["structure"]).label  # of results before it was stored
    # A warm start that is no point of the grid has the number 0, which no trial has.
    return Trial.model_validate({**kept, "number": max(1, kept["number"]), "label": label})


def _as_trial_of(trial: Trial, point: Point, *, before: Trial | None) -> Trial:
    """A job's result as that of its point, with the time of the jobs before it: of the rungs before."""
    added = {name: getattr(trial, name) + (getattr(before, name) if before else 0.0) for name in ("seconds", "cpu_s")}
    return trial.model_copy(update={"number": point.number, "values": dict(point.values), **added})


def _next_smaller(points: Sequence[Point]) -> dict[int, Point]:
    """For each network the largest one with fewer neurons and all else equal, by the number of its point."""
    alike: dict[str, list[Point]] = {}
    for point in points:
        family = point.structure.resized(1) if estimator_of(point.structure).initial is not None else None
        if family is not None:
            name = digest({"delays": family.to_dict(), "training": dict(point.training)})
            alike.setdefault(name, []).append(point)
    found: dict[int, Point] = {}
    for group in alike.values():
        rising = sorted(group, key=lambda point: point.structure.to_dict()["neurons"])
        found |= {larger.number: smaller for smaller, larger in itertools.pairwise(rising)}
    return found
