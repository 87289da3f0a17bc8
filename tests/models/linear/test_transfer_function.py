"""Transfer-function models: they run as SciPy's filters do, start at rest or in motion, survive storing."""

from __future__ import annotations

import json

import control
import numpy as np
import pytest
from scipy import linalg, signal

from sysid.errors import ConfigError, TraceError
from sysid.models import ARX, ARXModel, Domain, History, Mapping, Scaling, TransferFunction, model_from_dict
from sysid.models.converting.orthonormal_basis import basis_of, numerators
from sysid.models.converting.to_control import state_space
from sysid.models.linear.polynomial_moves import Polynomials
from sysid.models.linear.transfer_function import TransferFunctionModel

T = 0.1
B, F = [[1.0, 0.5], [0.4]], [[1.0, -1.5, 0.7], [1.0, -0.9]]
BC, FC = [[3.0, 2.0], [1.0]], [[4.0, 1.0, 1.0], [0.5, 1.0]]  # ascending in s


def build(
    domain: Domain = Domain.DISCRETE, *, delays: tuple[int, ...] = (1, 3), constant: float = 0.0
) -> TransferFunctionModel:
    b, f = (B, F) if domain is Domain.DISCRETE else (BC, FC)
    taps, sections = [], []
    for num, den in zip(b, f, strict=True):
        section = (np.array(den),)
        table = numerators(basis_of(section, len(num) - 1, domain))[:, : len(num)]
        taps.append(np.linalg.solve(table.T, np.array(num)))
        sections.append(section)
    return TransferFunctionModel(
        orders=TransferFunction(poles=(2, 1), zeros=(1, 0), delays=delays, domain=domain),
        sections=tuple(sections),
        taps=tuple(taps),
        constant=constant,
        scaling=Scaling.identity(2),
        mapping=Mapping.parse("u1+u2 -> y"),
        sample_time=T,
        input_units=("V", "A"),
        output_unit="bar",
        rest_output=0.0,
    )


