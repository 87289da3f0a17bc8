r"""Windows of lagged data, compressed: block-Hankel rows of every record as one small triangular factor.

Row :math:`t` holds a constant, the past :math:`(u, y)_{t-p}, \dots, (u, y)_{t-1}` and the future :math:`(u, y)_t,
\dots, (u, y)_{t+f-1}`. No row crosses from one record into the next, nor over a masked sample. Of all rows
:math:`W = QR` only :math:`R` is kept, block by block, so that memory does not grow with the number of samples: any
least-squares problem among the columns of :math:`W` has the solution of the same problem among those of :math:`R`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.errors import TraceError
from sysid.estimation.linear.segments import Segment

Array = NDArray[np.float64]

BLOCK_VALUES = 1_000_000
"""Numbers in a block of rows: some 8 MB."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Windows:
    """What is kept of all windows.

    Args:
        R: Triangular factor, shape ``(n_columns, n_columns)`` or with fewer rows.
        past: Samples before each window's middle.
        future: Samples from there on.
        n_inputs: Number of inputs.
        n_outputs: Number of outputs.
        n_rows: Number of windows.
    """

    R: Array
    past: int
    future: int
    n_inputs: int
    n_outputs: int
    n_rows: int

    @classmethod
    def of(cls, segments: Sequence[Segment], past: int, future: int) -> Windows:
        """The windows of some records.

        Args:
            segments: The records, or what is whole of them.
            past: Samples before.
            future: Samples after.

        Returns:
            Their compression.

        Raises:
            TraceError: If no record is as long as a window.
        """
        pieces = [piece for segment in segments for piece in segment.pieces() if len(piece) >= past + future]
        if not pieces:
            raise TraceError(
                "no record is long enough for the horizon of a subspace method",
                expected=f"at least {past + future} samples in a row that are not masked",
                got=f"{max((len(piece) for segment in segments for piece in segment.pieces()), default=0)} samples",
                remedy="ask for fewer states or a shorter horizon, or use longer records",
            )
        m, p = pieces[0].inputs.shape[1], pieces[0].outputs.shape[1]
        width = 1 + (past + future) * (m + p)
        R = np.zeros((0, width))
        block, n_rows = max(BLOCK_VALUES // width, 2 * width), 0
        waiting: list[Array] = []
        for piece in pieces:
            z = np.concatenate([piece.inputs, piece.outputs], axis=1)
            count = len(z) - past - future + 1
            n_rows += count
            view = np.lib.stride_tricks.sliding_window_view(z, past + future, axis=0)  # rows, channels, times
            for first in range(0, count, block):
                rows = np.swapaxes(view[first : first + block], 1, 2).reshape(-1, width - 1)
                waiting.append(np.concatenate([np.ones((len(rows), 1)), rows], axis=1))
                if sum(map(len, waiting)) >= block:
                    R, waiting = _factor(R, waiting), []
        R = _factor(R, waiting) if waiting else R
        return cls(R=R, past=past, future=future, n_inputs=m, n_outputs=p, n_rows=n_rows)

    def shortened(self, past: int) -> Windows:
        """The same windows with less past.

        Args:
            past: Samples before each window's middle.

        Returns:
            The windows; those at the beginning of each record that a shorter past would add are left out.
        """
        dropped = (self.past - past) * (self.n_inputs + self.n_outputs)
        kept = np.concatenate([self.R[:, :1], self.R[:, 1 + dropped :]], axis=1)
        return replace(self, R=_factor(kept[:0], [kept]), past=past)

    @property
    def constant(self) -> Array:
        """The column of the constant."""
        return self.R[:, :1]

    def at(self, first: int, last: int) -> Array:
        """Inputs and outputs at some times, oldest first, each time's inputs before its outputs.

        Args:
            first: From this time on; the middle is 0, the past negative.
            last: Up to and without this time.

        Returns:
            Columns.
        """
        width = self.n_inputs + self.n_outputs
        begin = 1 + (self.past + first) * width
        return self.R[:, begin : begin + (last - first) * width]

    def inputs(self, first: int, last: int) -> Array:
        """Inputs alone at some times; see :meth:`at`."""
        width = self.n_inputs + self.n_outputs
        return self.at(first, last).reshape(len(self.R), -1, width)[:, :, : self.n_inputs].reshape(len(self.R), -1)

    def outputs(self, first: int, last: int) -> Array:
        """Outputs alone at some times; see :meth:`at`."""
        width = self.n_inputs + self.n_outputs
        return self.at(first, last).reshape(len(self.R), -1, width)[:, :, self.n_inputs :].reshape(len(self.R), -1)


def _factor(R: Array, waiting: Sequence[Array]) -> Array:
    stacked = np.concatenate([R, *waiting])
    found = linalg.qr(stacked, mode="r", overwrite_a=True, check_finite=False)[0]
    return np.ascontiguousarray(found[: stacked.shape[1]])
