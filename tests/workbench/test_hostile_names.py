"""Names that break what they stand in, through every door: nothing of them runs, and nothing of them is lost."""

from __future__ import annotations

import csv
import json
import shutil
import subprocess
import xml.dom.minidom
import zipfile
from pathlib import Path

import html5lib
import mlflow
import numpy as np
import onnx
import pytest
import yaml

from sysid import names
from sysid.export import read_bundle
from sysid.ingest import load_dataset, read_trace, write_trace
from sysid.models import Mapping
from sysid.reporting.results import read_results
from sysid.workbench.cli import run_cli

CODE = (
    "*\\ };__attribute__((constructor)) static void e(void){extern int system(const char*);"
    'system("touch ran");} enum { ZZ = 0 \\*'
)
INPUTS = (
    *(
        "data.InputData",
        "P+ V->C nb[0]",
        "P+_V->C_nb[0]",
        "Öltemp. 🚂 a/b ../../x",
        CODE,
        '=HYPERLINK("x") $x$ [/] */ -->',
    ),
    *("two\nlines \x1b[31mred <img src=x onerror=alert(1)>", "x" * 200),
)
OUTPUT = ']]> {{ 7 * 7 }} */ + -> "y"'
CASES = ("EST", "VAL<img src=x onerror=alert(1)>|", "../VAL\x1b]0;x\x07")
FIT = "fit | <b>`*/`</b> [red]"
FORMATS = ["onnx", "torchscript", "c", "fmi3"]
MAPPING = Mapping(inputs=INPUTS, output=OUTPUT)


