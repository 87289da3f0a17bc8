"""Neural state spaces find systems whose truth is known, and say how."""

import time
from dataclasses import replace

import numpy as np
import pytest

from sysid.errors import ConfigError, TraceError
from sysid.estimation import FitResult, Loop, Training, fit_neural_state_space
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.networks.neural import layout as neural_layout
from sysid.estimation.networks.neural import start as neural_start
from sysid.estimation.networks.neural.layout import NeuralLayout
from sysid.estimation.networks.neural.provider import NeuralProvider
from sysid.estimation.networks.neural.start import linear_start
from sysid.estimation.networks.neural.state_space import STARTS
from sysid.estimation.networks.program_provider import BLOCK
from sysid.estimation.records.experiment import experiments_of
from sysid.models import (
    Mapping,
    NeuralForm,
    NeuralStateSpace,
    Scaling,
    Start,
    StartKind,
)
from sysid.traces import Role, Trace
from sysid.validation import evaluate_case
from tests.traces.made import trace_of

MAPPING = Mapping.parse("u -> y")
MEASURED = Start(kind=StartKind.MEASURED, n_measured=20)
FREE = Start(kind=StartKind.ESTIMATED)


def a_trace(name: str, u: np.ndarray, y: np.ndarray) -> Trace:
    return trace_of({"u": u, "y": y}, name=name)


