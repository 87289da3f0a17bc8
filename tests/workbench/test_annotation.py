"""Annotators: states along traces, figures state by state, and samples that weigh by their state."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ConfigError, TraceError
from sysid.estimation.records.experiment import Experiment
from sysid.ingest import load_dataset
from sysid.models import Mapping, Start
from sysid.reporting.results import read_results
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.validation import CaseResult, Evaluation
from sysid.validation.metrics import figures
from sysid.workbench.annotation import annotated_set, by_state, find_annotator, weighted
from sysid.workbench.cli import run_cli
from sysid.workbench.fits.config import Pipeline, PipelineConfig
from sysid.workbench.fits.record import read_scores
from sysid.workbench.fits.run import program_of
from sysid.workbench.runner.program import carry_out

U = Channel(name="u", unit="V")
TRAIN = """\
name: train
sample_time: 0.1
channels:
  - {name: STP, unit: psi, reference: gauge}
  - {name: BP, unit: psi, reference: gauge}
  - {name: ER, unit: psi, reference: gauge}
  - {name: AR, unit: psi, reference: gauge}
  - {name: BC, unit: psi, reference: gauge}
source:
  generator: abdx
  options:
    variant: physical
    pairs: 4
    quantities: {STP: command, BP: {pipe: 3}, ER: {emergency: 3}, AR: {auxiliary: 3}, BC: {cylinder: 3}}
cases:
  EST01:
    role: estimation
    recipe: {time_unit: s, command: [[0, 90], [10, 74], [30, 90], [60, 0], [105, 90], [200, 90]]}
  VAL05:
    role: validation
    recipe: {time_unit: s, command: [[0, 90], [15, 0], [60, 90], [180, 90]]}
"""
BRAKE = """\
name: brake
data: train
mapping: BP -> BC
rest: {BC: 0}
fits: [{name: ARX, structure: {kind: ARX, na: 1, nb: [2], nk: [0]}}]
export: null
annotate: {by: brake-states, weights: {emergency: 4}}
"""


class Halves:
    """Says low and high."""

    channel, labels = "HALF", ("low", "high", "never")

    def __call__(self, trace: Trace) -> Trace:
        half = (trace["u"] > 0.0).astype(np.float64)
        return Trace(
            name=trace.name,
            sample_time=trace.sample_time,
            channels=(*trace.channels, Channel(name=self.channel, unit="1")),
            values=np.column_stack([trace.values, half]),
            usable=trace.usable,
        )


def trace_set() -> TraceSet:
    values = np.array([[-1.0], [1.0], [1.0], [1.0]])
    return TraceSet(name="set", traces=(Trace(name="a", sample_time=1.0, channels=(U,), values=values),))


def test_figures_are_split_by_state_and_add_up() -> None:
    traces = annotated_set(trace_set(), Halves())
    target, output = np.zeros(4), np.array([2.0, 1.0, 1.0, 1.0])
    whole = figures(target, output, "V")
    case = CaseResult(
        case="a", role=Role.TEST, free_run=whole, one_step=whole, run_time_s=1.0, time=np.arange(4.0), target=target,
        simulated=output, predicted=output,
    )  # fmt: skip
    split = by_state(Evaluation(cases={"a": case}), traces, Halves()).cases["a"]
    assert split.by_state is not None
    assert {name: (one.mse, share) for name, (one, share) in split.by_state.items()} == {
        "low": (4.0, 0.25),
        "high": (1.0, 0.75),
    }
    assert sum(one.mse * share for one, share in split.by_state.values()) == whole.mse
    assert split.to_dict()["by_state"]["low"]["share"] == 0.25


def test_samples_weigh_by_their_state_and_one_on_average() -> None:
    trace = weighted(annotated_set(trace_set(), Halves())["a"], Halves(), {"low": 5.0})
    assert trace.weights is not None
    np.testing.assert_allclose(trace.weights, np.array([5.0, 1.0, 1.0, 1.0]) / 2.0)
    loss = Experiment.from_trace(trace, Mapping.parse("u -> HALF"), Start(), 0.0)
    np.testing.assert_array_equal(loss.weights, trace.weights)
    assert trace.digest != annotated_set(trace_set(), Halves())["a"].digest


@pytest.mark.parametrize("weights", [{"middle": 1.0}, {"low": -1.0}, {"low": 0.0, "high": 0.0}])
def test_weights_that_mean_nothing_are_refused(weights: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match=r"weights|no sample"):
        weighted(annotated_set(trace_set(), Halves())["a"], Halves(), weights)


@pytest.mark.parametrize("weights", [np.ones(3), np.array([1.0, 1.0, -1.0, 1.0]), np.full(4, np.nan)])
def test_weights_that_do_not_fit_a_trace_are_refused(weights: np.ndarray) -> None:
    with pytest.raises(TraceError, match="weights do not match"):
        Trace(name="a", sample_time=1.0, channels=(U,), values=np.zeros((4, 1)), weights=weights)


def test_a_misspelt_annotator_is_named() -> None:
    with pytest.raises(ConfigError, match="did you mean brake-states"):
        find_annotator("brake-state", where="here")


@pytest.fixture
def train(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A workspace with an emergency on a short train."""
    folder = tmp_path / "datasets" / "train"
    folder.mkdir(parents=True)
    (folder / "dataset.yaml").write_text(TRAIN, encoding="utf-8")
    monkeypatch.chdir(tmp_path)


