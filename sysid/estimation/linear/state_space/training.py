"""How a linear state space is fitted."""

from __future__ import annotations

from dataclasses import dataclass

from sysid.errors import ConfigError
from sysid.estimation.linear.subspace.projections import Weighting
from sysid.models.orders.typed_fields import TypedFields

METHODS = ("prediction-error", "subspace")


BEST = "best"


WEIGHTINGS = (BEST, *(one.value for one in Weighting))


@dataclass(frozen=True, kw_only=True)
class StateSpaceTraining(TypedFields):
    """How a linear state space is fitted.

    Args:
        method: ``prediction-error``, from a subspace estimate on; or ``subspace``, without iterations.
        weighting: Of the subspace method: ``N4SID``, ``MOESP``, ``CVA``, ``SSARX`` (also for records under feedback),
            or ``best``: each is tried, and the one with the least prediction error is taken.
        horizon: Samples of past and of future that it looks at; ``None`` takes the order of a long ARX model, up to 40,
            by Akaike's criterion.
        stable: Keep all poles inside the unit circle; ``None`` does so where the noise is not modelled, since the free
            run of an unstable plant is then lost.
        max_iterations: Steps of the prediction-error method.
        max_delay: Largest dead time that is tried where the structure leaves it open, in samples; by default a third of
            the longest record.
        max_time_s: Wall time in seconds.
        seed: Nothing is random; here so that all training has one.

    Raises:
        ConfigError: If a name or a number cannot be used.
    """

    method: str = METHODS[0]
    weighting: str = BEST
    horizon: int | None = None
    stable: bool | None = None
    max_iterations: int = 100
    max_delay: int | None = None
    max_time_s: float = float("inf")
    seed: int = 0

    def __post_init__(self) -> None:
        for name, choices in (("method", METHODS), ("weighting", WEIGHTINGS)):
            if getattr(self, name) not in choices:
                raise ConfigError(
                    f"unknown {name}",
                    where=name,
                    expected=" or ".join(choices),
                    got=getattr(self, name),
                    remedy=f"write for example {name}: {choices[0]}",
                )
        for name, least in (("max_iterations", 0), ("horizon", 2), ("max_delay", 0)):
            value = getattr(self, name)
            if value is not None and value < least:
                raise ConfigError(
                    f"{name} is too small", where=name, expected=f"{least} or more", got=value, remedy="correct it"
                )
