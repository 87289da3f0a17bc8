"""Data sets by name or path."""

from __future__ import annotations

import os
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.content import content_folders
from sysid.errors import ConfigError, ReaderError, UserError
from sysid.ingest import find_dataset, load_dataset
from sysid.ingest.datasets.dataset import unmade
from sysid.traces import Role


def test_a_generated_data_set_has_its_roles_rounding_and_provenance(ramp: Any, ramp_dataset: Path) -> None:
    traces = load_dataset(ramp_dataset, cache=False)
    assert (traces.name, traces.names, dict(traces.roles)) == (
        "ramps",
        ("EST", "VAL"),
        {"EST": Role.ESTIMATION, "VAL": Role.VALIDATION},
    )
    exact = np.arange(50) * 0.1 * 6.0 / 3.0
    np.testing.assert_array_equal(traces["VAL"]["u"], np.round(exact, 2))
    np.testing.assert_allclose(traces["VAL"]["y"], 2.0 * exact, rtol=1e-15)
    assert traces["VAL"].provenance == ("made by the generator ramp", "a ramp", "u: rounded to 2 decimals")
    assert traces.source == "made for a test\nInferred: the slope"


@pytest.mark.parametrize("kept", [False, True])
def test_what_a_generator_makes_is_masked(ramp: Any, ramp_dataset: Path, tmp_path: Path, kept: bool) -> None:
    """Made or kept from before: the mask is no part of what is made."""
    where = tmp_path / "cache" if kept else False
    plain = load_dataset(ramp_dataset, cache=where)
    file = ramp_dataset if ramp_dataset.is_file() else ramp_dataset / "dataset.yaml"
    text = file.read_text(encoding="utf-8")
    mask = "source:\n  repairs: {mask: [{channel: y, start: 1.0, stop: 1.9, cases: [VAL]}]}\n"
    file.write_text(text.replace("source:\n", mask), encoding="utf-8")
    traces = load_dataset(ramp_dataset, cache=where)
    assert np.flatnonzero(~traces["VAL"].usable_of(["y"])).tolist() == [*range(10, 20)]
    assert traces["VAL"].usable_of(["u"]).all() and traces["EST"].usable is None
    assert traces["VAL"].provenance == (*plain["VAL"].provenance, "y: 10 samples masked, from 1 s to 1.9 s")
    assert len(ramp.calls) == (2 if kept else 4)
    file.write_text(text.replace("source:\n", mask.replace("start: 1.0, stop: 1.9", "start: 90")), encoding="utf-8")
    with pytest.raises(ConfigError, match="holds no sample"):
        load_dataset(ramp_dataset, cache=where)


def test_a_trace_is_made_once(ramp: Any, ramp_dataset: Path, tmp_path: Path) -> None:
    first = load_dataset(ramp_dataset, cache=tmp_path / "cache")
    second = load_dataset(ramp_dataset, cache=tmp_path / "cache")
    assert ramp.calls == ["EST", "VAL"]
    assert first.digest == second.digest
    assert first["EST"].provenance == second["EST"].provenance


def test_the_default_cache_is_used(
    ramp: Any, ramp_dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path / "mine"))
    load_dataset(ramp_dataset)
    assert len(list((tmp_path / "mine" / "traces").glob("*.npz"))) == 2


@pytest.mark.parametrize(
    ("old", "new", "made"),
    [
        ("slope: 1.0", "slope: 1.5", ["EST"]),
        ("gain: 2.0", "gain: 2.5", ["EST", "VAL"]),
        ("sample_time: 0.1", "sample_time: 0.2", ["EST", "VAL"]),
        ("decimals: 2", "decimals: 3", ["EST", "VAL"]),
        ("unit: V", "unit: mV", ["EST", "VAL"]),
        ("  EST:", "  NEW:", ["NEW"]),
        ("role: estimation", "role: test", []),
        ("made for a test", "made for another", []),
    ],
)
def test_what_changes_the_samples_makes_them_again(  # noqa: PLR0917 - fixtures and one row of a table
    ramp: Any, ramp_dataset: Path, tmp_path: Path, old: str, new: str, made: list[str]
) -> None:
    load_dataset(ramp_dataset, cache=tmp_path / "cache")
    ramp.calls.clear()
    ramp_dataset.write_text(ramp_dataset.read_text().replace(old, new, 1))
    load_dataset(ramp_dataset, cache=tmp_path / "cache")
    assert ramp.calls == made


