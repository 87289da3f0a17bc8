"""The unit in which frequencies are drawn and told: hertz, as rates and bands of records have it, unless asked."""

from __future__ import annotations

from enum import StrEnum
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError

Told = TypeVar("Told", float, NDArray[np.float64])


class FrequencyUnit(StrEnum):
    """What stands on an axis of frequencies; arrays and tables have rad/s, whatever is drawn."""

    HERTZ = "Hz"
    RADIANS = "rad/s"

    @classmethod
    def of(cls, value: str) -> FrequencyUnit:
        """A unit as people write it.

        Args:
            value: ``"Hz"`` or ``"rad/s"``.

        Returns:
            The unit.

        Raises:
            ConfigError: If it is neither.

        Example:
            >>> FrequencyUnit.of("rad/s").label
            'frequency [rad/s]'
        """
        try:
            return cls(value)
        except ValueError:
            raise ConfigError(
                "not a unit in which frequencies are drawn",
                expected=" or ".join(cls),
                got=repr(value),
                remedy="write Hz, which is the default, or rad/s",
            ) from None

    @property
    def label(self) -> str:
        """What is written along an axis."""
        return f"frequency [{self.value}]"

    def told(self, frequency: Told) -> Told:
        """Frequencies that are given in rad/s, in this unit.

        Args:
            frequency: In rad/s.

        Returns:
            They in this unit.
        """
        return frequency / (2.0 * np.pi) if self is FrequencyUnit.HERTZ else frequency

    def radians(self, frequency: Told) -> Told:
        """Frequencies that are given in this unit, in rad/s.

        Args:
            frequency: In this unit.

        Returns:
            They in rad/s.
        """
        return frequency * (2.0 * np.pi) if self is FrequencyUnit.HERTZ else frequency


HERTZ = FrequencyUnit.HERTZ
