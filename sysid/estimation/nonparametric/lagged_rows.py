"""A record as a regression on past inputs, in blocks of rows: no matrix of the whole record is ever held."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.nonparametric.evidence import CHUNK, Triangle, triangle
from sysid.estimation.nonparametric.segments import Segment, columns_of_lags, stretches


@dataclass(frozen=True, kw_only=True, eq=False)
class Regression:
    """A record as a regression on past inputs.

    Args:
        segments: Stretches of the record, long enough.
        scale: By which inputs and then the output are divided.
        length: Lags of each input, from 0 on.
    """

    segments: tuple[Segment, ...]
    scale: NDArray[np.float64]
    length: int

    @property
    def n_inputs(self) -> int:
        """Inputs."""
        return len(self.scale) - 1

    def blocks(self, whiten: NDArray[np.float64]) -> Iterator[NDArray[np.float64]]:
        """Rows of lagged inputs and the output, each trace counted from its mean.

        Args:
            whiten: Coefficients of the filter that every signal passes, its first being 1.

        Yields:
            Matrices of shape ``(n_rows, n_inputs * length + 1)``.
        """
        first = self.length - 1 + len(whiten) - 1
        by_trace: dict[str, list[tuple[NDArray[np.float64], NDArray[np.bool_]]]] = {}
        for segment in self.segments:
            counts = segment.counts(len(whiten) - 1)
            counts[:first] = False
            if counts.any():
                signals = np.column_stack([segment.inputs, segment.output]) / self.scale
                white = np.column_stack([np.convolve(whiten, x)[: len(x)] for x in signals.T])
                by_trace.setdefault(segment.trace, []).append((white, counts))
        lags = range(self.length)
        for parts in by_trace.values():
            rows = sum(np.count_nonzero(counts) for _, counts in parts)
            mean = np.sum([_column_sums(x, lags, first, counts) for x, counts in parts], axis=0) / rows
            for x, counts in parts:
                for start in range(first, len(x), CHUNK):
                    part = slice(start, min(start + CHUNK, len(x)))
                    block = np.column_stack([*(columns_of_lags(u, lags, part) for u in x.T[:-1]), x[part, -1]])
                    yield (block if counts[part].all() else block[counts[part]]) - mean

    def count(self, whiten: NDArray[np.float64]) -> tuple[int, int]:
        """Rows, and traces that have any."""
        past = len(whiten) - 1
        rows = [int(np.count_nonzero(s.counts(past)[self.length - 1 + past :])) for s in self.segments]
        return sum(rows), len({s.trace for s, n in zip(self.segments, rows, strict=True) if n})

    def triangle(self, whiten: NDArray[np.float64]) -> Triangle:
        """The triangular factor of the regression; the level of each trace has taken one row."""
        found = triangle(self.blocks(whiten), free=0)
        return Triangle(R=found.R, z=found.z, samples=max(found.samples - self.count(whiten)[1], 1))

    def residuals(self, g: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        """What the scaled response ``g`` leaves, stretch by stretch of the output.

        Each stretch of the inputs is counted from its mean.
        """
        found = []
        for segment in self.segments:
            counts = segment.counts()[self.length - 1 :]
            if len(segment) > self.length and counts.any():
                u, y = segment.inputs / self.scale[:-1], segment.output / self.scale[-1]
                made = [np.convolve(row, x - x.mean())[: len(x)] for row, x in zip(g, u.T, strict=True)]
                left = (y - np.sum(made, axis=0))[self.length - 1 :]
                left = left - left[counts].mean()
                found += [left[part] for part in stretches(counts)]
        return found


def _column_sums(
    x: NDArray[np.float64], lags: Sequence[int], first: int, counts: NDArray[np.bool_]
) -> NDArray[np.float64]:
    rows = slice(None) if counts[first:].all() else counts[first:]
    sums = [[float(x[first - lag : len(x) - lag, j][rows].sum()) for lag in lags] for j in range(x.shape[1] - 1)]
    return np.array([value for row in sums for value in row] + [float(x[first:, -1][rows].sum())])