def test_another_version_of_the_generator_makes_them_again(
    ramp: Any, ramp_dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import sys

    load_dataset(ramp_dataset, cache=tmp_path / "cache")
    monkeypatch.setattr(sys.modules[type(ramp).__module__], "GENERATOR_VERSION", 2, raising=False)
    load_dataset(ramp_dataset, cache=tmp_path / "cache")
    assert ramp.calls == ["EST", "VAL"] * 2


def test_a_damaged_entry_is_made_again(ramp: Any, ramp_dataset: Path, tmp_path: Path) -> None:
    good = load_dataset(ramp_dataset, cache=tmp_path / "cache")
    for path in (tmp_path / "cache" / "traces").glob("*.npz"):
        path.write_bytes(b"damaged")
    assert load_dataset(ramp_dataset, cache=tmp_path / "cache").digest == good.digest
    assert ramp.calls == ["EST", "VAL"] * 2


def test_progress_is_told_before_each_case(ramp: Any, ramp_dataset: Path) -> None:
    told: list[tuple[str, int, int]] = []
    load_dataset(ramp_dataset, cache=False, progress=lambda *args: told.append(args))
    assert told == [("EST", 0, 2), ("VAL", 1, 2)]


def test_cases_can_be_chosen(ramp: Any, ramp_dataset: Path) -> None:
    assert load_dataset(ramp_dataset, cache=False, cases=["VAL"]).names == ("VAL",)
    assert ramp.calls == ["VAL"]
    with pytest.raises(ConfigError, match=r"(?s)no case VALL.*one of EST, VAL.*did you mean VAL"):
        load_dataset(ramp_dataset, cache=False, cases=["VALL"])
    with pytest.raises(ConfigError, match="no case is asked for"):
        load_dataset(ramp_dataset, cache=False, cases=[])


def test_a_data_set_is_found_by_file_folder_and_name(ramp_dataset: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = ramp_dataset.parent
    assert find_dataset(ramp_dataset) == ramp_dataset
    assert find_dataset(folder) == ramp_dataset
    assert find_dataset("ramps", search=[folder.parent]) == ramp_dataset
    monkeypatch.chdir(folder.parent.parent)
    assert find_dataset("ramps") == ramp_dataset


def test_the_workspace_comes_before_the_built_in_ones(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    built_in = find_dataset("abdx-service")
    assert tmp_path not in built_in.parents
    own = tmp_path / "datasets" / "abdx-service" / "dataset.yaml"
    own.parent.mkdir(parents=True)
    own.write_text("name: mine")
    assert find_dataset("abdx-service") == own


def test_an_unknown_data_set_names_the_known_ones(ramp_dataset: Path) -> None:
    with pytest.raises(ConfigError, match=r"(?s)no data set ramp-s.*one of ramps.*did you mean ramps"):
        find_dataset("ramp-s", search=[ramp_dataset.parent.parent])


def test_ones_own_data_sets_are_named_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    own = tmp_path / "datasets" / "zz-mine" / "dataset.yaml"
    own.parent.mkdir(parents=True)
    own.write_text("name: zz-mine")
    with pytest.raises(ConfigError) as caught:
        find_dataset("quite-another")
    assert str(caught.value.expected).startswith("one of zz-mine, ")


def test_every_built_in_data_set_is_described_without_mistake() -> None:
    from sysid.ingest import read_description

    found = [path for folder in content_folders("datasets") for path in sorted(folder.glob("*/dataset.yaml"))]
    assert {read_description(path).name for path in found} >= {"abdx-service", "abdx-combined"}


FILES = """
name: rig
sample_time: 0.05
channels:
  - {name: BP, unit: psi, reference: gauge, decimals: 2}
source:
  files: {time: "t [ms]", columns: {BP: P_pipe}, references: gauge, separator: ";"}
  repairs: {duplicates: drop}
cases:
  R1: {role: estimation, file: data/r1.csv}
  R2: {role: validation, file: data/r2.csv, start: 0.25}
"""


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    (tmp_path / "data").mkdir()
    for name, extra in (("r1", ""), ("r2", "950;295,0\n")):
        rows = "".join(f"{50 * i};{200 + 5 * i},0\n" for i in range(20))
        (tmp_path / "data" / f"{name}.csv").write_text("t [ms];P_pipe [kPa]\n" + rows + extra)
    (tmp_path / "dataset.yaml").write_text(FILES)
    return tmp_path


def test_files_of_a_users_own_become_a_trace_set(rig: Path) -> None:
    traces = load_dataset(rig)
    expected = np.round((200.0 + 5.0 * np.arange(20)) / 6.894757, 2)
    np.testing.assert_array_equal(traces["R1"]["BP"], expected)
    np.testing.assert_array_equal(traces["R2"]["BP"], expected[5:])
    assert traces["R2"].start_time == pytest.approx(0.25)
    assert [note.split(" (")[0] for note in traces["R2"].provenance] == [
        "read from r2.csv",
        "decimal comma",
        "BP: converted from kPa gauge to psi gauge",
        "dropped: 1 duplicate time stamps, first at sample 20",
        "cut to 15 of 20 samples by start 0.25, stop None",
        "BP: rounded to 2 decimals",
    ]


def test_a_missing_file_is_named(rig: Path) -> None:
    (rig / "data" / "r2.csv").unlink()
    with pytest.raises(ReaderError, match=r"(?s)no such file.*r2\.csv"):
        load_dataset(rig)


def test_a_real_dirty_record_is_read_as_its_description_says(tmp_path: Path) -> None:
    folder = os.environ.get("SYSID_DATA")
    source = Path(folder, "pneumatic_air_chamber", "Ultimaker_015.csv") if folder else None
    if source is None or not source.is_file():
        pytest.skip("SYSID_DATA does not name a folder that holds pneumatic_air_chamber")
    (tmp_path / "dataset.yaml").write_text(
        f"""
name: chamber
sample_time: 0.1
channels: [{{name: P, unit: kPa, reference: gauge}}, {{name: U, unit: V}}]
source:
  files: {{names: ["t [ms]", "P [bar]", "U [V]"], decimal: ".", thousands: ".", references: gauge}}
  grid: {{method: linear}}
  repairs: {{jitter: resample, gaps: mask}}
cases:
  U015: {{role: estimation, file: "{source}"}}
"""
    )
    trace = load_dataset(tmp_path)["U015"]
    # first and last line of the file: 0.000;3.826;7.652 and 143.863.000;0.036;0.072
    assert trace["P"][0] == pytest.approx(382.6)
    assert trace["U"][0] == 7.652
    assert len(trace) == 1439
    # steps of 262, 572 and 499 ms between stamps that are 100 ms apart otherwise
    stamps = [int(line.split(";")[0].replace(".", "")) for line in source.read_text().splitlines()]  # microseconds
    gaps = [(a, b) for a, b in pairwise(stamps) if b - a > 150_000]
    lost = [100_000 * k for k in range(1439) if any(a < 100_000 * k < b for a, b in gaps)]
    assert len(gaps) == 3
    np.testing.assert_allclose(trace.time[~trace.usable_samples], np.array(lost) / 1e6, atol=1e-9)


TWO_RECORDS = """
name: two
sample_time: 0.1
channels: [{name: u, unit: V}, {name: y, unit: V}]
source: {files: {time: {step: 0.1}, units: V}}
cases:
  EST: {role: estimation, file: a.npz, columns: {u: uEst, y: yEst}}
  VAL: {role: validation, file: a.npz, columns: {u: uVal, y: yVal}}
  END: {role: test, file: a.npz, columns: {u: uVal, y: yVal}, rows: [3, null]}
  MID: {role: test, file: a.npz, columns: {u: uEst, y: yEst}, rows: [3, 14]}
"""


def test_cases_of_one_file_have_columns_and_rows_of_their_own(tmp_path: Path) -> None:
    u, y = np.arange(20.0), np.arange(20.0) ** 2
    np.savez(tmp_path / "a.npz", uEst=u, yEst=y, uVal=-u[:13], yVal=-y[:13])
    (tmp_path / "dataset.yaml").write_text(TWO_RECORDS)
    traces = load_dataset(tmp_path)
    assert {trace.name: len(trace) for trace in traces} == {"EST": 20, "VAL": 13, "END": 11, "MID": 12}
    np.testing.assert_array_equal(traces["VAL"]["y"], -y[:13])
    np.testing.assert_array_equal(traces["END"]["u"], -u[2:13])
    np.testing.assert_array_equal(traces["MID"]["y"], y[2:14])
    assert "rows 3 to 14 of 20" in traces["MID"].provenance


@pytest.mark.parametrize("rows", ["3:14", "'3:14'", "[3, 14]"])
def test_rows_have_a_short_form(tmp_path: Path, rows: str) -> None:
    np.savez(tmp_path / "a.npz", uEst=np.arange(20.0), yEst=np.arange(20.0))
    text = TWO_RECORDS.split("  VAL", maxsplit=1)[0].replace("y: yEst}", f"y: yEst}}, rows: {rows}")
    (tmp_path / "dataset.yaml").write_text(text)
    np.testing.assert_array_equal(load_dataset(tmp_path)["EST"]["u"], np.arange(2.0, 14.0))


@pytest.mark.parametrize("rows", ["[0, 4]", "[5, 30]", "[9, 4]", "some", "1e3:2"])
def test_rows_that_are_not_there_are_refused(tmp_path: Path, rows: str) -> None:
    np.savez(tmp_path / "a.npz", uEst=np.arange(20.0), yEst=np.arange(20.0))
    text = TWO_RECORDS.split("  VAL", maxsplit=1)[0].replace("y: yEst}", f"y: yEst}}, rows: {rows}")
    (tmp_path / "dataset.yaml").write_text(text)
    with pytest.raises(UserError, match="rows"):
        load_dataset(tmp_path)


MIXED = """
name: both
sample_time: 0.1
channels:
  - {name: u, unit: V}
  - {name: y, unit: m}
source:
  generator: ramp
  files: {time: {step: 0.1}, units: {u: V, y: m}}
cases:
  EST: {role: estimation, recipe: {slope: 1.0}}
  TST: {role: test, file: [force.csv, seen.csv]}
"""


def test_some_cases_are_made_and_others_read_each_from_several_files(
    ramp: Any, write: Callable[[str, str | bytes], Path], tmp_path: Path
) -> None:
    path = write("dataset.yaml", MIXED)
    seen = np.arange(12.0)
    for name, letter, factor in (("force.csv", "u", 1.0), ("seen.csv", "y", 2.0)):
        write(name, "\n".join([letter, *map(str, factor * seen)]))
    traces = load_dataset(path, cache=tmp_path / "cache")
    assert ramp.calls == ["EST"]
    assert dict(traces.roles) == {"EST": Role.ESTIMATION, "TST": Role.TEST}
    np.testing.assert_array_equal(traces["TST"].values, np.column_stack([seen, 2.0 * seen]))
    write("seen.csv", "y\n4\n5\n")
    with pytest.raises(ReaderError, match=r"(?s)different lengths.*seen\.csv.*12 rows, as in force\.csv.*2 rows"):
        load_dataset(path, cache=tmp_path / "cache")


def test_only_what_a_generator_makes_is_still_to_be_made(
    ramp: Any, write: Callable[[str, str | bytes], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path / "cache"))
    lacking = unmade(write("dataset.yaml", MIXED))
    assert lacking is not None
    assert lacking.cases == 1


@pytest.mark.parametrize("name", ["page.html", "sheet.pdf", "record"])
def test_a_text_of_another_kind_is_no_description(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("<html><body>a page</body></html>", encoding="utf-8")
    with pytest.raises(ReaderError, match="no reader knows this kind of file"):
        find_dataset(tmp_path / name)


def test_a_record_is_no_description(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("t,u,y\n0,1,2\n1,2,3\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="no description of a data set") as refused:
        find_dataset(tmp_path / "run.csv")
    assert ".csv" in str(refused.value)
