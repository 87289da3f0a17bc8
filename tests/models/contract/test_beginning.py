"""Where a free run begins: an estimated start is exact for a deterministic record, and its window is not scored."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from sysid.models import (
    ARX,
    NARX,
    AbstractModel,
    ARXModel,
    Mapping,
    NARXModel,
    NeuralStateSpace,
    NeuralStateSpaceModel,
    Scaling,
    Start,
    StartKind,
    TransferFunction,
    TransferFunctionModel,
    beginning,
)
from sysid.models.contract.beginning import window

ESTIMATED = Start(kind=StartKind.ESTIMATED)
TERMS = {"mapping": Mapping.parse("u -> y"), "sample_time": 1.0, "input_units": ("V",), "output_unit": "V"}
PLAIN = Scaling(input_offset=(0.0,), input_scale=(1.0,), output_offset=0.0, output_scale=2.0)


def models() -> dict[str, AbstractModel]:
    """One of each kind, none of which forgets quickly."""
    arx = ARX(na=2, nb=(2,), nk=(3,))
    narx, space = NARX(input_delays=1, output_delays=2, neurons=1), NeuralStateSpace(states=2, neurons=1)
    theta = np.zeros(space.sizes(1).count)
    sizes = space.sizes(1)
    theta[sizes.linear] = [0.9, 0.2, 0.1, 0.0, -0.2, 0.9, 0.05, 0.0]
    theta[sizes.output_linear] = [1.0, 0.3, 0.0, 0.1]
    theta[sizes.hidden], theta[sizes.readout] = [0.5, 0.2, 0.3, 0.1], [-0.05, 0.05]
    return {
        "ARX": ARXModel(
            orders=arx, coefficients=np.array([0.1, 0.05, 1.6, -0.64]), intercept=0.1, rest_output=0.0, **TERMS
        ),
        "TF": TransferFunctionModel(
            orders=TransferFunction(poles=(2,), zeros=(1,), delays=(4,)),
            sections=((np.array([1.0, -1.6, 0.64]),),),
            taps=(np.array([0.2, 0.1]),),
            constant=0.2,
            scaling=PLAIN,
            rest_output=0.0,
            **TERMS,
        ),
        "NARX": NARXModel(
            network=narx,
            theta=np.array([0.3, 0.2, 0.1, 0.1, 0.2, 0.0, 0.1, 0.9, -0.05]),
            scaling=PLAIN,
            rest_output=0.0,
            **TERMS,
        ),
        "NSS": NeuralStateSpaceModel(network=space, theta=theta, scaling=PLAIN, rest_output=0.0, **TERMS),
    }


def off_equilibrium(model: AbstractModel, n: int, seed: int, noise: float = 0.0) -> tuple[NDArray[np.float64], ...]:
    """A record cut out of a longer run, so that nothing in it stands still where it begins."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1, 1, n // 4 + 20), 4)[: n + 60, None]
    y = model.simulate(u)
    return u[60 : 60 + n], y[60 : 60 + n] + noise * rng.standard_normal(n)


@pytest.mark.parametrize("kind", ["ARX", "TF", "NARX", "NSS"])
@settings(max_examples=10, deadline=None)
@given(n=st.integers(20, 120), seed=st.integers(0, 99))
def test_of_a_deterministic_record_the_run_is_exact(kind: str, n: int, seed: int) -> None:
    model = models()[kind]
    u, y = off_equilibrium(model, n, seed)
    begun = beginning(model, u, y, ESTIMATED)
    assert 0 < begun.first <= max(n // 5, model.recursion.memory)
    error = model.simulate(u[begun.first :], begun.history) - y[begun.first :]
    assert np.abs(error).max() < 1e-6


@pytest.mark.parametrize("kind", ["ARX", "TF", "NARX", "NSS"])
def test_noise_is_averaged_over_the_window_and_masked_samples_take_no_part(kind: str) -> None:
    model = models()[kind]
    u, y = off_equilibrium(model, 300, 1, noise=0.01)
    clean = off_equilibrium(model, 300, 1)[1]
    usable = np.ones(300, dtype=np.bool_)
    usable[20:30], y[20:30] = False, 50.0
    begun = beginning(model, u, y, ESTIMATED, usable)
    assert begun.first == 60  # fifty that count
    error = model.simulate(u[begun.first :], begun.history) - clean[begun.first :]
    assert np.abs(error).max() < 0.03


def test_a_single_sample_leaves_nothing_to_estimate_on() -> None:
    model = models()["ARX"]
    assert beginning(model, np.zeros((1, 1)), np.ones(1), ESTIMATED).first == 0
    assert window(7, np.ones(5, dtype=np.bool_)) == 4
    assert window(3, np.ones(500, dtype=np.bool_), asked=80) == 80


def test_the_other_starts_say_themselves_where_they_begin() -> None:
    model = models()["ARX"]
    u, y = off_equilibrium(model, 40, 0)
    assert beginning(model, u, y, Start(kind=StartKind.MEASURED, n_measured=7)).first == 7
    assert beginning(model, u, y, Start(kind=StartKind.FIRST_SAMPLE)).history.output.tolist() == [y[0]]


def line(history: NDArray[np.float64]) -> NDArray[np.float64]:
    """The free run, over 50 samples, of a model that goes on as it went: where a record has its first samples."""
    model = ARXModel(
        orders=ARX(na=2, nb=(1,), nk=(1,)), coefficients=np.array([0.0, 2.0, -1.0]), intercept=0.0, rest_output=0.0,
        **TERMS,
    )  # fmt: skip
    output = np.concatenate([history, np.zeros(250 - len(history))])
    begun = beginning(model, np.zeros((250, 1)), output, ESTIMATED)
    assert begun.first == 50
    return model.simulate(np.zeros((50, 1)), begun.history)


def test_what_is_estimated_does_not_make_up_for_an_error_that_goes_by() -> None:
    """Samples 5 to 20 are not the model's: the line that is nearest to the window's was 1.9 off fifty samples later."""
    disturbed = np.where((np.arange(50) >= 5) & (np.arange(50) < 20), 1.0, 0.0)
    assert np.abs(line(disturbed)).max() < 1e-12


def test_noise_of_the_first_samples_is_still_averaged_out() -> None:
    """A line through two noisy samples leads far away: that of all fifty foretells the later ones better."""
    noisy = 0.1 * np.random.default_rng(3).standard_normal(50)
    assert np.abs(line(noisy)).max() < 0.1
    assert abs(noisy[1] - noisy[0]) > 0.02
