"""ARX of several outputs: a plain twin, a coupled plant, coverage, masks and several records."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import sysid
from sysid.errors import TraceError
from sysid.estimation import fit_arx
from sysid.estimation.linear.modes import modes
from sysid.estimation.linear.vector_arx import fit_vector_arx
from sysid.estimation.results.result import FitResult, Loop, Status
from sysid.models import ARX, Mapping, Start, VectorARX, VectorARXModel
from sysid.reporting.linear_views import linear_views
from sysid.traces import Channel, Trace
from sysid.validation import predict_interval

FREE = Start(kind="estimated")
COUPLED = VectorARX(na=[[1, 1], [1, 2]], nb=[[2, 1], [1, 1]], nk=[[1, 3], [2, 1]])
TRUTH = np.array([0.5, 0.2, 0.4, 0.7, 0.3, 0.3, 0.8, -0.3, 1.1, -0.3])
"""In the order of the terms: b(y0, u0, 1), b(y0, u0, 2), b(y0, u1, 3), a(y0, y0, 1), a(y0, y1, 1), ..."""
NOISE = 0.05 * np.array([[1.0, 0.0], [0.7, 0.6]])
MAPPING = Mapping.parse("u0+u1 -> y0+y1")


def plant(seed: int, n: int = 600, *, noise: float = 1.0, level: float = 0.0) -> Trace:
    """The coupled plant, its inputs held for three samples; its noise of both outputs hangs together."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], size=(n // 3 + 20, 2)), 3, axis=0)[: n + 50]
    e, y = noise * rng.normal(size=(len(u), 2)) @ NOISE.T, np.zeros((len(u), 2))
    for t in range(3, len(u)):
        for (i, c, lag), value in zip(COUPLED.terms, TRUTH, strict=True):
            y[t, i] += value * (u[t - lag, c] if c < 2 else y[t - lag, c - 2])
        y[t] += e[t]
    channels = tuple(Channel(name=name, unit="V") for name in MAPPING.channels)
    return Trace(name=f"r{seed}", sample_time=0.1, channels=channels, values=np.column_stack([u, y + level])[50:])


def rows(traces: list[Trace], orders: VectorARX, output: int, depth: int) -> tuple[Any, Any]:
    """Regressors and target of one output, as they are written."""
    X, target = [], []
    for trace in traces:
        values = trace.values
        for t in range(depth, len(values)):
            X.append([values[t - lag, c] for i, c, lag in orders.terms if i == output] + [1.0] * orders.intercept)
            target.append(values[t, len(MAPPING.inputs) + output])
    return np.array(X), np.array(target)


def model_of(fit: FitResult) -> VectorARXModel:
    assert isinstance(fit.model, VectorARXModel)
    return fit.model


@pytest.mark.parametrize("level", [0.0, 1e5])
def test_it_is_least_squares_of_each_output_and_the_covariance_of_both(level: float) -> None:
    traces = [plant(1, 200, level=level), plant(2, 300, level=level)]
    fit = fit_vector_arx(traces, MAPPING, COUPLED, start=FREE)
    known = fit.uncertainty
    assert known is not None and known.noise_covariance is not None and fit.status is Status.EXACT
    found, maps, errors = [], [], []
    own = np.concatenate([np.arange(2, len(one)) for one in traces]) > 2  # rows of the second output that both have
    for output, depth in enumerate((3, 2)):
        X, target = rows(traces, COUPLED, output, depth)
        middle = X - np.append(X[:, :-1].mean(axis=0), 0.0)  # of large levels: the same, with more digits
        maps.append(np.linalg.pinv(middle)[:-1])
        found.append(maps[-1] @ target)
        errors.append(target - target.mean() - (X[:, :-1] - X[:, :-1].mean(axis=0)) @ found[-1])
    assert_allclose(model_of(fit).coefficients, np.concatenate(found), rtol=1e-9 if level else 1e-12, atol=1e-9)
    assert [len(one) for one in errors] == [494, 496]
    both = errors[0], errors[1][own]
    size = np.sqrt([one @ one / (len(one) - 6) for one in errors])
    across = size.prod() * (both[0] @ both[1]) / np.sqrt((both[0] @ both[0]) * (both[1] @ both[1]))
    sigma = np.array([[size[0] ** 2, across], [across, size[1] ** 2]])
    assert_allclose(known.noise_covariance, sigma, rtol=1e-8)
    wide = np.zeros((len(maps[0]), len(errors[1])))
    wide[:, own] = maps[0]
    maps[0] = wide
    joint = np.block([[sigma[i, j] * P @ Q.T for j, Q in enumerate(maps)] for i, P in enumerate(maps)])
    assert_allclose(known.covariance[:10, :10], joint, rtol=1e-6, atol=1e-8 * np.abs(joint).max())
    assert known.names[2] == "b(y0, u1, 3)" and known.names[8] == "a(y1, y1, 1)"
    assert known.names[10:] == ("intercept(y0)", "intercept(y1)")


