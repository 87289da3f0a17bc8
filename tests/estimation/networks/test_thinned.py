"""Records that are sampled much faster than they move: what starts are raced on, and what all samples make of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.estimation import FitResult
from sysid.estimation.networks.neural.finer import finer
from sysid.estimation.networks.neural.state_space import fit_neural_state_space
from sysid.estimation.networks.neural.thinned import LONG, Thinned, band_allows, thinned
from sysid.estimation.networks.training import Training
from sysid.models import NeuralForm, NeuralStateSpace, Scaling, Start
from sysid.traces import Role, Trace
from sysid.validation import case_results
from tests.estimation.networks.structures import MAPPING, shaken
from tests.traces.made import trace_of

EVERY = 5


def tones(*frequencies: float, n: int = LONG) -> Trace:
    """Sines of the same size in both channels, in parts of half the sampling rate."""
    t = np.arange(n)
    wave = np.sum([np.sin(np.pi * f * t) for f in frequencies], axis=0)
    return trace_of({"u": wave, "y": wave}, name="tones", sample_time=0.01, units={"u": "N", "y": "m/s^2"})


@pytest.mark.parametrize(
    ("trace", "every"),
    [
        (tones(0.05), 7),  # below 1 / (2.5 * 0.05), for its harmonics
        (tones(0.05, n=LONG - 1), 1),  # an iteration over few samples is cheap
        (tones(0.05, 0.3), 1),
        (tones(0.001), 16),
    ],
)
def test_the_band_of_the_inputs_says_how_many_samples_tell_all(trace: Trace, every: int) -> None:
    assert band_allows([trace], MAPPING) == every


def test_what_jumps_is_not_thinned() -> None:
    steps = np.repeat(np.random.default_rng(0).choice([-1.0, 1.0], LONG // 100), 100)
    trace = replace(tones(0.01), values=np.column_stack([steps, np.convolve(steps, np.full(50, 0.02))[:LONG]]))
    assert band_allows([trace], MAPPING) == 1


def test_a_thinned_record_has_what_is_slow_and_nothing_else() -> None:
    trace = replace(tones(0.04, 0.5), weights=np.ones(LONG))
    few = thinned(trace, MAPPING, EVERY, held=False)
    slow = np.sin(np.pi * 0.04 * np.arange(LONG))[::EVERY]
    assert few.sample_time == pytest.approx(EVERY * trace.sample_time)
    np.testing.assert_allclose(few["y"][40:-40], slow[40:-40], atol=1e-4)
    assert few.weights is not None
    assert len(few.weights) == len(few)


def test_samples_beside_masked_ones_are_masked_and_theirs_are_bridged() -> None:
    values, usable = tones(0.04).values.copy(), np.ones(LONG, dtype=np.bool_)
    values[1000:1010], usable[1000:1010] = 1e6, False
    few = thinned(replace(tones(0.04), values=values, usable=usable), MAPPING, EVERY, held=False)
    assert few.usable is not None
    assert np.flatnonzero(~few.usable).tolist() == list(range(198, 204))
    assert np.abs(few.values).max() < 2.0


def test_a_channel_that_stood_before_a_record_is_held_there() -> None:
    values = np.tile(np.concatenate([np.ones(300), 1.0 + 0.1 * np.arange(700)])[:, None], (1, 2))
    trace = replace(tones(0.04), values=values)
    np.testing.assert_allclose(thinned(trace, MAPPING, EVERY, held=True)["u"][:40], 1.0, atol=1e-6)


def test_a_structure_is_found_from_few_samples_and_is_a_model_of_all() -> None:
    records = [shaken(seed, force) for seed, force in ((0, 2.0), (1, 6.0))]
    assert band_allows(records, MAPPING) == 1  # too short for that unasked
    found = fit_neural_state_space(
        records,
        MAPPING,
        NeuralStateSpace(states=4, neurons=4),
        Training(starts=1, thin=EVERY, max_iterations=60),
        start=Start.of({"measured": 40}),
    )
    model = found.model
    assert model.sample_time == records[0].sample_time
    assert any("every 5th sample" in note for note in found.notes)
    linear = model.theta[model.recursion.sizes.linear].reshape(4, -1)[:, :4]
    assert np.abs(np.linalg.eigvals(linear)).max() < 1.0
    other = shaken(7, 4.0)
    (case,) = case_results(model, other, Role.TEST, Start.of({"measured": 40}), 1).values()
    assert case.free_run.mse < 0.02**2 * np.var(other["y"])  # a linear model leaves 0.2


def test_a_model_that_sums_up_is_trained_on_all_samples() -> None:
    record = shaken(0, 2.0, n=1500)
    structure, training = NeuralStateSpace(states=2, neurons=1, integrators=1), Training(starts=1, max_iterations=2)
    sparse, whole = (
        fit_neural_state_space([record], MAPPING, structure, replace(training, thin=thin)) for thin in (EVERY, 1)
    )
    np.testing.assert_array_equal(sparse.model.theta, whole.model.theta)


def test_a_number_that_thins_nothing_is_refused() -> None:
    with pytest.raises(ConfigError, match="thin is too small"):
        Training(thin=0)


def test_a_fit_whose_thinned_model_is_none_of_all_samples_begins_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sysid.estimation.networks.neural.thinned.finer", lambda *_: None)
    took, fit = list[float](), Thinned.fit

    def counted(self: Thinned, one: Callable[..., FitResult]) -> FitResult:
        def noted(**given: Any) -> FitResult:
            found = one(**given)
            took.append(found.train_time_s)
            return found

        return fit(self, noted)

    monkeypatch.setattr(Thinned, "fit", counted)
    record, training = shaken(0, 2.0, n=1500), Training(starts=1, max_iterations=2, stable=True)
    structure = NeuralStateSpace(states=2, neurons=1)
    sparse, whole = (
        fit_neural_state_space([record], MAPPING, structure, replace(training, thin=thin)) for thin in (EVERY, 1)
    )
    np.testing.assert_array_equal(sparse.model.theta, whole.model.theta)
    assert "every 5th sample" in sparse.notes[-1]
    assert len(took) == 2  # what was given up is counted, too
    assert sparse.train_time_s == sum(took)


@pytest.mark.parametrize("turn", [0.2, 1.0])
def test_a_swing_at_fewer_samples_is_the_same_swing_at_all(turn: float) -> None:
    """Frequency and damping to the last digits; the free run but for a phase far from the resonance."""
    A = 0.98 * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    sizes = NeuralStateSpace(states=2, neurons=0).sizes(1)
    theta = np.zeros(sizes.count)
    theta[sizes.linear] = np.column_stack([A, [0.1, 0.0], [0.0, 0.0]]).ravel()
    theta[sizes.output_linear] = [1.0, 0.0, 0.0, 0.0]
    scaling = Scaling(input_offset=(0.0,), input_scale=(1.0,), output_offset=0.0, output_scale=1.0)
    form = NeuralForm(sizes=sizes, theta=theta, scaling=scaling)
    rng, t = np.random.default_rng(0), np.arange(10_000)
    lines = np.arange(0.3, 1.7, 0.01) * turn / EVERY
    u = 0.05 * np.sum([np.cos(f * t + rng.uniform(0.0, 6.28)) for f in lines], axis=0)  # within the states' bounds
    few = replace(tones(0.04, n=2000), values=np.column_stack([u[::EVERY], np.zeros(2000)]))
    spectrum = np.fft.rfft(form.run(u[::EVERY, None], np.zeros(2))[:, 0], norm="forward")
    y = np.fft.irfft(np.concatenate([spectrum, np.zeros(5001 - len(spectrum))]), 10_000, norm="forward")
    every = replace(tones(0.04, n=10_000), values=np.column_stack([u, y]))
    found = finer(form, [few], [every], MAPPING, EVERY)
    assert found is not None
    swings = np.linalg.eigvals(found.theta[sizes.linear].reshape(2, -1)[:, :2])
    np.testing.assert_allclose(np.abs(swings), 0.98 ** (1 / EVERY), rtol=1e-9)
    np.testing.assert_allclose(np.abs(np.angle(swings)), turn / EVERY, rtol=1e-9)
    away = found.run(u[:, None], np.zeros(2))[1000:-1000, 0] - y[1000:-1000]
    assert np.std(away) < 0.05 * np.std(y)
