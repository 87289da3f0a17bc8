"""Fits that answer: simulate, predict, residuals, plot, summary, save."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from numpy.testing import assert_allclose, assert_array_equal

import sysid
from sysid.errors import ChannelError, ConfigError, TraceError
from sysid.models import History
from tests.api.first_order import ORDERS, U, Y, lag


@pytest.fixture(scope="module")
def fit() -> sysid.Fit:
    found = sysid.fit(sysid.data((U, Y), sample_time=0.1), "u -> y", ORDERS)
    assert isinstance(found, sysid.Fit)
    return found


INPUTS: dict[str, Any] = {
    "one dimension": U,
    "one column": U[:, None],
    "list": U.tolist(),
    "dict": {"u": U, "other": Y},
    "frame": pd.DataFrame({"other": Y, "u": U}),
    "trace": sysid.data((U, Y), sample_time=0.1)["record"],
}


@pytest.mark.parametrize("kind", INPUTS)
def test_a_free_run_takes_inputs_of_any_kind(fit: sysid.Fit, kind: str) -> None:
    assert_allclose(fit.simulate(INPUTS[kind], initial=0.0), Y, atol=1e-12)


def test_a_free_run_begins_where_it_is_told(fit: sysid.Fit) -> None:
    held = fit.simulate(U, initial=3.0)
    assert_allclose(held, lag(U, 0.8 * 3.0), atol=1e-12)
    before = (U[:5], Y[:5])
    assert_allclose(fit.simulate(U[5:], initial=before), Y[5:], atol=1e-12)
    assert_array_equal(fit.simulate(U, initial=History.at_rest(inputs=U[:1], output=3.0)), held)


def test_a_prediction_starts_each_sample_from_the_measurement(fit: sysid.Fit) -> None:
    shifted = Y + 1.0
    expected = 0.8 * np.concatenate([[1.0], shifted[:-1]]) + 0.2 * np.concatenate([U[:1], U[:-1]])
    assert_allclose(fit.predict(shifted, U, initial=1.0), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("traces", "words"),
    [
        (sysid.data((U, Y), sample_time=0.2), "another sample time"),
        (sysid.data((U, Y), sample_time=0.1, units={"u": "mV", "y": "m"}), "another unit"),
    ],
)
def test_a_record_of_another_rate_or_unit_is_no_record_of_the_model(traces: Any, words: str) -> None:
    made = sysid.fit(sysid.data((U, Y), sample_time=0.1, units={"u": "V", "y": "m"}), "u -> y", ORDERS)
    for use in (lambda: sysid.compare(traces, made), lambda: made.residuals(traces), lambda: made.plot(traces)):
        with pytest.raises(ConfigError, match=words):
            use()


@pytest.mark.parametrize("steps", [0, -1, 1.5])
def test_a_prediction_looks_whole_samples_ahead(fit: sysid.Fit, steps: Any) -> None:
    with pytest.raises(ConfigError, match="whole samples ahead"):
        fit.predict(Y, U, steps=steps)


@pytest.mark.parametrize("initial", [float("nan"), [1.0, 2.0], "a"])
def test_a_level_to_begin_at_is_one_finite_number(fit: sysid.Fit, initial: Any) -> None:
    with pytest.raises(ConfigError, match="one finite number"):
        fit.simulate(U, initial=initial)


def test_what_does_not_match_the_model_is_refused(fit: sysid.Fit) -> None:
    with pytest.raises(ConfigError, match="do not match the model"):
        fit.simulate(np.zeros((10, 2)))
    with pytest.raises(ChannelError):
        fit.simulate({"v": U})
    with pytest.raises(TraceError, match="different lengths"):
        fit.predict(Y[:-1], U)


def test_a_fit_says_what_it_is(fit: sysid.Fit) -> None:
    assert repr(fit) == "<Fit of ARX [1; 1; 1], u -> y: EXACT>"
    assert f"{fit.model.structure.label}, u -> y" in fit.summary()
    assert fit._repr_html_().startswith("<pre>")
    assert fit.residuals().n_samples == len(U) - 20  # a fifth gave the initial state


def test_a_figure_can_be_restyled(fit: sysid.Fit, tmp_path: Path) -> None:
    figure = fit.plot()
    assert isinstance(figure, Figure)
    (axes,) = figure.axes
    axes.set_title("ours")
    figure.savefig(tmp_path / "fit.png")
    assert (tmp_path / "fit.png").stat().st_size > 0


def test_a_bundle_runs_arrays_and_frames(fit: sysid.Fit, tmp_path: Path) -> None:
    single = fit.save(tmp_path / "one", formats=("onnx",))
    assert_allclose(single.simulate(U, initial=0.0), Y, atol=1e-12)
    assert_allclose(sysid.read_bundle(tmp_path / "one").simulate(U), fit.simulate(U), atol=1e-12)
    index = pd.timedelta_range("0s", periods=len(U), freq="100ms")
    frame = single.simulate(pd.DataFrame({"u": U}, index=index), initial=0.0)
    assert list(frame.columns) == ["y"] and frame.index.equals(index)
    with pytest.raises(ConfigError, match="do not match the model"):
        single.simulate(np.zeros((10, 2)))


def test_a_parameter_that_the_data_leave_open_has_no_spread_in_the_summary() -> None:
    still = sysid.data((U, np.full(len(U), 0.36)), sample_time=0.1)
    found = sysid.fit(still, "u -> y", sysid.ARX(na=2, nb=1, nk=0, intercept=False))
    assert isinstance(found, sysid.Fit)
    assert found.uncertainty is not None
    assert np.isnan(found.uncertainty.standard_deviations).any()
    assert "± nan" not in found.summary()


def test_a_trace_in_other_units_is_no_input() -> None:
    """Its numbers would be taken for others: a thousand volts for one."""
    (same,) = sysid.data((U, Y), sample_time=0.1, units={"u": "V"})
    fit = sysid.fit(same, "u -> y", ORDERS)
    assert_array_equal(fit.simulate(same), fit.simulate(U))
    (other,) = sysid.data((1000.0 * U, Y), sample_time=0.1, units={"u": "mV"})
    with pytest.raises(ConfigError, match="in another unit than the model"):
        fit.simulate(other)


def test_samples_before_a_run_are_numbers(fit: sysid.Fit) -> None:
    with pytest.raises(TraceError, match=r"(?s)a value is missing.*samples before a run"):
        fit.simulate(U, initial=(U[:3], [0.0, float("nan"), 0.0]))


@pytest.mark.parametrize(
    "given",
    [U[20:], list(U[20:]), U[None, 20:], np.ma.array(U[20:]), pd.Series(U[20:])],
    ids=lambda one: type(one).__name__,
)
def test_one_input_may_lie_flat_wherever_a_model_is_run(fit: sysid.Fit, given: Any) -> None:
    expected = fit.model.simulate(U[20:, None])
    assert_array_equal(fit.simulate(given), expected)
    if np.ndim(given) == 1:
        assert_array_equal(fit.model.simulate(given), expected)
        assert_array_equal(fit.model.predict(given, Y[20:]), fit.predict(Y[20:], given))


def test_what_is_masked_is_no_number_to_a_model(fit: sysid.Fit) -> None:
    masked = np.ma.masked_where(np.arange(len(U)) == 30, U)
    run = fit.model.simulate(masked)
    assert np.isfinite(run[:31]).all()
    assert np.isnan(run[31:]).all()


@pytest.mark.parametrize("given", [["a", "b"], U + 1j, np.zeros((0, 1))], ids=["text", "complex", "empty"])
def test_a_model_refuses_what_are_no_numbers(fit: sysid.Fit, given: Any) -> None:
    with pytest.raises(TraceError):
        fit.model.simulate(given)
    with pytest.raises((TraceError, ConfigError)):
        fit.simulate(given)


def test_measured_output_that_is_no_number_is_refused(fit: sysid.Fit) -> None:
    with pytest.raises(ConfigError, match=r"(?s)the measured outputs.*expected: numbers"):
        fit.predict(["a"] * len(U), U)


def test_a_sample_before_a_run_that_says_nothing_is_refused() -> None:
    """As a level is: one sample alone is a system at rest, and these rest where their inputs hold them."""
    traces = sysid.data((U, Y), sample_time=0.1)
    found = sysid.fit(traces, "u -> y", sysid.OE(nb=1, nf=1, nk=1))
    with pytest.raises(ConfigError, match="says nothing"):
        found.simulate(U[50:], initial=(U[49:50], Y[49:50] + 1.0))
    assert_allclose(found.simulate(U[50:], initial=(U[40:50], Y[40:50])), Y[50:], atol=1e-6)


@pytest.mark.parametrize("level", ["1", np.array([1.0]), float("nan"), True, None, {"y": [1.0]}, {"z": 1.0}], ids=repr)
def test_a_level_at_rest_is_a_number_of_an_output(level: Any) -> None:
    traces = sysid.data((U, Y), sample_time=0.1)
    if level is None:
        sysid.fit(traces, "u -> y", ORDERS, start="rest", rest_output=level)
        return
    with pytest.raises((ConfigError, ChannelError)):
        sysid.fit(traces, "u -> y", ORDERS, start="rest", rest_output=level)


def test_a_trace_before_a_run_is_both_of_its_signals(fit: sysid.Fit) -> None:
    before: Any = fit.traces.traces[0]
    run = fit.simulate(U, initial=before)
    np.testing.assert_array_equal(run, fit.simulate(U, initial=(before["u"], before["y"])))


def test_a_frame_is_no_data_set_to_any_word_of_a_fit(fit: sysid.Fit, tmp_path: Path) -> None:
    frame: Any = pd.DataFrame({"u": U, "y": Y})
    for ask in (fit.plot, fit.residuals, lambda given: fit.save(tmp_path / "bundle", given, formats=("c",))):
        with pytest.raises(ConfigError, match="takes a data set"):
            ask(frame)


@pytest.mark.parametrize(
    "structure",
    [ORDERS, sysid.OE(nb=1, nf=1, nk=1), sysid.LinearStateSpace(states=1)],
    ids=lambda one: type(one).__name__,
)
@pytest.mark.parametrize(
    "theta", [[1.0], np.zeros(99), "text", None, np.zeros((3, 1))], ids=["one", "many", "text", "none", "table"]
)
def test_other_parameters_are_as_many_as_there_are(structure: Any, theta: Any) -> None:
    model = sysid.fit(sysid.data((U, Y), sample_time=0.1), "u -> y", structure).model
    with pytest.raises(ConfigError, match="not the parameters of the model"):
        model.with_theta(theta)


def test_a_record_is_not_made_a_record_again(fit: sysid.Fit) -> None:
    for given in (fit.traces, fit.traces.traces[0], list(fit.traces)):
        with pytest.raises(ConfigError, match="already is what a fit takes"):
            sysid.data(given)


def test_orders_and_lengths_are_whole_numbers(fit: sysid.Fit) -> None:
    given: Any
    for given in (range(1, 3), "3", 2.5, True, -1):
        with pytest.raises(ConfigError, match="not a largest order"):
            sysid.search_orders(fit.traces, "u -> y", max_na=given)
    with pytest.raises(ConfigError, match="not a length"):
        sysid.impulse_response(fit.traces, "u -> y", lags="5")  # type: ignore[arg-type]


@pytest.mark.parametrize("first", [0.0, 1.0])
def test_a_level_that_a_model_happens_to_rest_at_is_no_level_to_begin_at(first: float, tmp_path: Path) -> None:
    """A transfer function begins where its inputs hold it: the output of the record's first sample did nothing."""
    u = U + 0.5
    traces = sysid.data((u, lag(u, first)), sample_time=0.1)
    found = sysid.fit(traces, "u -> y", sysid.OE(nb=1, nf=1, nk=1))
    assert found.model.resting == first
    bundle = found.save(tmp_path, formats=("c",))
    for one in (found, bundle):
        with pytest.raises(ConfigError, match="says nothing"):
            one.simulate(u, initial=first)
        held = np.full(len(u), first)
        assert_allclose(one.simulate(held, initial=first), held, atol=1e-6)
    arx = sysid.fit(traces, "u -> y", ORDERS)
    assert_allclose(arx.simulate(u, initial=first)[0], 0.8 * first + 0.1, atol=1e-9)
