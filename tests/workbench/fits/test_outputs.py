"""A pipeline of several outputs: one fit, one table row an output and the whole, one bundle."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose

import sysid
from sysid.errors import ConfigError
from sysid.export import read_bundle
from sysid.field_checks import check
from sysid.models import model_from_dict
from sysid.reporting.results import Results, read_results
from sysid.reporting.sections.training import RELATIVE, error_unit, trained_models
from sysid.workbench.cli import run_cli
from sysid.workbench.fits import table
from sysid.workbench.fits.config import Pipeline
from sysid.workbench.fits.record import _labels, read_fit
from sysid.workbench.fits.run import program_of
from sysid.workbench.fits.table import table_of_fits
from sysid.workbench.runner import events
from sysid.workbench.runner.program import carry_out
from sysid.workbench.sweep.config import SweepConfig
from sysid.workbench.sweep.run import Sweep
from sysid.workbench.sweep.run import program_of as program_of_sweep
from sysid.workbench.sweep.workers import InThisProcess
from tests.workbench.pipelines import parse_pipeline

DATASET = """\
name: tanks
sample_time: 0.5
channels: [{name: u, unit: V}, {name: w, unit: V}, {name: level, unit: cm}, {name: heat, unit: K}]
source: {files: {}}
cases:
  run-1: {role: estimation, file: run-1.csv}
  run-2: {role: selection, file: run-2.csv}
  run-3: {role: validation, file: run-3.csv}
"""
PIPELINE = """\
name: both
data: tanks
mapping: u+w -> level+heat
start: rest
rest: {heat: 1.0}
stability: {count: 5}
orders: {max_na: 2, max_nb: 2, max_nk: 1, criterion: BIC, structures: [SS], most: 2}
fits:
  - {name: ARX, structure: {kind: ARX, na: 1, nb: [1, 1], nk: [1, 1]}}
  - name: alone
    structure: {kind: NARX, input_delays: 1, output_delays: 1, neurons: 1}
    training: {max_iterations: 3, workers: 1}
    initial: ARX
  - name: whole
    structure: {kind: VectorNARX, input_delays: 1, output_delays: 1, neurons: 1}
    training: {max_iterations: 3, workers: 1}
  - name: further
    structure: {kind: VectorNARX, input_delays: 1, output_delays: 1, neurons: 1}
    training: {max_iterations: 2, workers: 1}
    initial: whole
