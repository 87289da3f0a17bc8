"""The check of a fit's free run over random sequences, as a pipeline asks for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pydantic import BaseModel, Field

from sysid.estimation.stability import StabilityOptions
from sysid.traces import Trace
from sysid.workbench.old_words import STRICT

_DEFAULT = StabilityOptions()


class ExcursionConfig(BaseModel):
    """Over how many excursions of the estimation traces a network's free run has to stay bounded and to settle.

    Args:
        count: How many at most; 0 checks nothing.
        tolerance: How far from its plateau a run may settle, as a share of the output's range.
        seed: Seed of the sequences.
        choose: Whether the best start gives way to the best stable one. It never does in a fit of the open loop, which
            is not made to run free.
        time_share: Share of the fit's own time that its checks may take together, and a minute in any case; on how
            many sequences the verdict then rests is said.
        amplitude: How many times as far from the middle of their range as in the estimation traces the inputs of
            excursions go; beyond 1 only whether a run stays bounded is judged.
    """

    model_config = STRICT

    count: int = Field(default=_DEFAULT.count, ge=0)
    tolerance: float = Field(default=_DEFAULT.tolerance, gt=0.0)
    seed: int = Field(default=_DEFAULT.seed, ge=0)
    choose: bool = _DEFAULT.choose
    time_share: float = Field(default=_DEFAULT.time_share, gt=0.0)
    amplitude: float = Field(default=_DEFAULT.amplitude, gt=0.0)

    def options(self) -> StabilityOptions:
        """What is asked."""
        return StabilityOptions(**{name: getattr(self, name) for name in ExcursionConfig.model_fields})


class StabilityConfig(ExcursionConfig):
    """Over which sequences a network's free run has to stay bounded and to settle.

    Args:
        sequences: Data set whose traces are run, as they are, such as the random commands of a generator; by default
            excursions made from the estimation traces.
    """

    sequences: str | None = None

    def options(self, sequences: Sequence[Trace] = ()) -> StabilityOptions:
        """What is asked, with the traces of the data set that is declared.

        Args:
            sequences: Those traces; none where none is declared.

        Returns:
            The options.
        """
        source = f"The traces of the data set {self.sequences}."
        return replace(super().options(), sequences=tuple(sequences), source=source)
