"""``sysid simulate --command``: a table of a few rows in, every channel and a picture out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sysid.estimation import FitResult, Loop, Status
from sysid.export import export_bundle, simulate_bundle
from sysid.ingest import read_trace
from sysid.models import ARX, ARXModel, Cascade, Limit, Mapping, Start
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.workbench.cli import run_cli
from sysid.workbench.commands.simulate import _of_cases
from tests.traces.made import trace_of


def model(text):
    return ARXModel(
        orders=ARX(na=1, nb=(1,), nk=(0,)), coefficients=np.array([0.1, 0.9]), intercept=0.0,
        mapping=Mapping.parse(text), sample_time=0.1, input_units=("V",), output_unit="V", rest_output=0.0,
    )  # fmt: skip


RECORD = trace_of({"u": np.linspace(0.0, 1.0, 50)}, name="EST", sample_time=0.1)
TRACES = TraceSet(name="t", traces=(RECORD,), roles={"EST": Role.ESTIMATION})


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    cascade = Cascade(models=(model("u -> a"), model("a -> b")), rest={"a": "u"}, limits={"b": Limit(low=0.5)})
    return export_bundle(cascade, TRACES, tmp_path_factory.mktemp("c") / "b", formats=[]).folder


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_command_is_simulated_written_and_drawn(bundle, tmp_path, capsys, ending):
    (tmp_path / "c.csv").write_text("time [ds],u [mV]\n0,1000\n20,250\n60,0\n")
    out = tmp_path / f"o.{ending}"
    assert run_cli(["simulate", str(bundle), "--command", str(tmp_path / "c.csv"), "--out", str(out)]) == 0
    written = read_trace(out)
    expected = simulate_bundle(bundle, tmp_path / "c.csv").trace
    assert written.channel_names == ("u", "a", "b")
    np.testing.assert_array_equal(written.values, expected.values)
    assert (tmp_path / "o.png").read_bytes().startswith(b"\x89PNG")
    said = capsys.readouterr().out
    assert "60 samples of a, b written to" in said
    assert "an output is held at one of its limits" in said


def test_each_of_several_outputs_begins_at_a_level_of_its_own(tmp_path, capsys):
    cascade = Cascade(models=(model("u -> T[1]"), model("u -> b")), rest={"T[1]": 0.0, "b": 0.0})
    folder = export_bundle(cascade, TRACES, tmp_path / "b", formats=[]).folder
    (tmp_path / "u.csv").write_text("time [s],u\n" + "".join(f"{k / 10},{k}\n" for k in range(9)))
    words = ["simulate", str(folder), str(tmp_path / "u.csv"), "--units", "u=V", "--out", str(tmp_path / "o.csv")]
    assert run_cli([*words, "--initial", "T[1]=3", "--initial", "b=-1"]) == 0
    assert read_trace(tmp_path / "o.csv")["T[1]"][0] == pytest.approx(2.7)
    assert read_trace(tmp_path / "o.csv")["b"][0] == pytest.approx(-0.9)
    for wrong, said in (
        (["3"], '--initial "T[1]=..." for each'),
        (["b=x"], "NAME=NUMBER for each of several outputs"),
        (["b=nan"], "the output cannot begin there"),
        (["c=1"], "missing channel c"),
    ):
        capsys.readouterr()
        assert run_cli([*words, *(part for one in wrong for part in ("--initial", one))]) == 2
        assert said in " ".join(capsys.readouterr().err.split())


def test_a_picture_where_it_is_asked_for(bundle, tmp_path):
    (tmp_path / "c.json").write_text("[[0, 2.0], [6, 0]]")
    words = ["--command", str(tmp_path / "c.json"), "--time-unit", "s", "--unit", "V", "--out", str(tmp_path / "o.csv")]
    assert run_cli(["simulate", str(bundle), *words, "--plot", str(tmp_path / "p.svg")]) == 0
    assert "outside the declared range" in (tmp_path / "p.svg").read_text()
    assert not (tmp_path / "o.png").exists()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        pytest.param([], "nothing says what to simulate", id="nothing to simulate"),
        pytest.param(["c.csv", "--command", "c.csv"], "two files say", id="both"),
        pytest.param(["--command", "c.csv", "--plot", "p.bmp"], "no picture of this kind", id="a strange picture"),
        pytest.param(["--command", "c.csv"], "unit of time is not declared", id="no unit"),
        pytest.param(["--command", "c.csv", "--time-unit", "psi", "--unit", "V"], "cannot convert psi to s", id="unit"),
        pytest.param(["--command", "no.csv"], "cannot be read", id="no file"),
    ],
)
def test_what_is_wrong_is_said(*, bundle, tmp_path, monkeypatch, capsys, words, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "c.csv").write_text("0,1\n2,1\n")
    assert run_cli(["simulate", str(bundle), *words, "--out", "o.csv"]) == 2
    assert says in capsys.readouterr().err
    assert not (tmp_path / "o.csv").exists()


def test_a_case_of_the_literature_is_the_trace_of_its_data_set(tmp_path):
    """The printed rows of a case give the same samples as the data set that was made from them."""
    from sysid.export import read_command
    from sysid.ingest import load_dataset

    (tmp_path / "c.yaml").write_text(
        "time_unit: ds\nunit: psi\ncommand: [[0, 90], [100, 84.2], [600, 90], [2050, 90]]\n"
    )
    trace = load_dataset("abdx-service", cases=["VAL04"])["VAL04"]
    found = read_command(tmp_path / "c.yaml", [trace.channel("STP")]).trace(trace.sample_time)
    np.testing.assert_array_equal(found["STP"], trace["STP"])


DECAY = np.concatenate([[5.0], np.zeros(39)])
for _t in range(1, 40):
    DECAY[_t] = 0.9 * DECAY[_t - 1] + 0.1 * (_t - 1) / 40 + 0.2 * 3.0


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run folder with one exported model of two inputs, as ``sysid run`` leaves it."""
    model = ARXModel(
        orders=ARX(na=1, nb=(1, 1), nk=(1, 1)), coefficients=np.array([0.1, 0.2, 0.9]), intercept=0.0,
        mapping=Mapping.parse("u+v -> y"), sample_time=0.1, input_units=("V", "V"), output_unit="m", rest_output=0.0,
    )  # fmt: skip
    channels = (Channel(name="u", unit="V"), Channel(name="v", unit="V"), Channel(name="y", unit="m"))
    values = np.column_stack([np.linspace(0.0, 1.0, 50), np.linspace(0.0, 5.0, 50), np.linspace(0.0, 6.0, 50)])
    record = Trace(name="EST", sample_time=0.1, channels=channels, values=values)
    traces = TraceSet(name="t", traces=(record,), roles={"EST": Role.ESTIMATION})
    folder = tmp_path_factory.mktemp("runs") / "mine"
    (folder / "fits" / "arx").mkdir(parents=True)
    (folder / "pipeline.yaml").write_text("name: mine")
    fit = FitResult(model=model, status=Status.EXACT, loop=Loop.OPEN, history={}, train_time_s=0.0)
    export_bundle(fit, traces, folder / "bundle", formats=[], start=Start(kind="estimated"))
    return folder


