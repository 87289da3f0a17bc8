"""Forms of files that strangers' instruments and logbooks write: read value by value, with what was guessed told."""

from __future__ import annotations

import datetime
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

import sysid
from sysid.ingest.inspecting.undescribed import GuessedWarning
from sysid.traces import Trace

N = 60
U = np.repeat(np.random.default_rng(1).integers(1, 9, N // 5), 5) / 2.0
Y = np.round(np.convolve(U - 2.5, 0.3 * 0.9 ** np.arange(N))[:N], 3)
BEGAN = datetime.datetime(2024, 3, 12, 8, 15)
STAMPS = [BEGAN + datetime.timedelta(seconds=60 * k) for k in range(N)]


def lines(cells: Callable[[int], str], *head: str) -> str:
    return "\n".join([*head, *map(cells, range(N)), ""])


def loaded(tmp_path: Path, text: str, name: str = "rig.csv", match: str = "") -> Trace:
    (tmp_path / name).write_text(text, encoding="utf-8")
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", GuessedWarning)
        (trace,) = sysid.load(tmp_path / name).traces
    assert match in " ".join(str(one.message) for one in told)
    return trace


def check(trace: Trace, *, step: float, values: Sequence[tuple[str, np.ndarray]] = (("u", U), ("y", Y))) -> None:
    assert trace.sample_time == pytest.approx(step, rel=1e-9)
    for name, expected in values:
        np.testing.assert_allclose(trace[name], expected, atol=1e-9)


@pytest.mark.parametrize(
    "form",
    [
        "%Y-%m-%d-%H-%M-%S",
        "%Y-%m-%d_%H-%M-%S",
        "%Y%m%d-%H%M%S",
        "%Y-%m-%d--%H-%M-%S-34",
        "%d.%m.%Y %H.%M.%S",
        "%d.%m.%Y %H.%M",
        "%I.%M%p",
    ],
)
def test_times_have_other_marks_than_colons_too(tmp_path: Path, form: str) -> None:
    text = lines(lambda k: f"{STAMPS[k].strftime(form)},{U[k]},{Y[k]}", "time,u [V],y [V]")
    check(loaded(tmp_path, text), step=60.0)


def test_a_mark_of_the_byte_order_before_every_line_is_none_of_its_cells(tmp_path: Path) -> None:
    text = lines(lambda k: f'\ufeff"{STAMPS[k]}",{U[k]},{Y[k]}', '\ufeff"Time","u [V]","y [V]"')
    check(loaded(tmp_path, text), step=60.0)


@pytest.mark.parametrize(("separator", "decimal"), [(",", "."), (";", ",")])
def test_a_number_in_brackets_is_negative_and_told(tmp_path: Path, separator: str, decimal: str) -> None:
    def cells(k: int) -> str:
        y = f"({-Y[k]:.3f})" if Y[k] < 0.0 else f"{Y[k]:.3f}"
        return f"{0.1 * k:.1f};{U[k]};{y}".replace(".", decimal).replace(";", separator)

    check(loaded(tmp_path, lines(cells, f"t [s]{separator}u [V]{separator}y [V]")), step=0.1)
    assert any("negative number in brackets" in note for note in sysid.ingest.inspect_file(tmp_path / "rig.csv").notes)


def test_units_in_brackets_below_the_names_are_no_row_of_numbers(tmp_path: Path) -> None:
    text = lines(lambda k: f"{0.1 * k:.1f},{U[k]},{Y[k]}", "t,u,y", "(s),(1),(1)")
    check(loaded(tmp_path, text), step=0.1)


def test_a_clock_of_few_digits_needs_no_name(tmp_path: Path) -> None:
    u, y = np.resize(U, 900), np.resize(Y, 900)
    rows = [f"{0.135 * k:.2E}\t{u[k]:.3E}\t{y[k]:.3E}" for k in range(900)]
    trace = loaded(tmp_path, "\n".join(["Towing tank", "zig-zag", "", *rows]), "tank.dat", "written in 3 digits")
    check(trace, step=0.135, values=(("column_2", u),))


def test_a_head_that_counts_its_columns_is_no_sample(tmp_path: Path) -> None:
    rows = np.random.default_rng(2).integers(10, 40, (N, 7))
    text = "\n".join([",".join(map(str, range(1, 8))), *(",".join(map(str, row)) for row in rows)])
    trace = loaded(tmp_path, text)
    assert len(trace) == N
    np.testing.assert_array_equal(trace["3"], rows[:, 2])


def test_a_clock_that_was_rounded_to_seconds_is_loaded_as_it_is_proposed(tmp_path: Path) -> None:
    stamps = [(BEGAN + datetime.timedelta(seconds=int(71.03 * k + 0.9))).strftime("%H:%M:%S") for k in range(40)]
    trace = loaded(tmp_path, "\n".join(["Time,flow [ml/min]", *(f"{s},{Y[k]}" for k, s in enumerate(stamps))]))
    assert trace.sample_time == pytest.approx(71.03, rel=2e-3)
    np.testing.assert_array_equal(trace["flow"], Y[:40])


def test_a_ramp_with_a_unit_is_no_second_clock(tmp_path: Path) -> None:
    ramp = 20.0 + 0.25 * np.arange(N)
    text = lines(lambda k: f"{0.5 * k},{U[k]},{ramp[k]}", "t [s],u [V],T [degC]")
    check(loaded(tmp_path, text), step=0.5, values=(("u", U), ("T", ramp)))


def test_a_table_of_a_historian_lies_on_its_side_behind_names_and_units(tmp_path: Path) -> None:
    def line(*cells: object) -> str:
        return ",".join(map(str, cells))

    text = "\n".join([line("Tag", "Unit", *STAMPS), line("PUMP", "V", *U), line("LEVEL", "cm", *Y), ""])
    trace = loaded(tmp_path, text)
    check(trace, step=60.0, values=(("PUMP", U), ("LEVEL", Y)))
    assert trace.channel("LEVEL").unit == "cm"


def test_a_mark_of_a_section_stands_between_names_and_numbers(tmp_path: Path) -> None:
    stamps = [f"0815{0.1 * k:05.2f}" for k in range(N)]
    head = ["[header]", "satellites", "time", "", "[column names]", "sats time velocity throttle", "", "[data]"]
    trace = loaded(tmp_path, lines(lambda k: f"{7 + k % 2:03d} {stamps[k]} {Y[k]} {U[k]}", *head), "run.vbo")
    check(trace, step=0.1, values=(("velocity", Y), ("throttle", U)))


def test_rows_with_an_empty_cell_between_tabs_are_not_lost(tmp_path: Path) -> None:
    def cells(k: int) -> str:
        return f"{k // 30:02d}:{2 * k % 60:02d}\t{k if k > 9 else ''}\t{U[k]}\t{Y[k]}\t{'Charge' if k == 9 else ''}"

    text = lines(cells, "Date:27.01.2024\tUnit:C\tCHARGE:00:30\t\t\t\t", "Time1\tTime2\tET\tBT\tEvent")
    assert len(sysid.ingest.inspect_file(_written(tmp_path, text)).table or ()) == N


def _written(tmp_path: Path, text: str) -> Path:
    (tmp_path / "roast.csv").write_text(text)
    return tmp_path / "roast.csv"


def test_times_that_may_be_of_a_stopwatch_are_told(tmp_path: Path) -> None:
    text = lines(lambda k: f"{k // 30:02d}:{2 * k % 60:02d},{U[k]},{Y[k]}", "Time,u [V],y [V]")
    loaded(tmp_path, text, match="taken for hours and minutes, which is a guess")


def test_words_and_numbers_of_the_record_behind_two_columns(tmp_path: Path) -> None:
    head = ["X,CH1,CH2,Start,Increment,", "Sequence,Volt,Volt,-6.0e-03,1.0e-06"]
    trace = loaded(tmp_path, lines(lambda k: f"{k},{U[k]:.5e},{Y[k]:.5e},,", *head))
    check(trace, step=1e-6, values=(("CH1", U), ("CH2", Y)))


def test_a_column_of_marks_alone_takes_no_record_with_it(tmp_path: Path) -> None:
    head = ["EXPLAIN", "CURVE\tTABLE\t60", "\tPt\tT\tIm\tVf\tOver", "\t#\ts\tA\tV\tbits"]
    text = lines(lambda k: f"\t{k}\t{0.1 * k:g}\t{U[k]}\t{Y[k]}\t...........", *head)
    check(loaded(tmp_path, text, "gamry.DTA"), step=0.1, values=(("Im", U), ("Vf", Y)))


def test_a_table_by_any_name_may_have_a_long_head(tmp_path: Path) -> None:
    settings = [f"setting {k:03d}          {'x' * 60}" for k in range(90)]
    text = lines(lambda k: f"{0.1 * k:.1f}\t{U[k]}\t{Y[k]}", *settings, "time/s\tu/V\ty/V")
    check(loaded(tmp_path, text, "cycler.mpt"), step=0.1)


def test_several_numbers_in_a_cell_are_no_dates(tmp_path: Path) -> None:
    text = lines(lambda k: f"{0.1 * k:.1f},{U[k]},0.00 {Y[k]:.2f} 4.20,{Y[k]}", "tick,u [V],sense,y [V]")
    check(loaded(tmp_path, text, match="left out: sense"), step=0.1)
