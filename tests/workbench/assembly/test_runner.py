"""An assembly end to end: its stages beside each other, what is stored, what a second run does again."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sysid.composite.rounds.round import JointRound
from sysid.errors import ConfigError, ParityError
from sysid.estimation import CascadeFit, Status
from sysid.export import read_bundle
from sysid.reporting import publish_run, read_run
from sysid.reporting.assembly.document import headline
from sysid.reporting.signals import read_signals
from sysid.workbench.assembly.runner import read_assembly
from sysid.workbench.commands.run import run_request
from sysid.workbench.fits.record import read_fit
from sysid.workbench.kinds import RunRequest, kind_of
from sysid.workbench.tracking.mlflow_store import connect, store_uri
from tests.workbench.assembly.conftest import ROLES, assembly_results, levels


def run(workspace: Path, *, fresh: bool = False, tracking: bool = False) -> int:
    file = workspace / "pipelines" / "tanks.yaml"
    return run_request(RunRequest(path=file, typed="tanks", fresh=fresh, tracking=tracking))


def test_an_assembly_from_a_yaml(workspace: Path, drawn: None, capsys: pytest.CaptureFixture[str]) -> None:
    assert kind_of(workspace / "pipelines" / "tanks.yaml") == "assembly"
    assert run(workspace) == 0
    folder = workspace / "runs" / "tanks"
    results = assembly_results(folder)
    stages = [stage.name for stage in results.stages]
    assert stages == ["each alone", "chosen together", "retrained", "trained end to end"]
    assert all({*stage.mse} == {"upper", "lower"} for stage in results.stages)
    assert [one.step for one in results.ablation] == ["choose_together", "retrain", "train_together"]
    assert [one.mapping for one in results.members] == ["pump+lower -> upper"]
    assert [one.name for one in results.rounds] == ["1"]
    assert results.monte_carlo is not None
    assert results.monte_carlo.sequences == 4
    assert {name: case.role.value for name, case in results.cases.items()} == ROLES
    assert [(one.output, one.low, one.high) for one in results.limits] == [("lower", 0.0, None)]
    published = results.published["lower"]
    assert (published.source, published.target, published.mse) == ("Table 1", 0.5, {"V": 0.4})
    # What is stored is what the stored assembly does.
    whole = read_assembly(folder)
    pump = np.repeat(np.random.default_rng(3).uniform(0.0, 2.0, 15), 20)
    pump[:5] = 0.0
    error = np.mean((whole.simulate(pump[:, None])["lower"] - levels(pump)[1]) ** 2)
    assert error == pytest.approx(results.chosen.mse["lower"]["V"], rel=1e-6)
    signals = read_signals(folder, list(results.cases), of="lower")["V"]
    assert np.mean(signals.error**2) == pytest.approx(error, rel=1e-6)
    assert (folder / "report" / "index.html").is_file()
    assert "From pump alone" in capsys.readouterr().out
    _is_published(folder, workspace / "reports")

    stamps = {file: file.stat().st_mtime_ns for file in folder.rglob("fit.json")}
    assert len(stamps) == 4
    assert run(workspace) == 0
    assert {file: file.stat().st_mtime_ns for file in folder.rglob("fit.json")} == stamps, "nothing is fitted again"
    assert assembly_results(folder).stages == results.stages


def _is_published(folder: Path, reports: Path) -> None:
    """``sysid publish`` takes the run as it takes one of fits."""
    results = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    page = publish_run(folder, reports)
    text = page.read_text(encoding="utf-8")
    assert page == reports / "tanks" / "README.md"
    for words in (
        f"**{headline(assembly_results(folder))}**",
        "- **Published.** lower at or below Table 1 on ",
        "- **Weakness.** Of 4 random sequences ",
        "| run | `sysid run tanks` |",
        f"| published | `sysid publish {folder} --as tanks` |",
        f"| commit | {results['environment']['commit']} |",
        f"| data | tanks, SHA-256 {results['data']['digest']} |",
    ):
        assert words in text, words
    named = set(re.findall(r"\]\(([^)]+\.svg)\)", text))
    assert named
    assert {file.name for file in page.parent.glob("*.svg")} == named


def test_the_chosen_stage_is_the_best_on_the_selection_traces(workspace: Path) -> None:
    run(workspace)
    results = assembly_results(workspace / "runs" / "tanks")
    assert results.chosen is min(results.stages, key=lambda stage: stage.selection)


def test_every_stage_is_tracked_once(workspace: Path, empty_store: Path) -> None:
    shutil.copyfile(empty_store, workspace / "mlflow.db")
    for _ in range(2):
        assert run(workspace, tracking=True) == 0
    client = connect(store_uri(workspace))
    experiment = client.get_experiment_by_name("tanks")
    runs = client.search_runs([experiment.experiment_id])
    names = {one.info.run_name: one for one in runs}
    best = min(names, key=lambda name: names[name].data.metrics["tanks/selection"])
    stages = ["each alone", "chosen together", "retrained", "trained end to end"]
    assert best.removeprefix("✓ ") in stages
    assert sorted(names) == sorted(best if best == f"✓ {stage}" else stage for stage in stages)
    assert best.startswith("✓ ")
    assert all(any(name.endswith("V/mse") for name in one.data.metrics) for one in runs)


def test_rounds_end_to_end_go_on_from_one_another_and_are_found_again(workspace: Path) -> None:
    pipeline = workspace / "pipelines" / "tanks.yaml"
    text = pipeline.read_text(encoding="utf-8").replace(
        "stride: 2, checkpoints: 2}\n",
        "stride: 2, checkpoints: 2}\n  traces: 1\n  again:\n    - {traces: 2}\n"
        "    - {targets: {upper: 0.2, lower: 0.1}, max_iterations: 2}\n",
    )
    pipeline.write_text(text, encoding="utf-8")
    assert run(workspace) == 0
    folder = workspace / "runs" / "tanks"
    files = [folder / f"{name}.json" for name in ("together", "together-2", "together-3")]
    fits = [CascadeFit.from_dict(json.loads(file.read_text(encoding="utf-8"))) for file in files]
    assert [fit.errors["upper"] for fit in fits] == [0.1, 0.1, 0.2]
    assert all(max(fit.history["iteration"], default=0) <= most for fit, most in zip(fits, (4, 4, 2), strict=True))
    stages = [stage.name for stage in assembly_results(folder).stages]
    rounds = ["trained end to end", "trained end to end, round 2", "trained end to end, round 3"]
    assert [name for name in stages if name in rounds] == rounds
    stamps = [file.stat().st_mtime_ns for file in files]
    assert run(workspace) == 0
    assert [file.stat().st_mtime_ns for file in files] == stamps
    # another third round leaves the first two as they are
    pipeline.write_text(text.replace("max_iterations: 2}", "max_iterations: 3}"), encoding="utf-8")
    assert run(workspace) == 0
    changed = [file.stat().st_mtime_ns != stamp for file, stamp in zip(files, stamps, strict=True)]
    assert changed == [False, False, True]


def test_a_whole_that_is_lost_says_so_in_its_report(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    trained = JointRound.fit

    def lost(*args) -> CascadeFit:
        return replace(trained(*args), status=Status.UNSTABLE)

    monkeypatch.setattr(JointRound, "fit", lost)
    assert run(workspace) == 0
    results = assembly_results(workspace / "runs" / "tanks")
    assert [one.status for one in results.rounds] == ["UNSTABLE"]
    assert Status.UNSTABLE.value in results.notes


def test_a_round_that_was_interrupted_is_used_now_and_trained_again_next_time(
    workspace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trained = JointRound.fit

    def interrupted(*args) -> CascadeFit:
        return replace(trained(*args), status=Status.INTERRUPTED)

    with monkeypatch.context() as patch:
        patch.setattr(JointRound, "fit", interrupted)
        assert run(workspace) == 0
    file = workspace / "runs" / "tanks" / "together.json"
    assert json.loads(file.read_text(encoding="utf-8"))["status"] == "INTERRUPTED"
    assert run(workspace) == 0
    assert json.loads(file.read_text(encoding="utf-8"))["status"] != "INTERRUPTED"


def test_a_circle_may_be_closed_in_a_later_round(workspace: Path) -> None:
    pipeline = workspace / "pipelines" / "tanks.yaml"
    text = pipeline.read_text(encoding="utf-8").replace("mapping: pump+lower -> upper", "mapping: pump -> upper")
    text = text.replace("input_delays: [[0, 1], [1]]", "input_delays: [0, 1]").replace(
        "stride: 2, checkpoints: 2}\n", "stride: 2, checkpoints: 2}\n  again: [{reads: {upper: {lower: 1}}}]\n"
    )
    pipeline.write_text(text, encoding="utf-8")
    assert run(workspace) == 0
    folder = workspace / "runs" / "tanks"
    chain, circle = (
        CascadeFit.from_dict(json.loads((folder / name).read_text(encoding="utf-8"))).model
        for name in ("together.json", "together-2.json")
    )
    assert str(chain.member("upper").mapping) == "pump -> upper"
    assert str(circle.member("upper").mapping) == "pump+lower -> upper"
    assert chain.inputs == circle.inputs == ("pump",)


@pytest.mark.parametrize(
    ("reads", "complaint"),
    [
        ("{upper: {level: 1}}", "together, reads names level"),
        ("{upper: {lower: 0}}", "not a set of lags"),
        ("{upper: {lower: 1}}", "reads some of these lags already"),
    ],
)
def test_a_circle_of_what_is_not_there_is_refused(workspace: Path, reads: str, complaint: str) -> None:
    pipeline = workspace / "pipelines" / "tanks.yaml"
    text = pipeline.read_text(encoding="utf-8").replace("  targets: {upper", f"  reads: {reads}\n  targets: {{upper")
    pipeline.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=complaint):
        run(workspace)


def test_what_is_as_measured_while_the_others_are_trained_stays_as_it_was(workspace: Path) -> None:
    pipeline = workspace / "pipelines" / "tanks.yaml"
    text = pipeline.read_text(encoding="utf-8").replace(
        "targets: {upper: 0.1, lower: 0.1}", "measured: [lower]\n  targets: {upper: 0.1}"
    )
    pipeline.write_text(text.replace("retrain: {members: [lower], max_iterations: 5}\n", ""), encoding="utf-8")
    assert run(workspace) == 0
    folder = workspace / "runs" / "tanks"
    fit = CascadeFit.from_dict(json.loads((folder / "together.json").read_text(encoding="utf-8")))
    alone = read_fit(folder / "fits" / "upper-lower-0")
    assert fit.model.inputs == ("pump",)
    assert fit.errors == {"upper": 0.1}
    assert fit.model.member("lower").to_dict() == alone.model.to_dict()
    starts = [read_fit(folder / "fits" / f"pump-lower-upper-{n}").model.to_dict() for n in range(2)]
    assert fit.model.member("upper").to_dict() not in starts


def test_what_is_as_measured_is_neither_trained_nor_a_target(workspace: Path) -> None:
    pipeline = workspace / "pipelines" / "tanks.yaml"
    text = pipeline.read_text(encoding="utf-8").replace("  targets: {upper", "  measured: [lower]\n  targets: {upper")
    pipeline.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match="lower is to be as measured"):
        run(workspace)


def test_a_run_that_has_not_come_so_far_has_no_assembly(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="has no assembly"):
        read_assembly(tmp_path)


def test_what_is_declared_beside_a_member_leaves_its_fit_as_it_was(workspace: Path) -> None:
    """One more known member, which holds the lower tank: fits that do not depend on it are found again."""
    pipeline = workspace / "pipelines" / "tanks.yaml"
    text = pipeline.read_text(encoding="utf-8").replace("retrain: {members: [lower], max_iterations: 5}\n", "")
    text = text.replace("targets: {upper: 0.1, lower: 0.1}", "measured: [lower]\n  targets: {upper: 0.1}")
    text = text.replace("candidates: 2", "candidates: 1")
    text = text.replace(
        "checkpoints: 2}\n", "checkpoints: 2}\n  again: [{measured: [], targets: {upper: 0.1, lower: 0.1}}]\n"
    )
    pipeline.write_text(text, encoding="utf-8")
    assert run(workspace) == 0
    folder = workspace / "runs" / "tanks"
    files = [*folder.rglob("fit.json"), folder / "together-2.json"]
    stamps = [file.stat().st_mtime_ns for file in files]
    whole = CascadeFit.from_dict(json.loads((folder / "together.json").read_text(encoding="utf-8")))
    held = text.replace("  lower: {low: 0}", "  lower: {low: LL}")
    known = "fixed: [{mapping: upper -> LL, gains: {upper: -100}, low: 0, high: 100, rest: 0}]\n"
    pipeline.write_text(held + known, encoding="utf-8")
    assert run(workspace) == 0
    changed = [file.stat().st_mtime_ns != stamp for file, stamp in zip(files, stamps, strict=True)]
    assert changed == [False] * (len(files) - 1) + [True]
    now = CascadeFit.from_dict(json.loads((folder / "together.json").read_text(encoding="utf-8")))
    assert now.train_time_s == whole.train_time_s, "not trained again"
    assert "LL" in now.model.outputs, "but in the whole as it now is"
    (said,) = read_run(folder).equations
    assert (said.output, said.equation) == ("LL", "LL = clamp(-100*upper, 0, 100)")


def test_a_limit_that_changes_leaves_the_fits_and_not_what_runs_on_the_others(workspace: Path) -> None:
    """Retraining runs on what the whole puts out, which its limits hold."""
    assert run(workspace) == 0
    folder = workspace / "runs" / "tanks"
    files = sorted((folder / "fits").rglob("fit.json"))
    stamps = [file.stat().st_mtime_ns for file in files]
    pipeline = workspace / "pipelines" / "tanks.yaml"
    text = pipeline.read_text(encoding="utf-8").replace("  lower: {low: 0}", "  lower: {low: 0, high: 50}")
    pipeline.write_text(text, encoding="utf-8")
    assert run(workspace) == 0
    changed = {file.parent.name for file, stamp in zip(files, stamps, strict=True) if file.stat().st_mtime_ns != stamp}
    assert changed == {"upper-lower-retrained-0"}


def test_the_report_says_what_was_exported_and_how_far_it_is_from_the_whole(workspace: Path) -> None:
    file = workspace / "pipelines" / "tanks.yaml"
    file.write_text(file.read_text().replace("export: null", "export: {formats: [torchscript], tolerance: 1.0e-6}"))
    assert run(workspace) == 0
    exports = assembly_results(workspace / "runs" / "tanks").exports
    bundle = read_bundle(workspace / "runs" / "tanks" / "bundle")
    assert [(one.file, one.format, one.unit) for one in exports] == [
        (f"bundle/{one.name}", "torchscript", "cm") for one in bundle.files
    ]
    assert all(one.largest_difference <= one.tolerance == 1e-6 for one in exports)


def test_a_file_that_is_refused_costs_nobody_the_report(workspace: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = workspace / "pipelines" / "tanks.yaml"
    file.write_text(file.read_text().replace("export: null", "export: {formats: [torchscript], tolerance: 1.0e-30}"))
    with pytest.raises(ParityError, match="does not reproduce its model"):
        run(workspace)
    assert "nothing is exported: " in capsys.readouterr().out
    results = assembly_results(workspace / "runs" / "tanks")
    assert not results.exports
    assert "It is not exported: " in results.notes[-1]
    assert (workspace / "runs" / "tanks" / "report" / "index.html").is_file()


def test_what_is_known_may_be_any_equation(workspace: Path) -> None:
    """The flow by its law: what is left to fit is linear, and the whole is exact but for rounding."""
    file = workspace / "pipelines" / "tanks.yaml"
    text = file.read_text()
    start, end = text.index("members:"), text.index("monte_carlo")
    declared = """\
