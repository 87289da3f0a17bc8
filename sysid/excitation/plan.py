"""What an excitation is drawn for, and what a kind of excitation is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError

MOST_SAMPLES = 20_000_000


@dataclass(frozen=True, kw_only=True)
class Plan:
    """An experiment.

    Args:
        samples: How long it is.
        sample_time: Seconds.
        channels: Inputs that are moved at the same time, each by a signal of its own.
        seed: Of everything that is random.

    Raises:
        ConfigError: If a number is out of range.
    """

    samples: int
    sample_time: float
    channels: int = 1
    seed: int = 0

    def __post_init__(self) -> None:
        check(0.0 < self.sample_time < np.inf, "sample_time", "seconds, above 0", self.sample_time)
        check(self.samples >= 2, "samples", "2 or more", self.samples)
        check(1 <= self.channels <= 1000, "channels", "1 to 1000", self.channels)
        most = MOST_SAMPLES // self.channels
        check(self.samples <= most, "samples", f"at most {most:,} for {self.channels} channels", self.samples)
        check(self.seed >= 0, "seed", "an integer from 0 on", self.seed)

    @property
    def nyquist(self) -> float:
        """Half the sampling frequency, in Hz."""
        return 0.5 / self.sample_time

    def rng(self, channel: int) -> np.random.Generator:
        """The random numbers of one channel, which do not depend on how many there are."""
        return np.random.default_rng([self.seed, channel])


class AbstractExcitation(ABC):
    """A kind of signal; concrete kinds are frozen dataclasses whose fields are its options."""

    @abstractmethod
    def draw(self, plan: Plan) -> NDArray[np.float64]:
        """The signal of each channel.

        Args:
            plan: The experiment.

        Returns:
            Shape ``(samples, channels)``, from -1 to 1.

        Raises:
            ConfigError: If an option does not go with the experiment.
        """


def check(holds: bool, name: str, expected: str, got: object) -> None:
    """Refuse an option that is out of range.

    Args:
        holds: Whether it is in range.
        name: The option.
        expected: What would have been.
        got: What it is.

    Raises:
        ConfigError: If it is not.
    """
    if not holds:
        raise ConfigError(
            f"{name} is out of range",
            where="excitation",
            expected=expected,
            got=got,
            remedy=f"give {name} {expected}",
        )


def band_in_hertz(band: tuple[float, float] | None, plan: Plan, *, slowest: float | None = None) -> tuple[float, float]:
    """The band of a signal, checked.

    Args:
        band: Lowest and highest frequency in Hz; ``None`` for all that the experiment can hold.
        plan: The experiment.
        slowest: The lowest frequency that it can hold; that of one swing over its whole length by default.

    Returns:
        The two.

    Raises:
        ConfigError: If it is none, or reaches beyond half the sampling frequency.
    """
    slowest = 1.0 / (plan.samples * plan.sample_time) if slowest is None else slowest
    if band is None:
        return slowest, plan.nyquist
    low, high = band
    top = plan.nyquist * (1.0 + 1e-9)
    check(
        0.0 <= low < high <= top, "band", f"two rising numbers of Hz, from 0 to {plan.nyquist:g}", f"{low:g}:{high:g}"
    )
    return low, high