export: {fit: best, formats: [onnx]}
"""


def fill(folder: Path) -> None:
    """Two outputs that act on each other."""
    data = folder / "datasets" / "tanks"
    data.mkdir(parents=True)
    (data / "dataset.yaml").write_text(DATASET, encoding="utf-8")
    for seed in (1, 2, 3):
        rng = np.random.default_rng(seed)
        u, w = (np.repeat(rng.choice([-1.0, 0.5, 1.0], 10), 20) for _ in range(2))
        level, heat = np.zeros(200), np.ones(200)
        for t in range(199):
            level[t + 1] = 0.9 * level[t] + 2.0 * u[t]
            heat[t + 1] = 0.8 * heat[t] + 0.2 + 0.01 * level[t] * w[t] + 0.03 * w[t]
        rows = np.column_stack([0.5 * np.arange(200), u, w, level, heat])
        header = "t [s],u [V],w [V],level [cm],heat [K]"
        np.savetxt(data / f"run-{seed}.csv", rows, delimiter=",", header=header, comments="", fmt="%.17g")


def run(folder: Path, text: str = PIPELINE, watch: list[events.Event] | None = None) -> Results:
    pipeline = Pipeline(config=parse_pipeline(text), text=text, path=folder / "pipelines" / "both.yaml")
    heard = [] if watch is None else [watch.append]
    return carry_out(program_of(pipeline), folder / "runs" / "both", command="sysid run both", watchers=heard)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tanks")
    fill(folder)
    run(folder)
    return folder


@pytest.fixture(scope="module")
def results(place: Path) -> Results:
    return read_results(place / "runs" / "both")


def test_each_output_of_each_fit_has_a_record(results: Results) -> None:
    assert [(fit.name, fit.mapping, fit.unit) for fit in results.fits] == [
        (f"{name}, {output}", f"u+w -> {output}", unit)
        for name in ("ARX", "alone", "whole", "further")
        for output, unit in (("level", "cm"), ("heat", "K"))
    ]
    assert {fit.initial for fit in results.fits if fit.system == "alone"} == {"ARX, level", "ARX, heat"}
    assert len(results.mappings()) == 2


@pytest.mark.parametrize(("fit", "outputs"), [("ARX", ["level", "heat"]), ("ARX, heat", ["heat"])])
def test_a_fit_of_one_model_an_output_is_exported_as_a_whole_and_by_output(
    place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fit: str, outputs: list[str]
) -> None:
    monkeypatch.chdir(place)
    (place / "pipelines").mkdir(exist_ok=True)
    (place / "pipelines" / "both.yaml").write_text(PIPELINE, encoding="utf-8")
    assert run_cli(["export", "both", "--fit", fit, "--out", str(tmp_path / "bundle")]) == 0
    assert [one["name"] for one in read_bundle(tmp_path / "bundle").metadata["outputs"]] == outputs


def test_the_whole_is_told_beside_its_outputs(results: Results) -> None:
    by_name = {one.name: one for one in results.systems}
    assert {name: one.models for name, one in by_name.items()} == {"ARX": 2, "alone": 2, "whole": 1, "further": 1}
    fits = {fit.name: fit for fit in results.fits}
    arx = by_name["ARX"]
    assert arx.n_parameters == sum(fits[name].n_parameters or 0 for name in arx.fits.values())
    both = [fits[name].cases["run-3"].free_run.nrmse_fit for name in arx.fits.values()]
    assert arx.cases["run-3"].mean_fit == pytest.approx(np.mean(both))


def test_the_structure_of_a_whole_is_that_of_all_its_models() -> None:
    """Of two transfer functions with dead times of their own the first alone was said to be that of both."""
    assert _labels(["ARX [1; 1; 1]"]) == "ARX [1; 1; 1]"
    assert _labels(["TF [1; 0; 1]", "TF [1; 0; 7]"]) == "TF [1; 0; 1] and TF [1; 0; 7]"
    assert _labels(["TF [1; 0; 1]", "TF [1; 0; 7]", "TF [1; 0; 3]"]) == "TF [1; 0; 1] and 2 others"


def test_the_screen_has_the_whole_below_its_outputs(results: Results) -> None:
    cells = list(table_of_fits(results).columns[0].cells)
    assert cells[:3] == ["ARX, level", "ARX, heat", "ARX"]
    run_3 = list(table_of_fits(results).columns[3 + list(results.data.cases).index("run-3")].cells)
    assert run_3[2] == f"{results.systems[0].cases['run-3'].mean_fit:.2f} %"


def test_more_cases_than_a_screen_has_room_for_are_their_roles_medians(
    results: Results, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(table, "MOST", 2)
    assert len(results.data.cases) == 3
    found = table_of_fits(results)
    estimation = [name for name, case in results.data.cases.items() if case.role.value == "estimation"]
    head = estimation[0] if len(estimation) == 1 else f"median of {len(estimation)}"
    assert str(found.columns[3].header) == f"{head}\nestimation"
    mses = [results.fits[0].cases[name].free_run.mse for name in estimation]
    assert next(iter(found.columns[3].cells)) == f"{np.median(mses):.3e}"


def test_the_training_of_one_model_is_told_once_and_its_errors_have_no_single_unit(results: Results) -> None:
    told = trained_models(results)
    assert [fit.name for fit in told] == ["ARX, level", "ARX, heat", "alone, level", "alone, heat", "whole", "further"]
    assert [error_unit(fit) for fit in told] == ["cm²", "K²", "cm²", "K²", RELATIVE, RELATIVE]


def test_whether_linear_is_enough_is_said_of_each_output(results: Results) -> None:
    assert results.linearity is not None
    assert {row.output for row in results.linearity.rows} == {"level", "heat"}


def test_a_structure_with_several_outputs_is_stored_once(place: Path, results: Results) -> None:
    folders = {fit.system: fit.model_slug for fit in results.fits if fit.system in {"whole", "further"}}
    assert folders == {"whole": "whole", "further": "further"}
    model = read_fit(place / "runs" / "both" / "fits" / "whole").model
    assert model.mapping.outputs == ("level", "heat")
    assert model.ends.rest_outputs[1] == 1.0


def test_what_is_chosen_is_chosen_and_exported_as_a_whole(place: Path, results: Results) -> None:
    assert results.best is not None
    assert "outputs" in results.best.chosen_by
    chosen = results.best_fits
    assert [fit.mapping for fit in chosen] == ["u+w -> level", "u+w -> heat"]
    bundle = read_bundle(place / "runs" / "both" / "bundle")
    assert [one["name"] for one in bundle.outputs] == ["level", "heat"]
    u = np.random.default_rng(5).normal(size=(30, 2))
    models = {fit.model_slug: read_fit(place / "runs" / "both" / "fits" / fit.model_slug).model for fit in chosen}
    alone = [model_from_dict(model.to_dict()).simulate(u).reshape(30, -1) for model in models.values()]
    assert_allclose(bundle.simulate(u, warn=False), np.column_stack(alone), rtol=1e-9, atol=1e-9)


def test_orders_are_searched_for_every_output(results: Results) -> None:
    level, heat = results.orders
    assert (level.mapping, heat.mapping) == ("u+w -> level", "u+w -> heat")
    assert (level.best["kind"], level.best["nk"][0]) == ("ARX", 1)  # without noise the other orders are rounding's
    assert level.chosen_by == "least BIC"
    assert level.curve.candidates == 2 * (2 * 2) ** 2
    assert {choice[0] for choice in level.curve.choices} == {"BIC", "AIC", "AICc"}
    assert level.label in {row.label for row in level.rows}


def test_the_report_has_the_whole_and_every_output(place: Path, results: Results) -> None:
    page = (place / "runs" / "both" / "report" / "index.html").read_text(encoding="utf-8")
    assert results.best_name in page
    anchors = re.findall(r'<section[^>]* id="([^"]+)"', page)
    assert len(anchors) == len(set(anchors))
    assert {"best", "best-2", "orders"} <= set(anchors)
    ids = re.findall(r' id="([^"]+)"', page)
    assert len(ids) == len(set(ids))


def test_a_second_run_does_nothing_again(place: Path) -> None:
    heard: list[events.Event] = []
    run(place, watch=heard)
    bundles = [event for event in heard if isinstance(event, events.BundleReady)]
    assert [(event.of.output, event.mapping, event.told) for event in bundles] == [
        ("level", "u+w -> level+heat", False),
        ("heat", "u+w -> level+heat", True),
    ]
    steps = [event for event in heard if isinstance(event, events.StepDone)]
    assert len(steps) > 10
    assert [event.step for event in steps if not event.stored and "Loading" not in event.step] == []


SWEPT = [
    {"kind": "ARX", "na": {"from": 1, "to": 2}, "nb": [1, 1], "nk": [1, 1]},
    {"kind": "VectorNARX", "input_delays": 1, "output_delays": 1, "neurons": 1},
]


def test_a_sweep_tries_all_outputs_of_a_point(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sysid.reporting.report.write_report", lambda folder: folder / "results.json")
    fields = {
        "kind": "sweep", "name": "swept", "data": "tanks", "mapping": "u+w -> level+heat", "start": "rest",
        "structure": SWEPT, "training": {"max_iterations": 2}, "export": None, "stability": {"count": 0},
    }  # fmt: skip
    sweep = Sweep(config=check(SweepConfig, fields, where="here"), text="", path=place / "pipelines" / "swept.yaml")
    found = carry_out(
        program_of_sweep(sweep, find_workers=lambda bench, _: InThisProcess(bench)),
        place / "runs" / "swept",
        command="",
    )
    assert [trial.label.split()[0] for trial in found.record.trials] == ["ARX", "ARX", "VectorNARX"]
    assert all(trial.usable for trial in found.record.trials), [trial.reason for trial in found.record.trials]
    # Errors count over the variances of their outputs: neither centimetres nor kelvins rule.
    best, chosen = found.record.trials[found.record.winner - 1], found.results.best_fits
    trace = sysid.load(place / "datasets" / "tanks" / "dataset.yaml")["run-2"]
    shares = [fit.selection_mse / trace[fit.mapping.split(" -> ")[1]].var() for fit in chosen]
    assert best.selection_free_run_mse == pytest.approx(np.mean(shares))
    assert [fit.mapping for fit in found.results.best_fits] == ["u+w -> level", "u+w -> heat"]
    assert found.results.systems[0].name == "sweep winner"


def test_a_state_space_of_several_outputs_is_one_through_every_door(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sysid.reporting.report.write_report", lambda folder: folder / "results.json")
    structure = {"kind": "SS", "states": 2}
    shared = {"data": "tanks", "mapping": "u+w -> level+heat", "export": None, "stability": {"count": 0}}
    fits = {"name": "both", **shared, "fits": [{"name": "SS", "structure": structure}]}
    text = yaml.safe_dump(fits)
    pipeline = Pipeline(config=parse_pipeline(text), text=text, path=place / "pipelines" / "ss.yaml")
    carry_out(program_of(pipeline), place / "runs" / "ss", command="")
    swept = {"kind": "sweep", "name": "swept", **shared, "structure": structure}
    sweep = Sweep(config=check(SweepConfig, swept, where="here"), text="", path=place / "pipelines" / "swept-ss.yaml")
    carry_out(
        program_of_sweep(sweep, find_workers=lambda bench, _: InThisProcess(bench)),
        place / "runs" / "swept-ss",
        command="",
    )
    traces = sysid.load(place / "datasets" / "tanks" / "dataset.yaml")
    python = sysid.fit(traces, "u+w -> level+heat", sysid.LinearStateSpace(states=2))
    assert isinstance(python, sysid.Fit)
    assert python.model.structure == sysid.VectorStateSpace(states=2)
    for stored in (place / "runs" / "ss" / "fits" / "ss", place / "runs" / "swept-ss" / "fits" / "sweep-winner"):
        assert read_fit(stored).model.to_dict() == python.model.to_dict()


WRONG = {
    "rest of an input": ("rest: {heat: 1.0}", "rest: {heat: 1.0, u: 0}", "not an output"),
    "lags of three outputs": ("output_delays: 1", "output_delays: [[1], [1], [1]]", "not match|not a set of lags"),
    "an initial fit that comes later": ("initial: ARX", "initial: whole", "not an earlier fit"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_does_not_go_together_is_refused(case: str) -> None:
    old, new, match = WRONG[case]
    assert old in PIPELINE
    with pytest.raises(ConfigError, match=match):
        parse_pipeline(PIPELINE.replace(old, new))
