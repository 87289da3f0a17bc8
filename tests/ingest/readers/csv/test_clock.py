"""Which column of several in a table of text is the clock of the record."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sysid.ingest import FileOptions, TimeOptions, inspect_file, read_table

STEPS = [40, 25, 60, 35]
ALL, PART = np.arange(sum(STEPS)), np.concatenate([np.arange(n) for n in STEPS])
DATED = pd.Timestamp("2024-05-01 22:30:00") + pd.to_timedelta(60 * ALL, "s")
U, Y = np.sin(ALL / 7.0), np.cos(ALL / 5.0)


def of_day(minutes: np.ndarray) -> list[str]:
    return [f"{m // 60:02d}:{m % 60:02d}:00" for m in minutes]


CYCLERS = {
    "times of day that begin anew with each step": {"Time": of_day(PART), "Cumulative Time": of_day(ALL)},
    "beside dates": {"Relative Time": of_day(PART), "Absolute Time": DATED.strftime("%Y-%m-%d %H:%M:%S")},
    "numbers": {"Time [s]": 60.0 * PART, "Total Time [s]": 60.0 * ALL},
}


@pytest.mark.parametrize("case", CYCLERS)
def test_a_clock_that_runs_on_goes_before_that_of_each_step(tmp_path: Path, case: str) -> None:
    """A cycler of batteries had come as a record a step, or with half of its samples masked."""
    pd.DataFrame({**CYCLERS[case], "U [V]": U, "I [A]": Y}).to_csv(tmp_path / "a.csv", index=False)
    found = inspect_file(tmp_path / "a.csv")
    assert not found.cases
    assert found.time.column == list(CYCLERS[case])[1].split(" [")[0]
    assert (found.samples, found.sample_time, found.of_time) == (len(ALL), 60.0, [])


def test_records_whose_every_clock_stops_between_them_stay_records(tmp_path: Path) -> None:
    hours = np.repeat(np.arange(len(STEPS)), STEPS) * 7200.0
    columns = {"Time [s]": 60.0 * PART, "Total Time [s]": hours + 60.0 * PART, "U [V]": U, "I [A]": Y}
    pd.DataFrame(columns).to_csv(tmp_path / "a.csv", index=False)
    assert [case.finding.samples for case in inspect_file(tmp_path / "a.csv").cases] == STEPS


def test_a_clock_that_was_named_stays(tmp_path: Path) -> None:
    columns = {**CYCLERS["beside dates"], "U [V]": U}
    pd.DataFrame(columns).to_csv(tmp_path / "a.csv", index=False)
    table = read_table(tmp_path / "a.csv", files=FileOptions(time=TimeOptions(column="Relative Time", unit="datetime")))
    assert np.nanmin(np.diff(table.find("Relative Time").values)) < 0.0


def test_what_is_called_time_goes_before_a_counter(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    uneven = np.cumsum(rng.uniform(0.002, 0.008, len(ALL)))
    pd.DataFrame({"step_pru": ALL, "cputime_pru": uneven, "v": U}).to_csv(tmp_path / "a.csv", index=False)
    assert inspect_file(tmp_path / "a.csv").time.column == "cputime_pru"