def table(path, **columns):
    """A CSV of 40 samples, 0.1 s apart; headers as they are given, numbers are held."""
    held = {name: np.broadcast_to(np.asarray(values, dtype=float), 40) for name, values in columns.items()}
    rows = np.column_stack([0.1 * np.arange(40), *held.values()])
    np.savetxt(path, rows, delimiter=",", header=",".join(["time [s]", *held]), comments="")
    return str(path)


def simulated(run, *words, out):
    code = run_cli(["simulate", str(run), *words, "--out", str(out)])
    return code, (read_trace(out) if code == 0 else None)


RAMP = np.arange(40) / 40


def test_a_constant_is_an_input_as_a_column_and_as_a_number(run, tmp_path):
    whole = table(tmp_path / "w.csv", **{"u [V]": RAMP, "v [V]": 3.0})
    part = table(tmp_path / "p.csv", **{"u [V]": RAMP})
    _, column = simulated(run, whole, out=tmp_path / "a.csv")
    _, number = simulated(run, part, "--constant", "v=3", out=tmp_path / "b.csv")
    np.testing.assert_array_equal(column.values, number.values)
    (tmp_path / "c.csv").write_text("time [s],u [V]\n0,1\n2,1\n")
    code, command = simulated(run, "--command", str(tmp_path / "c.csv"), "--constant", "v=3", out=tmp_path / "d.csv")
    assert code == 0 and set(command["v"]) == {3.0}


