"""What fitted networks have in common, whatever lags or states they read: weights, their scaling, a bound."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from sysid.models.channels.scaling import scaling_from_dict
from sysid.models.contract.base import AbstractModel
from sysid.models.contract.flat import as_many


class NetworkModel(AbstractModel):
    """A fitted network: a frozen dataclass with the fields below, held within a bound in scaled numbers."""

    if TYPE_CHECKING:  # fields of the dataclasses

        @property
        def theta(self) -> NDArray[np.float64]:
            """Flat parameters in scaled numbers."""

        @property
        def scaling(self) -> Any:
            """Between units and scaled numbers."""

        @property
        def clamp(self) -> float:
            """Bound of the outputs in scaled numbers; infinite for none."""

    def __post_init__(self) -> None:
        theta = np.array(self.theta, dtype=np.float64)
        theta.setflags(write=False)
        object.__setattr__(self, "theta", theta)
        object.__setattr__(self, "input_units", tuple(self.input_units))

    @property
    def n_parameters(self) -> int:
        """Length of ``theta``."""
        return len(self.theta)

    def with_theta(self, theta: NDArray[np.float64]) -> Self:
        """The same network with other weights."""
        model: Any = self  # a dataclass
        found: Self = replace(model, theta=as_many(theta, len(self.theta)))
        return found

    def _written(self) -> dict[str, Any]:
        return {
            "clamp": self.clamp if np.isfinite(self.clamp) else None,  # JSON has no infinity
            "scaling": self.scaling.to_dict(),
            "theta": self.theta.tolist(),
        }

    @staticmethod
    def _read(fields: Dict[str, Any]) -> dict[str, Any]:
        return {
            "theta": np.array(fields["theta"], dtype=np.float64),
            "scaling": scaling_from_dict(fields["scaling"]),
            "clamp": np.inf if fields["clamp"] is None else fields["clamp"],
        }
