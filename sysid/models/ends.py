"""What goes into a model and comes out: all that wiring knows of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol


class HasEnds(Protocol):
    """A model of one output, or of several."""

    @property
    def ends(self) -> Ends:
        """Its channels."""


@dataclass(frozen=True, kw_only=True)
class Ends:
    """What goes into a model and comes out.

    Args:
        inputs: Names of the channels that it reads.
        outputs: Names of the channels that it writes.
        input_units: Unit of each input.
        output_units: Unit of each output.
        rest_outputs: Each output at rest, in its unit.
        direct: The inputs that it reads at the sample of its output; of the others it reads past samples only.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    input_units: tuple[str, ...]
    output_units: tuple[str, ...]
    rest_outputs: tuple[float, ...]
    direct: frozenset[str]

    @staticmethod
    def of(model: HasEnds) -> Ends:
        """The ends of a model of one output, or of several."""
        return model.ends


def read_now(inputs: Sequence[str], lags: Sequence[Sequence[int]]) -> frozenset[str]:
    """Inputs that are read at the sample of the output.

    Args:
        inputs: Their names.
        lags: For each its lags.

    Returns:
        Those with a lag of 0.
    """
    return frozenset(name for name, some in zip(inputs, lags, strict=False) if 0 in some)
