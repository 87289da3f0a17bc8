"""``mean`` of a pipeline: the mean of several wholes answers, by what the library makes of the same, at every door."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from typer.testing import CliRunner

from sysid.composite import Doubt, committee, doubt_figures, doubting
from sysid.errors import BundleError, ConfigError
from sysid.export import read_bundle
from sysid.ingest import load_dataset
from sysid.models import Cascade
from sysid.validation import evaluate_cascade
from sysid.workbench.assembly.runner import read_assembly, read_interpolation
from sysid.workbench.cli import app
from sysid.yaml_files import parse_yaml, yaml_text
from tests.workbench.assembly.conftest import assembly_results, write_tanks
from tests.workbench.assembly.test_warm_start import FIRST, KNOWN, first_whole, run, trained  # noqa: F401

MEAN = "mean: {beside: [../runs/tanks/bundle], spread: [lower]}\n"
DOUBT = "doubt: {output: lower, error: 0.05, data: calm}\n"
UNSEEN = (
    FIRST.replace("name: tanks", "name: further", 1)
    .replace("seed: 3", "seed: 4")
    .replace("monte_carlo: {data: tanks", "monte_carlo: {data: other")
)


def as_json(whole: Cascade) -> object:
    return json.loads(json.dumps(whole.to_dict()))


@pytest.fixture(scope="module")
def two_wholes(tmp_path_factory: pytest.TempPathFactory, first_whole: Path) -> Path:  # noqa: F811
    """A workspace in which a second whole was trained too, and data that trained neither."""
    folder = tmp_path_factory.mktemp("second")
    shutil.copytree(first_whole, folder, dirs_exist_ok=True)
    write_tanks(folder / "datasets" / "calm", seed=50)
    write_tanks(folder / "datasets" / "other", seed=80)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        run(folder, "plain", UNSEEN.replace("name: further", "name: plain"))
    return folder


@pytest.fixture
def both(workspace: Path, two_wholes: Path) -> dict[str, Path]:
    """The run folders of the two."""
    shutil.copytree(two_wholes, workspace, dirs_exist_ok=True)
    # What trains the second again is found.
    shutil.copytree(workspace / "runs" / "plain", workspace / "runs" / "further")
    return {name: workspace / "runs" / name for name in ("tanks", "plain")}


@pytest.fixture
def by_hand(both: dict[str, Path]) -> Cascade:
    """What the library makes of the two."""
    wholes = [read_assembly(both["plain"]), read_assembly(both["tanks"])]
    return committee(wholes, mean=["upper", "lower"])


def test_a_run_scores_reports_and_exports_the_mean(workspace: Path, both: dict[str, Path], by_hand: Cascade) -> None:
    folder = run(workspace, "further", UNSEEN + MEAN)
    kept = by_hand.upstream_of(["upper", "lower", "lower_spread"])
    bundle, results = read_bundle(folder / "bundle"), assembly_results(folder)
    assert as_json(read_assembly(folder)) == as_json(bundle.model) == as_json(kept)
    assert [one["name"] for one in bundle.outputs] == ["upper", "lower", "lower_spread"]
    alone = {name: assembly_results(place) for name, place in both.items()}
    stages = {stage.name: stage for stage in results.stages}
    assert results.whole.stage == "the mean of 2"
    assert results.mean == [alone["plain"].whole.stage, "tanks"]
    assert stages["tanks"].mse == alone["tanks"].chosen.mse
    assert stages[alone["plain"].whole.stage].mse == alone["plain"].chosen.mse
    scored = evaluate_cascade(by_hand, load_dataset("tanks"))
    assert stages["the mean of 2"].mse["lower"] == scored.mse("lower")
    assert stages["tanks"].selection == alone["tanks"].chosen.selection
    assert results.monte_carlo is not None
    errors = [
        np.sqrt(np.mean((by_hand.simulate_trace(one)["lower"] - one["lower"]) ** 2)) for one in load_dataset("other")
    ]
    assert results.monte_carlo.worst[0].rmse == max(errors)
    assert {one.output for one in results.limits} == {"lower_1", "lower_2"}  # what holds it, and how often
    page = (folder / "report" / "index.html").read_text(encoding="utf-8")
    assert "the mean of 2 (chosen)" in page
    assert "The mean answers, as the pipeline says." in page
    card = (folder / "bundle" / "MODEL_CARD.md").read_text(encoding="utf-8")
    assert "The mean of 2 wholes answers: of this one and of tanks (../runs/tanks/bundle, " in card
    assert max(one.largest_difference for one in bundle.files) < 1e-9


def test_its_spread_doubts_and_what_that_is_worth_is_told(
    workspace: Path, both: dict[str, Path], by_hand: Cascade
) -> None:
    folder = run(workspace, "further", UNSEEN + MEAN + DOUBT)
    wholes = [read_assembly(both["plain"]), read_assembly(both["tanks"])]
    found = doubting(
        wholes[0], Doubt(output="lower", error=0.05), tuple(load_dataset("calm")), beside=wholes[1:],
        mean=["upper", "lower"],
    )  # fmt: skip
    model = read_bundle(folder / "bundle").model
    kept = found.whole.upstream_of(["upper", "lower", "lower_spread", "lower_apart"])
    assert as_json(model) == as_json(kept)
    results = assembly_results(folder)
    assert results.doubt is not None
    assert results.doubt.sentence == found.sentence
    assert "in doubt from a spread of" in found.sentence
    assert found.sentence in (folder / "bundle" / "MODEL_CARD.md").read_text(encoding="utf-8")
    assert [one.data for one in results.doubt.on] == ["calm", "tanks", "other"]
    for one in results.doubt.on:
        figures = doubt_figures(found.whole, tuple(load_dataset(one.data)), "lower", error=0.05)
        assert (one.samples, one.wrong, one.flagged, one.false) == (
            figures.samples, figures.wrong, figures.flagged, figures.false,
        )  # fmt: skip
        assert results.metrics()["the mean of 2"][f"lower/{one.data}/in doubt"] == one.flagged
    assert "Of the others in doubt" in (folder / "report" / "index.html").read_text(encoding="utf-8")
    assert by_hand.outputs


def test_by_command_a_bundle_has_the_mean_that_a_pipeline_gives_it(workspace: Path, both: dict[str, Path]) -> None:
    made = read_bundle(run(workspace, "further", UNSEEN + MEAN + DOUBT) / "bundle")
    asked = ["export", str(both["plain"] / "bundle")]
    for name, text in (("mean", MEAN), ("doubt", DOUBT)):
        file = workspace / "pipelines" / f"{name}.yaml"
        file.write_text(yaml_text(parse_yaml(text, where="")[name]), encoding="utf-8")
        asked += [f"--{name}", str(file)]
    told = CliRunner().invoke(app, asked)
    assert told.exit_code == 0, told.output
    found = read_bundle(both["plain"] / "bundle-mean")
    assert as_json(found.model) == as_json(made.model)
    same = ("structure", "stages", "model", "n_parameters", "state", "outputs", "inputs", "initialisation")
    for name in same:
        assert found.metadata[name] == made.metadata[name], name
    for case, figures in made.metadata["metrics"].items():
        assert found.metadata["metrics"][case]["outputs"] == figures["outputs"]
    assert found.metadata["provenance"]["doubt"] == made.metadata["provenance"]["doubt"]
    assert "The mean of 2 wholes answers: of plain (" in found.metadata["provenance"]["mean"]


def test_a_result_of_a_run_is_exported_as_the_mean_that_it_is(workspace: Path, both: dict[str, Path]) -> None:
    folder = run(workspace, "further", UNSEEN + MEAN)
    told = CliRunner().invoke(app, ["export", "further", "--fit", "assembly", "--out", str(workspace / "again")])
    assert told.exit_code == 0, told.output
    again, made = read_bundle(workspace / "again"), read_bundle(folder / "bundle")
    assert as_json(again.model) == as_json(made.model)
    assert again.metadata["outputs"] == made.metadata["outputs"]
    assert both


def test_the_mean_of_seeds_is_that_of_runs_with_these_seeds(workspace: Path, both: dict[str, Path]) -> None:
    text = UNSEEN.replace("seed: 4", "seed: 3") + "mean: {seeds: [4]}\n"
    (workspace / "pipelines" / "further.yaml").write_text(text, encoding="utf-8")
    shutil.rmtree(workspace / "runs" / "further")
    told = CliRunner().invoke(app, ["run", "further", "--dry-run"])
    assert told.exit_code == 0, told.output
    assert "Training end to end, seed 4" in " ".join(told.output.split())
    folder = run(workspace, "further", text)
    wholes = [read_assembly(both[name]) for name in ("tanks", "plain")]
    by_hand = committee(wholes, mean=["upper", "lower"]).upstream_of(["upper", "lower"])
    assert as_json(read_assembly(folder)) == as_json(by_hand)
    assert assembly_results(folder).mean[1] == "seed 4"
    stored = folder / "together-seed-4.json"
    stamp = stored.stat().st_mtime_ns
    run(workspace, "further", text)
    assert stored.stat().st_mtime_ns == stamp
    named = ["export", "further", "--fit", "upper -> lower 0, seed 4", "--out", str(workspace / "member")]
    told = CliRunner().invoke(app, named)
    assert told.exit_code == 0, told.output
    assert read_bundle(workspace / "member").model.mapping.output == "lower"


LINE = """\
fixed: [{mapping: upper -> LH, gains: {upper: 0.9}, low: 0, high: 1, rest: 0}]
interpolation: {channel: upper, knots: {upper: 1, lower: 9}, outputs: [upper, LH], data: places}
mean: {seeds: [4], spread: [LH]}
"""


def write_places(folder: Path) -> None:
    """The tanks as a line: what stands at three positions."""
    write_tanks(folder)
    file, columns = folder / "dataset.yaml", {"upper1": 2, "upper9": 3, "LH1": 2, "LH4": 2, "LH9": 3}
    for case in folder.glob("*.csv"):
        values = np.loadtxt(case, delimiter=",", skiprows=1)
        header = ",".join(["time [s]", "pump [cm]", *(f"{name} [cm]" for name in columns)])
        rows = np.column_stack([values[:, :2], values[:, list(columns.values())]])
        np.savetxt(case, rows, delimiter=",", header=header, comments="")
    head, rest = file.read_text(encoding="utf-8").split("channels:\n")
    channels = "\n".join(f"  - {{name: {name}, unit: cm}}" for name in ("pump", *columns))
    file.write_text(f"{head}channels:\n{channels}\nsource:{rest.split('source:')[1]}", encoding="utf-8")


def test_positions_between_have_the_mean_too_each_whole_behind_its_own_channel(workspace: Path) -> None:
    write_places(workspace / "datasets" / "places")
    folder = run(workspace, "tanks", FIRST + LINE)
    stored, bundle = read_interpolation(folder), read_bundle(folder / "bundle")
    assert [one.name for one in stored.outputs] == ["upper", "LH", "LH_spread"]
    pump = load_dataset("tanks")["V"]["pump"][:, None]
    run_there, whole = stored.line.simulate(pump, [1.0, 4.0, 9.0]), read_assembly(folder).simulate(pump)
    assert_allclose(run_there["upper"][0], whole["upper"], atol=1e-12)
    assert_allclose(run_there["upper"][2], whole["lower"], atol=1e-12)
    fields = [0.625 * whole[f"upper_{k}"] + 0.375 * whole[f"lower_{k}"] for k in (1, 2)]
    expected = [np.clip(0.9 * field, 0.0, 1.0) for field in fields]
    assert_allclose(run_there["LH"][1], np.mean(expected, axis=0), atol=1e-12)
    assert_allclose(run_there["LH_spread"][1], np.ptp(expected, axis=0), atol=1e-12)
    assert run_there["LH_spread"][1].max() > 1e-3
    scores = assembly_results(folder).interpolation
    assert scores is not None
    assert scores.outputs["LH"].positions == [1.0, 4.0, 9.0]
    error = run_there["upper"][0] - load_dataset("places")["V"]["upper1"]
    assert scores.outputs["upper"].mse["V"][0] == pytest.approx(np.mean(error**2))
    assert bundle.outputs
    words = ["simulate", "tanks", "--command", str(workspace / "command.json"), "--positions", "4", "--out", "line.csv"]
    rows = '{"command": [[0, 0], [5, 1.5], [60, 0.5], [90, 0.5]], "unit": "cm", "time_unit": "s"}'
    (workspace / "command.json").write_text(rows, encoding="utf-8")
    told = CliRunner().invoke(app, words)
    assert told.exit_code == 0, told.output
    assert "upper4" in Path("line.csv").read_text(encoding="utf-8").splitlines()[0]
    assert "LH_spread4" in Path("line.csv").read_text(encoding="utf-8").splitlines()[0]


def test_a_whole_beside_that_has_no_such_positions_is_refused_before_anything_is_trained(workspace: Path) -> None:
    """A mean of earlier wholes has the channel of each of them at a position, not the one that is asked for."""
    write_places(workspace / "datasets" / "places")
    first = run(workspace, "tanks", FIRST + LINE)
    text = FIRST.replace("name: tanks", "name: third", 1) + LINE.replace("seeds: [4]", f"beside: [{first / 'bundle'}]")
    with pytest.raises(ConfigError, match="cannot be had at a position") as told:
        run(workspace, "third", text)
    assert "mean, beside" in str(told.value)
    assert not list((workspace / "runs" / "third").rglob("fit.json"))


@pytest.mark.parametrize(
    ("changed", "complaint"),
    [
        (("beside: [../runs/tanks/bundle]", "beside: []"), "beside"),
        (("beside: [../runs/tanks/bundle]", "beside: [../runs/nobody]"), "nobody"),
        (("beside: [../runs/tanks/bundle]", "beside: [../pages/line]"), "a line cannot stand beside a whole"),
        (("beside: [../runs/tanks/bundle]", "beside: [../pages/line/line.json]"), "a line cannot stand beside a whole"),
        (("spread: [lower]", "seeds: [3]"), "seed 3 would train the same whole again"),
        (("spread: [lower]", "seeds: [5, 5]"), "no mean of several wholes"),
        (("spread: [lower]", "spread: [middle]"), "mean, spread names middle"),
        (("data: calm", "data: calm, beside: [../runs/tanks/bundle]"), "doubted by the spread"),
    ],
)
def test_what_cannot_be_averaged_is_said_before_anything_is_trained(
    workspace: Path,
    trained: Path,  # noqa: F811
    changed: tuple[str, str],
    complaint: str,
) -> None:
    write_tanks(workspace / "datasets" / "calm", seed=50)
    (workspace / "pages" / "line").mkdir(parents=True)
    (workspace / "pages" / "line" / "line.json").write_text("{}", encoding="utf-8")
    text = FIRST.replace("name: tanks", "name: third", 1) + MEAN + DOUBT
    assert changed[0] in text
    with pytest.raises((ConfigError, BundleError), match=complaint):
        run(workspace, "third", text.replace(*changed))
    assert not list((workspace / "runs" / "third").rglob("fit.json"))
    assert trained


@pytest.mark.usefixtures("trained")
def test_a_whole_of_another_question_is_named_with_what_was_expected(workspace: Path) -> None:
    write_tanks(workspace / "datasets" / "small")
    file = workspace / "datasets" / "small" / "dataset.yaml"
    file.write_text(file.read_text(encoding="utf-8").replace("unit: cm", "unit: mm"), encoding="utf-8")
    text = FIRST.replace("name: tanks", "name: third", 1).replace("data: tanks", "data: small") + MEAN + KNOWN
    text = text.replace("mapping: upper -> lower", "mapping: upper+LH -> lower")  # what is declared stands in no trace
    with pytest.raises(ConfigError) as told:
        run(workspace, "third", text.replace("training: tanks", "training: small"))
    said = str(told.value)
    assert "mean, beside: ../runs/tanks/bundle" in said
    assert "upper in mm" in said
    assert "upper in cm" in said
    assert "data set" in said
    assert not list((workspace / "runs" / "third").rglob("fit.json"))
