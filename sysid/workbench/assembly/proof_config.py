"""What a pipeline asks of the finished whole: random sequences, positions between others, published figures."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated

from pydantic import BaseModel, Field, model_validator

from sysid.composite import Doubt, Perturbation
from sysid.field_checks import FieldError
from sysid.models.interpolation import SPREAD
from sysid.workbench.old_words import STRICT


class MonteCarloConfig(BaseModel):
    """Random sequences of the reference, on which the whole has to hold.

    Args:
        data: Data set with the sequences.
        output: Output that is judged.
        within: Root mean square error in its unit that a sequence should stay under.
        states: Name of an annotator, for errors state by state.
    """

    model_config = STRICT

    data: str
    output: str
    within: float = Field(gt=0.0)
    states: str | None = None


class InterpolationConfig(BaseModel):
    """Positions between those that are modelled: a channel is interpolated to them, and the members stand there too.

    Args:
        channel: What the members at a position read, by its name in the first instance.
        knots: Position of each position that is modelled, increasing, by the channel's name there.
        outputs: What is had at every position, by the names in the first instance.
        data: Data set with the reference: the output at position 17 is the output's name with 17 behind it.
        judged: Outputs that are scored there; all by default.
        delay: Seconds that a front of the channel takes from one position to the next: it is then not smeared between
            knots.
    """

    model_config = STRICT

    channel: str
    knots: dict[str, float] = Field(min_length=2)
    outputs: tuple[str, ...] = Field(min_length=1)
    data: str
    judged: tuple[str, ...] = ()
    delay: float = Field(default=0.0, ge=0.0, allow_inf_nan=False)

    @model_validator(mode="after")
    def _check(self) -> InterpolationConfig:
        positions = list(self.knots.values())
        if any(after <= before for before, after in pairwise(positions)):
            raise FieldError(
                "the knots are no line",
                expected="increasing positions",
                got=", ".join(f"{name}: {position:g}" for name, position in self.knots.items()),
                remedy="give the knots in the order in which they stand",
            )
        strangers = [name for name in self.judged if name not in self.outputs]
        if strangers:
            raise FieldError(
                f"judged names {', '.join(strangers)}, which is not had at a position",
                expected=f"some of {', '.join(self.outputs)}",
                got=", ".join(self.judged),
                remedy="add it to the outputs",
            )
        return self

    @property
    def scored(self) -> tuple[str, ...]:
        """Outputs that are scored at positions."""
        return self.judged or self.outputs


class PerturbationConfig(BaseModel):
    """A channel that the whole reads a little more and a little less.

    Args:
        channel: An input, or an output that members read.
        by: About as much as it is usually wrong, in its unit.
        readers: Outputs of the members that read it so; all that read it by default. For a switch, the switch.
    """

    model_config = STRICT

    channel: str
    by: float = Field(gt=0.0, allow_inf_nan=False)
    readers: tuple[str, ...] = ()


class DoubtConfig(BaseModel):
    """The whole says where it does not know: what is exported has the flag IN_DOUBT.

    Args:
        output: The output that is judged.
        error: Largest error of a right answer, in its unit.
        false: Share of the right answers that may be in doubt.
        data: Data set with sequences that trained nothing, of more than one kind: all of them find the threshold.
        perturb: Channels that may decide; it doubts where it parts from itself with one of them moved.
        beside: Bundles of wholes that were trained apart, or runs that left one, seen from the folder of the YAML.
            Where the mean of several answers (``mean``), their spread doubts, and neither is said.
    """

    model_config = STRICT

    output: str
    error: float = Field(gt=0.0)
    false: float = Field(default=0.05, gt=0.0, lt=1.0)
    data: str
    perturb: tuple[PerturbationConfig, ...] = ()
    beside: tuple[str, ...] = ()

    def check_judges(self, *, averaged: bool) -> None:
        """Refuse what nobody would doubt.

        Args:
            averaged: Whether the mean of several wholes answers, whose spread judges it.

        Raises:
            FieldError: If nobody does, or somebody else beside the spread.
        """
        judging = [name for name in ("perturb", "beside") if getattr(self, name)]
        if averaged and judging:
            raise FieldError(
                "a mean is doubted by the spread of what it is the mean of",
                expected="doubt without perturb and beside, as there is a mean",
                got=f"doubt: {' and '.join(judging)}",
                remedy=f"leave out {' and '.join(judging)}; who is to be averaged stands under mean, beside",
            )
        if not averaged and not judging:
            raise FieldError(
                "nobody doubts",
                expected="perturb, or wholes beside it, or a mean whose spread doubts",
                got="none of them",
                remedy="write for example perturb: [{channel: BP, by: 0.3, readers: [RL]}]",
            )

    def asked(self) -> Doubt:
        """What the whole is to doubt."""
        moved = tuple(Perturbation(channel=one.channel, by=one.by, readers=one.readers) for one in self.perturb)
        return Doubt(output=self.output, error=self.error, false=self.false, perturb=moved)


class MeanConfig(BaseModel):
    """The mean of several wholes answers: of the one that is trained here and of others, for every scored output.

    Args:
        seeds: Seeds with which the whole is trained again, each time through all that the pipeline says.
        beside: Bundles of wholes that were trained apart, or runs that left one, seen from the folder of the YAML.
        spread: Outputs whose spread, the largest answer less the smallest, is an output of what is exported too:
            ``BC_spread`` of ``BC``.
    """

    model_config = STRICT

    seeds: tuple[Annotated[int, Field(ge=0)], ...] = ()
    beside: tuple[str, ...] = ()
    spread: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _check(self) -> MeanConfig:
        if (not self.seeds and not self.beside) or len(set(self.seeds)) < len(self.seeds):
            raise FieldError(
                "that is no mean of several wholes",
                expected="seeds to train the whole again with, each once, or bundles beside it",
                got=f"seeds {list(self.seeds)}, beside {list(self.beside)}",
                remedy="write for example seeds: [1, 2], or beside: [../reports/other/bundle]",
            )
        return self

    @property
    def spreads(self) -> tuple[str, ...]:
        """The names of these spreads."""
        return tuple(f"{name}{SPREAD}" for name in self.spread)


class PublishedConfig(BaseModel):
    """Published figures of an output, beside ours.

    Args:
        source: Where they stand.
        mse: By case, in the output's unit squared.
        target: Share of the published figure that is aimed at.
    """

    model_config = STRICT

    source: str
    mse: dict[str, float]
    target: float = Field(default=1.0, gt=0.0)
