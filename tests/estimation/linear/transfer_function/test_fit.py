"""Transfer functions: known systems are found with their dead times, within their own intervals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import optimize, signal

from sysid.errors import ConfigError, TraceError
from sysid.estimation import FitResult, Loop, Status, fit_transfer_function
from sysid.estimation.linear.transfer_function.training import TransferFunctionTraining
from sysid.models import Domain, Mapping, Start, StartKind, TransferFunction
from sysid.traces import Trace
from tests.estimation.linear_systems import noise_for, steps, trace_of

TWO, ONE = Mapping.parse("u1+u2 -> y"), Mapping.parse("u1 -> y")
T = 0.1
DELAYS = {Domain.DISCRETE: (1, 3), Domain.CONTINUOUS: (2, 0)}
TRUE = {
    Domain.DISCRETE: np.array([1.0, 0.5, -1.5, 0.7, 0.4, -0.9]),
    Domain.CONTINUOUS: np.array([3.0, 2.0, 4.0, 1.0, 1.0, 0.5]),
}
DOMAINS = pytest.mark.parametrize("domain", list(Domain), ids=lambda d: d.value)


def response(domain: Domain, u: np.ndarray) -> np.ndarray:
    total = np.zeros(len(u))
    for j, k in enumerate(DELAYS[domain]):
        delayed = np.concatenate([np.zeros(k), u[: len(u) - k, j]])
        if domain is Domain.DISCRETE:
            b, f = ([1.0, 0.5], [1.0, -1.5, 0.7]) if j == 0 else ([0.4], [1.0, -0.9])
        else:
            num, den = ([2.0, 3.0], [1.0, 1.0, 4.0]) if j == 0 else ([1.0], [1.0, 0.5])
            b, f, _ = signal.cont2discrete((num, den), T, "zoh")
            b = b.ravel()
        total += signal.lfilter(b, f, delayed)
    return total


def record(domain: Domain, seed: int, decibel: float, n: int = 800) -> Trace:
    rng = np.random.default_rng(seed)
    u = steps(n, 2, rng, held=5)
    clean = response(domain, u)
    return trace_of(u, clean + noise_for(clean, decibel, rng), sample_time=T)


def orders(domain: Domain, *, delays: tuple[int, ...] | None) -> TransferFunction:
    return TransferFunction(poles=(2, 1), zeros=(1, 0), delays=delays, domain=domain)


QUICK = TransferFunctionTraining(scattered_starts=0)


def share_held(domain: Domain, decibel: float, seeds: range) -> float:
    """The share of the true parameters that lie within the 95 % intervals of fits to noisy records."""
    held = 0
    for seed in seeds:
        trace = record(domain, seed, decibel)
        fit = fit_transfer_function([trace], TWO, orders(domain, delays=DELAYS[domain]), QUICK, rest_output=0.0)
        low, high = fit.uncertainty.interval(0.95).T[:, :6]
        held += int(np.sum((low <= TRUE[domain]) & (high >= TRUE[domain])))
    return held / (6 * len(seeds))


def test_true_parameters_lie_within_their_95_percent_intervals() -> None:
    """Over 16 records, 96 parameters; ``python -m tests.benchmarks coverage`` has 500 of each."""
    ways = [(domain, decibel) for domain in Domain for decibel in (20.0, 40.0)]
    shares = [share_held(domain, decibel, range(4 * k, 4 * k + 4)) for k, (domain, decibel) in enumerate(ways)]
    assert 0.90 <= np.mean(shares) <= 0.99


@DOMAINS
@pytest.mark.parametrize(("decibel", "seed"), [(20.0, 0), (40.0, 1)])
def test_dead_times_are_found(domain: Domain, decibel: float, seed: int) -> None:
    training = TransferFunctionTraining(scattered_starts=0, max_iterations=20)
    trace = record(domain, seed, decibel, 500)
    fit = fit_transfer_function([trace], TWO, orders(domain, delays=None), training, rest_output=0.0)
    assert fit.model.delays == DELAYS[domain]


def test_the_fit_is_that_of_scipys_least_squares() -> None:
    """The same cost from another program: simulate with lfilter, minimise with least_squares."""
    trace = record(Domain.DISCRETE, 3, 10.0, 300)
    u, y = trace.columns(["u1", "u2"]), trace["y"]

    def residual(p: np.ndarray) -> np.ndarray:
        one = signal.lfilter([0.0, *p[:2]], [1.0, *p[2:4]], u[:, 0])
        two = signal.lfilter([0.0, 0.0, 0.0, p[4]], [1.0, p[5]], u[:, 1])
        return one + two + p[6] - y

    reference = optimize.least_squares(residual, [*TRUE[Domain.DISCRETE], 0.0], xtol=1e-14, ftol=1e-14, gtol=1e-14)
    fit = fit_transfer_function([trace], TWO, orders(Domain.DISCRETE, delays=(1, 3)), QUICK, rest_output=0.0)
    np.testing.assert_allclose(fit.uncertainty.values[:6], reference.x[:6], rtol=1e-5)
    assert fit.history["mse"][-1] == pytest.approx(2 * reference.cost / 300, rel=1e-10)
    J = reference.jac
    covariance = np.linalg.inv(J.T @ J) * 2 * reference.cost / (300 - 7)
    np.testing.assert_allclose(fit.uncertainty.covariance[:6, :6], covariance[:6, :6], rtol=1e-3, atol=1e-9)


@DOMAINS
def test_refined_instrumental_variables_come_close_without_a_refinement(domain: Domain) -> None:
    """max_iterations 0 keeps the best start: of noisy data, that of the instruments."""
    none = TransferFunctionTraining(max_iterations=0, scattered_starts=0)
    trace = record(domain, 0, 20.0)
    start = fit_transfer_function([trace], TWO, orders(domain, delays=DELAYS[domain]), none, rest_output=0.0)
    full = fit_transfer_function([trace], TWO, orders(domain, delays=DELAYS[domain]), rest_output=0.0)
    assert "refined instrumental variables" in start.notes[0]
    assert start.history["mse"][0] <= 1.01 * full.history["mse"][-1]
    np.testing.assert_allclose(start.uncertainty.values[:6], TRUE[domain], rtol=0.15)


def test_a_record_in_motion_needs_its_initial_state() -> None:
    trace = record(Domain.DISCRETE, 5, 60.0)
    cut = Trace(name="cut", sample_time=T, channels=trace.channels, values=trace.values[200:500])
    given = orders(Domain.DISCRETE, delays=(1, 3))
    start = Start(kind=StartKind.MEASURED, n_measured=30)
    moving = fit_transfer_function([cut], TWO, given, QUICK, start=start)
    resting = fit_transfer_function([cut], TWO, given, QUICK)
    np.testing.assert_allclose(moving.uncertainty.values[:6], TRUE[Domain.DISCRETE], rtol=0.03)
    assert moving.history["mse"][-1] < 0.01 * resting.history["mse"][-1]


def test_selection_traces_choose_between_minima() -> None:
    trace, other = record(Domain.DISCRETE, 1, 3.0, 60), record(Domain.DISCRETE, 2, 60.0, 400)
    large = TransferFunction(poles=(3, 3), zeros=(2, 2), delays=(1, 1))
    blind = fit_transfer_function([trace], TWO, large, rest_output=0.0)
    seeing = fit_transfer_function([trace], TWO, large, rest_output=0.0, selection=[other])

    def error(fit: FitResult) -> float:
        return float(np.mean((fit.model.simulate(other.columns(["u1", "u2"])) - other["y"]) ** 2))

    assert error(seeing) <= error(blind)
    assert seeing.status is not Status.STOPPED_EARLY
    assert any("selection traces" in note for note in seeing.notes)


def test_several_experiments_share_the_parameters() -> None:
    pair = [record(Domain.DISCRETE, seed, 40.0, 200) for seed in (1, 2)]
    fit = fit_transfer_function(pair, TWO, orders(Domain.DISCRETE, delays=(1, 3)), QUICK, rest_output=0.0)
    np.testing.assert_allclose(fit.uncertainty.values[:6], TRUE[Domain.DISCRETE], rtol=0.02)
    errors = [np.mean((fit.model.simulate(t.columns(["u1", "u2"])) - t["y"]) ** 2) for t in pair]
    assert fit.history["mse"][-1] == pytest.approx(np.mean(errors), rel=1e-9)


def test_a_high_order_fit_reaches_the_noise() -> None:
    rng = np.random.default_rng(4)
    u = steps(3000, 1, rng, held=10)
    sos = signal.cheby1(8, 1.0, 0.2, output="sos")
    clean = signal.sosfilt(sos, np.concatenate([[0.0], u[:-1, 0]]))
    trace = trace_of(u, clean + noise_for(clean, 40.0, rng))
    fit = fit_transfer_function([trace], ONE, TransferFunction(poles=(8,), zeros=(7,), delays=(1,)), rest_output=0.0)
    assert fit.history["mse"][-1] < 1.02 * np.var(clean) * 1e-4
    assert fit.model.stable


def test_the_result_says_what_was_done() -> None:
    fit = fit_transfer_function(
        [record(Domain.DISCRETE, 0, 40.0)], TWO, orders(Domain.DISCRETE, delays=(1, 3)), rest_output=0.0
    )
    assert (fit.loop, fit.status) == (Loop.CLOSED, Status.CONVERGED)
    assert fit.notes[0].startswith("Best of ")
    again = FitResult.from_dict(fit.to_dict())
    np.testing.assert_array_equal(again.uncertainty.covariance, fit.uncertainty.covariance)
    assert fit.uncertainty.names == ("B(u1, 0)", "B(u1, 1)", "F(u1, 1)", "F(u1, 2)", "B(u2, 0)", "F(u2, 1)", "constant")


def test_orders_that_do_not_fit_the_inputs_are_refused() -> None:
    with pytest.raises(ConfigError, match="do not match the inputs"):
        fit_transfer_function([record(Domain.DISCRETE, 0, 40.0)], TWO, TransferFunction(poles=(2, 2, 2), zeros=1))


def test_too_few_samples_are_refused() -> None:
    trace = record(Domain.DISCRETE, 0, 40.0)
    short = Trace(name="short", sample_time=T, channels=trace.channels, values=trace.values[:6])
    with pytest.raises(TraceError, match="fewer samples"):
        fit_transfer_function([short], TWO, orders(Domain.DISCRETE, delays=(1, 1)))


@pytest.mark.parametrize("first,found", [(0.5, 0), (0.0, 1)])
def test_an_input_that_acts_within_the_sample_is_found_to(first: float, found: int) -> None:
    rng = np.random.default_rng(2)
    u = np.repeat(rng.standard_normal(100), 3)
    y = signal.lfilter([first, 0.3, 0.1], [1.0, -0.8, 0.1], u) + 0.05 * rng.standard_normal(300)
    fit = fit_transfer_function([trace_of(u, y)], Mapping.parse("u1 -> y"), TransferFunction(poles=(2,), zeros=(1,)))
    assert fit.model.structure.delays == (found,)
    assert any("answers within the sample" in told for told in fit.warnings) is (found == 0)


@pytest.mark.parametrize("between", ["foh", {"u1": "foh"}])
def test_an_input_that_moves_between_samples_is_one_where_that_is_said(between) -> None:
    """Beside SciPy's exact samples: the first input goes straight from sample to sample, the second may be held."""
    rng = np.random.default_rng(0)
    u = np.convolve(rng.normal(size=420), np.ones(6) / 3.0)[:400] if between == "foh" else rng.normal(size=400)
    u, t = np.column_stack([u - u[0], steps(400, 1, rng, held=7)[:, 0]]), T * np.arange(400)
    u[0] = 0.0
    y = signal.lsim(([2.0, 3.0], [1.0, 1.0, 4.0]), u[:, 0], t, interp=True)[1]
    y = y + signal.lsim(([1.0], [1.0, 0.5]), u[:, 1], t, interp=between == "foh")[1]
    structure = TransferFunction(
        poles=(2, 1), zeros=(1, 0), delays=(0, 0), domain=Domain.CONTINUOUS, intersample=between
    )
    trace = trace_of(u, y + 1e-4 * rng.normal(size=400), sample_time=T)
    fit = fit_transfer_function([trace], TWO, structure, QUICK, rest_output=0.0)
    np.testing.assert_allclose(fit.model.numerator(0), [3.0, 2.0], rtol=2e-3)
    np.testing.assert_allclose(fit.model.denominator(0), [4.0, 1.0, 1.0], rtol=2e-3)
    np.testing.assert_allclose(fit.model.denominator(1), [0.5, 1.0], rtol=5e-3)
    assert not any("moves with" in note for note in fit.notes)
    told = "u1, u2 go straight" if between == "foh" else "u1 goes straight"
    assert any(told in note for note in fit.notes)


