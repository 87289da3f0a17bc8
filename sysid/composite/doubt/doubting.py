"""A whole with its doubts: who looks over its shoulder, and from which difference on it says that it does not know."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal

from sysid.composite.doubt.committee import committee
from sysid.composite.doubt.figures import DoubtFigures, doubt_figures, doubt_threshold
from sysid.composite.doubt.perturbed import perturbed
from sysid.errors import ConfigError
from sysid.models import AbstractModel, Cascade
from sysid.traces import Trace


@dataclass(frozen=True, kw_only=True)
class Perturbation:
    """A channel that the whole reads a little more and a little less; see :func:`sysid.composite.perturbed`.

    Args:
        channel: The channel.
        by: About as much as it is usually wrong, in its unit.
        readers: Outputs of the members that read it so; all that read it by default.
    """

    channel: str
    by: float
    readers: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Doubt:
    """What a whole is to doubt.

    Args:
        output: The output that is judged.
        error: Largest error of a right answer, in its unit.
        false: Share of the right answers that may be in doubt.
        perturb: Where a channel may decide: the whole doubts where it parts from any of those that read it moved.

    Raises:
        ConfigError: If the error is not positive, or the share not between 0 and 1.
    """

    output: str
    error: float
    false: float = 0.05
    perturb: tuple[Perturbation, ...] = ()

    def __post_init__(self) -> None:
        if not self.error > 0.0 or not 0.0 < self.false < 1.0:
            raise ConfigError(
                "that is not what can be doubted",
                where="doubt",
                expected="an error above 0 that an answer may have, and a share of the right ones between 0 and 1",
                got=f"error {self.error:g}, false {self.false:g}",
            )


@dataclass(frozen=True, kw_only=True, eq=False)
class Doubting:
    """A whole that doubts.

    Args:
        whole: The committee, which answers as the whole did, or with the mean of all.
        output: What is judged.
        figures: On the sequences that its threshold was found on.
        judged_by: Of what the threshold is.
    """

    whole: Cascade
    output: str
    figures: DoubtFigures
    judged_by: Literal["difference", "spread"] = "difference"

    @property
    def sentence(self) -> str:
        """What it does, in words."""
        one, unit = self.figures, self.whole.units[self.output]
        return (
            f"{self.output} in doubt from a {self.judged_by} of {one.threshold:.3g} {unit} on; "
            f"where the threshold was found, wrong by more than {one.error:g} {unit} are "
            f"{100 * one.wrong:.2g} % of the samples, of these in doubt {100 * one.flagged:.3g} %, "
            f"of the others {100 * one.false:.2g} %"
        )


def doubting(
    whole: Cascade | AbstractModel,
    asked: Doubt,
    traces: Sequence[Trace],
    *,
    beside: Sequence[Cascade | AbstractModel] = (),
    mean: Collection[str] = (),
) -> Doubting:
    """A whole that says where it does not know.

    Args:
        whole: The whole, which goes on answering.
        asked: What it is to doubt.
        traces: Sequences that trained nothing, of more than one kind, with the measured output: the threshold is found
            on them.
        beside: Wholes that were trained apart. Alone they are one committee, from whose median it parts; with
            perturbations it doubts where it is as far from any one.
        mean: Outputs of which the mean of all answers, which doubts by its spread and has no perturbations.

    Returns:
        The whole with its doubts.

    Raises:
        ConfigError: If nobody stands beside it, or they cannot be a committee.
    """
    moved = [
        perturbed(whole, one.channel, by, readers=one.readers or None)
        for one in asked.perturb
        for by in (one.by, -one.by)
    ]
    members, each = [whole, *beside, *moved], bool(moved)
    output, answers = asked.output, bool(mean)
    threshold = doubt_threshold(members, traces, output, error=asked.error, false=asked.false, each=each, mean=answers)
    found = committee(members, {output: threshold}, each=each, mean=mean)
    return Doubting(
        whole=found,
        output=output,
        figures=doubt_figures(found, traces, output, error=asked.error),
        judged_by="spread" if mean else "difference",
    )
