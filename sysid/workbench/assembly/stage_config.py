"""What a pipeline asks of the stages of training: one step ahead, retraining, active learning, end to end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, Field, model_validator

from sysid.composite import ActiveLearning, OneStep, Retraining, RoundPlan
from sysid.errors import ConfigError
from sysid.estimation import JointTraining
from sysid.field_checks import FieldError
from sysid.workbench.fields import JointConfig, LagsField, as_field_error
from sysid.workbench.old_words import JOINT_TRAINING, STRICT, Words


class OneStepConfig(BaseModel):
    """Each candidate fitted one step ahead as well: with the same lags and neurons, on measured past output.

    Args:
        max_iterations: Of each training.
        starts: Random starts of each training.
    """

    model_config = STRICT

    max_iterations: int = Field(default=200, ge=1)
    starts: int = Field(default=2, ge=1)

    def options(self) -> OneStep:
        """The options, as the training has them."""
        return OneStep(max_iterations=self.max_iterations, starts=self.starts)


class AblationConfig(BaseModel):
    """What was published on what each stage of an assembly brings; words for the report.

    Args:
        closing: On a network that was fitted one step ahead, in free run.
        together: On members that are the best alone, as a whole.
        retraining: On members that are trained again on what the others put out.
        end_to_end: On a whole that is trained as one.
    """

    model_config = STRICT

    closing: str = ""
    together: str = ""
    retraining: str = ""
    end_to_end: str = ""


class RetrainConfig(BaseModel):
    """Members that are trained again on what the others really put out.

    Args:
        members: Their outputs, in the order of the training.
        max_iterations: Of each training.
        rounds: How often all of them are gone through.
    """

    model_config = STRICT

    members: tuple[str, ...] = Field(min_length=1)
    max_iterations: int = Field(default=60, ge=1)
    rounds: int = Field(default=1, ge=1)

    def options(self) -> Retraining:
        """The options, as the training has them."""
        return Retraining(members=self.members, max_iterations=self.max_iterations, rounds=self.rounds)


Reads = dict[str, dict[str, LagsField]]
"""By the output of a member, lags of the channels that it reads more."""


OF_TRAINING = ("max_iterations", "moves", "leverage", "robust_scale", "windows")
"""Options of a training that a round may have for itself."""


class RoundConfig(Words):
    """A round of training end to end as far as it is another one than that before; what it does not name stays.

    Args:
        members: Outputs of the members that are trained.
        measured: As under ``together``; ``[]`` for none any more.
        share_weights: As under ``together``.
        targets: The error of each output that counts as one, in its unit.
        max_iterations: Of its training.
        moves: Of its training.
        leverage: Of its training.
        robust_scale: Of its training.
        windows: Of its training; ``[]`` for none any more, ``auto`` for those that it needs.
    """

    OLD: ClassVar[Mapping[str, str]] = {"everywhere": "share_weights", **JOINT_TRAINING}

    members: tuple[str, ...] | None = Field(default=None, min_length=1)
    measured: tuple[str, ...] | None = None
    share_weights: bool | None = None
    targets: dict[str, float] | None = Field(default=None, min_length=1)
    max_iterations: int | None = Field(default=None, ge=1)
    moves: float | None = Field(default=None, gt=0)
    leverage: float | None = Field(default=None, gt=0)
    robust_scale: float | None = Field(default=None, gt=0)
    windows: Literal["auto"] | tuple[int, ...] | None = None


class AgainConfig(RoundConfig):
    """A further round of training end to end, from where the round before ended.

    Args:
        reads: Channels, or further lags, that members read from this round on, as under ``together``.
        traces: Estimation traces used, the first so many.
        also: Data sets as under ``together``.
    """

    reads: Reads = Field(default_factory=dict)
    traces: int | None = Field(default=None, ge=1)
    also: tuple[str, ...] | None = None


class TogetherConfig(Words):
    """Members that are trained end to end, for the free run of the whole.

    Args:
        members: Outputs of the members that are trained; all by default.
        measured: Outputs that are as measured while the others are trained, such as a switch: where the free run
            decides when it flips, the loss has an edge there, and no step of the training sees across it.
        share_weights: Whether the members keep one set of weights for all their instances. They are trained in
            their first instance, on traces of every one in turn; what they read from elsewhere is as measured, or as
            the whole puts it out.
        targets: The error of each output that counts as one, in its unit.
        reads: Channels of members that members read from here on, beside those of their mappings, with the lags:
            ``{AR: {ER: 1}}``; more lags of one that a member reads already, or of its own output, as well. Their
            weights begin at zero, so that a circle closes from a chain that runs and cannot run away at once.
        training: How.
        traces: Estimation traces used, the first so many; all by default.
        also: Data sets whose estimation traces are dealt in from here on, one in turn with one of those that all stages
            have: what is rare among these, and would keep members that know little yet from finding their way. Their
            selection traces choose with the others.
        again: Further rounds, for what is too slow from the beginning, such as more traces.
    """

    OLD: ClassVar[Mapping[str, str]] = {"everywhere": "share_weights"}

    members: tuple[str, ...] | None = None
    measured: tuple[str, ...] = ()
    share_weights: bool = False
    targets: dict[str, float] = Field(min_length=1)
    reads: Reads = Field(default_factory=dict)
    training: JointConfig = Field(default_factory=JointConfig)
    traces: int | None = Field(default=None, ge=1)
    also: tuple[str, ...] = ()
    again: tuple[AgainConfig, ...] = ()

    @model_validator(mode="after")
    def _check(self) -> TogetherConfig:
        check_rounds(self.rounds)
        return self

    @property
    def data(self) -> tuple[str, ...]:
        """Every data set that some round's ``also`` names."""
        return tuple(dict.fromkeys(name for one in self.rounds for name in one.also))

    @property
    def rounds(self) -> tuple[TogetherConfig, ...]:
        """Every round with all that it uses, in order."""
        first = self.model_copy(update={"again": ()})
        return (first, *first.followed_by(self.again))

    def followed_by(self, more: Sequence[RoundConfig]) -> tuple[TogetherConfig, ...]:
        """Rounds that go on from this one, each from the one before.

        Args:
            more: What each of them is another one in.

        Returns:
            Each with all that it uses.
        """
        found = [self]
        for one in more:
            given = {**one.model_dump(exclude_none=True), "reads": one.reads if isinstance(one, AgainConfig) else {}}
            own: dict[str, Any] = {name: given.pop(name) for name in OF_TRAINING if name in given}
            training = found[-1].training.model_copy(update=own)
            found.append(found[-1].model_copy(update={**given, "training": training}))
        return tuple(found[1:])

    def plan(self) -> RoundPlan:
        """The first round, as it is trained.

        Returns:
            The round.

        Raises:
            ConfigError: If it cannot be trained so.
        """
        given = {name: getattr(self.training, name) for name in self.training.model_fields_set}
        return RoundPlan(
            targets=self.targets,
            members=self.members,
            measured=self.measured,
            share_weights=self.share_weights,
            reads=self.reads,
            training=JointTraining(**given),
            traces=self.traces,
            also=self.also,
        )


