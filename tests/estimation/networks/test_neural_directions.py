"""Neurons that read and move a few directions: matrices of a rank, sensitivities along it, a start that finds it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.estimation import FitResult, Status, Training, fit_neural_state_space
from sysid.estimation.networks.neural.directions import in_few_directions, narrowed
from sysid.estimation.networks.neural.provider import NeuralProvider
from sysid.estimation.records.experiment import experiments_of
from sysid.models import (
    Mapping,
    NeuralForm,
    NeuralStateSpace,
    NeuralStateSpaceModel,
    Scaling,
    Start,
    StartKind,
    structure_from_dict,
)
from sysid.models.networks import low_rank
from sysid.models.networks.neural_sizes import Sizes
from sysid.traces import Channel, Trace

MAPPING = Mapping.parse("u -> y")
MEASURED = Start(kind=StartKind.MEASURED, n_measured=20)
UNIT = Scaling(input_offset=(0.0,), input_scale=(1.0,), output_offset=0.0, output_scale=1.0)
ODD: list[dict[str, Any]] = [
    {},
    {"output_neurons": 3},
    {"integrators": 1, "output_neurons": 3},
    {"integrators": 1, "integrators_seen": True},
    {"linear_inputs": True, "output_neurons": 3},
]
"""Options beside which directions have to hold."""


def spring(seed: int, n: int = 600, noise: float = 0.0) -> Trace:
    """A mass on a spring that stiffens, behind an actuator: linear but for a curve over its place."""
    rng = np.random.default_rng(seed)
    u, y, place, speed, force = np.repeat(rng.uniform(-1.0, 1.0, n // 15), 15), np.empty(n), 0.0, 0.0, 0.0
    for t in range(n):
        y[t] = place
        speed += 0.2 * (force - 0.5 * speed - place - 3.0 * place**3)
        place += 0.2 * speed
        force += 0.4 * (u[t] - force)
    channels = (Channel(name="u", unit="V"), Channel(name="y", unit="m"))
    return Trace(
        name=f"record {seed}",
        sample_time=0.1,
        channels=channels,
        values=np.column_stack([u, y + noise * rng.standard_normal(n)]),
    )


def a_provider(network: NeuralStateSpace, trace: Trace) -> NeuralProvider:
    form = NeuralForm(sizes=network.sizes(1), theta=np.zeros(network.sizes(1).count), scaling=UNIT)
    return NeuralProvider(template=form, experiments=experiments_of([trace], MAPPING, MEASURED, 0.0))


def parts(sizes: Sizes, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What neurons read, those of the state equation above those of the output's, and how they move the states."""
    read = [theta[part].reshape(-1, sizes.row)[:, :-1] for part in (sizes.hidden, sizes.output_hidden)]
    return np.concatenate(read), theta[sizes.readout].reshape(sizes.states, -1)


def random(sizes: Sizes, seed: int, more: int = 0) -> np.ndarray:
    return sizes.hold(0.3 * np.random.default_rng(seed).standard_normal(sizes.count + more))


@pytest.mark.parametrize("directions", [1, 2, 3, 9])
@pytest.mark.parametrize("options", ODD, ids=str)
def test_parameters_are_as_many_as_there_are_ways_to_move(options: dict[str, Any], directions: int) -> None:
    sizes = NeuralStateSpace(states=4, neurons=5, directions=directions, **options).sizes(2)
    theta = random(sizes, 0)
    assert [np.linalg.matrix_rank(part) <= directions for part in parts(sizes, theta)] == [True, True]
    np.testing.assert_allclose(sizes.hold(theta), theta, atol=1e-12)
    moves = np.eye(sizes.count)
    sizes.along(theta, moves)
    assert np.linalg.matrix_rank(moves) == sizes.free
    np.testing.assert_allclose(moves @ moves, moves, atol=1e-12)


def test_a_step_along_stays_to_first_order() -> None:
    sizes = NeuralStateSpace(states=4, neurons=5, output_neurons=3, directions=2).sizes(2)
    theta, step = random(sizes, 1), np.random.default_rng(2).standard_normal(sizes.count)
    off = step.copy()
    sizes.along(theta, step)
    lost = [
        [np.linalg.norm(sizes.hold(theta + h * one) - theta - h * one) for h in (1e-3, 1e-4)] for one in (step, off)
    ]
    assert lost[0][1] < 0.02 * lost[0][0]  # a hundredth: the second order is what is lost
    assert lost[1][1] > 0.05 * lost[1][0]


@pytest.mark.parametrize("options", ODD, ids=str)
def test_sensitivities_are_those_of_steps_that_keep_the_rank(options: dict[str, Any]) -> None:
    network = NeuralStateSpace(states=3, neurons=4, directions=1, **options)
    rows = a_provider(network, spring(0, 60))
    theta = random(rows.template.sizes, 3, rows.n_parameters - rows.template.sizes.count)
    J, rng = rows.jacobian(theta), np.random.default_rng(4)
    for _ in range(5):
        step = rng.standard_normal(len(theta))
        ends = [rows.outputs(rows.nearest(theta + h * step)).ravel() for h in (1e-6, -1e-6)]
        np.testing.assert_allclose(J @ step, (ends[0] - ends[1]) / 2e-6, atol=1e-5)
    at = rows.linearise(theta)
    np.testing.assert_allclose(at.gauss_newton, J.T @ J, atol=1e-9)
    leaves = np.eye(len(theta))
    rows.template.sizes.along(theta, leaves)
    np.testing.assert_allclose(leaves @ at.gradient, at.gradient, atol=1e-9)


