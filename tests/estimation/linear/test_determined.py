"""An input that never moves, or is made of others, has no effect in any linear model, and nothing is known of it."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import signal

import sysid

RNG = np.random.default_rng(0)
U = np.repeat(RNG.uniform(-1.0, 1.0, 40), 10)
E = 0.01 * RNG.standard_normal(400)
Y = signal.lfilter([0.0, 0.2], [1.0, -0.8], U) + E
OPEN = {"still": np.full(400, 2.0), "of zeros": np.zeros(400), "made of the other": 3.0 * U + 1.0}
ONE: dict[str, Any] = {
    "ARX": sysid.ARX(na=1, nb=1, nk=1),
    "OE": sysid.OE(nb=1, nf=1, nk=1),
    "ARMAX": sysid.ARMAX(na=1, nb=1, nc=1, nk=1),
    "BJ": sysid.BJ(nb=1, nc=1, nd=1, nf=1, nk=1),
    "SS": sysid.LinearStateSpace(states=1),
    "SS without noise": sysid.LinearStateSpace(states=1, noise=False),
    "SS with dead times": sysid.LinearStateSpace(states=1, nk="auto"),
    "TF": sysid.TransferFunction(poles=1, zeros=0, delays=1),
    "continuous TF": sysid.TransferFunction(poles=1, zeros=0, domain="continuous"),
}
TWO: dict[str, Any] = ONE | {
    "ARX": sysid.ARX(na=1, nb=(1, 1), nk=(1, 1)),
    "OE": sysid.OE(nb=(1, 2), nf=(1, 2), nk=(1, 3)),
    "ARMAX": sysid.ARMAX(na=1, nb=(1, 2), nc=1, nk=(1, 3)),
    "BJ": sysid.BJ(nb=(1, 2), nc=1, nd=1, nf=(1, 2), nk=(1, 3)),
    "TF": sysid.TransferFunction(poles=(1, 2), zeros=(0, 1), delays=(1, 3)),
    "continuous TF": sysid.TransferFunction(poles=(1, 2), zeros=(0, 1), domain="continuous"),
}


def fitted(columns: dict[str, Any], mapping: str, structure: Any) -> Any:
    return sysid.fit(sysid.data(columns, sample_time=0.1), mapping, structure)


@cache
def alone_of(kind: str) -> Any:
    """A fit without the other input, and its step response."""
    alone = fitted({"u": U, "y": Y}, "u -> y", ONE[kind])
    return alone, alone.step()


@pytest.mark.parametrize("kind", ONE)
@pytest.mark.parametrize("how", OPEN)
def test_an_input_that_says_nothing_has_no_effect_and_no_interval(kind: str, how: str) -> None:
    """The others' are those of a fit without it: of a state space it had a gain of 523."""
    alone, own = alone_of(kind)
    both = fitted({"u": U, "v": OPEN[how], "y": Y}, "u+v -> y", TWO[kind])
    moved = both.simulate(np.column_stack([U, RNG.standard_normal(400)]))
    assert_allclose(moved, alone.simulate(U), atol=1e-9)
    known = dict(zip(both.uncertainty.names, both.uncertainty.standard_deviations, strict=True))
    assert all(np.isnan(spread) for name, spread in known.items() if "(v, " in name)
    assert any("v " in note for note in both.notes)
    found = both.step()
    n = min(len(found.time), len(own.time))
    assert_allclose(found.low[:n, 0], own.low[:n, 0], rtol=1e-6, atol=1e-9)
    assert not found.values[:, 1].any() and np.isnan(found.low[:, 1]).all() and np.isnan(found.gain_low[1])
    assert "v: no effect" in str(found)
    assert np.isnan(both.bode().gain_low[:, 1]).all()
    assert both.bode().plot() and found.plot() and both.poles().plot()  # a warning of the picture's is an error here


@pytest.mark.parametrize("kind", ONE)
def test_a_sole_input_that_never_moves_has_none_either(kind: str) -> None:
    found = fitted({"u": OPEN["still"], "y": Y}, "u -> y", ONE[kind])
    assert_allclose(found.simulate(U), found.simulate(0.0 * U), atol=1e-9)
    known = dict(zip(found.uncertainty.names, found.uncertainty.standard_deviations, strict=True))
    assert all(np.isnan(spread) for name, spread in known.items() if name.lower().startswith("b("))
    assert np.isnan(found.step().low).all()


def test_states_of_several_outputs_leave_it_out_too() -> None:
    z = signal.lfilter([0.0, 0.5], [1.0, -0.5], U) + E[::-1]
    structure = sysid.LinearStateSpace(states=2)
    alone = fitted({"u": U, "y": Y, "z": z}, "u -> y+z", structure)
    both = fitted({"v": OPEN["still"], "u": U, "y": Y, "z": z}, "v+u -> y+z", structure)
    inputs = np.column_stack([RNG.standard_normal(400), U])
    assert_allclose(both.simulate(inputs), alone.simulate(U), atol=1e-9)
    assert both.poles().to_frame().pole.tolist() == alone.poles().to_frame().pole.tolist()
    assert both.model.continuous().B.shape == (2, 2)


def test_what_is_known_in_part_is_not_drawn_as_if_the_rest_were_certain() -> None:
    """Of a single sine two numbers are known: four coefficients are not."""
    u = np.sin(0.3 * np.arange(400))
    found = fitted(
        {"u": u, "y": signal.lfilter([0.4, 0.3, 0.2, 0.1], [1.0], u) + E}, "u -> y", sysid.ARX(na=0, nb=4, nk=0)
    )
    assert any("2 of" in note or "3 of" in note for note in found.notes)
    assert np.isnan(found.step().low).all() and np.isnan(found.bode().gain_low).all()