@pytest.mark.parametrize("start", [Start(), FREE, Start(kind="measured", n_measured=7)], ids=lambda one: one.kind.value)
def test_without_cross_orders_it_is_arx_of_each_output(start: Start) -> None:
    traces = [plant(3, 300), plant(4, 200)]
    fit = fit_vector_arx(traces, MAPPING, VectorARX(na=[[2, 0], [0, 2]], nb=2, nk=[1, 2]), start=start)
    for i, mapping in enumerate(MAPPING.each):
        alone: Any = fit_arx(traces, mapping, ARX(na=2, nb=(2, 2), nk=(1, 2)), start=start)
        own = slice(6 * i, 6 * i + 6)
        assert_allclose(model_of(fit).coefficients[own], alone.model.coefficients, rtol=1e-10, atol=1e-12)
        assert_allclose(model_of(fit).intercepts[i], alone.model.intercept, rtol=1e-9, atol=1e-12)
        assert fit.uncertainty is not None
        assert_allclose(fit.uncertainty.covariance[own, own], alone.uncertainty.covariance[:6, :6], rtol=1e-9)


def oscillators(seed: int, noise: float) -> tuple[Any, Any]:
    """Two that hardly die away and drive each other, each with an input of its own."""
    rng = np.random.default_rng(seed)
    u, e, y = (
        np.repeat(rng.choice([-1.0, 1.0], size=(180, 2)), 5, axis=0),
        rng.normal(size=(900, 2)),
        np.zeros((900, 2)),
    )
    for t in range(2, 900):
        y[t] = [1.8, 1.7] * y[t - 1] - 0.93 * y[t - 2] + [0.05, -0.05] * y[t - 1, ::-1] + 0.1 * u[t - 1] + noise * e[t]
    return u, y


def test_of_a_coupled_plant_the_free_run_is_right_where_that_of_each_output_alone_is_not() -> None:
    traces, (inputs, measured) = sysid.data(oscillators(1, 0.02), sample_time=1.0), oscillators(2, 0.0)
    score = []
    for orders in (VectorARX(na=2, nb=1, nk=1), ARX(na=2, nb=(1,), nk=(1,)), ARX(na=4, nb=(4,), nk=(1,))):
        fit = sysid.fit(traces, "u1+u2 -> y1+y2", orders, start=FREE)
        left = measured[20:] - fit.simulate(inputs[20:], initial=(inputs[:20], measured[:20]))
        score.append(1.0 - np.linalg.norm(left, axis=0) / np.linalg.norm(measured - measured.mean(axis=0), axis=0))
    assert score[0].min() > 0.95
    assert max(score[1].min(), score[2].min()) < 0.4


def masked(trace: Trace, holes: list[tuple[slice, int]]) -> tuple[Any, Any]:
    """The record with samples of some channels missing, and which are there."""
    usable = np.ones(trace.values.shape, dtype=bool)
    for where, channel in holes:
        usable[where, channel] = False
    values = np.where(usable, trace.values, np.nan)
    columns = {name: values[:, at] for at, name in enumerate(MAPPING.channels)}
    ends = {"inputs": list(MAPPING.inputs), "outputs": list(MAPPING.outputs)}
    return sysid.data(columns, **ends, sample_time=0.1, repairs={"nan": "mask"}), usable


def own_rows(usable: Any, output: int) -> list[int]:
    """Samples at which an output, and all that it reads, is measured; those before the record are not."""
    read = [(c, lag) for i, c, lag in COUPLED.terms if i == output] + [(len(MAPPING.inputs) + output, 0)]
    depth = max(lag for _, lag in read)
    return [t for t in range(depth, len(usable)) if all(usable[t - lag, c] for c, lag in read)]


HOLES = [(slice(100, 103), 2), (slice(200, 260), 3), (slice(300, 301), 1), (slice(310, 320), 0)]


def test_an_output_loses_the_rows_in_which_it_or_what_it_reads_is_masked_and_no_others() -> None:
    whole = plant(7, 400)
    broken, usable = masked(whole, HOLES)
    fit = sysid.fit(broken, "u0+u1 -> y0+y1", COUPLED, start=FREE)
    counts = []
    for output, depth in enumerate((3, 2)):
        X, target = rows([whole], COUPLED, output, depth)
        at = np.array(own_rows(usable, output)) - depth
        counts.append(len(at))
        true = np.linalg.lstsq(X[at], target[at], rcond=None)[0]
        own = [value for (i, *_), value in zip(COUPLED.terms, fit.model.coefficients, strict=True) if i == output]
        assert_allclose(own, true[:-1], rtol=1e-9)
    assert counts[0] != counts[1]


