"""The radio of distributed power: what locomotives inside a train hear of the handle in front, and how late.

The leading locomotive sends its handle whenever it moves, and again at even intervals, as such radios do to show that
the link stands. A message arrives after a delay, or not at all; a locomotive that hears nothing holds what it heard
last.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.airbrake.settings import check_numbers
from sysid.errors import ConfigError


@dataclass(frozen=True, kw_only=True)
class Radio:
    """A link from the leading locomotive to all others.

    Args:
        delay: From the handle to the remote brake valve in s.
        loss: Probability that a message is lost, each by itself.
        repeat: Time in s after which the handle is sent again.
        seed: Of what is lost.

    Raises:
        ConfigError: If a number is out of range.
    """

    delay: float = 1.0
    loss: float = 0.0
    repeat: float = 1.0
    seed: int = 0

    def __post_init__(self) -> None:
        check_numbers(self, "a radio", from_zero=("delay", "loss", "seed"))
        if self.loss > 1.0:
            raise ConfigError(
                "not a radio: a loss is a probability", where="radio, loss", expected="from 0 to 1", got=self.loss
            )

    def heard(self, command: NDArray[np.float64], sample_time: float) -> NDArray[np.float64]:
        """The handle as the others have it.

        Args:
            command: At each sample, shape ``(n,)``.
            sample_time: In s.

        Returns:
            The same, late and held where nothing arrives; what stands at the first sample is known.

        Example:
            >>> Radio(delay=0.2).heard(np.array([90.0, 70.0, 70.0, 70.0]), 0.1).tolist()
            [90.0, 90.0, 90.0, 70.0]
        """
        rng, late = np.random.default_rng(self.seed), round(self.delay / sample_time)
        every = max(1, round(self.repeat / sample_time))
        shown = np.full(len(command), command[0] if len(command) else 0.0)
        sent = 0
        for k in range(1, len(command)):
            if command[k] != command[k - 1] or k - sent >= every:
                sent = k
                if rng.random() >= self.loss:
                    shown[k + late :] = command[k]
        return shown
