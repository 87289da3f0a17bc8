"""Commands that a system might be given next: pieces of the records' inputs, in other order.

Pieces are of random length and from anywhere (the moving block bootstrap of Künsch 1989, Annals of Statistics 17), so
that one may end before the output has come to rest, where none of the record's does. What the outputs would be, nobody
knows: models are compared with each other, not with a target.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError
from sysid.estimation.stability.excursions import usable_parts
from sysid.estimation.stability.sequences import AbstractSequences, InputSequence
from sysid.traces import Trace

LONGEST = 1000
"""Samples of a sequence at most."""
SHORTEST_SHARE, SHORTEST = 100, 20
"""A piece has a hundredth of its record at least, and of a long record so many samples."""
LONGEST_SHARE = 8
"""A piece has at most this part of its record, and half of the sequence."""


@dataclass(frozen=True, kw_only=True, eq=False)
class OtherCommands(AbstractSequences):
    """Pieces of records' inputs in other order; each sequence is of one record.

    Args:
        inputs: Names of the input channels.
        outputs: Names of the output channels.
        sample_time: Seconds between samples.
        records: Inputs and outputs side by side, each of shape ``(n_samples, n_inputs + n_outputs)``.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    sample_time: float
    records: tuple[NDArray[np.float64], ...]

    @classmethod
    def of(cls, traces: Sequence[Trace], inputs: Sequence[str], outputs: Sequence[str]) -> OtherCommands:
        """What some traces give.

        Args:
            traces: At least one.
            inputs: Names of the input channels.
            outputs: Names of the output channels.

        Returns:
            The source.

        Raises:
            ChannelError: If a trace lacks a channel.
            TraceError: If no trace has 20 usable samples in a row.
        """
        records = tuple(part for trace in traces for part in usable_parts(trace, [*inputs, *outputs]))
        if not records:
            raise TraceError("no trace is long enough for other commands", expected="20 usable samples in a row")
        return cls(
            inputs=tuple(inputs), outputs=tuple(outputs), sample_time=traces[0].sample_time, records=records
        )  # fmt: skip

    @property
    def source(self) -> str:
        """Where the sequences come from, as a sentence."""
        return "Pieces of the estimation traces' inputs, in other order."

    @property
    def output_range(self) -> NDArray[np.float64]:
        """Least and greatest value of each output in the records, shape ``(2, n_outputs)``."""
        outputs = [record[:, len(self.inputs) :] for record in self.records]
        return np.stack(
            [np.min([o.min(axis=0) for o in outputs], axis=0), np.max([o.max(axis=0) for o in outputs], axis=0)]
        )

    def draw(self, count: int, seed: int) -> Iterator[InputSequence]:
        """The sequences; each depends on the seed and its own number alone. None of their samples is judged."""
        shares = np.array([len(record) for record in self.records], dtype=np.float64)
        for number in range(count):
            rng = np.random.default_rng([seed, number])
            record = self.records[rng.choice(len(shares), p=shares / shares.sum())]
            rows = record[_in_other_order(len(record), rng, min(len(record), LONGEST))]
            m = len(self.inputs)
            still = np.broadcast_to(rows[0, m:], (len(rows), rows.shape[1] - m))
            judged = np.zeros(len(rows), dtype=bool)
            yield InputSequence(name=f"command {number + 1}", inputs=rows[:, :m], targets=still, judged=judged)


def _in_other_order(n: int, rng: np.random.Generator, samples: int) -> NDArray[np.int64]:
    """The places of a record's samples, piece by piece; lengths are even in their logarithm."""
    low = max(2, min(n // SHORTEST_SHARE, SHORTEST))
    high = max(4, min(n // LONGEST_SHARE, samples // 2))
    pieces, total = list[NDArray[np.int64]](), 0
    while total < samples:
        length = round(math.exp(rng.uniform(math.log(low), math.log(high))))
        first = int(rng.integers(0, n - length))
        pieces.append(np.arange(first, first + length))
        total += length
    return np.concatenate(pieces)[:samples]
