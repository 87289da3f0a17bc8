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
    """Samples in a row that all count.

    Args:
        inputs: In the channels' units, shape ``(n_samples, n_inputs)``.
        output: In its unit, shape ``(n_samples,)``.
        trace: Name of the trace that it is of.
        first: Its first sample in that trace.
    """

    inputs: NDArray[np.float64]
    output: NDArray[np.float64]
    trace: str = ""
    first: int = 0

    def __len__(self) -> int:
        return len(self.output)


def segments_of(traces: Sequence[Trace], mapping: Mapping, *, shortest: int = 1) -> tuple[Segment, ...]:
    """The stretches of some traces.

    Args:
        traces: The traces.
        mapping: Which channels go in, which comes out.
        shortest: Stretches with fewer samples are left out.

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
        usable = trace.usable_of(mapping.channels)
        if trace.weights is not None:
            usable = usable & (trace.weights > 0.0)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], usable.astype(np.int8), [0]])))
        found += [
            Segment(inputs=inputs[a:b], output=output[a:b], trace=trace.name, first=int(a))
            for a, b in zip(edges[::2], edges[1::2], strict=True)
            if b - a >= shortest
        ]
    return tuple(found)


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