def test_with_the_measured_output_the_run_begins_where_the_plant_is(run, tmp_path, capsys):
    file = table(tmp_path / "w.csv", **{"u [V]": RAMP, "v [V]": 3.0, "y [m]": DECAY})
    _, found = simulated(run, file, out=tmp_path / "a.csv")
    np.testing.assert_allclose(found["y"], DECAY, atol=1e-10)
    assert "estimated on the first 8 samples" in capsys.readouterr().out
    _, rest = simulated(run, file, "--start", "rest", out=tmp_path / "b.csv")
    assert abs(rest["y"][1] - DECAY[1]) > 1.0
    assert "against the measured y: fit" in capsys.readouterr().out
    simulated(run, file, "--initial", "3", out=tmp_path / "d.csv")
    told = capsys.readouterr().out
    assert "it begins where the output has stood at 3" in told and "on all samples" in told
    _, first = simulated(run, file, "--start", "first-sample", out=tmp_path / "c.csv")
    assert first["y"][0] == pytest.approx(0.9 * 5.0 + 0.6)


def test_samples_at_which_the_output_is_missing_take_no_part(run, tmp_path):
    """Measured up to now, and the rest of the column is blank."""
    seen = DECAY.copy()
    seen[[2, *range(9, 40)]] = np.nan
    file = table(tmp_path / "w.csv", **{"u [V]": RAMP, "v [V]": 3.0, "y [m]": seen})
    _, found = simulated(run, file, out=tmp_path / "a.csv")
    np.testing.assert_allclose(found["y"][10:], DECAY[10:], atol=1e-10)


@pytest.mark.parametrize("folder", ["", "fits"])
def test_a_run_folder_is_taken_for_its_bundle(run, tmp_path, folder):
    file = table(tmp_path / "w.csv", **{"u [V]": RAMP, "v [V]": 3.0})
    assert simulated(run / folder, file, out=tmp_path / "a.csv")[0] == 0


@pytest.mark.parametrize(
    ("columns", "repaired"),
    [
        pytest.param({"U1 [V]": RAMP, "v [V]": RAMP}, ["--columns", "u=U1"], id="another name"),
        pytest.param({"u": RAMP, "v [V]": RAMP}, ["--units", "u=V"], id="no unit"),
        pytest.param({"u [V]": RAMP}, ["--constant", "v=0.5"], id="no column"),
        pytest.param({"u [V]": np.where(RAMP == 0.5, np.nan, RAMP), "v [V]": 1}, ["--repairs", "nan=hold"], id="nan"),
    ],
)
def test_the_remedy_is_an_option_of_this_command(run, tmp_path, capsys, columns, repaired):
    file = table(tmp_path / "w.csv", **columns)
    assert simulated(run, file, out=tmp_path / "a.csv")[0] == 2
    assert repaired[0] in capsys.readouterr().err
    assert simulated(run, file, *repaired, out=tmp_path / "a.csv")[0] == 0


@pytest.mark.parametrize(("unit", "in_seconds"), [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("min", 60.0)])
def test_a_clock_without_a_unit_is_told_by_the_models_sample_time(run, tmp_path, capsys, unit, in_seconds):
    rows = np.column_stack([0.1 * np.arange(40) / in_seconds, RAMP, RAMP])
    np.savetxt(tmp_path / "s.csv", rows, delimiter=",", header="t,u [V],v [V]", comments="")
    code, found = simulated(run, str(tmp_path / "s.csv"), out=tmp_path / "a.csv")
    assert code == 0 and len(found) == 40
    assert f"t is taken in {unit}" in capsys.readouterr().out


def test_a_clock_of_another_step_is_declared_as_the_remedy_says(run, tmp_path, capsys):
    rows = np.column_stack([0.2 * np.arange(40), RAMP, RAMP])
    np.savetxt(tmp_path / "s.csv", rows, delimiter=",", header="t,u [V],v [V]", comments="")
    assert simulated(run, str(tmp_path / "s.csv"), out=tmp_path / "a.csv")[0] == 2
    assert "--time 't [s]'" in capsys.readouterr().err
    words = ["--time", "t [s]", "--grid", "method=linear"]
    code, found = simulated(run, str(tmp_path / "s.csv"), *words, out=tmp_path / "a.csv")
    assert code == 0 and len(found) == 79


def test_another_sample_time_is_resampled_where_that_is_asked_for(run, tmp_path, capsys):
    rows = np.column_stack([0.2 * np.arange(40), RAMP, RAMP])
    np.savetxt(tmp_path / "s.csv", rows, delimiter=",", header="time [s],u [V],v [V]", comments="")
    assert simulated(run, str(tmp_path / "s.csv"), out=tmp_path / "a.csv")[0] == 2
    said = capsys.readouterr().err
    assert "--grid method=linear" in said and "sample_time:" not in said
    assert simulated(run, str(tmp_path / "s.csv"), "--grid", "method=linear", out=tmp_path / "a.csv")[0] == 0


