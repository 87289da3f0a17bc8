"""Parameters that each case has its own value of: found, told, run and refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy

import sysid
from sysid.errors import ConfigError, TraceError
from sysid.estimation.grey_box.by_case import for_case
from sysid.estimation.grey_box.fit import fit_equations, fit_grey_box
from sysid.estimation.results.result import FitResult
from sysid.models import GreyBox, GreyBoxModel, History, Mapping, Start, StartKind
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.validation import evaluate, predict_interval

MAPPING = Mapping.parse("u -> y")
ESTIMATED = Start(kind=StartKind.ESTIMATED)
TRUE = {"run1": 0.5, "run2": 1.0, "run3": 2.0}


def recorded(gain: float, name: str, *, n: int = 150, begin: float = 0.0, seed: int = 0, size: float = 2.0) -> Trace:
    """``x[k+1] = 0.8 x + gain u`` with noise of 0.01."""
    rng = np.random.default_rng(seed)
    u, x = np.repeat(rng.uniform(0.0, size, n // 10 + 1), 10)[:n], np.empty(n + 1)
    x[0] = begin
    for t in range(n):
        x[t + 1] = 0.8 * x[t] + gain * u[t]
    channels = (Channel(name="u", unit="V"), Channel(name="y", unit="V"))
    values = np.column_stack([u, x[:n] + 0.01 * rng.standard_normal(n)])
    return Trace(name=name, sample_time=0.5, channels=channels, values=values)


RECORDS = [recorded(gain, name, begin=3.0 * i, seed=i) for i, (name, gain) in enumerate(TRUE.items())]
EQUATIONS = "x[k+1] = a*x + gain*u; y = x"
BY_CASE = {"a": 0.5, "gain": {"start": 1.0, "low": 0.0, "unit": "1/V", "per": "case"}}


def fitted(traces: list[Trace] = RECORDS, *, start: Start = ESTIMATED, **fields: Any) -> FitResult:
    selection = fields.pop("selection", ())
    grey = GreyBox(**{"equations": EQUATIONS, "parameters": BY_CASE, **fields})
    return fit_grey_box(traces, MAPPING, grey, sysid.Training(starts=1), start=start, selection=selection)


@pytest.fixture(scope="module")
def fit() -> FitResult:
    return fitted()


def model_of(fit: FitResult) -> GreyBoxModel:
    assert isinstance(fit.model, GreyBoxModel)
    return fit.model


def test_each_case_has_its_value_and_interval_and_all_share_the_rest(fit: FitResult) -> None:
    known = fit.uncertainty
    assert known is not None
    assert known.names == ("a", "gain of run1 [1/V]", "gain of run2 [1/V]", "gain of run3 [1/V]")
    assert (np.abs(known.values - [0.8, *TRUE.values()]) < 3.0 * known.standard_deviations).all()
    assert (known.standard_deviations < 0.005).all()
    assert model_of(fit).by_case == {"gain": dict(zip(TRUE, known.values[1:], strict=True))}
    assert (model_of(fit).parameters, fit.model.n_parameters) == ({"a": known.values[0]}, 4)
    assert any("Each of 3 cases has its own gain" in note for note in fit.notes)


def test_they_are_those_of_least_squares_over_all_records(fit: FitResult) -> None:
    def left(p: np.ndarray) -> np.ndarray:
        errors = []
        for i, record in enumerate(RECORDS):
            x = p[4 + i]
            for u, y in record.values:
                errors.append(x - y)
                x = p[0] * x + p[1 + i] * u
        return np.array(errors)

    slow = scipy.optimize.least_squares(left, [0.5, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    assert fit.uncertainty is not None
    assert fit.uncertainty.values == pytest.approx(slow.x[:4], rel=1e-5)
    deviations = np.sqrt(np.diag(np.linalg.inv(slow.jac.T @ slow.jac)) * 2.0 * slow.cost / (450 - 7))
    assert fit.uncertainty.standard_deviations == pytest.approx(deviations[:4], rel=0.25)  # of correlated residuals


def test_gradients_are_those_of_differences(fit: FitResult, monkeypatch: pytest.MonkeyPatch) -> None:
    kept: list[Any] = []
    finished = fit_equations.__globals__["finished"]
    monkeypatch.setitem(
        fit_equations.__globals__, "finished",
        lambda ready, *given, **named: kept.append(ready) or finished(ready, *given, **named),
    )  # fmt: skip
    rest = [replace(one, name=f"{one.name} of rest") for one in RECORDS]
    fitted(rest, start=Start(), cases={"all": ["run1 of rest", "run3 of rest"]})
    fitted()
    for ready in kept:
        theta = ready.theta * 1.1 + 0.01
        found = ready.provider.linearise(theta).gradient
        steps = 1e-6 * np.eye(len(theta))
        slow = [(ready.provider.loss(theta + step) - ready.provider.loss(theta - step)) / 2e-6 for step in steps]
        assert found == pytest.approx(np.array(slow), rel=1e-6, abs=1e-7)
    assert [len(ready.theta) for ready in kept] == [3, 4 + 3]


def test_a_plain_model_of_a_case_and_one_with_inputs_run_alike(fit: FitResult) -> None:
    model, u = model_of(fit), RECORDS[2].columns(["u"])
    plain, wide = model.for_case("run3"), model.with_case_inputs()
    assert plain.parameters == {"a": model.parameters["a"], "gain": model.by_case["gain"]["run3"]}
    assert (plain.n_parameters, wide.mapping.inputs) == (2, ("u", "gain"))
    more = np.column_stack([u, np.full(len(u), plain.parameters["gain"])])
    assert np.array_equal(plain.simulate(u), wide.simulate(more))
    history = History(inputs=u[:20], output=RECORDS[2]["y"][:20], case="run3")
    alone = History(inputs=u[:20], output=RECORDS[2]["y"][:20])
    assert np.array_equal(model.simulate(u[20:], history), plain.simulate(u[20:], alone))
    narrow = for_case(fit, "run3")
    assert narrow.uncertainty is not None
    assert narrow.uncertainty.names == ("a", "gain of run3 [1/V]")
    assert narrow.model.to_dict() == plain.to_dict()
    moved, kept = (predict_interval(one, RECORDS[2], start=ESTIMATED) for one in (narrow, fit))
    assert moved.half_width == pytest.approx(kept.half_width)


def test_a_case_that_is_none_is_refused_with_the_nearest(fit: FitResult) -> None:
    with pytest.raises(ConfigError, match="there is no case run4") as caught:
        model_of(fit).for_case("run4")
    assert "did you mean run" in str(caught.value)
    plain = model_of(fit).for_case("run1")
    with pytest.raises(ConfigError, match="no parameter differs by case"):
        plain.for_case("run1")


def test_a_run_of_which_nobody_says_the_case_is_refused(fit: FitResult) -> None:
    with pytest.raises(ConfigError, match="nothing says which case it is"):
        fit.model.simulate(np.ones((5, 1)))


def test_a_case_that_was_not_fitted_is_run_with_what_its_first_samples_show(fit: FitResult) -> None:
    other = recorded(1.5, "other", begin=1.0, seed=9)
    cases = TraceSet(name="rig", traces=(*RECORDS, other), roles=dict.fromkeys([*TRUE, "other"], Role.TEST))
    found = evaluate(fit.model, cases, ESTIMATED, repeats=0).cases
    assert found["run2"].constants == {"gain": model_of(fit).by_case["gain"]["run2"]}
    assert found["other"].constants["gain"] == pytest.approx(1.5, abs=0.02)
    assert found["other"].free_run.mse < 9e-4
    assert predict_interval(fit, other, start=ESTIMATED).coverage(other["y"][30:]).share > 0.7


def test_a_case_that_was_not_fitted_is_refused_at_rest(fit: FitResult) -> None:
    cases = TraceSet(name="rig", traces=(recorded(1.5, "other"),), roles={"other": Role.TEST})
    with pytest.raises(ConfigError, match="other is none of those that are fitted"):
        evaluate(fit.model, cases, Start(), repeats=0)
    with pytest.raises(ConfigError, match="other is none of those that are fitted"):
        fitted(start=Start(), selection=cases.traces)


def test_samples_that_do_not_show_a_value_are_refused(fit: FitResult) -> None:
    still = recorded(1.5, "still", size=0.0, begin=2.0)
    cases = TraceSet(name="rig", traces=(still,), roles={"still": Role.TEST})
    with pytest.raises(TraceError, match="the first 30 samples of still do not show its gain") as caught:
        evaluate(fit.model, cases, ESTIMATED, repeats=0)
    assert "measured: 60" in str(caught.value)


def test_records_of_one_case_share_its_value() -> None:
    again = recorded(0.5, "again", seed=5)
    fit = fitted([*RECORDS, again], cases={"monday": ["run1", "again", "later"]})
    assert set(model_of(fit).by_case["gain"]) == {"monday", "run2", "run3"}
    assert any("later (monday)" in note for note in fit.notes)
    later = TraceSet(name="rig", traces=(recorded(0.5, "later", seed=6),), roles={"later": Role.TEST})
    found = evaluate(fit.model, later, Start(), repeats=0).cases["later"]
    assert found.constants["gain"] == model_of(fit).by_case["gain"]["monday"]
    with pytest.raises(ConfigError, match="no record of the case monday is fitted"):
        fitted(cases={"monday": ["run9"]})


def test_bounds_and_what_records_leave_open_are_told_by_case() -> None:
    still = recorded(1.0, "still", size=0.0, begin=2.0)
    fit = fitted([*RECORDS, still], parameters=BY_CASE | {"gain": {"start": 1.0, "high": 1.5, "per": "case"}})
    assert any("The parameter gain of run3 stands at its bound, 1.5" in one for one in fit.warnings)
    assert any("do not determine the parameter gain of still" in one for one in fit.warnings)
    assert not any("gain of run1" in one for one in fit.warnings)


def test_a_prior_holds_each_case_on_its_own() -> None:
    still = recorded(1.0, "still", size=0.0, begin=2.0)
    fit = fitted([*RECORDS, still], parameters=BY_CASE | {"gain": {"start": 1.2, "prior": 0.5, "per": "case"}})
    found = model_of(fit).by_case["gain"]
    assert (found["still"], found["run3"]) == (pytest.approx(1.2, abs=1e-4), pytest.approx(2.0, abs=0.01))
    assert fit.uncertainty is not None
    assert fit.uncertainty.standard_deviations[-1] == pytest.approx(0.5, rel=1e-3)
    assert fit.evidence is not None
    assert {"gain of run1", "gain of still"} <= set(fit.evidence.alphas)


def test_it_is_stored_and_read_again(fit: FitResult) -> None:
    again = FitResult.from_dict(fit.to_dict())
    assert model_of(again).by_case == model_of(fit).by_case
    assert again.model.structure == fit.model.structure


def test_several_outputs_share_the_cases() -> None:
    channels = (*RECORDS[0].channels, Channel(name="z", unit="V"))
    noise = np.random.default_rng(3).standard_normal(150)
    both = [
        replace(one, channels=channels, values=np.column_stack([one.values, 2.0 * one["y"] + 0.1 * noise]))
        for one in RECORDS
    ]
    grey = GreyBox(equations=f"{EQUATIONS}; z = b*x", parameters=BY_CASE | {"b": 1.0}).for_outputs(2)
    mapping = Mapping.parse("u -> y+z")
    fit = fit_grey_box(both, mapping, grey, sysid.Training(starts=1), start=ESTIMATED)  # type: ignore[arg-type]
    assert list(fit.model.by_case["gain"].values()) == pytest.approx(list(TRUE.values()), rel=0.02)  # type: ignore[attr-defined]
    assert fit.model.for_case("run1").simulate(np.ones((9, 1))).shape == (9, 2)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"parameters": BY_CASE | {"gain": {"start": 1, "per": "day"}}}, "no such thing to have a value per"),
        (
            {"parameters": BY_CASE | {"gain": {"start": 1, "per": "case", "fixed": True}}},
            "each case is to have its own",
        ),
        ({"parameters": {"a": 1, "gain": 1}, "cases": {"all": ["run1"]}}, "no parameter has a value per case"),
        ({"cases": {"a": ["run1"], "b": ["run1"]}}, "the record run1 is named twice"),
        ({"cases": {"a": "run1"}}, "cases are no records by name"),
        ({"cases": ["run1"]}, "cases are no records by name"),
    ],
)
def test_fields_that_cannot_be_are_refused(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError, match=words) as caught:
        GreyBox(**{"equations": EQUATIONS, "parameters": BY_CASE, **fields})
    assert caught.value.remedy