def check_rounds(rounds: Sequence[TogetherConfig]) -> None:
    """Refuse what no round can be.

    Args:
        rounds: The rounds, with all that they use.

    Raises:
        FieldError: If one shares weights and names no members, or trains or judges what is to be as measured.
    """
    try:
        for one in rounds:
            one.plan()
    except ConfigError as error:
        raise as_field_error(error) from error


def names_in(rounds: Sequence[TogetherConfig]) -> dict[str, tuple[str, ...]]:
    """The channels that some rounds name.

    Args:
        rounds: The rounds.

    Returns:
        By the field that names them, each channel once.
    """
    found = {
        "members": (name for one in rounds for name in one.members or ()),
        "targets": (name for one in rounds for name in one.targets),
        "reads": (name for one in rounds for member, more in one.reads.items() for name in (member, *more)),
        "measured": (name for one in rounds for name in one.measured),
    }
    return {field: tuple(dict.fromkeys(names)) for field, names in found.items()}


Count = Annotated[int, Field(ge=1)]


class ActiveLearningConfig(BaseModel):
    """Active learning: training data that grow by what the whole is worst at, round by round, after ``together``.

    Args:
        data: Data set of the pool: cases with ``role: estimation`` are added from, cases with ``role: selection`` are
            never trained on, say what a round has brought, and choose with the other selection traces, among the states
            of a round of active learning and between the stages. A data set that nothing else uses. Or, with
            ``candidates``, a pipeline of kind ``experiment``, whose reference is asked for new runs.
        candidates: New random experiments that a round looks at, with those that the rounds before left. They are drawn
            as the pipeline draws its own, and are none of its own, which may be trained on.
        held_out: New random experiments in the place of those with ``role: selection``.
        duration: Seconds of each new experiment; those of the pipeline's by default.
        outputs: Outputs that are looked at; the one with the largest error counts.
        within: Root mean square error in their unit that a sequence should stay under.
        add: Sequences added in each round; or in each one of its own, and there are as many rounds: ``[10, 20, 40]``.
        rounds: At most; 5 by default.
        until: Share of the sequences within the limit at which there is no further round.
        patience: Rounds without an improvement after which there is no further one.
        pick: Which sequences are added: those with the largest errors (``worst``), or those that come next in the pool
            (``next``), to see beside it whether looking for the worst pays.
        train: Rounds of training end to end that each round of active learning goes through, as under ``again``. The
            first is what the last round of ``together`` was, but for what it names, and each further one what the one
            before was. All of them have the estimation traces of that last round, and all that has been added.
    """

    model_config = STRICT

    data: str
    candidates: Count | None = None
    held_out: Count | None = None
    duration: float | None = Field(default=None, gt=0.0, allow_inf_nan=False)
    outputs: tuple[str, ...] = Field(min_length=1)
    within: float = Field(gt=0.0)
    add: Count | Annotated[tuple[Count, ...], Field(min_length=1)] = 20
    rounds: Count | None = None
    until: float = Field(default=0.99, gt=0.0, le=1.0)
    patience: int = Field(default=2, ge=1)
    pick: Literal["worst", "next"] = "worst"
    train: tuple[RoundConfig, ...] = Field(default=(RoundConfig(),), min_length=1)

    @model_validator(mode="after")
    def _check(self) -> ActiveLearningConfig:
        if isinstance(self.add, tuple) and self.rounds is not None and self.rounds != len(self.add):
            raise FieldError(
                f"{self.rounds} rounds of active learning, and what to add in {len(self.add)}",
                expected="as many numbers under add as there are rounds",
                got=f"rounds: {self.rounds}, add: {', '.join(map(str, self.add))}",
                remedy="leave rounds out: add says it",
            )
        asked = [name for name in ("candidates", "held_out", "duration") if getattr(self, name) is not None]
        if asked and not {"candidates", "held_out"} <= set(asked):
            raise FieldError(
                "a reference that is asked for new runs is told how many of each",
                expected="candidates and held_out together, and duration with them at most", got=" and ".join(asked),
                remedy="name both, or neither where the data are a data set",
            )  # fmt: skip
        return self

    @property
    def additions(self) -> tuple[int, ...]:
        """How many sequences each round adds, for as many rounds as there are at most."""
        if isinstance(self.add, tuple):
            return self.add
        return (self.add,) * (5 if self.rounds is None else self.rounds)

    def options(self, rounds: Sequence[RoundPlan]) -> ActiveLearning:
        """The options, as the training has them.

        Args:
            rounds: Of training end to end, which each round goes through.

        Returns:
            The options.
        """
        return ActiveLearning(
            outputs=self.outputs,
            within=self.within,
            additions=self.additions,
            until=self.until,
            patience=self.patience,
            pick=self.pick,
            rounds=tuple(rounds),
        )