@pytest.mark.parametrize(
    ("words", "says"),
    [
        pytest.param(["--constant", "w=3"], "missing channel w", id="no such input"),
        pytest.param(["--constant", "v=3"], "v is given twice", id="twice"),
        pytest.param(["--constant", "v=nan"], "cannot be held there", id="not finite"),
        pytest.param(["--constant", "v"], "NAME=NUMBER", id="no number"),
        pytest.param(["--start", "estimated"], "needs the measured output", id="nothing measured"),
        pytest.param(["--start", "sleepy"], "cannot begin so", id="no such start"),
        pytest.param(["--start", "first-sample", "--initial", "3"], "two ways", id="two starts"),
    ],
)
def test_how_a_run_cannot_begin(run, tmp_path, capsys, words, says):
    file = table(tmp_path / "w.csv", **{"u [V]": RAMP, "v [V]": RAMP})
    assert simulated(run, file, *words, out=tmp_path / "a.csv")[0] == 2
    assert says in capsys.readouterr().err


def test_units_that_are_missing_are_asked_for_at_once(run, tmp_path, capsys):
    file = table(tmp_path / "w.csv", u=RAMP, v=RAMP, y=DECAY)
    assert simulated(run, file, out=tmp_path / "a.csv")[0] == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "--units u=V --units v=V --units y=m" in said and "none for u, v, y" in said
    units = ["--units", "u=V", "--units", "v=V", "--units", "y=m"]
    for start in ([], ["--start", "rest"], ["--initial", "5"]):
        assert simulated(run, file, *units, *start, out=tmp_path / "a.csv")[0] == 0
    assert simulated(run, file, *units, "--units", "w=V", out=tmp_path / "a.csv")[0] == 2
    assert "units names w, which is not a channel" in capsys.readouterr().err


def test_without_a_name_it_is_written_beside_what_is_simulated(run, tmp_path, capsys):
    file = table(tmp_path / "w.csv", **{"u [V]": RAMP, "v [V]": 3.0})
    assert run_cli(["simulate", str(run), file]) == 0
    assert read_trace(tmp_path / "w.simulated.csv").channel_names == ("u", "v", "y")
    assert "w.simulated.csv" in capsys.readouterr().out.replace("\n", "")
    (tmp_path / "c.csv").write_text("time [s],u [V],v [V]\n0,1,2\n2,1,2\n")
    assert run_cli(["simulate", str(run), "--command", str(tmp_path / "c.csv")]) == 0
    assert {"c.simulated.csv", "c.simulated.png"} <= {one.name for one in tmp_path.iterdir()}


DATASET = """
name: rig
sample_time: 0.1
channels: [{name: u, unit: V}, {name: v, unit: V}, {name: y, unit: m}]
source: {files: {}, repairs: {constant: accept}}
cases:
  EST: {role: estimation, file: ../../w.csv, rows: [1, 20]}
  VAL: {role: validation, file: ../../w.csv, rows: [21, null]}
"""


def test_the_records_of_a_data_set_of_the_workspace_are_simulated(run, tmp_path, monkeypatch, capsys):
    table(tmp_path / "w.csv", **{"u [V]": RAMP, "v [V]": 3.0, "y [m]": DECAY})
    (tmp_path / "datasets" / "rig").mkdir(parents=True)
    (tmp_path / "datasets" / "rig" / "dataset.yaml").write_text(DATASET)
    monkeypatch.chdir(tmp_path)
    assert run_cli(["simulate", str(run), "rig"]) == 0
    for case, rows in {"EST": slice(0, 20), "VAL": slice(20, 40)}.items():
        written = read_trace(tmp_path / f"rig.simulated.{case}.csv")
        np.testing.assert_allclose(written["y"], DECAY[rows], atol=1e-10)
    capsys.readouterr()
    for words, says in (
        (["rug"], "did you mean rig"),
        (["rug"], "named with its ending, as inputs.csv"),
        (["rig", "--units", "u=V"], "these options are for a file of samples"),
    ):
        assert run_cli(["simulate", str(run), *words]) == 2
        assert says in " ".join(capsys.readouterr().err.split())


def test_cases_whose_names_fit_alike_have_a_file_each() -> None:
    """The second had overwritten the first, and on some disks capitals do not tell files apart."""
    found = _of_cases(Path("run.csv"), ["a/b", "a b", "A_B", "a-b", "Größe 1"])
    assert [path.name for path in found.values()] == [
        "run.a-b.csv", "run.a-b-2.csv", "run.A_B.csv", "run.a-b-3.csv", "run.Größe-1.csv",
    ]  # fmt: skip
    assert [path.name for path in _of_cases(Path("run.csv"), ["A", "a"]).values()] == ["run.A.csv", "run.a-2.csv"]