def test_intervals_hold_where_outputs_have_rows_of_their_own() -> None:
    inside, regions, noise = [], [], []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        holes = [(slice(at, at + 4), int(rng.integers(2, 4))) for at in rng.integers(0, 236, size=12)]
        traces, _ = masked(plant(3000 + seed, 240), [*holes, (slice(0, 60), 2)])
        known = fit_vector_arx(traces.estimation, MAPPING, COUPLED, start=FREE).uncertainty
        assert known is not None
        low, high = known.interval(0.95)[:10].T
        inside.append((low <= TRUTH) & (high >= TRUTH))
        away = known.values[:10] - TRUTH
        regions.append(away @ np.linalg.solve(known.covariance[:10, :10], away) <= 18.307)  # chi2, 10, 95 %
        noise.append(known.noise_covariance)
    assert 0.93 < np.mean(inside) < 0.97  # of 2,000
    assert 0.90 < np.mean(regions) < 0.985  # of 200
    assert_allclose(np.mean(noise, axis=0), NOISE @ NOISE.T, rtol=0.03)


def test_an_output_without_a_row_is_refused() -> None:
    traces, _ = masked(plant(7, 100), [(slice(1, 100, 2), 3)])
    with pytest.raises(TraceError, match="no sample has its past beside it"):
        fit_vector_arx(traces.estimation, MAPPING, COUPLED, start=FREE)


def test_a_long_record_is_taken_block_by_block_and_weights_count() -> None:
    trace = plant(8, 9000)
    fit = fit_vector_arx([trace], MAPPING, COUPLED, start=FREE)
    X, target = rows([trace], COUPLED, 1, 2)
    assert_allclose(model_of(fit).coefficients[5:], np.linalg.lstsq(X, target, rcond=None)[0][:-1], rtol=1e-10)


def test_95_percent_intervals_hold_95_percent() -> None:
    inside, regions = [], []
    for seed in range(400):
        fit = fit_vector_arx([plant(1000 + seed, 240)], MAPPING, COUPLED, start=FREE)
        known = fit.uncertainty
        assert known is not None
        low, high = known.interval(0.95)[:10].T
        inside.append((low <= TRUTH) & (high >= TRUTH))
        away = known.values[:10] - TRUTH
        regions.append(away @ np.linalg.solve(known.covariance[:10, :10], away) <= 18.307)  # chi2, 10, 95 %
    assert 0.93 < np.mean(inside) < 0.97  # of 4,000
    assert 0.92 < np.mean(regions) < 0.975  # of 400


def test_poles_and_frequency_responses_have_intervals_that_hold_the_truth() -> None:
    true = VectorARXModel(**{**vars_of(model_of(fit_vector_arx([plant(1)], MAPPING, COUPLED))), "coefficients": TRUTH})
    radius = np.abs(np.log(true.poles)) / 0.1
    w = np.array([0.1, 1.0, 5.0])
    of_poles, of_gains = [], []
    for seed in range(60):
        fit = fit_vector_arx([plant(2000 + seed, 400)], MAPPING, COUPLED, start=FREE)
        for mode in modes(fit.model, fit.uncertainty):
            low, high = mode.intervals.get("natural_frequency") or sorted(
                1.0 / np.array(mode.intervals["time_constant"])
            )
            of_poles.append(np.min(np.abs(radius - np.clip(radius, low, high))) < 1e-9)
        for view, ideal in zip(linear_views(fit.model, fit.uncertainty), linear_views(true, None), strict=True):
            low, high = np.quantile(np.abs(view.responses(w)[1:]), [0.025, 0.975], axis=0)
            here = np.abs(ideal.responses(w)[0])
            of_gains.append((low <= here) & (here <= high))
    assert 0.88 < np.mean(of_poles) < 0.99
    assert 0.91 < np.mean(of_gains) < 0.98


def test_intervals_of_the_output_hold_what_they_say() -> None:
    trace = plant(9, 1200)
    fit = sysid.fit([trace], "u0+u1 -> y0+y1", COUPLED, start=FREE)
    new = plant(10, 1200)
    for given in ({}, {"loop": Loop.OPEN}, {"loop": Loop.OPEN, "steps": 4}):
        interval = predict_interval(fit, new, **given)  # type: ignore[arg-type]
        assert 0.92 < interval.coverage(new.columns(MAPPING.outputs)).share < 0.98, given


