"""Unknown files: what is found, and a description that loads them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sysid.errors import ReaderError, UserError
from sysid.ingest import inspect_file, load_dataset, propose_dataset
from sysid.traces import TraceSet
from sysid.units import Reference

Write = Callable[[str, str | bytes], Path]


def proposed(path: Path) -> TraceSet:
    """The data set that is proposed for a file, loaded from beside it."""
    (path.parent / "dataset.yaml").write_text(propose_dataset(inspect_file(path)))
    return load_dataset(path.parent)


def rows(count: int, line: Callable[[int], str]) -> str:
    return "".join(line(i) + "\n" for i in range(count))


def test_a_clean_file_is_described_without_guesses(write: Write) -> None:
    path = write("run.csv", "t [s],BP [bar gauge],u [V]\n" + rows(20, lambda i: f"{0.05 * i!r},{5 + i},{i}"))
    found = inspect_file(path)
    assert (found.sample_time, found.samples, found.problems) == (0.05, 20, ())
    assert [(c.name, c.unit, c.reference) for c in found.channels] == [
        ("BP", "bar", Reference.GAUGE),
        ("u", "V", Reference.NONE),
    ]
    assert (found.channels[0].minimum, found.channels[0].maximum) == (5.0, 24.0)
    text = propose_dataset(found)
    assert "guessed:" not in text
    assert "repairs" not in text
    assert proposed(path)["run"]["BP"].tolist() == [5.0 + i for i in range(20)]


def test_units_references_and_time_are_guessed_and_marked(write: Write) -> None:
    path = write("run.csv", "clock,P_kPa,Q_kPa,valve\n" + rows(20, lambda i: f"{100 * i},{101 + i},{i},{i % 3}"))
    found = inspect_file(path)
    assert (found.time.column, found.time.unit, found.time_guessed) == ("clock", "ms", True)
    assert found.sample_time == 0.1
    assert [(c.unit, c.unit_guessed, c.reference, c.reference_guessed) for c in found.channels] == [
        ("kPa", True, Reference.ABSOLUTE, True),
        ("kPa", True, Reference.GAUGE, True),
        ("1", True, Reference.NONE, False),
    ]
    assert "guessed: unit and reference; 101 to 120" in propose_dataset(found)
    assert proposed(path)["run"]["valve"].tolist() == [float(i % 3) for i in range(20)]


def test_a_data_set_is_called_as_its_folder_is(tmp_path: Path, write: Write) -> None:
    found = inspect_file(write("run.csv", "t [s],u,y\n" + rows(20, lambda i: f"{i},{i % 3},{i}")))
    assert "name: rig\n" in propose_dataset(found, folder=tmp_path / "datasets" / "rig"), "as `sysid run` finds it"
    assert "name: run\n" in propose_dataset(found, folder=tmp_path / "elsewhere")


def test_every_problem_is_told_and_its_repair_proposed(write: Write) -> None:
    stamps = [0, 1, 2, 3, 3, 4, 6, 5, 7, 8, 12, 13, 14.3, 15, 16, 17, 18, 19, 20]
    cells = [f"{t};{i};7;{'' if i == 2 else i}" for i, t in enumerate(stamps)]
    cells.insert(9, ";1;7;1")
    cells.insert(12, "9;9")
    found = inspect_file(path := write("run.csv", "t [s];u [V];still [A];holes [V]\n" + "\n".join(cells)))
    assert found.problems == (
        "1 ragged rows dropped, first at line 14",
        "1 sample without a time stamp",
        "1 backward time stamp",
        "1 duplicate time stamp",
        "4 samples missing in 2 gaps",
        "uneven time stamps, up to 0.277 s off",
        "still: never changes",
        "holes: 1 missing value",
    )
    assert found.needed.model_dump() == {
        "ragged": "drop", "stamps": "drop", "backward": "sort", "duplicates": "drop",
        "gaps": "mask", "nan": "mask", "marks": None, "mask": None, "repeats": None, "drift": None,
        "jitter": "resample", "constant": "accept",
    }  # fmt: skip
    trace = proposed(path)["run"]
    assert (trace.sample_time, len(trace)) == (1.0, 21)
    assert np.flatnonzero(~trace.usable_samples).tolist() == [2, 9, 10, 11]


def test_stamps_whose_marks_all_look_alike_are_understood(write: Write) -> None:
    stamps = [100 * i + i % 2 for i in range(30)]
    path = write("run.csv", "\r\n".join(f"{t:,}.000;{3 + t / 1e4:.3f}".replace(",", ".") for t in stamps))
    found = inspect_file(path)
    assert (found.time.column, found.time.unit, found.sample_time) == ("column_1", "ms", 0.1)
    assert (found.files.decimal, found.files.thousands) == (".", ".")
    trace = proposed(path)["run"]
    assert len(trace) == 30
    np.testing.assert_allclose(trace["column_2"], 3.0 + trace.time / 10.0, atol=6e-4)


def test_calendar_time_is_understood(write: Write) -> None:
    path = write("run.csv", "Time,u [V]\n" + rows(20, lambda i: f"2024-05-01 10:00:{i:02d},{i}"))
    found = inspect_file(path)
    assert (found.time.unit, found.sample_time) == ("datetime", 1.0)
    assert proposed(path)["run"]["u"].tolist() == [float(i) for i in range(20)]


def test_a_file_without_time_gets_a_step_to_be_corrected(write: Write) -> None:
    path = write("run.csv", "u [V],y [V]\n" + rows(20, lambda i: f"{i % 4},{i % 3}"))
    found = inspect_file(path)
    assert (found.time.step, found.time_guessed, found.problems) == (1.0, True, ("no time stamps",))
    assert "time: {step: 1.0}  # guessed" in propose_dataset(found)
    assert len(proposed(path)["run"]) == 20


@pytest.mark.parametrize("at", [0, 7])
def test_a_sample_time_in_a_column_of_its_own_is_taken_and_is_no_channel(write: Write, at: int) -> None:
    said = rows(20, lambda i: f"{i % 4},{i % 3},{'4' if i == at else ''}")
    path = write("run.csv", f"u [V],y [V],Ts\n{said}")
    found = inspect_file(path)
    assert (found.time.step, found.time_guessed) == (4.0, False)
    assert found.problems == ("sample time 4 s, from column Ts", "Ts: one value only, 4")
    assert proposed(path)["run"].channel_names == ("u", "y")
    assert len(proposed(path)["run"].usable_samples) == 20


def test_a_column_of_remarks_is_left_out_and_told(write: Write) -> None:
    path = write("run.csv", "t [s],state,u [V]\n" + rows(20, lambda i: f"{i},OK,{i}"))
    assert inspect_file(path).problems == ("state: the column holds words",)
    assert proposed(path).channels[0].name == "u"


def test_a_column_of_nothing_but_a_mark_is_no_column_of_words(write: Write) -> None:
    """A bar between columns; of + and - nobody knows whether they are states."""
    path = write("run.csv", "t [s];|;sign;u [V];y [V]\n" + rows(20, lambda i: f"{i};|;{'+-'[i > 9]};{i};{i % 7}"))
    bar, sign = inspect_file(path).problems
    assert bar == "|: the column holds one mark and no values"
    assert sign.startswith("sign: the column holds words ('+', '-')")


def test_a_value_far_from_all_others_is_told(write: Write) -> None:
    """What no list of usual marks has: 1e308 had been a value like any other."""
    path = write("run.csv", "t [s],u [V]\n" + rows(40, lambda k: f"{k / 10},{'1e308' if k == 7 else k % 5}"))
    found = inspect_file(path)
    assert "u: 1e+308 (1 sample) is far from all other values" in " ".join(found.problems)
    spiky = write("spiky.csv", "t [s],u [V]\n" + rows(40, lambda k: f"{k / 10},{50 if k == 7 else k % 5}"))
    assert not [one for one in inspect_file(spiky).problems if "far from" in one]


def test_a_short_file_is_still_described(write: Write) -> None:
    path = write("run.csv", "t [s],u [V]\n0,1\n1,2\n2,4\n")
    assert proposed(path)["run"]["u"].tolist() == [1.0, 2.0, 4.0]


def test_a_file_of_time_alone_is_refused(write: Write) -> None:
    with pytest.raises(ReaderError, match=r"(?s)no column that can be a channel.*time alone"):
        propose_dataset(inspect_file(write("run.csv", "t [s]\n" + rows(12, str))))


def test_what_cannot_be_read_at_all_is_refused(write: Write) -> None:
    with pytest.raises(ReaderError, match="not text"):
        inspect_file(write("run.csv", b"\x00" * 100))


def test_any_format_is_inspected(tmp_path: Path) -> None:
    import h5py

    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["rig/time"], file["rig/u"] = np.arange(20) * 0.01, np.sin(np.arange(20.0))
    trace = proposed(tmp_path / "run.h5")["run"]
    assert (trace.sample_time, trace.channel_names) == (0.01, ("rig/u",))


@settings(max_examples=60, deadline=None)
@given(
    st.text(min_size=1, max_size=12).filter(
        lambda name: name == name.strip() and "\r" not in name and "\n" not in name
    ),
    st.text(alphabet="abcdefghij -_.!'#{}[]:,&*?|<>=%@", min_size=1, max_size=12),
)
def test_whatever_columns_and_files_are_called_the_proposal_loads(
    tmp_path_factory: pytest.TempPathFactory, name: str, stem: str
) -> None:
    import csv

    path = tmp_path_factory.mktemp("any") / f"{stem}.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["t [s]", f"{name} [V]", "other [V]"])
        writer.writerows([[0.1 * i, i, 2 * i] for i in range(20)])
    try:
        traces = proposed(path)
    except UserError as error:
        assert error.remedy  # two columns of one name, a name that is nothing: refused, and told how to go on
        assert name.strip() in {"t", "other"} or not name.isprintable() or "\x00" in name
        return
    trace = traces.traces[0]
    assert trace.values[:, -1].tolist() == [2.0 * i for i in range(20)]
    assert name in trace.channel_names


def test_a_guess_is_told_in_words_and_where_to_say_otherwise(write: Write) -> None:
    text = "time [s];y [Pa]\n" + rows(20, lambda i: f"{i};1.234.567,{i:02d}")
    told = inspect_file(write("german.csv", text)).problems
    assert [one for one in told if "guess" in one] == [
        "',' is taken for the decimal mark, which is a guess: source.files.decimal in dataset.yaml says it",
        "'.' is taken for the mark between thousands, which is a guess: source.files.thousands in dataset.yaml says it",
    ]
    text = "time [s],y [Pa]\n" + rows(20, lambda i: f"{i},{'#N/A' if i == 7 else i * i}")
    told = inspect_file(write("sheet.csv", text)).problems
    assert "'#N/A' is taken for a missing value, which is a guess: source.files.missing in dataset.yaml says it" in told


@pytest.mark.parametrize(
    ("split", "roles"),
    [
        ([0.7], {"estimation": 14, "validation": 6}),
        ([0.5, 0.25, 0.25], {"estimation": 10, "selection": 5, "validation": 5}),
    ],
)
def test_a_record_is_proposed_in_parts(tmp_path: Path, split: list[float], roles: dict[str, int]) -> None:
    (tmp_path / "log.csv").write_text("t [s],u [V]\n" + "".join(f"{k},{k % 7}\n" for k in range(20)))
    text = propose_dataset(inspect_file(tmp_path / "log.csv"), split=split)
    (tmp_path / "dataset.yaml").write_text(text.replace("source:", "source:\n  grid: {fewest_samples: 2}"))
    loaded = load_dataset(tmp_path / "dataset.yaml")
    assert {trace.name: len(trace) for trace in loaded} == roles
    assert {name: role.value for name, role in loaded.roles.items()} == {name: name for name in roles}
    assert np.concatenate([trace["u"] for trace in loaded]).tolist() == [k % 7 for k in range(20)]


def test_a_step_that_stands_in_a_part_is_proposed_so_that_it_loads(tmp_path: Path) -> None:
    """A step test: after the first samples the heater never changes."""
    text = "t [s],heater [%],T [degC]\n" + "".join(f"{k},{50 * (k > 3)},{20 + k % 7}\n" for k in range(60))
    (tmp_path / "log.csv").write_text(text)
    proposed = propose_dataset(inspect_file(tmp_path / "log.csv"), split=[0.5, 0.2, 0.3])
    assert "heater: never changes in selection" in proposed
    (tmp_path / "dataset.yaml").write_text(proposed)
    assert [len(trace) for trace in load_dataset(tmp_path / "dataset.yaml")] == [30, 12, 18]


@pytest.mark.parametrize(("step", "unit"), [(0.02, "s"), (10, "ms"), (60, "s"), (1800, "s"), (10_000, "us")])
def test_stamps_without_a_unit_are_of_one_that_records_have(write: Write, step: float, unit: str) -> None:
    found = inspect_file(write("rig.csv", "Time,u\n" + rows(20, lambda i: f"{i * step},{i % 3}")))
    assert found.time.unit == unit
    assert f"Time in {unit}; the file does not say its unit" in found.time_told


@pytest.mark.parametrize(
    ("head", "step", "said"),
    [
        ("n,u", 1.0, "guessed: n counts the rows and says no time, 1 s between them"),
        ("t,u", 1.0, "guessed: t in s; the file does not say its unit; it rises by 1, as a number of samples does"),
        ("# fs = 20 Hz\nn,u", 0.05, ""),
        ("# fs = 20 Hz\nt,u", 0.05, ""),
    ],
)
def test_a_number_of_rows_is_not_taken_for_seconds_in_silence(write: Write, head: str, step: float, said: str) -> None:
    found = inspect_file(write("rig.csv", f"{head}\n" + rows(20, lambda i: f"{i},{i % 3}")))
    assert (found.sample_time, found.time_told) == (step, said)
    assert [column.name for column in found.channels] == ["u"]


def test_a_time_beside_a_rate_is_of_the_unit_that_agrees_with_it(write: Write) -> None:
    found = inspect_file(write("rig.csv", "# fs = 20 Hz\nt,u\n" + rows(20, lambda i: f"{50 * i},{i % 3}")))
    assert (found.sample_time, found.time.unit) == (0.05, "ms")
    found = inspect_file(write("bad.csv", "# fs = 20 Hz\nt [s],u\n" + rows(20, lambda i: f"{0.1 * i:.1f},{i % 3}")))
    assert found.sample_time == 0.1
    assert "the file says 0.05 s between samples, and t rises by 0.1 s: t is believed" in found.problems


@pytest.mark.parametrize(
    "content",
    [
        {"meta": {"fs": 20}, "data": {"u": [1, 2, 4], "y": [0, 1, 2]}},
        {"meta": {"sampling_rate_hz": 20}, "data": [{"u": 1, "y": 0}, {"u": 2, "y": 1}, {"u": 4, "y": 2}]},
        {"info": {"rig": "A", "timing": {"dt_ms": 50}}, "data": {"u": [1, 2, 4], "y": [0, 1, 2]}},
        {"meta": {"Fs [kHz]": 0.02, "channels": ["u", "y"]}, "data": [[1, 0], [2, 1], [4, 2]]},
        {
            "meta": {"fs": 20},
            "signals": {"u": {"values": [1, 2, 4], "unit": "V"}, "y": {"values": [0, 1, 2], "unit": "V"}},
        },
    ],
)
def test_what_is_said_of_arrays_may_stand_beside_them(write: Write, content: object) -> None:
    found = inspect_file(write("run.json", json.dumps(content)))
    assert (found.sample_time, [column.name for column in found.channels]) == (0.05, ["u", "y"])


def test_counts_may_be_hexadecimal(write: Write) -> None:
    path = write("bus.csv", "t [s],u [1],share_%\n" + rows(20, lambda i: f"{i},0x{250 * i:04X},{i}"))
    trace = proposed(path).traces[0]
    assert trace["u"].tolist() == [250.0 * i for i in range(20)]
    assert trace.channels[1].unit == "percent"


def test_a_table_that_lies_on_its_side_is_read_by_its_lines(write: Write) -> None:
    numbers = range(20)
    text = "".join(f"{name},{','.join(str(f(i)) for i in numbers)}\n" for name, f in SIDES.items())
    trace = proposed(write("side.csv", text)).traces[0]
    assert (trace.sample_time, trace.channel_names) == (0.5, ("u", "y"))
    assert trace["y"].tolist() == [float(i * i) for i in numbers]


SIDES = {"t [s]": lambda i: 0.5 * i, "u [V]": lambda i: i % 3, "y [V]": lambda i: i * i}


def test_stamps_that_are_uneven_by_a_third_of_a_step_lack_no_sample(write: Write) -> None:
    stamps = np.arange(60) * 0.1 + np.random.default_rng(1).uniform(-0.03, 0.03, 60)
    path = write("uneven.csv", "t [s],u [V]\n" + rows(60, lambda i: f"{stamps[i]:.4f},{i % 7}"))
    found = inspect_file(path)
    assert (found.sample_time, found.needed.gaps, found.needed.jitter) == (0.1, None, "resample")
    assert len(proposed(path).traces[0]) == 59  # from the first stamp on, as far as the last


@pytest.mark.parametrize(
    ("head", "first"),
    [("dt_ms,u", "50"), ("fs,u", "20"), ("# Sampling: 20 Hz\nv,u", "3"), ("# Log interval (ms): 50\nv,u", "3")],
)
def test_a_rate_is_understood_by_its_unit(write: Write, head: str, first: str) -> None:
    assert inspect_file(write("rig.csv", f"{head}\n" + rows(20, lambda i: f"{first},{i % 3}"))).sample_time == 0.05


def test_a_column_that_says_the_rate_is_no_guess_and_no_channel(write: Write) -> None:
    found = inspect_file(write("run.csv", "u [V],y [V],fs\n" + rows(20, lambda i: f"{i % 3},{i % 5},20")))
    assert (found.sample_time, found.time_guessed, [c.name for c in found.channels]) == (0.05, False, ["u", "y"])
    assert "sample time 0.05 s, from column fs" in found.problems
    assert "time: {step: 0.05}\n" in propose_dataset(found)


def test_stamps_that_are_uneven_by_a_third_or_wrong_once_leave_the_sample_time(write: Write) -> None:
    uneven = [0.1 * k + 0.03 * np.sin(3.0 * k) for k in range(60)]
    found = inspect_file(write("a.csv", "t [s],u [V]\n" + rows(60, lambda k: f"{uneven[k]:.4f},{k % 7}")))
    assert (found.sample_time, found.needed.gaps) == (0.1, None)
    once = [0.1 * k - (0.25 if k == 20 else 0.0) for k in range(60)]
    found = inspect_file(write("b.csv", "t [s],u [V]\n" + rows(60, lambda k: f"{once[k]:.2f},{k % 7}")))
    assert (found.sample_time, found.needed.backward) == (0.1, "sort")
