"""States that are sums: exact in what is fitted, found from linear models, and better than poles near 1."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import block_diag

from sysid.errors import ConfigError
from sysid.estimation import FitResult, Training, fit_neural_state_space
from sysid.estimation.networks.neural.integrators import summed
from sysid.estimation.networks.neural.map import learnt_map
from sysid.estimation.networks.neural.provider import NeuralProvider
from sysid.estimation.records.experiment import experiments_of
from sysid.models import (
    History,
    Mapping,
    NeuralForm,
    NeuralStateSpace,
    Scaling,
    Start,
    StartKind,
    structure_from_dict,
)
from sysid.models.networks.neural_sizes import Sizes
from sysid.traces import Trace
from tests.traces.made import trace_of

MAPPING = Mapping.parse("u -> y")
MEASURED, ESTIMATED = Start(kind=StartKind.MEASURED, n_measured=20), Start(kind=StartKind.ESTIMATED)
TRAINING = Training(max_iterations=60, starts=2)
UNIT = Scaling(input_offset=(0.0,), input_scale=(1.0,), output_offset=0.0, output_scale=1.0)


def a_trace(u: np.ndarray, y: np.ndarray) -> Trace:
    return trace_of({"u": u, "y": y}, sample_time=0.1, units={"u": "V", "y": "m"})


def ball_and_beam(seed: int, n: int = 400, size: float = 1.0) -> Trace:
    """A ball that rolls on a beam, with its rolling friction; a controller that turns the beam keeps it there."""
    rng = np.random.default_rng(seed)
    wanted = np.repeat(size * rng.uniform(-0.5, 0.5, n // 50 + 1), 50)[:n]
    u, y, speed, place = np.empty(n), np.empty(n), 0.0, 0.0
    for t in range(n):
        y[t] = place
        u[t] = np.clip(1.5 * (wanted[t] - place) - 1.2 * speed + 0.1 * rng.standard_normal(), -1.2, 1.2)
        place += 0.1 * speed
        speed += 0.1 * (np.sin(u[t]) - 0.5 * np.tanh(3.0 * speed))
    return a_trace(u, y)


def carried(order: int, n: int = 300) -> Trace:
    """What a lag brings, added up once or twice."""
    u, y, lag, sums = np.repeat(np.random.default_rng(0).uniform(-1.0, 1.0, n // 10), 10), np.empty(n), 0.0, [0.3, 0.0]
    for t in range(n):
        y[t] = sums[0]
        sums[0] += 0.1 * (sums[1] if order == 2 else lag)
        sums[1] += 0.1 * lag
        lag += 0.3 * (u[t] + 0.05 - lag)
    return a_trace(u, y)


def rmse(fit: FitResult, trace: Trace) -> float:
    u, y = trace.columns(["u"]), trace["y"]
    found = fit.model.simulate(u[20:], MEASURED.history(u, y, fit.model.rest_output))
    return float(np.sqrt(np.mean((found - y[20:]) ** 2)))


def a_provider(network: NeuralStateSpace, trace: Trace, start: Start) -> NeuralProvider:
    sizes = network.sizes(1)
    form = NeuralForm(sizes=sizes, theta=np.zeros(sizes.count), scaling=UNIT)
    return NeuralProvider(template=form, experiments=experiments_of([trace], MAPPING, start, 0.0))


@pytest.fixture(scope="module")
def rolling() -> FitResult:
    network = NeuralStateSpace(states=2, neurons=2, integrators=1)
    return fit_neural_state_space([ball_and_beam(0)], MAPPING, network, TRAINING, start=MEASURED)


def test_a_plant_that_integrates_is_found_for_places_that_were_not_seen(rolling: FitResult) -> None:
    seen = ball_and_beam(2)
    elsewhere = a_trace(seen.columns(["u"]), seen["y"] + 0.6)
    plain = fit_neural_state_space(
        [ball_and_beam(0)], MAPPING, NeuralStateSpace(states=2, neurons=2), TRAINING, start=MEASURED
    )
    assert rmse(rolling, elsewhere) < 0.02 * np.ptp(seen["y"])
    assert rmse(rolling, elsewhere) < 0.5 * rmse(plain, elsewhere)


def test_it_is_the_same_plant_wherever_it_stands(rolling: FitResult) -> None:
    trace = ball_and_beam(2)
    u, y = trace.columns(["u"]), trace["y"]
    at, away = (rolling.model.simulate(u[20:], History(inputs=u[:20], output=y[:20] + by)) for by in (0.0, 0.2))
    np.testing.assert_allclose(away - at, 0.2, atol=1e-6)


def test_no_step_moves_what_is_held(rolling: FitResult) -> None:
    sizes = rolling.model.recursion.sizes
    np.testing.assert_array_equal(sizes.hold(rolling.model.theta), rolling.model.theta)
    M = rolling.model.theta[sizes.linear].reshape(2, -1)
    assert M[:, 1].tolist() == [0.0, 1.0]
    assert np.count_nonzero(M) == 7
    assert rolling.posterior is not None
    assert np.count_nonzero(rolling.posterior.factor[sizes.held]) == 0


@pytest.mark.parametrize(
    ("states", "integrators", "unfed"), [(1, 1, 0), (2, 1, 1), (2, 2, 1), (3, 2, 2), (3, 0, 0)]
)  # fmt: skip
def test_neurons_feed_what_is_no_sum(states: int, integrators: int, unfed: int) -> None:
    sizes = Sizes(states=states, inputs=1, neurons=2, output_neurons=1, integrators=integrators)
    held = np.zeros(sizes.count, dtype=bool)
    held[sizes.held] = True
    fed = ~held[sizes.readout].reshape(states, 2).any(axis=1)
    assert np.count_nonzero(~fed) == unfed
    assert fed[: states - unfed].all()
    read = ~held[sizes.hidden].reshape(2, -1)[:, :states].all(axis=0)
    assert read.tolist() == [k < states - integrators for k in range(states)]
    A = sizes.hold(np.full(sizes.count, 0.5))[sizes.linear].reshape(states, -1)[:, :states]
    assert np.count_nonzero(np.abs(np.linalg.eigvals(A) - 1.0) < 1e-6) >= integrators


@pytest.mark.parametrize(
    "options",
    [
        {"integrators": 1},
        {"integrators": 1, "integrators_seen": True, "linear_inputs": True},
        {"linear_inputs": True},
    ],
    ids=", ".join,
)
@pytest.mark.parametrize("start", [ESTIMATED, MEASURED, Start()], ids=["estimated", "measured", "at rest"])
def test_sensitivities_are_those_of_what_is_free(start: Start, options: dict[str, Any]) -> None:
    network = NeuralStateSpace(states=3, neurons=2, output_neurons=1, **options)
    rows = a_provider(network, carried(1, 80), start)
    sizes = rows.template.sizes
    theta = sizes.hold(0.3 * np.random.default_rng(0).standard_normal(rows.n_parameters))
    J, held = rows.jacobian(theta), np.isin(np.arange(len(theta)), sizes.held)
    assert not J[:, held].any()
    for place in np.flatnonzero(~held):
        step = np.where(np.arange(len(theta)) == place, 1e-6, 0.0)
        slope = (rows.outputs(theta + step) - rows.outputs(theta - step)).ravel() / 2e-6
        np.testing.assert_allclose(J[:, place], slope, atol=1e-6)
    at = rows.linearise(theta)
    assert not at.gradient[held].any()
    np.testing.assert_allclose(at.gauss_newton, J.T @ J, atol=1e-9)


@pytest.mark.parametrize("order", [1, 2])
def test_the_linear_start_has_its_poles_at_one(order: int) -> None:
    network = NeuralStateSpace(states=order + 1, neurons=0, integrators=order)
    fit = fit_neural_state_space(
        [carried(order)], MAPPING, network, Training(max_iterations=20, starts=1), start=MEASURED
    )
    assert rmse(fit, carried(order)) < 1e-5


@pytest.mark.parametrize("count", [0, 1, 2])
def test_a_system_is_the_same_in_the_coordinates_of_its_sums(count: int) -> None:
    rng = np.random.default_rng(count)
    chain = np.eye(count) + np.eye(count, k=-1)
    A = block_diag(np.array([[0.6, 0.3], [-0.3, 0.6]]), 0.9, chain)
    A[3:, :3] = rng.standard_normal((count, 3))
    n = len(A)
    T, B, C = rng.standard_normal((n, n)), rng.standard_normal((n, 2)), rng.standard_normal((1, n))
    own: tuple[Any, ...] = (np.linalg.solve(T, A @ T), np.linalg.solve(T, B), C @ T, np.zeros((1, 2)), np.zeros(1))
    found = summed(own, count)
    responses = [[C @ np.linalg.matrix_power(A, k) @ B for k in range(12)] for A, B, C, *_ in (own, found)]
    np.testing.assert_allclose(responses[1], responses[0], rtol=1e-4, atol=1e-4)
    first = n - count
    assert not found[0][:first, first:].any()
    np.testing.assert_array_equal(np.triu(found[0][first:, first:]), np.eye(count))


def test_the_map_has_the_states_at_which_records_begin() -> None:
    rows = a_provider(NeuralStateSpace(states=2, neurons=2, integrators=1), carried(1), ESTIMATED)
    theta = rows.template.sizes.hold(0.3 * np.random.default_rng(1).standard_normal(rows.n_parameters))
    form, (u, y) = rows.at(learnt_map(rows, theta)), rows.signals[0]
    np.testing.assert_allclose(form.resting(u[0], y[0]), theta[-2:], atol=1e-2)


@pytest.mark.parametrize("integrators", [-1, 3, 0.5, True])
def test_other_numbers_are_refused(integrators: object) -> None:
    with pytest.raises(ConfigError, match="not a number of integrators"):
        NeuralStateSpace(states=2, neurons=1, integrators=integrators)  # type: ignore[arg-type]


def test_neurons_may_see_where_the_plant_stands_and_nothing_linear_does() -> None:
    plain, seen = (
        NeuralStateSpace(states=2, neurons=3, integrators=1, integrators_seen=seen).sizes(1) for seen in (False, True)
    )
    more = np.setdiff1d(plain.held, seen.held)
    assert set(more) == set(np.arange(plain.count)[plain.hidden].reshape(3, -1)[:, 1])
    with pytest.raises(ConfigError, match="no integrator to be seen"):
        NeuralStateSpace(states=2, neurons=3, integrators_seen=True)


def test_inputs_act_in_proportion_where_neurons_do_not_read_them() -> None:
    """Whatever the state: twice the input moves the next state twice as far."""
    network = NeuralStateSpace(states=2, neurons=3, output_neurons=2, linear_inputs=True)
    sizes = network.sizes(1)
    theta = sizes.hold(np.random.default_rng(2).standard_normal(sizes.count))
    form = NeuralForm(sizes=sizes, theta=theta, scaling=UNIT)
    ends = [form.path(np.array([[u], [0.0]]), np.array([0.3, -0.2]))[1] for u in (0.0, 1.0, 2.0)]
    np.testing.assert_allclose(ends[2] - ends[0], 2.0 * (ends[1] - ends[0]), atol=1e-12)
    assert network.label == "NSS 2/3/2 linear inputs"
    assert structure_from_dict(network.to_dict()) == network


def test_it_is_named_and_stored() -> None:
    network = NeuralStateSpace(states=3, neurons=2, integrators=2)
    assert network.label == "NSS 3/2 2 integrators"
    assert structure_from_dict(network.to_dict()) == network
    assert structure_from_dict(replace(network, integrators_seen=True).to_dict()).label.endswith("2 integrators seen")
    assert network.to_dict()["integrators"] == 2
    assert "integrators" not in NeuralStateSpace(states=3, neurons=2).to_dict()