@pytest.mark.parametrize(("dead", "seed"), [(42, 2), (60, 0), (30, 10)])
def test_a_record_that_begins_in_motion_while_its_inputs_stand_tells_its_dead_time(dead: int, seed: int) -> None:
    """The input moved as the record began, stands for some samples, and shows later than it moves again."""
    rng = np.random.default_rng([seed, dead])
    u = np.repeat(rng.integers(0, 2, 120), 5) * 2.0 - 1.0
    y = signal.lfilter([*np.zeros(dead), 0.02, 0.015], np.convolve([1.0, -0.9], [1.0, -0.8]), u)
    y += 0.1 * y.std() * rng.standard_normal(600)
    estimated = Start(kind=StartKind.ESTIMATED)
    structure = TransferFunction(poles=(2,), zeros=(1,))
    fit = fit_transfer_function([trace_of(u[:, np.newaxis], y)], ONE, structure, start=estimated)
    assert fit.model.structure.to_dict()["delays"] == [dead]


@pytest.mark.parametrize("seed", [1, 2, 4])
def test_an_input_without_effect_has_a_short_dead_time(seed: int) -> None:
    """Each place leaves something else by chance; a long dead time would be as many states in every file."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1.0, 1.0, (60, 2)), 10, axis=0)
    y = signal.lfilter([0.0, 0.0, 0.0, 0.2], [1.0, -0.8], u[:, 0]) + 0.05 * rng.standard_normal(600)
    fit = fit_transfer_function([trace_of(u, y)], TWO, TransferFunction(poles=(1, 1), zeros=(0, 0)))
    first, second = fit.model.structure.to_dict()["delays"]
    assert first == 3
    assert second <= 5


def test_a_dead_time_of_few_samples_moves_by_what_they_say() -> None:
    """Of so few a better place takes away more than any part of the loss that grows with one over their number."""
    u = np.repeat([0.0, 1.0], [6, 12])[:, np.newaxis]
    y = signal.lfilter([0.0, 0.0, 0.0, 0.0, 0.2], [1.0, -0.8], u[:, 0])
    y += 1e-3 * np.random.default_rng(0).standard_normal(18)
    fit = fit_transfer_function([trace_of(u, y)], ONE, TransferFunction(poles=(1,), zeros=(0,)))
    assert fit.model.structure.to_dict()["delays"] == [4]


def test_dead_times_beyond_a_record_are_left_to_those_that_begin_at_rest() -> None:
    u = np.repeat([0.0, 1.0], [50, 40])[:, np.newaxis]
    y = signal.lfilter([*np.zeros(20), 0.2], [1.0, -0.8], u[:, 0]) + 1e-3 * np.random.default_rng(0).standard_normal(90)
    training = TransferFunctionTraining(max_delay=100)
    start = Start(kind=StartKind.ESTIMATED)
    structure = TransferFunction(poles=(1,), zeros=(0,))
    fit = fit_transfer_function([trace_of(u, y)], ONE, structure, training, start=start)
    assert fit.model.structure.to_dict()["delays"] == [20]


@pytest.mark.parametrize("width", [1, 180], ids=["impulse", "step"])
def test_a_record_that_begins_at_rest_tells_its_dead_time_by_a_single_response(width: int) -> None:
    """Samples that a long dead time would leave out are all that it has."""
    u = np.zeros((200, 1))
    u[20 : 20 + width] = 1.0
    y = signal.lfilter([0.0, 0.0, 0.0, 0.2], [1.0, -0.8], u[:, 0]) + 0.002 * np.random.default_rng(0).standard_normal(
        200
    )
    fit = fit_transfer_function(
        [trace_of(u, y, sample_time=T)],
        ONE,
        TransferFunction(poles=(1,), zeros=(0,)),
        QUICK,
        start=Start(kind=StartKind.ESTIMATED),
    )
    ratio = fit.model.ratios[(0, 0)]
    assert ratio.delay == 3
    np.testing.assert_allclose([ratio.B[0], -ratio.F[1]], [0.2, 0.8], atol=0.01)


@pytest.mark.parametrize("dead", [7, 12, 30])
def test_inputs_that_step_as_the_record_begins_are_no_rest_before_it(dead: int) -> None:
    """The output stands until the dead time is over, as it does in a record that begins at rest: for another reason."""
    u = np.repeat(np.random.default_rng(1).choice([-1.0, 1.0], 76), 8)[:600, np.newaxis]
    y = signal.lfilter(np.r_[np.zeros(dead), 0.05, 0.03], [1.0, -1.6, 0.8], u[:, 0])
    fit = fit_transfer_function(
        [trace_of(u, y, sample_time=T)],
        ONE,
        TransferFunction(poles=(2,), zeros=(1,), delays=(dead,)),
        QUICK,
        start=Start(kind=StartKind.ESTIMATED),
    )
    ratio = fit.model.ratios[(0, 0)]
    np.testing.assert_allclose([*ratio.B, *ratio.F], [0.05, 0.03, 1.0, -1.6, 0.8], atol=1e-8)


def test_a_double_integrator_is_no_long_dead_time() -> None:
    u = np.repeat(np.random.default_rng(0).integers(0, 2, 61), 5)[:300, np.newaxis] * 2.0 - 1.0
    y = signal.lfilter([0.0, 0.05, 0.05], [1.0, -2.0, 1.0], u[:, 0])
    fit = fit_transfer_function(
        [trace_of(u, y, sample_time=T)],
        ONE,
        TransferFunction(poles=(2,), zeros=(1,)),
        QUICK,
        start=Start(kind=StartKind.ESTIMATED),
    )
    np.testing.assert_allclose(fit.model.ratios[(0, 0)].F, [1.0, -2.0, 1.0], atol=1e-6)
    assert "Dead times in samples: 1." in fit.notes
