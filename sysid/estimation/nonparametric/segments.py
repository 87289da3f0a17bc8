"""Stretches of usable samples: a lag never reaches across a gap, nor from one experiment into the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.models import Mapping
from sysid.traces import Trace


@dataclass(frozen=True, kw_only=True, eq=False)
class Segment:
    """Samples in a row that all count, or whose inputs do.

    Args:
        inputs: In the channels' units, shape ``(n_samples, n_inputs)``.
        output: In its unit, shape ``(n_samples,)``.
        trace: Name of the trace that it is of.
        first: Its first sample in that trace.
        seen: Which samples of the output count, shape ``(n_samples,)``; all where there is none.
    """

    inputs: NDArray[np.float64]
    output: NDArray[np.float64]
    trace: str = ""
    first: int = 0
    seen: NDArray[np.bool_] | None = None

    def __len__(self) -> int:
        return len(self.output)

    def counts(self, past: int = 0) -> NDArray[np.bool_]:
        """Which samples of the output count, with the last few before them.

        Args:
            past: How many before.

        Returns:
            Shape ``(n_samples,)``.
        """
        counts = np.ones(len(self), dtype=np.bool_) if self.seen is None else self.seen
        found = counts.copy()
        found[:past] = False
        for k in range(1, past + 1 if self.seen is not None else 1):
            found[k:] &= counts[:-k]
        return found


def segments_of(
    traces: Sequence[Trace], mapping: Mapping, *, shortest: int = 1, of_inputs: bool = False
) -> tuple[Segment, ...]:
    """The stretches of some traces.

    Args:
        traces: The traces.
        mapping: Which channels go in, which comes out.
        shortest: Stretches with fewer samples are left out.
        of_inputs: Whether a stretch goes on where the output alone is missing: for what looks at past inputs, and at
            no past output.

    Returns:
        The stretches, in order.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        TraceError: If a channel has values that cannot be squared.
    """
    found = []
    for trace in traces:
        trace.check_sizes([*mapping.inputs, mapping.output])
        inputs, output = trace.columns(mapping.inputs), trace.columns([mapping.output])[:, 0]
        weighed = True if trace.weights is None else trace.weights > 0.0
        usable = trace.usable_of(mapping.channels) & weighed
        for part in stretches(trace.usable_of(mapping.inputs) & weighed if of_inputs else usable):
            seen = usable[part]
            if len(seen) >= shortest and seen.any():
                some = None if seen.all() else seen
                at = int(part.start)
                found.append(Segment(inputs=inputs[part], output=output[part], trace=trace.name, first=at, seen=some))
    return tuple(found)


def stretches(usable: NDArray[np.bool_]) -> list[slice]:
    """Where a mask is true, one stretch after the other.

    Args:
        usable: Shape ``(n_samples,)``.

    Returns:
        From the first sample of each to the one after its last.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], usable.astype(np.int8), [0]])))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def columns_of_lags(x: NDArray[np.float64], lags: Sequence[int], rows: slice) -> NDArray[np.float64]:
    """A signal at some lags, negative ones being samples to come.

    Args:
        x: Shape ``(n_samples,)``.
        lags: In samples.
        rows: The samples that are looked from; every lag of each lies within the signal.

    Returns:
        Shape ``(n_rows, n_lags)``.
    """
    start, stop, _ = rows.indices(len(x))
    return np.column_stack([x[start - lag : stop - lag] for lag in lags]) if len(lags) else np.empty((stop - start, 0))
