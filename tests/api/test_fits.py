"""Fits that answer: simulate, predict, residuals, plot, summary, save; one output and several."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

import sysid
from sysid.api.system_fit import TRUSTED_LEAST
from sysid.errors import ChannelError, ConfigError, TraceError, UserError
from sysid.estimation import Status
from sysid.models import History

U = np.repeat([0.0, 1.0, -1.0, 0.5, 0.0], 20)
ORDERS = sysid.ARX(na=1, nb=1, nk=1)


def lag(u: NDArray[np.float64], first: float = 0.0) -> NDArray[np.float64]:
    y = np.full(len(u), first)
    for k in range(len(u) - 1):
        y[k + 1] = 0.8 * y[k] + 0.2 * u[k]
    return y


Y = lag(U)


@pytest.fixture(scope="module")
def fit() -> sysid.Fit:
    found = sysid.fit(sysid.data((U, Y), sample_time=0.1), "u -> y", ORDERS)
    assert isinstance(found, sysid.Fit)
    return found


@pytest.fixture(scope="module")
def system() -> sysid.SystemFit:
    frame = pd.DataFrame({"u": U, "y": Y, "z": 2.0 * Y + 1.0})
    found = sysid.fit(sysid.data(frame, inputs="u", outputs=["y", "z"], sample_time=0.1), "u -> y+z", ORDERS)
    assert isinstance(found, sysid.SystemFit)
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


OUTPUTS: dict[str, Any] = {
    "columns in another order": pd.DataFrame({"z": 2.0 * Y + 1.0, "u": U, "y": Y}),
    "dict": {"z": 2.0 * Y + 1.0, "y": Y},
    "trace": sysid.data({"z": 2.0 * Y + 1.0, "y": Y}, sample_time=0.1)["record"],
}


@pytest.mark.parametrize("kind", OUTPUTS)
def test_measured_outputs_are_taken_by_their_names(system: sysid.SystemFit, kind: str) -> None:
    expected = system.predict(np.column_stack([Y, 2.0 * Y + 1.0]), U)
    assert_array_equal(system.predict(OUTPUTS[kind], U), expected)


STAMPS = pd.date_range("2024-01-01", periods=100, freq="100ms")
REFUSED: dict[str, Any] = {
    "channels in rows": np.vstack([Y, Y]),
    "a third column": np.column_stack([Y, Y, Y]),
    "a missing value": np.column_stack([Y, np.where(Y > 0.5, np.nan, Y)]),
    "an infinite one": np.column_stack([Y, np.where(Y > 0.5, np.inf, Y)]),
    "rows of other stamps": pd.DataFrame({"y": Y, "z": Y}, index=STAMPS + pd.Timedelta("100ms")),
    "another rate": pd.DataFrame({"y": Y, "z": Y}, index=pd.date_range("2024-01-01", periods=100, freq="50ms")),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_measured_outputs_that_do_not_go_with_the_inputs_are_refused(system: sysid.SystemFit, kind: str) -> None:
    u = pd.DataFrame({"u": U}, index=STAMPS)
    with pytest.raises(UserError):
        system.predict(REFUSED[kind], u)
    y = REFUSED[kind]["y"] if kind.startswith("rows") else y_of(REFUSED[kind])
    with pytest.raises(UserError):
        system["y"].predict(y, u)
    with pytest.raises(UserError):
        system.simulate(u, initial=(u, REFUSED[kind]))


def y_of(y: Any) -> Any:
    """What a fit of one output refuses for the same reason."""
    return y[:, 1:] if getattr(y, "shape", ())[1:] == (2,) and not hasattr(y, "columns") else y


def test_a_prediction_of_all_outputs_begins_where_it_is_told(system: sysid.SystemFit) -> None:
    y = np.column_stack([Y, 2.0 * Y + 1.0])
    found = system.predict(y[5:], U[5:], initial=(U[:5], y[:5]))
    assert_allclose(found, y[5:], atol=1e-12)
    assert_allclose(system.predict(y, U, initial={"y": 3.0})[0], [2.4, 1.0], atol=1e-12)


@pytest.mark.parametrize("steps", [0, -1, 1.5])
def test_a_prediction_looks_whole_samples_ahead(fit: sysid.Fit, steps: Any) -> None:
    with pytest.raises(ConfigError, match="whole samples ahead"):
        fit.predict(Y, U, steps=steps)


@pytest.mark.parametrize("initial", [float("nan"), [1.0, 2.0], "a"])
def test_a_level_to_begin_at_is_one_finite_number(fit: sysid.Fit, initial: Any) -> None:
    with pytest.raises(ConfigError, match="one finite number"):
        fit.simulate(U, initial=initial)


@pytest.mark.parametrize("initial", [[1.0, 2.0], "a", float("nan")])
def test_levels_of_several_outputs_are_by_name(system: sysid.SystemFit, initial: Any) -> None:
    with pytest.raises(ConfigError, match="one finite number") as refused:
        system.simulate(U, initial=initial)
    assert "several outputs are a dict by name" in str(refused.value.remedy)
    with pytest.raises(TraceError, match="no samples before a run") as refused_pair:
        system.simulate(U, initial=(1.0, 2.0))
    assert 'initial={"y": ..., "z": ...}' in str(refused_pair.value.remedy)
    assert_allclose(system.simulate(U, initial=2.0), system.simulate(U, initial={"y": 2.0, "z": 2.0}))


@pytest.mark.parametrize("whole", [True, False], ids=["one model", "a model an output"])
def test_residuals_of_several_outputs_are_asked_for_by_name(system: sysid.SystemFit, whole: bool) -> None:
    data = system.traces
    found = sysid.fit(data, "u -> y+z", sysid.LinearStateSpace(states=1)) if whole else system
    assert found.residuals(output="z").n_samples > 50
    with pytest.raises(ConfigError, match="one output at a time") as refused:
        found.residuals()
    assert 'residuals(output="y")' in str(refused.value.remedy)
    with pytest.raises(ChannelError, match="missing channel w"):
        found.residuals(output="w")


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


def test_several_outputs_are_one_system(system: sysid.SystemFit) -> None:
    assert system.outputs == ("y", "z")
    assert_allclose(system.simulate(U, initial={"y": 0.0, "z": 1.0}), np.column_stack([Y, 2.0 * Y + 1.0]), atol=1e-10)
    assert repr(system) == "<SystemFit of y, z: EXACT, EXACT>"
    assert system["z"].model.mapping.output == "z"
    assert len(system.plot().axes) == 2
    assert system.summary().count("ARX [1; 1; 1], u") == 2
    with pytest.raises(ChannelError):
        system["x"]
    with pytest.raises(ChannelError):
        system.simulate(U, initial={"x": 0.0})


def test_a_bundle_runs_arrays_and_frames(fit: sysid.Fit, system: sysid.SystemFit, tmp_path: Path) -> None:
    single = fit.save(tmp_path / "one", formats=("onnx",))
    assert_allclose(single.simulate(U, initial=0.0), Y, atol=1e-12)
    assert_allclose(sysid.read_bundle(tmp_path / "one").simulate(U), fit.simulate(U), atol=1e-12)
    index = pd.timedelta_range("0s", periods=len(U), freq="100ms")
    frame = single.simulate(pd.DataFrame({"u": U}, index=index), initial=0.0)
    assert list(frame.columns) == ["y"] and frame.index.equals(index)
    both = system.save(tmp_path / "two", formats=("onnx",))
    assert_allclose(both.simulate(U, initial={"y": 0.0, "z": 1.0}), np.column_stack([Y, 2.0 * Y + 1.0]), atol=1e-10)
    with pytest.raises(ConfigError, match="do not match the model"):
        single.simulate(np.zeros((10, 2)))
    with pytest.raises(ChannelError):
        both.simulate(U, initial={"x": 0.0})


def test_several_outputs_are_saved_as_one_file(system: sysid.SystemFit, tmp_path: Path) -> None:
    bundle = system.save(tmp_path / "bundle", formats=("onnx",))
    assert [output["name"] for output in bundle.outputs] == ["y", "z"]
    assert {file.name for file in bundle.files} == {"step.onnx", "sequence.onnx"}


def test_a_parameter_that_the_data_leave_open_has_no_spread_in_the_summary() -> None:
    still = sysid.data((U, np.full(len(U), 0.36)), sample_time=0.1)
    found = sysid.fit(still, "u -> y", sysid.ARX(na=2, nb=1, nk=0, intercept=False))
    assert isinstance(found, sysid.Fit)
    assert found.uncertainty is not None
    assert np.isnan(found.uncertainty.standard_deviations).any()
    assert "± nan" not in found.summary()


@pytest.fixture(scope="module")
def whole() -> sysid.Fit:
    """One network of both outputs."""
    frame = pd.DataFrame({"u": U, "y": Y, "z": 2.0 * Y + 1.0})
    traces = sysid.data(frame, inputs="u", outputs=["y", "z"], sample_time=0.1)
    network = sysid.VectorNARX(input_delays=1, output_delays=1, neurons=1)
    training = sysid.Training(max_iterations=15)
    found = sysid.fit(traces, "u -> y+z", network, training, stability=sysid.StabilityOptions(count=5))
    assert isinstance(found, sysid.Fit)
    return found


def test_a_structure_with_several_outputs_is_one_fit(whole: sysid.Fit) -> None:
    both = np.column_stack([Y, 2.0 * Y + 1.0])
    assert_allclose(whole.simulate(U, initial={"y": 0.0, "z": 1.0}), both, atol=0.3)
    assert_allclose(whole.predict(both, U, steps=2), both, atol=0.3)
    assert whole.residuals(output="z").n_samples > 50
    figures = sysid.compare(whole.traces, whole).to_frame()
    assert figures["output"].tolist() == ["y", "z"]
    assert figures["fit"].min() > 80.0
    assert len(whole.plot().axes) == 2
    with pytest.raises(ChannelError, match="initial"):
        whole.simulate(U, initial={"x": 0.0})


def test_a_structure_with_several_outputs_is_saved_as_one_model(whole: sysid.Fit, tmp_path: Path) -> None:
    bundle = whole.save(tmp_path / "bundle", formats=("onnx", "c"))
    assert [one["name"] for one in bundle.outputs] == ["y", "z"]
    assert_allclose(bundle.simulate(U), whole.simulate(U), atol=1e-9)
    again = sysid.read_bundle(tmp_path / "bundle")
    assert_array_equal(again.simulate(U, initial={"y": 0.3}), bundle.simulate(U, initial={"y": 0.3}))


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


def test_a_fit_of_several_outputs_says_how_it_ended_as_any_other() -> None:
    """A loop over structures asked each fit for its status, and that of several models had none."""
    assert set(TRUSTED_LEAST) == set(Status)
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1.0, 1.0, 30), 10)
    y = np.convolve(u, 0.1 * 0.9 ** np.arange(300))[:300] + 0.01 * rng.standard_normal(300)
    traces = sysid.data((u, np.column_stack([y, np.full(300, 2.0)])), sample_time=1.0)
    fit = sysid.fit(traces, "u -> y1+y2", sysid.ARX(na=1, nb=1, nk=1))
    assert isinstance(fit, sysid.SystemFit)
    assert fit.status is Status.EXACT
    assert any(note.startswith("y2: y2 never changes") for note in fit.warnings)
    worse = replace(fit["y1"], status=Status.UNSTABLE)
    assert sysid.SystemFit.of({"y1": worse, "y2": fit["y2"]}).status is Status.UNSTABLE