def steps(n: int, rng: np.random.Generator) -> np.ndarray:
    return np.repeat(rng.uniform(-1.0, 1.0, n // 10 + 1), 10)[:n]


def linear(seed: int, n: int = 600) -> Trace:
    """Two poles, one of them slow, and a constant."""
    u = steps(n, np.random.default_rng(seed))
    x, y = np.zeros(2), np.empty(n)
    for t in range(n):
        y[t] = x @ [0.7, -0.3] + 0.2
        x = np.array([[0.95, 0.1], [0.0, 0.6]]) @ x + np.array([0.05, 0.4]) * u[t]
    return a_trace(f"linear {seed}", u, y)


def hidden_saturation(seed: int, n: int = 800) -> Trace:
    """A state that saturates and is not measured, then a slow one that is."""
    u = steps(n, np.random.default_rng(seed))
    a, b, y = 0.0, 0.0, np.empty(n)
    for t in range(n):
        y[t] = b
        a, b = 0.8 * a + 0.3 * u[t], 0.95 * b + 0.05 * np.tanh(2.0 * a)
    return a_trace(f"saturation {seed}", u, y)


def rmse(fit: FitResult, trace: Trace, start: Start = MEASURED) -> float:
    u, y = trace.columns(["u"]), trace["y"]
    n = start.n_measured
    output = fit.model.simulate(u[n:], start.history(u, y, fit.model.rest_output))
    return float(np.sqrt(np.mean((output - y[n:]) ** 2)))


def test_the_linear_start_is_the_best_linear_model():
    trace = linear(0)
    network = NeuralStateSpace(states=2, neurons=3)
    form = NeuralForm(
        sizes=network.sizes(1),
        theta=np.zeros(network.sizes(1).count),
        scaling=Scaling.to_unit_range([trace.columns(["u"])], [trace["y"]]),
    )
    provider = NeuralProvider(template=form, experiments=experiments_of([trace], MAPPING, MEASURED, 0.0))
    theta = linear_start(provider)
    assert 2.0 * provider.loss(theta) / provider.n_samples < 1e-12
    assert np.abs(np.concatenate(provider.states(theta))).max() == pytest.approx(1.0)


def test_the_linear_start_ends_in_its_time(monkeypatch):
    """Each of its fits has a share of what is left, and one for the subspace."""
    given = []
    monkeypatch.setattr(neural_start, "_fitted", lambda _, theta, seconds: given.append(seconds) or theta)
    trace, sizes = linear(0), NeuralStateSpace(states=2, neurons=3).sizes(1)
    scaling = Scaling.to_unit_range([trace.columns(["u"])], [trace["y"]])
    form = NeuralForm(sizes=sizes, theta=np.zeros(sizes.count), scaling=scaling)
    provider = NeuralProvider(template=form, experiments=experiments_of([trace], MAPPING, MEASURED, 0.0))
    linear_start(provider, until=time.perf_counter() + 12.0)
    assert all(0.5 * most < seconds <= most for seconds, most in zip(given, (3.0, 4.0, 6.0), strict=True))
    linear_start(provider)
    assert given[3:] == [np.inf] * 3


@pytest.mark.parametrize("start", [Start(), MEASURED], ids=["at rest", "measured start"])
def test_a_linear_system_is_found_exactly(start):
    fit = fit_neural_state_space(
        [linear(0), linear(1)],
        MAPPING,
        NeuralStateSpace(states=2, neurons=0),
        Training(max_iterations=20),
        start=start,
        rest_output=0.2,
    )
    assert rmse(fit, linear(2), start) < 1e-5
    assert fit.loop is Loop.CLOSED


@pytest.fixture(scope="module")
def saturation() -> FitResult:
    return fit_neural_state_space(
        [hidden_saturation(0)],
        MAPPING,
        NeuralStateSpace(states=2, neurons=3),
        Training(max_iterations=60, starts=2, regularisation=1e-6),
        start=MEASURED,
        selection=[hidden_saturation(1)],
    )


def test_a_hidden_nonlinearity_is_found(saturation):
    unseen = hidden_saturation(2)
    best_linear = fit_neural_state_space(
        [hidden_saturation(0)], MAPPING, NeuralStateSpace(states=2, neurons=0), Training(), start=MEASURED
    )
    assert rmse(saturation, unseen) < 0.1 * rmse(best_linear, unseen)


def test_the_same_seed_gives_the_same_model(saturation):
    again = fit_neural_state_space(
        [hidden_saturation(0)],
        MAPPING,
        NeuralStateSpace(states=2, neurons=3),
        Training(max_iterations=60, starts=2, regularisation=1e-6),
        start=MEASURED,
        selection=[hidden_saturation(1)],
    )
    np.testing.assert_array_equal(again.model.theta, saturation.model.theta)


def test_a_result_comes_back_from_its_fields(saturation):
    again = FitResult.from_dict(saturation.to_dict())
    np.testing.assert_array_equal(again.model.theta, saturation.model.theta)
    assert "starts" in saturation.notes[0]


def test_a_rectified_output_is_fitted_through_its_sign():
    def record(seed: int) -> Trace:
        whole = linear(seed)
        return a_trace(f"rectified {seed}", whole["u"], np.abs(whole["y"] - 0.2))

    fits = {
        output: fit_neural_state_space(
            [record(0), record(1)], MAPPING, NeuralStateSpace(states=2, neurons=0, output=output), start=MEASURED
        )
        for output in ("plain", "absolute")
    }
    assert rmse(fits["absolute"], record(2)) < 0.01 * rmse(fits["plain"], record(2))


def test_there_is_no_open_loop():
    with pytest.raises(ConfigError, match="open loop"):
        fit_neural_state_space([linear(0)], MAPPING, NeuralStateSpace(states=1, neurons=1), Training(loop=Loop.OPEN))


@pytest.mark.parametrize("given", [{"pretraining": 100}, {"stride": 2}, {"basis": "plain"}], ids=str)
def test_options_of_lagged_regressors_are_refused(given):
    with pytest.raises(ConfigError, match=next(iter(given))):
        fit_neural_state_space([linear(0)], MAPPING, NeuralStateSpace(states=1, neurons=1), Training(**given))


def test_one_measured_sample_is_a_system_that_has_stood_there_in_the_fit_as_in_the_run() -> None:
    rng = np.random.default_rng(0)

    def record(name: str, first: float) -> Trace:
        u, y = np.repeat(rng.uniform(-1.0, 1.0, 10), 20), np.full(200, first)
        for k in range(199):
            y[k + 1] = 0.95 * y[k] + 0.05 * u[k]
        return trace_of({"u": u, "y": y}, name=name, sample_time=0.1, units="1")

    records = (record("a", 2.0), record("b", -1.0))
    start = Start(kind=StartKind.MEASURED, n_measured=1)
    network = NeuralStateSpace(states=1, neurons=2)
    fit = fit_neural_state_space(records, Mapping.parse("u -> y"), network, Training(max_iterations=60), start=start)
    for one in records:
        found = evaluate_case(fit.model, one, Role.ESTIMATION, start, 1)
        assert found.free_run.nrmse_fit > 99.0


def test_a_record_of_two_samples_does_not_spoil_the_start_that_a_long_one_gives() -> None:
    long = linear(1)
    short = a_trace("short", long.columns(["u"])[:2, 0], long["y"][:2])
    start = Start(kind=StartKind.ESTIMATED)
    fit = fit_neural_state_space(
        [short, long], MAPPING, NeuralStateSpace(states=2, neurons=0), Training(max_iterations=20), start=start
    )
    assert rmse(fit, long) < 1e-6


@pytest.mark.parametrize("n", [2, 60])
def test_an_output_that_never_moves_has_a_fit(n: int) -> None:
    still = a_trace("still", np.random.default_rng(0).standard_normal(n), np.zeros(n))
    fit = fit_neural_state_space([still], MAPPING, NeuralStateSpace(states=1, neurons=1), Training(max_iterations=5))
    np.testing.assert_allclose(fit.model.simulate(still.columns(["u"])), 0.0, atol=1e-9)


def test_a_state_that_an_output_of_little_range_says_much_of_is_found_without_a_warning() -> None:
    rng = np.random.default_rng(5)
    u, y = rng.integers(-3, 4, 17) * 1e-7, rng.integers(-1, 2, 17) * 1e-6
    fit = fit_neural_state_space([a_trace("tiny", u, y)], MAPPING, NeuralStateSpace(states=2, neurons=2), Training())
    assert np.isfinite(fit.model.simulate(u[:, None])).all()


def test_records_that_are_masked_altogether_are_refused() -> None:
    trace = a_trace("masked", np.arange(20.0), np.arange(20.0))
    masked = replace(trace, usable=np.zeros(20, dtype=np.bool_))
    with pytest.raises(TraceError, match="no sample is left"):
        fit_neural_state_space([masked], MAPPING, NeuralStateSpace(states=1, neurons=0))


def check_valve(seed: int, n: int = 600) -> Trace:
    """A tank that fills through a check valve while the input is above it, and leaks only while the input is low."""
    u = np.repeat(np.random.default_rng(seed).uniform(0.0, 1.0, n // 20), 20)
    y = np.zeros(n)
    for t in range(n - 1):
        y[t + 1] = y[t] + 0.1 * max(u[t] - y[t], 0.0) - (0.05 * y[t] if u[t] < 0.3 else 0.0)
    return a_trace(f"valve {seed}", u, y)


@pytest.mark.parametrize("seed", range(4))
def test_starts_that_differ_find_what_switches_whatever_the_record(seed: int) -> None:
    """From the best linear model alone, one of these records is left with 8 % of the range."""
    trace = check_valve(seed)
    fit = fit_neural_state_space(
        [trace], MAPPING, NeuralStateSpace(states=2, neurons=6), Training(max_iterations=100), rest_output=0.0
    )
    assert len({attempt.seed for attempt in fit.attempts}) == STARTS
    assert rmse(fit, trace, Start()) < 0.01


@pytest.mark.parametrize(("n", "pole"), [(1, 0.5), (3, 0.999), (3, 1.0), (2, 0.0)])
def test_random_dynamics_are_stable_and_span_the_linear_models_time_constants(n: int, pole: float) -> None:
    sizes = NeuralStateSpace(states=n, neurons=2).sizes(1)
    base = np.zeros(sizes.count + n)  # with the initial state of one record behind it
    base[sizes.linear] = np.column_stack([pole * np.eye(n), np.zeros((n, 2))]).ravel()
    layout = NeuralLayout(sizes=sizes, base=base, longest=1000)
    theta, centre = layout.start(1, np.random.default_rng(0), layout.centre())
    poles = np.diag(theta[sizes.linear].reshape(n, -1))
    assert theta.shape == centre.shape == base.shape
    assert ((poles > 0.0) & (poles < 1.0)).all()
    assert n < 3 or (poles.max() > 0.99 and poles.min() < 0.95)
    assert np.abs(theta[sizes.readout]).max() > 1e-3 * (1.0 - poles.max())


def test_random_dynamics_swing_where_the_linear_model_does() -> None:
    sizes = NeuralStateSpace(states=3, neurons=2).sizes(1)
    A = np.zeros((3, 3))
    A[:2, :2] = 0.98 * np.array([[np.cos(0.6), -np.sin(0.6)], [np.sin(0.6), np.cos(0.6)]])
    A[2, 2] = 0.9
    base = np.zeros(sizes.count + 3)
    base[sizes.linear] = np.column_stack([A, np.zeros((3, 2))]).ravel()
    layout = NeuralLayout(sizes=sizes, base=base, longest=1000)
    for seed in range(10):
        _, centre = layout.start(1, np.random.default_rng(seed), layout.centre())
        poles = np.linalg.eigvals(centre[sizes.linear].reshape(3, -1)[:, :3])
        turns = np.sort(np.angle(poles))
        assert np.abs(poles).max() < 1.0
        assert turns[1] == 0.0 and 0.1 < turns[2] < np.pi and turns[0] == -turns[2]


def test_random_dynamics_before_a_sum_do_to_it_what_the_linear_model_does() -> None:
    n, inputs = 4, 2
    sizes = NeuralStateSpace(states=n, neurons=2, integrators=1).sizes(inputs)
    rng = np.random.default_rng(1)
    base = np.zeros(sizes.count + n)
    base[sizes.linear] = np.column_stack([np.diag([0.9, 0.8, 0.5, 1.0]), rng.standard_normal((n, inputs + 1))]).ravel()
    base[sizes.linear].reshape(n, -1)[-1, :-4] = [0.3, -0.2, 0.1]
    base[sizes.output_linear] = rng.standard_normal(sizes.row)
    layout = NeuralLayout(sizes=sizes, base=sizes.hold(base), longest=1000)

    def settled(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gain of the output and of the sum's steps at inputs that stay."""
        M, L = theta[sizes.linear].reshape(n, -1), theta[sizes.output_linear]
        x = np.linalg.solve(np.eye(n - 1) - M[:-1, : n - 1], M[:-1, n:])
        return L[n:] + L[: n - 1] @ x, M[-1, n:] + M[-1, : n - 1] @ x

    slowest = []
    for seed in range(3):
        theta, centre = layout.start(1, np.random.default_rng(seed), layout.centre())
        A = centre[sizes.linear].reshape(n, -1)[:, :n]
        assert A[:, -1] == pytest.approx([0.0, 0.0, 0.0, 1.0])
        slowest.append(np.abs(np.linalg.eigvals(A[:-1, :-1])).max())
        for found, wanted in zip(settled(centre), settled(layout.base), strict=True):
            assert found == pytest.approx(wanted)
        assert theta[sizes.held] == pytest.approx(layout.base[sizes.held])
    assert len({round(one, 6) for one in slowest}) == 3
    assert max(slowest) < 1.0


def test_what_integrators_hold_is_no_parameter() -> None:
    plain, summed = (NeuralStateSpace(states=3, neurons=2, integrators=n).sizes(1) for n in (0, 1))
    assert plain.free == plain.count
    assert summed.free == summed.count - len(set(summed.held.tolist())) < plain.free


def hardening_spring(seed: int, n: int = 1500) -> Trace:
    """A hardly damped mass on a spring that stiffens."""
    rng = np.random.default_rng(seed)
    u, x, v = steps(n, rng), 0.0, 0.0
    y = np.empty(n)
    for t in range(n):
        y[t] = x
        v += 0.3 * (0.06 * u[t] - 0.5 * x - 0.3 * x**3 - 0.05 * v)
        x += 0.3 * v
    return a_trace(f"spring {seed}", u, y)


def test_cubes_begin_so_quiet_that_no_start_is_lost() -> None:
    """Loud ones led a resonance away to where no gradient leads back from: the error stayed the output's own."""
    network = NeuralStateSpace(states=2, neurons=2, activation="cubic")
    experiments = experiments_of([hardening_spring(0)], MAPPING, Start(), 0.0)
    scaling = Scaling.to_unit_range([experiments[0].inputs], [experiments[0].output])
    form = NeuralForm(sizes=network.sizes(1), theta=np.zeros(network.sizes(1).count), scaling=scaling)
    provider = NeuralProvider(template=form, experiments=experiments)
    base = linear_start(provider)
    loud, quiet = (
        [layout.start(2, np.random.default_rng(seed), base)[0] for seed in range(10)]
        for layout in (
            NeuralLayout(sizes=form.sizes, base=base, longest=1500, loss=loss) for loss in (None, provider.loss)
        )
    )
    assert max(map(provider.loss, loud)) > 10.0 * provider.loss(base)
    assert max(map(provider.loss, quiet)) <= neural_layout.LOST * provider.loss(base)
    assert all((np.abs(one[form.sizes.readout]) > 0.0).all() for one in quiet)


def test_a_fit_goes_on_from_an_initial_one_of_its_structure_in_that_ones_scaled_numbers() -> None:
    network, few = NeuralStateSpace(states=2, neurons=2), Training(max_iterations=1, starts=1)
    near = [hidden_saturation(0, 200)]
    far = [*near, replace(near[0], name="far", values=2.0 * near[0].values)]
    first = fit_neural_state_space(near, MAPPING, network, Training(max_iterations=60, starts=1), rest_output=0.0)
    again = fit_neural_state_space(near, MAPPING, network, few, rest_output=0.0, initial=first)
    afresh = fit_neural_state_space(near, MAPPING, network, few, rest_output=0.0)
    rest = Start()
    assert rmse(again, near[0], rest) <= rmse(first, near[0], rest) * (1.0 + 1e-6)
    assert rmse(again, near[0], rest) < 0.95 * rmse(afresh, near[0], rest)
    wider = fit_neural_state_space(far, MAPPING, network, few, rest_output=0.0, initial=first)
    assert wider.model.recursion.scaling == first.model.recursion.scaling


def test_what_a_first_state_does_is_gone_once_it_has_died_away():
    """It stands still near 1e-320 otherwise, where a processor takes a hundred cycles for a number."""
    sizes, n = NeuralStateSpace(states=1, neurons=0).sizes(1), 9 * BLOCK
    u = np.repeat(np.random.default_rng(0).uniform(-1.0, 1.0, n // 32), 32)
    trace = a_trace("long", u, 0.5 * u)
    form = NeuralForm(
        sizes=sizes, theta=np.zeros(sizes.count), scaling=Scaling.to_unit_range([trace.columns(["u"])], [trace["y"]])
    )
    starts = experiments_of([trace], MAPPING, Start(kind=StartKind.ESTIMATED), 0.0)
    provider = NeuralProvider(template=form, experiments=starts)
    theta = np.zeros(sizes.count + sizes.states)
    theta[[0, 1, 3]] = 0.9, 0.1, 1.0  # a pole, and what goes in and out
    theta[-1] = 1.0
    moves = provider.jacobian(theta)[:, -1]
    assert moves[0] == pytest.approx(1.0)
    assert moves[BLOCK] == pytest.approx(0.9**BLOCK)
    assert np.abs(moves[8 * BLOCK :]).max() == 0.0


def test_an_interruption_while_the_linear_start_is_fitted_ends_the_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """It had ended that start alone, halfway, and all that was kept of the fit then began there."""

    def pressed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(LevenbergMarquardt, "_step", pressed)
    with pytest.raises(KeyboardInterrupt):
        fit_neural_state_space([linear(0, 200)], MAPPING, NeuralStateSpace(states=2, neurons=2))
