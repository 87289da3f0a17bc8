"""Tracking, read back from a store of its own: what an engineer finds there, and what its failure costs."""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
import subprocess
import sys
import warnings
import zlib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sysid.export import read_bundle
from sysid.models import History
from sysid.reporting import read_signals
from sysid.reporting.results import Results
from sysid.workbench.cli import run_cli
from sysid.workbench.fits.config import Pipeline, PipelineConfig
from sysid.workbench.fits.run import program_of
from sysid.workbench.runner.program import carry_out
from sysid.workbench.tracking import fit_values as tracked
from sysid.workbench.tracking import mlflow_store as tracking
from sysid.workbench.tracking import mlflow_views as views
from sysid.workbench.tracking import registry
from sysid.workbench.tracking.listener import KEY_TAG, Tracker, registered_as
from sysid.workbench.tracking.mlflow_store import latest_experiment, store_uri


def read_view(value: str) -> dict:
    """What ``view_tag`` packed, as MLflow's page unpacks it."""
    packed = json.loads(value)["state"].removeprefix("deflate;")
    return json.loads(zlib.decompress(base64.b64decode(packed)))


def track(workspace: Path, name: str = "first", *, fresh: bool = False) -> tuple[Tracker, Results]:
    """Run a pipeline of the workspace with a tracker."""
    told: list[str] = []
    tracker = Tracker.of_workspace(workspace, told.append)
    read = Pipeline.read(PipelineConfig, workspace / "pipelines" / f"{name}.yaml")
    results = carry_out(
        program_of(read), workspace / "run", command=f"sysid run {name}", fresh=fresh, watchers=[tracker]
    )
    assert len(told) == len(tracker.failures)
    return tracker, results


def runs_of(client) -> dict[str, object]:
    """Runs by the name of their fit."""
    experiment = client.get_experiment_by_name("inlet+valve -> outlet")
    return {run.data.tags["fit"]: run for run in client.search_runs([experiment.experiment_id])}


@pytest.fixture(scope="module")
def tracked_once(tmp_path_factory: pytest.TempPathFactory, write_rig, empty_store: Path):
    """One run with export, tracked; and the client that reads it back."""
    workspace = tmp_path_factory.mktemp("tracked")
    write_rig(workspace)
    shutil.copyfile(empty_store, workspace / "mlflow.db")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(workspace)
        patch.delenv("MLFLOW_TRACKING_URI", raising=False)
        file = workspace / "pipelines" / "first.yaml"
        file.write_text(file.read_text().replace("export: null", "export: {formats: [onnx]}"), encoding="utf-8")
        tracker, results = track(workspace)
        assert tracker.failures == []
        assert "MLFLOW_TRACKING_URI" not in os.environ, "the next run in this process would be tracked there"
        yield workspace, tracker.client, results


def test_fits_stand_flat_in_the_experiment_of_their_mapping(tracked_once) -> None:
    _, client, _ = tracked_once
    found = runs_of(client)
    assert {run.info.run_name for run in found.values()} == {
        "ARX [1; 1 1; 1 1] · open · inlet+valve -> outlet",
        "NARX 1/1/2 · open · inlet+valve -> outlet",
        "NARX 1/1/2 · closed · inlet+valve -> outlet",
    }
    assert {run.info.status for run in found.values()} == {"FINISHED"}
    assert not any("mlflow.parentRunId" in run.data.tags for run in found.values())
    assert len({run.data.tags["pipeline_run"] for run in found.values()}) == 1
    assert len({run.data.tags["mlflow.runColor"] for run in found.values()}) == len(found), "told apart in charts"


def four_digits(value: float) -> float:
    return float(f"{value:.4g}")


def test_parameters_and_figures_are_those_of_the_results(tracked_once) -> None:
    _, client, results = tracked_once
    closed = runs_of(client)["closed loop"]
    record = results.fits[2]
    assert closed.data.params["structure.neurons"] == "2"
    assert closed.data.params["training.max_iterations"] == "8"
    assert closed.data.params["training.loop"] == "closed"
    for name, case in record.cases.items():
        assert closed.data.metrics[f"free_run_mse/{name}"] == four_digits(case.free_run.mse)
        assert closed.data.metrics[f"one_step_mse/{name}"] == four_digits(case.one_step.mse)
    assert closed.data.metrics["mean_free_run_mse"] == four_digits(record.cases["run-3"].free_run.mse)
    assert closed.data.metrics["parameters"] == record.n_parameters
    assert "training.loop" not in runs_of(client)["ARX"].data.params


