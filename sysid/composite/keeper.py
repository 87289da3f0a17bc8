"""Where the results of a long training are kept: a seam, so that the training knows no folder, screen or tracker."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from sysid.estimation import CascadeFit, FitProgress, FitResult, Training

Report = Callable[[FitProgress], None]
"""Told after every iteration of a training."""

Fit = TypeVar("Fit", FitResult, CascadeFit)


@dataclass(frozen=True, kw_only=True)
class Sample:
    """A piece of a training that can be timed.

    Args:
        training: Of the whole.
        fit: Fits with other options on a part of the samples; given whom to tell after every iteration.
        share: That part.
    """

    training: Training
    fit: Callable[[Training, Report], FitResult]
    share: float


@dataclass(frozen=True, kw_only=True)
class Task(Generic[Fit]):
    """One fit that is to be had, made or found.

    Args:
        name: What it is stored as, different for every task of a training.
        title: What it is for people.
        terms: JSON values of all that its result depends on, beside the code.
        runs: Functions and classes whose code it runs, or their addresses (``module:name``).
        make: Does it; given whom to tell after every iteration.
        kind: What comes of it, for who reads it back.
        put: What a stored result comes to here: the same part of a whole may stand in another whole now.
        limit_s: Seconds after which it ends in any case.
        amount: JSON values that say how much work it is, for who tells how long it will take.
        sample: A small piece of the same work, for the same purpose.
    """

    name: str
    title: str
    terms: Mapping[str, Any]
    runs: tuple[Callable[..., Any] | str, ...]
    make: Callable[[Report], Fit]
    kind: type[Fit]
    put: Callable[[Fit], Fit] = lambda fit: fit
    limit_s: float = float("inf")
    amount: Any = None
    sample: Sample | None = None


@dataclass(frozen=True, kw_only=True)
class Decision:
    """Something small that takes a while to find out, and is kept as well.

    Args:
        name: What it is stored as.
        title: What it is for people.
        terms: JSON values of all that it depends on, beside the code.
        runs: Functions and classes whose code it runs, or their addresses.
        make: Finds out; given whom to tell how it goes. Gives JSON values.
        outcome: How it came out, in words.
    """

    name: str
    title: str
    terms: Mapping[str, Any]
    runs: tuple[Callable[..., Any] | str, ...]
    make: Callable[[Callable[[str], None]], dict[str, Any]]
    outcome: Callable[[dict[str, Any]], str]


class Keeper(Protocol):
    """Gives the result of each task, stored or made now, and hears what is done beside."""

    def keep(self, task: Task[Fit]) -> Fit:
        """The result of a task.

        Args:
            task: The task.

        Returns:
            What its ``make`` gives, or gave when the terms were the same.
        """

    def keep_all(self, tasks: Sequence[Task[Fit]]) -> list[Fit]:
        """The results of tasks that do not depend on each other.

        Args:
            tasks: The tasks.

        Returns:
            What :meth:`keep` gives for each.
        """

    def decide(self, decision: Decision) -> dict[str, Any]:
        """What a decision comes to.

        Args:
            decision: The decision.

        Returns:
            What its ``make`` gives, or gave when the terms were the same.
        """

    def say(self, title: str, detail: str = "", *, done: bool = False) -> None:
        """Hear of work whose result is not kept.

        Args:
            title: The work.
            detail: How it goes.
            done: Whether it has ended.
        """


class MakeAll:
    """A keeper that keeps nothing: every task is made.

    Args:
        on_progress: Told after every iteration of every training.
    """

    def __init__(self, on_progress: Report = lambda _: None) -> None:
        self.on_progress = on_progress

    def keep(self, task: Task[Fit]) -> Fit:
        """Make it."""
        return task.make(self.on_progress)

    def keep_all(self, tasks: Sequence[Task[Fit]]) -> list[Fit]:
        """Make each."""
        return [self.keep(task) for task in tasks]

    def decide(self, decision: Decision) -> dict[str, Any]:
        """Find out."""
        return decision.make(lambda _: None)

    def say(self, title: str, detail: str = "", *, done: bool = False) -> None:
        """Say nothing."""
