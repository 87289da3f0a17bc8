"""Checkpoints of a whole fit: where each of its runs of Levenberg-Marquardt stands, kept now and then, gone on from.

A fit is many runs of the engine: one step ahead first, then start after start, part after part of the iterations. All
else about it follows from these runs and is computed again in no time. So what is kept is, of each run by its name, its
last state and whether it has ended; a fit that begins again with what was kept takes the runs that ended as they are,
goes on with those that were cut off, and ends with the same parameters, to the last bit, as one that was never stopped.

Whom a fit tells of its progress also says where its checkpoints go: :class:`Watch`.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from sysid.estimation.clock import now
from sysid.estimation.least_squares.checkpoint import Checkpoint
from sysid.estimation.least_squares.evidence import Prior
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.provider import AbstractProvider
from sysid.estimation.least_squares.state import Solution, State
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.results.result import Status

EVERY_S = 30.0
"""Seconds between two writings: what a killed fit does again at most."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Run:
    """One run of the engine: where it began, where it stands, and how it ended, if it did."""

    first_loss: float
    began_s: float
    state: State
    status: Status | None = None

    def to_dict(self) -> dict[str, Any]:
        return {
            "first_loss": self.first_loss,
            "began_s": self.began_s,
            "status": None if self.status is None else self.status.name,
            "state": Checkpoint.of(self.state).fields,
        }


@dataclass(kw_only=True, eq=False)
class Checkpoints:
    """Where the runs of one fit stand.

    Args:
        kept: What an earlier session of the same fit, over the same data and with the same code, has saved.
        save: Given JSON values to be written, all that is needed to go on; ``None`` keeps nothing.
        every_s: Seconds between two savings.
    """

    kept: Mapping[str, Any] = field(default_factory=dict)
    save: Callable[[dict[str, Any]], None] | None = None
    every_s: float = EVERY_S
    _runs: dict[str, _Run] = field(default_factory=dict)
    _guard: threading.Lock = field(default_factory=threading.Lock)
    _began: float = field(default_factory=now)
    _saved: float = field(default_factory=now)

    @property
    def earlier_s(self) -> float:
        """Seconds that earlier sessions have spent on this fit."""
        return float(self.kept.get("spent_s", 0.0))

    def minimise(
        self, name: str, engine: LevenbergMarquardt, provider: AbstractProvider, theta: Any, prior: Prior
    ) -> Solution:
        """A run of the engine from a start, or from where an earlier session left it.

        Args:
            name: Of the run, different for each of the fit.
            engine: The engine.
            provider: Residuals and Jacobians.
            theta: Start, shape ``(n_parameters,)``.
            prior: Centre and precisions to begin with.

        Returns:
            The solution.
        """
        found = self._kept(name, provider, prior)
        if found is not None:
            return self._go_on(name, engine, provider, found)

        def begun(state: State) -> _Run:
            return _Run(first_loss=state.losses[0], began_s=0.0, state=state)

        return self._ended(name, self._watched(name, engine, begun).minimise(provider, theta, prior))

    def resume(self, name: str, engine: LevenbergMarquardt, provider: AbstractProvider, state: State) -> Solution:
        """A run that goes on from where another one of the same fit has ended.

        Args:
            name: Of the run, different for each of the fit.
            engine: The engine.
            provider: Residuals and Jacobians.
            state: Where that run ended.

        Returns:
            The solution.
        """
        found = self._kept(name, provider, state.prior)
        run = found or _Run(first_loss=state.at.loss, began_s=state.curve[-1].elapsed_s, state=state)
        return self._go_on(name, engine, provider, run)

    def spent_s(self, name: str) -> float:
        """Seconds that earlier sessions have spent on one run.

        Args:
            name: Of the run.

        Returns:
            The seconds; 0 of a run that has not begun.
        """
        stored = self.kept.get("runs", {}).get(name)
        return 0.0 if stored is None else float(stored["state"]["curve"][-1]["elapsed_s"]) - float(stored["began_s"])

    def flush(self) -> None:
        """Save where everything stands now."""
        if self.save is not None:
            with self._guard:
                self._write()

    def _go_on(self, name: str, engine: LevenbergMarquardt, provider: AbstractProvider, run: _Run) -> Solution:
        if run.status is not None:
            self._note(name, run)
            return Solution(state=run.state, status=run.status)
        spent_s = run.state.curve[-1].elapsed_s - run.began_s
        watched = self._watched(name, engine, lambda state: replace(run, state=state))
        solution = watched.resume(provider, run.state, first_loss=run.first_loss, spent_s=spent_s)
        return self._ended(name, solution, run)

    def _kept(self, name: str, provider: AbstractProvider, prior: Prior) -> _Run | None:
        stored = self.kept.get("runs", {}).get(name)
        if stored is None:
            return None
        with one_blas_thread():  # as the engine does: sums in another order are other sums
            state = Checkpoint(fields=stored["state"]).state(provider, prior)
        return _Run(
            first_loss=float(stored["first_loss"]),
            began_s=float(stored["began_s"]),
            state=state,
            status=None if stored["status"] is None else Status[stored["status"]],
        )

    def _watched(self, name: str, engine: LevenbergMarquardt, as_run: Callable[[State], _Run]) -> LevenbergMarquardt:
        return replace(engine, on_state=lambda state: self._note(name, as_run(state)))

    def _ended(self, name: str, solution: Solution, run: _Run | None = None) -> Solution:
        """Note that a run has ended; one that was interrupted has not."""
        if self.save is not None and solution.status is not Status.INTERRUPTED:
            last = run or self._runs[name]
            self._note(name, replace(last, state=solution.state, status=solution.status))
        return solution

    def _note(self, name: str, run: _Run) -> None:
        if self.save is None:
            return
        with self._guard:
            self._runs[name] = run
            if now() - self._saved >= self.every_s:
                self._write()

    def _write(self) -> None:
        if self.save is None:
            return
        # Runs that this session has not come to yet are as they were.
        runs = {**self.kept.get("runs", {}), **{name: run.to_dict() for name, run in self._runs.items()}}
        self.save({"spent_s": self.earlier_s + now() - self._began, "runs": runs})
        self._saved = now()


