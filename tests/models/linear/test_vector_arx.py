"""ARX models of several outputs against their own equation, written as a loop, and against matrices of polynomials."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy
from numpy.testing import assert_allclose

import sysid
from sysid.errors import ConfigError, TraceError
from sysid.models import History, Mapping, VectorARX, VectorARXModel, model_from_dict

NA, NB, NK = [[2, 1], [1, 2]], [[2, 1, 0], [1, 2, 1]], [[1, 4, 0], [0, 2, 3]]
ORDERS = VectorARX(na=NA, nb=NB, nk=NK)


def model(orders: VectorARX = ORDERS, inputs: int = 3, seed: int = 1, *, size: float = 0.6) -> VectorARXModel:
    mapping = Mapping(inputs=[f"u{j}" for j in range(inputs)], outputs=["y0", "y1"])
    rng = np.random.default_rng(seed)
    terms = orders.sized(inputs, 2).terms
    values = [rng.uniform(0.3, 1.0) * (size / 3 if c >= inputs else 1.0) * rng.choice([-1, 1]) for _, c, _ in terms]
    return VectorARXModel(
        orders=orders, coefficients=np.array(values), intercepts=np.array([0.3, -0.2]), mapping=mapping,
        sample_time=0.1, input_units=("V",) * inputs, output_units=("bar", "K"), rest_outputs=(1.0, 2.0),
    )  # fmt: skip


def step_by_step(one: VectorARXModel, u: Any, y: Any, past: int, *, free: bool) -> Any:
    """The equation as it is written; of the free run the model's own past, else the measured one."""
    m, found = len(one.mapping.inputs), np.array(y)
    for t in range(past, len(u)):
        read = found if free else y
        row = one.intercepts.copy()
        for (i, c, lag), value in zip(one.orders.terms, one.coefficients, strict=True):
            row[i] += value * (u[t - lag, c] if c < m else read[t - lag, c - m])
        found[t] = row
    return found


def test_a_free_run_and_a_prediction_are_those_of_the_equation() -> None:
    one, rng = model(), np.random.default_rng(2)
    u, y = rng.normal(size=(80, 3)), rng.normal(size=(80, 2))
    history = History(inputs=u[:5], output=y[:5])
    assert_allclose(one.simulate(u[5:], history), step_by_step(one, u, y, 5, free=True)[5:], atol=1e-12)
    assert_allclose(one.predict(u[5:], y[5:], history), step_by_step(one, u, y, 5, free=False)[5:], atol=1e-12)


def test_the_matrices_of_coefficients_are_those_of_the_equation() -> None:
    one = model()
    assert one.a.shape == (2, 2, 2) and one.b.shape == (5, 2, 3)
    named = dict(zip(one.orders.terms, one.coefficients, strict=True))
    assert one.b[4, 0, 1] == named[0, 1, 4]
    assert one.a[1, 1, 1] == named[1, 4, 2]
    assert one.a[1, 0, 1] == 0.0  # y0 reads y1 one sample back
    assert np.count_nonzero(one.a) + np.count_nonzero(one.b) == len(one.coefficients)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("na", "nb", "nk"),
    [(NA, NB, NK), (2, 1, 1), ([[1, 2], [0, 1]], 2, [[0, 3, 9]]), ([[0, 3], [1, 0]], NB, 1), (0, 2, 1)],
)
def test_ratios_and_state_space_are_the_inverse_of_the_polynomials(na: Any, nb: Any, nk: Any, seed: int) -> None:
    one = model(VectorARX(na=na, nb=nb, nk=nk), seed=seed)
    A, B, C, D = one.matrices
    for z in np.exp(1j * np.array([0.0, 0.3, 2.0])):
        left = np.eye(2) - sum((a * z ** -(k + 1.0) for k, a in enumerate(one.a)), np.zeros((2, 2)))
        true = np.linalg.solve(left, sum(b * z ** -float(k) for k, b in enumerate(one.b)))
        assert_allclose(C @ np.linalg.solve(z * np.eye(len(A)) - A, B) + D, true, atol=1e-11)
        for (o, j), ratio in one.ratios.items():
            top = ratio.B @ z ** -(ratio.delay + np.arange(len(ratio.B)))
            assert_allclose(top / (ratio.F @ z ** -np.arange(len(ratio.F))), true[o, j], atol=1e-11)


