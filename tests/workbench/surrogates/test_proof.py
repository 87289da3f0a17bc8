"""A surrogate against its reference: a proof on what taught nothing, the same ports, and what has to be asked for."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import sysid
from sysid.errors import ConfigError
from sysid.export import Bundle
from sysid.field_checks import check
from sysid.models import Mapping, Start
from sysid.references.config import ReferenceConfig
from sysid.references.described import Wish
from sysid.references.design import Design, designed
from sysid.references.proposal import proposed
from sysid.references.sources import source_of
from sysid.reporting import report
from sysid.reporting.judging.document import judgement_points
from sysid.reporting.judging.results import FOLDER, JudgementRecord
from sysid.reporting.records import write_record
from sysid.reporting.report import write_report
from sysid.workbench.auto.families import Family, Try
from sysid.workbench.cli import run_cli
from sysid.workbench.experiments.config import ExperimentConfig
from sysid.workbench.experiments.run import Experimented, Experiments
from sysid.workbench.experiments.run import program_of as experiment_program
from sysid.workbench.runner.events import Event, StepDone, StepProgress
from sysid.workbench.runner.program import carry_out
from sysid.workbench.surrogates import work
from sysid.workbench.surrogates.asked import surrogate_of
from sysid.workbench.surrogates.plan import times
from sysid.workbench.surrogates.proof import Proof, _begun_until, fmu_of, prove
from sysid.workbench.surrogates.told import beginning_of, poor, restless, short_of_time, unlike, without_effect
from sysid.workbench.written import Written
from sysid.yaml_files import read_yaml

pytest.importorskip("fmpy")
MODELS = Path(__file__).parents[2] / "references"
REFERENCE = {
    **{"python": "slow_models:first_order", "folder": str(MODELS), "sample_time": 0.5},
    **{"inputs": {"u": {"unit": "V", "range": [0, 2], "start": 0}}, "outputs": {"y": {"unit": "V"}}},
}
DESIGN = {"duration": 40.0, "runs": {"estimation": 4, "selection": 0, "test": 0}}


@pytest.fixture(scope="module")
def proven(tmp_path_factory: pytest.TempPathFactory) -> tuple[Bundle, Proof, JudgementRecord]:
    """A lag of the first order, which a linear model is, on twelve new experiments."""
    folder = tmp_path_factory.mktemp("surrogate")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SYSID_CACHE", str(folder / "cache"))
        traces = sysid.experiment(REFERENCE, DESIGN, workers=1)
        fit = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=0), rest_output=0.0)
        bundle = sysid.save(fit, traces, folder / "bundle", formats=("fmi2",), start=Start())
        config, design = ReferenceConfig.model_validate(REFERENCE), Design.model_validate(DESIGN)
        return (bundle, *prove(bundle, config, design, traces, count=12, workers=1))


def test_every_new_experiment_is_within_the_tolerance_of_a_model_that_is_exact(
    proven: tuple[Bundle, Proof, JudgementRecord],
) -> None:
    _, proof, section = proven
    assert proof.errors.shape == (12, 1)
    assert proof.errors.max() < 1e-9
    assert (proof.share, proof.share_everywhere, proof.diverged, proof.failed) == (1.0, 1.0, 0, 0)
    assert len(section.scenes) == 3, "a tenth of them, but three at least"
    assert "Of 12 new random experiments" in section.method


def test_what_a_report_says_first_is_the_share_that_is_within(
    proven: tuple[Bundle, Proof, JudgementRecord], tmp_path: Path
) -> None:
    _, proof, record = proven
    (tmp_path / FOLDER).mkdir()
    write_record(tmp_path / FOLDER / "proof.json", record)
    assert judgement_points(tmp_path) == [("Proof", f"{proof.sentences()[0]}.")]
    assert f"{100.0 * proof.share:.1f} % are within" in record.told


def test_no_experiment_of_the_proof_has_taught(proven: tuple[Bundle, Proof, JudgementRecord]) -> None:
    config, design = ReferenceConfig.model_validate(REFERENCE), Design.model_validate(DESIGN)
    taught = {case.inputs.tobytes() for some in designed(config, design).values() for case in some}
    assert not taught & {one.case.inputs.tobytes() for one in proven[1].outcomes}


def test_the_fmu_runs_in_the_place_of_the_reference(proven: tuple[Bundle, Proof, JudgementRecord]) -> None:
    assert proven[1].dropped is not None
    assert proven[1].dropped < 1e-12


def test_what_an_fmu_does_not_say_is_asked_for_by_its_option(proven: tuple[Bundle, Proof, JudgementRecord]) -> None:
    file = fmu_of(proven[0])
    assert file is not None
    wish = Wish(ranges={"u": (0.0, 2.0)}, parameters={}, outputs=("y",), sample_time=0.5, duration=40.0)
    content = proposed(source_of(str(file)), wish).content
    assert (content["reference"]["inputs"]["u"]["unit"], content["experiment"]) == ("V", {"duration": 40.0})
    with pytest.raises(ConfigError, match="does not say all") as caught:
        proposed(source_of(str(file)), Wish(ranges={}, parameters={}, outputs=("y",)))
    assert caught.value.remedy == "say it: --duration SECONDS"  # a range is proposed, as a guess


def test_a_workspace_that_begins_with_an_fmu_runs(
    proven: tuple[Bundle, Proof, JudgementRecord], tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    file = fmu_of(proven[0])
    assert file is not None
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path / "cache"))
    begun = ["init", str(tmp_path / "ws"), "--reference", str(file), "--range", "u=0:2"]
    assert run_cli(begun) != 0
    assert "--duration SECONDS" in capsys.readouterr().err
    assert not (tmp_path / "ws").exists()
    begun += ["--duration", "40"]
    assert run_cli(begun) == 0
    (pipeline,) = (tmp_path / "ws" / "pipelines").glob("*.yaml")
    monkeypatch.chdir(tmp_path / "ws")
    assert f"sysid surrogate {pipeline.stem}" in Path("README.md").read_text(encoding="utf-8")
    assert run_cli(["run", pipeline.stem, "--dry-run"]) == 0
    assert "20 of 20 runs to make" in capsys.readouterr().out.replace("\n", " ")
    assert run_cli(begun) != 0


def test_a_workspace_begins_with_a_function_or_a_program_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "lag.py").write_text("def lag(time, inputs, parameters):\n    return inputs[:, 0]\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    said = ["--range", "u [V]=0:2", "--output", "y [bar gauge]", "--sample-time", "0.5", "--duration", "40"]
    for name, source in (("lag", "lag.py:lag"), ("python", "python -m lag {inputs} {outputs}")):
        assert run_cli(["init", name, "--reference", source, *said]) == 0
        pipeline = tmp_path / name / "pipelines" / f"{name}.yaml"
        config = check(ExperimentConfig, read_yaml(pipeline), where=pipeline)
        assert (config.reference.inputs["u"].unit, config.reference.outputs["y"].reference.value) == ("V", "gauge")
        assert Path(config.reference.at(pipeline.parent).folder) == tmp_path
    assert run_cli(["init", "lag", "--reference", "lag.py:lag", *said]) == 2, "it is there"
    Path("lag/README.md").unlink()  # as a call leaves it that is cut off
    assert run_cli(["init", "lag", "--reference", "lag.py:lag", *said]) == 0
    Path("lag/README.md").unlink()
    assert run_cli(["init", "lag", "--reference", "lag.py:lag", *said[:-1], "50"]) == 2, "another pipeline is there"


@pytest.mark.usefixtures("undrawn")
def test_the_page_of_a_search_is_made_once_and_has_the_proof(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its pictures take longer than all else after a short search."""
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path / "cache"))
    lag = Family(kind="ARX", linear=True, first=lambda _: [Try(structure=sysid.ARX(na=1, nb=(1,), nk=(0,)))])
    monkeypatch.setattr("sysid.workbench.auto.ledger.FAMILIES", (lag,))
    monkeypatch.setattr("sysid.workbench.auto.plan.suggested", lambda *_, **__: [])
    made_of: list[Path] = []
    monkeypatch.setattr(report, "write_report", lambda folder: made_of.append(folder) or write_report(folder))
    monkeypatch.setattr(work, "write_report", report.write_report)
    runs = {"estimation": 4, "selection": 2, "test": 1}
    content = {"kind": "experiment", "name": "lag", "workers": 1, "reference": REFERENCE}
    content["experiment"] = {"duration": 20.0, "runs": runs}
    (tmp_path / "lag.yaml").write_text(json.dumps(content), encoding="utf-8")
    told: list[Event] = []
    with monkeypatch.context() as patch:
        patch.setattr("sysid.workbench.surrogates.python.surrogate_of", partial(surrogate_of, watch=told.append))
        made = sysid.surrogate(tmp_path / "lag.yaml", tmp_path / "out", iterations=20, proof=4)
    # One step whose progress a terminal shows in a line, and of which a file has only the end.
    assert [type(one).__name__ for one in told] == ["StepStarted", *4 * ["StepProgress"], "StepDone"]
    assert isinstance(told[-2], StepProgress)
    assert told[-2].fraction == 1.0
    assert isinstance(told[-1], StepDone)
    assert told[-1].detail == "4 new experiments, 100.0 % within 1 % of the range"
    assert made.proof.errors.max() < 1e-9
    assert made_of == [tmp_path / "out" / "model"]
    assert "Of 4 new random experiments" in made.report.read_text(encoding="utf-8")
    # Of another proof the page that is there says nothing.
    more = sysid.surrogate(tmp_path / "lag.yaml", tmp_path / "out", iterations=20, proof=5)
    assert len(made_of) == 2
    assert "Of 5 new random experiments" in more.report.read_text(encoding="utf-8")


