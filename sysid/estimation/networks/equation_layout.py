"""Where the free parameters of an equation stand that is trained with networks, and what is known of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.models import GreyBox, Member
from sysid.models.grey_box.declared import Parameter


@dataclass(frozen=True, kw_only=True)
class EquationLayout:
    """The free parameters of a grey box without states, each trained over its scale.

    Args:
        name: The output, for the names of groups.
        parameters: What is declared of each.
    """

    name: str
    parameters: tuple[Parameter, ...]

    @classmethod
    def of(cls, model: Member) -> EquationLayout:
        """The layout of a member that is an equation.

        Args:
            model: The member.

        Returns:
            Its layout.

        Raises:
            ConfigError: If it has weights besides: networks in an equation are fitted with it alone.
        """
        grey = model.structure
        if not isinstance(grey, GreyBox) or model.n_parameters != len(grey.free):
            raise ConfigError(
                "an equation has more to train than parameters",
                where=str(model.mapping),
                expected="an equation without networks inside",
                got=grey.label,
                remedy="fit it alone, and train the others beside it",
            )
        return cls(name=model.mapping.output, parameters=grey.free)

    @property
    def n_parameters(self) -> int:
        """Number of parameters."""
        return len(self.parameters)

    @property
    def scale(self) -> NDArray[np.float64]:
        """Of each parameter, in its unit."""
        return np.array([one.scale for one in self.parameters])

    def centre(self) -> NDArray[np.float64]:
        """Where each is declared to start, in its unit: what a prior draws it to."""
        return np.array([one.start for one in self.parameters])