fixed:
  - unit: cm
    equations: |
      head = max(upper[k-1] - 0.3*lower[k-1], 0)
      down = min(0.15*sqrt(head), head)
members:
  - {mapping: pump+down -> upper, structure: {kind: NARX, input_delays: [0], output_delays: 1, neurons: 0}, rest: 0}
  - {mapping: down -> lower, structure: {kind: NARX, input_delays: [0], output_delays: 1, neurons: 0}, rest: 0}
together: {targets: {upper: 0.1, lower: 0.1}, training: {max_iterations: 4, stride: 2}}
"""
    text = text[:start] + declared + text[end:]
    text = text.replace("lower: {low: 0}", 'lower: {low: 0, high: "max(upper, 20) + 5"}')
    file.write_text(text.replace("export: null", "export: {formats: [c], tolerance: 1.0e-4}"))
    assert run(workspace) == 0
    results = assembly_results(workspace / "runs" / "tanks")
    assert [(one.equation, one.unit) for one in results.equations] == [
        ("head = max(upper[k-1] - 0.3 * lower[k-1], 0)", "cm"), ("down = min(0.15 * sqrt(head), head)", "cm"),
        ('"lower high" = max(upper, 20) + 5', "cm"),
    ]  # fmt: skip
    for output in ("upper", "lower"):
        assert max(results.stages[-1].mse[output].values()) < 1e-5