def test_what_the_records_do_not_determine_is_told_and_has_no_interval() -> None:
    trace = plant(11)
    values = trace.values.copy()
    values[:, 1] = 2.0
    still = Trace(name="s", sample_time=0.1, channels=trace.channels, values=values)
    fit = fit_vector_arx([still], MAPPING, COUPLED, start=FREE)
    assert "The data determine 5 of 6 parameters of y0; the others are zero." in fit.notes
    assert fit.uncertainty is not None
    gone = np.isnan(np.diag(fit.uncertainty.covariance))
    assert [name for name, lost in zip(fit.uncertainty.names, gone, strict=True) if lost] == [
        "b(y0, u1, 3)", "b(y1, u1, 1)"
    ]  # fmt: skip
    assert np.isfinite(linear_views(fit.model, fit.uncertainty)[0].responses(np.array([1.0]))).all()
    assert len(linear_views(fit.model, fit.uncertainty)[0].B) > 1


def test_an_input_is_asked_for_as_many_coefficients_as_an_output_reads_of_it() -> None:
    t = np.arange(400)
    u = np.column_stack([np.sin(0.3 * t), np.random.default_rng(3).normal(size=400)])
    y = u @ [[0.5, 0.1], [0.2, 0.4]] + 0.01 * np.random.default_rng(4).normal(size=(400, 2))
    traces = sysid.data((u, y), sample_time=1.0)
    for nb, told in ((3, 0), (4, 1)):  # a sine and its level tell three, whatever the determinant of the past has
        fit = sysid.fit(traces, "u1+u2 -> y1+y2", VectorARX(na=2, nb=nb, nk=0), start=FREE)
        assert sum("too few ways" in note for note in fit.warnings) == told, nb


def test_the_covariance_of_the_noise_is_kept_and_state_spaces_have_it_too() -> None:
    record = plant(14, 400)
    u, y = record.columns(MAPPING.inputs), record.columns(MAPPING.outputs)
    for orders in (COUPLED, sysid.VectorStateSpace(states=3)):
        fit = sysid.fit([record], "u0+u1 -> y0+y1", orders, start=FREE)
        noise = fit.uncertainty.noise_covariance
        left = (y - fit.model.predict(u, y))[20:]
        assert_allclose(noise, left.T @ left / len(left), rtol=0.15)
        if orders is COUPLED:
            assert_allclose(noise, NOISE @ NOISE.T, rtol=0.15)
        assert fit.uncertainty.noise_variance == pytest.approx(np.linalg.det(noise) ** 0.5, rel=1e-6)
        again = FitResult.from_dict(fit.to_dict()).uncertainty
        assert again is not None
        assert_allclose(again.noise_covariance, noise)
    alone = sysid.fit([plant(14, 400)], "u0+u1 -> y0", sysid.LinearStateSpace(states=3), start=FREE)
    assert alone.uncertainty.noise_covariance is None


def test_three_outputs_of_two_inputs_with_dead_times_are_found_without_noise() -> None:
    rng = np.random.default_rng(12)
    orders = VectorARX(na=[[1, 1, 0], [0, 2, 1], [1, 0, 1]], nb=[[1, 1], [2, 0], [0, 1]], nk=[[5, 1], [0, 0], [0, 8]])
    mapping = Mapping.parse("u1+u2 -> y1+y2+y3")
    sized = orders.sized(2, 3)
    truth = np.array([0.4 if c < 2 else 0.25 for _, c, _ in sized.terms]) * rng.choice([-1.0, 1.0], len(sized.terms))
    true = VectorARXModel(
        orders=orders, coefficients=truth, intercepts=np.array([1.0, 20.0, -300.0]), mapping=mapping, sample_time=1.0,
        input_units=("V", "V"), output_units=("m", "K", "Pa"), rest_outputs=(0.0, 0.0, 0.0),
    )  # fmt: skip
    u = rng.normal(size=(200, 2))
    traces = sysid.data((u, true.simulate(u)), sample_time=1.0)
    fit = sysid.fit(traces, mapping, orders, start=FREE)
    assert_allclose(fit.model.coefficients, truth, atol=1e-9)
    assert_allclose(fit.model.intercepts, [1.0, 20.0, -300.0], rtol=1e-9)
    assert fit.notes[0].startswith("The free run is stable")


def test_a_network_of_several_outputs_begins_at_it() -> None:
    traces = [plant(13, 300)]
    first = sysid.fit(traces, "u0+u1 -> y0+y1", VectorARX(na=2, nb=2, nk=1), start=FREE)
    network = sysid.VectorNARX(input_delays="1:2", output_delays=2, neurons=0)
    training = sysid.Training(max_iterations=1, starts=1, loop="open")
    again = sysid.fit(traces, "u0+u1 -> y0+y1", network, training, initial=first, start=FREE)
    u = np.column_stack([traces[0]["u0"], traces[0]["u1"]])
    assert_allclose(again.simulate(u), first.simulate(u), atol=0.02)


def vars_of(one: VectorARXModel) -> dict[str, Any]:
    return {name: getattr(one, name) for name in one.__dataclass_fields__}
