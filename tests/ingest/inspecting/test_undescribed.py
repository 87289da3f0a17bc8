"""A bare file is the data set that would be proposed for it, and says what was guessed."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

import sysid
from sysid.errors import TraceError
from sysid.ingest import inspect_file, load_dataset, propose_dataset
from sysid.ingest.inspecting.undescribed import GuessedWarning, load_file
from sysid.traces import Role

Write = Callable[[str, str | bytes], Path]


def lines(header: str, row: Callable[[int], str], count: int = 40) -> str:
    return "\n".join([header, *(row(k) for k in range(count))]) + "\n"


BARE = {
    "no units": (lines("t [s],u,y", lambda k: f"{0.1 * k:.1f},{k % 7},{k}"), "no unit for u, y"),
    "no unit of time": (
        lines("time,u [V]", lambda k: f"{0.1 * k:.1f},{k % 7}"),
        "time in s; the file does not say its",
    ),
    "no time": (lines("u [V],y [m]", lambda k: f"{k % 7},{k * k % 11}"), "no time stamps, 1 s between them"),
    "a unit in the name": (lines("t [s],p_kPa", lambda k: f"{k},{5 + k % 3}"), "p_kPa in kPa; p_kPa is gauge pressure"),
    "points for thousands": (
        lines("t [s];p [kPa gauge]", lambda k: f"{k};1.{100 + k}.{100 + k}"),
        "'.' is taken for the mark between thousands",
    ),
    "a name twice": (
        lines("t [s],u [V],y [V],y [m]", lambda k: f"{k},{k % 7},{k},{2 * k}"),
        "a name stands twice, so columns are called 't [s]', 'u [V]', 'y [V]', 'y 2 [m]'",
    ),
    "what is no measurement": (
        lines("t [s],u,y,No.,remark", lambda k: f"{k},{k % 7},{k * k % 5},{k + 1},ok{k}"),
        "left out: No. (counts the rows), remark",
    ),
}


@pytest.mark.parametrize(("text", "told"), BARE.values(), ids=BARE)
def test_what_the_file_leaves_out_is_guessed_as_it_is_proposed_and_told(text: str, told: str, write: Write) -> None:
    path = write("run.csv", text)
    with pytest.warns(GuessedWarning) as warned:
        bare = sysid.load(path)
    assert told in str(warned[0].message)
    assert f"Inferred: {told.split(';', maxsplit=1)[0]}" in bare.source  # which the report shows
    (path.parent / "dataset.yaml").write_text(propose_dataset(inspect_file(path)))
    described = load_dataset(path.parent)
    assert [trace.digest for trace in bare.traces] == [trace.digest for trace in described.traces]
    assert bare.roles == described.roles


def test_a_file_that_says_all_is_taken_as_it_stands(write: Write) -> None:
    path = write("run.csv", lines("t [s],u [V],y [m]", lambda k: f"{k},{k % 7},{k * k % 11}"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert sysid.load(path).roles == {"run": Role.ESTIMATION}


def test_samples_are_not_repaired_unasked(write: Write) -> None:
    path = write("run.csv", lines("t [s],u,y", lambda k: f"{k},{k % 7},{'' if k == 9 else k}"))
    with pytest.raises(TraceError, match=r"(?s)missing.*sysid ingest .*run\.csv --propose"):
        sysid.load(path)


def test_several_records_are_as_many_traces(tmp_path: Path) -> None:
    from scipy.io import savemat

    path = tmp_path / "two.mat"
    rng = np.random.default_rng(0)
    savemat(path, {name: {"u": rng.random(size), "y": rng.random(size)} for name, size in {"a": 30, "b": 20}.items()})
    with pytest.warns(GuessedWarning, match="2 records: .*roles a: estimation, b: "):
        traces = sysid.load(path)
    assert [len(trace) for trace in traces.traces] == [30, 20]


def test_a_channel_that_never_changes_does_not_keep_the_others_from_being_read(write: Write) -> None:
    path = write("run.csv", lines("t [s],u [V],y [m],pin [1]", lambda k: f"{k},{k % 7},{k * k % 11},1"))
    assert np.ptp(sysid.load(path).traces[0]["pin"]) == 0.0


def test_the_command_line_tells_what_was_guessed(
    write: Write, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from sysid.workbench.cli import run_cli

    rng = np.random.default_rng(0)
    u = rng.standard_normal(300).cumsum()
    y = np.convolve(u, [0.0, 0.5, 0.3, 0.1])[:300] + 0.01 * rng.standard_normal(300)
    path = write("run.csv", lines("time,u,y", lambda k: f"{0.1 * k:.1f},{u[k]},{y[k]}", 300))
    monkeypatch.chdir(path.parent)
    with warnings.catch_warnings():
        warnings.simplefilter("default", GuessedWarning)
        assert run_cli(["advise", str(path)]) == 0
    assert "no unit for u, y" in capsys.readouterr().err


def test_simulate_guesses_the_time_of_a_file_and_has_the_models_where_there_is_none(write: Write) -> None:
    from sysid.ingest import FileOptions, read_table
    from sysid.ingest.inspecting.undescribed import guessed_time

    stamped = write("stamped.csv", lines("stamps,u", lambda k: f"{100 * k},{k % 7}"))
    with pytest.warns(GuessedWarning, match="stamps in ms"):
        found = guessed_time(read_table(stamped), FileOptions(), sample_time=0.5)
    assert (found.time.column, found.time.unit) == ("stamps", "ms")
    bare = write("bare.csv", lines("u,w", lambda k: f"{k % 7},{k * k % 11}"))
    with pytest.warns(GuessedWarning, match="no time stamps, 0.5 s between them"):
        assert guessed_time(read_table(bare), FileOptions(), sample_time=0.5).time.step == 0.5
    said = write("said.csv", lines("t [s],u", lambda k: f"{k},{k % 7}"))
    assert guessed_time(read_table(said), FileOptions(), sample_time=0.5) == FileOptions()


@pytest.mark.parametrize("lengths", [(60, 50, 40), (60, 60, 60)], ids=["of several lengths", "of one length"])
def test_records_of_a_file_that_says_all_else_are_records_too(tmp_path: Path, lengths: tuple[int, ...]) -> None:
    """The first had been read alone, in silence, or all of them as channels of one record."""
    file, rng = tmp_path / "rig.h5", np.random.default_rng(0)
    with h5py.File(file, "w") as written:
        for name, n in zip(("run1", "run2", "val"), lengths, strict=True):
            for column, unit in (("time", "s"), ("u", "V"), ("y", "cm")):
                values = 0.5 * np.arange(n) if column == "time" else rng.random(n)
                written.create_dataset(f"{name}/{column}", data=values).attrs["units"] = unit
    with pytest.warns(GuessedWarning, match=r"3 records: run1 \(60 samples\).*val: validation"):
        found = load_file(file)
    assert [(one.name, len(one)) for one in found] == list(zip(("run1", "run2", "val"), lengths, strict=True))
    assert [channel.label for channel in found.channels] == ["u [V]", "y [cm]"]


def test_columns_of_another_length_are_told(tmp_path: Path) -> None:
    file = tmp_path / "rig.npz"
    np.savez(file, **{"t [s]": 0.5 * np.arange(60), "u [V]": np.arange(60.0), "y [cm]": np.arange(60.0)}, w=np.ones(7))
    with pytest.warns(GuessedWarning, match=r"left out: w \(7 samples\)"):
        found = load_file(file)
    assert [channel.label for channel in found.channels] == ["u [V]", "y [cm]"]
