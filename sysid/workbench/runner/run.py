"""The runner: makes each step of a pipeline or finds it, keeps it, and tells of it; for every kind of pipeline."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel

from sysid.code_digest import code_digest
from sysid.errors import ConfigError, ParityError, SysidError
from sysid.estimation import FitProgress
from sysid.estimation.least_squares.checkpoints import Checkpoints, Watch
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.reporting.records import RunResults, write_record
from sysid.workbench.runner.environment import environment
from sysid.workbench.runner.events import Event, StepDone, StepProgress, StepStarted, Warned, Watcher
from sysid.workbench.runner.naming import nearby
from sysid.workbench.runner.steps import Done, Estimate, Outlined, Step, iteration_detail
from sysid.workbench.runner.store import RunFolder, digest

T = TypeVar("T")
R = TypeVar("R", bound=RunResults)

REPORT = Outlined(name="report", title="Writing the report", estimate=Estimate(seconds=10.0, basis="typical"))
"""The last step of most pipelines; the time is that of a page of three fits, as measured on two cores."""


@dataclass(kw_only=True, eq=False)
class Run:
    """One run of a pipeline.

    Args:
        store: The run folder.
        command: The command that makes the run again.
        fresh: Whether everything is done again, whatever is stored.
        watchers: Told of everything that happens, in order.
        run_id: Name of this run.
        environment: The machine and the packages.
        refused: Why files were not published, raised once the report is written.
    """

    store: RunFolder
    command: str
    fresh: bool = False
    watchers: tuple[Watcher, ...] = ()
    run_id: str = field(default_factory=lambda: time.strftime("%Y%m%d-%H%M%S"))
    environment: Mapping[str, Any] = field(default_factory=environment)
    refused: list[ParityError] = field(default_factory=list)

    def tell(self, event: Event) -> None:
        """Tell everybody.

        Args:
            event: What has happened.
        """
        for watch in self.watchers:
            watch(event)

    def then(self, what: Callable[[], object]) -> None:
        """Do what follows from results but gives none: tell of them, write down how far it has come.

        Args:
            what: Does it; a dry run does not.
        """
        what()

    def go_on(self) -> None:
        """Go on with work between the steps; a dry run stops where that takes too long."""

    def do(self, step: Step[T]) -> Done[T]:
        """A step's result: made, or found where an earlier run has left it.

        Args:
            step: The step.

        Returns:
            The result; on disk, if it is kept, before anybody hears of it.

        Raises:
            SysidError: What making it raises, with a note that says what was being done.
        """
        self.tell(StepStarted(step=step.title))
        done = self._done(step, step.title)
        found = done.stored or step.was_found(done.value)
        self.tell(StepDone(step=step.title, stored=found, detail=step.outcome(done.value)))
        return done

    def export(self, step: Step[T]) -> Done[T] | None:
        """The step that writes the bundle; a file that does not reproduce its model costs nobody the report.

        Args:
            step: The step.

        Returns:
            Its result; ``None`` where a file was refused, which :attr:`refused` keeps.
        """
        try:
            return self.do(step)
        except ParityError as error:
            self.refused.append(error)
            self.store.put_aside_bundle()
            self.tell(Warned(text=f"nothing is exported: {error.summary}"))
            return None

    def do_all(self, title: str, steps: Sequence[Step[T]]) -> list[Done[T]]:
        """Many small steps that are told as one.

        Args:
            title: What they are together, for people.
            steps: The steps.

        Returns:
            Their results, each on disk before the next begins.
        """
        self.tell(StepStarted(step=title))
        done: list[Done[T]] = []
        for number, step in enumerate(steps):
            detail = f"{step.title.removeprefix(title).strip()} ({number + 1} of {len(steps)})"
            self.tell(StepProgress(step=title, fraction=number / len(steps), detail=detail))
            done.append(self._done(step, title))
        stored = sum(one.stored for one in done)
        detail = f"{len(steps)} steps, {stored} of them stored"
        self.tell(StepDone(step=title, stored=stored == len(steps), detail=detail))
        return done

    def _done(self, step: Step[T], title: str) -> Done[T]:
        key = step.key() if step.key else ""
        final = all(one.final for one in step.takes)
        stored = self.is_stored(step, key)
        if stored and step.read is not None:
            value = step.read(self.store.facts(step.name))
        else:
            value = self._made(step, key, title, final=final)
        final = final and step.final(value)
        return Done(step=step, get=lambda: value, find_key=lambda: key, stored=stored, final=final)

    def is_stored(self, step: Step[Any], key: str) -> bool:
        """Whether an earlier run's result is taken for a step.

        Args:
            step: The step.
            key: Digest of all that it depends on.

        Returns:
            Whether it need not be made.
        """
        return step.may_be_found() and bool(key) and not self.fresh and self.store.is_done(step.name, key)

    def _made(self, step: Step[T], key: str, title: str, *, final: bool) -> T:
        work = _Working(run=self, step=step, key=key, title=title)
        began = time.perf_counter()
        try:
            with one_blas_thread():
                value = step.make(work)
        except SysidError as error:
            if key:
                error.add_note(f"{step.title[0].lower()}{step.title[1:]}")
            raise
        finally:
            work.flush()
        seconds = work.earlier_s + time.perf_counter() - began
        files = list(step.write(value))
        if final and step.final(value):
            if key:
                self.store.mark_done(step.name, key, files, **step.facts(value))
            self.store.keep_time(step.timed_as or step.name, seconds, amount=step.amount())
            self.store.drop_checkpoint(step.name)
        return value

    def results(self, new: R) -> R:
        """Write the results of a run, unless nothing is new: what was made then keeps its date.

        Args:
            new: The results.

        Returns:
            What lies in the run folder now.
        """
        before = self._stored_results()
        if isinstance(before, type(new)) and undated(before) == undated(new):
            return before
        self._write_results(new)
        return new

    def _write_results(self, new: RunResults) -> None:
        write_record(self.store.results, new)

    def _stored_results(self) -> RunResults | None:
        from sysid.reporting.kinds import read_run

        try:
            return read_run(self.store.path)
        except ConfigError:
            # None yet, damaged, or of another release: written anew.
            return None

    def report(self, results: BaseModel) -> Done[Path]:
        """Write the page of the results, or find it.

        Args:
            results: The contents of ``results.json``.

        Returns:
            The page.
        """

        def make(_: object) -> Path:
            from sysid.reporting import report

            return report.write_report(self.store.path)

        # As text: an infinity that was never written differs, as a number, from the nothing that is read back.
        code = code_digest("sysid.reporting.report:write_report", files=("sysid/reporting/templates",))
        terms = {"results": results.model_dump_json(), "code": code}
        return self.do(
            Step(
                name=REPORT.name,
                title=REPORT.title,
                key=lambda: digest(terms),
                make=make,
                write=lambda page: [page],
                read=lambda _: self.store.path / "report" / "index.html",
                outcome=lambda page: str(nearby(page)),
                typical=REPORT.estimate,
            )
        )


def undated(results: BaseModel) -> str:
    """Results without their date; as text, because NaN differs from itself as a number."""
    return results.model_copy(update={"created": ""}).model_dump_json()


@dataclass(kw_only=True, eq=False)
class _Working:
    """A step that is being made: what it tells, and where its fits stand."""

    run: Run
    step: Step[Any]
    key: str
    title: str
    checkpoints: Checkpoints | None = None
    unkept: bool = False
    share: float = 0.0
    guard: threading.Lock = field(default_factory=threading.Lock)
    began: float = field(default_factory=time.perf_counter)

    @property
    def earlier_s(self) -> float:
        """Seconds that earlier runs have spent on this very step."""
        return self.checkpoints.earlier_s if self.checkpoints else 0.0

    def say(self, detail: str, fraction: float | None = None) -> None:
        """Tell how it goes."""
        self.run.tell(StepProgress(step=self.title, fraction=fraction, detail=detail))

    def watch(self, limit_s: float = float("inf")) -> Watch:
        """Whom an estimator tells of its iterations, from several threads."""
        store, name = self.run.store, self.step.name
        kept = {} if self.run.fresh or not self.key else store.checkpoint(name, self.key)

        def save(values: dict[str, Any]) -> None:
            try:
                store.keep_checkpoint(name, self.key, values)
            except OSError as error:
                # What cannot be kept costs nobody the fit; that a disk is full is said where a result is written.
                if not self.unkept:
                    self.run.tell(Warned(text=f"where the fit stands is not kept ({error})"))
                self.unkept = True

        self.checkpoints = Checkpoints(kept=kept, save=save if self.key else None)

        def report(entry: FitProgress) -> None:
            spent = (self.earlier_s + time.perf_counter() - self.began) / limit_s
            with self.guard:
                # Starts are told about in any order, and some begin again: the share never falls.
                self.share = min(max(self.share, entry.fraction, spent), 1.0)
                self.say(iteration_detail(entry), self.share)

        return Watch(report=report, checkpoints=self.checkpoints)

    def flush(self) -> None:
        """Save where the fits stand, however the step ends."""
        if self.checkpoints is not None:
            self.checkpoints.flush()
