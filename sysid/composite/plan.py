"""How a composite is trained: each stage as plain options, and all of them as one plan."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import asdict, dataclass, field
from typing import Any

from sysid.errors import ConfigError
from sysid.estimation import JointTraining

Reads = Dict[str, Dict[str, tuple[int, ...]]]
"""By the output of a member, lags of the channels that it reads more."""

PICKS = ("worst", "next")


def _at_least(least: int, where: str, **values: int) -> None:
    for name, value in values.items():
        if value < least:
            raise ConfigError(f"{name} is too small", where=where, expected=f"{least} or more", got=value)


@dataclass(frozen=True, kw_only=True)
class OneStep:
    """Each candidate fitted one step ahead as well: with the same lags and neurons, on measured past output.

    Args:
        max_iterations: Of each training.
        starts: Random starts of each training.
    """

    max_iterations: int = 200
    starts: int = 2

    def __post_init__(self) -> None:
        _at_least(1, "one step", max_iterations=self.max_iterations, starts=self.starts)


@dataclass(frozen=True, kw_only=True)
class Retraining:
    """Members that are trained again on what the others really put out.

    Args:
        members: Their outputs, in the order of the training.
        max_iterations: Of each training.
        rounds: How often all of them are gone through.
    """

    members: tuple[str, ...]
    max_iterations: int = 60
    rounds: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "members", tuple(self.members))
        _at_least(1, "retrain", max_iterations=self.max_iterations, rounds=self.rounds)


@dataclass(frozen=True, kw_only=True)
class RoundPlan:
    """One round of training end to end.

    Args:
        targets: The error of each output that counts as one, in its unit.
        members: Outputs of the members that are trained; all by default.
        measured: Outputs that are as measured while the others are trained, such as a switch: where the free run
            decides when it flips, the loss has an edge there, and no step of the training sees across it.
        share_weights: Whether the members keep one set of weights for all their instances. They are trained in their
            first one, on traces of every instance in turn; what they read from elsewhere is as measured, or as the
            whole puts it out.
        reads: Channels of members that members read from here on, beside those of their mappings, with the lags:
            ``{"AR": {"ER": (1,)}}``; more lags of one that a member reads already, or of its own output, as well. Their
            weights begin at zero, so that a circle closes from a chain that runs and cannot run away at once.
        training: How.
        traces: Estimation traces used, the first so many; all by default.
        also: Names of further sets of traces that are dealt in, one in turn with one of those that all stages have;
            their selection traces choose with the others.

    Raises:
        ConfigError: If weights are shared and no member is named, or an output is to be as measured and trained.
    """

    targets: Dict[str, float]
    members: tuple[str, ...] | None = None
    measured: tuple[str, ...] = ()
    share_weights: bool = False
    reads: Reads = field(default_factory=dict)
    training: JointTraining = field(default_factory=JointTraining)
    traces: int | None = None
    also: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.targets:
            raise ConfigError("a round has no targets", where="targets", expected="an output and its error", got="none")
        if self.share_weights and not self.members:
            raise ConfigError(
                "a round that shares weights names no members",
                where="members",
                expected="members that stand in the same instances",
                got="all of them",
                remedy="name them under members",
            )
        if both := set(self.measured) & {*(self.members or ()), *self.targets}:
            raise ConfigError(
                f"{', '.join(sorted(both))} is to be as measured, and trained or judged",
                where="measured",
                expected="outputs under measured that the same round has neither under members nor under targets",
                got=f"measured {', '.join(self.measured)}",
                remedy="take it out of measured, or out of the others",
            )

    @property
    def terms(self) -> dict[str, Any]:
        """JSON values that the round's result depends on, beside the whole, the traces and the code."""
        asked = asdict(self)
        asked.pop("also")  # their traces are among the round's
        return asked


@dataclass(frozen=True, kw_only=True)
class ActiveLearning:
    """Active learning: training data that grow by what the whole is worst at, round by round.

    Args:
        outputs: Outputs that are looked at; the one with the largest error counts.
        within: Root mean square error in their unit that a sequence should stay under.
        additions: How many sequences each round adds, for as many rounds as there are at most.
        until: Share of the sequences within the limit at which there is no further round.
        patience: Rounds without an improvement after which there is no further one.
        pick: Which sequences are added: those with the largest errors (``worst``), or those that come next in the pool
            (``next``), to see beside it whether looking for the worst pays.
        rounds: Rounds of training end to end that each round goes through, with all that has been added.

    Raises:
        ConfigError: If a number is out of its range.
    """

    outputs: tuple[str, ...]
    within: float
    additions: tuple[int, ...] = (20, 20, 20, 20, 20)
    until: float = 0.99
    patience: int = 2
    pick: str = "worst"
    rounds: tuple[RoundPlan, ...] = ()

    def __post_init__(self) -> None:
        for name in ("outputs", "additions", "rounds"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        where = "active learning"
        _at_least(1, where, patience=self.patience, additions=min(self.additions, default=0))
        if not self.outputs or not self.within > 0.0 or not 0.0 < self.until <= 1.0 or self.pick not in PICKS:
            raise ConfigError(
                "active learning cannot be done so",
                where=where,
                expected=f"outputs, within above 0, until above 0 and at most 1, pick one of {', '.join(PICKS)}",
                got=f"outputs {', '.join(self.outputs) or 'none'}, within {self.within:g}, until {self.until:g}, "
                f"pick {self.pick}",
            )


@dataclass(frozen=True, kw_only=True)
class TrainingPlan:
    """The stages of a composite's training; each begins where the one before has ended.

    Args:
        outputs: Outputs whose error on the selection traces chooses: members, stages, states of a round.
        one_step: Fits one step ahead beside the others, to see what becomes of them in free run.
        retrain: Members to train again on what the others put out.
        rounds: Rounds of training end to end.
        active_learning: Rounds on what the whole is worst at, behind the others; it needs one of these.

    Raises:
        ConfigError: If active learning has no round to go on from.
    """

    outputs: tuple[str, ...]
    one_step: OneStep | None = None
    retrain: Retraining | None = None
    rounds: tuple[RoundPlan, ...] = ()
    active_learning: ActiveLearning | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "outputs", tuple(self.outputs))
        object.__setattr__(self, "rounds", tuple(self.rounds))
        if self.active_learning is not None and not (self.rounds and self.active_learning.rounds):
            raise ConfigError(
                "active learning without training end to end",
                where="rounds",
                expected="at least one round before it, and one that each of its own goes through",
                got=f"{len(self.rounds)} before it, {len(self.active_learning.rounds)} in each of its own",
                remedy="add a RoundPlan to rounds, and to the rounds of active_learning",
            )

    @property
    def all_rounds(self) -> tuple[RoundPlan, ...]:
        """The rounds of training end to end, those that active learning goes through behind the others."""
        return (*self.rounds, *(self.active_learning.rounds if self.active_learning else ()))
