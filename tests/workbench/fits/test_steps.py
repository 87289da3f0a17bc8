"""Steps: what a result depends on, what is refused before anything is fitted, and what chooses."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from sysid.errors import UserError
from sysid.estimation import FitResult, Loop, Status
from sysid.models import ARX, ARXModel, Mapping
from sysid.traces import Role
from sysid.validation import CaseResult, Evaluation, Figures
from sysid.workbench.fits import choice, steps
from sysid.workbench.fits.config import PipelineConfig
from sysid.workbench.fits.data import Data, load_data
from tests.workbench.pipelines import parse_pipeline


def load(config: PipelineConfig, workspace: Path) -> Data:
    return load_data(config, beside=workspace / "pipelines", progress=lambda _: None)


def pipeline_text(workspace: Path) -> str:
    return (workspace / "pipelines" / "first.yaml").read_text(encoding="utf-8")


def keys(workspace: Path, text: str | None = None) -> dict[str, str]:
    """Every key of a pipeline by its step."""
    config = parse_pipeline(text or pipeline_text(workspace))
    data = load(config, workspace)
    found: dict[str, str] = {}
    for fit in config.fits:
        found[fit.name] = steps.fit_key(fit, config, data, found.get(fit.initial or ""))
        found[f"{fit.name} scores"] = steps.scores_key(found[fit.name], fit.structure, data, config)
    return found


ALL = {"ARX", "open loop", "closed loop"}
NETWORKS = {"open loop", "closed loop"}

OPEN, CLOSED = "loop: open, max_iterations: 8", "loop: closed, max_iterations: 8"

CHANGES = [
    pytest.param("name: first", "name: second", set(), id="name of the pipeline: nothing"),
    pytest.param("name: ARX", "name: linear", {"ARX"}, id="name of a fit: that fit alone, under its new name"),
    pytest.param("na: 1", "na: 2", {"ARX"}, id="order of the ARX: the ARX"),
    pytest.param(OPEN, OPEN + "0", NETWORKS, id="training of the open loop: it and what starts from it"),
    pytest.param(CLOSED, CLOSED + "0", {"closed loop"}, id="training of the closed loop: it alone"),
    pytest.param("seed: 3", "seed: 4", NETWORKS, id="seed: what is random"),
    pytest.param("rest: {outlet: 100}", "rest: {outlet: 101}", ALL, id="rest: everything"),
    pytest.param("start: rest", "start: first-sample", ALL, id="start: everything"),
    pytest.param("inlet+valve", "valve+inlet", ALL, id="mapping: everything"),
]


@pytest.mark.parametrize(("old", "new", "changed"), CHANGES)
def test_a_change_concerns_what_depends_on_it(workspace: Path, old: str, new: str, changed: set[str]) -> None:
    text = pipeline_text(workspace)
    assert old in text
    before, after = keys(workspace), keys(workspace, text.replace(old, new))
    assert {name for name, key in before.items() if after.get(name) != key} == {
        *changed,
        *(f"{name} scores" for name in changed),
    }


@pytest.mark.parametrize(
    ("record", "changed"),
    [
        pytest.param(1, ALL, id="estimation record: everything"),
        pytest.param(2, NETWORKS, id="selection record: the networks, and every score"),
        pytest.param(3, set(), id="validation record: every score, no fit"),
    ],
)
def test_a_changed_record_concerns_what_reads_it(workspace: Path, record: int, changed: set[str]) -> None:
    before = keys(workspace)
    file = workspace / "datasets" / "rig" / f"run-{record}.csv"
    file.write_text(file.read_text().rstrip("\n") + "0\n", encoding="utf-8")
    assert keys(workspace) == before  # a digit 0 at the end of the last number is no change
    lines = file.read_text().splitlines()
    lines[-1] = lines[-1].rsplit(",", 1)[0] + ",101.5"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    after = keys(workspace)
    assert {name for name in before if after[name] != before[name]} == {*changed, *(f"{name} scores" for name in ALL)}


def test_changed_code_concerns_everything(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = keys(workspace)
    monkeypatch.setattr(steps, "code_digest", lambda *_, **__: "other code")
    assert not set(keys(workspace).values()) & set(before.values())


def refusal(workspace: Path, text: str) -> str:
    with pytest.raises(UserError) as caught:
        load(parse_pipeline(text), workspace)
    return str(caught.value)


def other_dataset(workspace: Path, name: str, *changes: tuple[str, str]) -> None:
    """A data set of the same files with something changed."""
    text = (workspace / "datasets" / "rig" / "dataset.yaml").read_text(encoding="utf-8")
    for old, new in (("name: rig", f"name: {name}"), ("file: ", "file: ../rig/"), *changes):
        assert old in text
        text = text.replace(old, new)
    (workspace / "datasets" / name).mkdir()
    (workspace / "datasets" / name / "dataset.yaml").write_text(text, encoding="utf-8")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        pytest.param("data: rig", "data: rigg", "did you mean rig", id="unknown data set"),
        pytest.param("inlet+valve", "inlett+valve", "did you mean inlet", id="unknown channel"),
    ],
)
def test_a_misspelt_name_is_refused(workspace: Path, old: str, new: str, words: str) -> None:
    assert words in refusal(workspace, pipeline_text(workspace).replace(old, new))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        pytest.param(("role: selection", "role: test"), "no trace is for selection", id="no selection case"),
        pytest.param(("run-2.csv", "run-3.csv"), "selection trace run-2 is the case run-3", id="a case that is scored"),
        pytest.param(("outlet, unit: kPa", "outlet, unit: bar"), "outlet [bar gauge]", id="another unit"),
        pytest.param(("name: valve", "name: flap, description: valve"), "flap", id="another channel"),
    ],
)
def test_traces_that_cannot_choose_are_refused(workspace: Path, change: tuple[str, str], words: str) -> None:
    other_dataset(workspace, "other", change)
    assert words in refusal(workspace, pipeline_text(workspace).replace("data: rig", "data: rig\nselection: other"))


def test_traces_of_another_sample_time_cannot_choose(workspace: Path) -> None:
    other_dataset(workspace, "other", ("time: 0.05", "time: 0.1"), ("{files", "{grid: {method: average}, files"))
    text = pipeline_text(workspace).replace("data: rig", "data: rig\nselection: other")
    assert "every 0.1 s" in refusal(workspace, text)


def test_data_without_anything_to_fit_are_refused(workspace: Path) -> None:
    other_dataset(workspace, "other", ("role: estimation", "role: test"))
    text = pipeline_text(workspace).replace("data: rig", "data: other")
    assert "no trace is for estimation" in refusal(workspace, text)


def test_a_path_to_a_data_set_is_beside_the_pipeline(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config = parse_pipeline(pipeline_text(workspace).replace("data: rig", "data: ../datasets/rig/dataset.yaml"))
    monkeypatch.chdir("/")
    assert load(config, workspace).traces.names == ("run-1", "run-2", "run-3")
    assert load(parse_pipeline(pipeline_text(workspace)), workspace).traces.name == "rig"


def fitted(free_run_mse: dict[Role, float], selection_mse: float, status: Status = Status.CONVERGED):
    """A fit with given figures, as `choose` sees it."""
    model = ARXModel(
        orders=ARX(na=1, nb=(1,), nk=(1,)),
        coefficients=np.array([1.0, 0.5]),
        intercept=0.0,
        mapping=Mapping.parse("u -> y"),
        sample_time=1.0,
        input_units=("V",),
        output_unit="V",
        rest_output=0.0,
    )
    signal = np.zeros(2)
    cases = {}
    for role, mse in free_run_mse.items():
        figures = Figures(mse=mse, nrmse_fit=0.0, max_abs_error=0.0, r=0.0, unit="V")
        cases[role.value] = CaseResult(
            case=role.value, role=role, free_run=figures, one_step=figures, run_time_s=0.0,
            time=signal, target=signal, simulated=signal, predicted=signal,
        )  # fmt: skip
    fit = FitResult(model=model, status=status, loop=Loop.OPEN, history={}, train_time_s=0.0)
    return fit, steps.Scores(evaluation=Evaluation(cases=cases), selection_mse=selection_mse)


def one_output(fits: dict[str, tuple[FitResult, steps.Scores]]) -> dict[str, list[tuple[FitResult, steps.Scores]]]:
    return {name: [pair] for name, pair in fits.items()}


def test_each_output_counts_by_its_own_size() -> None:
    near, far = (fitted({Role.ESTIMATION: 1.0}, mse) for mse in (1.0, 100.0))
    small, large = (fitted({Role.ESTIMATION: 1.0}, mse) for mse in (0.001, 0.1))
    fits = {"good at the small one": [far, small], "good at the large one": [near, large]}
    assert choice.choose(fits, "best", (1e4, 1e-3)).name == "good at the small one"
    assert choice.choose(fits, "best", (1.0, 1.0)).name == "good at the large one"


def test_selection_traces_choose_and_validation_has_no_say() -> None:
    fits = {
        "best on validation": fitted({Role.ESTIMATION: 1.0, Role.VALIDATION: 0.1}, 3.0),
        "best on selection": fitted({Role.ESTIMATION: 2.0, Role.VALIDATION: 9.0}, 2.0),
        "best on estimation": fitted({Role.ESTIMATION: 0.1, Role.VALIDATION: 9.0}, 4.0),
    }
    given = one_output(fits)
    assert choice.choose(given, "best").name == "best on selection"
    assert "selection traces" in choice.choose(given, "best").chosen_by
    without = {name: (fit, dataclasses.replace(scores, selection_mse=math.nan)) for name, (fit, scores) in fits.items()}
    assert choice.choose(one_output(without), "best").name == "best on estimation"
    assert "for want of selection traces" in choice.choose(one_output(without), "best").chosen_by
    named = choice.choose(given, "best on validation")
    assert (named.name, named.chosen_by) == ("best on validation", "Named in the pipeline.")


def test_the_sentence_has_what_chose_and_the_next_or_those_that_it_cannot_be_told_from() -> None:
    errors = {"good": np.tile([0.5, 1.5], 6), "next": np.tile([0.5, 1.5, 1.0, 1.2], 3), "far": np.full(12, 9.0)}
    fits = {}
    for name, some in errors.items():
        fit, scores = fitted({Role.ESTIMATION: 1.0}, float(some.mean()))
        fits[name] = (fit, dataclasses.replace(scores, selection_errors=tuple(some)))
    said = choice.choose(one_output(fits), "best").chosen_by
    assert said.endswith(": 1.00\xa0V², tied with next (1.05\xa0V²): the difference is within one standard error.")
    said = choice.choose(one_output({name: fits[name] for name in ("good", "far")}), "best").chosen_by
    assert said.endswith("on the selection traces: 1.00\xa0V², before 9.00\xa0V² of far.")


def test_who_stays_within_a_tolerance_over_more_traces_is_best_whatever_the_mean() -> None:
    shares = {"even": (2.0, [0.009, 0.009]), "uneven": (1.0, [0.001, 0.02]), "worse": (3.0, [0.009, 0.009])}
    fits = {}
    for name, (mse, some) in shares.items():
        fit, scores = fitted({Role.ESTIMATION: 1.0}, mse)
        fits[name] = (fit, dataclasses.replace(scores, selection_rms_shares=tuple(some)))
    assert choice.choose(one_output(fits), "best").name == "uneven"
    found = choice.choose(one_output(fits), "best", tolerance=0.01)
    assert found.name == "even"
    assert "within 0.01 of the range" in found.chosen_by
    assert "within" not in choice.choose(one_output(fits), "best", tolerance=0.05).chosen_by
    # Of several outputs each has to stay within it over the same trace.
    both = {"even": [fits["even"], fits["uneven"]], "uneven": [fits["uneven"], fits["uneven"]]}
    assert choice.choose(both, "best", (1.0, 1.0), tolerance=0.01).name == "uneven"


def test_a_fit_that_failed_is_not_chosen_unless_all_did() -> None:
    good = fitted({Role.ESTIMATION: 1.0}, 5.0)
    failed = fitted({Role.ESTIMATION: 1.0}, 1.0, Status.NOT_IMPROVED)
    assert choice.choose(one_output({"failed": failed, "good": good}), "best").name == "good"
    assert choice.choose(one_output({"failed": failed}), "best").name == "failed"
