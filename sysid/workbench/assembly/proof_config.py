"""What a pipeline asks of the finished whole: random sequences, positions between others, published figures."""

from __future__ import annotations

from itertools import pairwise

from pydantic import BaseModel, Field, model_validator

from sysid.field_checks import FieldError
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
