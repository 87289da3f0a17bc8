"""``sysid simulate --command``: a table of a few rows in, every channel and a picture out."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.export import export_bundle, simulate_bundle
from sysid.ingest import read_trace
from sysid.models import ARX, ARXModel, Cascade, Limit, Mapping
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.workbench.cli import run_cli


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    def model(text):
        return ARXModel(
            orders=ARX(na=1, nb=(1,), nk=(0,)), coefficients=np.array([0.1, 0.9]), intercept=0.0,
            mapping=Mapping.parse(text), sample_time=0.1, input_units=("V",), output_unit="V", rest_output=0.0,
        )  # fmt: skip

    cascade = Cascade(models=(model("u -> a"), model("a -> b")), rest={"a": "u"}, limits={"b": Limit(low=0.5)})
    channel = (Channel(name="u", unit="V"),)
    record = Trace(name="EST", sample_time=0.1, channels=channel, values=np.linspace(0.0, 1.0, 50)[:, np.newaxis])
    traces = TraceSet(name="t", traces=(record,), roles={"EST": Role.ESTIMATION})
    return export_bundle(cascade, traces, tmp_path_factory.mktemp("c") / "b", formats=[]).folder


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
    assert "an output is held at a limit" in said


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
    trace = load_dataset("abdx-service")["VAL04"]
    found = read_command(tmp_path / "c.yaml", [trace.channel("STP")]).trace(trace.sample_time)
    np.testing.assert_array_equal(found["STP"], trace["STP"])
