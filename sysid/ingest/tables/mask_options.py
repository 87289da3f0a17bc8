"""Stretches of time that are masked, as they stand in ``repairs: {mask: ...}``."""

from __future__ import annotations

from datetime import date, datetime
from typing import Annotated, Any

from pydantic import BeforeValidator, model_validator

from sysid.errors import ConfigError
from sysid.field_checks import FieldError
from sysid.ingest.cells.began import Began
from sysid.ingest.tables.durations import seconds
from sysid.ingest.tables.option_group import Options
from sysid.traces.stretch import Stretch


def _end(value: Any) -> Any:
    """Seconds, or a date and time."""
    try:
        if isinstance(value, str):
            return datetime.fromisoformat(value.strip())
        if isinstance(value, date):
            return value if isinstance(value, datetime) else datetime(value.year, value.month, value.day)
    except ValueError:
        pass
    if isinstance(value, str | bool):
        raise FieldError(
            "the ends of a masked stretch are seconds, or dates",
            expected="a number: seconds in the file's own time; or a date and time, where it is calendar time",
            got=str(value),
            remedy="write 90, or 2024-05-01 10:01:30",
        )
    return seconds(value)


End = Annotated[float | datetime, BeforeValidator(_end, json_schema_input_type=float | datetime)]


class MaskOptions(Options):
    """A stretch of time in which a sensor was stuck, saturated or disturbed: its samples do not count.

    Args:
        channel: The channel; all of them where none is named.
        start: Its first sample: seconds in the file's time, or a date and time where that is calendar time; from the
            first one on where it is left out.
        stop: Its last sample, likewise; up to the last one where it is left out.
        cases: The cases it is for; all of them where none is named.
    """

    channel: str | None = None
    start: End | None = None
    stop: End | None = None
    cases: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _stretch(self) -> MaskOptions:
        if self.start is None and self.stop is None:
            raise FieldError(
                "a masked stretch has no ends",
                expected="start, stop, or both",
                got="neither",
                remedy="write when it was, in seconds; a channel that is of no use at all is left out of channels",
            )
        if self.start is None or self.stop is None:
            return self
        try:
            behind = self.stop < self.start  # type: ignore[operator]
        except TypeError:
            raise FieldError(
                "start and stop are of two kinds",
                expected="two numbers of seconds, or two dates, both with a zone or without one",
                got=f"{_told(self.start)} and {_told(self.stop)}",
                remedy="write both alike",
            ) from None
        if behind:
            raise FieldError(
                "stop is before start",
                expected=f"a stop from {_told(self.start)} on",
                got=_told(self.stop),
                remedy="correct start or stop; both belong to the stretch",
            )
        return self

    def stretch(self, began: Began | None = None, *, where: str = "repairs.mask") -> Stretch:
        """When it is.

        Args:
            began: When the record began, where its time is calendar time.
            where: Named in errors.

        Returns:
            The stretch, in seconds of the record's own time.

        Raises:
            ConfigError: If an end is a date, and the record's time is none.
        """
        return Stretch(start=_seconds_of(self.start, began, where), stop=_seconds_of(self.stop, began, where))

    @property
    def told(self) -> str:
        """Its ends in words, as they were written."""
        ends = (("from", self.start), ("to", self.stop))
        return " ".join(f"{word} {_told(end)}" for word, end in ends if end is not None)


def _told(end: float | datetime) -> str:
    return end.isoformat(" ") if isinstance(end, datetime) else f"{end:.15g} s"


def _seconds_of(end: float | datetime | None, began: Began | None, where: str) -> float | None:
    if not isinstance(end, datetime):
        return end
    if began is None:
        raise ConfigError(
            "a mask has a date, and the record's time is no calendar time",
            where=where,
            expected="seconds in the record's own time",
            got=_told(end),
            remedy="write how many seconds after the first sample it is",
        )
    return began.seconds(end, where=where)


def _one_mask(value: Any) -> Any:
    return [value] if isinstance(value, dict | MaskOptions) else value


Masks = Annotated[
    tuple[MaskOptions, ...],
    BeforeValidator(_one_mask, json_schema_input_type=MaskOptions | tuple[MaskOptions, ...]),
]
"""Stretches of time; one alone needs no list."""
