"""Random starts of one network: what they have in common, and what each is where it was looked at.

How each begins, is trained and is judged: :mod:`sysid.estimation.networks.starts.advancing`.

A free-run fit has many local minima. Starts of equal error on the estimation record can differ by orders of magnitude
on the next one, so that how one chooses matters as much as how one trains. The starts run side by side for a part of
the iterations, and the better half goes on (:mod:`sysid.estimation.networks.starts.race`); every state at which a
start was looked at stays a candidate, which makes the choice an early stopping too. What chooses is the selection
traces: they train nothing, and no score on them is published as one on unseen data.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError
from sysid.estimation.clock import now
from sysid.estimation.least_squares.checkpoint import Checkpoint
from sysid.estimation.least_squares.checkpoints import Checkpoints, checkpoints_of
from sysid.estimation.least_squares.damping import DAMPINGS
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.provider import AbstractProvider
from sysid.estimation.least_squares.state import Iteration, Solution
from sysid.estimation.least_squares.termination import Termination
from sysid.estimation.networks.initialise import AbstractLayout
from sysid.estimation.networks.pretraining import StepSamples
from sysid.estimation.networks.starts.halving import planned_iterations
from sysid.estimation.networks.training import FitProgress, Training
from sysid.estimation.results.result import Loop
from sysid.models import (
    EquationModel,
    NARXModel,
    NeuralStateSpaceModel,
    Start,
    VectorNARXModel,
    VectorNeuralStateSpaceModel,
)
from sysid.traces import Trace

SETTLED = 5
"""Iterations after which a candidate with other weights of its residuals is near a minimum again."""

INITIAL_ALPHA = 1e-2
"""Precision of the weights before the evidence has spoken: weak, but enough to keep the first steps of an
underdetermined network small."""


SHORT = 20.0
"""Samples per parameter below which a record is fitted once more, cautiously: of residuals that persist over more than
five samples the evidence otherwise makes more than they say."""


class Place(IntEnum):
    """Where a candidate stands if no selection traces choose."""

    FIRST = 0
    BY_EVIDENCE = 1
    LAST = 2


Network: TypeAlias = NARXModel | VectorNARXModel | NeuralStateSpaceModel | VectorNeuralStateSpaceModel | EquationModel
"""What is trained here."""


Prepared = Callable[["Multistart", int, NDArray[np.float64]], NDArray[np.float64]]
"""From where a start is drawn to where its training begins, by its number."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Multistart:
    """Everything that the starts of one fit have in common.

    Args:
        training: How to train.
        layout: Where the parameters stand.
        provider: Residuals and Jacobians, in the basis of training.
        to_plain: From the parameters that are trained to the model's, shape ``(n_model, n_trained)``: a change of
            basis, or what leaves out what belongs to the records.
        template: The model to fill with parameters.
        selection: Traces that choose.
        start: How a free run begins.
        initial: Plain parameters of the first start; ``None`` for a random one.
        on_progress: Called after every iteration, from the threads that train.
        resume: Where the first start was put aside; ``None`` to begin it.
        pretraining: Where a random start is drawn and trained one step ahead before anything else; ``None`` for none.
        until: When the fit has to have ended, on the clock of ``sysid.estimation.clock.now``; infinity for no limit.
    """

    training: Training
    layout: AbstractLayout
    provider: AbstractProvider
    to_plain: NDArray[np.float64]
    template: Network
    selection: Sequence[Trace]
    start: Start
    initial: NDArray[np.float64] | None
    on_progress: Callable[[FitProgress], None]
    resume: Checkpoint | None = None
    pretraining: StepSamples | None = None
    learnt: Callable[[NDArray[np.float64]], NDArray[np.float64]] = lambda theta: theta
    """From trained parameters to the same with those that no residual reads, such as a map to a state."""
    until: float = math.inf
    alone: int = 0
    """First starts that are looked at one after another before the others begin."""
    enough: Callable[[Candidate], bool] = lambda _: False
    """Whether one of them is so good that the others need not begin."""
    prepared: Prepared = lambda _, __, theta: theta
    again: bool = False
    """Whether a short record is fitted once more, cautiously."""
    cautious: bool = False
    """Whether this is that fit."""
    least: int = 1
    """Starts that are trained to their end, whoever is ahead: those that an ensemble unites, or that are compared on
    inputs that nobody measured."""
    checkpoints: Checkpoints = field(default_factory=Checkpoints)
    """Where the runs of this multistart, and of others of the same fit, are kept."""
    name: str = ""
    """Of the multistart, where a fit has several."""
    stop: threading.Event = field(default_factory=threading.Event)
    iterations: dict[int, int] = field(default_factory=dict)
    """Iterations done by each start, for the progress bar."""

    def model(self, theta: NDArray[np.float64]) -> Network:
        """The model with these parameters of the basis."""
        return replace(self.template, theta=self.to_plain @ self.learnt(theta))

    @property
    def twice(self) -> bool:
        """Whether the record is short, and what is short is fitted once more."""
        found = self.again and self.training.regularisation is None and self.training.loop is Loop.CLOSED
        return found and self.initial is None and is_short(self.provider.n_samples, len(self.layout.centre()))

    def left(self, run: str) -> float:
        """Seconds that a run may take, what earlier sessions have spent on it included."""
        return max(0.0, self.until - now()) + self.checkpoints.spent_s(run)

    def engine(
        self, number: int, limits: Termination, *, stage: Callable[[Iteration], str] | None = None
    ) -> LevenbergMarquardt:
        """What trains a start, and tells how far all are.

        Args:
            number: Which start.
            limits: When it ends.
            stage: What it is called before the training itself, whose iterations alone count; ``None`` for that.

        Returns:
            The engine.
        """
        training, scale = self.training, self.template.scaling.error_unit
        planned = planned_iterations(training, self.least) + (training.max_iterations * self.least if self.twice else 0)
        own = "free run" if training.loop is Loop.CLOSED else "one step ahead"
        own += ", cautious" if self.cautious else ""

        def report(entry: Iteration) -> None:
            if stage is None:
                self.iterations[number] = entry.iteration
            self.on_progress(
                FitProgress(
                    stage=own if stage is None else stage(entry),
                    start=number + 1,
                    starts=training.n_starts,
                    iteration=entry.iteration if stage is None else 0,
                    max_iterations=training.max_iterations,
                    mse=entry.mse * scale,
                    elapsed_s=entry.elapsed_s,
                    fraction=min(1.0, sum(self.iterations.values()) / planned),
                )
            )

        damping = DAMPINGS[training.damping]()
        return LevenbergMarquardt(
            termination=limits, damping=damping, on_iteration=report, should_stop=self.stop.is_set
        )

    def trained(self, number: int, iterations: int, seconds: float) -> LevenbergMarquardt:
        """What trains a start itself.

        Args:
            number: Which start.
            iterations: At most.
            seconds: Likewise.

        Returns:
            The engine; it looks for the evidence where no regularisation was given.
        """
        tolerance, patience = self.training.tolerance, self.training.patience
        limits = Termination(max_iterations=iterations, max_time_s=seconds, tolerance=tolerance, patience=patience)
        engine = self.engine(number, limits)
        return engine if self.training.regularisation is None else replace(engine, evidence_after=None)


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidate:
    """One start, as it stood when it was looked at.

    Args:
        number: Which start, from 0 on.
        seed: Its seed; ``None`` for the one that was given.
        solution: Where its fit stands.
        model: The model there.
        score: Geometric mean over the selection traces, and over outputs, of the mean squared error; NaN without
            such traces.
        outside: Selection traces on which it leaves the tolerance of the training; 0 where that has none.
        members: Starts that an ensemble unites, once for each pick; empty for a single start.
        without: Inputs that it does without.
        place: Where it stands among the others if no selection traces choose.
        away: How far it is from the middle of all starts on inputs that nobody measured (``united.py``), in scaled
            numbers; NaN where that does not choose.
    """

    number: int
    seed: int | None
    solution: Solution
    model: Network
    score: float
    outside: int = 0
    members: tuple[int, ...] = ()
    without: tuple[str, ...] = ()
    place: Place = Place.BY_EVIDENCE
    away: float = math.nan

    @property
    def cautious(self) -> bool:
        """Whether it counts errors that persist as fewer samples."""
        return self.solution.state.prior.cautious

    @property
    def log_evidence(self) -> float:
        """Logarithm of the evidence; minus infinity where none was computed."""
        evidence = self.solution.evidence
        return evidence.log_evidence if evidence else -np.inf

    @property
    def loss(self) -> float:
        """Loss on the estimation traces."""
        return self.solution.at.loss


