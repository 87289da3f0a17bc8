"""The driver's command: handle positions over time, held until the next one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError

EMERGENCY = 0.0
"""The command in psi gauge that means an emergency."""

TIME_UNITS = {"s": 1.0, "ds": 0.1}
"""Seconds per unit of the time column: seconds, or the deciseconds of the dissertation's vectors."""

MAX_DURATION = 86_400.0
"""Longest command in s that is taken for meant: one day."""


def _check_increasing(times: Sequence[float] | NDArray[np.float64]) -> None:
    if times[0] != 0.0 or np.any(np.diff(times) <= 0.0):
        raise ConfigError(
            "the command's times do not increase from 0",
            where="command",
            expected="a first row at time 0, then increasing times",
            got=[float(t) for t in times],
            remedy="sort the rows; say what holds from the start",
        )


@dataclass(frozen=True, kw_only=True)
class Command:
    """A command vector: zero-order hold, psi gauge at the handle.

    Args:
        times: Start of each position in s, the first 0, increasing.
        pressures: Position in psi gauge; 0 is the emergency.
        duration: Length of the record in s.

    Raises:
        ConfigError: If times or pressures cannot be those of a command.

    Example:
        >>> command = Command.from_rows([[0, 90], [100, 84.2], [600, 90], [2050, 90]], time_unit="ds")
        >>> command.duration, command.sampled(sample_time=5.0)[:4].tolist()
        (205.0, [90.0, 90.0, 84.2, 84.2])
    """

    times: tuple[float, ...]
    pressures: tuple[float, ...]
    duration: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "times", tuple(float(t) for t in self.times))
        object.__setattr__(self, "pressures", tuple(float(p) for p in self.pressures))
        if not self.times or len(self.times) != len(self.pressures):
            raise ConfigError(
                "the command has no rows, or not one pressure per time",
                where="command",
                expected="rows of time and pressure",
                got=f"{len(self.times)} times and {len(self.pressures)} pressures",
            )
        finite = np.isfinite([*self.times, *self.pressures, self.duration])
        if not finite.all():
            raise ConfigError("the command has a value that is not finite", where="command", expected="finite numbers")
        _check_increasing(self.times)
        low = [p for p in self.pressures if p < 0.0]
        if low:
            raise ConfigError(
                "a command is below the atmosphere",
                where="command",
                expected="psi gauge, 0 for the emergency",
                got=low[0],
                remedy="give gauge pressures",
            )
        if not self.times[-1] < self.duration <= MAX_DURATION:
            raise ConfigError(
                "the command's duration does not fit its rows",
                where="command, duration",
                expected=f"seconds, after the last row at {self.times[-1]:g} s and at most {MAX_DURATION:g} s",
                got=self.duration,
                remedy="check time_unit: s or ds",
            )

    @staticmethod
    def from_rows(rows: Sequence[Sequence[float]], *, time_unit: str = "s", duration: float | None = None) -> Command:
        """A command from rows of time and pressure, as the dissertation prints them.

        Args:
            rows: ``[time, psi gauge]``. Without ``duration`` the last row only ends the record.
            time_unit: ``"s"`` or ``"ds"``.
            duration: Length in s, if the last row is to be held.

        Returns:
            The command, in seconds.

        Raises:
            ConfigError: If the rows are not such rows.
        """
        if time_unit not in TIME_UNITS:
            raise ConfigError.unknown(
                "unknown time unit", time_unit, TIME_UNITS, "write one of these", where="command, time_unit"
            )
        try:
            table = np.array([[float(value) for value in row] for row in rows], dtype=np.float64)
        except (TypeError, ValueError):
            table = np.empty((0, 0))
        if table.ndim != 2 or table.shape[1:] != (2,) or len(table) < (1 if duration else 2):
            raise ConfigError(
                "the command is not a list of rows",
                where="command",
                expected="at least two rows [time, pressure in psi gauge]",
                got=rows,
            )
        _check_increasing(table[:, 0])
        # Division by ten is exact to the last digit where multiplication by 0.1 is not.
        seconds = table[:, 0] / (10.0 if time_unit == "ds" else 1.0)
        if duration is None:
            return Command(times=tuple(seconds[:-1]), pressures=tuple(table[:-1, 1]), duration=float(seconds[-1]))
        return Command(times=tuple(seconds), pressures=tuple(table[:, 1]), duration=float(duration))

    @staticmethod
    def from_samples(pressures: NDArray[np.float64], *, sample_time: float) -> Command:
        """A command from a position for every sample.

        Args:
            pressures: Psi gauge, shape ``(n,)``.
            sample_time: Seconds between them.

        Returns:
            The command, with a row wherever the handle moves.
        """
        moved = np.flatnonzero(np.concatenate([[True], np.diff(pressures) != 0.0]))
        return Command(
            times=tuple((moved * sample_time).tolist()),
            pressures=tuple(pressures[moved].tolist()),
            duration=len(pressures) * sample_time,
        )

    def sampled(self, *, sample_time: float) -> NDArray[np.float64]:
        """The command at each sample, in psi gauge.

        Args:
            sample_time: Seconds between samples. Sample i covers ``[i, i + 1) * sample_time``.

        Returns:
            Shape ``(duration / sample_time,)``, rounded to whole samples.

        Raises:
            ConfigError: If a position is held for less than a sample, and would not be there.
        """
        count = round(self.duration / sample_time)
        starts = np.array([round(t / sample_time) for t in self.times])
        lost = np.flatnonzero(np.diff([*starts, max(count, starts[-1] + 1)]) <= 0)
        if len(lost):
            raise ConfigError(
                "a position of the handle falls between two samples", where="command",
                expected=f"positions held for {sample_time:g} s or longer",
                got=f"{self.pressures[lost[0]]:g} psi at {self.times[lost[0]]:g} s",
                remedy="hold it longer, or take shorter samples",
            )  # fmt: skip
        index = np.searchsorted(starts, np.arange(count), side="right") - 1
        return np.array(self.pressures, dtype=np.float64)[index]
