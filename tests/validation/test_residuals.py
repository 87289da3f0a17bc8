"""Residual analysis: what is right passes, what is wrong fails at the lag where it is wrong."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from sysid.errors import TraceError
from sysid.estimation import TransferFunctionTraining, fit_arx, fit_transfer_function
from sysid.models import ARX, NARX, Mapping, NARXModel, Scaling, TransferFunction, parameter_count
from sysid.traces import Trace
from sysid.validation.residuals import analyse_residuals
from tests.estimation.linear_systems import arx_response, steps, trace_of

MAPPING = Mapping.parse("u1+u2 -> y")
A, B = [1.5, -0.7], [[0.0, 1.0, 0.5], [0.0, 0.0, 0.0, 0.3]]
RIGHT, SHORT, LATE = (
    ARX(na=2, nb=(2, 1), nk=(1, 3)),
    ARX(na=1, nb=(2, 1), nk=(1, 3)),
    ARX(na=2, nb=(2, 1), nk=(1, 5)),
)


def record(seed: int, *, n: int = 2000, held: int = 3) -> Trace:
    rng = np.random.default_rng(seed)
    u = steps(n, 2, rng, held=held)
    return trace_of(u, arx_response(A, B, u, 0.2 * rng.normal(size=n)), name=f"t{seed}")


def test_a_right_model_passes_as_often_as_it_should() -> None:
    white = independent = 0
    for seed in range(100):
        analysis = analyse_residuals(fit_arx([record(seed)], MAPPING, RIGHT).model, [record(seed)])
        white += analysis.white
        independent += analysis.independent
    assert white >= 95
    assert independent >= 95


def test_single_lags_keep_their_bounds_for_held_inputs_too() -> None:
    """99 % bounds: of residuals that owe nothing to the inputs one value in a hundred lies outside."""
    outside = count = 0
    for seed in range(60):
        trace = record(seed, held=12)
        analysis = analyse_residuals(fit_arx([record(seed + 500, held=12)], MAPPING, RIGHT).model, [trace])
        for correlation in analysis.inputs:
            outside += int(np.sum(np.abs(correlation.values) > correlation.bound))
            count += len(correlation.values)
    assert 0.002 <= outside / count <= 0.03


def test_an_order_too_low_is_not_white() -> None:
    analysis = analyse_residuals(fit_arx([record(0)], MAPPING, SHORT).model, [record(0)])
    assert not analysis.white
    assert 1 in analysis.whiteness.outside


def test_a_missing_input_lag_shows_there() -> None:
    """The second input acts from lag 3 on, and the model lets it act from lag 5 on."""
    analysis = analyse_residuals(fit_arx([record(0, held=1)], MAPPING, LATE).model, [record(0, held=1)])
    assert not analysis.independent
    first, second = analysis.inputs
    assert first.passed
    assert {3, 4} & set(second.outside.tolist())


def test_feedback_shows_at_negative_lags_only() -> None:
    rng = np.random.default_rng(0)
    e = rng.normal(size=3000)
    u = np.column_stack([0.5 * np.concatenate([np.zeros(4), e[:-4]]) + rng.normal(size=3000), rng.normal(size=3000)])
    trace = trace_of(u, arx_response([], [[0.0, 1.0], [0.0, 1.0]], u, e))
    fit = fit_arx([trace], MAPPING, ARX(na=0, nb=(1, 1), nk=(1, 1)))
    first = analyse_residuals(fit.model, [trace]).inputs[0]
    beyond = first.lags[np.abs(first.values) > first.bound]
    assert -4 in beyond
    assert first.passed


def test_ljung_box_is_that_of_its_authors() -> None:
    trace = record(1, n=400)
    model = fit_arx([trace], MAPPING, RIGHT).model
    e = trace["y"] - model.predict(trace.columns(["u1", "u2"]), trace["y"])
    e -= e.mean()
    r = np.array([e[k:] @ e[: len(e) - k] for k in range(11)]) / (e @ e)
    expected = 400 * 402 * sum(r[k] ** 2 / (400 - k) for k in range(1, 11))
    analysis = analyse_residuals(model, [trace], n_lags=10)
    assert analysis.ljung_box == pytest.approx(expected, rel=1e-9)
    np.testing.assert_allclose(analysis.whiteness.values, r[1:], atol=1e-12)


def test_free_run_residuals_of_an_output_error_model() -> None:
    rng = np.random.default_rng(3)
    u = steps(2000, 2, rng)
    clean = signal.lfilter([0.0, 1.0, 0.5], [1.0, -1.5, 0.7], u[:, 0]) + signal.lfilter(
        [0.0, 0.4], [1.0, -0.9], u[:, 1]
    )
    trace = trace_of(u, clean + 0.3 * rng.normal(size=2000))
    fit = fit_transfer_function(
        [trace], MAPPING, TransferFunction(poles=(2, 1), zeros=(1, 0), delays=(1, 1)),
        TransferFunctionTraining(scattered_starts=0), rest_output=0.0,
    )  # fmt: skip
    analysis = analyse_residuals(fit.model, [trace], free_run=True)
    assert analysis.white
    assert analysis.independent


def test_networks_are_analysed_too() -> None:
    network = NARX(input_delays=1, output_delays=1, neurons=2)
    size = parameter_count(network.lags(2), 2, linear=network.feedthrough)
    model = NARXModel(
        network=network, theta=np.full(size, 0.1), scaling=Scaling.identity(2), mapping=MAPPING, sample_time=1.0,
        input_units=("V", "A"), output_unit="bar", rest_output=0.0, clamp=3.0,
    )  # fmt: skip
    analysis = analyse_residuals(model, [record(0)])
    assert not analysis.white
    assert [correlation.name for correlation in analysis.inputs] == ["u1", "u2"]


def test_samples_that_do_not_count_do_not() -> None:
    trace = record(2)
    usable = np.ones(len(trace), dtype=bool)
    usable[100:150] = False
    spoilt = trace.values.copy()
    spoilt[120:130, 2] += 1e3
    gap = Trace(name="gap", sample_time=1.0, channels=trace.channels, values=spoilt, usable=usable)
    model = fit_arx([trace], MAPPING, ARX(na=0, nb=(2, 1), nk=(1, 3))).model
    analysis = analyse_residuals(model, [gap])
    assert analysis.n_samples == len(trace) - 50
    assert analysis.variance < 100.0


def test_experiments_are_not_concatenated() -> None:
    model = fit_arx([record(0)], MAPPING, RIGHT).model
    parts = [analyse_residuals(model, [record(seed)]) for seed in (0, 1)]
    both = analyse_residuals(model, [record(0), record(1)])
    assert both.n_samples == sum(part.n_samples for part in parts)
    assert both.variance == pytest.approx(np.mean([part.variance for part in parts]), rel=1e-2)


def test_the_result_is_json() -> None:
    import json

    fields = analyse_residuals(fit_arx([record(0)], MAPPING, RIGHT).model, [record(0)]).to_dict()
    assert json.loads(json.dumps(fields))["white"] is True


def test_too_few_residuals_are_refused() -> None:
    model = fit_arx([record(0)], MAPPING, RIGHT).model
    with pytest.raises(TraceError, match="cannot be analysed"):
        analyse_residuals(model, [record(0, n=20)])
