"""How a transfer function is fitted, and what its model says about its channels."""

from __future__ import annotations

from dataclasses import dataclass

from sysid.errors import ConfigError
from sysid.models import Mapping
from sysid.models.orders.typed_fields import TypedFields


@dataclass(frozen=True, kw_only=True)
class TransferFunctionTraining(TypedFields):
    """How a transfer function is fitted.

    Args:
        max_iterations: Steps from the best start; 0 keeps the poles of the best start, such as those of the refined
            instrumental variables.
        short_iterations: Steps from every start, before the best one goes on.
        scattered_starts: Random starts beside the informed ones.
        stable: Keep all poles stable, or let them be wherever they are; ``None`` lets the data decide: poles at or
            outside the edge of stability are taken where those within it are significantly worse.
        max_delay: Largest dead time that is tried where the structure leaves it open, in samples; by default a third of
            the longest record.
        max_time_s: Wall time in seconds.
        seed: Of the random starts.

    Raises:
        ConfigError: If a number is negative.
    """

    max_iterations: int = 200
    short_iterations: int = 12
    scattered_starts: int = 2
    stable: bool | None = None
    max_delay: int | None = None
    max_time_s: float = float("inf")
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("max_iterations", "short_iterations", "scattered_starts", "max_delay"):
            if (getattr(self, name) or 0) < 0:
                raise ConfigError(
                    f"{name} is negative", expected="0 or more", got=getattr(self, name), remedy="correct it"
                )


@dataclass(frozen=True, kw_only=True)
class Terms:
    """What a model says about its channels.

    Args:
        mapping: Which channels go in, which comes out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_unit: Unit of the output.
        rest_output: Output at rest, in its unit.
    """

    mapping: Mapping
    sample_time: float
    input_units: tuple[str, ...]
    output_unit: str
    rest_output: float
