"""When a record of calendar time began: what its second 0 is on the clock."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

import numpy as np

from sysid.errors import ConfigError
from sysid.ingest.cells.zones import to_utc, utc_microseconds


@dataclass(frozen=True, kw_only=True)
class Began:
    """The first date and time of a column.

    Args:
        micros: Microseconds since 1970: UTC where the stamps have a zone, as the clock showed them otherwise.
        zoned: Whether the stamps have a zone, of their own or a declared one.
        zone: The declared one, in which dates without a zone are meant.
    """

    micros: int
    zoned: bool = False
    zone: str | None = None

    def seconds(self, date: datetime, *, where: str) -> float:
        """How long after the first row a date is.

        Args:
            date: With a zone or without one.
            where: Named in the error.

        Returns:
            Seconds; below zero before the first row.

        Raises:
            ConfigError: If the stamps have a zone and the date has none, or the other way round.
            ReaderError: If the date is in an hour that its zone leaves out.
        """
        micros = utc_microseconds(date)
        if date.tzinfo is None and self.zone is not None:
            micros = int(to_utc(np.array([micros]), self.zone, where=where)[0])
        elif (date.tzinfo is not None) != self.zoned:
            raise ConfigError(
                "the file's time has a zone and the date has none"
                if self.zoned
                else "a date has a zone, the file none",
                where=where,
                expected="a date in the form of the file's stamps",
                got=date.isoformat(" "),
                remedy=f"write its zone, as {date.isoformat(' ')}+00:00 for UTC"
                if self.zoned
                else "leave the zone out",
            )
        return (micros - self.micros) / 1e6
