"""The register machine against equations walked through in plain Python, and against the complex step."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sysid.equations import ROSENBROCK, Terms, lowering
from sysid.equations.slopes import jacobian
from sysid.kernels import register_machine as machine
from sysid.models import GreyBox, GreyBoxModel, Mapping, Scaling
from sysid.models.grey_box.equation_reference import EquationTwin
from sysid.models.grey_box.grey_box import lowered

PARAMETERS = {"a": 0.7, "b": 0.4, "c": {"start": 1.3, "fixed": True}}

EQUATIONS = {
    "a rate": "dx/dt = -a*x + b*u + c*v; y = x",
    "two rates of each other": "dx/dt = z; dz/dt = -a*x - b*z^3 + u - v/c; y = x + 0.1*z",
    "the next sample": "x[k+1] = a*x + b*u; y = c*x + v",
    "both": "dx/dt = -a*x + z; z[k+1] = b*z + u*c; y = x*z + v",
    "roots and powers": "dx/dt = -a*sqrt(x) + b*abs(u) + 0.2; y = x^c + x**2 + x^-1 + v",
    "functions": "dx/dt = -a*x + sin(u) + cos(v); y = exp(-x) + log(3 + b*x) + tanh(c*x) + atan(x) + tan(0.1*x)",
    "more functions": "dx/dt = -a*x + u; y = sinh(x) + cosh(b*x) + log10(4 + c*v) + pi",
    "limits": "dx/dt = -a*x + saturate(b*u, -0.3, 0.4); y = deadzone(x, -0.05, 0.05) + min(x, v, c) + max(x, 0)",
    "conditions": "dx/dt = where(u > 0.2 and not v > 0.5, -a*x, b - x); y = x + sign(v)*c + (u >= 0.1)",
    "a relay": "dx/dt = -a*x + b*relay(u, on=0.4, off=-0.4); y = x*c + v",
    "a latch and a hold": "dx/dt = -a*x + b*latch(u > 0.8, v > 0.8); y = x + hold(v*c, u > 0)",
    "delayed inputs": "dx/dt = -a*x + b*u(t - 0.5) + c*v(t - 0.2); y = x + u[k-3]",
    "delayed states": "dx/dt = -a*x + b*u; y = x + c*x(t - 0.25) + v",
    "an output's own past": "y[k] = a*y[k-1] - 0.2*y[k-2] + b*u[k-1] + c*v",
    "a delayed expression": "dx/dt = -a*x + b*delay(u*v, 0.3); y = c*x",
    "definitions in any order": "y = x*flow; flow = a*head + c; head = u - b*x; dx/dt = flow - x + v",
    "a table": "dx/dt = -a*x + bend(u); y = x + b*bend(2*v) + c",
    "a network": "dx/dt = -a*x + net(x, u, v; neurons=3); y = b*x + c",
    "a stiff one": "dx/dt = -1e4*(x - a*sin(u)) + z; dz/dt = -b*z*x + exp(-x)*v/c; y = x + z",
    "three in a ring": "dx/dt = a*(1 + z^2)^1.5 - x; dw/dt = -sqrt(w)*b + x/(1 + z^2); "
    "dz/dt = log(2 + w) - 30*z + u*v*c; y = z",
    "moving inputs": "dx/dt = -a*x + b*u*v + c*u[k-1]*net(x, v; neurons=2); y = x + 0.1*u",
    "one that moves": "dx/dt = z - sin(u)*x*b - a*v(t - 0.25)*x; z[k+1] = b*z + v + u[k-1]; y = x*z + c*x[k-1]",
    "a moving stiff one": "dx/dt = -1e4*(x - a*sin(u)) + z; dz/dt = -b*z*x + exp(-x)*v/c; y = x + z*u",
    "a long sum": "y = " + " + ".join(f"a*u^{1 + i % 3}" for i in range(150)) + " + b*v + c",
}
MOVING = {"moving inputs": "foh", "one that moves": {"v": "foh"}, "a moving stiff one": "foh"}
TABLES = {"bend": [[-1, -0.5], [0, 0.1], [0.4, 1.0], [2, 1.2]]}


def a_model(name: str, **fields: Any) -> GreyBoxModel:
    text = EQUATIONS[name]
    tables = TABLES if "bend" in text else {}
    grey = GreyBox(equations=text, parameters=PARAMETERS, tables=tables, intersample=MOVING.get(name, "zoh"))
    mapping = Mapping.parse("u+v -> y")
    low = lowered(grey, mapping.inputs, mapping.outputs, 0.1)
    rng = np.random.default_rng(3)
    return GreyBoxModel(
        grey=grey,
        theta=np.concatenate([[0.7, 0.4], 0.5 * rng.standard_normal(low.n_weights)]),
        norms=tuple(np.array(low.norms) + 0.1 * rng.standard_normal(len(low.norms))),
        levels=(0.0,) * low.n_states,
        spans=(1.0,) * low.n_states,
        scaling=Scaling.identity(2),
        mapping=mapping,
        sample_time=0.1,
        input_units=("V", "V"),
        output_unit="V",
        rest_output=0.0,
        **{"substeps": 3, **fields},
    )


def a_run(model: GreyBoxModel, n: int = 60) -> tuple[np.ndarray, dict[str, float]]:
    rng = np.random.default_rng(5)
    names = model.lowered.states
    remembers = [name.split()[0] in {"relay", "latch"} for name in names]
    return rng.uniform(-1.0, 1.0, (n, 2)), {
        name: 0.0 if flag else float(rng.uniform(0.2, 0.8)) for name, flag in zip(names, remembers, strict=True)
    }


@pytest.mark.parametrize("name", [name for name in EQUATIONS if "stiff" not in name])
def test_a_run_is_that_of_the_tree(name: str) -> None:
    model = a_model(name)
    inputs, begin = a_run(model)
    # Between two kept samples of an expression nobody but the machine knows its states: they all begin at zero.
    begin |= {state: 0.0 for state in begin if state.startswith("delay ")}
    form = model.recursion
    found = form.run(form.given(inputs, inputs[:1]), np.array([begin[state] for state in model.lowered.states]))
    if name == "a delayed expression":
        zeroed = GreyBox(
            equations="dx/dt = -a*x + b*w; y = c*x", parameters=PARAMETERS
        )  # the same, its delay made by hand
        lagged = np.concatenate([np.zeros(3), (inputs[:, 0] * inputs[:, 1])[:-3]])[:, None]
        mapping = Mapping.parse("w -> y")
        model = replace(model, grey=zeroed, mapping=mapping, levels=(0.0,), spans=(1.0,))
        expected = EquationTwin(model, model.theta).run(lagged, begin)
    else:
        expected = EquationTwin(model, model.theta).run(inputs, begin)
    assert_allclose(found, expected.real, rtol=1e-12, atol=1e-13)


IMPLICIT = {
    "two rates of each other", "both", "functions", "a relay", "a network", "definitions in any order", "a stiff one",
    "three in a ring", "moving inputs", "one that moves", "a moving stiff one",
}  # fmt: skip
"""Of these steps are made implicitly too: smooth ones, whose Jacobian a twin can take by differences."""


@pytest.mark.parametrize("name", sorted(IMPLICIT))
def test_an_implicit_run_is_that_of_the_tree(name: str) -> None:
    model = a_model(name, solver=ROSENBROCK)
    inputs, begin = a_run(model, n=10)
    form, states = model.recursion, model.lowered.states
    u, x = form.given(inputs, inputs[:1]), np.array([begin[state] for state in states])
    expected = EquationTwin(model, model.theta).run(inputs, begin)
    assert_allclose(form.run(u, x.copy()), expected.real, rtol=1e-10, atol=1e-11)
    n, p = len(states), len(model.theta)
    S = np.zeros((n, p + n))
    S[:, p:] = np.eye(n)
    _, J = form.moved(u, x.copy(), S, p)
    assert_allclose(J, complex_steps(model, inputs, begin), rtol=1e-9, atol=1e-9)


def complex_steps(model: GreyBoxModel, inputs: np.ndarray, begin: dict[str, float]) -> np.ndarray:
    """How the outputs of the twin move with each parameter and initial state, a column each."""
    moved = []
    for i in range(len(model.theta) + len(begin)):
        theta, start = model.theta.astype(complex), {key: complex(value) for key, value in begin.items()}
        if i < len(theta):
            theta[i] += 1j * STEP
        else:
            start[model.lowered.states[i - len(theta)]] += 1j * STEP
        moved.append(EquationTwin(model, theta).run(inputs, start).imag / STEP)
    return np.stack(moved, axis=2)


STEP = 1e-30
SMOOTH = [name for name in EQUATIONS if name != "a delayed expression" and "stiff" not in name]


@pytest.mark.parametrize("name", SMOOTH)
def test_derivatives_are_those_of_the_complex_step(name: str) -> None:
    model = a_model(name)
    inputs, begin = a_run(model, n=30)
    form, states = model.recursion, model.lowered.states
    n, p = len(states), len(model.theta)
    S = np.zeros((n, p + n))
    S[:, p:] = np.eye(n)
    x = np.array([begin[state] for state in states])
    y, J = form.moved(form.given(inputs, inputs[:1]), x.copy(), S, p)
    assert_allclose(y, form.run(form.given(inputs, inputs[:1]), x.copy()), rtol=1e-14)
    assert_allclose(J, complex_steps(model, inputs, begin), rtol=1e-9, atol=1e-11)


def test_soft_switches_have_the_derivatives_of_what_is_computed() -> None:
    model = a_model("conditions")
    form = replace(model.recursion, widths=np.full(len(model.lowered.switches), 0.05))
    inputs, begin = a_run(model, n=30)
    u, x = form.given(inputs, inputs[:1]), np.array(list(begin.values()))
    _, J = form.moved(u, x.copy(), np.zeros((1, 2)), 2)
    for i in range(2):
        apart = 1e-6 * np.eye(2)[i]
        two = [form.with_theta(model.theta + sign * apart).run(u, x.copy()) for sign in (1.0, -1.0)]
        assert_allclose(J[:, :, i], (two[0] - two[1]) / 2e-6, atol=1e-8)


def test_a_soft_root_has_a_slope_at_zero_and_is_the_root_elsewhere() -> None:
    grey = GreyBox(equations="y = sqrt(u)")
    mapping = Mapping.parse("u -> y")
    low = lowered(grey, mapping.inputs, mapping.outputs, 1.0)
    model = replace(
        a_model("a rate"), grey=grey, mapping=mapping, theta=np.zeros(0), levels=(), spans=(), norms=low.norms
    )
    form = replace(model.recursion, widths=np.array([1e-4]))
    soft, exact = (one.run(np.array([[-1.0], [0.0], [1.0]]), np.zeros(0))[:, 0] for one in (form, model.recursion))
    assert soft.tolist() == pytest.approx([0.0, 0.0, 1.0], abs=1e-8)
    assert exact.tolist() == [0.0, 0.0, 1.0]


def test_what_explodes_is_no_number_and_takes_no_time() -> None:
    grey = GreyBox(equations="dx/dt = x^3 + u; y = x")
    model = replace(
        a_model("a rate"), grey=grey, mapping=Mapping.parse("u -> y"), theta=np.zeros(0), levels=(1.0,), norms=()
    )
    y = model.recursion.run(np.ones((5_000, 1)), np.array([1.0]))
    assert np.isfinite(y[0])
    assert np.isnan(y[-1])


def test_the_method_is_of_fourth_order() -> None:
    grey = GreyBox(equations="dx/dt = -x; y = x")
    base = replace(
        a_model("a rate"), grey=grey, mapping=Mapping.parse("-> y"), theta=np.zeros(0), levels=(0.0,), norms=()
    )
    errors = []
    for substeps in (1, 2):
        form = replace(base, substeps=substeps, sample_time=0.5).recursion
        errors.append(abs(form.run(np.zeros((3, 0)), np.array([1.0]))[2, 0] - np.exp(-1.0)))
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.3)


@pytest.mark.parametrize(("text", "order"), [("-x^2", 8.0), ("-max(x, 0)*abs(x)", 8.0), ("-where(x > 0, x, x)*x", 8.0)])
def test_the_implicit_method_is_of_third_order_with_any_jacobian(text: str, order: float) -> None:
    grey = GreyBox(equations=f"dx/dt = {text}; y = x")
    base = replace(
        a_model("a rate"), grey=grey, mapping=Mapping.parse("-> y"), theta=np.zeros(0), levels=(0.0,), norms=(),
        solver=ROSENBROCK, sample_time=0.5,
    )  # fmt: skip
    errors = [
        abs(replace(base, substeps=n).recursion.run(np.zeros((3, 0)), np.array([1.0]))[2, 0] - 0.5) for n in (4, 8)
    ]
    assert errors[0] / errors[1] == pytest.approx(order, rel=0.25)


def test_an_implicit_step_follows_what_is_slow_however_fast_the_rest_is() -> None:
    """Curtiss and Hirschfelder 1952: an explicit step of this length explodes."""
    grey = GreyBox(equations="dx/dt = -1e6*(x - z); dz/dt = -z; y = x")
    model = replace(
        a_model("a rate"), grey=grey, mapping=Mapping.parse("-> y"), theta=np.zeros(0), levels=(0.0, 0.0), norms=(),
        solver=ROSENBROCK, sample_time=0.1, substeps=2,
    )  # fmt: skip
    y = model.recursion.run(np.zeros((21, 0)), np.array([3.0, 1.0]))[:, 0]
    assert_allclose(y[1:], np.exp(-0.1 * np.arange(1, 21)), rtol=2e-5)


def test_the_jacobian_of_a_step_is_that_of_the_rates() -> None:
    """Every operation, at points away from kinks; a table's goes smoothly from piece to piece."""
    text = """
        da/dt = -a*b + a/c - (a + c)*2 + abs(b) + min(a, b) + max(a, c, 0.3) + where(u > 0, a*a, b) + sqrt(a + 2)
        q = a^3 + c^2.5 + c^0.5 + (2 + b)^a
        db/dt = q + exp(a*b) - log(3 + c) + tanh(b) + sin(a) + cos(c) + atan(a*c) + bend(b)
        dc/dt = -c^-1 + sign(a) + b^5
        y = a
    """
    grey = GreyBox(equations=text, tables=TABLES)
    low = lowered(grey, ("u",), ("y",), 0.1)
    work = lowering._Lowering(
        system=grey.system,
        terms=Terms(inputs=("u",), outputs=("y",), sample_time=0.1, free=(), fixed=(), tables=grey.points),
    )
    rates = [work.value(one.right) for one in grey.system.equations if one.name in grey.system.continuous]
    leaves = [work.state(name) for name in "abc"]
    rows = jacobian(work.graph, rates, leaves, work._slope_of_table)
    found = work.programs(
        [work.graph.constant(0.0)], [row.get(j, work.graph.constant(0.0)) for row in rows for j in range(3)], [],
        ahead=False,
    )  # fmt: skip
    for b in (-0.5, 0.2, 1.2):
        x, u = np.array([0.7, b, 1.7]), np.array([0.4])
        y, r, J = np.empty((1, 9)), np.empty(3), np.empty((3, 3))
        none = np.zeros(len(low.switches)), found.places, found.table
        machine.values(found.slopes.arrays, np.zeros(2), x[None], u[None], *none, y)
        machine.derivatives(low.rates.arrays, np.zeros(2), 0, x, u, *none, r, J, np.empty((3, 0)))
        assert_allclose(y.reshape(3, 3), J, rtol=1e-12, atol=1e-12)
