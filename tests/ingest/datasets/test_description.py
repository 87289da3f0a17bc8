"""dataset.yaml, checked field by field."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from sysid.errors import ConfigError
from sysid.ingest import read_description
from sysid.traces import Role
from sysid.units import Reference

Write = Callable[[str, str | bytes], Path]

GOOD = """
name: rig
sample_time: 0.05
channels:
  - {name: BP, unit: kPa, reference: gauge, decimals: 1}
  - {name: u, unit: 1}
source:
  files:
    time: t [ms]
    columns: {BP: "P_pipe [bar gauge]", u: {column: drive, unit: V}}
    separator: ";"
  grid: {method: linear}
  repairs: {gaps: mask, nan: interpolate}
cases:
  R1: {role: estimation, file: r1.csv, start: 1, stop: 2.5}
inferred: [the unit of BP]
"""


def test_a_description_is_read(write: Write) -> None:
    description = read_description(write("dataset.yaml", GOOD))
    assert [(c.name, c.unit, c.reference) for c in description.trace_channels] == [
        ("BP", "kPa", Reference.GAUGE),
        ("u", "1", Reference.NONE),
    ]
    assert description.decimals == {"BP": 1}
    files = description.source.files
    assert files is not None
    assert (files.time.column, files.time.unit) == ("t", "ms")
    assert (files.columns["BP"].column, files.columns["BP"].unit) == ("P_pipe", "bar")
    assert files.columns["BP"].reference is Reference.GAUGE
    assert (files.columns["u"].column, files.columns["u"].unit) == ("drive", "V")
    assert description.cases["R1"].role is Role.ESTIMATION
    assert (description.source.repairs.gaps, description.source.repairs.backward) == ("mask", None)


# problem: text to replace, its replacement, message: field, expected, got, remedy
REFUSED = {
    "a misspelt field": (
        "sample_time:",
        "sampletime:",
        r"unknown field 'sampletime'.*field sampletime.*did you mean sample_time",
    ),
    "a misspelt field in a channel": (
        "decimals: 1",
        "decimal: 1",
        r"field channels\[0\]\.decimal.*decimals.*did you mean decimals",
    ),
    "a misspelt option of files": (
        "separator:",
        "seperator:",
        r"field source\.files\.seperator.*did you mean separator",
    ),
    "a misspelt repair": (
        "nan: interpolate",
        "nans: drop",
        r"field source\.repairs\.nans.*duplicates.*did you mean nan\?",
    ),
    "a repair that does not exist": (
        "gaps: mask",
        "gaps: ignore",
        r"field source\.repairs\.gaps.*'linear', 'hold' or 'mask'.*'ignore'",
    ),
    "a misspelt field of a case": (
        "role: est",
        "rolle: est",
        r"field cases\.R1\.rolle.*role, recipe, file, start, stop.*did you mean role",
    ),
    "a role that does not exist": (
        "role: estimation",
        "role: training",
        r"field cases\.R1\.role.*estimation.*'training'",
    ),
    "a missing field": ("sample_time: 0.05", "", r"'sample_time' is missing.*add sample_time"),
    "a sample time that is not positive": ("0.05", "-0.05", r"field sample_time.*greater than 0.*-0\.05"),
    "a sample time that is text": ("0.05", "fast", r"field sample_time.*valid number.*'fast'"),
    "an unknown unit": ("unit: kPa", "unit: kPaa", r"unknown unit 'kPaa'.*field channels\[0\].*known to pint.*kPaa"),
    "a unit with its reference": (
        "unit: kPa, reference: gauge",
        "unit: barg",
        r"mixes a unit and a reference.*unit: bar and reference: gauge",
    ),
    "a pressure without reference": (
        ", reference: gauge, d",
        ", d",
        r"channel BP does not say.*gauge, absolute, or none.*add reference",
    ),
    "a reference on no pressure": (
        "unit: 1}",
        "unit: V, reference: gauge}",
        r"channel u has a reference.*a unit of pressure.*unit: V",
    ),
    "two channels of one name": ("name: u", "name: BP", r"two channels are named BP.*field channels.*a different name"),
    "no channels": (
        GOOD[GOOD.index("channels:") : GOOD.index("source:")],
        "channels: []\n",
        r"field channels.*at least 1 entry",
    ),
    "no cases": (GOOD[GOOD.index("cases:") : GOOD.index("inferred:")], "cases: {}\n", r"field cases.*at least 1 entry"),
    "options without a generator": (
        "  files:\n",
        "  options: {a: 1}\n  files:\n",
        r"source.options means nothing here.*field source.*options with a generator",
    ),
    "a file and a recipe for one case": (
        "file: r1.csv",
        "file: r1.csv, recipe: {a: 1}",
        r"case R1 does not fit.*file, as the source is files.*remove recipe",
    ),
    "neither kind of source": (
        GOOD[GOOD.index("  files:") : GOOD.index("  grid:")],
        "",
        r"neither a generator nor files",
    ),
    "a recipe for a file": (
        "file: r1.csv",
        "recipe: {a: 1}",
        r"case R1 does not fit.*file, as the source is files.*write file",
    ),
    "stop before start": ("stop: 2.5", "stop: 0.5", r"stop is not after start.*field cases\.R1.*above 1 s.*0\.5 s"),
    "one mark for two things": (
        'separator: ";"',
        'separator: ","\n    decimal: ","',
        r"separator and decimal are the same.*field source\.files",
    ),
    "a step beside a time column": (
        "time: t [ms]",
        "time: {column: t, step: 0.1}",
        r"time\.step and a time column exclude",
    ),
    "a format beside no calendar time": (
        "time: t [ms]",
        "time: {column: t, unit: s, format: '%S'}",
        r"format is for calendar time.*unit: datetime",
    ),
    "a key that stands twice": (
        "sample_time: 0.05",
        "sample_time: 0.05\nname: again",
        r"'name' stands twice|key 'name'",
    ),
    "broken YAML": ("channels:", "channels: [", r"not valid YAML.*line \d+, column \d+"),
    "not a mapping": (GOOD, "- a\n- b\n", r"does not hold a mapping.*a list"),
    "an empty file": (GOOD, "", r"does not hold a mapping.*an empty file"),
}


@pytest.mark.parametrize(("old", "new", "message"), REFUSED.values(), ids=REFUSED)
def test_a_mistake_is_named_with_its_field(write: Write, old: str, new: str, message: str) -> None:
    assert GOOD.count(old) >= 1
    path = write("dataset.yaml", GOOD.replace(old, new, 1))
    with pytest.raises(ConfigError, match=f"(?s){message}") as caught:
        read_description(path)
    assert str(path) in str(caught.value.where)
    assert caught.value.remedy


def test_several_mistakes_are_all_named(write: Write) -> None:
    path = write("dataset.yaml", GOOD.replace("separator:", "seperator:").replace("gaps: mask", "gaps: ignore"))
    with pytest.raises(ConfigError, match=re.escape("(also at fault: source.repairs.gaps)")):
        read_description(path)


def test_a_missing_description_says_how_to_get_one(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"(?s)no description.*sysid ingest FILE"):
        read_description(tmp_path / "dataset.yaml")


def test_bytes_that_are_not_text_are_refused(write: Write) -> None:
    with pytest.raises(ConfigError, match=r"(?s)cannot be read.*UTF-8"):
        read_description(write("dataset.yaml", b"\xff\xfe\x00name"))


def test_the_page_about_files_shows_descriptions_that_are_valid(tmp_path: Path) -> None:
    page = (Path(__file__).resolve().parents[3] / "docs" / "files" / "several-records.md").read_text(encoding="utf-8")
    shown = [
        block for block in re.findall(r"^```yaml\n(.*?)^```$", page, re.MULTILINE | re.DOTALL) if "cases:" in block
    ]
    assert shown
    for block in shown:
        (tmp_path / "dataset.yaml").write_text(block)
        assert read_description(tmp_path / "dataset.yaml").cases
