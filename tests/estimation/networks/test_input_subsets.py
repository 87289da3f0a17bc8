"""Starts that do without some inputs: each is the network over the others, inside the whole structure."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.errors import ChannelError, ConfigError
from sysid.estimation import Training, fit_narx
from sysid.estimation.networks.initialise import Layout
from sysid.estimation.networks.input_subsets import embedding, part_of, views
from sysid.estimation.networks.training import FitProgress
from sysid.models import NARX, Mapping, NARXModel, Scaling
from sysid.traces import Channel, Trace
from tests.estimation.tank import tank

BOTH = Mapping(inputs=("pump", "rumour"), output="level")
ALONE = Mapping(inputs=("pump",), output="level")
NETWORKS = {
    "plain": NARX(input_delays=[[0, 1], [1, 4]], output_delays="1:2", neurons=3),
    "gated": NARX(input_delays=[[1], [0, 7]], output_delays=[1, 4], neurons=2, gated=True),
    "without feedthrough": NARX(input_delays=[[1, 2], [3]], output_delays=1, neurons=4, feedthrough=False),
}
SMALL = NARX(input_delays=[[1], [0, 1]], output_delays=1, neurons=3, gated=True)
SHARED = Training(max_iterations=15, starts=5, input_subsets=[["rumour"]], workers=1)


def told(seed: int, n: int = 400, *, sound: bool = True) -> Trace:
    """A tank, and an input that follows its level; or, where it is not sound, says what it likes."""
    trace = tank(seed, n)
    level = trace["level"] if sound else np.random.default_rng(seed).uniform(0.0, 2.0, n)
    rumour = np.concatenate([[0.0], level[:-1]])
    channels = (*trace.channels, Channel(name="rumour", unit="m"))
    return replace(trace, channels=channels, values=np.column_stack([trace.values, rumour]))


def network_over(network: NARX, inputs: tuple[int, ...]) -> NARX:
    return NARX(
        input_delays=[network.input_delays[i] for i in inputs],
        output_delays=network.output_delays,
        neurons=network.neurons,
        feedthrough=network.feedthrough,
        gated=network.gated,
    )


@pytest.mark.parametrize("network", NETWORKS.values(), ids=NETWORKS)
@given(kept=st.sampled_from([0, 1]), seed=st.integers(0, 1000))
def test_a_part_inside_the_whole_is_the_network_over_its_own_inputs(network, kept, seed):
    rng = np.random.default_rng(seed)
    whole = Layout.of(network, 2)
    part = part_of(whole, BOTH, (BOTH.inputs[1 - kept],))
    theta = 0.3 * rng.standard_normal(part.n_parameters)
    inputs = rng.uniform(-1.0, 1.0, (40, 2))
    shared = {"sample_time": 0.5, "output_unit": "m", "rest_output": 0.0}

    def ranges(columns: int) -> Scaling:
        return Scaling.to_unit_range([np.array([[-1.0], [1.0]]) * np.ones(columns)], [np.array([-2.0, 2.0])])

    inside = NARXModel(
        network=network, theta=embedding(part, whole) @ theta, scaling=ranges(2), mapping=BOTH,
        input_units=("V", "m"), **shared,
    )  # fmt: skip
    alone = NARXModel(
        network=network_over(network, (kept,)), theta=theta, scaling=ranges(1),
        mapping=Mapping(inputs=(BOTH.inputs[kept],), output="level"), input_units=("V",), **shared,
    )  # fmt: skip
    np.testing.assert_allclose(inside.simulate(inputs), alone.simulate(inputs[:, [kept]]), atol=1e-12)


def test_a_start_that_does_without_an_input_is_trained_as_the_network_that_has_none():
    training = Training(max_iterations=25, starts=2, input_subsets=[["rumour"]], workers=1)
    both = fit_narx([told(1)], BOTH, SMALL, training, selection=[told(2, sound=False)])
    alone = fit_narx([told(1)], ALONE, network_over(SMALL, (0,)), Training(max_iterations=25, seed=1))
    (without,) = (attempt for attempt in both.attempts if attempt.without)
    assert without.seed == 1
    assert without.estimation_mse == pytest.approx(alone.history["mse"][-1], rel=1e-6)
    assert without.effective_parameters == pytest.approx(alone.history["effective_parameters"][-1], rel=1e-4)
    # what it was told is no good on the selection trace, so that the start without it is chosen
    assert without.chosen
    heard, unheard = (trace.columns(BOTH.inputs) for trace in (told(3), told(3, sound=False)))
    np.testing.assert_array_equal(both.model.simulate(heard), both.model.simulate(unheard))
    np.testing.assert_allclose(both.model.simulate(heard), alone.model.simulate(heard[:, :1]), atol=1e-6)
    assert both.posterior.covariance.shape == (both.model.n_parameters,) * 2


def test_starts_are_shared_out_and_keep_numbers_and_seeds_of_their_own():
    fit = fit_narx([told(1)], BOTH, SMALL, SHARED, selection=[told(2)])
    origins = {attempt.start: (attempt.seed, attempt.without) for attempt in fit.attempts}
    assert origins == {1: (0, ()), 2: (1, ()), 3: (2, ()), 4: (3, ("rumour",)), 5: (4, ("rumour",))}


def test_a_ensemble_unites_those_that_see_an_input_and_those_that_do_not():
    training = replace(SHARED, ensemble=5, starts=12, max_iterations=60)
    fit = fit_narx([told(1)], BOTH, SMALL, training, selection=[told(2), told(4)])
    without = {attempt.start for attempt in fit.attempts if attempt.without}
    (chosen,) = (attempt for attempt in fit.attempts if attempt.chosen)
    assert without & set(chosen.members)
    assert set(chosen.members) - without
    assert fit.model.mapping == BOTH


def test_progress_counts_over_the_starts_of_all_views():
    seen: list[FitProgress] = []
    fit_narx([told(1)], BOTH, SMALL, SHARED, selection=[told(2)], on_progress=seen.append)
    assert {entry.starts for entry in seen} == {5}
    assert {entry.start for entry in seen} == {1, 2, 3, 4, 5}
    assert [entry.fraction for entry in seen] == sorted(entry.fraction for entry in seen)
    assert seen[-1].fraction <= 1.0


def test_an_interruption_ends_the_races_that_have_not_begun():
    def stop(entry: FitProgress) -> None:
        if entry.start == 2:
            raise KeyboardInterrupt

    fit = fit_narx([told(1)], BOTH, SMALL, SHARED, selection=[told(2)], on_progress=stop)
    assert not any(attempt.without for attempt in fit.attempts)


def test_time_is_shared_out_with_the_starts():
    limits = [view.training.max_time_s for view in views(replace(SHARED, max_time_s=10.0), BOTH)]
    assert limits == pytest.approx([6.0, 4.0])


def test_an_input_that_is_none_cannot_be_left_out():
    with pytest.raises(ChannelError, match="input_subsets"):
        views(Training(starts=2, input_subsets=[["noise"]]), BOTH)


def test_something_has_to_be_left_to_see():
    with pytest.raises(ConfigError, match="nothing is left to see"):
        views(Training(starts=2, input_subsets=[["rumour", "pump"]]), BOTH)


def test_every_set_needs_a_start():
    with pytest.raises(ConfigError, match="not every set of inputs has a start"):
        Training(input_subsets=[["rumour"]], starts=1)
