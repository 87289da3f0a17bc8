"""What strangers hand over is read as what it is, or refused with what helps: never as something else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import sysid
from sysid.errors import ChannelError, ConfigError, ReaderError, TraceError, UnitError
from sysid.ingest import inspect_file
from sysid.ingest.inspecting.undescribed import GuessedWarning

N = 120
U, Y = np.arange(N) % 7.0, np.arange(N) % 5.0


@pytest.mark.parametrize(("bad", "unit"), [("ERR", " [V]"), ("ERR", ""), ("off", " [V]")])
def test_a_column_that_was_measured_is_not_lost(tmp_path: Path, bad: str, unit: str) -> None:
    rows = [f"{0.1 * k:.1f},{U[k]},{bad if k == 50 or bad == 'off' else Y[k]}" for k in range(N)]
    (tmp_path / "rig.csv").write_text("\n".join([f"t [s],u [V],y{unit}", *rows]))
    with pytest.raises(ReaderError, match="column y"):
        sysid.load(tmp_path / "rig.csv")


def test_remarks_beside_it_do_no_harm(tmp_path: Path) -> None:
    rows = [f"{0.1 * k:.1f},{U[k]},{'on' if k % 3 else 'off'},{Y[k]}" for k in range(N)]
    (tmp_path / "rig.csv").write_text("\n".join(["t [s],u [V],state,y [V]", *rows]))
    with pytest.warns(GuessedWarning, match=r"left out: state \(the column holds words\); sysid ingest .*--propose"):
        assert sysid.load(tmp_path / "rig.csv").traces[0].channel_names == ("u", "y")


def test_a_column_of_dates_that_cannot_be_read_is_no_reason_to_guess_a_second(tmp_path: Path) -> None:
    rows = [f"W11-2-2024_{k // 60:02d}h{k % 60:02d},{U[k]},{Y[k]}" for k in range(N)]
    (tmp_path / "rig.csv").write_text("\n".join(["when,u [V],y [V]", *rows]))
    with pytest.raises(ReaderError, match="in a form that is not known") as refused:
        sysid.load(tmp_path / "rig.csv")
    assert "format: '%d.%m.%Y %H:%M:%S.%f'}. Options are typed behind sysid ingest" in str(refused.value.remedy)


@pytest.mark.parametrize("row", [list, tuple])
def test_a_list_of_rows_is_no_list_of_experiments(row: type) -> None:
    with pytest.raises(ConfigError, match="120 rows of 2 numbers") as refused:
        sysid.data([row(pair) for pair in zip(U, Y, strict=True)], sample_time=1.0)
    assert "np.array(rows)" in str(refused.value.remedy)


def test_stamps_of_32_bit_are_not_dropped() -> None:
    with pytest.raises(TraceError, match="duplicates") as refused:
        sysid.data({"t": (1e6 + 0.01 * np.arange(N)).astype(np.float32), "u": U, "y": Y})
    assert "0.0625 s" in str(refused.value.remedy)


def test_an_hour_that_comes_twice_is_not_sorted_into_itself() -> None:
    clock = pd.date_range("2024-10-27 01:30", periods=N, freq="90s", tz="Europe/Berlin")
    frame = pd.DataFrame({"u": U, "y": Y}, index=clock.tz_localize(None))
    with pytest.raises(TraceError, match="step back") as refused:
        sysid.data(frame)
    assert "tz_localize" in str(refused.value.remedy)
    assert sysid.data(frame.tz_localize("Europe/Berlin", ambiguous="infer")).sample_time == 90.0
    with pytest.raises(TraceError, match="step back") as refused:
        sysid.data({"t": np.r_[np.arange(N // 2), np.arange(N // 2)], "u": U, "y": Y})
    assert "a new recording starts" in str(refused.value.remedy)


@pytest.mark.parametrize(("name", "said"), [("run.wav", "scipy.io.wavfile"), ("run.bin", "export the traces")])
def test_a_file_of_another_kind_is_no_broken_yaml(tmp_path: Path, name: str, said: str) -> None:
    (tmp_path / name).write_bytes((b"RIFF" if name.endswith("wav") else b"") + bytes(range(256)))
    with pytest.raises(ReaderError, match="no reader knows") as refused:
        sysid.load(tmp_path / name)
    assert said in str(refused.value.remedy)


def test_columns_in_another_unit_are_converted_at_every_door_that_runs_a_model(tmp_path: Path) -> None:
    traces = sysid.data({"u [V]": U, "y [m]": Y}, sample_time=1.0)
    fit = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=1), stability=sysid.StabilityOptions(count=0))
    bundle = sysid.save(fit, traces, tmp_path / "bundle", formats=["c"])
    frame, pair = pd.DataFrame({"u [mV]": 1e3 * U}), ({"u [mV]": 1e3 * U[:9]}, {"y [cm]": 1e2 * Y[:9]})
    for model, options in ((fit, {}), (bundle, {"warn": False})):
        plain = np.ravel(model.simulate(U, **options))
        np.testing.assert_allclose(np.ravel(model.simulate(frame, **options)), plain, rtol=1e-12)
        np.testing.assert_allclose(np.ravel(model.simulate({"u": U}, **options)), plain, rtol=1e-12)
        after = np.ravel(model.simulate(frame[9:], initial=pair, **options))
        np.testing.assert_allclose(after, np.ravel(model.simulate(U[9:], initial=(U[:9], Y[:9]), **options)), rtol=1e-9)
    measured = pd.DataFrame({"u [mV]": 1e3 * U, "y [m]": Y})
    ahead = fit.predict(pd.DataFrame({"y [cm]": 1e2 * Y}), measured)
    np.testing.assert_allclose(ahead, fit.predict(Y, U), rtol=1e-12)
    begun = bundle.simulate(measured, start="first-sample", warn=False)
    there = bundle.simulate(pd.DataFrame({"u": U, "y": Y}), start="first-sample", warn=False)
    np.testing.assert_allclose(begun, there, rtol=1e-12)
    with pytest.raises(UnitError):
        fit.simulate({"u [kg]": U})


def test_commas_in_a_mapping_are_told() -> None:
    with pytest.raises(ChannelError, match=r"write u\+y"):
        sysid.fit(sysid.data({"u": U, "y": Y}, sample_time=1.0), "u, y -> y", sysid.ARX(na=1, nb=1, nk=1))


@pytest.mark.parametrize("words", [("ON", "OFF"), ("open", "Closed"), ("true", "False"), ("one", "two")])
def test_the_numbers_that_are_proposed_for_words_are_no_way_round(tmp_path: Path, words: tuple[str, str]) -> None:
    rows = [f"{0.1 * k:.1f},{words[k % 7 > 2]},{Y[k]}" for k in range(N)]
    (tmp_path / "rig.csv").write_text("\n".join(["t [s],u [V],y [V]", *rows]))
    if words == ("true", "False"):  # numbers already
        assert set(sysid.load(tmp_path / "rig.csv").traces[0]["u"]) == {0.0, 1.0}
        return
    with pytest.raises(ReaderError, match="holds words") as refused:
        sysid.load(tmp_path / "rig.csv")
    zero = "one" if "one" in words else words[1]
    assert f"'{zero}': 0" in str(refused.value.remedy) or f"{zero}: 0" in str(refused.value.remedy)


@pytest.mark.parametrize(
    ("header", "rows", "step"),
    [
        ("u [V],t [degC]", lambda k, y: f"{U[k]},{y}", None),  # a temperature, and no stamps
        ("stamp [s],u,t", lambda k, y: f"{0.5 * k},{U[k]},{y}", 0.5),  # by name t would be time
        ("T [s],u,time", lambda k, y: f"{0.5 * k},{U[k]},{y}", 0.5),
    ],
)
def test_a_signal_that_is_called_as_time_is_not_the_clock(
    tmp_path: Path, header: str, rows: object, step: object
) -> None:
    level = np.random.default_rng(0).uniform(18.0, 22.0, N)
    lines = [rows(k, f"{level[k]:.6f}") for k in range(N)]  # type: ignore[operator]
    (tmp_path / "rig.csv").write_text("\n".join([header, *lines]))
    with pytest.warns(GuessedWarning):
        trace = sysid.load(tmp_path / "rig.csv").traces[0]
    assert trace.sample_time == (step or 1.0)
    assert np.allclose(trace[trace.channel_names[-1]], level, atol=1e-6)


def test_what_is_the_matter_with_several_columns_is_told_once(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("t [s],a,b,c,d\n" + "".join(f"{k / 10},1,2,{k},\n" for k in range(30)))
    problems = inspect_file(path).problems
    assert "a, b: never changes" in problems
    assert sum("never changes" in one for one in problems) == 1


@pytest.mark.parametrize("mark", ["#", "!", "%", "//", ";"])
def test_a_head_among_comments_is_the_one_that_names_a_time(tmp_path: Path, mark: str) -> None:
    said = [f"{mark} of the rig", f"{mark} t u y", f"{mark} recorded by me"]
    rows = [f"{0.1 * k:.1f} {U[k]} {Y[k]}" for k in range(N)]
    (tmp_path / "rig.txt").write_text("\n".join([*said, *rows]))
    with pytest.warns(GuessedWarning, match="t in s"):
        assert sysid.load(tmp_path / "rig.txt").traces[0].channel_names == ("u", "y")


@pytest.mark.parametrize("name", ["rig.out", "rig.log", "rig.1", "rig"])
def test_a_table_of_text_is_read_whatever_its_name_ends_in(tmp_path: Path, name: str) -> None:
    rows = [f"{0.1 * k:.1f}\t{U[k]}\t{Y[k]}" for k in range(N)]
    (tmp_path / name).write_text("\n".join(["Time\tGenTq\tGenSpeed", "(s)\t(kN-m)\t(rpm)", *rows]))
    traces = sysid.load(tmp_path / name)
    assert [channel.unit for channel in traces.channels] == ["kN*m", "rpm"]
    np.testing.assert_array_equal(traces.traces[0]["GenTq"], U)


def test_a_file_of_time_alone_is_refused_in_words(tmp_path: Path) -> None:
    (tmp_path / "rig.csv").write_text("\n".join(["time [s]", *(f"{0.1 * k:.1f}" for k in range(N))]))
    with pytest.raises(TraceError, match=r"the file has no channel"):
        sysid.load(tmp_path / "rig.csv")
