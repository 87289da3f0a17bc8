"""What goes into a model and comes out: all that wiring knows of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from sysid.errors import ConfigError
from sysid.traces import Trace, check_units


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

    @property
    def units(self) -> dict[str, str]:
        """The unit of each channel."""
        pairs = zip((*self.inputs, *self.outputs), (*self.input_units, *self.output_units), strict=True)
        return dict(pairs)

    @staticmethod
    def of(model: HasEnds) -> Ends:
        """The ends of a model of one output, or of several."""
        return model.ends


def check_record(units: Mapping[str, str], sample_time: float, trace: Trace) -> None:
    """Refuse a record that a model cannot be run over: its numbers would mean something else.

    Args:
        units: The unit of each of the model's channels, of which the record may lack some.
        sample_time: Of the model, in seconds.
        trace: The record.

    Raises:
        ConfigError: If the record has another sample time than the model, or a channel in another unit.
    """
    if abs(trace.sample_time - sample_time) > 1e-6 * sample_time:
        raise ConfigError(
            "the record has another sample time than the model",
            where=f"trace {trace.name}",
            expected=f"{sample_time:g} s",
            got=f"{trace.sample_time:g} s",
            remedy="a model holds at its own sample time: resample the record at ingest (grid), or fit it anew",
        )
    check_units(units, trace)


def read_now(inputs: Sequence[str], lags: Sequence[Sequence[int]]) -> frozenset[str]:
    """Inputs that are read at the sample of the output.

    Args:
        inputs: Their names.
        lags: For each its lags.

    Returns:
        Those with a lag of 0.
    """
    return frozenset(name for name, some in zip(inputs, lags, strict=False) if 0 in some)