@pytest.mark.usefixtures("train")
def test_a_pipeline_reports_by_state(tmp_path: Path) -> None:
    file = tmp_path / "brake.yaml"
    file.write_text(BRAKE, encoding="utf-8")
    carry_out(program_of(Pipeline.read(PipelineConfig, file)), tmp_path / "run", command="sysid run brake")
    case = read_results(tmp_path / "run").fits[0].cases["VAL05"]
    assert case.by_state is not None
    assert {"release", "emergency"} <= set(case.by_state)
    assert sum(one.share for one in case.by_state.values()) == pytest.approx(1.0)
    assert sum(one.share * one.mse for one in case.by_state.values()) == pytest.approx(case.free_run.mse)
    stored = read_scores(tmp_path / "run" / "fits" / "arx").evaluation.cases["VAL05"].by_state
    assert stored is not None
    assert {name: one.mse for name, (one, _) in stored.items()} == {n: one.mse for n, one in case.by_state.items()}
    assert "Error by state" in (tmp_path / "run" / "report" / "index.html").read_text(encoding="utf-8")


@pytest.mark.usefixtures("train", "quick_report")
def test_weights_move_the_error_to_where_they_are_small(tmp_path: Path) -> None:
    found = []
    for weight in (1, 50):
        file = tmp_path / "brake.yaml"
        file.write_text(BRAKE.replace("emergency: 4", f"emergency: {weight}"), encoding="utf-8")
        results = carry_out(
            program_of(Pipeline.read(PipelineConfig, file)), tmp_path / f"run{weight}", command="sysid run brake"
        )
        states = results.fits[0].cases["EST01"].by_state
        assert states is not None
        found.append(states)
    assert found[1]["emergency"].mse < found[0]["emergency"].mse
    assert found[1]["release"].mse > found[0]["release"].mse


@pytest.mark.usefixtures("train")
def test_a_data_set_is_annotated_from_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "states"
    assert run_cli(["ingest", "train", "--annotate", "brake-states", "--out", str(out)]) == 0
    assert "emergency" in capsys.readouterr().out
    traces = load_dataset(out / "dataset.yaml")
    assert set(np.unique(traces["VAL05"]["STATE"])) <= set(range(7))
    np.testing.assert_array_equal(traces["VAL05"]["BC"], load_dataset("train")["VAL05"]["BC"])
    assert run_cli(["ingest", "train", "--annotate", "brake-states", "--out", str(out)]) == 2


def test_a_file_alone_cannot_be_annotated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "a.csv"
    file.write_text("t [s],u [V]\n0,1\n1,1\n", encoding="utf-8")
    assert run_cli(["ingest", str(file), "--annotate", "brake-states"]) == 2
    assert "--propose" in capsys.readouterr().err
