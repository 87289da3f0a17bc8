"""What a pipeline asks of each stage of an assembly's training: one step ahead, retraining, growing, end to end."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, Field, model_validator

from sysid.estimation import JointTraining
from sysid.workbench.fields import STRICT, JointConfig, LagsField
from sysid.yaml_files import FieldError


class OneStepConfig(BaseModel):
    """Each candidate fitted one step ahead as well: with the same lags and neurons, on measured past output.

    Args:
        max_iterations: Of each training.
        starts: Random starts of each training.
    """

    model_config = STRICT

    max_iterations: int = Field(default=200, ge=1)
    starts: int = Field(default=2, ge=1)


class LessonsConfig(BaseModel):
    """What was published on each of the lessons that the stages of an assembly put to the test; words for the report.

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


Reads = dict[str, dict[str, LagsField]]
"""By the output of a member, lags of the channels that it reads more."""


OF_TRAINING = ("max_iterations", "moves", "leverage", "soft_margin")
"""Options of a training that a round may have for itself."""


class AgainConfig(BaseModel):
    """A further round of training end to end, from where the round before ended; what it does not name stays.

    Args:
        members: Outputs of the members that are trained.
        reads: Channels, or further lags, that members read from this round on, as under ``together``.
        measured: As under ``together``; ``[]`` for none any more.
        everywhere: As under ``together``.
        targets: The error of each output that counts as one, in its unit.
        traces: Estimation traces used, the first so many.
        also: Data sets as under ``together``.
        max_iterations: Of its training.
        moves: Of its training.
        leverage: Of its training.
        soft_margin: Of its training.
    """

    model_config = STRICT

    members: tuple[str, ...] | None = Field(default=None, min_length=1)
    reads: Reads = {}
    measured: tuple[str, ...] | None = None
    everywhere: bool | None = None
    targets: dict[str, float] | None = Field(default=None, min_length=1)
    traces: int | None = Field(default=None, ge=1)
    also: tuple[str, ...] | None = None
    max_iterations: int | None = Field(default=None, ge=1)
    moves: float | None = Field(default=None, gt=0)
    leverage: float | None = Field(default=None, gt=0)
    soft_margin: float | None = Field(default=None, gt=0)


class TogetherConfig(BaseModel):
    """Members that are trained end to end, for the free run of the whole.

    Args:
        members: Outputs of the members that are trained; all by default.
        measured: Outputs that are as measured while the others are trained, such as a switch: where the free run
            decides when it flips, the loss has an edge there, and no step of the training sees across it.
        everywhere: Whether the members keep one set of weights for all places where they stand. They are trained in
            their first place, on traces of every place in turn; what they read from elsewhere is as measured, or as the
            whole puts it out.
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

    model_config = STRICT

    members: tuple[str, ...] | None = None
    measured: tuple[str, ...] = ()
    everywhere: bool = False
    targets: dict[str, float] = Field(min_length=1)
    reads: Reads = {}
    training: JointConfig = Field(default_factory=JointConfig)
    traces: int | None = Field(default=None, ge=1)
    also: tuple[str, ...] = ()
    again: tuple[AgainConfig, ...] = ()

    @model_validator(mode="after")
    def _check(self) -> TogetherConfig:
        for one in self.rounds:
            if one.everywhere and not one.members:
                raise FieldError(
                    "a round that trains everywhere names no members",
                    expected="members that stand in the same places",
                    got="all of them",
                    remedy="name them under members",
                )
            both = set(one.measured) & {*(one.members or ()), *one.targets}
            if both:
                raise FieldError(
                    f"{', '.join(sorted(both))} is to be as measured, and trained or judged",
                    expected="outputs under measured that the same round has neither under members nor under targets",
                    got=f"measured {', '.join(one.measured)}",
                    remedy="take it out of measured, or out of the others",
                )
        return self

    @property
    def trained(self) -> tuple[str, ...]:
        """Every member that some round's ``members`` names."""
        return tuple(dict.fromkeys(name for one in self.rounds for name in one.members or ()))

    @property
    def judged(self) -> tuple[str, ...]:
        """Outputs that are a target in some round."""
        return tuple(dict.fromkeys(name for one in self.rounds for name in one.targets))

    @property
    def spared(self) -> tuple[str, ...]:
        """Outputs that are as measured in some round."""
        return tuple(dict.fromkeys(name for one in self.rounds for name in one.measured))

    @property
    def data(self) -> tuple[str, ...]:
        """Every data set that some round's ``also`` names."""
        return tuple(dict.fromkeys(name for one in self.rounds for name in one.also))

    @property
    def circles(self) -> tuple[str, ...]:
        """Every channel that some round's ``reads`` names."""
        return tuple(name for one in self.rounds for member, more in one.reads.items() for name in (member, *more))

    @property
    def rounds(self) -> tuple[TogetherConfig, ...]:
        """Every round with all that it uses, in order."""
        found = [self.model_copy(update={"again": ()})]
        for more in self.again:
            given = {**more.model_dump(exclude_none=True), "reads": more.reads}
            own: dict[str, Any] = {name: given.pop(name) for name in OF_TRAINING if name in given}
            training = found[-1].training.model_copy(update=own)
            found.append(found[-1].model_copy(update={**given, "training": training}))
        return tuple(found)

    def training_options(self, seed: int) -> JointTraining:
        """The options of the training, with a seed where none is named.

        Args:
            seed: The seed.

        Returns:
            The options.
        """
        given = {name: getattr(self.training, name) for name in self.training.model_fields_set}
        return JointTraining(**{"seed": seed, **given})


class GrowConfig(BaseModel):
    """Training data that grow by what the whole is worst at, round by round.

    Args:
        data: Data set of the pool: cases with ``role: estimation`` are added from, cases with ``role: selection`` say
            what a round has brought. Never sequences that are scored.
        outputs: Outputs that are looked at; the one with the largest error counts.
        within: Root mean square error in their unit that a sequence should stay under.
        members: Outputs of the members that are trained again in each round, in this order, on what the others put out.
        add: Sequences added in each round.
        rounds: At most.
        until: Share of the sequences within the limit at which no further round is begun.
        patience: Rounds without an improvement after which no further one is begun.
        max_iterations: Of each training.
    """

    model_config = STRICT

    data: str
    outputs: tuple[str, ...] = Field(min_length=1)
    within: float = Field(gt=0.0)
    members: tuple[str, ...] = Field(min_length=1)
    add: int = Field(default=20, ge=1)
    rounds: int = Field(default=5, ge=1)
    until: float = Field(default=0.99, gt=0.0, le=1.0)
    patience: int = Field(default=2, ge=1)
    max_iterations: int = Field(default=60, ge=1)
