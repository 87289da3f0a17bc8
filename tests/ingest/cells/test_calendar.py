"""Dates and times as people write them, and the clock on the wall."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.errors import ReaderError
from sysid.ingest.cells.calendar import Calendar, is_calendar
from sysid.ingest.cells.zones import guess_zone, to_utc, utc_microseconds


def seconds(*cells: str, zone: str | None = None, pattern: str | None = None) -> list[float]:
    calendar = Calendar(where="a.csv, column t", zone=zone, pattern=pattern)
    calendar.add(cells, np.arange(len(cells)) + 2)
    return calendar.finish()[0].tolist()


@pytest.mark.parametrize(
    ("first", "second", "step"),
    [
        ("2024-05-01 10:00:00", "2024-05-01 10:00:00.5", 0.5),
        ("2024-05-01T23:59:59Z", "2024-05-02T00:00:00Z", 1.0),
        ("2024-05-01T10:00:00+02:00", "2024-05-01T10:00:00+01:00", 3600.0),
        ("12.03.2024 08:15", "13.03.2024 08:15", 86400.0),
        ("12.03.2024 08:15:00,25", "12.03.2024 08:15:00,50", 0.25),
        ("2/28/2024 11:59:59 PM", "2/29/2024 12:00:00 AM", 1.0),
        ("31/12/2023 23:59:59", "01/01/2024 00:00:00", 1.0),
        ("12-Mar-2024 08:15:00", "12-Mär-2024 08:15:01", 1.0),
        ("12 Okt 2024 08:15:00", "12 Oct 2024 08:15:10", 10.0),
        ("20240501T100000", "20240501T100001", 1.0),
        ("2024-05-01", "2024-05-03", 2 * 86400.0),
        ("23:59:59.5", "00:00:00.0", 0.5),
        ("99:59:59", "100:00:00", 1.0),
        ("59:59.5", "60:00.0", 0.5),
        ("10:00:00:100", "10:00:00:350", 0.25),
        ("Mon Jan  1 23:59:59.5 2024", "Tue Jan  2 00:00:00 2024", 0.5),
        ("Fri, 01 Mar 2024 10:00:00 +0100", "Fri, 01 Mar 2024 10:00:00 +0000", 3600.0),
        ("March 12, 2024 08:15", "March 13, 2024 08:15", 86400.0),
        ("0 days 23:59:59.5", "1 days 00:00:00", 0.5),
        ("0h59m59.5s", "1h00m00.0s", 0.5),
    ],
)
def test_what_people_write_is_read(first: str, second: str, step: float) -> None:
    assert is_calendar(first)
    assert seconds(first, second) == [0.0, pytest.approx(step)]


@pytest.mark.parametrize(
    "text", ["1.5", "1.003.000", "45363.34", "2024", "12:61", "Mon", "10:00 o'clock", "", "1:2:3:4:5"]
)
def test_what_is_no_time_is_none(text: str) -> None:
    assert not is_calendar(text)


@given(st.datetimes(datetime(1971, 1, 1), datetime(2099, 1, 1)), st.integers(1, 10**12))
def test_iso_time_reads_back_to_the_microsecond(start: datetime, micros: int) -> None:
    stop = start + timedelta(microseconds=micros)
    assert seconds(start.isoformat(), stop.isoformat(" ")) == [0.0, pytest.approx(micros / 1e6, rel=1e-15)]


def test_a_day_above_twelve_tells_which_number_is_the_day() -> None:
    assert seconds("11/12/2024 00:00", "12/12/2024 00:00", "13/12/2024 00:00") == [0.0, 86400.0, 2 * 86400.0]
    assert seconds("12/11/2024 00:00", "12/12/2024 00:00", "12/13/2024 00:00") == [0.0, 86400.0, 2 * 86400.0]


def test_missing_stamps_stay_missing() -> None:
    np.testing.assert_array_equal(seconds("", "10:00:00", "", "10:00:01"), [np.nan, 0.0, np.nan, 1.0])


def test_a_pattern_is_taken_at_its_word() -> None:
    assert seconds("010203", "020203", pattern="%d%m%y") == [0.0, 86400.0]


def wall(zone: str, start: datetime, step: float, count: int) -> list[datetime]:
    """What a clock on the wall shows, without saying its zone."""
    stamps = [start.replace(tzinfo=UTC) + timedelta(seconds=step * k) for k in range(count)]
    return [stamp.astimezone(ZoneInfo(zone)).replace(tzinfo=None) for stamp in stamps]


@given(
    st.sampled_from(["Europe/Berlin", "Europe/London", "America/New_York", "Australia/Sydney", "Australia/Lord_Howe"]),
    st.datetimes(datetime(2015, 1, 1), datetime(2030, 1, 1)),
    st.sampled_from([60.0, 600.0, 900.0, 1800.0, 3600.0]),
)
def test_the_clock_on_the_wall_is_undone(zone: str, start: datetime, step: float) -> None:
    local = np.array([utc_microseconds(stamp) for stamp in wall(zone, start, step, 40)])
    np.testing.assert_array_equal(np.diff(to_utc(local, zone, where="a")), np.full(39, int(step * 1e6)))


@pytest.mark.parametrize("step", [1.0, 60.0, 600.0, 3600.0])
@pytest.mark.parametrize(
    ("zone", "start"),
    [
        ("Europe/Berlin", datetime(2024, 10, 27, 0, 30)),
        ("Europe/Berlin", datetime(2024, 3, 31, 0, 30)),
        ("America/New_York", datetime(2024, 11, 3, 5, 30)),
        ("Australia/Sydney", datetime(2024, 4, 6, 15, 30)),
        ("Australia/Lord_Howe", datetime(2024, 4, 6, 14, 30)),
        ("Australia/Lord_Howe", datetime(2024, 10, 5, 15, 0)),
        ("America/Santiago", datetime(2024, 4, 7, 2, 30)),
        ("Africa/Cairo", datetime(2024, 10, 31, 20, 30)),
        ("America/Sao_Paulo", datetime(2018, 2, 18, 1, 30)),
    ],
)
def test_a_zone_is_proposed_where_it_explains_the_jump(zone: str, start: datetime, step: float) -> None:
    count = 40 if step >= 600.0 else 4000 if step == 1.0 else 120
    local = np.array([utc_microseconds(stamp) for stamp in wall(zone, start, step, count)])
    found = guess_zone(local)
    assert found is not None
    assert set(np.diff(to_utc(local, found[0], where="a"))) == {int(step * 1e6)}


def test_a_gap_of_an_hour_at_noon_is_no_zone() -> None:
    local = np.array([utc_microseconds(datetime(2024, 3, 31, 12) + timedelta(minutes=m)) for m in (0, 1, 2, 63, 64)])
    assert guess_zone(local) is None


def test_an_hour_that_does_not_exist_is_refused_with_what_helps() -> None:
    with pytest.raises(ReaderError, match=r"(?s)02:30 does not exist in Europe/Berlin.*zone: UTC"):
        seconds("2024-03-31 02:30", "2024-03-31 02:40", zone="Europe/Berlin")
    assert seconds("2024-03-31 02:30", "2024-03-31 02:40", zone="UTC") == [0.0, 600.0]


def test_an_unknown_zone_is_refused() -> None:
    with pytest.raises(ReaderError, match=r"(?s)no time zone Berlin.*Europe/Berlin"):
        seconds("2024-03-31 01:30", zone="Berlin")


FORMS = [
    "%Y-%m-%d %H:%M:%S.%f",
    "%Y-%m-%dT%H:%M:%SZ",
    "%d.%m.%Y %H:%M:%S",
    "%d %b %Y %H:%M:%S",
    "%Y%m%d %H:%M:%S",
    "%H:%M:%S,%f",
    "%Y-%m-%d %H:%M:%S+02:00",
]


@given(
    st.sampled_from(FORMS),
    st.datetimes(datetime(2001, 1, 1), datetime(2030, 1, 1)),
    st.sampled_from([0.25, 1.0, 60.0, 3600.0, 86400.0]),
)
def test_many_cells_at_once_are_what_each_of_them_is(form: str, start: datetime, step: float) -> None:
    cells = [(start + timedelta(seconds=step * k)).strftime(form) for k in range(60)]
    together = seconds(*cells)
    one_by_one = Calendar(where="a")
    for row, cell in enumerate(cells):
        one_by_one.add([cell], np.array([row]))
    np.testing.assert_array_equal(together, one_by_one.finish()[0])


def test_zones_by_name_behind_the_clock() -> None:
    autumn = [f"27.10.2024 0{h}:30:00 {zone}" for h, zone in ((1, "CEST"), (2, "CEST"), (2, "CET"), (3, "CET"))]
    assert seconds(*autumn) == [0.0, 3600.0, 7200.0, 10_800.0]
    assert seconds("2024-11-03 01:59:59 EDT", "2024-11-03 01:00:00 EST") == [0.0, 1.0]
    assert seconds("2024-10-27T02:30:00+02:00[Europe/Berlin]", "2024-10-27T02:30:00+01:00[Europe/Berlin]") == [0, 3600]
    assert not is_calendar("2024-11-03 01:59:59 PUMP")