def test_a_proof_ends_with_its_time_and_says_what_gave_no_record(
    proven: tuple[Bundle, Proof, JudgementRecord], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path))
    monkeypatch.setattr("sysid.workbench.surrogates.proof.FEWEST", 6)
    config = ReferenceConfig.model_validate({**REFERENCE, "python": "slow_models:raises"})
    design = Design.model_validate({**DESIGN, "excitations": ["events"], "hold": [8, 8], "seed": 3})
    u = np.linspace(0.0, 1.0, 40)
    traces = sysid.data({"u": u, "y": u}, inputs="u", outputs="y", sample_time=0.5)
    proof, section = prove(proven[0], config, design, traces, count=1000, workers=1, until=time.monotonic())
    assert len(proof.errors) + proof.failed == 6
    assert f"of {proof.failed} more, where nobody knows how the surrogate does: it raised ValueError" in section.method


def test_a_proof_leaves_time_for_the_runs_of_the_surrogate(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]

    def run(*_: object) -> None:
        clock[0] += 0.5

    monkeypatch.setattr("sysid.workbench.surrogates.proof._run", run)
    monkeypatch.setattr("sysid.workbench.surrogates.proof.time", SimpleNamespace(monotonic=lambda: clock[0]))
    runs: Any = SimpleNamespace(config=None, workers=2, seconds_each=lambda: (1.0, ""))
    # Two references a second, and half a second of each surrogate: as long for these as for those.
    assert _begun_until(101.0, cast("Any", None), runs, cast("Any", None)) == 1.0 + 0.5 * 100.0


