"""Intervals by profile likelihood, beside fits of the others by brute force."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy

import sysid
from sysid.errors import ConfigError
from sysid.estimation.results.result import FitResult

SATURATING = "y = top*(1 - exp(-rate*u))"


def recorded(reach: float, *, n: int = 40, seed: int = 1, noise: float = 0.08) -> sysid.Fit | Any:
    """A sensor that saturates at 3, over inputs up to some reach."""
    u = np.linspace(0.05 * reach, reach, n)
    y = 3.0 * (1.0 - np.exp(-0.5 * u)) + noise * np.random.default_rng(seed).standard_normal(n)
    return sysid.data((u, y), inputs="u", outputs="y", sample_time=1.0)


def fitted(traces: Any, equations: str = SATURATING, **fields: Any) -> sysid.Fit:
    given: dict[str, Any] = {"parameters": {"top": {"start": 2, "low": 0}, "rate": {"start": 1, "low": 0}}, **fields}
    found = sysid.fit(
        traces, "u -> y", sysid.GreyBox(equations=equations, **given), sysid.Training(starts=1), start=sysid.Start(),
        rest_output=0.0, stability=sysid.StabilityOptions(count=0),
    )  # fmt: skip
    assert isinstance(found, sysid.Fit)
    return found


def slow_ends(traces: Any, fit: FitResult, which: str) -> list[float]:
    """Where the least squares over the other parameter rise by what noise allows, found by bisection."""
    record = traces.traces[0]
    u, y = record["u"], record["y"]

    def best(value: float) -> float:
        if which == "rate":
            form = 1.0 - np.exp(-value * u)
            top = form @ y / (form @ form)
            return float(np.sum((y - top * form) ** 2))
        return float(
            scipy.optimize.minimize_scalar(
                lambda rate: np.sum((y - value * (1.0 - np.exp(-rate * u))) ** 2), bounds=(1e-3, 20.0),
                method="bounded", options={"xatol": 1e-10},
            ).fun
        )  # fmt: skip

    at = fit.model.parameters[which]  # type: ignore[attr-defined]
    assert fit.evidence is not None
    independent = len(y) / fit.evidence.correlation_time - 2
    left = best(at)

    def beyond(value: float) -> float:
        return (best(value) - left) / left * independent - scipy.stats.chi2.ppf(0.95, 1)

    return [scipy.optimize.brentq(beyond, at, end) for end in (0.5 * at, 4.0 * at)]


@pytest.fixture(scope="module")
def traces() -> Any:
    return recorded(2.0)


@pytest.fixture(scope="module")
def fit(traces: Any) -> sysid.Fit:
    return fitted(traces, intervals="profile")


def test_ends_are_where_brute_force_has_them(traces: Any, fit: sysid.Fit) -> None:
    assert fit.uncertainty is not None
    assert fit.uncertainty.profile is not None
    for name, ends in zip(fit.uncertainty.names, fit.uncertainty.profile, strict=True):
        slow = slow_ends(traces, fit, name)
        assert ends == pytest.approx(slow, abs=0.006 * (slow[1] - slow[0]))


def test_where_the_curvature_is_visibly_wrong_it_is_told(fit: sysid.Fit) -> None:
    assert fit.uncertainty is not None
    assert fit.uncertainty.profile is not None
    (low, high), (near, far) = fit.uncertainty.interval()[0], fit.uncertainty.profile[0]
    top = fit.uncertainty.values[0]
    assert high - top == pytest.approx(top - low)
    assert far - top > 1.4 * (top - near)
    assert any("interval of top by profile likelihood" in note for note in fit.notes)
    assert "by profile likelihood" in fit.summary()


def test_one_parameter_of_a_fit_that_has_ended(fit: sysid.Fit) -> None:
    assert fit.uncertainty is not None
    assert fit.uncertainty.profile is not None
    found = fit.profile("top")
    assert (found.low, found.high) == pytest.approx(fit.uncertainty.profile[0], rel=2e-3)
    assert (np.diff(found.values) > 0.0).all()
    assert found.deviances[np.argmin(np.abs(found.values - found.value))] == pytest.approx(0.0, abs=1e-6)
    narrow = fit.profile("top", level=0.5)
    assert found.low < narrow.low < narrow.high < found.high


def test_a_linear_run_has_the_interval_of_its_curvature(traces: Any) -> None:
    fit = fitted(traces, "y = a*u + b", parameters={"a": 1, "b": {"start": 1, "prior": 2.0}}, intervals="profile")
    assert fit.uncertainty is not None
    assert fit.uncertainty.profile == pytest.approx(fit.uncertainty.interval(), rel=3e-3)
    assert not any("by profile likelihood" in note for note in fit.notes)


def test_an_interval_that_the_records_do_not_end_has_no_end() -> None:
    fit = fitted(recorded(0.5, noise=0.04), intervals="profile")
    assert fit.uncertainty is not None
    assert fit.uncertainty.profile is not None
    low, high = fit.uncertainty.profile[0]
    assert 0.0 < low < fit.uncertainty.values[0]
    assert high == np.inf
    assert any("do not end the 95 % interval of top" in note for note in fit.notes)
    again = FitResult.from_dict(fit.to_dict())
    assert again.uncertainty is not None
    np.testing.assert_array_equal(again.uncertainty.profile, fit.uncertainty.profile)


def test_a_bound_that_comes_first_is_the_end(traces: Any) -> None:
    fit = fitted(traces, parameters={"top": {"start": 2.9, "high": 3.2}, "rate": {"start": 1, "low": 0}})
    found = fit.profile("top")
    assert (found.high, found.bound) == (pytest.approx(3.2), ("high",))
    assert found.low < found.value


def test_values_by_case_have_intervals_of_their_own() -> None:
    both = [recorded(2.0, seed=seed).traces[0] for seed in (1, 2)]
    values = {f"day{i}": (one["u"], (i + 1) * one["y"]) for i, one in enumerate(both)}
    traces = sysid.data(values, inputs="u", outputs="y", sample_time=1.0)
    parameters = {"top": {"start": 2, "low": 0, "per": "case"}, "rate": {"start": 1, "low": 0}}
    fit = fitted(traces, parameters=parameters, intervals="profile")
    assert fit.uncertainty is not None
    assert fit.uncertainty.names == ("top of day0", "rate", "top of day1")
    assert fit.uncertainty.profile is not None
    low, high = fit.profile("top of day1").low, fit.profile("top of day1").high
    assert (low, high) == pytest.approx(fit.uncertainty.profile[2], rel=5e-3)
    assert low < 6.0 < high


@pytest.mark.parametrize(
    ("name", "level", "words"), [("tops", 0.95, "no parameter tops was estimated"), ("top", 1.0, "not a probability")]
)
def test_what_cannot_be_profiled_is_refused(fit: sysid.Fit, name: str, level: float, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        fit.profile(name, level=level)


def test_a_fit_that_is_none_of_equations_has_no_profile(traces: Any) -> None:
    fit = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=0))
    assert isinstance(fit, sysid.Fit)
    with pytest.raises(ConfigError, match="there is no profile of this fit"):
        fit.profile("a1")
    with pytest.raises(ConfigError, match="there are no such intervals") as caught:
        sysid.GreyBox(equations="y = a*u", parameters={"a": 1}, intervals="profiles")
    assert caught.value.remedy == "did you mean profile?"
