"""The linearity verdict: amplitude by amplitude, on unseen cases only."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.traces import Role
from sysid.validation import CaseResult, Evaluation, Figures
from sysid.validation.linearity import Amplitude, Answer, Linearity, judge_linearity

SPANS = {
    "EST": (60.0, Role.ESTIMATION),
    "MIN": (10.0, Role.VALIDATION),
    "MID": (35.0, Role.VALIDATION),
    "FULL": (60.0, Role.TEST),
    "STILL": (0.0, Role.TEST),
}


def evaluation(**fits: float) -> Evaluation:
    cases = {}
    for name, fit in {"EST": 99.0, **fits}.items():
        span, role = SPANS[name]
        figures = Figures(mse=1.0, nrmse_fit=fit, max_abs_error=1.0, r=1.0, unit="psi")
        signal = np.array([0.0, span])
        cases[name] = CaseResult(
            case=name, role=role, free_run=figures, one_step=figures, run_time_s=1.0,
            time=np.arange(2.0), target=signal, simulated=signal, predicted=signal,
        )  # fmt: skip
    return Evaluation(cases=cases)


@pytest.mark.parametrize(
    ("linear", "network", "answer"),
    [
        ({"MIN": 97.0, "MID": 96.0, "FULL": 98.0}, {"MIN": 99.9, "MID": 99.9, "FULL": 99.9}, Answer.LINEAR),
        ({"MIN": 65.0, "MID": 88.0, "FULL": 97.0}, {"MIN": 95.0, "MID": 98.0, "FULL": 99.0}, Answer.NETWORK),
        ({"MIN": 65.0, "MID": 88.0, "FULL": 97.0}, {"MIN": 70.0, "MID": 90.0, "FULL": 99.0}, Answer.NEITHER),
        ({"MIN": 65.0, "MID": 88.0, "FULL": 97.0}, {"MIN": 64.0, "MID": 80.0, "FULL": 99.0}, Answer.LINEAR),
    ],
    ids=["linear is good", "network far better", "network little better", "network no better"],
)
def test_answers(linear: dict[str, float], network: dict[str, float], answer: Answer) -> None:
    verdict = judge_linearity({"ARX": evaluation(**linear)}, {"NARX": evaluation(**network)})
    assert verdict.answer is answer
    assert [row.amplitude for row in verdict.rows] == list(Amplitude)
    assert [row.cases for row in verdict.rows] == [("MIN",), ("MID",), ("FULL",)]


def test_each_amplitude_has_its_own_best_model() -> None:
    one, other = evaluation(MIN=80.0, MID=90.0, FULL=60.0), evaluation(MIN=60.0, MID=70.0, FULL=97.0)
    verdict = judge_linearity({"A": one, "B": other}, {"N": evaluation(MIN=99.0, MID=99.0, FULL=99.0)})
    assert [(row.linear, row.linear_fit) for row in verdict.rows] == [("A", 80.0), ("A", 90.0), ("B", 97.0)]


def test_what_was_chosen_is_judged_and_what_unseen_cases_like_better_is_only_named() -> None:
    chosen, other = evaluation(MIN=80.0, MID=90.0, FULL=97.0), evaluation(MIN=99.0, MID=70.0, FULL=97.0)
    verdict = judge_linearity({"A": chosen}, {"N": chosen, "M": other}, ranked=["N", "A", "M"])
    assert [(row.network, row.network_fit) for row in verdict.rows] == [("N", 80.0), ("N", 90.0), ("N", 97.0)]
    assert [row.better_network for row in verdict.rows] == ["M", "", ""]
    assert verdict.rows[0].to_dict()["better_network_fit"] == 99.0
    assert "better_network" not in verdict.rows[1].to_dict()
    assert verdict.answer is Answer.LINEAR


def test_a_run_that_diverges_is_never_the_best() -> None:
    lost = evaluation(MIN=float("-inf"), MID=float("nan"), FULL=0.0)
    verdict = judge_linearity({"lost": lost, "A": evaluation(MIN=1.0, MID=1.0, FULL=1.0)}, {"N": lost})
    assert {row.linear for row in verdict.rows} == {"A"}


@pytest.mark.parametrize("missing", ["linear", "networks"])
def test_one_kind_alone_gives_no_answer(missing: str) -> None:
    some = {"x": evaluation(MIN=1.0, MID=1.0, FULL=1.0)}
    kinds = {"linear": some, "networks": some} | {missing: {}}
    assert judge_linearity(**kinds).answer is Answer.UNKNOWN


def test_a_case_that_does_not_vary_has_no_say():
    verdict = judge_linearity(
        {"arx": evaluation(MIN=97.0, FULL=98.0, STILL=np.nan)}, {"narx": evaluation(MIN=99.0, FULL=99.0, STILL=np.nan)}
    )
    assert verdict.answer is Answer.LINEAR
    assert "STILL" not in {case for row in verdict.rows for case in row.cases}


def test_of_several_outputs_each_has_its_verdict_and_the_whole_that_of_the_worst() -> None:
    good, bad = evaluation(MIN=99.0, MID=99.0, FULL=99.0), evaluation(MIN=50.0, MID=50.0, FULL=50.0)
    each = {
        "y1": judge_linearity({"ARX, y1": good}, {"NARX, y1": good}),
        "y2": judge_linearity({"ARX, y2": bad}, {"NARX, y2": good}),
    }
    verdict = Linearity.of_outputs(each)
    assert verdict.answer is Answer.NETWORK
    assert [row.output for row in verdict.rows] == ["y1"] * 3 + ["y2"] * 3
    assert verdict.text == f"y2: {Answer.NETWORK.value} y1: {Answer.LINEAR.value}"
    assert Linearity.of_outputs({"y1": each["y1"]}) == each["y1"]
