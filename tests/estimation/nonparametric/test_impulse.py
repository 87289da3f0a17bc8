"""The regularised impulse response: near the truth, nearer than least squares, with bands, dead times and words."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import approx_fprime
from scipy.signal import lfilter

from sysid.errors import ConfigError, TraceError
from sysid.estimation.nonparametric.evidence import Triangle, factored, posterior, triangle
from sysid.estimation.nonparametric.impulse import estimate_impulse_response
from sysid.estimation.nonparametric.kernels import Hyperparameters, Kernel
from sysid.estimation.nonparametric.lagged_rows import Regression
from sysid.estimation.nonparametric.noise import whitener
from sysid.estimation.nonparametric.prior import Prior, _Search
from sysid.estimation.nonparametric.segments import segments_of
from sysid.models import Mapping
from sysid.traces import Channel, Trace

B, F = [0.0, 0.0, 0.0, 0.3, 0.15], [1.0, -1.2, 0.5]
ONE, TWO = Mapping.parse("u1 -> y"), Mapping.parse("u1+u2 -> y")


def trace(u: NDArray[np.float64], y: NDArray[np.float64], *, name: str = "a", usable: object = None) -> Trace:
    u = u.reshape(len(y), -1)
    channels = [Channel(name=f"u{j + 1}", unit="V") for j in range(u.shape[1])] + [Channel(name="y", unit="m")]
    values = np.column_stack([u, y])
    return Trace(name=name, sample_time=0.5, channels=tuple(channels), values=values, usable=usable)


def record(n: int, seed: int, *, noise: float = 0.1, level: float = 3.0, name: str = "a") -> Trace:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], n // 4 + 1), 4)[:n]
    y = lfilter(B, F, u)
    return trace(u, y + level + noise * y.std() * rng.standard_normal(n), name=name)


def truth(n: int) -> NDArray[np.float64]:
    return np.asarray(lfilter(B, F, np.eye(1, n)[0]))


def test_it_is_nearer_the_truth_than_least_squares() -> None:
    a = record(400, 0, noise=0.3)
    found = estimate_impulse_response([a], ONE, lags=40)
    X = np.column_stack([np.roll(a["u1"], k)[39:] for k in range(40)] + [np.ones(361)])
    plain = np.linalg.lstsq(X, a["y"][39:], rcond=None)[0][:40]
    assert np.linalg.norm(found.values[0] - truth(40)) < 0.5 * np.linalg.norm(plain - truth(40))


@pytest.mark.parametrize("whiten", [[1.0], [1.0, -0.4, 0.1]])
def test_rows_are_those_whose_output_counts_with_all_inputs_before_them(whiten: list[float]) -> None:
    """Lag by lag and sample by sample, of two records with gaps in the output and one in an input."""
    rng, n, length = np.random.default_rng(4), 120, 5
    made, expected = [], []
    for name in ("a", "b"):
        u, y = rng.standard_normal((n, 2)), rng.standard_normal(n) + 5.0
        usable = np.ones((n, 3), dtype=np.bool_)
        usable[:, 2] = rng.random(n) > 0.2
        usable[60, 0] = False
        made.append(trace(u, y, name=name, usable=usable))
        rows = []
        for k in range(n):
            past, back = range(k - length - len(whiten) + 2, k + 1), range(k - len(whiten) + 1, k + 1)
            if past[0] >= 0 and usable[past, :2].all() and usable[back, 2].all():
                lagged = [
                    sum(w * u[k - lag - i, j] for i, w in enumerate(whiten)) for j in (0, 1) for lag in range(length)
                ]
                rows.append([*lagged, sum(w * y[k - i] for i, w in enumerate(whiten))])
        expected.append(np.array(rows) - np.mean(rows, axis=0))
    segments = segments_of(made, TWO, shortest=2, of_inputs=True)
    problem = Regression(segments=segments, scale=np.ones(3), length=length)
    found = np.concatenate(list(problem.blocks(np.array(whiten))))
    assert found == pytest.approx(np.concatenate(expected), abs=1e-12)
    assert problem.count(np.array(whiten)) == (len(found), 2)
    g = rng.standard_normal((2, length))
    left = np.concatenate(problem.residuals(g))
    counted = [s.counts()[length - 1 :] for s in segments]
    assert len(left) == sum(int(c.sum()) for c in counted)


def test_the_dead_time_is_that_of_the_plant_and_nothing_comes_before_it() -> None:
    found = estimate_impulse_response([record(500, 1)], ONE)
    assert found.dead_times[0].best == 3
    assert found.dead_times[0].acts
    assert np.all(found.values[0, : found.dead_times[0].low] == 0.0)


@pytest.mark.parametrize("dead", [20, 45, 80])
def test_a_response_that_begins_late_is_not_taken_for_none(dead: int) -> None:
    rng = np.random.default_rng(dead)
    u = np.repeat(rng.choice([-1.0, 1.0], 150), 5)
    y = lfilter([*np.zeros(dead), 0.3], [1.0, -0.7], u)
    found = estimate_impulse_response([trace(u, y + 0.1 * y.std() * rng.standard_normal(750))], ONE)
    assert abs(found.dead_times[0].best - dead) <= 1


def test_bands_hold_the_truth_where_there_is_a_response() -> None:
    inside = []
    for seed in range(6):
        found = estimate_impulse_response([record(600, seed, noise=0.2)], ONE, lags=32)
        error = np.abs(found.values[0] - truth(32))
        seen = np.abs(truth(32)) > 0.01
        inside.append(np.mean(error[seen] <= 1.96 * found.deviation[0][seen]))
    assert np.mean(inside) > 0.85


def test_bands_hold_the_tail_of_a_slow_response_whose_decay_is_known_no_better_than_the_data_tell() -> None:
    """With the decay of largest evidence taken for certain they held 66 % of it; the benchmark has more."""
    held = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        u = np.repeat(rng.uniform(-1.0, 1.0, 100), 5)
        y = lfilter([0.0, 0.0, 0.05], [1.0, -0.95], u)
        y = y + 0.1 * y.std() * rng.standard_normal(500)
        found = estimate_impulse_response([trace(u, y)], ONE)
        g = lfilter([0.0, 0.0, 0.05], [1.0, -0.95], np.eye(1, len(found.lags))[0])
        tail = (g > 0.001 * g.max()) & (g < 0.1 * g.max())
        held.append(np.mean(np.abs(found.values[0] - g)[tail] <= 1.96 * found.deviation[0][tail]))
    assert np.mean(held) > 0.88


def test_coloured_noise_is_whitened_and_its_size_is_told() -> None:
    rng = np.random.default_rng(3)
    u = rng.standard_normal(3000)
    v = lfilter([1.0], [1.0, -0.9], 0.2 * rng.standard_normal(3000))
    found = estimate_impulse_response([trace(u, lfilter(B, F, u) + v)], ONE)
    assert found.noise_ar[0] == pytest.approx(-0.9, abs=0.05)
    assert found.noise_variance == pytest.approx(0.04, rel=0.1)
    assert found.noise_deviation == pytest.approx(v.std(), rel=0.15)


def test_several_inputs_and_experiments_with_levels_of_their_own() -> None:
    rng = np.random.default_rng(4)
    traces = []
    for name, level in (("a", 5.0), ("b", -20.0)):
        u = rng.standard_normal((500, 2))
        y = lfilter(B, F, u[:, 0]) + lfilter([0.0, -0.5], [1.0, -0.8], u[:, 1]) + level
        traces.append(trace(u, y + 0.05 * rng.standard_normal(500), name=name))
    found = estimate_impulse_response(traces, TWO)
    n = len(found.lags)
    other = lfilter([0.0, -0.5], [1.0, -0.8], np.eye(1, n)[0])
    np.testing.assert_allclose(found.values, np.stack([truth(n), other]), atol=0.03)
    assert [one.best for one in found.dead_times] == [3, 1]
    step, deviation = found.step()
    assert step[1, -1] == pytest.approx(-2.5, abs=0.05)
    assert 0.0 < deviation[1, -1] < 0.05


def test_an_input_without_effect_is_told() -> None:
    rng = np.random.default_rng(5)
    u = rng.standard_normal((600, 2))
    found = estimate_impulse_response([trace(u, lfilter(B, F, u[:, 0]) + 0.1 * rng.standard_normal(600))], TWO)
    assert [one.acts for one in found.dead_times] == [True, False]


def test_masked_samples_are_nobody_s_past() -> None:
    a = record(600, 6, noise=0.02)
    usable = np.ones(600, dtype=np.bool_)
    usable[200:210] = False
    spoiled = a.values.copy()
    spoiled[200:210] = 1e6
    found = estimate_impulse_response([trace(spoiled[:, 0], spoiled[:, 1], usable=usable)], ONE, lags=32)
    np.testing.assert_allclose(found.values[0], truth(32), atol=0.02)


def test_it_grows_until_it_has_settled_and_says_where_it_has_not() -> None:
    rng = np.random.default_rng(7)
    u = rng.standard_normal(2000)
    slow = lfilter([0.0, 0.05], [1.0, -0.97], u)
    found = estimate_impulse_response([trace(u, slow + 0.01 * rng.standard_normal(2000))], ONE)
    assert len(found.lags) > 64
    assert found.settled
    short = estimate_impulse_response([trace(u, slow)], ONE, lags=20)
    assert not short.settled
    assert len(short.notes) == 1


def test_units_go_through() -> None:
    a = record(300, 8)
    found = estimate_impulse_response([a], ONE, lags=20)
    large = estimate_impulse_response([trace(a["u1"] * 1e-9, a["y"] * 1e12)], ONE, lags=20)
    np.testing.assert_allclose(large.values, found.values * 1e21, rtol=1e-6)
    np.testing.assert_allclose(large.deviation, found.deviation * 1e21, rtol=1e-5)


def test_it_simulates_what_it_says() -> None:
    a = record(300, 9, noise=0.0)
    found = estimate_impulse_response([a], ONE)
    assert found.explained > 0.9999
    made = found.simulate(a.columns(["u1"]))
    np.testing.assert_allclose((made - made.mean())[60:], (a["y"] - a["y"][60:].mean() - 0 * made)[60:], atol=0.2)


def test_the_frame_has_a_row_for_each_lag() -> None:
    frame = estimate_impulse_response([record(200, 10)], ONE, lags=16).to_frame()
    assert len(frame) == 16
    assert (frame["low"] <= frame["value"]).all()


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        ({"lags": 1}, ConfigError),
        ({"lags": 5000}, ConfigError),
        ({"lags": 199}, TraceError),
        ({"dead_times": [1, 2]}, ConfigError),
        ({"dead_times": [-1]}, ConfigError),
        ({"noise_order": -1}, ConfigError),
    ],
)
def test_what_cannot_be_is_refused_in_words(arguments: dict[str, object], error: type[Exception]) -> None:
    with pytest.raises(error):
        estimate_impulse_response([record(200, 11)], ONE, **arguments)


def test_records_without_anything_to_respond_to_are_refused() -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(ConfigError):
        estimate_impulse_response([record(200, 12)], Mapping.parse("-> y"))
    with pytest.raises(TraceError):
        estimate_impulse_response([trace(np.ones(200), rng.standard_normal(200))], ONE)
    with pytest.raises(TraceError):
        estimate_impulse_response([record(10, 12)], ONE)


@pytest.mark.parametrize("kernel", Kernel)
def test_the_gradient_of_the_evidence_is_its_gradient(kernel: Kernel) -> None:
    rng = np.random.default_rng(1)
    X, y = rng.standard_normal((60, 16)), rng.standard_normal(60)
    data = triangle([np.column_stack([X, y])], free=0)
    search = _Search(data=data, kernel=kernel, length=8, dead=np.array([2, 0]))
    theta = np.tile([0.5, 1.5, 0.7][: kernel.size], 2)
    numeric = approx_fprime(theta, lambda x: search.descent(x)[0], 1e-6)
    np.testing.assert_allclose(search.descent(theta)[1], numeric, rtol=1e-4, atol=1e-4)
    assert -search.descent(theta)[0] == pytest.approx(search.value(theta))


def test_evidence_and_posterior_are_those_of_the_textbook() -> None:
    rng = np.random.default_rng(2)
    X, y = rng.standard_normal((30, 4)), rng.standard_normal(30)
    data = triangle([np.column_stack([X[:11], y[:11]]), np.column_stack([X[11:], y[11:]])], free=0)
    assert isinstance(data, Triangle)
    L = Hyperparameters(scale=0.7, decay=0.8, correlation=0.5).factor(4)
    whole = np.eye(30) + X @ L @ L.T @ X.T
    variance = float(y @ np.linalg.solve(whole, y)) / 30
    found = posterior(data, L)
    assert found.noise_variance == pytest.approx(variance)
    said = -0.5 * (30 * np.log(2 * np.pi * variance) + np.linalg.slogdet(whole)[1] + 30)
    assert factored(data, L).log_evidence == pytest.approx(said)
    inverse = np.linalg.inv(X.T @ X + np.linalg.inv(L @ L.T))
    np.testing.assert_allclose(found.mean, inverse @ X.T @ y)
    np.testing.assert_allclose(found.covariance, variance * inverse)
    assert found.effective == pytest.approx(np.trace(X @ inverse @ X.T))


def test_white_residuals_have_no_colour_and_growing_ones_a_stable_one() -> None:
    rng = np.random.default_rng(0)
    assert whitener([rng.standard_normal(500)], 6).tolist() == [1.0]
    assert np.abs(np.roots(whitener([1.05 ** np.arange(100)], 1, exact=True))).max() < 1.0


@pytest.mark.parametrize("noise", [1.0, 0.0], ids=["noisy", "exact"])
def test_the_evidence_beside_what_other_inputs_explain_is_that_of_all(noise: float) -> None:
    """Where dead times of one input are looked at, the others are factored once."""
    rng = np.random.default_rng(2)
    a, n = rng.standard_normal((200, 24)), 8
    y = a[:, 3:24] @ rng.standard_normal(21) + noise * rng.standard_normal(200)
    data = triangle([np.column_stack([a, y])], free=0)
    rows = np.log([[2.0, 3.0], [5.0, 2.0], [1.0, 4.0]])
    whole = Prior(kernel=Kernel.TC, length=n, dead=np.array([2, 0, 1]), theta=rows.ravel())
    without, own = whole.shifted(1, n), np.repeat([False, True, False], n)
    left, constant = data.beside(without.kept, without.factor())
    for dead in (0, 3, 7):
        moved = whole.shifted(1, dead)
        alone = Prior(kernel=Kernel.TC, length=n, dead=moved.dead[1:2], theta=rows[1])
        part = factored(left.columns(own[~without.kept]).columns(alone.kept), alone.factor())
        expected = factored(data.columns(moved.kept), moved.factor()).log_evidence
        assert part.log_evidence - constant == pytest.approx(expected, rel=1e-9)


def test_what_a_simulation_leaves_is_rounding_and_has_no_colour() -> None:
    u = np.random.default_rng(1).standard_normal((300, 2))
    exact = estimate_impulse_response([trace(u, lfilter([0.0, 2.0], [1.0], u[:, 0]))], TWO)
    assert exact.noise_ar == ()
    np.testing.assert_allclose(exact.values[0, :3], [0.0, 2.0, 0.0], atol=1e-9)
    assert [one.acts for one in exact.dead_times] == [True, False]


def test_the_evidence_of_an_output_that_stands_is_a_number() -> None:
    """Of a target that is 0 throughout nothing is left, and no share of it."""
    data = Triangle(R=np.eye(4), z=np.zeros(4), samples=400)
    for prior in (np.eye(4), 1e6 * np.eye(4)):
        whole = factored(data, prior)
        assert whole.rest > 0.0
        assert np.isfinite(whole.log_evidence)
        assert np.isfinite(data.samples / whole.rest)
