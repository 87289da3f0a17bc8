"""Conversions: the same system at its samples, and a smaller one within its bound."""

from __future__ import annotations

import control
import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.models.conversions import c2d, canonical, d2c, d2d, reduced, state_space, transfer_function


def plant(dt: float = 0) -> control.StateSpace:
    rng = np.random.default_rng(0)
    A = np.array([[-0.3, 2.0, 0.0], [-2.0, -0.3, 0.1], [0.0, 0.0, -8.0]])
    system = control.StateSpace(A, rng.normal(size=(3, 2)), rng.normal(size=(2, 3)), 0.1 * rng.normal(size=(2, 2)), 0)
    return c2d(system, dt) if dt else system


def test_a_sampled_system_comes_back() -> None:
    one, again = plant(), d2c(plant(0.1))
    w = np.array([0.1, 1.0, 3.0])
    np.testing.assert_allclose(again(1j * w), one(1j * w), rtol=1e-8, atol=1e-10)
    assert again.input_labels == one.input_labels


def test_another_rate_gives_the_same_steps_at_common_samples() -> None:
    fast, slow = plant(0.05), d2d(plant(0.05), 0.1)
    y, z = (control.step_response(one, T=np.arange(n) * one.dt).outputs for one, n in ((fast, 41), (slow, 21)))
    np.testing.assert_allclose(y[..., ::2], z, rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("dt", [0, 0.1])
@pytest.mark.parametrize("states", [0, 1, 2, 3])
def test_a_smaller_system_is_within_its_bound(dt: float, states: int) -> None:
    one = plant(dt)
    found = reduced(one, states)
    w = np.logspace(-2, np.log10(np.pi / 0.1), 300)
    x = np.exp(1j * w * 0.1) if dt else 1j * w
    off = [np.linalg.norm(m, 2) for m in np.moveaxis(one(x) - found.system(x), -1, 0)]
    assert found.system.nstates == states
    assert max(off) <= found.bound + 1e-9
    assert (np.diff(found.singular_values) <= 0.0).all()


def test_transfer_functions_and_state_spaces_are_the_same_system() -> None:
    one = control.tf([1.0, 0.5], [1.0, -1.5, 0.7], 0.1)
    z = np.exp(0.3j)
    assert state_space(one)(z) == pytest.approx(one(z))
    assert transfer_function(state_space(one))(z) == pytest.approx(one(z))


def test_what_shares_its_poles_shares_its_states_whatever_the_number_of_inputs_and_outputs() -> None:
    slow, fast, x = [1.0, -1.5, 0.7], [1.0, -0.2], np.exp(0.3j)
    wide = control.tf([[[1.0], [0.5, 0.1], [2.0]]], [[slow, slow, fast]], 0.1)
    tall = control.tf([[[1.0]], [[0.5, 0.1, 0.3]], [[2.0]]], [[slow], [slow], [fast]], 0.1)
    for system in (wide, tall):
        found = state_space(system)
        assert found.nstates == 3
        np.testing.assert_allclose(found(x), system(x), rtol=1e-10)
        assert (found.input_labels, found.output_labels) == (system.input_labels, system.output_labels)
    both = plant(0.1)
    np.testing.assert_allclose(state_space(transfer_function(both))(x), both(x), rtol=1e-7)


def test_a_whole_multiple_of_the_sample_time_needs_no_continuous_system() -> None:
    fast = state_space(control.tf([[[1.0, 0.3], [2.0]]], [[[1.0, 0.5, 0.0], [1.0, 0.5, 0.0]]], 0.1))  # -0.5 and 0
    slow = d2d(fast, 0.3)
    y, z = (control.step_response(one, T=np.arange(n) * one.dt).outputs for one, n in ((fast, 31), (slow, 11)))
    np.testing.assert_allclose(y[..., ::3], z, rtol=1e-10, atol=1e-12)


def test_milliseconds_are_reduced_as_seconds_are() -> None:
    """A dead time by Padé and fast poles: coefficients of a polynomial in s range over thirty decades."""
    sizes = []
    for unit in (1.0, 1e-3):
        num, den = control.pade(0.1 * unit, 4)
        plant = control.tf(num, den) * control.tf([2.0], [unit**2, 0.4 * unit, 1.0])
        sizes.append(reduced(plant, 2).singular_values)
    np.testing.assert_allclose(sizes[1], sizes[0], rtol=1e-6)


@pytest.mark.parametrize("dt", [0, 0.1])
def test_canonical_forms_are_the_same_system_in_named_coordinates(dt: float) -> None:
    one = plant(dt)[0, 0]  # three states of one input and one output
    x, denominator = np.exp(0.3j) if dt else 0.7j, np.poly(one.A)
    found = {form: canonical(one, form) for form in ("modal", "companion", "observable")}
    for system in found.values():
        assert system(x) == pytest.approx(one(x), rel=1e-9)
        assert (system.dt, system.input_labels) == (one.dt, one.input_labels)
    eye = np.eye(3)
    np.testing.assert_allclose(found["companion"].A, np.column_stack([eye[:, 1:], -denominator[:0:-1]]), atol=1e-9)
    np.testing.assert_allclose(found["companion"].B[:, 0], eye[0], atol=1e-9)
    np.testing.assert_allclose(found["observable"].A, np.column_stack([-denominator[1:], eye[:, :2]]), atol=1e-9)
    np.testing.assert_allclose(found["observable"].C[0], eye[0], atol=1e-9)
    blocks = canonical(plant(dt), "modal").A  # of several inputs and outputs too
    pair = blocks[:2, :2] if abs(blocks[0, 1]) > 1e-9 else blocks[1:, 1:]
    assert pair[0, 0] == pytest.approx(pair[1, 1])
    assert pair[0, 1] == pytest.approx(-pair[1, 0])
    assert np.count_nonzero(np.abs(blocks) > 1e-9) == 5


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: d2c(control.tf([1.0], [1.0, 0.5], 0.1)),
        lambda: d2c(plant()),
        lambda: c2d(plant(0.1), 0.2),
        lambda: c2d(plant(), 0.0),
        lambda: reduced(control.tf([1.0], [1.0, -1.0]), 1),
        lambda: reduced(plant(), 4),
        lambda: state_space(control.tf([1.0, 0.0, 0.0], [1.0, 1.0])),
        lambda: d2d(plant(), 0.1),
        lambda: canonical(plant(), "companion"),
        lambda: canonical(plant(), "diagonal"),
        lambda: canonical(control.ss([[0.5, 1.0], [0.0, 0.5]], [[0.0], [1.0]], [[1.0, 0.0]], 0.0, 0.1), "modal"),
    ],
    ids=[
        "negative pole",
        "continuous",
        "discrete",
        "no time",
        "unstable",
        "more states",
        "more zeros than poles",
        "continuous at another rate",
        "two inputs",
        "no form",
        "equal poles",
    ],
)
def test_what_cannot_be_is_refused_with_a_remedy(wrong) -> None:
    with pytest.raises(ConfigError) as caught:
        wrong()
    assert caught.value.remedy
