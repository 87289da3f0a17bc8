"""The samples of one file on their way to a trace, with what was done to them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sysid.ingest.tables.table import RawTable


@dataclass(frozen=True, kw_only=True, eq=False)
class Record:
    """The samples of one file on their way to a trace.

    Args:
        table: The file they came from.
        rows: Shape ``(n,)``: row of the file that each sample was; ``None`` while it is all of them, in their order.
        stamps: Shape ``(n,)``, seconds.
        names: Channel names.
        values: Shape ``(n, n_channels)``.
        marked: Shape ``(n, n_channels)``: values that must not count.
        notes: What was done, one sentence each.
    """

    table: RawTable
    rows: NDArray[np.intp] | None = None
    stamps: NDArray[np.float64]
    names: tuple[str, ...]
    values: NDArray[np.float64]
    marked: NDArray[np.bool_]
    notes: tuple[str, ...] = field(default=())

    def at(self, index: int) -> str:
        """Where a sample is in the file, for messages."""
        return self.table.place(index if self.rows is None else int(self.rows[index]))

    def where(self, index: int, channel: str | None = None) -> str:
        """File, channel and sample, for messages."""
        middle = "" if channel is None else f", channel {channel}"
        return f"{self.table.source}{middle}, {self.at(index)}"

    def keep(self, chosen: NDArray[np.intp] | NDArray[np.bool_], note: str | None = None) -> Record:
        """Some of the samples, in the order given."""
        taken = np.arange(len(self.stamps))[chosen]
        return replace(
            self,
            rows=taken if self.rows is None else self.rows[taken],
            stamps=self.stamps[chosen],
            values=self.values[chosen],
            marked=self.marked[chosen],
            notes=self.notes if note is None else (*self.notes, note),
        )

    def noted(self, note: str) -> Record:
        """The same samples with a sentence added."""
        return replace(self, notes=(*self.notes, note))
