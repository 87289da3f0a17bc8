"""Clocks and tables of other tools: rounded stamps, signals stamped one by one, zones by name."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import sysid
from sysid.errors import ReaderError, TraceError
from sysid.ingest import inspect_file, load_dataset, propose_dataset
from sysid.ingest.assembling.timing import rounded_step, survey
from sysid.ingest.tables.time_columns import is_called_time
from sysid.traces import Trace

N = 60
U = np.repeat([1.0, 3.0, 1.0, 3.0, 3.0, 1.0], 10)
Y = np.round(np.convolve(U, 0.2 * 0.8 ** np.arange(N))[:N], 6)


def proposed(tmp_path: Path, text: str | bytes, name: str = "a.csv") -> Trace:
    """The one record of a file, by the data set that is proposed for it."""
    (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    (tmp_path / "dataset.yaml").write_text(propose_dataset(inspect_file(tmp_path / name)), encoding="utf-8")
    (trace,) = load_dataset(tmp_path / "dataset.yaml").traces
    return trace


def rows(stamps: list[str], head: str = "t [s],u [V],y [V]") -> str:
    return "\n".join([head, *(f"{t},{u},{y}" for t, u, y in zip(stamps, U, Y, strict=True))]) + "\n"


@pytest.mark.parametrize(("rate", "digits"), [(30.0, 2), (120.0, 3), (24.0, 2)])
def test_rounded_stamps_are_put_on_an_even_clock_and_no_value_is_changed(
    tmp_path: Path, rate: float, digits: int
) -> None:
    trace = proposed(tmp_path, rows([f"{k / rate:.{digits}f}" for k in range(N)]))
    assert trace.sample_time == pytest.approx(1.0 / rate, rel=1e-12)
    np.testing.assert_array_equal(trace["y"], Y)


def test_rounded_stamps_with_a_sample_left_out() -> None:
    stamps = np.round(np.delete(np.arange(80), 33) / 30.0, 2)
    found = rounded_step(stamps, survey(stamps))
    assert found is not None
    assert found[0] == pytest.approx(1 / 30.0)


def test_a_clock_that_is_uneven_is_not_called_rounded() -> None:
    stamps = np.arange(80) * 0.1 + np.random.default_rng(0).uniform(0, 0.02, 80)
    assert rounded_step(stamps, survey(stamps)) is None


def test_signals_that_are_stamped_one_by_one_are_joined(tmp_path: Path) -> None:
    lines = ["time [s],signal,value"]
    for k in range(N):
        if k == 0 or U[k] != U[k - 1]:
            lines.append(f"{max(k / 10 - 0.001, 0):.3f},u,{U[k]}")
        lines.append(f"{k / 10:.3f},y,{Y[k]}")
    trace = proposed(tmp_path, "\n".join(lines) + "\n")
    assert trace.sample_time == pytest.approx(0.1)
    np.testing.assert_array_equal(trace["u"], U)
    np.testing.assert_array_equal(trace["y"], Y)


def test_utf_16_without_its_mark(tmp_path: Path) -> None:
    for encoding in ("utf-16-le", "utf-16-be"):
        trace = proposed(tmp_path, rows([f"{k / 10:.1f}" for k in range(N)]).encode(encoding))
        np.testing.assert_array_equal(trace["y"], Y)


def test_names_in_another_encoding_are_told(tmp_path: Path) -> None:
    text = rows([f"{k / 10:.1f}" for k in range(N)], "Χρόνος (s),Πίεση,Θερμοκρασία")
    (tmp_path / "a.csv").write_bytes(text.encode("cp1253"))
    assert any("name the encoding" in one for one in inspect_file(tmp_path / "a.csv").problems)
    assert not any("encoding" in one for one in inspect_file(write(tmp_path, text)).problems)


@pytest.mark.parametrize(
    ("encoding", "head"),
    [
        ("cp1251", "Время; с|Давление; МПа|Расход; м3/ч"),
        ("gb18030", "时间(s)|压力(MPa)|流量(m3/h)"),
        ("cp932", "時間(s)|圧力(MPa)|流量(m3/h)"),
    ],
)
def test_names_that_are_words_in_another_encoding_are_read_in_it(tmp_path: Path, encoding: str, head: str) -> None:
    """The comma before a unit is quoted, as it stands between cells too."""
    names = ",".join(f'"{cell}"' for cell in head.replace(";", ",").split("|"))
    text = rows([f"{k / 10:.1f}" for k in range(N)], names)
    trace = proposed(tmp_path, text.encode(encoding))
    assert [c.unit for c in trace.channels] == ["MPa", "m^3/h" if encoding != "cp1251" else "m^3/hour"]
    assert [c.name[0] for c in trace.channels] == [head.split("|")[k][0] for k in (1, 2)]
    assert any(encoding in one for one in inspect_file(tmp_path / "a.csv").problems)


@pytest.mark.parametrize(
    ("form", "step"),
    [
        ("%Y-%j %H:%M:%S", 1800.0),
        ("%Y:%j:%H:%M:%S", 1800.0),
        ("%Y年%m月%d日 %H:%M:%S", 1800.0),
        ("%Y年%m月%d日%H时%M分", 1800.0),
        ("%d-%b-%y %I.%M.%S.000000 %p", 1800.0),
    ],
)
def test_dates_of_databases_and_of_asia(tmp_path: Path, form: str, step: float) -> None:
    began = datetime.datetime(2024, 3, 12, 8, 15)
    stamps = [(began + datetime.timedelta(seconds=step * k)).strftime(form) for k in range(N)]
    trace = proposed(tmp_path, rows(stamps, "stamp,u [V],y [V]"))
    assert trace.sample_time == step
    np.testing.assert_array_equal(trace["y"], Y)


@pytest.mark.parametrize(
    ("head", "stamp", "step"),
    [
        ("mm:ss", lambda k: f"{k // 2:02d}:{k % 2 * 30:02d}", 30.0),
        ("elapsed (min:s)", lambda k: f"{2 * k}:00.5", 120.0),
        ("span", lambda k: f"{k // 4}.{k % 4 * 6:02d}:00:00.0000000", 21_600.0),
        ("timestamp", lambda k: f"{133_546_995_000_000_000 + 1_000_000 * k}", 0.1),
        ("ticks", lambda k: f"{638_458_281_000_000_000 + 1_000_000 * k}", 0.1),
        ("JD", lambda k: f"{2_460_381.5 + k / 1440:.9f}", 60.0),
        ("t", lambda k: f"{52_341_232 + 1000 * k + 4 * (k * k % 7)}", 0.001),
    ],
)
def test_clocks_that_say_by_name_or_size_what_they_count(
    tmp_path: Path, head: str, stamp: Callable[[int], str], step: float
) -> None:
    found = inspect_file(write(tmp_path, rows([stamp(k) for k in range(N)], f"{head},u [V],y [V]")))
    assert found.sample_time == pytest.approx(step, rel=2e-3)
    assert [column.name for column in found.channels] == ["u", "y"]


def test_a_refusal_says_how_the_clock_was_guessed(tmp_path: Path) -> None:
    stamps = [f"{1003 * k + 40_000 * (k > 30)}" for k in range(N)]
    with pytest.raises(TraceError, match=r"missing in 1 gap(.|\n)*t in ms.*if it is us, say so"):
        sysid.load(write(tmp_path, rows(stamps, "t,u [V],y [V]")))


def test_stamps_in_a_form_that_is_not_known_ask_for_their_pattern(tmp_path: Path) -> None:
    text = rows([f"2024-W11-2 08:15:{k / 10:06.3f}" for k in range(N)], "Time,u [V],y [V]")
    with pytest.raises(ReaderError, match=r"(?s)form that is not known.*format: "):
        inspect_file(write(tmp_path, text))


def test_one_sample_is_not_proposed(tmp_path: Path) -> None:
    with pytest.raises(ReaderError, match="one sample is no record"):
        propose_dataset(inspect_file(write(tmp_path, "t [s],u [V]\n0,1\n")))


@pytest.mark.parametrize(
    ("cell", "told"), [("[-11059] No Good Data", "missing"), ("<0.1", "'<0.1'"), ("1.5*", "'1.5*'")]
)
def test_what_stands_among_numbers_is_quoted(tmp_path: Path, cell: str, told: str) -> None:
    text = "t [s],u [V],y [V]\n" + "".join(f"{k / 10},{U[k]},{cell if k in {7, 8} else Y[k]}\n" for k in range(N))
    found = inspect_file(write(tmp_path, text))
    assert any(told in one for one in found.problems if "y" in one)
    (y,) = (one for one in found.columns if one.name == "y")
    assert y.missing == 2 or cell in y.problem


def test_words_that_may_be_states_are_quoted(tmp_path: Path) -> None:
    text = "t [s],mode,y [V]\n" + "".join(f"{k / 10},{('Off', 'Heat', 'Cool')[k // 7 % 3]},{Y[k]}\n" for k in range(N))
    (mode,) = (one for one in inspect_file(write(tmp_path, text)).columns if one.name == "mode")
    assert "'Off', 'Heat', 'Cool'" in mode.problem
    assert "states" in mode.problem


def write(tmp_path: Path, text: str) -> Path:
    """A file of text in UTF-8."""
    path = tmp_path / "b.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_u_and_y_once_with_each_letter_are_two_records(tmp_path: Path) -> None:
    from scipy.io import savemat

    savemat(tmp_path / "a.mat", {"ue": U[:30], "ye": Y[:30], "uv": U[30:], "yv": Y[30:], "Ts": 0.1})
    found = {case.name: case.role for case in inspect_file(tmp_path / "a.mat").cases}
    assert found == {"estimation": "estimation", "validation": "validation"}


def test_varnames_beside_a_matrix_name_its_columns(tmp_path: Path) -> None:
    from scipy.io import savemat

    names = np.array(["time", "pump", "level"], dtype=object)
    savemat(tmp_path / "a.mat", {"data": np.column_stack([np.arange(N) / 10, U, Y]), "varnames": names})
    assert [column.name for column in inspect_file(tmp_path / "a.mat").channels] == ["pump", "level"]


@pytest.mark.parametrize(
    ("step", "unit"), [(1800.0, "s"), (60.0, "s"), (20.0, "ms"), (1000.0, "ms"), (0.5, "s"), (10_000.0, "us")]
)
def test_a_clock_without_a_unit_that_goes_by_whole_minutes_is_in_seconds(
    tmp_path: Path, step: float, unit: str
) -> None:
    found = inspect_file(write(tmp_path, rows([f"{k * step}" for k in range(N)], "Time,u [V],y [V]")))
    assert found.time.unit == unit
    assert ("say so" in found.time_told) == (step >= 5)


def test_an_even_clock_of_a_workspace_is_in_seconds_and_a_loggers_is_not(tmp_path: Path) -> None:
    from scipy.io import savemat

    logged = 20 * np.arange(N) + np.random.default_rng(0).integers(0, 3, N)
    for stamps, unit in ((5 * np.arange(N), "s"), (logged, "ms")):
        savemat(tmp_path / "a.mat", {"t": stamps, "u": U, "y": Y})
        assert inspect_file(tmp_path / "a.mat").time.unit == unit


def test_a_clock_beside_an_index_without_a_name_is_found(tmp_path: Path) -> None:
    text = "\n".join([",Unnamed: 0.1,time_exp,u,y", *(f"{k},{k},{k / 200},{U[k]},{Y[k]}" for k in range(N))])
    found = inspect_file(write(tmp_path, text + "\n"))
    assert found.time.column == "time_exp"
    assert found.sample_time == pytest.approx(0.005)
    assert [column.name for column in found.channels] == ["u", "y"]


def test_stamps_since_1970_are_time_however_uneven_and_further_ones_are_no_channels(tmp_path: Path) -> None:
    steps = np.random.default_rng(0).choice([90, 200, 1000, 5000], N)
    stamps = 1_394_206_372_724 + np.cumsum(steps)
    lines = [f"{k} {U[k]} {stamps[k]} {stamps[k] + 37 + k % 5} {Y[k]}" for k in range(N)]
    found = inspect_file(write(tmp_path, "\n".join(lines) + "\n"))
    assert (found.time.column, found.time.unit) == ("column_3", "ms")
    assert [column.name for column in found.channels] == ["column_2", "column_5"]


@pytest.mark.parametrize(
    ("name", "scale"), [("test_time_second", 1.0), ("test_time_millisecond", 1e-3), ("Elapsed_Time_minutes", 60.0)]
)
def test_a_time_whose_unit_is_written_out_is_known(tmp_path: Path, name: str, scale: float) -> None:
    """As battery cyclers' files have it; steps of 10 s were taken for milliseconds, and uneven ones for no time."""
    stamps = np.cumsum(np.random.default_rng(0).choice([10.0, 10.0, 10.5], N))
    head = f"{name},voltage_volt,cell_temperature_celsius"
    found = inspect_file(write(tmp_path, rows([f"{t}" for t in stamps], head)))
    assert (found.time.column, found.time_told) == (name, "")
    assert [column.unit for column in found.columns] == ["V", "degC"]
    assert found.sample_time == pytest.approx(10.0 * scale, rel=0.05)


