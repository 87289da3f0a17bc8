"""Input sequences that no record contains, for finding out whether a free run stays what it should be.

Inputs of a mapping are rarely independent: they are states of one system, and a sequence that sets each at random asks
about a system that cannot exist. There are two honest sources: excursions of the records
(:mod:`sysid.estimation.stability.excursions`), and **traces** (:class:`TraceSequences`) of a generator's random
commands: the inputs that the system really has, and with them the outputs it really has, so that every plateau on the
way is judged.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.models import History
from sysid.traces import Trace

STILL = 0.01
"""Share of a channel's range within which it stands still."""


@dataclass(frozen=True, kw_only=True, eq=False)
class InputSequence:
    """One sequence of inputs, and what is known of the outputs that belong to it.

    Args:
        name: Of the sequence.
        inputs: In their units, shape ``(n_samples, n_inputs)``.
        targets: Outputs in their units, shape ``(n_samples, n_outputs)``.
        judged: Samples at which the outputs have settled at the target, shape ``(n_samples,)``.
    """

    name: str
    inputs: NDArray[np.float64]
    targets: NDArray[np.float64]
    judged: NDArray[np.bool_]

    def history(self, *, several: bool, output: int = 0) -> History:
        """Before the first sample everything stands where it begins.

        Args:
            several: For a model of all outputs; of one otherwise.
            output: The place of that one.

        Returns:
            The history.
        """
        stands = self.targets[0] if several else float(self.targets[0, output])
        return History.at_rest(inputs=self.inputs[0], output=stands)


class AbstractSequences(ABC):
    """A source of input sequences.

    Concrete sources are frozen dataclasses with at least these fields.
    """

    inputs: tuple[str, ...]
    """Names of the input channels."""
    outputs: tuple[str, ...]
    """Names of the output channels."""
    sample_time: float
    """Seconds between samples."""

    @property
    @abstractmethod
    def source(self) -> str:
        """Where the sequences come from, as a sentence."""

    @property
    @abstractmethod
    def output_range(self) -> NDArray[np.float64]:
        """Least and greatest value of each output in the records, shape ``(2, n_outputs)``."""

    def available(self, count: int) -> int:
        """How many there are where so many are asked for."""
        return count

    @abstractmethod
    def draw(self, count: int, seed: int) -> Iterator[InputSequence]:
        """The sequences, one after the other.

        Args:
            count: How many at most.
            seed: Of the random numbers.

        Yields:
            Each sequence.
        """


@dataclass(frozen=True, kw_only=True, eq=False)
class TraceSequences(AbstractSequences):
    """Traces as they are: a generator's random commands, or records of the real thing.

    Args:
        inputs: Names of the input channels.
        outputs: Names of the output channels.
        sample_time: Seconds between samples.
        traces: The traces, in order; the first ``count`` are drawn, whatever the seed.
        source_text: Where they come from, as a sentence.
        still: Samples for which an output has to stand still before it is judged.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    sample_time: float
    traces: Sequence[Trace]
    source_text: str
    still: int

    @property
    def source(self) -> str:
        """Where the sequences come from, as a sentence."""
        return self.source_text

    @property
    def output_range(self) -> NDArray[np.float64]:
        """Least and greatest value of each output in the traces, shape ``(2, n_outputs)``."""
        columns = [trace.columns(self.outputs) for trace in self.traces]
        low, high = np.min([c.min(axis=0) for c in columns], axis=0), np.max([c.max(axis=0) for c in columns], axis=0)
        return np.stack([low, high])

    def available(self, count: int) -> int:
        """As many as there are traces, at most."""
        return min(count, len(self.traces))

    def draw(self, count: int, seed: int) -> Iterator[InputSequence]:
        """The traces; each is judged where its outputs have stood still."""
        del seed  # nothing is random here
        span = np.ptp(self.output_range, axis=0)
        scale = np.where(span > 0.0, span, 1.0)
        for trace in self.traces[:count]:
            targets = trace.columns(self.outputs)
            judged = plateaus(targets / scale, self.still) & trace.usable_samples
            yield InputSequence(name=trace.name, inputs=trace.columns(self.inputs), targets=targets, judged=judged)


def plateaus(scaled: NDArray[np.float64], window: int) -> NDArray[np.bool_]:
    """Samples before which every column has stood still for a window.

    Args:
        scaled: Columns over their ranges, shape ``(n_samples, n_columns)``.
        window: Samples.

    Returns:
        Shape ``(n_samples,)``.
    """
    # The filter at t looks from t - size // 2 on; the window that ends at s is that of the filter a lead before s.
    size = min(window, len(scaled) - 1) + 1
    lead = size - 1 - size // 2
    stands = np.ones(len(scaled), dtype=bool)
    for column in scaled.T:
        spread = scipy.ndimage.maximum_filter1d(column, size)
        spread -= scipy.ndimage.minimum_filter1d(column, size)
        stands &= spread <= STILL
    still = np.zeros(len(scaled), dtype=bool)
    still[window:] = stands[window - lead : len(scaled) - lead]
    return still
