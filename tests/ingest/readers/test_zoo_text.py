"""The zoo of text files: one known record as people's tools write it, each read right with nothing but its proposal."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from sysid.ingest import inspect_file, load_dataset
from sysid.workbench.cli import run_cli

N = 20
T = [0.1 * k for k in range(N)]
U = [1.0 if k // 5 % 2 == 0 else 3.0 for k in range(N)]
Y = [0.0]
for _u in U[:-1]:
    Y.append(0.8 * Y[-1] + 0.2 * _u)

Line = Callable[[int], str]


def table(line: Line, *above: str, below: tuple[str, ...] = (), count: int = N) -> str:
    """Lines above, a line a sample, lines below."""
    return "\n".join([*above, *(line(k) for k in range(count)), *below]) + "\n"


def plain(k: int, mark: str = ",", decimal: str = ".") -> str:
    """A sample with a mark between its cells."""
    return mark.join(f"{x:.6f}".replace(".", decimal) for x in (T[k], U[k], Y[k]))


def clock(k: int, start: float = 0.0) -> str:
    """A time of day, 0.1 s apart, from so many seconds after midnight."""
    tenths = round(10 * start) + k
    hours, rest = divmod(tenths, 36000)
    return f"{hours % 24:02d}:{rest // 600:02d}:{rest % 600 / 10:04.1f}"


def autumn(k: int) -> str:
    """The clock on the wall in Berlin on the night on which an hour comes twice, every 600 s from 02:30."""
    minutes = 150 + 10 * k - (60 if k >= 3 else 0)
    return f"2024-10-27 {minutes // 60:02d}:{minutes % 60:02d}:00"


def leap_day(k: int) -> str:
    """Month, day, hour and minute, every 10 minutes from 23:00 on the 29th of February."""
    minutes = 1380 + 10 * k
    return f"{'02 29' if minutes < 1440 else '03 01'} {minutes // 60 % 24:02d} {minutes % 60:02d}"


def historian(k: int) -> str:
    """A row of each signal, one of them bad, where a zero stands."""
    good, y = ("Bad", 0.0) if k == 7 else ("Good", Y[k])
    return f"u;{T[k]:.1f};{U[k]};Good\ny;{T[k]:.1f};{y:.6f};{good}"


def wincc(k: int) -> str:
    """A row of each signal of a German panel, which counts millionths of days in a column that it calls ms."""
    count = f"{45363343750 + k * 11.574074:.6f}"
    rows = (f'"{name}";"12.03.2024 08:15:{k:02d}";{x:.6f};1;{count}' for name, x in (("u", U[k]), ("y", Y[k])))
    return "\n".join(re.sub(r"(?<=\d)\.(?=\d{6})", ",", row) for row in rows)


@dataclass(frozen=True, kw_only=True)
class Animal:
    """A file and what must come out of it.

    Args:
        text: The file.
        u: Name of the channel that is u.
        y: Name of the channel that is y, or the empty text.
        step: Seconds between samples.
        unit: Unit of u.
        suffix: Ending of the file's name.
        encoding: How it is written.
        told: What the proposal must say.
    """

    text: str
    u: str = "u"
    y: str = "y"
    step: float = 0.1
    unit: str = "V"
    suffix: str = ".csv"
    encoding: str = "utf-8"
    told: tuple[str, ...] = field(default=())


HEAD = "t [s],u [V],y [V]"
BESIDE = ("Record Length,20", "Trigger Point,3", ",", "Source,u", "Vertical Units,V", "Horizontal Units,s")
ZOO = {
    "digits of dates": Animal(
        text=table(lambda k: f"202403122359{40 + k},{U[k]},{Y[k]}", "stamp,u [V],y [V]"), step=1.0, told=("%Y%m%d",)
    ),
    "comma": Animal(text=table(plain, HEAD)),
    "semicolon, decimal comma, Windows": Animal(
        text=table(lambda k: plain(k, ";", ","), "t [s];u [V];y [°C]").replace("\n", "\r\n"), encoding="cp1252"
    ),
    "tabs, UTF-16": Animal(text=table(lambda k: plain(k, "\t"), HEAD.replace(",", "\t")), encoding="utf-16"),
    "bars": Animal(text=table(lambda k: plain(k, "|"), HEAD.replace(",", "|"))),
    "numpy.savetxt": Animal(text=table(lambda k: plain(k, " ")), u="column_2", y="column_3", unit="1", suffix=".txt"),
    "numpy.savetxt with a header": Animal(text=table(lambda k: plain(k, " "), "# t u y"), unit="1", suffix=".txt"),
    "MATLAB save -ascii": Animal(
        text=table(lambda k: "".join(f"   {x:.7e}" for x in (T[k], U[k], Y[k]))),
        u="column_2", y="column_3", unit="1", suffix=".dat",
    ),
    "Fortran, D exponents, a count above": Animal(
        text=table(lambda k: "".join(f"{x:16.8E}".replace("E", "D") for x in (T[k], U[k], Y[k])), "  20   3"),
        u="column_2", y="column_3", unit="1", suffix=".dat",
    ),
    "blanks, header with units": Animal(
        text=table(lambda k: plain(k, "   "), "  t [s]   u [V]   y [V]", ""), suffix=".txt"
    ),
    "blanks, % header": Animal(text=table(lambda k: plain(k, " "), "% t u y"), unit="1", suffix=".asc"),
    "title lines": Animal(
        text=table(
            lambda k: plain(k, ";", ","), "Test rig 4", "Operator;A", "Start;12.03.2024 08:15", "", "t [s];u [V];y [V]"
        )
    ),
    "title lines, no header": Animal(
        text=table(lambda k: plain(k, "\t"), "Towing tank, free model", "Zig-zag 10 / -10", ""),
        u="column_2", y="column_3", unit="1", suffix=".dat",
    ),
    "Excel's sep=": Animal(text=table(lambda k: plain(k, ";"), "sep=;", HEAD.replace(",", ";"))),
    "units row": Animal(text=table(plain, "t,u,y", "s,V,V")),
    "units row with a unit that nobody knows": Animal(
        text=table(plain, "Rig 7", "t,u,y", "s,Amps,Nm3/h"), unit="A", told=("the file says Nm3/h",)
    ),
    "units in words": Animal(text=table(plain, "Time (Sec),u (Volts),y (m3/h)")),
    "names, types below": Animal(text=table(plain, HEAD, "REAL,REAL,REAL")),
    "numbers in the header": Animal(text=table(plain, "t,25,50"), u="25", y="50", unit="1"),
    "columns without values": Animal(
        text=table(lambda k: f"{U[k]},{T[k]:.1f},{Y[k]:.6f},,,", "u [V],time,y [V],,dT,0.1"), told=("no values at all",)
    ),
    "separators at the ends of lines": Animal(text=table(lambda k: plain(k) + ",", HEAD)),
    "quotes about everything": Animal(
        text=table(lambda k: '"' + plain(k, '","') + '"', '"t [s]","u [V]","y [V]"')
    ),
    "footer": Animal(text=table(plain, HEAD, below=("", "Max,3.0,2.35", "End of file"))),
    "blank lines and comments": Animal(
        text=table(lambda k: plain(k) + "\n" * (k == 4) + "\n# mark" * (k == 9), "# by: me", HEAD)
    ),
    "long table": Animal(
        text=table(lambda k: f"{T[k]:.1f},u,{U[k]}\n{T[k]:.1f},y,{Y[k]:.6f}", "time [s],signal,value"), unit="1"
    ),
    "long table, a block a signal, with units": Animal(
        text="time [s];name;unit;value\n"
        + "".join(f"{T[k]:.1f};u;V;{U[k]}\n" for k in range(N))
        + "".join(f"{T[k]:.1f};y;A;{Y[k]:.6f}\n" for k in range(N))
    ),
    "states": Animal(
        text=table(lambda k: f"{T[k]:.1f},{'ON' if U[k] == 3.0 else 'OFF'},{Y[k]:.6f}", "t [s],u,y [V]"),
        unit="1", told=("states",),
    ),
    "truth": Animal(
        text=table(lambda k: f"{T[k]:.1f},{str(U[k] == 3.0).upper()},{Y[k]:.6f}", "t [s],u,y [V]"), unit="1"
    ),
    "held until changed": Animal(
        text=table(lambda k: f"{T[k]:.1f},{U[k] if k % 5 == 0 else ''},{Y[k]:.6f}", HEAD), told=("hold",)
    ),
    "a mark for missing values": Animal(
        text=table(lambda k: f"{T[k]:.1f},{U[k]},{'---' if k == 7 else f'{Y[k]:.6f}'}", HEAD), y="", told=("missing",)
    ),
    "an instrument's word for no value": Animal(
        text=table(lambda k: f"{T[k]:.1f},{U[k]},{'Overload' if k == 7 else f'{Y[k]:.6f}'}", HEAD),
        y="", told=("missing", "Overload"),
    ),
    "ISO time": Animal(text=table(lambda k: f"2024-05-01T{clock(k)},{U[k]},{Y[k]:.6f}", "Time,u [V],y [V]")),
    "German date and time": Animal(
        text=table(lambda k: f"12.03.2024 {clock(k)};{U[k]};{Y[k]:.6f}".replace(".", ",", 0), "Zeit;u [V];y [V]")
    ),
    "American date, AM and PM": Animal(
        text=table(
            lambda k: f"3/12/2024 {'11:59:59' if k < 10 else '12:00:00'}.{k % 10} {'AP'[k // 10]}M,{U[k]},{Y[k]}",
            "Timestamp,u [V],y [V]",
        )
    ),
    "date and time in two columns": Animal(
        text=table(lambda k: f"2024-05-01,{clock(k)},{U[k]},{Y[k]:.6f}", "Date,Time,u [V],y [V]")
    ),
    "time of day past midnight": Animal(
        text=table(lambda k: f"{clock(k, 86399.0)},{U[k]},{Y[k]:.6f}", "Time,u [V],y [V]")
    ),
    "local time in autumn": Animal(
        text=table(lambda k: f"{autumn(k)},{U[k]},{Y[k]:.6f}", "time,u [V],y [V]"), step=600.0, told=("Europe/Berlin",)
    ),
    "epoch in s": Animal(
        text=table(lambda k: f"{1710231300 + T[k]:.1f},{U[k]},{Y[k]:.6f}", "timestamp,u [V],y [V]"),
        told=("s since 1970",),
    ),
    "epoch in ms": Animal(
        text=table(lambda k: f"{1710231300000 + 100 * k},{U[k]},{Y[k]:.6f}", "time,u [V],y [V]"),
        told=("ms since 1970",),
    ),
    "epoch in us": Animal(
        text=table(lambda k: f"{1710231300000000 + 100000 * k},{U[k]},{Y[k]:.6f}", "t,u [V],y [V]"),
        told=("us since 1970",),
    ),
    "epoch in ns": Animal(
        text=table(lambda k: f"{1710231300000000000 + 100000000 * k},{U[k]},{Y[k]:.6f}", "timestamp,u [V],y [V]"),
        told=("ns since 1970",),
    ),
    "Excel's serial dates": Animal(
        text=table(lambda k: f"{45363.34375 + T[k] / 86400:.10f},{U[k]},{Y[k]:.6f}", "Date,u [V],y [V]"),
        told=("days since 1900",),
    ),
    "no unit of time": Animal(text=table(plain, "t,u [V],y [V]"), told=("guessed: t in s",)),
    "milliseconds in the name": Animal(
        text=table(lambda k: f"{100 * k},{U[k]},{Y[k]:.6f}", "Time_ms,u [V],y [V]")
    ),
    "thousands": Animal(
        text=table(lambda k: f"{1000000 + 100 * k:,};".replace(",", ".") + f"{U[k]};{Y[k]:.6f}".replace(".", ","),
                   "t [ms];u [V];y [V]"), told=("thousands",)
    ),
    "thousands in English": Animal(
        text=table(lambda k: f"{1000000 + 100 * k:,};{U[k]};{Y[k]:.6f}", "t [ms];u [V];y [V]"), told=("thousands",)
    ),
    "long table of a historian: a bad value is none": Animal(
        text=table(historian, "tag;time [s];value;quality"),
        y="", unit="1", told=("1 missing value", "quality calls it bad"),
    ),
    "long table of WinCC: a second clock, and what is valid": Animal(
        text=table(wincc, '"VarName";"TimeString";"VarValue";"Validity";"Time_ms"', below=('"$RT_COUNT$";40',)),
        step=1.0, unit="1",
    ),
    "long table of InfluxDB: numbers of tables, spans of the query": Animal(
        text="#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,dateTime:RFC3339,double,string,string\n"
        ",result,table,_start,_stop,_time,_value,_field,_measurement\n"
        + "".join(
            f",,{i},2024-03-12T00:00:00Z,2024-03-13T00:00:00Z,2024-03-12T08:15:{k:02d}Z,{x[k]:.6f},{name},tank\n"
            for i, (name, x) in enumerate((("u", U), ("y", Y)))
            for k in range(N)
        ),
        step=1.0, unit="1",
    ),
    "rows of one stamp with a channel each": Animal(
        text=table(lambda k: f"{T[k]:.1f},{U[k]},\n{T[k]:.1f},,{Y[k]:.6f}", HEAD), told=("40 rows of 20 stamps",)
    ),
    "truth in German": Animal(
        text=table(lambda k: f"{T[k]:.1f};{'WAHR' if U[k] == 3.0 else 'FALSCH'};{Y[k]:.6f}", "t [s];u;y [V]"), unit="1"
    ),
    "a year, a month, a day, an hour and minutes in columns": Animal(
        text=table(lambda k: f"2024 {leap_day(k)} {U[k]} {Y[k]:.6f}", "#YY MM DD hh mm u y"),
        suffix=".txt", step=600.0, unit="1", told=("YY, MM, DD, hh, mm together",),
    ),
    "a clock of 32 bit that is full": Animal(
        text=table(lambda k: f"{(2**32 - 500000 + 100000 * k) % 2**32},{U[k]},{Y[k]:.6f}", "micros,u [V],y [V]"),
        told=("a counter of 32 bit is full",),
    ),
    "dates as SAS writes them": Animal(
        text=table(lambda k: f"12MAR2024:08:15:{k:02d},{U[k]},{Y[k]:.6f}", "DT,u [V],y [V]"), step=1.0
    ),
    "a unit behind numbers with a decimal comma": Animal(
        text=table(lambda k: f"{T[k]:.1f} s;{U[k]} V;{Y[k]:.6f} V".replace(".", ","), "t;u;y")
    ),
    "one number shows what points and commas mean": Animal(
        text=table(
            lambda k: f"{T[k]:.1f};{U[k]};{Y[k]:.6f};".replace(".", ",") + ("4.000,00" if k % 3 else f"{800 + k}.000"),
            "t [s];u [V];y [V];p [Pa]",
        ),
        told=("thousands",),
    ),
    "thousands as a Swiss Windows writes them": Animal(
        text=table(lambda k: f"{1000000 + 100 * k:,};{U[k]};{Y[k]:.6f}".replace(",", "\u2019"), "t [ms];u [V];y [V]"),
        told=("thousands",),
    ),
    "a head of several lines in its cells": Animal(
        text=table(plain, '"Time\n[s]","u\n[V]","y\n[V]"')
    ),
    "Campbell's TOA5, units and kinds below the names": Animal(
        text=table(
            lambda k: f'"2024-05-01 {clock(k)}",{1000 + k},{U[k]},{Y[k]:.6f}',
            '"TOA5","Rig","CR1000"', '"TIMESTAMP","RECORD","u","y"', '"TS","RN","V","m"', '"","","Smp","Avg"',
        )
    ),
    "names that two comments say, units in the second": Animal(
        text=table(lambda k: plain(k, "  "), "#t   u   y", "#s   V   V"), suffix=".txt"
    ),
    "a mark between names and numbers": Animal(text=table(plain, "Rig 4", HEAD, "[Data]")),
    "Rigol: the increment behind the names": Animal(
        text=table(
            lambda k: f"{k},{U[k]:.2e},{Y[k]:.6e},", "X,u,y,Start,Increment,", "Sequence,Volt,Volt,-2.5e0,1.0e-1"
        )
    ),
    "Rigol: a clock whose unit is all that names it": Animal(
        text=table(lambda k: f"{T[k] - 1:.5e},{U[k]:.2e},{Y[k]:.6e}, ", ",u,y", "Second,Volt,Volt")
    ),
    "Rigol: the same name over both channels, words above them": Animal(
        text=table(
            plain, '"Sampling Frequency (Hz)=",10,', '"Channel Data","CH 1","CH 2"', '"Inverted = ","NO","YES"',
            '"Time (s)","Voltage (V)","Voltage (V)"',
        ),
        u="Voltage", y="Voltage 2",
    ),
    "potentiostats: units behind strokes": Animal(
        text=table(lambda k: plain(k, "\t"), "time/s\tu/V\t<y>/mA"), y="<y>", suffix=".txt"
    ),
    "Tektronix: units in a line of their own further above": Animal(
        text=table(plain, "Model,MSO44", "Sample Interval,1.0e-01", "Vertical Units,V,V", "Labels,,", "TIME,u,y")
    ),
    "older Tektronix: words of the record beside its first rows": Animal(
        text=table(
            lambda k: f"{BESIDE[k] if k < len(BESIDE) else ','},,  {T[k] - 1.0:.6f},  {U[k]:.5f},"
        ),
        y="",
    ),
    "Yokogawa: a word before what each column has": Animal(
        text=table(
            lambda k: f",{U[k]:.4E},{Y[k]:.6E}",
            "Header Size,9", "Model,DL850", "TraceName,u,y", "BlockSize,20,20", "VUnit,V,V",
            "SampleRate,1.0E+01,1.0E+01", "HOffset,-3.0E-02,-3.0E-02", "Date,2024/03/12", "",
        )
    ),
    "dSPACE: a word before what each column has": Animal(
        text=table(
            lambda k: f",{plain(k)}", '"2024-03-12 08:15:00"', '"type","X","Y","Y"', '"unit","s","V","m"',
            '"name","Time","u","y"', '"trace_values"',
        )
    ),
}  # fmt: skip


@pytest.mark.parametrize("animal", ZOO.values(), ids=ZOO)
def test_what_is_proposed_for_a_file_reads_it_right(
    tmp_path: Path, animal: Animal, monkeypatch: pytest.MonkeyPatch
) -> None:
    # What is drawn is tested where it is drawn.
    monkeypatch.setattr("sysid.workbench.commands.ingest._picture", lambda *_: "none")
    path, proposed = tmp_path / f"record{animal.suffix}", tmp_path / "dataset.yaml"
    path.write_bytes(animal.text.encode(animal.encoding))
    assert run_cli(["ingest", str(path), "--propose", str(proposed)]) == 0
    proposal = proposed.read_text(encoding="utf-8")
    trace = load_dataset(tmp_path)["record"]
    states = max(trace[animal.u]) == 1.0
    assert len(trace) == N
    assert trace.sample_time == pytest.approx(animal.step, rel=1e-9)
    np.testing.assert_allclose(trace[animal.u], [(u - 1.0) / 2.0 for u in U] if states else U, atol=1e-9)
    if animal.y:
        np.testing.assert_allclose(trace[animal.y], Y, atol=1e-6)
        assert trace.usable is None
    assert trace.channels[trace.index(animal.u)].unit == animal.unit
    found = inspect_file(path)
    said = " ".join([proposal, found.time_told, *found.problems])
    for words in animal.told:
        assert words in said