@dataclass(kw_only=True, eq=False)
class _Part(Checkpoints):
    """The checkpoints of one of several fits that are kept together: its runs under names of its own.

    Args:
        whole: Where they are kept.
        name: What its runs are called after.
    """

    whole: Checkpoints
    name: str

    @property
    def earlier_s(self) -> float:
        """Seconds that earlier sessions have spent on the runs of this fit."""
        own = [name for name in self.whole.kept.get("runs", {}) if name.startswith(self._named(""))]
        return sum(self.whole.spent_s(name) for name in own)

    def minimise(
        self, name: str, engine: LevenbergMarquardt, provider: AbstractProvider, theta: Any, prior: Prior
    ) -> Solution:
        """As the whole does, under its own name."""
        return self.whole.minimise(self._named(name), engine, provider, theta, prior)

    def resume(self, name: str, engine: LevenbergMarquardt, provider: AbstractProvider, state: State) -> Solution:
        """As the whole does, under its own name."""
        return self.whole.resume(self._named(name), engine, provider, state)

    def spent_s(self, name: str) -> float:
        """As the whole says."""
        return self.whole.spent_s(self._named(name))

    def flush(self) -> None:
        """Save where everything stands now."""
        self.whole.flush()

    def _named(self, name: str) -> str:
        return f"{self.name}: {name}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Watch:
    """Whom a fit tells of its iterations, and where its checkpoints go: passed as ``on_progress``.

    Args:
        report: Called after every iteration, from the threads that train.
        checkpoints: What it goes on from and keeps.

    Example:
        >>> Watch(report=print, checkpoints=Checkpoints())("iteration 3")
        iteration 3
    """

    report: Callable[[Any], None]
    checkpoints: Checkpoints

    def __call__(self, entry: Any) -> None:
        """Tell of an iteration."""
        self.report(entry)


def checkpoints_of(on_progress: Callable[[Any], None]) -> Checkpoints:
    """The checkpoints of whoever is told of a fit's progress.

    Args:
        on_progress: A :class:`Watch`, or any other function.

    Returns:
        Its checkpoints; such as keep nothing for any other function.
    """
    return on_progress.checkpoints if isinstance(on_progress, Watch) else Checkpoints()


def part_of(on_progress: Callable[[Any], None], name: str) -> Callable[[Any], None]:
    """Whom one of several fits tells, where all of them are kept together.

    Args:
        on_progress: Whom all of them tell: a :class:`Watch`, or any other function.
        name: What tells this fit from the others.

    Returns:
        A watch whose checkpoints are this fit's own; any other function as it is.
    """
    if not isinstance(on_progress, Watch):
        return on_progress
    return replace(on_progress, checkpoints=_Part(whole=on_progress.checkpoints, name=name))
