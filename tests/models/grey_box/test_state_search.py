"""The state that nobody measured."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.models import GreyBox, GreyBoxModel, History, Mapping, Scaling
from sysid.models.grey_box import equation_programs
from sysid.models.grey_box.grey_box import lowered


def a_model(equations: str, **initial: object) -> GreyBoxModel:
    grey, mapping = GreyBox(equations=equations, initial=initial), Mapping.parse("u -> y")
    n = lowered(grey, mapping.inputs, mapping.outputs, 0.5).n_states
    return GreyBoxModel(
        grey=grey, theta=np.zeros(0), norms=(), levels=(0.5,) * n, spans=(1.0,) * n, substeps=4,
        scaling=Scaling.identity(1), mapping=mapping, sample_time=0.5, input_units=("V",), output_unit="V",
        rest_output=0.0,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("equations", "u", "y", "state"),
    [
        ("dx/dt = 2*u - x; y = x", 3.0, 0.0, [6.0]),
        ("dx/dt = u - sqrt(x); y = x", 3.0, 0.0, [9.0]),
        ("x[k+1] = 0.5*x + u; y = x", 3.0, 0.0, [6.0]),
        ("dq/dt = v; dv/dt = u - v; y = q", 0.0, 7.0, [7.0, 0.0]),
        ("y = 0.5*y[k-1] + u[k-1]", 3.0, 0.0, [6.0]),
        ("dx/dt = u - x; y = x + relay(u, on=2, off=1)", 3.0, 0.0, [3.0, 1.0]),
    ],
    ids=["linear", "a root", "discrete", "what integrates is where the output says", "its own past", "a relay"],
)
def test_a_system_at_rest_stands_still(equations: str, u: float, y: float, state: list[float]) -> None:
    model = a_model(equations)
    history = History.at_rest(inputs=[u], output=y)
    assert model.recursion.state(history) == pytest.approx(np.array(state), abs=1e-9)
    run = model.simulate(np.full((20, 1), u), history)
    assert run == pytest.approx(np.full(20, run[0]), abs=1e-8)


@pytest.mark.parametrize(
    ("equations", "state"),
    [
        ("dx/dt = (x - 0.6)*(5 - x)*u; y = x", 5.0),
        ("x[k+1] = x + 0.1*(x - 0.6)*(5 - x)*u; y = x", 5.0),
        ("y = y[k-1] + 0.1*(y[k-1] - 0.6)*(5 - y[k-1])*u[k-1]", 5.0),
        ("dx/dt = x - u; y = x", 1.0),
        ("x[k+1] = 1.5*x - 0.5*u; y = x", 1.0),
    ],
    ids=["continuous", "discrete", "its own past", "which it leaves, if there is no other", "the same, discrete"],
)
def test_of_several_equilibria_a_system_has_stood_where_it_returns_to(equations: str, state: float) -> None:
    """A polynomial NARX model began at the other root of its square, and its run left all bounds."""
    found = a_model(equations).recursion.state(History.at_rest(inputs=[1.0], output=0.0))
    assert found == pytest.approx(np.full(len(found), state), abs=1e-9)


def test_a_state_at_rest_is_looked_for_once_and_no_run_moves_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A thousand sequences that begin at one plateau each looked for it: twenty times as long as to run them."""
    model, searches = a_model("dx/dt = u - sqrt(x); y = x"), list[float]()
    found = equation_programs.at_rest
    monkeypatch.setattr(equation_programs, "at_rest", lambda *given: searches.append(0.0) or found(*given))
    begun = [History.at_rest(inputs=[u], output=0.0) for u in (3.0, 3.0, 2.0, 3.0)]
    runs = [model.simulate(np.ones((20, 1)), history) for history in begun]
    assert len(searches) == 2
    assert [run[0] for run in runs] == pytest.approx([9.0, 9.0, 4.0, 9.0])
    np.testing.assert_array_equal(runs[0], runs[3])


def test_a_declared_state_is_where_it_is_declared() -> None:
    model = a_model("dx/dt = 2*u - x; y = x", x=1.5)
    assert model.recursion.state(History.at_rest(inputs=[3.0], output=0.0)).tolist() == [1.5]


@pytest.mark.parametrize("begin", [[0.2, -0.4], [2.0, 1.0]])
def test_a_history_shows_the_state_before_it(begin: list[float]) -> None:
    model = a_model("dq/dt = v; dv/dt = u - sin(q) - 0.2*v; y = q")
    u, x = np.random.default_rng(0).uniform(-1.0, 1.0, (40, 1)), np.array(begin)
    form = model.recursion
    y = form.run(form.given(u, u[:1]), x.copy())[:, 0]
    history = History(inputs=u[:15], output=y[:15])
    assert form.followed(history) == pytest.approx(y[:15], abs=1e-6)
    assert model.simulate(u[15:], history) == pytest.approx(y[15:], abs=1e-5)