def test_what_takes_longer_than_was_asked_for_is_told(proven: tuple[Bundle, Proof, JudgementRecord]) -> None:
    plan = times(0.03, minutes=1.0, spent=5.0, experiments=40, workers=1, finish=30.0)
    short, over = short_of_time(proven[1], plan, 40, took=90.0)
    assert "of 12 experiments, not of 40, as the time was up" in short
    assert "it took 1.5 min, 30 s more than was asked for" in over
    asked = replace(plan, apart=True, proof=40.0)  # which took the rest
    assert len(short_of_time(proven[1], asked, 40, took=90.0)) == 1


def test_a_poor_surrogate_is_said_to_be_poor_with_what_helps(proven: tuple[Bundle, Proof, JudgementRecord]) -> None:
    assert poor(proven[1], 1.0) == []
    (said,) = poor(replace(proven[1], errors=np.full((12, 1), 0.3)), 1.0)
    assert said.startswith("this surrogate is poor: 0 % of the new experiments are within 1 %, and y is 30 % of its")
    assert "--minutes 2 or more" in said
    (said,) = poor(replace(proven[1], errors=np.full((12, 1), 0.3)), 1.0, needs_s=316.0)
    assert "--minutes 6 or more" in said, "no less than a search takes"
    (said,) = poor(replace(proven[1], errors=np.full((12, 1), np.inf)), 1.0)
    assert "y is without bound in half" in said


