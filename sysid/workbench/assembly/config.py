"""The YAML of an assembly: its members, how they are trained and chosen, and what leaves the workbench."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator

from sysid.composite import Composite, Member, TrainingPlan
from sysid.errors import ConfigError
from sysid.field_checks import FieldError, FolderName
from sysid.models import Limit
from sysid.models.grey_box.declared import Parameter, parameters_from
from sysid.workbench.assembly.extending import extending_schema
from sysid.workbench.assembly.member_config import FixedConfig, MemberConfig, ParametersField, StandingConfig
from sysid.workbench.assembly.proof_config import (
    DoubtConfig,
    InterpolationConfig,
    MeanConfig,
    MonteCarloConfig,
    PublishedConfig,
)
from sysid.workbench.assembly.stage_config import (
    AblationConfig,
    ActiveLearningConfig,
    OneStepConfig,
    RetrainConfig,
    TogetherConfig,
    check_rounds,
    names_in,
)
from sysid.workbench.fields import as_field_error
from sysid.workbench.fits.shared_config import ExportConfig
from sysid.workbench.old_words import ASSEMBLY, STRICT, Words
from sysid.workbench.stability import ExcursionConfig


class LimitConfig(BaseModel):
    """Values between which an output is held: a number in its unit, a channel, or an expression of channels.

    Args:
        low: Least value; none where it is left out.
        high: Greatest value; none where it is left out.
        parameters: What of it is estimated: by name a start, or ``{start:, low:, high:, prior:, fixed:, unit:}``. Those
            of ``fixed`` are known here as well.
    """

    model_config = STRICT

    low: float | str | None = None
    high: float | str | None = None
    parameters: ParametersField = Field(default_factory=dict)


class AssemblyConfig(Words):
    """A pipeline of kind ``assembly``.

    Args:
        kind: ``assembly``.
        extends: YAML of a pipeline that this one builds on, seen from the folder of the YAML; the two are joined before
            anything is checked (:mod:`sysid.workbench.assembly.extending`).
        name: Name of the run folder; letters, digits, dots, dashes and underscores.
        description: What it is for.
        data: Data set whose cases are scored; they need the inputs of the whole and the outputs that are scored.
        training: Data set with the traces that are fitted, and those that choose (role ``selection``); or several
            data sets, whose traces are dealt in turn, so that the first so many hold some of each.
        selection: Another data set with traces that choose.
        outputs: Outputs that are scored.
        choose_on: Outputs whose error on the selection traces chooses; those that are scored by default.
        definitions: Anything, to be repeated by YAML's anchors; not read.
        members: The members.
        fixed: Members that are declared, not fitted; members may read them, and they the members.
        warm_start: Bundle of a trained whole to go on from, seen from the folder of the YAML: its networks stand where
            the members would be fitted; ``together`` trains them on, and ``active_learning``.
        rest: Levels at rest that are inputs' (``{BP: STP}``: charged to where the handle stands).
        limits: Limits of outputs; in its other instances a member has those of its first, unless they have their own.
        stability: How the free run of each candidate is checked by itself. It says so in the candidate's status; by
            default it changes no choice, for a member is chosen by the error of the whole.
        one_step: Each candidate fitted one step ahead as well, to see what becomes of it in free run.
        retrain: Members to train again on what the others put out.
        together: Training end to end.
        active_learning: Adding to its data what the whole is worst at.
        interpolation: Positions between those that are modelled.
        monte_carlo: Random sequences on which the whole has to hold.
        mean: Other wholes, the mean of which and of this one answers.
        doubt: Where the exported whole says that it does not know.
        published: Published figures by output.
        published_models: A table of ``reports/published`` with models of single members: where it has one of the same
            mapping and structure as a candidate, its figures stand beside the candidate's.
        published_whole: What that table calls the whole, such as ``STP -> BP -> BC``: all that it has of such wholes
            stands beside the stages.
        ablation: What was published on what the stages bring.
        seed: Seed of everything random.
        export: What leaves the workbench; ``null`` for nothing.
    """

    model_config = ConfigDict(**STRICT, json_schema_extra=extending_schema)
    OLD = ASSEMBLY

    kind: Literal["assembly"]
    extends: str | None = None
    name: FolderName
    description: str = ""
    data: str
    training: str | Annotated[tuple[str, ...], Field(min_length=1)]
    selection: str | None = None
    outputs: tuple[str, ...] = Field(min_length=1)
    choose_on: tuple[str, ...] = ()
    definitions: dict[str, Any] = Field(default_factory=dict)
    members: tuple[MemberConfig, ...] = Field(min_length=1)
    fixed: tuple[FixedConfig, ...] = ()
    warm_start: str | None = None
    rest: dict[str, FiniteFloat | str] = Field(default_factory=dict)
    limits: dict[str, LimitConfig] = Field(default_factory=dict)
    stability: ExcursionConfig = ExcursionConfig(choose=False)
    one_step: OneStepConfig | None = None
    retrain: RetrainConfig | None = None
    together: TogetherConfig | None = None
    active_learning: ActiveLearningConfig | None = None
    interpolation: InterpolationConfig | None = None
    monte_carlo: MonteCarloConfig | None = None
    mean: MeanConfig | None = None
    doubt: DoubtConfig | None = None
    published: dict[str, PublishedConfig] = Field(default_factory=dict)
    published_models: str | None = None
    published_whole: str | None = None
    ablation: AblationConfig = AblationConfig()
    seed: int = Field(default=0, ge=0)
    export: ExportConfig | None = ExportConfig()

    @property
    def composite(self) -> Composite:
        """What stands in the whole, as it is trained."""
        return Composite(
            members=self._fitted,
            fixed=tuple(one.fixed() for one in self.fixed),
            rest=self.rest,
            limits={name: Limit(low=one.low, high=one.high) for name, one in self.limits.items()},
            parameters=self._limited_by,
        )

    @property
    def _fitted(self) -> tuple[Member, ...]:
        return tuple(one.member(self.seed, self.stability.options()) for one in self.members)

    @property
    def _limited_by(self) -> tuple[Parameter, ...]:
        """The parameters of limits, each once if it is declared alike."""
        known = (one for limit in self.limits.values() for one in parameters_from(limit.parameters))
        return tuple(dict.fromkeys(known))

    def seeded(self, seed: int) -> AssemblyConfig:
        """The same pipeline with another seed.

        Args:
            seed: The seed.

        Returns:
            The pipeline.
        """
        return self.model_copy(update={"seed": seed})

    @property
    def plan(self) -> TrainingPlan:
        """The stages of its training."""
        learning = [one.plan() for one in self.learning_rounds]
        return TrainingPlan(
            outputs=self.choose_on or self.outputs,
            one_step=None if self.one_step is None else self.one_step.options(),
            retrain=None if self.retrain is None else self.retrain.options(),
            rounds=tuple(one.plan() for one in self.joint),
            active_learning=None if self.active_learning is None else self.active_learning.options(learning),
        )

    @property
    def standing(self) -> tuple[StandingConfig, ...]:
        """All members, the fitted ones first."""
        return (*self.members, *self.fixed)

    @property
    def joint(self) -> tuple[TogetherConfig, ...]:
        """The rounds of training end to end, without those of active learning."""
        return self.together.rounds if self.together else ()

    @property
    def learning_rounds(self) -> tuple[TogetherConfig, ...]:
        """The rounds of training end to end that each round of active learning goes through."""
        return self.joint[-1].followed_by(self.active_learning.train) if self.active_learning and self.joint else ()

    @property
    def wanted(self) -> tuple[str, ...]:
        """Outputs that are asked of the whole; what none of them depends on only the training looked at."""
        stressed = (self.monte_carlo.output,) if self.monte_carlo else ()
        line = (
            (self.interpolation.channel, *self.interpolation.knots, *self.interpolation.outputs)
            if self.interpolation
            else ()
        )
        doubted = (self.doubt.output,) if self.doubt else ()
        spread = self.mean.spread if self.mean else ()
        return tuple(dict.fromkeys((*self.outputs, *self.choose_on, *stressed, *doubted, *spread, *line)))

    @property
    def leaving(self) -> tuple[str, ...]:
        """Outputs of what is exported."""
        return (*self.outputs, *(self.mean.spreads if self.mean else ()))

    @model_validator(mode="after")
    def _check_published(self) -> AssemblyConfig:
        if self.published_whole is not None and self.published_models is None:
            raise FieldError(
                "published_whole names what a table calls the whole, and no table is named",
                expected="published_models: a table of reports/published",
                got=f"published_whole: {self.published_whole}, and no published_models",
                remedy="name the table, or leave published_whole out",
            )
        return self

    @model_validator(mode="after")
    def _check_export(self) -> AssemblyConfig:
        if self.export is not None and self.export.input_levels:
            raise FieldError(
                "what the inputs of an assembly stood at is said for all of it", expected="levels under rest",
                got=f"input_levels of the export: {self.export.input_levels}", remedy="move them to rest",
            )  # fmt: skip
        return self

    @model_validator(mode="after")
    def _check_begin(self) -> AssemblyConfig:
        if self.warm_start is None:
            return self
        fitted = {
            "candidates": any(member.candidates > 1 for member in self.members),
            "sweep": any(member.sweep for member in self.members),
            "alternatives": any(member.alternatives for member in self.members),
            "one_step": self.one_step is not None,
            "retrain": self.retrain is not None,
        }
        if asked := [name for name, yes in fitted.items() if yes]:
            raise FieldError(
                f"a whole that is begun from another one has {', '.join(asked)}",
                expected="begin and together: there is one beginning, and no fit of a member alone",
                got=f"warm_start: {self.warm_start}, and {', '.join(asked)}",
                remedy=f"leave out {', '.join(asked)}, or begin",
            )
        return self

    @model_validator(mode="after")
    def _check_active_learning(self) -> AssemblyConfig:
        if self.active_learning is None:
            return self
        if self.together is None:
            raise FieldError(
                "active learning without training end to end",
                expected="together, whose last round is what it goes on from",
                got="active_learning alone",
                remedy="add together, or leave active_learning out",
            )
        check_rounds(self.learning_rounds)
        pool = self.active_learning.data
        if self.active_learning.candidates is not None:
            return self  # new ones, whatever else the pipeline's own experiments are used for
        if (used := self._data).get(pool):
            raise FieldError(
                f"the pool of active_learning is used otherwise: {pool} is under {used[pool]}",
                expected="a data set that nothing else trains on, chooses by or scores",
                got=f"active_learning, data: {self.active_learning.data}",
                remedy="name another pool",
            )
        return self

    @model_validator(mode="after")
    def _check_seeds(self) -> AssemblyConfig:
        taught = self.warm_start is None or self.together is not None
        known = [self]
        for seed in self.mean.seeds if self.mean else ():
            again = self.seeded(seed)
            if not taught or any((one._fitted, one.plan) == (again._fitted, again.plan) for one in known):
                raise FieldError(
                    f"seed {seed} would train the same whole again",
                    expected="mean, seeds: others than seed, in a pipeline that trains with the seed it is given",
                    got=f"seed: {self.seed}, seeds: {list(self.mean.seeds if self.mean else ())}"
                    + ("" if taught else ", a warm_start, and nothing that is trained"),
                    remedy="name other seeds; leave seed out of training, and together in where there is a warm_start",
                )
            known.append(again)
        return self

    @model_validator(mode="after")
    def _check_doubt(self) -> AssemblyConfig:
        if self.doubt is not None:
            self.doubt.check_judges(averaged=self.mean is not None)
        training = (self.training,) if isinstance(self.training, str) else self.training
        fitted = (*training, *(self.together.data if self.together else ()))
        if self.doubt is not None and self.doubt.data in fitted:
            raise FieldError(
                "the threshold of the doubt would be found on what was trained on, where the whole errs less",
                expected="a data set that trained nothing",
                got=f"doubt, data: {self.doubt.data}",
                remedy="name another one, with other kinds of sequence",
            )
        return self

    @property
    def _data(self) -> dict[str, str]:
        """Every data set but the pool, and which field names it."""
        training = (self.training,) if isinstance(self.training, str) else self.training
        also = self.together.data if self.together else ()
        beside = {
            "monte_carlo, data": self.monte_carlo,
            "interpolation, data": self.interpolation,
            "doubt, data": self.doubt,
        }
        return {
            self.data: "data",
            **{one.data: field for field, one in beside.items() if one},
            **({self.selection: "selection"} if self.selection else {}),
            **dict.fromkeys(training, "training"),
            **dict.fromkeys(also, "together, also"),
        }

    @model_validator(mode="after")
    def _check_outputs(self) -> AssemblyConfig:
        bases = [member.mapping.output for member in self.members]
        written = [f"{one.mapping.output}{place}" for one in self.standing for place in one.instances]
        if len(set(written)) < len(written):
            raise FieldError(
                "two members write one channel",
                expected="each channel written by one member in one instance",
                got=", ".join(sorted(name for name in set(written) if written.count(name) > 1)),
                remedy="correct the mapping or the instances",
            )
        asked = {
            "outputs": self.outputs,
            "choose_on": self.choose_on,
            "limits": tuple(self.limits),
            "published": tuple(self.published),
            "monte_carlo": (self.monte_carlo.output,) if self.monte_carlo else (),
            "doubt, output": (self.doubt.output,) if self.doubt else (),
            "mean, spread": self.mean.spread if self.mean else (),
            "active_learning, outputs": self.active_learning.outputs if self.active_learning else (),
            "interpolation": (self.interpolation.channel, *self.interpolation.knots, *self.interpolation.outputs)
            if self.interpolation
            else (),
        }
        try:
            free = [one.output for one in self.composite.fixed if one.free]
        except ConfigError as error:
            raise as_field_error(error) from error
        retrained = {"retrain, members": self.retrain.members if self.retrain else ()}
        named: dict[str, tuple[str, ...]] = {}
        for stage, rounds in (("together", self.joint), ("active_learning, train", self.learning_rounds)):
            for field, names in names_in(rounds).items():
                (named if field == "members" else asked)[f"{stage}, {field}"] = names
        for known, places in ((written, asked), (bases, retrained), ([*bases, *free], named)):
            for where, names in places.items():
                strangers = [name for name in names if name not in known]
                if strangers:
                    raise FieldError(
                        f"{where} names {', '.join(strangers)}, which no member writes",
                        expected=f"some of {', '.join(known)}",
                        got=", ".join(names),
                        remedy="correct the name, or add a member",
                    )
        return self
