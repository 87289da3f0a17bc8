"""A step of a pipeline: what it depends on, how its result is made, written and read again, and how long that takes.

Pipelines of every kind are made of such steps and give them, one after the other, to a :class:`Run
<sysid.workbench.runner.run.Run>`, which makes a result or finds it, or to a :class:`DryRun
<sysid.workbench.runner.dry_run.DryRun>`, which only says what would be done.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from sysid.estimation import FitProgress
from sysid.estimation.least_squares.checkpoints import Watch

if TYPE_CHECKING:
    from sysid.export import Bundle

T = TypeVar("T")


class NotKnownError(Exception):
    """A dry run was asked for what only a run finds out; nobody but the runner sees it."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """How long a step will take.

    Args:
        seconds: At most; ``None`` where nothing is known.
        basis: Where that comes from, for people.
    """

    seconds: float | None
    basis: str


NOT_KNOWN = Estimate(seconds=None, basis="not known before it is run")


class Work(Protocol):
    """What a step is given while it is made."""

    def say(self, detail: str, fraction: float | None = None) -> None:
        """Tell how it goes.

        Args:
            detail: How it stands, in words.
            fraction: Share that is done, 0 to 1, where that is known.
        """

    def watch(self, limit_s: float = float("inf")) -> Watch:
        """Whom an estimator tells of its iterations; keeps where the fit stands, so that it goes on if it is cut off.

        Args:
            limit_s: Seconds after which the fit ends in any case.
        """


def _nothing_written(_: Any) -> Sequence[Path]:
    return ()


@dataclass(frozen=True, kw_only=True, eq=False)
class Step(Generic[T]):
    """One step.

    Args:
        name: On disk; different for each step of a pipeline.
        title: For people.
        make: Gives the result.
        key: Digest of everything that the result depends on, the code among it; ``None`` for what is done every time.
        after: Steps whose results it takes: what comes of one that did not run to its end is not kept either.
        of: The step whose result this one is about, such as figures of a fit: made again whenever that is.
        write: Writes a result, and gives the files.
        read: Reads it again; given what ``facts`` said.
        facts: JSON values to keep of a result beside its files.
        outcome: How it came out, in words.
        final: Whether a result is what it should be; one that is not (an interrupted fit) is used now and made again.
        amount: JSON values that say how much work it is: the last time tells how long it takes if they are the same.
        how_long: Finds out, in seconds and without writing anything, where there was no last time.
        typical: How long it takes where that cannot be found out.
        timed_as: Name under which its time is kept; its own by default.
        was_found: Whether a result was found, for a step that keeps what it does by itself.
        at_hand: Whether making it takes no time to speak of, so that a dry run does; not where it is not given.
        peek: Looks for a result that the step keeps by itself; raises :class:`NotKnownError` if it is not all there.
        called: Name by which people ask for the model that comes of it; empty where none does.
        export: Writes that model as a bundle; given the result, the folder, and what it says of where it is from.
    """

    name: str
    title: str
    make: Callable[[Work], T]
    key: Callable[[], str] | None = None
    after: Sequence[Done[Any]] = ()
    of: Done[Any] | None = None
    write: Callable[[T], Sequence[Path]] = _nothing_written
    read: Callable[[Mapping[str, Any]], T] | None = None
    facts: Callable[[T], Mapping[str, Any]] = lambda _: {}
    outcome: Callable[[T], str] = lambda _: ""
    final: Callable[[T], bool] = lambda _: True
    amount: Callable[[], Any] = lambda: None
    how_long: Callable[[], Estimate] | None = None
    typical: Estimate = NOT_KNOWN
    timed_as: str = ""
    was_found: Callable[[T], bool] = lambda _: False
    at_hand: Callable[[], bool] | None = None
    peek: Callable[[], T] | None = None
    called: str = ""
    export: Callable[[T, Path, dict[str, Any]], Bundle] | None = None

    @property
    def takes(self) -> tuple[Done[Any], ...]:
        """All steps whose results it takes."""
        return (*self.after, *([self.of] if self.of else []))

    def may_be_found(self) -> bool:
        """Whether an earlier run's result can stand for it."""
        return self.key is not None and self.read is not None and (self.of is None or self.of.stored)


@dataclass(frozen=True, kw_only=True, eq=False)
class Done(Generic[T]):
    """A step that is done, or, in a dry run, has been looked at.

    Args:
        step: The step.
        get: Gives the result.
        find_key: Gives the digest of what it depends on; empty for what is done every time.
        stored: Whether an earlier run's result was taken.
        final: Whether it and all that it took ran to their end.
    """

    step: Step[T]
    get: Callable[[], T]
    find_key: Callable[[], str]
    stored: bool
    final: bool = True

    @property
    def value(self) -> T:
        """The result.

        Raises:
            NotKnownError: In a dry run, where it has yet to be made.
        """
        return self.get()

    @property
    def key(self) -> str:
        """Digest of what it depends on.

        Raises:
            NotKnownError: In a dry run, where that follows from what has yet to be made.
        """
        return self.find_key()


@dataclass(frozen=True, kw_only=True)
class Outlined:
    """A step that comes for certain, before it is known what it will work on.

    Args:
        name: Of the step.
        title: For people.
        estimate: How long it takes where there was no last time.
        called: Name by which people ask for the model that comes of it.
        how_long: Finds out how long, where there was no last time and no estimate.
    """

    name: str
    title: str
    estimate: Estimate = field(default=NOT_KNOWN)
    called: str = ""
    how_long: Callable[[], Estimate] | None = None


def iteration_detail(entry: FitProgress) -> str:
    """Where a fit stands, in words.

    Args:
        entry: What the estimator tells.

    Returns:
        For example ``"start 2 of 6, free run, iteration 12, mse 0.031"``.
    """
    start = f"start {entry.start} of {entry.starts}, " if entry.starts > 1 else ""
    return f"{start}{entry.stage}, iteration {entry.iteration}, mse {entry.mse:.3g}"