def test_an_input_that_reaches_an_output_through_another_comes_as_late() -> None:
    orders = VectorARX(na=[[1, 1], [0, 1]], nb=[[0, 1], [2, 0]], nk=[[0, 2], [3, 0]])
    ratios = model(orders, inputs=2).ratios
    assert {places: ratio.delay for places, ratio in ratios.items()} == {(0, 0): 4, (0, 1): 2, (1, 0): 3, (1, 1): 0}
    assert len(ratios[1, 1].B) == 0  # what acts on the first output does not reach the second
    assert len(ratios[0, 0].F) == 3


def test_poles_are_the_roots_of_the_determinant_and_none_is_a_dead_time() -> None:
    one = model()
    block = np.zeros((4, 4))
    block[:2, :2], block[:2, 2:], block[2:, :2] = one.a[0], one.a[1], np.eye(2)
    true = sorted(np.linalg.eigvals(block), key=lambda z: (-abs(z), z.imag))
    assert_allclose(sorted(one.poles, key=lambda z: (-abs(z), z.imag)), true, atol=1e-12)
    assert one.pole_radius == pytest.approx(max(map(abs, true)))
    assert (
        len(model(VectorARX(na=[[1, 2], [0, 1]], nb=1, nk=1)).poles) == 2
    )  # two roots, whatever y1 of two samples ago
    assert model(VectorARX(na=0, nb=1, nk=1)).pole_radius == 0.0


def test_a_plant_that_integrates_has_its_pole_at_one_and_its_numerators() -> None:
    orders = VectorARX(na=[[1, 1], [0, 1]], nb=1, nk=1)
    mapping = Mapping.parse("u -> y0+y1")
    one = VectorARXModel(
        orders=orders, coefficients=np.array([0.0, 1.0, 0.5, 1.0, 0.8]), intercepts=np.zeros(2), mapping=mapping,
        sample_time=1.0, input_units=("V",), output_units=("m", "m/s"), rest_outputs=(0.0, 0.0),
    )  # fmt: skip
    assert_allclose(one.poles, [1.0, 0.8], atol=1e-14)
    ratio = one.ratios[0, 0]
    assert_allclose(np.append(np.zeros(ratio.delay), ratio.B), [0.0, 0.0, 0.5], atol=1e-14)
    assert_allclose(ratio.F, [1.0, -1.8, 0.8], atol=1e-14)


def test_polynomials_move_with_each_coefficient_as_they_are_said_to() -> None:
    one = model()
    step = 1e-6
    for o, j in [(-1, -1), *one.ratios]:
        slopes = one.polynomials.slopes(o, j)
        for k in range(len(one.coefficients)):
            ends = []
            for way in (step, -step):
                moved = one.coefficients.copy()
                moved[k] += way
                found = replace(one, coefficients=moved).polynomials
                ends.append(found.denominator if o < 0 else found.numerator(o, j))
            assert_allclose(slopes[:, k], (ends[0] - ends[1]) / (2 * step), atol=1e-8)


def test_innovations_go_through_the_inverse_of_the_past() -> None:
    one = model()
    responses = one.innovation_responses(6)
    for j in range(2):
        y = np.zeros((8, 2))
        y[2, j] = 1.0
        for t in range(3, 8):
            y[t] = one.a[0] @ y[t - 1] + one.a[1] @ y[t - 2]
        assert_allclose(responses[:, :, j], y[2:], atol=1e-14)


