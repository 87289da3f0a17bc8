"""Calendar time as text to seconds since the first sample.

A cell is taken apart first, a block of the file at a time. What only the whole column can tell is told at the end:
which of two numbers is the day, whether midnight passes, which of two like hours it is.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.cells.began import Began
from sysid.ingest.cells.date_orders import DAY, days_of, full_year
from sysid.ingest.cells.stamp_forms import usual_form
from sysid.ingest.cells.zones import guess_zone, to_utc

_NONE = np.iinfo(np.int64).min
_ZONELESS = 100_000
_MONTHS = {
    word: number + 1
    for number, words in enumerate(
        (
            "jan januar january januari janv janvier ene enero gen gennaio janeiro",
            "feb februar february februari févr fevr fév février febrero febbraio fev fevereiro",
            "mar mrz mär märz march maart mars marzo março mrt",
            "apr april avr avril abr abril aprile",
            "may mai mei mayo mag maggio maio",
            "jun juni june juin junio giu giugno junho",
            "jul juli july juil juillet julio lug luglio julho",
            "aug august août aout ago agosto augustus",
            "sep sept september septembre septiembre set settembre setembro",
            "oct okt october oktober octobre octubre ott ottobre out outubro",
            "nov november novembre noviembre novembro",
            "dec dez december dezember déc décembre dic diciembre dicembre dezembro",
        )
    )
    for word in words.split()
}
_DATE = re.compile(
    r"(?P<a>[0-9]{4}|[0-9]{1,2})(?P<mark>[-/.])\s?(?P<b>[0-9]{1,2})(?P=mark)\s?(?P<c>[0-9]{4}|[0-9]{1,2})(?![0-9])"
    r"|(?P<day>[0-9]{1,2})[-./ ]?\s?(?P<month>[^\W\d_]{3,10})\.?[-./, ]?\s?(?P<year>[0-9]{4}|[0-9]{2})(?![0-9])"
    r"|(?P<packed>(?:19|20)[0-9]{2}(?:0[1-9]|1[0-2])[0-3][0-9])(?=[T_ :]?[0-2][0-9]:?[0-5][0-9])"
)
_CLOCK = re.compile(
    r"(?:[\sT,;_]\s*|(?<=^)|(?<=[0-9]):?)"
    r"(?:(?P<h>[0-9]{1,4}):(?P<m>[0-9]{1,2})(?::(?P<s>[0-9]{1,2}))?"
    r"|(?P<th>[0-2][0-9])(?P<tm>[0-5][0-9])(?P<ts>[0-5][0-9])?)"
    r"(?:[.,:](?P<f>[0-9]+))?\s?(?P<half>[AaPp]\.?\s?[Mm]\.?)?\s?(?P<zone>Z|[A-Z]{3,4}(?![A-Za-z])|[+-][0-9]{2}(?::?[0-9]{2})?)?"
    r"(?:\[[\w/+-]+\])?"
)
_HOURS_AHEAD = {
    word: hours
    for hours, words in {
        0: "UTC GMT WET", 1: "CET MEZ BST WEST", 2: "EET CEST MESZ", 3: "EEST MSK", 8: "AWST SGT HKT", 9: "JST KST",
        10: "AEST", 11: "AEDT", 12: "NZST", 13: "NZDT", -3: "ADT BRT", -4: "AST EDT", -5: "EST CDT", -6: "CST MDT",
        -7: "MST PDT", -8: "PST AKDT", -9: "AKST",
    }.items()
    for word in words.split()
}  # fmt: skip
"""What zones are called behind a time of day. IST is left out: it is a zone of three countries."""
_TWO = re.compile(r"[0-9]{1,4}:[0-9]{1,2}")
_LONGEST = 40
_SHORTEST_INTERVAL = 32
_INTERVAL = re.compile(
    r"(?P<first>[0-9]{4}-?[0-9]{2}-?[0-9]{2}[T ]\S{4,20})\s?/\s?(?P<last>[0-9]{4}-?[0-9]{2}-?[0-9]{2}[T ]\S{4,20})"
)
"""An interval of ISO 8601: where it begins and where it ends."""
_FEW = 32
_HOUR = 3_600_000_000
_ZERO = 48


@dataclass(frozen=True, kw_only=True)
class _Stamp:
    """A cell taken apart: three numbers of a date, or none; microseconds of the day; minutes ahead of UTC."""

    date: int
    micros: int
    offset: int = _ZONELESS
    clock: bool = True
    interval: bool = False


def is_calendar(text: str) -> bool:
    """Whether a text is a date, a time of day, or both.

    Args:
        text: For example ``"12.03.2024 08:15"``, ``"2024-05-01T10:00:00Z"``, ``"08:15:00.5 PM"``.

    Returns:
        True if it is.
    """
    return _taken_apart(text) is not None


def _taken_apart(text: str) -> _Stamp | None:
    """A text in its parts; one that begins with a day of the week or a month, or counts days, is brought into form."""
    if len(text) > _SHORTEST_INTERVAL and (interval := _INTERVAL.fullmatch(text)):
        first, last = (_in_parts(interval[end]) for end in ("first", "last"))
        return None if first is None or last is None else replace(first, interval=True)
    digit = "0" <= text[:1] <= "9"
    if len(text) > _LONGEST or not (digit or " " in text):
        return None
    found = _in_parts(text) if digit else None
    return _in_parts(usual_form(text)) if found is None else found


def _in_parts(text: str) -> _Stamp | None:
    found = _DATE.match(text)
    code = 0 if found is None else _date_code(found)
    at = 0 if found is None else found.end()
    if code is None or (found is not None and at == len(text)):
        return None if code is None else _Stamp(date=code, micros=0, clock=False)
    clock = _CLOCK.fullmatch(text, at)
    if clock is None or (found is None and clock["h"] is None) or not _is_zone(clock["zone"]):
        return None
    return _with_clock(code, clock)


def _date_code(found: re.Match[str]) -> int | None:
    if found["packed"]:
        year, month, day = int(found["packed"][:4]), int(found["packed"][4:6]), int(found["packed"][6:])
    elif found["month"]:
        number = _MONTHS.get(found["month"].casefold())
        if number is None:
            return None
        year, month, day = full_year(int(found["year"])), number, int(found["day"])
    else:
        year, month, day = int(found["a"]), int(found["b"]), int(found["c"])
    return year * 100_000_000 + month * 10_000 + day


def _with_clock(code: int, clock: re.Match[str]) -> _Stamp | None:
    hours, minutes, seconds = (int(clock[x] or clock[y] or 0) for x, y in (("h", "th"), ("m", "tm"), ("s", "ts")))
    fraction = clock["f"] or ""
    if clock["h"] is not None and clock["s"] is None and fraction:
        hours, minutes, seconds = 0, hours, minutes  # 15:30.5 is minutes and seconds
    if clock["half"]:
        hours = hours % 12 + (12 if clock["half"][0] in "pP" else 0)
    if (minutes > 59 and hours) or seconds > 60 or (code and hours > 24):
        return None
    micros = ((hours * 60 + minutes) * 60 + seconds) * 1_000_000 + int(fraction[:6].ljust(6, "0") or 0)
    return _Stamp(date=code, micros=micros, offset=_minutes(clock["zone"]))


def _all_alike(cells: Sequence[str]) -> tuple[NDArray[np.int64], NDArray[np.int64], int] | None:
    """Cells that differ in nothing but the digits of date and time, taken apart as one; ``None`` if they do not."""
    text = "".join(cells)
    width = len(cells[0]) if cells else 0
    if len(cells) < _FEW or len(text) != width * len(cells) or not text.isascii() or {*map(len, cells)} != {width}:
        return None
    letters = np.frombuffer(text.encode(), dtype=np.uint8).reshape(len(cells), width)
    found = _DATE.match(cells[0])
    start = 0 if found is None else found.end()
    clock = _CLOCK.fullmatch(cells[0], start)
    if clock is None or clock["h"] is None or clock["s"] is None or not _is_zone(clock["zone"]):
        return None
    if found and _date_code(found) is None:
        return None
    spans = [match.span(name) for match, names in ((found, "abc"), (clock, "hmsf")) if match for name in names]
    spans += [found.span(name) for name in ("day", "year", "packed")] if found else []
    varies = np.zeros(width, dtype=np.bool_)
    for low, high in spans:
        varies[max(low, 0) : max(high, 0)] = True
    digits = letters[:, varies]
    if (letters[:, ~varies] != letters[0, ~varies]).any() or (digits < _ZERO).any() or (digits > _ZERO + 9).any():
        return None

    def number(match: re.Match[str], name: str, most: int = 9) -> NDArray[np.int64]:
        low, high = match.span(name)
        high = min(high, low + most)
        powers = 10 ** np.arange(high - low - 1, -1, -1, dtype=np.int64)
        return (letters[:, low:high].astype(np.int64) - _ZERO) @ powers

    hours, minutes, seconds = (number(clock, name) for name in "hms")
    if clock["half"]:
        hours = hours % 12 + (12 if clock["half"][0] in "pP" else 0)
    if (minutes > 59).any() or (seconds > 60).any() or (found is not None and (hours > 24).any()):
        return None
    micros = ((hours * 60 + minutes) * 60 + seconds) * 1_000_000
    if clock["f"]:
        micros += number(clock, "f", 6) * 10 ** max(6 - len(clock["f"]), 0)
    return _codes(found, number, len(cells)), micros, _minutes(clock["zone"])


def _codes(
    found: re.Match[str] | None, number: Callable[[re.Match[str], str], NDArray[np.int64]], count: int
) -> NDArray[np.int64]:
    """The dates of cells that differ in nothing but digits."""
    if found is None:
        return np.zeros(count, dtype=np.int64)
    if found["packed"]:
        packed = number(found, "packed")
        return packed // 10_000 * 100_000_000 + packed // 100 % 100 * 10_000 + packed % 100
    if found["month"]:
        years = number(found, "year")
        years += np.where(years > 99, 0, np.where(years < 70, 2000, 1900))
        return years * 100_000_000 + _MONTHS[found["month"].casefold()] * 10_000 + number(found, "day")
    return number(found, "a") * 100_000_000 + number(found, "b") * 10_000 + number(found, "c")


def _is_zone(zone: str | None) -> bool:
    return not zone or zone[0] in "Z+-" or zone in _HOURS_AHEAD


def _minutes(zone: str | None) -> int:
    if not zone:
        return _ZONELESS
    if zone[0] not in "+-":
        return 60 * _HOURS_AHEAD.get(zone, 0)
    digits = zone[1:].replace(":", "")
    return (-1 if zone[0] == "-" else 1) * (int(digits[:2]) * 60 + int(digits[2:] or 0))


@dataclass(kw_only=True)
class Calendar:
    """A column of calendar time that is read block by block.

    Args:
        where: File and column, for errors.
        pattern: As for ``datetime.strptime``; ``None`` recognises ISO 8601, day.month.year, month/day/year, names of
            months, AM and PM, and times of day alone.
        zone: The zone of the clock, where the stamps do not say theirs.
        minutes: Whether two numbers are said to be minutes and seconds.
    """

    where: str
    pattern: str | None = None
    zone: str | None = None
    minutes: bool = False
    began: Began | None = field(default=None, init=False)
    """When the first stamp is, once the column is finished; ``None`` of times of day."""
    _dates: list[NDArray[np.int64]] = field(default_factory=list)
    _micros: list[NDArray[np.int64]] = field(default_factory=list)
    _offsets: list[NDArray[np.int64]] = field(default_factory=list)
    _clocks: int = 0
    _intervals: bool = False
    _of_two: bool = True

    def add(self, cells: Sequence[str], lines: NDArray[np.integer[Any]]) -> None:
        """Take a block of cells apart.

        Args:
            cells: Their texts; an empty one is a missing stamp.
            lines: Line of each in the file.

        Raises:
            ReaderError: If a cell is not a date and time of the pattern.
        """
        if self.minutes:  # 15:30.0 is minutes and seconds
            cells = [f"{cell.strip()}.0" if _TWO.fullmatch(cell.strip()) else cell for cell in cells]
        alike = _all_alike(cells) if self.pattern is None else None
        if alike is not None:
            dates, micros, offset = alike
            self._dates.append(dates)
            self._micros.append(micros)
            self._offsets.append(np.full(len(cells), offset, dtype=np.int64))
            self._clocks += len(cells)
            self._of_two = False
            return
        stamps = []
        for cell, line in zip(cells, lines, strict=True):
            stamp = self._stamp(cell.strip())
            if stamp is None:
                raise self._not_a_date(cell, int(line))
            stamps.append(stamp)
        self._dates.append(np.array([stamp.date for stamp in stamps], dtype=np.int64))
        self._micros.append(np.array([stamp.micros for stamp in stamps], dtype=np.int64))
        self._offsets.append(np.array([stamp.offset for stamp in stamps], dtype=np.int64))
        self._clocks += sum(stamp.clock for stamp in stamps)
        self._intervals |= any(stamp.interval for stamp in stamps)
        self._of_two = self._of_two and all(cell.count(":") < 2 for cell in cells)

    def _stamp(self, text: str) -> _Stamp | None:
        if not text:
            return _Stamp(date=0, micros=_NONE, clock=False)
        if self.pattern is None:
            return _taken_apart(text)
        try:
            parsed = datetime.strptime(text, self.pattern)
        except ValueError:
            return None
        offset = parsed.utcoffset()
        code = parsed.year * 100_000_000 + parsed.month * 10_000 + parsed.day
        micros = ((parsed.hour * 60 + parsed.minute) * 60 + parsed.second) * 1_000_000 + parsed.microsecond
        minutes = _ZONELESS if offset is None else int(offset.total_seconds() // 60)
        return _Stamp(date=0 if parsed.year == 1900 else code, micros=micros, offset=minutes)

    def _not_a_date(self, cell: str, line: int) -> ReaderError:
        return ReaderError(
            "a cell is not a date and time",
            where=f"{self.where}, line {line}",
            expected="a date and time (2024-05-01 10:00:00.100)" if self.pattern is None else self.pattern,
            got=repr(cell),
            remedy="give its pattern, for example time: {unit: datetime, format: '%d.%m.%Y %H:%M:%S.%f'}",
        )

    @property
    def has_clock(self) -> bool:
        """Whether any stamp has a time of day."""
        return self._clocks > 0

    @property
    def has_date(self) -> bool:
        """Whether any stamp has a date."""
        return any(part.any() for part in self._dates)

    def with_date(self, dates: Calendar) -> None:
        """Take the dates of another column, whose stamps have no time of day.

        Args:
            dates: The other column.
        """
        self._dates = dates._dates

    def finish(self) -> tuple[NDArray[np.float64], list[str], str | None]:
        """The whole column.

        Returns:
            Seconds since the first stamp, shape ``(n,)``, NaN where there is none; what should be told; and a zone
            that would explain a jump of the clock by an hour, if none was given.

        Raises:
            ReaderError: If some stamps have a time zone and some have none, or a date cannot be.
        """
        dates, micros, offsets = (np.concatenate(parts) for parts in (self._dates, self._micros, self._offsets))
        known = np.flatnonzero(micros != _NONE)
        seconds = np.full(len(micros), np.nan)
        if not len(known):
            return seconds, [], None
        dates, micros, offsets = dates[known], micros[known], offsets[known]
        zoned = offsets != _ZONELESS
        if zoned.any() and not zoned.all():
            raise ReaderError(
                "some time stamps have a time zone and some have none",
                where=self.where,
                expected="a time zone on all or on none",
                got=f"{int(zoned.sum())} with one, {int((~zoned).sum())} without",
                remedy="export the time stamps in one form",
            )
        if not dates.any():
            local, notes = self._of_no_date(micros)
        else:
            days, notes = days_of(dates, micros, self.where)
            local = days * DAY + micros
        guess = None
        if zoned.all():
            local = local - 60_000_000 * offsets
        elif self.zone is not None:
            local = to_utc(local, self.zone, where=self.where)
        elif dates.any():
            guess, notes = _told_zone(local, notes)
        if dates.any():
            inside = zoned.all()
            self.began = Began(
                micros=int(local[0]),
                zoned=bool(inside) or self.zone is not None,
                zone=None if inside else self.zone,
            )
        notes = [*notes, "stamps are intervals: time is where each begins"] if self._intervals else notes
        seconds[known] = (local - local[0]) / 1e6
        return seconds, notes, guess

    def _of_no_date(self, micros: NDArray[np.int64]) -> tuple[NDArray[np.int64], list[str]]:
        guessed = self._of_two and not self.minutes
        return _over_midnight(*_minutes_and_seconds(micros) if guessed else (micros, []))


def _minutes_and_seconds(micros: NDArray[np.int64]) -> tuple[NDArray[np.int64], list[str]]:
    """Two numbers are hours and minutes, but where the first is more than the hours of a day from the start."""
    if not len(micros) or micros[0] < DAY:
        early = len(micros) and micros[0] < _HOUR  # 00:02: midnight, or the beginning of a stopwatch
        other = "minutes and seconds would need time: {unit: datetime, format: '%M:%S'}"
        return micros, [f"stamps are taken for hours and minutes, which is a guess: {other}"] if early else []
    return micros // 60, ["stamps are taken for minutes and seconds, which is a guess: no day has so many hours"]


def _over_midnight(micros: NDArray[np.int64], notes: list[str]) -> tuple[NDArray[np.int64], list[str]]:
    """Times of day in the order in which they were written: each fall by more than half a day is a midnight."""
    passed = np.cumsum(np.concatenate([[0], np.diff(micros) < -DAY // 2]))
    told = [f"midnight passes {int(passed[-1])} times" if passed[-1] > 1 else "midnight passes"] if passed[-1] else []
    return micros + DAY * passed, [*notes, *told]


def _told_zone(local: NDArray[np.int64], notes: list[str]) -> tuple[str | None, list[str]]:
    found = guess_zone(local)
    if found is None:
        return None, notes
    zone, index = found
    hour = "comes twice" if local[index] <= local[index - 1] else "is left out"
    shown = np.datetime64(int(local[index]), "us").astype("datetime64[m]")
    told = f"an hour {hour} at {str(shown).replace('T', ' ')}: local time; time: {{zone: {zone}}} says so"
    return zone, [*notes, told]