def test_the_learning_curve_is_a_stepped_metric(tracked_once) -> None:
    _, client, results = tracked_once
    history = client.get_metric_history(runs_of(client)["closed loop"].info.run_id, "learning_curve_mse")
    curve = results.fits[2].learning_curve
    assert curve is not None
    assert [(entry.step, entry.value) for entry in sorted(history, key=lambda entry: entry.step)] == [
        (int(step), mse) for step, mse in zip(curve.iteration, curve.mse, strict=True)
    ]


def test_free_runs_are_lines_over_the_samples_of_a_case_beside_their_target(tracked_once) -> None:
    workspace, client, _ = tracked_once
    run = runs_of(client)["closed loop"].info.run_id
    output, target = (
        {entry.step: entry.value for entry in client.get_metric_history(run, f"{line}/run-3")}
        for line in (tracked.OUTPUT, tracked.TARGET)
    )
    assert output.keys() == target.keys()
    assert np.ptp(list(target.values())) > 0.0
    whole = read_signals(workspace / "run" / "fits" / "closed-loop", ["run-3"])["run-3"]
    steps = list(output)
    np.testing.assert_allclose([output[step] for step in steps], whole.simulated[steps], rtol=1e-5)
    np.testing.assert_allclose([target[step] for step in steps], whole.target[steps], rtol=1e-5)


def test_the_data_set_is_an_input_with_its_digest(tracked_once) -> None:
    _, client, results = tracked_once
    for run in runs_of(client).values():
        (entry,) = run.inputs.dataset_inputs
        assert entry.dataset.name == "rig"
        assert results.data.digest.startswith(entry.dataset.digest)
        assert run.data.tags["data_digest"] == results.data.digest
        assert "outlet [kPa gauge]" in entry.dataset.schema


def test_pictures_have_the_same_key_in_every_fit(tracked_once) -> None:
    _, client, _ = tracked_once
    keys = {}
    for name, run in runs_of(client).items():
        files = [entry.path for entry in client.list_artifacts(run.info.run_id, "images")]
        keys[name] = {Path(file).name.split("+step+")[0] for file in files}
        assert run.data.tags["mlflow.loggedImages"] == "True"
    assert set(map(frozenset, keys.values())) == {
        frozenset({"target and output~run-1", "target and output~run-2", "target and output~run-3"})
    }


def test_pictures_lie_where_the_comparison_of_runs_looks_for_them(tracked_once) -> None:
    _, client, _ = tracked_once
    for run in runs_of(client).values():
        files = {entry.path for entry in client.list_artifacts(run.info.run_id) if not entry.is_dir}
        assert {f"target and output - run-{n}.png" for n in (1, 2, 3)} <= files


def test_a_fit_leads_to_the_fit_it_started_from_and_to_its_bundle(tracked_once) -> None:
    _, client, results = tracked_once
    runs = runs_of(client)
    closed, parent = runs["closed loop"], runs["open loop"].info.run_id
    here = f"#/experiments/{closed.info.experiment_id}/runs"
    assert closed.data.tags["initial_run"] == parent
    assert f"[started from open loop]({here}/{parent})" in closed.data.tags["mlflow.note.content"]
    best = runs[results.best.name]
    for part in ("bundle", "report"):
        assert f"[{part}]({here}/{best.info.run_id}/artifacts/{part})" in best.data.tags["mlflow.note.content"]
    zips = [entry.path for entry in client.list_artifacts(best.info.run_id) if entry.path.endswith(".zip")]
    assert len(zips) == 1


def test_the_experiment_shows_first_what_matters_first(tracked_once) -> None:
    _, client, _ = tracked_once
    tags = client.get_experiment_by_name("inlet+valve -> outlet").tags
    state = read_view(tags[views.TAG])
    assert tags[views.CASES_TAG] == "run-1|run-2|run-3"
    assert state["selectedColumns"][0] == state["orderByKey"] == "metrics.`mean_free_run_mse`"
    known = {name for run in runs_of(client).values() for name in run.data.metrics}
    charts = state["compareRunCharts"]
    assert {chart["metricKey"] for chart in charts if "metricKey" in chart} <= known
    lines = [chart["selectedMetricKeys"] for chart in charts if chart["type"] == "LINE"]
    assert {name for line in lines for name in line} <= known
    assert ["target/run-2", "output/run-2"] in lines
    assert {chart["lineSmoothness"] for chart in charts if chart["type"] == "LINE"} == {0}
    pictures = [chart["imageKeys"] for chart in charts if chart["type"] == "IMAGE"]
    assert pictures == [[f"target and output/run-{n}"] for n in (1, 2, 3)]


def test_the_list_of_experiments_says_what_is_in_one(tracked_once) -> None:
    _, client, _ = tracked_once
    told = {one.name: one.tags.get("mlflow.note.content", "") for one in client.search_experiments()}
    assert all(text for name, text in told.items() if name != "Default"), told