def test_a_reference_that_is_random_is_told_to_who_goes_on_too(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Python has no screen for warnings, and a second run runs nothing that would tell."""
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path / "cache"))
    (tmp_path / "noise.py").write_text(
        "import numpy as np\n\ndef noise(t, u, p):\n    return u + np.random.default_rng().standard_normal(u.shape)\n",
        encoding="utf-8",
    )
    reference = {**REFERENCE, "python": "noise.py:noise", "folder": str(tmp_path)}
    config = check(
        ExperimentConfig, {"kind": "experiment", "name": "noise", "workers": 1, "reference": reference,
        "experiment": DESIGN}, where="",
    )  # fmt: skip
    written = Written(config=config, text="", path=tmp_path / "noise.yaml")
    for _ in range(2):
        carry_out(experiment_program(written), tmp_path / "out", command="test")
        (said,) = unlike(tmp_path / "out")
        assert "The reference is random (give it a seed)" in said
    assert unlike(tmp_path) == []


def test_a_parameter_without_effect_is_told_of_a_good_surrogate(
    proven: tuple[Bundle, Proof, JudgementRecord], tmp_path: Path
) -> None:
    rng = np.random.default_rng(0)
    u, p = rng.standard_normal(400), np.repeat(rng.uniform(0.0, 1.0, 4), 100)
    y = np.zeros(400)
    for k in range(1, 400):
        y[k] = 0.8 * y[k - 1] + 0.2 * u[k]
    traces = sysid.data({"u": u, "p": p, "y": y}, inputs=["u", "p"], outputs="y", sample_time=0.5)
    fit = sysid.fit(traces, "u+p -> y", sysid.ARX(na=1, nb=(1, 1), nk=(0, 0)), rest_output=0.0)
    bundle = sysid.save(fit, traces, tmp_path / "bundle", formats=("c",), start=Start())
    (said,) = without_effect(bundle, traces.traces, proven[1])
    assert said.startswith("p moves no output by more than")
    assert without_effect(bundle, traces.traces, replace(proven[1], errors=np.full((12, 1), 0.3))) == []


def test_what_experiments_take_is_told_before_they_are_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path))
    content = {"kind": "experiment", "name": "lag", "workers": 1, "experiment": {**DESIGN, "excitations": ["events"]}}

    def told(function: str, **more: object) -> str | None:
        config = check(ExperimentConfig, {**content, "reference": {**REFERENCE, "python": function, **more}}, where="")
        reference = config.reference.at(tmp_path)
        return work.first_look(Experiments(config=config, reference=reference), minutes=1.0)

    slow = told("slow_models:raises", cost=20.0)
    assert slow is not None
    assert "4 experiments are to be run, about 80 s of the 60 s that were asked for, as one takes 20 s" in slow
    failed = told("slow_models:raises", inputs={"u": {"unit": "V", "range": [1.5, 2]}})
    assert failed is not None
    assert "it gave no record: it raised ValueError: valve jammed" in failed


def test_what_would_be_passed_over_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "lag.py").write_text("", encoding="utf-8")
    (tmp_path / "lag.yaml").write_text("kind: experiment", encoding="utf-8")
    for words, said in (
        (["surrogate", str(tmp_path / "lag.yaml"), "--range", "u=0:1", "--duration", "5"], "--range, --duration"),
        (["init", str(tmp_path / "ws"), "--parameter", "m=0:1"], "--parameter"),
        (["surrogate", str(tmp_path / "lag.py")], "named without its function"),
        (["init", str(tmp_path / "ws"), "--reference", str(tmp_path / "lag.py")], "named without its function"),
    ):
        assert run_cli(words) != 0
        assert said in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "ws").exists()


def test_what_does_not_begin_at_rest_is_told() -> None:
    u = np.repeat([0.0, 1.0], [10, 30])
    for name, y in (("decays", 5.0 * 0.8 ** np.arange(40)), ("rests", np.minimum(u, 0.5))):
        traces = sysid.data({"u": u, "y": y}, inputs="u", outputs="y", sample_time=0.5)
        found = Experimented(traces=traces, outcomes={}, before={"y": 0.0}, spread={"y": 0.0})
        told = restless(found, Mapping(inputs=("u",), outputs=("y",)))
        assert [one.split(" while ")[0] for one in told] == (["y moves by up to 4.33"] if name == "decays" else [])


def test_a_surrogate_and_its_fmu_begin_where_the_reference_does_and_follow_its_start_value(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A lag that is let go from a value that is varied: its state before the first sample is learnt."""
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path / "cache"))
    reference = {**REFERENCE, "python": "slow_models:released"}
    reference["parameters"] = {"from": {"unit": "V", "range": [2, 5]}, "tau": {"unit": "s", "range": [4, 4.0001]}}
    traces = sysid.experiment(reference, DESIGN, workers=1)
    fit = sysid.fit(
        traces, "u+from+tau -> y", sysid.NeuralStateSpace(states=1, neurons=0), sysid.Training(starts=1),
        start=Start(), rest_output=0.0,
    )  # fmt: skip
    assert not any("does not begin in equilibrium" in note for note in fit.notes)
    bundle = sysid.save(fit, traces, tmp_path / "bundle", formats=("fmi2",), start=Start())
    config, design = ReferenceConfig.model_validate(reference), Design.model_validate(DESIGN)
    proof, _ = prove(bundle, config, design, traces, count=8, workers=1)
    assert proof.largest.max() < 1e-3
    assert proof.dropped is not None
    assert proof.dropped < 1e-9
    assert "at its first sample y is at most" in beginning_of(bundle, traces.traces)[0]
