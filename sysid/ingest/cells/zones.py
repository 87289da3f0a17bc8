"""Local time to UTC: the hour that comes twice in autumn, and the one that is missing in spring."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from functools import cache
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError, available_timezones

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError

_SECOND = 1_000_000
_SHIFTS = (3600 * _SECOND, 1800 * _SECOND)  # by which clocks are changed; by half an hour on Lord Howe Island
_QUARTER = 900 * _SECOND  # no clock is changed but at a quarter of an hour
_EPOCH, _A_DAY = datetime(1970, 1, 1), timedelta(days=1)
_IN_USE = re.compile(r"(?:Africa|America|Antarctica|Asia|Atlantic|Australia|Europe|Indian|Pacific)/[A-Z][a-z].*")

CANDIDATES = (
    "Europe/Berlin",
    "Europe/London",
    "Europe/Athens",
    "America/New_York",
    "Australia/Sydney",
    "Pacific/Auckland",
    "America/Santiago",
    "Atlantic/Azores",
    "Africa/Cairo",
)
"""One zone for each rule that many live by; which of those with one rule does not matter for differences."""


def to_utc(local: NDArray[np.int64], zone: str, *, where: str) -> NDArray[np.int64]:
    """Stamps of a clock on the wall, in the order in which they were written, as stamps that never jump.

    Args:
        local: Shape ``(n,)``, microseconds since 1970 as the clock showed them.
        zone: For example ``"Europe/Berlin"``.
        where: File and column, for errors.

    Returns:
        Shape ``(n,)``, microseconds since 1970, UTC.

    Raises:
        ReaderError: If there is no such zone, or a stamp is in an hour that it leaves out.
    """
    if not len(local):
        return local
    quarters, places = np.unique(local // _QUARTER, return_inverse=True)
    offsets = np.array([_offsets(zone, int(quarter), where) for quarter in quarters], dtype=np.int64)
    early, late = offsets[places, 0], offsets[places, 1]
    missing = np.flatnonzero(early < late)
    if len(missing):
        shown = _EPOCH + timedelta(microseconds=int(local[missing[0]]))
        raise ReaderError(
            f"{shown:%Y-%m-%d %H:%M} does not exist in {zone}",
            where=where,
            expected="a clock that is put forward in spring",
            got=f"{len(missing)} stamps in the hour that is left out",
            remedy="this clock knows no summer time: leave time.zone out, or write zone: UTC",
        )
    twice = early > late
    second = _second_time(local, twice, int(np.max(early - late))) if twice.any() else twice
    utc: NDArray[np.int64] = local - np.where(second, late, early)
    return utc


def guess_zone(local: NDArray[np.int64]) -> tuple[str, int] | None:
    """A zone that explains why a clock jumps by an hour, or by half of one: one that many live by, else any other.

    Args:
        local: Shape ``(n,)``, microseconds since 1970 as the clock showed them.

    Returns:
        The zone and the index of the stamp after the first jump, or ``None`` if no jump is explained by one.
    """
    steps = np.diff(local)
    rising = steps[steps > 0]
    if not len(rising):
        return None
    usual = float(np.median(rising))
    odd = np.abs(steps - usual) > 0.4 * usual  # half an hour, of samples an hour apart
    # Days apart, a step is odd for other reasons than an hour.
    shifts = [shift for shift in _SHIFTS if shift > 0.4 * usual]
    near = [np.minimum(np.abs(steps + shift - usual), np.abs(steps - shift - usual)) < 0.5 * usual for shift in shifts]
    jumps = np.flatnonzero(odd & np.logical_or.reduce(near)) if near else np.zeros(0, dtype=np.intp)
    if not len(jumps):
        return None
    first = int(jumps[0])
    for zone in itertools.chain(CANDIDATES, _changing(local[first], local[first + 1])):
        try:
            explained = np.diff(to_utc(local, zone, where=""))[jumps]
        except ReaderError:
            continue
        if (np.abs(explained - usual) < 0.5 * usual).all():
            return zone, first + 1
    return None


def _changing(before: np.int64, after: np.int64) -> Iterator[str]:
    """The zones whose clocks are changed within a day of two stamps."""
    low, high = (_EPOCH + timedelta(microseconds=int(stamp)) for stamp in (min(before, after), max(before, after)))
    for zone in sorted(filter(_IN_USE.fullmatch, available_timezones())):
        place = ZoneInfo(zone)
        ahead = [stamp.replace(tzinfo=place).utcoffset() for stamp in (low - _A_DAY, high + _A_DAY)]
        if ahead[0] != ahead[1]:
            yield zone


def _second_time(local: NDArray[np.int64], twice: NDArray[np.bool_], shift: int) -> NDArray[np.bool_]:
    """Which stamps of hours that come twice belong to the second time."""
    second = np.zeros(len(local), dtype=np.bool_)
    steps = np.diff(local)
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    edges = np.flatnonzero(np.diff(np.concatenate([[False], twice, [False]]).astype(np.int8)))
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        inside = steps[start : stop - 1]
        back = np.flatnonzero((inside <= 0) & (np.abs(inside + shift - usual) < np.abs(inside - usual)))
        if len(back):
            second[start + int(back[0]) + 1 : stop] = True
            continue
        before = abs(steps[start - 1] - usual) - abs(steps[start - 1] + shift - usual) if start else 0.0
        after = abs(steps[stop - 1] + shift - usual) - abs(steps[stop - 1] - usual) if stop < len(local) else 0.0
        second[start:stop] = before + after > 0.0
    return second


@cache
def _offsets(zone: str, quarter: int, where: str) -> tuple[int, int]:
    """Microseconds ahead of UTC, the first and the second time that a quarter of an hour is on the clock."""
    try:
        place = ZoneInfo(zone)
    except (ZoneInfoNotFoundError, ValueError, OSError) as error:
        raise ReaderError(
            f"there is no time zone {zone}",
            where=where,
            expected="a name of the IANA time-zone database, as Europe/Berlin, America/New_York or UTC",
            got=zone,
            remedy="correct time.zone; if none is known at all: pip install tzdata",
        ) from error
    clock = _EPOCH + timedelta(microseconds=quarter * _QUARTER)
    first, last = (clock.replace(tzinfo=place, fold=fold).utcoffset() or timedelta() for fold in (0, 1))
    return first // timedelta(microseconds=1), last // timedelta(microseconds=1)


def utc_microseconds(stamp: datetime) -> int:
    """A date and time as microseconds since 1970.

    Args:
        stamp: With a zone, or without one, which is taken as it stands.

    Returns:
        The microseconds.
    """
    aware = stamp if stamp.tzinfo is not None else stamp.replace(tzinfo=UTC)
    return (aware - datetime(1970, 1, 1, tzinfo=UTC)) // timedelta(microseconds=1)
