"""Command tables: a few rows in several forms become inputs at every sample; what cannot be meant is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.errors import ConfigError, UnitError
from sysid.export import CommandTable, read_command
from sysid.traces import Channel
from sysid.units import Reference

HANDLE = Channel(name="STP", unit="psi", reference=Reference.GAUGE)
FLOW = Channel(name="FLOW", unit="m^3/s")
ROWS = [[0, 90], [100, 84.2], [600, 90], [2050, 90]]
EXPECTED = np.repeat([90.0, 84.2, 90.0], [100, 500, 1450])

FORMS = {
    "CSV without a header": ("c.csv", "0,90\n100,84.2\n600,90\n2050,90\n", {"time_unit": "ds", "unit": "psi"}),
    "CSV that names units": ("c.csv", "time [ds],STP [psi]\n0,90\n100,84.2\n600,90\n2050,90\n", {}),
    "CSV with semicolons and decimal commas": ("c.csv", "t [ds];STP [psi]\n0;90\n100;84,2\n600;90\n2050;90\n", {}),
    "CSV with remarks": ("c.csv", "# a case\n\ntime [ds],STP\n0,90\n100,84.2\n600,90\n2050,90\n", {"unit": "psi"}),
    "CSV in seconds": ("c.csv", "time [s],STP [psi]\n0,90\n10,84.2\n60,90\n205,90\n", {}),
    "JSON, the rows alone": ("c.json", json.dumps(ROWS), {"time_unit": "ds", "unit": "psi"}),
    "JSON that says all": ("c.json", json.dumps({"time_unit": "ds", "unit": "psi", "command": ROWS}), {}),
    "YAML, units by channel": ("c.yaml", f"time_unit: ds\nunit: {{STP: psi}}\ncommand: {ROWS}\n", {}),
    "YAML, the rows over lines": (
        "c.yml",
        "time_unit: ds\nunit: psi\ncommand:\n  - [0, 90]\n  - [100, 84.2]\n  - [600, 90]\n  - [2050, 90]\n",
        {},
    ),
}


@pytest.mark.parametrize("form", FORMS)
def test_every_form_gives_the_same_inputs(form, tmp_path):
    name, text, declared = FORMS[form]
    (tmp_path / name).write_text(text)
    trace = read_command(tmp_path / name, [HANDLE], **declared).trace(0.1)
    np.testing.assert_array_equal(trace["STP"], EXPECTED)
    assert (trace.sample_time, trace.channels) == (0.1, (HANDLE,))


@pytest.mark.parametrize(
    ("unit", "value", "expected"),
    [("kPa", 620.528156, 90.0), ("kPa abs", 721.853156, 90.0), ("bar gauge", 6.20528156, 90.0), ("psi", 90.0, 90.0)],
)
def test_values_are_converted_to_the_channels_unit(unit, value, expected, tmp_path):
    (tmp_path / "c.csv").write_text(f"0,{value}\n1,{value}\n")
    found = read_command(tmp_path / "c.csv", [HANDLE], time_unit="s", unit=unit).trace(0.5)["STP"]
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_columns_are_found_by_their_names(tmp_path):
    (tmp_path / "c.csv").write_text("time [s],FLOW [l/s],STP [psi]\n0,2000,90\n1,3000,80\n2,0,0\n")
    trace = read_command(tmp_path / "c.csv", [HANDLE, FLOW]).trace(0.5)
    np.testing.assert_array_equal(trace["STP"], [90.0, 90.0, 80.0, 80.0])
    np.testing.assert_allclose(trace["FLOW"], [2.0, 2.0, 3.0, 3.0])


REFUSED = {
    "no unit of time": ("c.csv", "0,90\n1,80\n", {"unit": "psi"}, "unit of time is not declared"),
    "no unit of a value": ("c.csv", "0,90\n1,80\n", {"time_unit": "s"}, "unit of STP is not declared"),
    "two units": ("c.csv", "time [s],STP [psi]\n0,90\n1,80\n", {"unit": "kPa"}, "declared twice"),
    "a time that goes back": ("c.csv", "t [s],STP [psi]\n0,90\n5,80\n4,80\n", {}, "(?s)do not increase.*4 s after 5 s"),
    "a time that stands": ("c.csv", "t [s],STP [psi]\n0,90\n5,80\n5,80\n", {}, "do not increase"),
    "a late beginning": ("c.csv", "t [s],STP [psi]\n1,90\n5,80\n", {}, "(?s)do not increase.*1 s first"),
    "one row": ("c.csv", "t [s],STP [psi]\n0,90\n", {}, "needs a row for its end"),
    "nothing": ("c.csv", "", {"time_unit": "s", "unit": "psi"}, "needs a row for its end"),
    "a word": ("c.csv", "t [s],STP [psi]\n0,90\n1,full\n", {}, "(?s)no number.*row 2.*full"),
    "nan": ("c.csv", "t [s],STP [psi]\n0,90\n1,nan\n", {}, "not a number"),
    "a row too long": ("c.csv", "t [s],STP [psi]\n0,90\n1,80,3\n", {}, "(?s)another length.*row 2"),
    "another input": ("c.csv", "t [s],HANDLE [psi]\n0,90\n1,80\n", {}, "(?s)not one of this surrogate.*STP.*HANDLE"),
    "too long a time": ("c.csv", "t [d],STP [psi]\n0,90\n9000,80\n", {}, "cannot be meant"),
    "too short a time": ("c.csv", "t [ms],STP [psi]\n0,90\n9,80\n", {}, "cannot be meant"),
    "another kind of file": ("c.xlsx", "", {}, "not a kind of command file"),
    "YAML without rows": ("c.yaml", "time_unit: s\n", {}, "not a command file"),
    "YAML with a stranger": ("c.yaml", "command: [[0, 1]]\nspeed: 3\n", {}, "(?s)not a command file.*speed"),
    "YAML that is no table": ("c.yaml", "command: 3\n", {}, "not a list of rows"),
    "JSON cut short": ("c.json", "[[0, 90], [1", {"time_unit": "s", "unit": "psi"}, "c.json"),
    "a truth value": ("c.json", "[[0, true], [1, 2]]", {"time_unit": "s", "unit": "psi"}, "no number"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_meant_is_refused(case, tmp_path):
    name, text, declared, match = REFUSED[case]
    (tmp_path / name).write_text(text)
    with pytest.raises(ConfigError, match=match):
        read_command(tmp_path / name, [HANDLE], **declared).trace(0.1)


@pytest.mark.parametrize(
    ("time_unit", "unit"), [("psi", "psi"), ("s", "V"), ("s", "nonsense"), ("fortnights ago", "psi")]
)
def test_a_unit_of_something_else_is_refused(time_unit, unit, tmp_path):
    (tmp_path / "c.csv").write_text("0,90\n1,80\n")
    with pytest.raises(UnitError):
        read_command(tmp_path / "c.csv", [HANDLE], time_unit=time_unit, unit=unit)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(ConfigError, match="cannot be read"):
        read_command(tmp_path / "c.csv", [HANDLE])


@given(
    steps=st.lists(st.integers(1, 50), min_size=1, max_size=8),
    sample_time=st.sampled_from([0.1, 0.01, 0.25, 1.0 / 3.0]),
    data=st.data(),
)
def test_every_row_counts_from_its_sample(steps, sample_time, data):
    levels = data.draw(st.lists(st.floats(-100.0, 100.0), min_size=len(steps) + 1, max_size=len(steps) + 1))
    times = sample_time * np.cumsum([0, *steps])
    table = CommandTable(channels=(HANDLE,), times=times, values=np.array(levels)[:, np.newaxis], source="drawn")
    np.testing.assert_array_equal(table.trace(sample_time)["STP"], np.repeat(levels[:-1], steps))
