"""Dates and times in several columns, or in the digits of a number: every stamp and value comes back."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from sysid.ingest import FileFinding, inspect_file, load_dataset, propose_dataset
from sysid.traces import Trace

N = 100
Y = np.round(np.sin(0.3 * np.arange(N)), 6)


def read(tmp_path: Path, text: str) -> tuple[FileFinding, Trace]:
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    found = inspect_file(tmp_path / "a.csv")
    (tmp_path / "dataset.yaml").write_text(propose_dataset(found), encoding="utf-8")
    (trace,) = load_dataset(tmp_path / "dataset.yaml").traces
    return found, trace


def stamps(step: timedelta, start: str) -> Iterator[tuple[datetime, float]]:
    first = datetime.fromisoformat(start)
    return ((first + k * step, float(y)) for k, y in enumerate(Y))


HOUR, DAY, MINUTE = timedelta(hours=1), timedelta(days=1), timedelta(minutes=1)
Line = Callable[[datetime, float], str]
TABLES: dict[str, tuple[str, timedelta, str, Line]] = {
    "CAMELS: the length of a day is no clock": (
        "Year Mnth Day Hr\tdayl(s)\ty", DAY, "2000-12-01",
        lambda d, y: f"{d:%Y %m %d} 12\t{32000 + 500 * abs(d.day - 15)}\t{y}",
    ),
    "dates in text before how long it rained": (
        "Date (MM/DD/YYYY),Time (HH:MM),rain quantity (hour),y", HOUR, "2001-02-27",
        lambda d, y: f"{d:%m/%d/%Y},{d:%H:%M},{1 + d.hour % 3},{y}",
    ),
    "no names, as SURFRAD": (
        "", MINUTE, "2016-02-28T23:10",
        lambda d, y: f"{d.year} {d:%j} {d.month} {d.day} {d.hour} {d.minute} {d.hour + d.minute / 60:.3f} {y}",
    ),
    "no names, a number before them, as the USGS": (
        "", DAY, "2000-01-20", lambda d, y: f"01022500 {d:%Y %m %d} {y}",
    ),
    "no names and no year, as the German weather service": (
        "", HOUR, "2023-01-30T01:00", lambda d, y: f"1 7 {d.month} {d.day} {d.hour or 24} {d.day % 9} {y}"
        if d.hour else f"1 7 {(d - HOUR).month} {(d - HOUR).day} 24 {d.day % 9} {y}",
    ),
    "no year": ("Month,Day,Hour,y", HOUR, "2023-12-30", lambda d, y: f"{d.month},{d.day},{d.hour},{y}"),
    "a typical year, of hours 1 to 24": (
        "Year,Month,Day,Hour,Minute,y", HOUR, "2023-01-30",
        lambda d, y: f"{1998 if d.month == 2 else 2011},{d.month},{d.day},{d.hour + 1},30,{y}",
    ),
    "an hour in four digits, as MIDC": (
        "Year,DOY,MST,y", MINUTE, "2018-10-18T22:50", lambda d, y: f"{d:%Y},{int(f'{d:%j}')},{int(f'{d:%H%M}')},{y}",
    ),
    "an hour in four digits alone": (
        "HHMM,y", timedelta(minutes=10), "2018-10-18T22:50", lambda d, y: f"{int(f'{d:%H%M}')},{y}",
    ),
    "dates of eight digits, hours of four": (
        "station,LST_DATE,LST_TIME,y", timedelta(minutes=5), "2019-12-31T22:05",
        lambda d, y: f"53131,{d:%Y%m%d},{int(f'{d:%H%M}')},{y}",
    ),
    "dates of text, hours of six digits": (
        "date,time,y", timedelta(seconds=20), "2019-12-31T22:05",
        lambda d, y: f"{d:%d.%m.%Y},{int(f'{d:%H%M%S}')},{y}",
    ),
    "a date, a time and thousandths": (
        "date;time;ms;y", timedelta(milliseconds=100), "2024-03-12T08:15:00.3",
        lambda d, y: f"{d:%Y-%m-%d};{d:%H:%M:%S};{d.microsecond // 1000};{y}",
    ),
    "ROS": (
        "header.stamp.secs,header.stamp.nsecs,y", timedelta(milliseconds=20), "2024-03-12T08:15:00.46",
        lambda d, y: f"{int(d.timestamp())},{1000 * d.microsecond},{y}",
    ),
    "ISO 8601 without a mark": ("time,y", MINUTE, "2016-01-01T00:10", lambda d, y: f"{d:%Y%m%d:%H%M},{y}"),
    "intervals": (
        "period;y", MINUTE, "2016-01-01T23:10", lambda d, y: f"{d.isoformat()}.0/{(d + MINUTE).isoformat()}.0;{y}",
    ),
    "French months": (
        "date;y", DAY, "2024-01-30",
        lambda d, y: f"{d.day} {('janv.', 'févr.', 'mars', 'avr.', 'mai')[d.month - 1]} {d:%Y};{y}",
    ),
    "Spanish halves of a day": (
        "fecha;y", timedelta(minutes=30), "2024-05-13T06:00",
        lambda d, y: f"{d:%d/%m/%Y} {d.hour % 12 or 12}:{d:%M} {'a. m.' if d.hour < 12 else 'p. m.'};{y}",
    ),
    "minutes and seconds": (
        "time,y", timedelta(seconds=2), "2024-01-01T00:58:40",
        lambda d, y: f"{60 * d.hour + d.minute}:{d:%S},{y}",
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", TABLES)
def test_stamps_in_whatever_columns_are_read(tmp_path: Path, kind: str) -> None:
    head, step, start, line = TABLES[kind]
    text = "\n".join([*([head] if head else []), *(line(d, y) for d, y in stamps(step, start))]) + "\n"
    found, trace = read(tmp_path, text)
    assert trace.sample_time == pytest.approx(step.total_seconds())
    assert found.timing is not None and not len(found.timing.gaps)
    np.testing.assert_array_equal(trace.values[:, -1], Y)


def test_parts_beside_the_dates_are_no_channels(tmp_path: Path) -> None:
    lines = [f"{d.isoformat(' ')},{d.year},{d.month},{d.day},{d.hour},{y}" for d, y in stamps(HOUR, "2024-02-27")]
    found, trace = read(tmp_path, "\n".join([",Year,Month,Day,Hour,y", *lines]) + "\n")
    assert [channel.name for channel in trace.channels] == ["y"]
    assert {c.aside for c in found.columns if c.name != "y"} == {"a part of column_1"}


def test_numbers_without_names_that_are_no_dates_stay_channels(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    lines = [f"{2000 + k % 7},{rng.integers(1, 13)},{rng.integers(1, 29)},{y}" for k, y in enumerate(Y)]
    found, _ = read(tmp_path, "\n".join(lines) + "\n")
    assert [column.name for column in found.channels] == ["column_1", "column_2", "column_3", "column_4"]
    # A speed that is set, a gear and a number of rows.
    found, trace = read(tmp_path, "\n".join(f"2000,5,{1 + k % 24},{y}" for k, y in enumerate(Y[:24])) + "\n")
    assert trace.sample_time == 1.0 and "time" not in {column.name for column in found.columns}


def test_stamps_that_nearly_all_lack_are_no_clock(tmp_path: Path) -> None:
    lines = [f"{k / 24 if k < 10 else ''},{y}" for k, y in enumerate(Y)]
    found, trace = read(tmp_path, "\n".join(["Time,y", *lines]) + "\n")
    assert len(trace) == N and "no time stamps" in found.problems


def test_a_clock_that_counts_to_sixty_goes_on(tmp_path: Path) -> None:
    _, trace = read(tmp_path, "\n".join(["sec,y", *(f"{(55 + k) % 60},{y}" for k, y in enumerate(Y))]) + "\n")
    np.testing.assert_array_equal(trace["y"], Y)
    _, trace = read(tmp_path, "\n".join(["tick_ms,y", *(f"{(65000 + 100 * k) % 65536},{y}" for k, y in enumerate(Y))]))
    np.testing.assert_array_equal(trace["y"], Y)


def test_records_that_begin_at_nothing_are_records_though_they_last_a_minute(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time [s],y\n" + "".join(f"{k % 60},{k % 7}\n" for k in range(180)))
    assert len(inspect_file(tmp_path / "a.csv").cases) == 3


def test_dates_one_below_the_other_are_time_though_the_head_is_of_numbers(tmp_path: Path) -> None:
    head = "," + ",".join(map(str, range(51)))
    lines = [f"{d:%Y-%m-%d}," + ",".join(f"{y + j:.6f}" for j in range(51)) for d, y in stamps(DAY, "2014-01-02")]
    found, trace = read(tmp_path, "\n".join([head, *lines[:33]]) + "\n")
    assert found.samples == 33 and trace.sample_time == 86_400.0 and [c.name for c in trace.channels][:2] == ["0", "1"]


@pytest.mark.parametrize("start", ["2024-03-10T00:00", "2024-11-03T00:00"])
def test_a_night_on_which_clocks_are_changed_tells_the_day_from_the_month(tmp_path: Path, start: str) -> None:
    from zoneinfo import ZoneInfo

    zone = ZoneInfo("America/New_York")
    first = datetime.fromisoformat(start).replace(tzinfo=zone).timestamp()
    shown = [datetime.fromtimestamp(first + 900.0 * k, tz=zone) for k in range(N)]
    lines = [f"{d:%m/%d/%Y %I:%M %p},{y}" for d, y in zip(shown, Y, strict=True)]
    _, trace = read(tmp_path, "\n".join(["time,y", *lines]) + "\n")
    np.testing.assert_array_equal(trace["y"], Y)


def test_days_apart_no_zone_explains_a_step(tmp_path: Path) -> None:
    days = np.cumsum(np.random.default_rng(2).integers(8, 21, N))
    text = "\n".join(
        f"{datetime(1981, 7, 3) + timedelta(days=int(d)):%Y-%m-%d},{y}" for d, y in zip(days, Y, strict=True)
    )
    (tmp_path / "a.csv").write_text(f"date,y\n{text}\n")
    assert inspect_file(tmp_path / "a.csv").time.zone is None


def test_days_with_gaps_are_days(tmp_path: Path) -> None:
    days = np.cumsum(np.concatenate([np.ones(60, int), np.random.default_rng(3).integers(8, 21, 40)]))
    hours = np.where(np.arange(N) % 30 == 29, 9, 12)  # some were taken earlier
    lines = [
        f"{datetime(1981, 7, 3, int(h)) + timedelta(days=int(d))},{y}" for d, h, y in zip(days, hours, Y, strict=True)
    ]
    (tmp_path / "a.csv").write_text("\n".join(["date,y", *lines]) + "\n")
    assert inspect_file(tmp_path / "a.csv").sample_time == 86_400.0


def test_years_with_a_point_are_time(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(
        "decimal_year,y\n" + "".join(f"{2001 + (k + 0.5) / 12:.6f},{y}\n" for k, y in enumerate(Y))
    )
    found = inspect_file(tmp_path / "a.csv")
    assert found.sample_time == pytest.approx(365.25 * 86_400 / 12, rel=1e-3)


def test_the_least_of_something_is_in_no_minutes(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(
        "time [s],T_min,flow_l_min\n" + "".join(f"{k},{y},{y + 1}\n" for k, y in enumerate(Y))
    )
    assert [(c.unit, c.unit_guessed) for c in inspect_file(tmp_path / "a.csv").columns] == [("1", True)] * 2


def test_a_channel_that_never_changes_and_is_called_as_a_clock_warns_of_nothing(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("Time,T1,y\n" + "".join(f"{k},21.55,{y}\n" for k, y in enumerate(Y)))
    assert [c.name for c in inspect_file(tmp_path / "a.csv").channels] == ["T1", "y"]


def test_events_between_even_stamps_leave_the_step_as_it_is(tmp_path: Path) -> None:
    times = np.sort(np.concatenate([600.0 * np.arange(N), 600.0 * np.arange(0, N, 5) + 123.0, [7223.0]]))
    (tmp_path / "a.csv").write_text("time [s],y\n" + "".join(f"{t},{t % 7}\n" for t in times))
    assert inspect_file(tmp_path / "a.csv").sample_time == 600.0
    months = [datetime(1913 + m // 12, m % 12 + 1, 1) for m in range(N)]
    (tmp_path / "a.csv").write_text("time,y\n" + "".join(f"{d},{k % 7}\n" for k, d in enumerate(months)))
    assert inspect_file(tmp_path / "a.csv").sample_time == pytest.approx(30.44 * 86_400, rel=2e-3)


@pytest.mark.parametrize("station", ["B32C0609", "USGS01022500"])
def test_the_number_of_a_station_is_no_date(tmp_path: Path, station: str) -> None:
    (tmp_path / "a.csv").write_text("station,y\n" + "".join(f"{station},{y}\n" for y in Y))
    (problem,) = (column.problem for column in inspect_file(tmp_path / "a.csv").columns if column.name == "station")
    assert problem == "the column holds words"


def test_a_second_head_below_names_that_stand_twice_is_no_bad_row(tmp_path: Path) -> None:
    lines = [f"{d.isoformat(' ')}+01:00,{y},{y + 1},{y + 2}" for d, y in stamps(HOUR, "2010-01-01")]
    text = "\n".join(["variable_name,pressure,wind,wind", "height,0,10,80", *lines]) + "\n"
    found, trace = read(tmp_path, text)
    assert (found.samples, found.sample_time, len(trace.channels)) == (N, 3600.0, 3)