def inputs(n: int = 200, seed: int = 0) -> np.ndarray:
    u = np.repeat(np.random.default_rng(seed).normal(size=(n // 5, 2)), 5, axis=0)
    u[0] = 0.0
    return u


def by_scipy(domain: Domain, u: np.ndarray, delays: tuple[int, ...] = (1, 3)) -> np.ndarray:
    total = np.zeros(len(u))
    for j, k in enumerate(delays):
        delayed = np.concatenate([np.zeros(k), u[: len(u) - k, j]])
        if domain is Domain.DISCRETE:
            total += signal.lfilter(B[j], F[j], delayed)
        else:
            num, den, _ = signal.cont2discrete((BC[j][::-1], FC[j][::-1]), T, "zoh")
            total += signal.lfilter(num.ravel(), den, delayed)
    return total


DOMAINS = pytest.mark.parametrize("domain", list(Domain), ids=lambda d: d.value)


@DOMAINS
@pytest.mark.parametrize("delays", [(1, 3), (0, 0), (4, 1)], ids=str)
def test_free_run_is_scipys(domain: Domain, delays: tuple[int, ...]) -> None:
    u = inputs()
    np.testing.assert_allclose(build(domain, delays=delays).simulate(u), by_scipy(domain, u, delays), atol=1e-11)


@DOMAINS
def test_a_system_at_rest_stays_there(domain: Domain) -> None:
    model = build(domain, constant=2.0)
    held = np.tile([3.0, -1.0], (50, 1))
    gain = [np.real(model.response(j, np.array([0.0]))[0]) for j in range(2)]
    np.testing.assert_allclose(model.simulate(held), 2.0 + 3.0 * gain[0] - gain[1], rtol=1e-9)


@DOMAINS
def test_a_measured_start_finds_the_state(domain: Domain) -> None:
    """The record begins in motion; the history's output tells the state."""
    model, u = build(domain), inputs(400, 1)
    y = model.simulate(u)
    history = History(inputs=u[100:160], output=y[100:160])
    np.testing.assert_allclose(model.simulate(u[160:], history), y[160:], atol=2e-3)
    at_rest = model.simulate(u[160:])
    assert np.abs(at_rest - y[160:]).max() > 0.5


@DOMAINS
def test_a_run_in_pieces_equals_one_long_run(domain: Domain) -> None:
    form, u = build(domain).recursion, inputs()
    x = form.state(History.at_rest(inputs=u[0], output=0.0))
    pieces = np.concatenate([form._run(u[:70], x), form._run(u[70:], x)])
    np.testing.assert_array_equal(pieces[:, 0], build(domain).simulate(u))


def test_there_is_no_prediction_that_is_not_the_free_run() -> None:
    model, u = build(), inputs()
    assert not model.recursion.predicts
    with pytest.raises(ConfigError, match="no prediction"):
        model.predict(u, np.ones(len(u)), steps=3)


@DOMAINS
def test_coefficients_poles_and_zeros(domain: Domain) -> None:
    model = build(domain)
    b, f = (B, F) if domain is Domain.DISCRETE else (BC, FC)
    for j in range(2):
        np.testing.assert_allclose(model.numerator(j), b[j], atol=1e-12)
        np.testing.assert_allclose(model.denominator(j), f[j], atol=1e-12)
    descending = f[0] if domain is Domain.DISCRETE else f[0][::-1]
    np.testing.assert_allclose(np.sort_complex(model.poles(0)), np.sort_complex(np.roots(descending)))
    assert model.zeros(0)[0] == pytest.approx(-0.5 if domain is Domain.DISCRETE else -1.5)
    assert model.stable
    assert model.n_parameters == 7


@DOMAINS
def test_the_model_survives_being_stored(domain: Domain) -> None:
    model, u = build(domain, constant=0.3), inputs()
    again = model_from_dict(json.loads(json.dumps(model.to_dict())))
    np.testing.assert_array_equal(again.simulate(u), model.simulate(u))
    assert again.structure == model.structure


@DOMAINS
@pytest.mark.parametrize("delays", [(1, 3), (0, 0)], ids=str)
def test_python_control_agrees(domain: Domain, delays: tuple[int, ...]) -> None:
    model, u = build(domain, delays=delays), inputs()
    system = state_space(model)
    response = control.forced_response(system, np.arange(len(u)) * T, u.T)
    np.testing.assert_allclose(response.outputs.ravel(), model.simulate(u), atol=1e-9)
    w = np.array([0.3, 2.0, 5.0])
    tf = model.to_control(pade_order=8)
    for j in range(2):
        np.testing.assert_allclose(control.frequency_response(tf[0, j], w).complex, model.response(j, w), rtol=1e-4)


def arx_model() -> ARXModel:
    return ARXModel(
        orders=ARX(na=2, nb=(2, 1), nk=(0, 3)),
        coefficients=np.array([1.0, 0.5, 0.3, 1.5, -0.7]),
        intercept=0.0,
        mapping=Mapping.parse("u1+u2 -> y"),
        sample_time=T,
        input_units=("V", "A"),
        output_unit="bar",
        rest_output=0.0,
    )


def test_python_control_agrees_on_arx() -> None:
    model, u = arx_model(), inputs()
    for system in (state_space(model), control.ss(signal_to_ss(model))):
        response = control.forced_response(system, np.arange(len(u)) * T, u.T)
        np.testing.assert_allclose(response.outputs.ravel(), model.simulate(u), atol=1e-9)
    tf = model.to_control()
    assert control.isdtime(tf, strict=True)
    np.testing.assert_allclose(np.sort_complex(tf[0, 0].poles()), np.sort_complex(model.poles))


def signal_to_ss(model: ARXModel) -> control.StateSpace:
    """The two columns of the transfer function side by side."""
    tf = model.to_control()
    parts = [signal.tf2ss(tf.num[0][j], tf.den[0][j]) for j in range(2)]
    A, B = (linalg.block_diag(parts[0][k], parts[1][k]) for k in (0, 1))
    return control.StateSpace(A, B, np.hstack([parts[0][2], parts[1][2]]), np.hstack([parts[0][3], parts[1][3]]), T)


@pytest.mark.parametrize(
    "fields",
    [
        {"poles": (2,), "zeros": (3,)},
        {"poles": (0,), "zeros": (0,)},
        {"poles": (2, 1), "zeros": (1,)},
        {"poles": (2,), "zeros": (1,), "delays": (-1,)},
        {"poles": (2,), "zeros": (1,), "domain": "laplace"},
        {"poles": (), "zeros": ()},
    ],
    ids=str,
)
def test_impossible_orders_are_refused(fields: dict) -> None:
    with pytest.raises(ConfigError):
        TransferFunction(**fields)


def test_a_wrong_number_of_inputs_is_refused() -> None:
    with pytest.raises(TraceError, match="do not fit"):
        build().simulate(np.zeros((5, 3)))


def test_moves_do_not_depend_on_the_units_of_time_and_output() -> None:
    """Coefficients of 1e-20 are small in their unit and no zeros."""
    u = np.random.default_rng(0).normal(size=(50, 1))
    powers = np.array([1.0, 1e-6, 1e-12])
    found = []
    for scale, gain, T_ in ((np.ones(3), 1.0, 0.1), (powers, 1e-9, 1e-7)):
        F = np.array([4.0, 1.0, 1.0]) * scale / scale[-1]
        B = gain * np.array([3.0, 2.0]) * scale[:2] / scale[-1]
        model = Polynomials(
            numerators=[B], denominators=[F], constant=0.0, delays=(0,), sample_time=T_, moving=(False,)
        )
        found.append(model.moves(np.diag(model.vector)[:, :4], u, known=False) / gain)
    np.testing.assert_allclose(found[1], found[0], rtol=1e-6, atol=1e-9)
    nothing = Polynomials(
        numerators=[np.zeros(2)], denominators=[F], constant=0.0, delays=(0,), sample_time=T_, moving=(False,)
    )
    assert not nothing.moves(np.diag(nothing.vector), u, known=False)[:, 2:].any()


LATE = (1.3, 0.75)


@pytest.mark.parametrize("of", [LATE, (0.4, 2.0)], ids=str)
def test_a_dead_time_between_samples_is_in_the_free_run_and_everywhere_else(of: tuple[float, ...]) -> None:
    model, fine, u = build(Domain.CONTINUOUS, delays=of), 100, inputs()
    total = np.zeros(len(u))
    for j, late in enumerate(of):
        num, den, _ = signal.cont2discrete((BC[j][::-1], FC[j][::-1]), T / fine, "zoh")
        dead = round(late * fine)
        held = np.concatenate([np.zeros(dead), np.repeat(u[:, j], fine)])[: len(u) * fine]
        total += signal.lfilter(num.ravel(), den, held)[::fine]
    np.testing.assert_allclose(model.simulate(u), total, atol=1e-9)
    again = model_from_dict(json.loads(json.dumps(model.to_dict())))
    np.testing.assert_array_equal(again.simulate(u), model.simulate(u))
    assert model.structure.label == f"continuous TF [2 1; 1 0; {of[0]:g} {of[1]:g}]"
    assert model.continuous().delays == pytest.approx([late * T for late in of])
    assert model.ratio(0).delay == of[0]


def test_the_free_run_moves_with_dead_times_between_samples() -> None:
    model, u, h = build(Domain.CONTINUOUS, delays=LATE), inputs(), 1e-6
    vector = model.polynomials.vector
    assert vector[-2:] == pytest.approx(np.array(LATE) * T)
    found = model.polynomials.moves(1e-3 * np.eye(len(vector))[:, -2:], u, known=False)
    for j, column in enumerate(found.T):
        there, back = (
            build(Domain.CONTINUOUS, delays=tuple(np.array(LATE) + way * h * np.eye(2)[j])).simulate(u)
            for way in (1.0, -1.0)
        )
        np.testing.assert_allclose(column, 1e-3 * (there - back) / (2 * h * T), atol=1e-6)


def test_a_discrete_one_has_whole_samples() -> None:
    with pytest.raises(ConfigError, match="a whole number"):
        TransferFunction(poles=1, zeros=0, delays=1.5)
    assert TransferFunction(poles=1, zeros=0, delays=2.0, domain="continuous").to_dict()["delays"] == [2]
