"""Words as numbers, long tables, clocks by their size, blanks by their pattern."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.errors import ChannelError, ConfigError, ReaderError, TraceError
from sysid.ingest import FileOptions, read_table, read_trace
from sysid.ingest.cells.blanks import blanks_mean
from sysid.ingest.cells.words import PAIRS, known_states, quoted
from sysid.ingest.tables.clocks import clock_of

Write = Callable[[str, str | bytes], Path]
NAN = float("nan")

VALVE = "t [s],valve,gear\n0,OFF,closed\n1,ON,open\n2,,open\n3,ON,closed\n"


def test_states_are_numbers_by_a_table(write: Write) -> None:
    files = FileOptions.model_validate({"states": {"OFF": 0, "ON": 1, "gear": {"closed": -1, "open": 2}}})
    table = read_table(write("run.csv", VALVE), files=files)
    np.testing.assert_array_equal(table.find("valve").values, [0.0, 1.0, NAN, 1.0])
    np.testing.assert_array_equal(table.find("gear").values, [-1.0, 2.0, 2.0, -1.0])


def test_words_without_a_table_are_refused_and_the_remedy_works(write: Write) -> None:
    path = write("run.csv", VALVE)
    with pytest.raises(ReaderError, match=r"(?s)column valve.*states: \{'OFF': 0, 'ON': 1\}") as caught:
        read_table(path).find("valve")
    assert caught.value.remedy is not None
    from sysid.yaml_files import parse_yaml

    said = parse_yaml(caught.value.remedy.split(": ", 1)[1].split(";")[0], where="the remedy")
    assert read_table(path, files=FileOptions.model_validate(said)).find("valve").values[0] == 0.0


def test_truth_values_are_numbers_by_themselves(write: Write) -> None:
    table = read_table(write("run.csv", "t [s],a,b\n0,TRUE,false\n1,False,\n2,true,true\n"))
    np.testing.assert_array_equal(table.find("a").values, [1.0, 0.0, 1.0])
    np.testing.assert_array_equal(table.find("b").values, [0.0, NAN, 1.0])


def test_a_table_for_a_column_that_is_not_there_is_refused(write: Write) -> None:
    with pytest.raises(ChannelError, match="valv"):
        read_table(write("run.csv", VALVE), files=FileOptions.model_validate({"states": {"valv": {"ON": 1}}}))


@pytest.mark.parametrize("pair", PAIRS, ids="/".join)
def test_known_pairs_are_zero_and_one_in_any_case(pair: dict[str, float]) -> None:
    for change in (str.upper, str.title, str):
        found = known_states([change(word) for word in pair])
        assert found is not None
        assert set(found.values()) == {0.0, 1.0}
    assert known_states(["auto", "left"]) is None


@given(st.text(min_size=1, max_size=10).filter(str.isprintable))
def test_a_quoted_word_reads_back(text: str) -> None:
    from sysid.yaml_files import parse_yaml

    assert parse_yaml(f"{{{quoted(text)}: 1}}", where="a") == {text: 1}


LONG = "time [s],name,value,unit\n0,u,1,V\n0,p,5,bar\n1,u,2,V\n1,p,6,bar\n2,u,3,V\n"


def test_a_long_table_is_made_wide(write: Write) -> None:
    files = FileOptions.model_validate({"long": {"names": "name", "values": "value", "units": "unit"}})
    table = read_table(write("run.csv", LONG), files=files)
    assert [(column.name, column.unit) for column in table.columns] == [("time", "s"), ("u", "V"), ("p", "bar")]
    np.testing.assert_array_equal(table.find("p").values, [5.0, 6.0, NAN])
    assert table.lines is not None
    assert table.lines.tolist() == [2, 4, 6]


@pytest.mark.parametrize(
    ("long", "error"),
    [({"names": "tag", "values": "value"}, ChannelError), ({"names": "name", "values": "name"}, ReaderError)],
)
def test_a_long_table_that_is_none_is_refused(write: Write, long: dict[str, str], error: type[Exception]) -> None:
    with pytest.raises(error):
        read_table(write("run.csv", LONG), files=FileOptions.model_validate({"long": long}))


def test_signals_that_are_measurements_are_no_names(write: Write) -> None:
    text = "time [s],x,value\n" + "".join(f"{k},{k / 7},1\n" for k in range(400))
    files = FileOptions.model_validate({"long": {"names": "x", "values": "value"}})
    with pytest.raises(ConfigError, match="no names of signals"):
        read_table(write("run.csv", text), files=files)


@pytest.mark.parametrize(
    ("start", "step", "name", "told"),
    [
        (1.71e9, 0.1, "t", "s since 1970"),
        (1.71e12, 100.0, "t", "ms since 1970"),
        (1.71e15, 1e5, "t", "us since 1970"),
        (1.71e18, 1e8, "t", "ns since 1970"),
        (45363.34, 0.1 / 86400, "t", "days since 1900, as Excel counts"),
        (45363.0, 1.0, "Date", "days since 1900, as Excel counts"),
        (739323.0, 1 / 86400, "t", "days since year 0, as MATLAB counts"),
        (0.0, 0.1, "t", None),
        (45000.0, 0.1, "t", None),
        (45000.0, 1.0, "t", None),
        (1e12, 1e8, "t", None),  # a counter of nanoseconds since the machine was switched on
    ],
)
def test_a_clock_is_told_by_the_size_of_its_numbers(start: float, step: float, name: str, told: str | None) -> None:
    clock = clock_of(start + step * np.arange(50.0), name)
    assert (None if clock is None else clock.told) == told


def test_blanks_are_held_where_they_stand_for_no_change() -> None:
    levels = np.array([1.0, 3.0, 1.0, 3.0])
    held = np.full(20, NAN)
    held[::5] = levels
    rng = np.random.default_rng(1)
    noisy = rng.normal(size=200)
    noisy[rng.choice(200, 30, replace=False)] = NAN
    dead = np.concatenate([rng.normal(size=80), np.full(120, NAN)])
    slow = np.full(200, NAN)
    slow[::10] = rng.normal(size=20)
    assert [blanks_mean(values) for values in (held, noisy, dead, slow)] == ["hold", "mask", "mask", "hold"]


def test_an_hour_that_comes_twice_is_refused_with_the_zone_that_helps(write: Write) -> None:
    hours = [*range(90, 180, 10), *range(120, 240, 10)]
    path = write(
        "run.csv", "time,y [V]\n" + "".join(f"2024-10-27 {m // 60:02d}:{m % 60:02d},{k}\n" for k, m in enumerate(hours))
    )
    with pytest.raises(TraceError, match=r"(?s)step back.*zone: Europe/Berlin"):
        read_trace(path)
    trace = read_trace(path, files=FileOptions.model_validate({"time": {"column": "time", "zone": "Europe/Berlin"}}))
    assert (trace.sample_time, trace["y"].tolist()) == (600.0, [float(k) for k in range(len(hours))])