def is_short(n_samples: int, n_parameters: int) -> bool:
    """Whether a record is short, so that a network of lagged regressors is fitted a second time, cautiously.

    Args:
        n_samples: Samples that count.
        n_parameters: Parameters of the network.

    Returns:
        Whether there are fewer than :data:`SHORT` samples for each.
    """
    return n_samples < SHORT * n_parameters


def deadline(began: float, training: Training, on_progress: Callable[[FitProgress], None]) -> float:
    """When a fit has to have ended: its time is that of all that it does, over all its sessions.

    Args:
        began: When this session of it began, on the clock of ``sysid.estimation.clock.now``.
        training: How long it may take.
        on_progress: Whom it tells, who also knows what earlier sessions have spent.

    Returns:
        The time on that clock; infinity for no limit.
    """
    return began + training.max_time_s - checkpoints_of(on_progress).earlier_s


def check_samples(provider: AbstractProvider) -> None:
    """Refuse records of which nothing is left to fit.

    Args:
        provider: Their residuals.

    Raises:
        TraceError: If no sample counts.
    """
    if provider.n_samples == 0:
        raise TraceError(
            "no sample is left to fit",
            expected="a sample that is not masked, nor looks back on one that is",
            got="none in the estimation traces",
            remedy="use fewer or shorter lags, mask less, or give a longer record",
        )