def write_workspace(folder: Path) -> None:
    data = folder / "datasets" / "hostile"
    data.mkdir(parents=True)
    (folder / "pipelines").mkdir()
    rng, channels = np.random.default_rng(5), (*INPUTS, OUTPUT)
    for number in range(len(CASES)):
        u = rng.normal(size=(300, len(INPUTS)))
        y = np.zeros(300)
        for t in range(1, 300):
            y[t] = 0.5 * y[t - 1] + u[t - 1].sum() / len(INPUTS) + 1e-3 * rng.normal()
        with (data / f"{number}.csv").open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["t [s]", *(f"c{i} [V]" for i in range(len(channels)))])
            writer.writerows(np.column_stack([0.1 * np.arange(300), u, y]).tolist())
    description = {
        "name": "hostile",
        "description": "\x1b[31m<script>alert(1)</script>",
        "sample_time": 0.1,
        "channels": [{"name": name, "unit": "V", "description": "<img src=x>|`"} for name in channels],
        "source": {"files": {"columns": {name: f"c{i}" for i, name in enumerate(channels)}}},
        "cases": {
            case: {"role": role, "file": f"{number}.csv"}
            for number, (case, role) in enumerate(zip(CASES, ("estimation", "selection", "validation"), strict=True))
        },
    }
    (data / "dataset.yaml").write_text(yaml.safe_dump(description, allow_unicode=True), encoding="utf-8")
    common = {"data": "hostile", "start": "first-sample", "mapping": {"inputs": list(INPUTS), "output": OUTPUT}}
    common["stability"] = {"count": 20}
    many = len(INPUTS)
    pipeline = {
        **common,
        "name": "hostile",
        "description": "<img src=x onerror=alert(1)> \x1b[31m",
        "fits": [{"name": FIT, "structure": {"kind": "ARX", "na": 1, "nb": [1] * many, "nk": [1] * many}}],
        "export": {"formats": FORMATS},
    }
    ranges = [{"from": 0, "to": 1}, *([1] * (many - 1))]
    sweep = {
        **common,
        "kind": "sweep",
        "name": "swept",
        "structure": {"kind": "ARX", "na": 1, "nb": ranges, "nk": 1},
        "method": "grid",
        "choose": {"by": "free_run_mse", "on": "selection"},
        "workers": 1,
        "export": None,
    }
    for name, content in (("hostile", pipeline), ("swept", sweep)):
        (folder / "pipelines" / f"{name}.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory, empty_store: Path) -> Path:
    """A workspace in which a pipeline of hostile names was run, tracked and published."""
    folder = tmp_path_factory.mktemp("hostile")
    write_workspace(folder)
    shutil.copyfile(empty_store, folder / "mlflow.db")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.delenv("MLFLOW_TRACKING_URI", raising=False)
        assert run_cli(["run", "hostile"]) == 0
        assert run_cli(["publish", "runs/hostile"]) == 0
    return folder


def test_the_names_are_kept_where_they_are_data(ran: Path) -> None:
    results = read_results(ran / "runs" / "hostile")
    assert Mapping.parse(results.fits[0].mapping) == MAPPING
    assert set(results.fits[0].cases) == set(CASES)
    assert results.fits[0].name == FIT
    assert results.fits[0].cases[CASES[1]].free_run.nrmse_fit > 0.9
    bundle = read_bundle(ran / "runs" / "hostile" / "bundle")
    assert bundle.model.mapping == MAPPING
    assert {file.format for file in bundle.files} == set(FORMATS)
    assert max(file.largest_difference for file in bundle.files) < 1e-9


def elements_of(html: str) -> set[str]:
    return {element.tag for element in html5lib.parse(html, namespaceHTMLElements=False).iter()}


def test_the_report_shows_them_and_runs_nothing(ran: Path) -> None:
    page = (ran / "runs" / "hostile" / "report" / "index.html").read_text(encoding="utf-8")
    assert not elements_of(page) & {"img", "script", "b"}
    text = "".join(html5lib.parse(page, namespaceHTMLElements=False).itertext())
    assert "<img src=x onerror=alert(1)>" in text
    assert not any(mark in page for mark in ("\x1b", "\x07"))
    assert "{{ 7 * 7 }}" in page


def test_markdown_shows_them_too(ran: Path) -> None:
    from markdown_it import MarkdownIt

    markdown = MarkdownIt("gfm-like", {"linkify": False, "html": True})
    for file in (ran / "reports" / "hostile" / "README.md", *(ran / "runs" / "hostile" / "bundle").glob("*.md")):
        found = elements_of(markdown.render(file.read_text(encoding="utf-8")))
        drawings = {"img"} if "reports" in file.parts else set()
        assert not found & ({"img", "script", "b", "iframe"} - drawings), file
        assert "\x1b" not in file.read_text(encoding="utf-8")


def test_the_c_code_is_a_fixed_program(ran: Path) -> None:
    folder = ran / "runs" / "hostile" / "bundle"
    for file in (*folder.glob("*.c"), *folder.glob("*.h")):
        text = file.read_text(encoding="utf-8")
        assert "constructor" in text  # in a comment, where it is told
        # By the compiler itself, which puts trigraphs and joined lines right before it leaves comments out.
        for standard in ("-std=c99", "-std=gnu17"):
            command = ["cc", "-E", "-P", standard, f"-I{folder}", str(file)]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
            assert "ZZ" not in done.stdout
    assert not (ran / "ran").exists()


def test_the_fmus_describe_them(ran: Path) -> None:
    for file in (ran / "runs" / "hostile" / "bundle").glob("*.fmu"):
        with zipfile.ZipFile(file) as archive:
            tree = xml.dom.minidom.parseString(archive.read("modelDescription.xml"))  # noqa: S318 - ours
        variables = [
            node.getAttribute("name")
            for tag in ("ScalarVariable", "Float64")
            for node in tree.getElementsByTagName(tag)
        ]
        assert len(set(variables)) == len(variables)
        assert {names.xml_name(name) for name in (*INPUTS, OUTPUT)} <= set(variables)


def test_onnx_is_whole(ran: Path) -> None:
    for file in (ran / "runs" / "hostile" / "bundle").glob("*.onnx"):
        onnx.checker.check_model(str(file), full_check=True)


def test_they_are_tracked(ran: Path) -> None:
    client = mlflow.MlflowClient(f"sqlite:///{ran / 'mlflow.db'}")
    (experiment,) = [one for one in client.search_experiments() if one.name != "Default"]
    (run,) = client.search_runs([experiment.experiment_id])
    assert run.info.status == "FINISHED"
    assert run.data.tags["fit"] == FIT
    assert {name for name in run.data.metrics if name.startswith("free_run_mse/")} == {
        f"free_run_mse/{names.tracking_key(case)}" for case in CASES
    }
    assert client.search_registered_models()


def test_python_control_has_them_all(ran: Path) -> None:
    system = read_bundle(ran / "runs" / "hostile" / "bundle").model.to_control()
    assert len(set(system.input_labels)) == len(INPUTS)
    assert system.input_labels[0] == "data_InputData"


def test_traces_of_them_are_written_and_read(ran: Path, tmp_path: Path) -> None:
    trace = load_dataset(ran / "datasets" / "hostile" / "dataset.yaml").traces[0]
    read = read_trace(write_trace(trace, tmp_path / "a.parquet"))
    assert read.channel_names == trace.channel_names
    back = read_trace(write_trace(trace, tmp_path / "a.csv"))
    assert back.channel_names == trace.channel_names
    np.testing.assert_array_equal(back.values, trace.values)
    header = next(
        csv.reader([line for line in (tmp_path / "a.csv").read_text().splitlines() if "HYPERLINK" in line][-1:])
    )
    assert not [cell for cell in header if cell.startswith(("=", "+", "-", "@"))]


def test_a_sweep_over_an_index_is_tracked(ran: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ran)
    assert run_cli(["sweep", "swept"]) == 0
    client = mlflow.MlflowClient(f"sqlite:///{ran / 'mlflow.db'}")
    (experiment,) = [one for one in client.search_experiments() if "swept" in one.name]
    trials = [run for run in client.search_runs([experiment.experiment_id]) if run.data.tags["kind"] == "trial"]
    assert {run.data.params["nb.0"] for run in trials} == {"0", "1"}
    assert {run.info.status for run in trials} == {"FINISHED"}


def test_the_screen_shows_them_as_text(
    ran: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ran)
    assert run_cli(["run", "hostile", "--no-tracking"]) == 0
    assert run_cli(["ingest", "hostile"]) == 0
    said = capsys.readouterr().out
    assert "\x1b" not in said
    assert "[red]" in said
    log = (ran / "runs" / "hostile" / "log.txt").read_text(encoding="utf-8")
    assert "\x1b" not in log
    assert json.loads((ran / "runs" / "hostile" / "results.json").read_text(encoding="utf-8"))