def test_the_nearest_matrix_is_as_far_as_the_singular_values_that_it_lacks() -> None:
    matrix = np.random.default_rng(5).standard_normal((6, 4))
    values = np.linalg.svd(matrix, compute_uv=False)
    assert np.linalg.norm(matrix - low_rank.nearest(matrix, 2)) == pytest.approx(np.hypot(*values[2:]))
    assert low_rank.nearest(matrix, 4) is matrix


def test_what_leaves_a_rank_is_what_the_projectors_take() -> None:
    rng = np.random.default_rng(6)
    matrix, moves = low_rank.nearest(rng.standard_normal((6, 4)), 2), rng.standard_normal((3, 6, 4))
    U, _, Q = np.linalg.svd(matrix)
    slow = np.stack([U[:, 2:] @ U[:, 2:].T @ one @ Q[2:].T @ Q[2:] for one in moves])
    np.testing.assert_allclose(low_rank.leaving(moves, low_rank.spaces(matrix, 2)), slow, atol=1e-12)


@pytest.mark.parametrize("output_neurons", [0, 3])
def test_directions_that_a_network_has_without_saying_so_are_found(output_neurons: int) -> None:
    """Neurons of one direction and lines beside it: what is left to find is the same model, of that direction."""
    free = NeuralStateSpace(states=3, neurons=4, output_neurons=output_neurons).sizes(1)
    one = replace(free, directions=1)
    theta = 0.5 * random(one, 6)
    form = NeuralForm(sizes=free, theta=theta, scaling=UNIT)
    u = np.random.default_rng(7).uniform(-1.0, 1.0, (800, 1))
    z = np.column_stack([form.path(u, np.zeros(3)), u])
    found = narrowed(form, z, 1)
    assert found.sizes == one
    begun = np.array([0.2, -0.1])
    np.testing.assert_allclose(
        found.run(u, found.resting(begun[:1], begun[1:])), form.run(u, form.resting(begun[:1], begun[1:])), atol=1e-8
    )


def test_a_plant_with_one_curve_is_found_with_one_direction() -> None:
    training = Training(max_iterations=80, starts=2, workers=1)
    network = NeuralStateSpace(states=3, neurons=6, directions=1)
    fit = fit_neural_state_space([spring(0, noise=2e-3)], MAPPING, network, training, start=MEASURED)
    model, unseen = fit.model, spring(1)
    assert isinstance(model, NeuralStateSpaceModel)
    assert [np.linalg.matrix_rank(part, tol=1e-9) for part in parts(model.recursion.sizes, model.theta)] == [1, 1]
    assert model.n_parameters < NeuralStateSpace(states=3, neurons=6).sizes(1).count - 20
    u, y = unseen.columns(["u"]), unseen["y"]
    run = model.simulate(u[20:], MEASURED.history(u, y, model.rest_output))
    assert np.sqrt(np.mean((run - y[20:]) ** 2)) < 0.03 * y.std()
    assert fit.posterior is not None
    assert np.isfinite(fit.posterior.factor).all()


def test_who_stops_it_while_neurons_are_free_has_a_model_of_few_directions_at_once() -> None:
    network = NeuralStateSpace(states=3, neurons=6, directions=1)
    asked = list[Training]()

    def fit(*, training: Training, **given: Any) -> FitResult:
        asked.append(training)
        found = fit_neural_state_space(**given, training=training)
        return replace(found, status=Status.INTERRUPTED) if len(asked) == 1 else found

    given = {"traces": [spring(0)], "mapping": MAPPING, "network": network, "start": MEASURED}
    found = in_few_directions(given, Training(max_iterations=20, starts=2, workers=1), fit)
    assert [one.max_time_s for one in asked] == [np.inf, 0.0]
    assert found.status is Status.INTERRUPTED
    assert found.model.structure == network


def test_without_neurons_there_are_none_to_seek() -> None:
    network = NeuralStateSpace(states=2, neurons=0, directions=1)
    fit = fit_neural_state_space([spring(0)], MAPPING, network, Training(max_iterations=5, starts=1), start=MEASURED)
    assert fit.model.n_parameters == NeuralStateSpace(states=2, neurons=0).sizes(1).free
    assert not any("Begun from" in note for note in fit.notes)


@pytest.mark.parametrize("directions", [0, -1, 1.5, True, "1"])
def test_other_numbers_are_refused(directions: object) -> None:
    with pytest.raises(ConfigError, match="not a number of directions"):
        NeuralStateSpace(states=2, neurons=1, directions=directions)  # type: ignore[arg-type]


def test_it_is_named_and_stored() -> None:
    network = NeuralStateSpace(states=3, neurons=8, directions=2)
    assert network.label == "NSS 3/8 2 directions"
    assert structure_from_dict(network.to_dict()) == network
