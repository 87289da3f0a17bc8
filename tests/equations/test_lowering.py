"""What equations become: each value once, states for what remembers, and bounds on all that grows."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sysid.equations import Lowered, System, Terms, lower
from sysid.errors import ConfigError


def lowered(text: str, *, inputs: tuple[str, ...] = ("u",), sample_time: float = 0.5, free: Any = ()) -> Lowered:
    terms = Terms(inputs=inputs, outputs=("y",), sample_time=sample_time, free=free, fixed=(), tables={})
    return lower(System.read(text, free), terms)


def test_a_value_is_computed_once_whatever_asks_for_it() -> None:
    once = lowered("y = sin(u)*cos(u)")
    assert len(lowered("y = sin(u)*cos(u) + cos(u)*sin(u)").outputs.code) == len(once.outputs.code) + 1


def test_numbers_are_computed_beforehand() -> None:
    low = lowered("y = u*(2 + 3)*1 + 0*1 + sqrt(4) - 2")
    assert set(low.outputs.constants) == {2.0, 5.0}
    assert len(low.outputs.code) <= 3


def test_what_nothing_needs_is_left_out() -> None:
    assert len(lowered("spare = exp(u); y = u").outputs.code) == 0


def test_delayed_inputs_are_inputs_and_cost_no_state() -> None:
    low = lowered("y = u(t - 1.25) + u[k-500]")
    assert low.lagged == ((0, 2.5), (0, 500.0))
    assert low.states == ()
    assert low.depth == 500


def test_a_delay_but_for_rounding_of_whole_samples_is_whole() -> None:
    assert lowered("y = u(t - 0.3)", sample_time=0.1).lagged == ((0, 3.0),)


def test_delayed_inputs_are_interpolated_between_samples() -> None:
    low = lowered("y = u(t - 0.6)")
    before = np.arange(12.0)[:, None]
    assert low.given(before, 10)[:, 0] == pytest.approx(np.arange(2.0, 12.0) - 1.2)


def test_what_remembers_has_states_after_those_with_names() -> None:
    low = lowered("y = relay(u, on=2, off=1) + hold(u, u > 1) + y[k-2]; x[k+1] = y")
    assert low.states[0] == "x"
    assert set(low.states[1:]) == {"relay 1", "hold 1", "y[k-1]", "y[k-2]"}


def test_the_same_relay_twice_is_one() -> None:
    assert lowered("y = relay(u, on=2, off=1) * relay(u, on=2, off=1)").states == ("relay 1",)


def test_a_network_has_weights_of_its_own_each_time_it_is_written() -> None:
    low = lowered("y = net(u; neurons=3) + net(u, u*u; neurons=2)")
    assert [(net.first, net.stop) for net in low.nets] == [(0, 11), (11, 22)]
    assert low.n_weights == 22


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("y = relay(u, on=1, off=2)", "goes off above where it goes on"),
        ("y = clamp(u, 1, 0)", "lower limit of clamp is above"),
        ("y = deadzone(u, 0.1, -0.1)", "lower limit of deadzone is above"),
        ("y = relay(u, 1)", "relay takes x, on, off"),
        ("y = net(u)", "a network takes what it sees, and neurons"),
        ("y = net(u; neurons=0)", "not a number of neurons"),
        ("y = net(u; neurons=2.5)", "not a number of neurons"),
        ("y = net(u; neurons=u)", "neurons is a number"),
        ("y = net(u; neurons=5, activation=1)", "a network takes"),
        ("y = y(t - 0.1)", "y needs itself"),
        ("y = delay(u, u)", "a delay is a number"),
        ("x[k+1] = u + x; y = x[k-101]", "more than 100 past samples"),
        ("y = u[k-999999] + u(t - 999999)", "a delay of 1,999,998 samples"),
        ("y = " + " + ".join("net(u; neurons=200)" for _ in range(9)), "too many weights"),
    ],
)
def test_what_cannot_be_lowered_is_refused(text: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words) as caught:
        lowered(text)
    assert caught.value.remedy
    assert str(caught.value.where).startswith("equations")


def test_a_long_chain_of_definitions_is_no_deep_one() -> None:
    text = "a0 = u\n" + "\n".join(f"a{i + 1} = a{i}*1.5 + u" for i in range(250)) + "\ny = a250"
    assert len(lowered(text).outputs.code) == 250
