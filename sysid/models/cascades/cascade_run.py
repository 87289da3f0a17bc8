"""What a cascade puts out, and what had to be held on the way."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError
from sysid.kernels.cascade_layout import HIGH, HIGH_CHANNEL, LOST, LOW, LOW_CHANNEL
from sysid.traces import Channel, Trace

Level = float | str
"""A value at rest in the channel's unit, or the input whose first sample it is."""


@dataclass(frozen=True, kw_only=True)
class Activity:
    """How often an output was held.

    Args:
        low: Samples at the declared lower limit.
        high: Samples at the declared upper limit.
        lost: Samples at the bound of the network itself, far outside the range that it was trained on.
        samples: Samples of the run.
    """

    low: int
    high: int
    lost: int
    samples: int

    @property
    def sentence(self) -> str:
        """For reports: which limits were active, and how long."""
        parts = [
            f"at its {what} for {100.0 * count / self.samples:.2g} % of {self.samples} samples"
            for what, count in (("lower limit", self.low), ("upper limit", self.high), ("network's bound", self.lost))
            if count
        ]
        return ", ".join(parts) or "never held"


@dataclass(frozen=True, kw_only=True, eq=False)
class CascadeRun:
    """Every channel of a free run.

    Args:
        inputs: Names of the inputs.
        outputs: Names of the outputs, in the order in which they are computed.
        values: Inputs, then outputs, in their units: shape ``(n_samples, n_channels)``, or ``(n_records, n_samples,
            n_channels)`` for a batch.
        held: What held each output at each sample, codes of ``sysid.kernels.cascade_layout``; same leading shape, last
            axis ``n_outputs``.
        units: Unit of every channel.
        sample_time: Seconds.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    values: NDArray[np.float64]
    held: NDArray[np.int8]
    units: Dict[str, str]
    sample_time: float

    def __getitem__(self, channel: str) -> NDArray[np.float64]:
        """One channel, shape ``(n_samples,)`` or ``(n_records, n_samples)``."""
        names = (*self.inputs, *self.outputs)
        if channel not in names:
            raise ChannelError([channel], names, where="run of the cascade")
        return self.values[..., names.index(channel)]

    def __contains__(self, channel: object) -> bool:
        return channel in (*self.inputs, *self.outputs)

    @property
    def activity(self) -> dict[str, Activity]:
        """How often each output was held, over all records."""
        found = {}
        for i, name in enumerate(self.outputs):
            counts = np.bincount(self.held[..., i].ravel(), minlength=LOST + 1)
            found[name] = Activity(
                low=int(counts[LOW] + counts[LOW_CHANNEL]),
                high=int(counts[HIGH] + counts[HIGH_CHANNEL]),
                lost=int(counts[LOST]),
                samples=int(self.held[..., i].size),
            )
        return found

    def trace(self, name: str, *, start_time: float = 0.0) -> Trace:
        """A single run as a trace.

        Args:
            name: Name of the case.
            start_time: Time of the first sample in seconds.

        Returns:
            The trace, with every channel.

        Raises:
            TraceError: If it is a batch, or a value is not finite.
        """
        channels = tuple(Channel(name=one, unit=self.units[one]) for one in (*self.inputs, *self.outputs))
        return Trace(
            name=name, sample_time=self.sample_time, channels=channels, values=self.values, start_time=start_time
        )