def test_a_continuous_system_gives_its_samples_behind_the_dead_times_that_all_outputs_share() -> None:
    orders = VectorARX(na=1, nb=1, nk=[[1, 4, 2]])
    one = model(orders)
    moved = one.coefficients.copy()
    moved[[3, 4, 8, 9]] = [0.7, 0.1, -0.2, 0.8]
    one = replace(one, coefficients=moved)
    found = one.continuous()
    assert_allclose(found.delays, [0.0, 0.3, 0.1])
    assert_allclose(np.exp(0.1 * found.poles), one.poles, atol=1e-12)
    u = np.repeat(np.random.default_rng(3).normal(size=(20, 3)), 5, axis=0)
    x, y, late = np.zeros(2), np.zeros((100, 2)), [0, 3, 1]
    for t in range(99):  # sample by sample, by what python-control says of it
        plant = sampled(found)
        now = np.array([u[t - k, j] if t >= k else 0.0 for j, k in enumerate(late)])
        x = plant[0] @ x + plant[1] @ now
        y[t + 1] = found.C @ x
    alone = replace(one, intercepts=np.zeros(2))
    history = History(inputs=np.zeros((5, 3)), output=np.zeros((5, 2)))
    assert_allclose(alone.simulate(u, history)[1:], y[1:], atol=1e-10)
    assert one.to_control().ninputs == one.to_control(continuous=True).ninputs == 3
    with pytest.raises(ConfigError, match="no continuous system of this order"):
        model().continuous()


def sampled(found: Any) -> tuple[Any, Any]:
    """The matrices from sample to sample, inputs held."""
    n, m = found.B.shape
    block = np.zeros((n + m, n + m))
    block[:n] = 0.1 * np.concatenate([found.A, found.B], axis=1)
    whole = scipy.linalg.expm(block)
    return whole[:n, :n], whole[:n, n:]


def test_it_is_written_and_read_and_takes_other_parameters() -> None:
    one = model()
    again = model_from_dict(one.to_dict())
    assert isinstance(again, VectorARXModel)
    assert again.to_dict() == one.to_dict()
    theta = one.vector
    assert theta is not None
    assert_allclose(one.with_theta(2.0 * theta).coefficients, 2.0 * one.coefficients)
    with pytest.raises(TraceError, match="the coefficients do not fit the structure"):
        replace(one, coefficients=one.coefficients[1:])


def test_one_number_is_for_all_and_the_model_says_what_it_became() -> None:
    assert VectorARX(na=2, nb=[[1], [2]], nk=1).label == "VectorARX [2; 1, 2; 1]"
    assert model(VectorARX(na=2, nb=[[1], [2]], nk=1)).structure.label == "VectorARX [2; 1 1 1, 2 2 2; 1]"
    assert VectorARX(na=np.array(NA), nb=NB, nk=NK) == ORDERS
    assert VectorARX(na=2, nb=[1, 2, 1], nk=0) == VectorARX(na=[[2]], nb=[[1, 2, 1]], nk=[[0]])


@pytest.mark.parametrize(
    "fields",
    [
        {"na": [2, 1]},  # the own past of each output, or what each reads of both?
        {"na": []},
        {"na": [[1, 2], [1]]},
        {"na": [[1, 2, 1], [1, 1, 1]]},
        {"nb": [[1, 1], [1, 1], [1, 1]], "na": NA},
        {"nb": [], "nk": 1},
        {"nb": [1, 2], "nk": [1, 2, 3]},
        {"nk": [[1.5]]},
        {"na": -1},
    ],
    ids=str,
)
def test_what_are_no_orders_is_refused(fields: dict[str, Any]) -> None:
    with pytest.raises(ConfigError, match="not the orders of an ARX model of several outputs"):
        VectorARX(**({"na": 1, "nb": 1, "nk": 1} | fields))


@pytest.mark.parametrize(
    ("fields", "where"),
    [({"na": [[1] * 3] * 3}, "na with a row and a column"), ({"nb": [[1], [1], [1]]}, "nb with a row"),
     ({"nk": [1, 1]}, "nk with a column")],
)  # fmt: skip
def test_matrices_of_another_size_are_refused_by_name(fields: dict[str, Any], where: str) -> None:
    with pytest.raises(ConfigError, match=where):
        VectorARX(**({"na": 1, "nb": 1, "nk": 1} | fields)).sized(3, 2)


def test_matrices_of_arx_lead_to_the_structure_that_has_them() -> None:
    with pytest.raises(ConfigError, match="write VectorARX, with the same orders"):
        sysid.ARX(na=NA, nb=1, nk=1)  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="write VectorARX, with the same orders"):
        sysid.ARX(na=1, nb=[[1, 1], [1, 1]], nk=1)  # type: ignore[arg-type]
