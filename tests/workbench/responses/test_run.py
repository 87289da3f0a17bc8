"""Pipelines of kind ``response``: from a file of a sweep to a model, its files and its page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from scipy import signal

import sysid
from sysid.errors import ConfigError, UserError
from sysid.reporting.kinds import read_run
from sysid.reporting.responses.results import ResponseResults
from sysid.reporting.results import read_results
from sysid.workbench.cli import run_cli
from sysid.workbench.kinds import RunRequest
from sysid.workbench.responses.run import program
from sysid.workbench.runner.program import carry_out

W = np.geomspace(0.5, 200.0, 40)
H = signal.freqs([400.0], [1.0, 4.0, 100.0], W)[1]
H = H * (1.0 + 0.02 * np.random.default_rng(0).standard_normal(len(W)))
ASKED = {
    "kind": "response", "name": "arm", "data": "sweep.csv", "mapping": "torque -> angle", "poles": 2, "zeros": 0,
    "dead_time": 0.0, "sample_time": 0.001, "weighting": "relative",
}  # fmt: skip


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    columns = {"w [rad/s]": W, "mag [dB]": 20 * np.log10(np.abs(H)), "phase [deg]": np.degrees(np.angle(H))}
    pd.DataFrame(columns).to_csv("sweep.csv", index=False)
    return tmp_path


def written(folder: Path, **fields: Any) -> Path:
    file = folder / "arm.yaml"
    file.write_text(yaml.safe_dump(ASKED | fields), encoding="utf-8")
    return file


def found(folder: Path) -> ResponseResults:
    results = read_run(folder)
    assert isinstance(results, ResponseResults)
    return results


def run(folder: Path, **fields: Any) -> ResponseResults:
    file = written(folder, **fields)
    carry_out(program(RunRequest(path=file, typed="arm")), folder / "runs" / "arm", command="sysid run arm")
    return found(folder / "runs" / "arm")


def test_every_door_gives_the_same_numbers(bench: Path) -> None:
    fit = sysid.fit_response(
        sysid.response_data("sweep.csv"),
        sysid.TransferFunction(poles=(2,), zeros=(0,), delays=(0,), domain="continuous"),
        "torque -> angle", sample_time=0.001, weighting="relative",
    )  # fmt: skip
    options = ["--poles", "2", "--zeros", "0", "--dead-time", "0", "--sample-time", "0.001"]
    typed = ["fit-response", "sweep.csv", *options, "--weighting", "relative", "--mapping", "torque -> angle"]
    assert run_cli([*typed, "--no-tracking"]) == 0
    assert fit.uncertainty is not None
    for (record,) in (run(bench, export=None).fits, found(bench / "runs" / "response-sweep").fits):
        assert [one.value for one in record.parameters] == fit.uncertainty.values.tolist()
        assert [one.deviation for one in record.parameters] == fit.uncertainty.standard_deviations.tolist()
        assert (record.fit_percent, record.left_out_percent) == (fit.fit_percent, fit.left_out_percent)
        assert record.notes == list(fit.notes)
    again = yaml.safe_load((bench / "runs" / "response-sweep" / "pipeline.yaml").read_text())
    assert again == ASKED | {"name": "response-sweep"}
    assert found(bench / "runs" / "response-sweep").command == " ".join(["sysid", *typed[:-1], "'torque -> angle'"])


def test_a_run_leaves_a_page_a_table_and_files_and_is_found_again(
    bench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = written(bench, export={"formats": ["c"]}, channel_units={"torque": "N*m", "angle": "rad"})
    assert run_cli(["run", str(file), "--dry-run"]) == 0
    assert "40 points from" in capsys.readouterr().out
    assert not (bench / "runs").exists()
    assert run_cli(["run", str(file), "--no-tracking"]) == 0
    capsys.readouterr()
    folder = bench / "runs" / "arm"
    page = (folder / "report" / "index.html").read_text(encoding="utf-8")
    for words in (
        "Bode diagram of torque",
        "95 % interval",
        "frequencies left out",
        "Poles and zeros",
        "within tolerance",
    ):
        assert words in page
    (fit,) = found(folder).fits
    assert [export.format for export in fit.exports] == ["c"]
    assert abs(complex(fit.poles[0].real, fit.poles[0].imaginary) + 2) == pytest.approx(96**0.5, rel=0.02)
    np.testing.assert_allclose(pd.read_csv(folder / "response.csv")["gain"], np.abs(H), rtol=1e-9)
    assert sysid.read_bundle(folder).inputs[0]["name"] == "torque"
    before = json.loads((folder / "results.json").read_text())["created"]
    assert run_cli(["run", str(file), "--dry-run"]) == 0
    assert capsys.readouterr().out.count("stored") == 3
    assert run_cli(["export", str(file), "--fit", "arm", "--run-folder", str(folder)]) == 0
    assert (folder / "bundle-arm" / "model.json").is_file()
    assert json.loads((folder / "results.json").read_text())["created"] == before
    assert run_cli(["response", str(folder)]) == 0
    assert "natural frequency" in capsys.readouterr().out
    with pytest.raises(ConfigError, match="fitted no records"):
        read_results(folder)
    assert run_cli(["report", str(folder), "--against", str(folder)]) == 2
    assert "no cases to compare" in capsys.readouterr().err


def test_orders_are_compared_and_stand_on_the_page(bench: Path) -> None:
    results = run(bench, poles="1:3", zeros=None, export=None)
    (fit,) = results.fits
    assert fit.orders is not None
    assert (fit.orders.rows[0].poles, fit.orders.rows[0].zeros) == (2, 0)
    assert len(fit.orders.rows) >= 3
    page = (bench / "runs" / "arm" / "report" / "index.html").read_text(encoding="utf-8")
    table = page.partition("Structures that were compared")[2].partition("</table>")[0]
    assert "poles / zeros" in table and table.count("poles") == 1
    assert not (bench / "runs" / "arm" / "bundle").exists()


def test_what_was_guessed_heads_the_page(bench: Path) -> None:
    table = pd.read_csv("sweep.csv").rename(columns={"phase [deg]": "phase"})
    table.to_csv("sweep.csv", index=False)
    (told,) = run(bench, export=None).data.notes
    assert told.startswith("phase in deg")
    assert "phase in deg" in (bench / "runs" / "arm" / "report" / "index.html").read_text(encoding="utf-8")


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "no number of poles": ({"poles": "two"}, "not a number of poles"),
    "a range backwards": ({"poles": [3, 1]}, "not a number of poles"),
    "more zeros than poles": ({"zeros": 3}, "no more zeros than poles"),
    "a dead time between samples": ({"dead_time": 0.0015}, "multiple of the sample time"),
    "a discrete model without its time": (
        {"domain": "discrete", "sample_time": None, "dead_time": None}, "has a sample time",
    ),
    "a unit of another channel": ({"channel_units": {"speed": "rad/s"}}, "neither input nor output"),
    "an option of another fit": ({"training": {"neurons": 3}}, "unknown field 'neurons'"),
    "two inputs": ({"mapping": "a+b -> y"}, "one input to one output"),
    "no coherence": ({"weighting": "coherence"}, "no coherence to weight by"),
    "no such file": ({"data": "swept.csv"}, "swept.csv"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_done_is_said_before_anything_is_fitted(case: str, bench: Path) -> None:
    fields, says = REFUSED[case]
    with pytest.raises(UserError) as caught:
        run(bench, **fields)
    assert says in str(caught.value)
    assert not (bench / "runs" / "arm" / "fits").exists()


def test_a_fit_that_is_gone_or_of_a_later_release_is_said(bench: Path) -> None:
    run(bench, export=None)
    folder = bench / "runs" / "arm"
    (place,) = (folder / "fits").iterdir()
    (place / "fit.json").unlink()
    with pytest.raises(ConfigError, match="a fit of the run is missing"):
        sysid.reporting.report.write_report(folder)