def test_times_that_are_signals_are_no_clock() -> None:
    for name in ("step_time", "dead_time_s", "cycle time", "Sample Time", "on_time_seconds"):
        assert not is_called_time(name)


def test_a_solvers_steps_are_no_gaps(tmp_path: Path) -> None:
    steps = 0.001 * np.exp(np.cumsum(np.random.default_rng(4).normal(0.0, 0.3, 399)) * 0.3)
    stamps = np.concatenate([[0.0], np.cumsum(np.clip(steps, 4e-4, 4e-3))])
    text = "time [s],y\n" + "".join(f"{t:.8f},{np.sin(3.0 * t):.8f}\n" for t in stamps)
    trace = proposed(tmp_path, text)
    assert trace.usable_samples.all()
    assert trace.sample_time == pytest.approx(stamps[-1] / 399, rel=0.2)
    np.testing.assert_allclose(trace["y"], np.sin(3.0 * trace.time), atol=3e-5)
    # Samples that were lost by chance, of an even clock, stay gaps.
    kept = np.flatnonzero(np.random.default_rng(5).random(400) < 0.7)
    trace = proposed(tmp_path, "time [s],y\n" + "".join(f"{0.01 * k:.2f},{k % 5}\n" for k in kept))
    assert trace.sample_time == 0.01 and not trace.usable_samples.all()
