"""What is tracked of a fit, in plain words."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from sysid.estimation import Status
from sysid.reporting.sections.fit_tables import DRAWN
from sysid.traces import Role
from sysid.validation import Evaluation
from sysid.validation.metrics import Figures
from sysid.workbench.tracking import fit_values
from sysid.workbench.tracking.fit_values import MAX_METRICS, batches, drawn


def test_metrics_go_in_as_many_batches_as_the_store_needs():
    values = list(range(2 * MAX_METRICS + 1))
    assert [len(one) for one in batches(values)] == [MAX_METRICS, MAX_METRICS, 1]
    assert [value for one in batches(values) for value in one] == values
    assert list(batches([])) == []


def many_cases(asked: int | None = None) -> Any:
    """A fit of sixty cases, of which ten test it."""
    cases = {f"EST{k}": SimpleNamespace(role=Role.ESTIMATION) for k in range(50)}
    cases |= {f"TST{k}": SimpleNamespace(role=Role.TEST) for k in range(10)}
    report = SimpleNamespace(drawn=asked)
    return SimpleNamespace(evaluation=SimpleNamespace(cases=cases), pipeline=SimpleNamespace(report=report))


def test_pictures_are_tracked_of_as_many_cases_as_the_report_draws_those_that_test_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tests = [f"TST{k}" for k in range(10)]
    assert drawn(many_cases()) == ["EST0", "EST1", *tests]
    assert len(drawn(many_cases())) == DRAWN
    assert drawn(many_cases(3)) == tests[:3]
    monkeypatch.setattr(fit_values, "_picture", lambda _, case: case.role)
    pictures = dict(fit_values.pictures(cast("Any", many_cases(3))))
    assert pictures == dict.fromkeys([f"target and output/{name}" for name in tests[:3]], Role.TEST)


def test_what_is_warned_of_stands_first_and_once_in_what_a_run_says() -> None:
    """MLflow shows the first few lines and hides the rest."""
    fit = SimpleNamespace(
        status=Status.CONVERGED, notes=("Chosen by evidence.", "Not shown by the record."),
        warnings=("Not shown by the record.",),
    )  # fmt: skip
    ready: Any = SimpleNamespace(fit=fit, config=SimpleNamespace(name="best found"))
    run: Any = SimpleNamespace(pipeline="search", command="sysid auto rig.csv")
    told = [line for line in fit_values.description(ready, run, {}).splitlines() if line.startswith("* ")]
    assert told == ["* Not shown by the record.", "* Chosen by evidence."]


@pytest.mark.parametrize(("roles", "mean"), [(("ESTIMATION",), 70.0), (("ESTIMATION", "TEST"), 80.0)])
def test_the_mean_fit_is_over_what_scores_or_over_all_where_nothing_does(roles: tuple[str, ...], mean: float) -> None:
    """A first record has one case: the column and the charts of the fit were empty."""
    cases = {}
    for fit, role in zip((70.0, 80.0), roles, strict=False):
        figures = Figures(mse=1.0, nrmse_fit=fit, max_abs_error=1.0, r=0.9, unit="V")
        cases[role] = SimpleNamespace(
            role=Role[role], free_run=figures, one_step=figures, run_time_s=0.1, intervals=None
        )
    evaluation = Evaluation(cases=cast("Any", cases))
    fit = SimpleNamespace(model=SimpleNamespace(n_parameters=3), train_time_s=1.0, evidence=None, stability=None)
    ready: Any = SimpleNamespace(fit=fit, evaluation=evaluation, selection_mse=float("nan"))
    found = fit_values.metrics(ready)
    assert found["mean_nrmse_fit"] == mean
    assert found["correlation/ESTIMATION"] == 0.9