@pytest.mark.parametrize(
    ("mapping", "fit"), [pytest.param("u -> y1+y2", "NARX", id="all"), pytest.param("", "NARX, y1", id="one")]
)
def test_a_version_of_several_outputs_is_of_the_whole_fit(mapping: str, fit: str) -> None:
    """It was tagged with the fit of its first output alone."""
    ready: Any = SimpleNamespace(
        system="NARX", config=SimpleNamespace(name="NARX, y1"), pipeline=SimpleNamespace(mapping="u -> y1")
    )
    assert registered_as(ready, mapping) == (mapping or "u -> y1", fit)


def test_a_view_of_many_cases_fits_into_a_tag() -> None:
    names = [f"case {n} {'x' * (n % 40)}" for n in range(400)]
    value = views.view_tag(names, 0)
    assert len(value) <= views.TAG_LIMIT
    shown = [chart for chart in read_view(value)["compareRunCharts"] if chart["type"] == "IMAGE"]
    assert 10 < len(shown) < 400


def test_the_best_fit_has_bundle_report_and_a_model(tracked_once) -> None:
    _, client, results = tracked_once
    run = runs_of(client)[results.best.name]
    bundled = {Path(entry.path).name for entry in client.list_artifacts(run.info.run_id, "bundle")}
    assert {"model.json", "step.onnx", "sequence.onnx"} <= bundled
    assert {Path(entry.path).name for entry in client.list_artifacts(run.info.run_id, "report")} == {
        "index.html",
        "results.json",
    }
    (output,) = run.outputs.model_outputs
    assert client.get_logged_model(output.model_id).name


SERVE = """
import io, json, pickle, sys, warnings
warnings.simplefilter("ignore")
import mlflow
import pandas as pd

def refused(*_, **__):
    raise AssertionError("something is unpickled")

pickle.load = pickle.loads = pickle.Unpickler = refused
mlflow.set_tracking_uri(sys.argv[1])
loaded = mlflow.pyfunc.load_model("models:/inlet-valve-to-outlet@candidate")
table = pd.read_csv(sys.argv[2], index_col="t [s]").drop(columns="outlet [kPa]")
table.columns = ["inlet [kPa gauge]", "valve [V]"]
whole = loaded.predict(table, params={"outlet_at_rest": 120.0})
half = loaded.predict(table[:150], params={"outlet_at_rest": 120.0})
rest = loaded.predict(table[150:], params={"state": half.attrs["state"]})
assert pd.concat([half, rest]).equals(whole)
assert whole.index.equals(table.index)
ours = [name for name in sys.modules if name.split(".")[0] == "sysid"]
signature = loaded.metadata.signature
print(json.dumps({
    "columns": list(whole.columns), "outlet": whole["outlet [kPa gauge]"].tolist(), "ours": ours,
    "inputs": signature.inputs.input_names(), "outputs": signature.outputs.input_names(),
    "params": [one.name for one in signature.params.params], "metadata": loaded.metadata.metadata,
}))
"""


