"""What the steps of a run have in common: where it stores, whom it tells, what it loads and fits."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from sysid.code_digest import code_digest
from sysid.composite.keeper import Decision, Fit, Sample, Task
from sysid.errors import ConfigError
from sysid.estimation import CascadeFit, FitResult
from sysid.models import Cascade
from sysid.names import slug, task_slug
from sysid.traces import Trace, TraceSet
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.exporting import export_model
from sysid.workbench.assembly.extending import Joined
from sysid.workbench.assembly.stage_config import ActiveLearningConfig
from sysid.workbench.experiments.data import ExperimentData
from sysid.workbench.fits.data import estimate_of, load_named, unmade_data
from sysid.workbench.fits.estimates import network_time
from sysid.workbench.fits.record import is_final, read_fit, write_fit
from sysid.workbench.fits.steps import STORED_BY
from sysid.workbench.kinds import data_of_pipeline
from sysid.workbench.runner import events
from sysid.workbench.runner.run import Run
from sysid.workbench.runner.steps import NOT_KNOWN, Done, Estimate, Outlined, Step, Work
from sysid.workbench.runner.store import RunFolder, digest, read_json, strict, write_json

if TYPE_CHECKING:
    from sysid.export import Bundle

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True, eq=False)
class Context:
    """One run.

    Args:
        config: The pipeline.
        joined: Its YAML, with what that extends.
        beside: Folder of the YAML, where data sets are looked for first.
        run: Does the steps.
        digests: SHA-256 of every data set that was read, by name.
        cases: The cases that are scored, once they are loaded.
        seed: With which the whole is trained once more; ``None`` the first time.
    """

    config: AssemblyConfig
    joined: Joined
    beside: Path
    run: Run
    digests: dict[str, str] = field(default_factory=dict)
    cases: list[TraceSet] = field(default_factory=list)
    seed: int | None = None

    def seeded(self, seed: int) -> Context:
        """The same run, in which what is trained with another seed is kept apart.

        Args:
            seed: The seed.

        Returns:
            The run.
        """
        return replace(self, config=self.config.seeded(seed), seed=seed)

    @property
    def store(self) -> RunFolder:
        """The run folder."""
        return self.run.store

    def load(self, name: str) -> TraceSet:
        """Load a data set.

        Args:
            name: Its name, or its folder beside the pipeline.

        Returns:
            Its traces.
        """
        loaded = self.run.do(self._loading(name)).value
        self.digests[loaded.name] = loaded.digest
        return loaded

    def _loading(self, name: str) -> Step[TraceSet]:
        def make(work: Work) -> TraceSet:
            return load_named(
                name,
                self.beside,
                progress=lambda case, index, count: work.say(f"{case} ({index + 1} of {count})", index / count),
            )

        return Step(
            name=f"data-{slug(name)}",
            title=f"Loading {name}",
            make=make,
            outcome=lambda loaded: f"{len(loaded)} traces",
            at_hand=lambda: unmade_data([name], beside=self.beside) is None,
            how_long=lambda: unmade_data([name], beside=self.beside) or NOT_KNOWN,
        )

    def new_runs(self, asked: ActiveLearningConfig, number: int) -> list[Trace]:
        """Ask the reference behind active learning for new experiments.

        Args:
            asked: The active learning, with ``candidates``.
            number: Of the round that looks at them; 0 for those that are held out of all.

        Returns:
            Their records; what has been run is found.
        """
        source, found_out = _new_runs_of(asked, self.beside), new_runs_outlined(asked, number, self.beside)
        count = asked.candidates if number else asked.held_out

        def make(work: Work) -> list[Trace]:
            return source.new(
                number, count or 0, duration=asked.duration,
                progress=lambda case, done, of: work.say(f"{case} ({done} of {of})", done / of),
            )  # fmt: skip

        return self.run.do(
            Step(
                name=found_out.name,
                title=found_out.title,
                make=make,
                outcome=lambda traces: f"{len(traces)} traces",
                at_hand=lambda: source.unmade_new(number, count or 0, duration=asked.duration) is None,
                how_long=found_out.how_long,
            )
        ).value

    def keep(self, task: Task[Fit]) -> Fit:
        """The result of a task of the training, stored under what it depends on.

        Args:
            task: The task.

        Returns:
            What it comes to.
        """
        (found,) = self.keep_all([task])
        return found

    def keep_all(self, tasks: Sequence[Task[Fit]]) -> list[Fit]:
        """The results of tasks that do not depend on each other.

        Args:
            tasks: The tasks.

        Returns:
            What they come to, each stored before the next begins.
        """
        done = [self._kept(task) for task in tasks]
        return [one.value for one in done]

    def _kept(self, task: Task[Fit]) -> Done[Fit]:
        key, form, of_seed = _key(task.runs, task.terms), _FORMS[task.kind], OfSeed(self.seed)
        name = of_seed.name(task_slug(task.name))
        stamp, place = form.stamp.format(name=name), self.store.path / form.place.format(name=name)
        done = self.run.do(
            Step(
                name=stamp,
                title=of_seed.title(task.title),
                make=lambda work: task.make(work.watch(task.limit_s)),
                key=lambda: key,
                write=lambda fit: form.write(place, fit),
                read=lambda _: task.put(form.read(place)),
                outcome=lambda fit: f"{fit.train_time_s:.1f} s, {fit.status.value}",
                final=is_final,
                amount=lambda: task.amount,
                how_long=lambda: _how_long(task.sample),
                called=of_seed.title(task.name),
                export=self.export,
            )
        )

        def renew() -> None:
            # The file has the whole as it now stands, whatever else of it has changed since the round was trained.
            if done.stored and form.read(place).model.to_dict() != done.value.model.to_dict():
                self.store.mark_done(stamp, key, form.write(place, done.value))

        self.run.then(renew)
        return done

    def export(self, found: FitResult | CascadeFit | Cascade, folder: Path, provenance: dict[str, Any]) -> Bundle:
        """Write what came of a step as a bundle.

        Args:
            found: A member's fit, or a whole.
            folder: Where the bundle goes.
            provenance: What it says of where it is from.

        Returns:
            The bundle.
        """
        return export_model(self.config, self.cases[0], found, folder, provenance)

    def decide(self, decision: Decision) -> dict[str, Any]:
        """What a decision of the training comes to, stored under what it depends on.

        Args:
            decision: The decision.

        Returns:
            JSON values.
        """
        key, of_seed = _key(decision.runs, decision.terms), OfSeed(self.seed)
        name = of_seed.name(slug(decision.name))
        file = self.store.path / "steps" / f"{name}.json"

        def write(values: dict[str, Any]) -> list[Path]:
            write_json(file, values)
            return [file]

        return self.run.do(
            Step(
                name=name,
                title=of_seed.title(decision.title),
                make=lambda work: dict(json.loads(json.dumps(strict(decision.make(work.say))))),
                key=lambda: key,
                write=write,
                read=lambda _: dict(read_json(file)),
                outcome=decision.outcome,
            )
        ).value

    def say(self, title: str, detail: str = "", *, done: bool = False) -> None:
        """Tell of work of the training whose result is not stored.

        Args:
            title: The work.
            detail: How it goes.
            done: Whether it has ended.
        """
        self.run.go_on()
        if done:
            self.run.tell(events.StepDone(step=title, stored=False, detail=detail))
        elif detail:
            self.run.tell(events.StepProgress(step=title, fraction=None, detail=detail))
        else:
            self.run.tell(events.StepStarted(step=title))

    def compute(
        self,
        step: Outlined,
        make: Callable[[Work], T],
        *,
        outcome: Callable[[T], str] = lambda _: "",
    ) -> T:
        """Something that is done every time.

        Args:
            step: Its name and title.
            make: Does it.
            outcome: How it came out, in words.

        Returns:
            What came of it.
        """
        return self.run.do(Step(name=step.name, title=step.title, make=make, outcome=outcome)).value


@dataclass(frozen=True)
class OfSeed:
    """What is trained once more with another seed is called by it.

    Args:
        seed: The seed; ``None`` for what is trained the first time.
    """

    seed: int | None

    def name(self, name: str) -> str:
        """Of a step and its files."""
        return name if self.seed is None else f"{name}-seed-{self.seed}"

    def title(self, title: str) -> str:
        """As people read it."""
        return title if self.seed is None or not title else f"{title}, seed {self.seed}"


def _new_runs_of(asked: ActiveLearningConfig, beside: Path) -> ExperimentData:
    """The experiments whose reference active learning asks for new runs, seen from the folder of the pipeline."""
    source = data_of_pipeline(beside / asked.data)
    if not isinstance(source, ExperimentData):
        raise ConfigError(
            "only a pipeline of kind experiment can be asked for new runs", where="active_learning, data",
            expected="its file, seen from the folder of the pipeline", got=asked.data,
            remedy="name one, or leave candidates and held_out out: a data set has its pool",
        )  # fmt: skip
    return source


def new_runs_outlined(asked: ActiveLearningConfig, number: int, beside: Path) -> Outlined:
    """The step that asks for new runs, before it is come to.

    Args:
        asked: The active learning.
        number: Of the round; 0 for those that are held out.
        beside: Folder of the pipeline.

    Returns:
        Its name, its title and how long it takes.
    """
    count = (asked.candidates if number else asked.held_out) or 0

    def how_long() -> Estimate:
        unmade = _new_runs_of(asked, beside).unmade_new(number, count, duration=asked.duration)
        return estimate_of([] if unmade is None else [unmade]) or Estimate(seconds=1.0, basis="they have been run")

    title = f"Running {count} new experiments" + (f" for round {number}" if number else ", which train nothing")
    return Outlined(name=f"new-runs-{number}", title=title, how_long=how_long)


def _how_long(sample: Sample | None) -> Estimate:
    return NOT_KNOWN if sample is None else network_time(sample.training, sample.fit, share=sample.share)


def _key(runs: Iterable[Callable[..., Any] | str], terms: Mapping[str, Any]) -> str:
    """Digest of what a result depends on; what the YAML asks for is not code, and is among the terms."""
    code = code_digest(*runs, STORED_BY, without=("sysid.workbench",))
    return digest(strict({"code": code, "terms": dict(terms)}))


@dataclass(frozen=True)
class _Form:
    """How a kind of result is stored: what its stamp is called, where it lies, how it is written and read."""

    stamp: str
    place: str
    write: Callable[[Path, Any], list[Path]]
    read: Callable[[Path], Any]


def _write_round(file: Path, fit: CascadeFit) -> list[Path]:
    write_json(file, fit.to_dict())
    return [file]


def _read_round(file: Path) -> CascadeFit:
    return CascadeFit.from_dict(read_json(file))


_FORMS: dict[type, _Form] = {
    FitResult: _Form("fit-{name}", "fits/{name}", write_fit, read_fit),
    CascadeFit: _Form("{name}", "{name}.json", _write_round, _read_round),
}
