"""Where linear systems without noise rest: at the equilibrium of their inputs, and sums at any output that is said."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import block_diag

from sysid.models import ARMAX, BJ, OE, Mapping, Scaling, TransferFunction, VectorScaling
from sysid.models.linear.at_rest import state_at_rest
from sysid.models.linear.innovations import Innovations
from sysid.models.linear.polynomial import PolynomialModel
from sysid.models.linear.state_space import StateSpace
from sysid.models.linear.transfer_function import TransferFunctionModel

REST = 5.0
SYSTEMS = {
    "one sum": np.diag([1.0, 0.5, 0.9]),
    "two sums": np.diag([1.0, 1.0, 0.4]),
    "a chain of two": block_diag([[1.0, 1.0], [0.0, 1.0]], [[0.7]]),
    "a chain of three": np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]]),
    "a sum beside what grows": np.diag([1.0, 1.05, 0.5]),
    "a sum beside what alternates": np.diag([-1.0, 0.5, 1.0]),
    "three slow modes and no sum": np.diag([0.999, 0.9991, 0.9992]),
}
Array = np.ndarray


def run(matrices: tuple[Array, ...], u: Array, rest: float) -> Array:
    A, B, C, D, constant = matrices
    x, found = state_at_rest((A, B, C, D, constant), u[0], np.array([rest])), []
    for row in u:
        found.append(C @ x + D @ row + constant)
        x = A @ x + B @ row
    return np.array(found)[:, 0]


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_run_is_the_same_in_all_coordinates(name: str) -> None:
    rng, A = np.random.default_rng(0), SYSTEMS[name]
    B, C, D = rng.standard_normal((3, 2)), rng.standard_normal((1, 3)), rng.standard_normal((1, 2))
    constant, u = np.array([0.3]), np.repeat(rng.standard_normal((2, 2)), 20, axis=0)
    first = run((A, B, C, D, constant), u, REST)
    for _ in range(10):
        T = 10.0 ** rng.integers(-6, 6, (3, 1)) * np.linalg.qr(rng.standard_normal((3, 3)))[0]
        back = np.linalg.inv(T)
        other = run((T @ A @ back, T @ B, C @ back, D, constant), u, REST)
        assert_allclose(other, first, rtol=0.0, atol=1e-6 * np.abs(first).max())


def models(poles: tuple[float, ...], delay: int) -> list[PolynomialModel | TransferFunctionModel]:
    """One system as OE and as a transfer function."""
    terms = {
        "scaling": Scaling.identity(1), "mapping": Mapping.parse("u -> y"), "sample_time": 1.0, "input_units": ("V",),
        "output_unit": "V", "rest_output": REST,
    }  # fmt: skip
    n, F = len(poles), np.poly(poles)
    orders = OE(nb=(1,), nf=(n,), nk=(delay,))
    one = PolynomialModel(orders=orders, theta=np.array([0.1, *F[1:], *[0.0] * orders.level]), **terms)
    asked = TransferFunction(poles=(n,), zeros=(0,), delays=(delay,))
    sections = tuple(np.array([1.0, -pole]) for pole in poles)
    made = TransferFunctionModel(orders=asked, sections=(sections,), taps=(np.array([1.0]),), constant=0.0, **terms)
    taps = (np.array([0.1 / made.numerator(0)[0]]),)
    return [
        one,
        TransferFunctionModel(orders=asked, sections=(sections,), taps=taps, constant=0.0, **terms),
    ]


@pytest.mark.parametrize("delay", [0, 1, 4])
@pytest.mark.parametrize("poles", [(1.0,), (1.0, 0.5), (1.0 - 1e-10, 0.5), (0.9, 0.5)], ids=str)
def test_a_polynomial_and_a_transfer_function_begin_alike_at_rest(poles: tuple[float, ...], delay: int) -> None:
    u = np.repeat([2.0, 3.0], 10)[:, np.newaxis]
    first, second = (model.simulate(u) for model in models(poles, delay))
    assert_allclose(first, second, rtol=1e-6)
    if poles[0] > 0.99:  # a sum stands at its output until the input has gone through its dead time
        expected, z = np.full(20, REST), 0.0
        drive = np.concatenate([np.zeros(delay), u[:, 0]])[:20]
        level = REST
        for t in range(20):
            z = (poles[1] if len(poles) > 1 else 0.0) * z + drive[t]
            level = level + 0.1 * z
            expected[t] = level
        assert_allclose(first, expected - (expected[0] - REST), rtol=1e-6)


def test_inputs_that_balance_stand_as_they_are_and_others_at_the_nearest_level_at_which_they_do() -> None:
    """A tank with what comes in and what goes out."""
    tank = (np.ones((1, 1)), np.array([[1.0, -1.0]]), np.ones((1, 1)), np.zeros((1, 2)), np.zeros(1))
    assert_allclose(run(tank, np.tile([3.0, 3.0], (5, 1)), REST), np.full(5, REST))
    assert_allclose(run(tank, np.tile([3.0, 2.0], (5, 1)), REST), REST + np.arange(5.0))
    beside = (
        np.diag([1.0, 0.5]), np.diag([1.0, 1.0]), np.ones((1, 2)), np.zeros((1, 2)), np.zeros(1)
    )  # fmt: skip
    # The second input is none of the sum's: what it does has settled, and the sum makes up for it.
    assert_allclose(run(beside, np.tile([0.0, 7.0], (5, 1)), REST), np.full(5, REST))


def test_the_state_that_a_fit_begins_from_is_the_one_that_is_run() -> None:
    system = models((1.0, 0.5), 3)[0].system
    u, y = np.array([2.0]), np.array([REST])
    rested = state_at_rest((system.A, system.B, system.C, system.D, system.constant), u, y)
    assert isinstance(system, Innovations)
    assert_allclose(system.standing(u, y), rested)


def noisy(kind: str, poles: tuple[float, ...], zeros: tuple[float, ...]) -> PolynomialModel:
    """A plant with a model of its noise, whose output stands at 0.2 without an input."""
    n, A, C = len(poles), np.poly(poles)[1:], np.atleast_1d(np.poly(zeros))[1:]
    theta: tuple[float, ...]
    orders: ARMAX | BJ
    if kind == "ARMAX":
        orders, theta = ARMAX(na=n, nb=(1,), nc=len(C), nk=(1,)), (0.1, *A, *C)
    else:
        orders, theta = BJ(nb=(1,), nc=len(C), nd=1, nf=(n,), nk=(1,)), (0.1, *A, *C, -0.5)
    return PolynomialModel(
        orders=orders, theta=np.array([*theta, 0.2]), scaling=Scaling.identity(1), mapping=Mapping.parse("u -> y"),
        sample_time=1.0, input_units=("V",), output_unit="V", rest_output=REST,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "poles", "zeros", "begins"),
    [
        ("ARMAX", (0.8,), (), 0.2 + 0.8 * (REST - 0.2)),  # a recursion over past outputs
        ("ARMAX", (0.8,), (0.5,), 0.2 + 0.6 * (REST - 0.2)),  # 1 - 0.2 / 0.5 of the way to the output that stood
        ("ARMAX", (0.8,), (0.95,), 0.2),  # what stands is no noise: it had begun three times as far off, beyond
        ("ARMAX", (0.8,), (1.0,), 0.2),  # a filter that forgets nothing: it had begun anywhere
        ("ARMAX", (1.0,), (1.0,), REST),
        ("ARMAX", (1.0 + 3e-6,), (1.0 - 1e-8,), 0.2),  # begun at -1435
        ("BJ", (1.0,), (0.3,), REST),
        ("BJ", (1.0, 0.5), (1.0,), REST),
    ],
)
def test_a_model_of_the_noise_begins_at_rest_no_further_off_than_the_output_that_stood(
    kind: str, poles: tuple[float, ...], zeros: tuple[float, ...], begins: float
) -> None:
    model = noisy(kind, poles, zeros)
    run = model.simulate(np.zeros((400, 1)))
    assert_allclose(run[0], begins, rtol=1e-9)
    if poles == (0.8,):
        assert_allclose(run[-1], 0.2, rtol=1e-9)


@pytest.mark.parametrize(("second", "begins"), [(-0.014, [REST, 3.0 * (1.0 - 0.1 / 0.086)]), (-0.099, [REST, 0.0])])
def test_an_output_that_nearly_integrates_begins_where_it_stood_beside_one_that_does_not(
    second: float, begins: list[float]
) -> None:
    system = Innovations(
        A=np.diag([1.0 - 1e-10, 0.9]), B=np.ones((2, 1)), C=np.eye(2), D=np.zeros((2, 1)), K=np.diag([0.03, second]),
        constant=np.zeros(2),
    )  # fmt: skip
    form = StateSpace.of(system, VectorScaling.of([Scaling.identity(1)] * 2), noise=True)
    assert_allclose(form.resting(np.zeros(1), np.array([REST, 3.0])), begins, rtol=1e-6, atol=1e-6)