def test_the_registered_model_takes_and_gives_tables_where_the_workbench_is_not(tracked_once) -> None:
    workspace, _, _ = tracked_once
    record = workspace / "datasets" / "rig" / "run-3.csv"
    command = [sys.executable, "-c", SERVE, store_uri(workspace), str(record)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["ours"] == []
    assert told["inputs"] == ["inlet [kPa gauge]", "valve [V]"]
    assert told["outputs"] == told["columns"] == ["outlet [kPa gauge]", "flags"]
    assert told["params"] == ["state", "outlet_at_rest"]
    assert told["metadata"]["sample_time_s"] == 0.05
    assert told["metadata"]["mapping"] == "inlet+valve -> outlet"
    u = np.loadtxt(record, delimiter=",", skiprows=1)[:, 1:3]
    model = read_bundle(workspace / "run" / "bundle").model.single
    expected = model.simulate(u, History.at_rest(inputs=u[0], output=120.0))
    np.testing.assert_allclose(told["outlet"], expected, rtol=0.0, atol=1e-9)


def test_what_is_tracked_already_is_not_tracked_twice(tracked_once) -> None:
    workspace, client, _ = tracked_once
    before = {name: run.info.run_id for name, run in runs_of(client).items()}
    tracker, _ = track(workspace)
    assert tracker.failures == []
    experiment = client.get_experiment_by_name("inlet+valve -> outlet")
    assert len(client.search_runs([experiment.experiment_id])) == len(before)
    assert latest_experiment(store_uri(workspace)) == experiment.experiment_id


@pytest.mark.parametrize("status", ["RUNNING", "KILLED", "FAILED"])
def test_what_a_kill_left_half_logged_makes_way_for_one_whole_run(tracked_once, status: str) -> None:
    workspace, client, _ = tracked_once
    run = runs_of(client)["ARX"]
    client.update_run(run.info.run_id, status=status)
    track(workspace)
    experiment = client.get_experiment_by_name("inlet+valve -> outlet")
    twins = client.search_runs(
        [experiment.experiment_id], filter_string=f"tags.`{KEY_TAG}` = '{run.data.tags[KEY_TAG]}'"
    )
    assert [twin.info.status for twin in twins] == ["FINISHED"]
    assert twins[0].info.run_id != run.info.run_id


def test_a_deleted_experiment_comes_back(tracked_once) -> None:
    workspace, client, _ = tracked_once
    experiment = client.get_experiment_by_name("inlet+valve -> outlet")
    client.delete_experiment(experiment.experiment_id)
    tracker, _ = track(workspace)
    assert tracker.failures == []
    assert client.get_experiment(experiment.experiment_id).lifecycle_stage == "active"


@pytest.mark.parametrize("step", ["connect", "pictures"])
def test_a_failing_store_costs_no_fit(
    workspace: Path, empty_store: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    shutil.copyfile(empty_store, workspace / "mlflow.db")

    def fail(*_: object) -> object:
        raise OSError("the disk is full")

    monkeypatch.setattr(tracking if step == "connect" else tracked, step, fail)
    tracker, results = track(workspace)
    assert len(results.fits) == 3
    assert (workspace / "run" / "report" / "index.html").is_file()
    assert tracker.failures
    assert all("the disk is full" in text for text in tracker.failures)


def load_onnx(workspace: Path, uri: str):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # MLflow's own deprecations
        import mlflow

        mlflow.set_tracking_uri(store_uri(workspace))
        return mlflow.onnx.load_model(uri)


def test_the_exported_model_is_the_newest_version_and_the_candidate(tracked_once) -> None:
    workspace, client, results = tracked_once
    model = client.get_registered_model("inlet-valve-to-outlet")
    assert set(model.aliases) == {"candidate"}
    version = client.get_model_version(model.name, str(model.aliases["candidate"]))
    assert version.run_id == runs_of(client)[results.best.name].info.run_id
    assert version.tags["fit"] == results.best.name
    best = results.best_fit
    said = version.description.replace("\\", "")  # of Markdown
    assert best.label in said and f"{best.n_parameters} parameters" in said
    assert (
        f"Fitted on data set {results.data.name} by sysid run" in said or "Fitted to its own free run on data" in said
    )
    worst = min(case.free_run.nrmse_fit for case in best.cases.values() if case.role != "estimation")
    assert f"cases that it was not fitted to: {worst:.4g} " in said
    graph = load_onnx(workspace, "models:/inlet-valve-to-outlet@candidate").graph
    assert [value.name for value in graph.output] == ["y", "state_out", "flags"]


def test_a_promoted_model_is_loaded_as_the_champion(tracked_once, capsys: pytest.CaptureFixture[str]) -> None:
    workspace, client, results = tracked_once
    name = "inlet-valve-to-outlet"
    (first,) = client.search_model_versions(f"name = '{name}'")
    second = registry.register(
        client,
        "inlet+valve -> outlet",
        source=first.source,
        run_id=first.run_id,
        model_id=getattr(first, "model_id", None),
        fit="again",
    )
    assert str(client.get_registered_model(name).aliases["candidate"]) == second
    assert run_cli(["promote", "inlet+valve -> outlet", "--version", first.version]) == 0
    assert f"version {first.version} ({results.best.name}) is the champion." in capsys.readouterr().out
    assert run_cli(["promote", name]) == 0
    assert f"version {second} (again) is the champion, in place of version {first.version}" in capsys.readouterr().out
    assert str(client.get_model_version_by_alias(name, "champion").version) == second
    run = client.get_run(first.run_id)
    for who in ("first", run.data.tags["pipeline_run"], first.run_id):
        assert run_cli(["promote", who, "--version", first.version]) == 0
        assert run_cli(["promote", who]) == 0
        assert str(client.get_model_version_by_alias(name, "champion").version) == second
    assert load_onnx(workspace, f"models:/{name}@champion").graph.node


@pytest.mark.parametrize(
    ("words", "match"),
    [
        (["outlet"], r"(?s)no such model in the registry.*one of inlet-valve-to-outlet.*got:\s+outlet"),
        (["inlet-valve-to-outlet", "--version", "99"], r"(?s)has no such version.*one of 1.*got:\s+99"),
    ],
    ids=["unknown model", "unknown version"],
)
def test_what_cannot_be_promoted_is_refused(tracked_once, capsys: pytest.CaptureFixture[str], words, match) -> None:
    assert run_cli(["promote", *words]) == 2
    assert re.search(match, capsys.readouterr().err)
