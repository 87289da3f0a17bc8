"""A dry run: the steps of a pipeline as far as they are known, which of them are stored, and how long the others take.

Nothing is run and nothing is written. A step that is stored is read, so that what follows from it is known too; how
long another one takes is known from the last time that it was done, or is found out in seconds, or is not known, which
is then said.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, NoReturn, TypeVar

from sysid.compilation import compiled_s
from sysid.estimation.least_squares.checkpoints import Checkpoints, Watch
from sysid.reporting.records import RunResults
from sysid.workbench.runner.events import Event
from sysid.workbench.runner.run import Run
from sysid.workbench.runner.steps import Done, Estimate, NotKnownError, Outlined, Step

T = TypeVar("T")

PATIENCE_S = 20.0
"""Seconds after which a dry run times no further steps: it shall answer while one waits.

Of the processor, so that what is told does not hang on what else the machine does, and without what is compiled: that
is kept, and had taken all of them after an installation.
"""


def worked_s() -> float:
    """What this process has worked but for compiling, in seconds of the processor."""
    return time.process_time() - compiled_s()


@dataclass(frozen=True, kw_only=True)
class PlannedStep:
    """One step of a run to come.

    Args:
        name: Of the step.
        step: What is done.
        stored: Whether an earlier run's result will be taken.
        seconds: How long it will take at most; 0 where it is stored, ``None`` where nothing is known.
        basis: Where that comes from.
    """

    name: str
    step: str
    stored: bool
    seconds: float | None
    basis: str


@dataclass(kw_only=True, eq=False)
class DryRun(Run):
    """Goes through the steps of a pipeline as a run does, and does none of them.

    Args:
        loads: Whether data are loaded even if their traces have to be made first; nothing is timed then.
        planned: The steps that were come to, by name.
        seen: The same with their results, by name.
    """

    loads: bool = False
    planned: dict[str, PlannedStep] = field(default_factory=dict)
    seen: dict[str, Done[Any]] = field(default_factory=dict)
    began: float = field(default_factory=worked_s)

    def tell(self, event: Event) -> None:
        """There is nobody to tell."""

    def then(self, what: Callable[[], object]) -> None:
        """Nothing follows."""

    def go_on(self) -> None:
        """Go on, as long as somebody waits.

        Raises:
            NotKnownError: If it has taken too long.
        """
        if worked_s() - self.began > PATIENCE_S:
            raise NotKnownError("work between the steps")

    def do(self, step: Step[T]) -> Done[T]:
        """Look at a step; what is neither stored nor at hand raises :class:`NotKnownError` when it is asked for."""
        done = self._looked_at(step)
        self.seen[step.name] = done
        return done

    def _looked_at(self, step: Step[T]) -> Done[T]:
        def find_key() -> str:
            return step.key() if step.key else ""

        def unknown() -> NoReturn:
            raise NotKnownError(step.name)

        key = ""
        with contextlib.suppress(NotKnownError):
            key = find_key()
        read = step.read
        if read is not None and self.is_stored(step, key):
            self._plan(step, stored=True, estimate=Estimate(seconds=0.0, basis="stored"))
            return Done(
                step=step, get=lambda: read(self.store.facts(step.name)), find_key=find_key, stored=True, final=True
            )
        made = self._found(step) or self._at_hand(step)
        if made is not None:
            return made
        self._plan(step, stored=False, estimate=self._estimate(step, key))
        return Done(step=step, get=unknown, find_key=find_key, stored=False)

    def do_all(self, title: str, steps: Sequence[Step[T]]) -> list[Done[T]]:
        """Look at many small steps, which are told as one; see the base class."""
        before = dict(self.planned)
        done = [self.do(step) for step in steps]
        each = [one for name, one in self.planned.items() if name not in before]
        left = [one for one in each if not one.stored]
        known = [one.seconds for one in left if one.seconds is not None]
        basis = f"{len(each)} steps, {len(each) - len(left)} of them stored"
        if len(known) < len(left):
            basis += f"; of {len(left) - len(known)} it is not known before they are run"
        self.planned = before | {
            title: PlannedStep(
                name=title,
                step=title,
                stored=not left,
                seconds=sum(known) if known or not left else None,
                basis=basis if left else "stored",
            )
        }
        return done

    def _found(self, step: Step[T]) -> Done[T] | None:
        """The result of a step that keeps it by itself."""
        if step.peek is None or self.fresh:
            return None
        try:
            value = step.peek()
        except NotKnownError:
            return None
        self._plan(step, stored=True, estimate=Estimate(seconds=0.0, basis="stored"))
        return Done(step=step, get=lambda: value, find_key=lambda: "", stored=True)

    def _at_hand(self, step: Step[T]) -> Done[T] | None:
        """The result of a step that takes no time to speak of."""
        try:
            if step.at_hand is None or not (self.loads or step.at_hand()):
                return None
            began = time.perf_counter()
            value = step.make(_Silent())
        except NotKnownError:
            return None
        said = step.outcome(value)
        basis = f"measured now: {said}" if said else "measured now"
        self._plan(step, stored=False, estimate=Estimate(seconds=time.perf_counter() - began, basis=basis))
        return Done(step=step, get=lambda: value, find_key=lambda: "", stored=False)

    def _estimate(self, step: Step[Any], key: str) -> Estimate:
        try:
            seconds = self.store.last_time(step.timed_as or step.name, amount=step.amount())
            if seconds is not None:
                found = Estimate(seconds=seconds, basis="as last time")
            elif step.how_long and not self.loads and worked_s() - self.began <= PATIENCE_S:
                found = step.how_long()
            else:
                return step.typical
        except NotKnownError:
            return step.typical
        kept = self.store.checkpoint(step.name, key) if key and not self.fresh else {}
        if kept and found.seconds is not None:
            left = max(found.seconds - float(kept["spent_s"]), 0.0)
            return Estimate(seconds=left, basis=f"{found.basis}; it goes on where it was cut off")
        return found

    def _plan(self, step: Step[Any], *, stored: bool, estimate: Estimate) -> None:
        self.planned[step.name] = PlannedStep(
            name=step.name, step=step.title, stored=stored, seconds=estimate.seconds, basis=estimate.basis
        )

    def _write_results(self, new: RunResults) -> None:
        """Nothing is written."""

    def with_outline(self, outline: Sequence[Outlined]) -> tuple[PlannedStep, ...]:
        """All steps: those that were come to, and those that come after them for certain.

        Args:
            outline: All steps that are known beforehand, in order.

        Returns:
            The steps in the order of the run.
        """
        left = [one for one in outline if one.name not in self.planned]
        return (*self.planned.values(), *(self._outlined(one) for one in left))

    def _outlined(self, one: Outlined) -> PlannedStep:
        seconds = self.store.last_time(one.name)
        if seconds is not None:
            found = Estimate(seconds=seconds, basis="as last time")
        else:
            found = one.how_long() if one.how_long is not None and not self.loads else one.estimate
        return PlannedStep(name=one.name, step=one.title, stored=False, seconds=found.seconds, basis=found.basis)


class _Silent:
    """A step that a dry run makes says nothing."""

    def say(self, detail: str, fraction: float | None = None) -> None:
        """Nobody listens."""

    def watch(self, limit_s: float = float("inf")) -> Watch:  # noqa: ARG002 - as every Work
        """Nobody listens, and nothing is kept."""
        return Watch(report=lambda _: None, checkpoints=Checkpoints())


def together(planned: Sequence[PlannedStep]) -> Estimate:
    """How long all steps take.

    Args:
        planned: The steps.

    Returns:
        The sum of what is known; its basis says how many are not in it.
    """
    unknown = sum(one.seconds is None for one in planned)
    seconds = sum(one.seconds for one in planned if one.seconds is not None)
    steps = "one step" if unknown == 1 else f"{unknown} steps"
    return Estimate(seconds=seconds, basis=f"{steps} whose time is not known" if unknown else "")
