"""A committee answers as its first member, and doubts where the others say something else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sysid.composite import committee, doubt_figures, doubt_threshold
from sysid.errors import ChannelError, ConfigError
from sysid.export import Flag, Surrogate, expected_flags
from sysid.export.flags import limits_reached
from sysid.models import Cascade, Limit
from sysid.models.store import cascade_from_dict
from sysid.testing import simulate_cascade
from sysid.traces import Channel, Trace
from tests.models.cascades.cascades import network


def whole(seed: int) -> Cascade:
    return Cascade(
        models=(network("STP -> BP", seed=seed), network("BP+STP -> AR", seed=seed + 10)),
        rest={"BP": "STP"},
        limits={"AR": Limit(high="BP")},
    )


WHOLES = [whole(seed) for seed in (1, 2, 3)]


def measured(seed: int, by: Cascade, apart: float = 0.0) -> Trace:
    """What a whole computes, and where the handle is low something else."""
    handle = np.repeat(np.random.default_rng(seed).uniform(64.0, 90.0, 12), 20)
    run = by.simulate(handle[:, None])["AR"]
    values = np.column_stack([handle, run + np.where(handle < 75.0, apart, 0.0)])
    channels = tuple(Channel(name=name, unit="psi") for name in ("STP", "AR"))
    return Trace(name=f"T{seed}", sample_time=0.1, channels=channels, values=values)


@pytest.mark.parametrize("count", [3, 4, 5])
def test_of_three_others_and_more_it_is_the_median(count: int) -> None:
    """One that runs away raises no doubt of its own."""
    wholes = [whole(seed) for seed in range(count + 1)]
    handle = measured(0, wholes[0])["STP"][:, None]
    both = committee(wholes, {"AR": 100.0})
    run, others = both.simulate(handle), np.stack([one.simulate(handle)["AR"] for one in wholes[1:]])
    np.testing.assert_allclose(run["AR_apart"], run["AR"] - np.median(others, axis=0), rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(simulate_cascade(both, handle)["AR_apart"], run["AR_apart"], rtol=0.0, atol=1e-9)
    assert cascade_from_dict(both.to_dict()).to_dict() == both.to_dict()


def test_it_answers_as_its_first_member_does() -> None:
    handle = measured(0, WHOLES[0])["STP"][:, None]
    run = committee(WHOLES, {"AR": 0.5}).simulate(handle)
    for number, one in enumerate(WHOLES, 1):
        alone = one.simulate(handle)
        for name in ("BP", "AR"):
            np.testing.assert_array_equal(run[name if number == 1 else f"{name}_{number}"], alone[name])
    np.testing.assert_allclose(
        run["AR_apart"], np.clip(run["AR"] - 0.5 * (run["AR_2"] + run["AR_3"]), -0.5, 0.5), atol=1e-12
    )


@pytest.mark.parametrize("mean", [(), ("AR", "BP")], ids=["the first answers", "the mean"])
def test_where_an_output_is_said_to_begin_all_its_wholes_begin(mean: tuple[str, ...]) -> None:
    handle = measured(0, WHOLES[0])["STP"][:, None]
    begun = {"AR": 60.0, "BP": 65.0}
    both = committee(WHOLES, {"AR": 0.5}, mean=mean)
    alone = [one.simulate(handle, rest=begun)["AR"] for one in WHOLES]
    assert not np.allclose(alone[1], WHOLES[1].simulate(handle)["AR"], atol=0.1)
    expected = np.mean(alone, axis=0) if mean else alone[0]
    run = both.simulate(handle, rest=begun)
    np.testing.assert_allclose(run["AR"], expected, rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(run["AR_3"], alone[2])
    surrogate = Surrogate.of(both, outputs=["BP", "AR"])
    np.testing.assert_array_equal(surrogate.simulate(handle, np.array([65.0, 60.0]))[:, 1], run["AR"])


@pytest.mark.parametrize("count", [2, 3, 4])
def test_a_mean_answers_as_all_do_and_its_spread_is_how_far_they_are_apart(count: int) -> None:
    wholes = [whole(seed) for seed in range(count)]
    handle = measured(0, wholes[0])["STP"][:, None]
    both = committee(wholes, {"AR": 0.5}, mean=["BP", "AR"])
    run, twin = both.simulate(handle), simulate_cascade(both, handle)
    for name in ("BP", "AR"):
        alone = np.stack([one.simulate(handle)[name] for one in wholes])
        np.testing.assert_allclose(run[name], alone.mean(axis=0), rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(run[f"{name}_spread"], np.ptp(alone, axis=0), rtol=0.0, atol=1e-12)
        np.testing.assert_array_equal(run[f"{name}_1"], alone[0])
    np.testing.assert_allclose(twin["AR_spread"], run["AR_spread"], rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(run["AR_apart"], np.minimum(run["AR_spread"], 0.5))
    assert (run["AR"] <= run["BP"]).all()  # a limit that is an averaged channel is kept
    surrogate = Surrogate.of(both, outputs=["AR"])
    flags = expected_flags(surrogate, handle, surrogate.compute(handle))
    np.testing.assert_array_equal((flags & Flag.IN_DOUBT) > 0, run["AR_spread"] >= 0.5)
    held = [holds(one, handle, "AR") for one in wholes]
    assert 0 < np.count_nonzero(np.any(held, axis=0)) < len(handle)
    np.testing.assert_array_equal((flags & Flag.AT_LIMIT) > 0, np.any(held, axis=0))
    of_pipe = Surrogate.of(both, outputs=["BP"])  # of what does not leave it nobody is told
    assert not (expected_flags(of_pipe, handle, of_pipe.compute(handle)) & Flag.AT_LIMIT).any()
    assert cascade_from_dict(both.to_dict()).to_dict() == both.to_dict()


@pytest.mark.parametrize("count", [2, 3, 4])
def test_how_a_spread_or_a_median_is_computed_is_no_limit_to_be_told_of(count: int) -> None:
    """Where all that is computed comes out, the lesser of two is one of them, and had been told to be held."""
    models = [network("u -> y", seed=seed) for seed in range(count)]
    u = np.random.default_rng(0).uniform(64.0, 90.0, size=(50, 1))
    for both in (committee(models, mean=["y"]), committee(models, {"y": 100.0})):
        for one in (both, cascade_from_dict(both.to_dict())):
            surrogate = Surrogate.of(one)
            assert not expected_flags(surrogate, u, surrogate.compute(u)).any()
            assert limits_reached(surrogate, u, surrogate.compute(u)) == []


def test_what_holds_a_part_of_a_mean_of_means_is_told_of_the_outermost() -> None:
    handle = measured(0, WHOLES[0])["STP"][:, None]
    both = committee([committee(WHOLES[:2], mean=["BP", "AR"]), WHOLES[2]], mean=["BP", "AR"])
    surrogate = Surrogate.of(both, outputs=["AR"])
    flags = expected_flags(surrogate, handle, surrogate.compute(handle))
    np.testing.assert_array_equal(
        (flags & Flag.AT_LIMIT) > 0, np.any([holds(one, handle, "AR") for one in WHOLES], axis=0)
    )


def holds(one: Cascade, u: np.ndarray, output: str) -> np.ndarray:
    """Where the file of a whole raises AT_LIMIT."""
    surrogate = Surrogate.of(one, outputs=[output])
    return (expected_flags(surrogate, u, surrogate.compute(u)) & Flag.AT_LIMIT) > 0


def test_a_mean_of_plain_models_may_be_one_of_a_committee_itself() -> None:
    models = [network("STP -> BP", seed=seed) for seed in (1, 2, 3)]
    handle = measured(0, WHOLES[0])["STP"][:, None]
    inner = committee(models[:2], mean=["BP"])
    outer = committee([models[2], inner], {"BP": 1.0})
    run, alone = outer.simulate(handle), [one.simulate(handle) for one in models]
    np.testing.assert_allclose(run["BP_2"], 0.5 * (alone[0] + alone[1]), rtol=0.0, atol=1e-12)
    begun = outer.simulate(handle, rest={"BP": 50.0})
    np.testing.assert_array_equal(begun["BP_2_2"], inner.simulate(handle, rest={"BP": 50.0})["BP_2"])


def test_one_system_is_at_rest_at_one_level() -> None:
    other = Cascade(models=WHOLES[1].models, rest={"BP": "STP", "AR": 12.0}, limits=WHOLES[1].limits)
    with pytest.raises(ConfigError, match="AR at rest at different levels"):
        committee([WHOLES[0], other], mean=["AR"])
    both = committee([WHOLES[0], other], mean=["AR"], rest={"AR": 30.0})
    assert both.level("AR") == both.level("AR_1") == both.level("AR_2") == 30.0
    with pytest.raises(ChannelError, match="BP"):
        committee(WHOLES, mean=["AR"], rest={"BP": 30.0})


def test_the_figures_of_a_mean_are_those_of_its_spread() -> None:
    traces = [measured(seed, WHOLES[0], apart=5.0) for seed in range(4)]
    found = doubt_threshold(WHOLES, traces, "AR", error=1.0, false=0.25, mean=True)
    both = committee(WHOLES, {"AR": found}, mean=["AR"])
    figures = doubt_figures(both, traces, "AR", error=1.0)
    runs = [both.simulate_trace(trace) for trace in traces]
    spread = np.concatenate([run["AR_spread"] for run in runs])
    wrong = np.abs(np.concatenate([run["AR"] - trace["AR"] for run, trace in zip(runs, traces, strict=True)])) > 1.0
    assert 0.0 < wrong.mean() < 1.0
    assert figures.wrong == wrong.mean()
    assert figures.flagged == np.mean(spread[wrong] >= found)
    assert figures.false == pytest.approx(0.25, abs=0.02)


def test_the_slow_twin_agrees() -> None:
    handle = measured(0, WHOLES[0])["STP"][:60, None]
    both = committee(WHOLES, {"AR": 0.5})
    twin, run = simulate_cascade(both, handle), both.simulate(handle)
    for name in both.outputs:
        np.testing.assert_allclose(run[name], twin[name], rtol=0.0, atol=1e-9)


def test_doubt_is_a_flag_of_its_own_whatever_leaves_the_whole() -> None:
    both = committee(WHOLES, {"AR": 0.5})
    surrogate = Surrogate.of(both, outputs=["AR"])
    u = measured(0, WHOLES[0])["STP"][:, None]
    computed = surrogate.compute(u)
    flags = expected_flags(surrogate, u, computed)
    apart = np.abs(both.simulate(u)["AR_apart"])
    np.testing.assert_array_equal((flags & Flag.IN_DOUBT) > 0, apart == 0.5)
    assert 0 < np.count_nonzero(apart == 0.5) < len(u)


def test_it_is_stored_and_read_again() -> None:
    both = committee(WHOLES, {"AR": 0.5})
    again = cascade_from_dict(both.to_dict())
    assert again.limits == both.limits
    assert again.limits["AR_apart"].doubt


def test_the_threshold_leaves_most_right_answers_undoubted() -> None:
    traces = [measured(seed, WHOLES[0]) for seed in range(4)]
    found = doubt_threshold(WHOLES, traces, "AR", error=0.1, false=0.25)
    figures = doubt_figures(committee(WHOLES, {"AR": found}), traces, "AR", error=0.1)
    assert (figures.wrong, figures.flagged, figures.threshold) == (0.0, 1.0, found)
    assert figures.false == pytest.approx(0.25, abs=0.02)


def test_the_figures_are_shares_of_wrong_and_of_right_answers() -> None:
    traces = [measured(seed, WHOLES[0], apart=5.0) for seed in range(4)]
    both = committee(WHOLES, {"AR": 0.5})
    figures = doubt_figures(both, traces, "AR", error=1.0)
    wrong = np.concatenate([trace["STP"] for trace in traces]) < 75.0
    apart = np.concatenate([np.abs(both.simulate_trace(trace)["AR_apart"]) for trace in traces])
    assert figures.wrong == np.mean(wrong)
    assert figures.flagged == np.mean(apart[wrong] == 0.5)
    assert figures.false == np.mean(apart[~wrong] == 0.5)


@pytest.mark.parametrize(
    ("wholes", "thresholds", "said"),
    [
        (WHOLES[:1], {"AR": 1.0}, "not a committee"),
        (WHOLES, {"AR": 0.0}, "not a committee"),
        (WHOLES, {}, "not a committee"),
        (WHOLES, {"BC": 1.0}, "the same question"),
        ([WHOLES[0], network("BP+STP -> AR")], {"AR": 1.0}, "the same question"),
        (
            [network("STP -> BP"), replace(network("STP -> BP"), sample_time=0.2)],
            {"BP": 1.0},
            r"number 2(.|\n)*every 0.1 s(.|\n)*every 0.2 s",
        ),
        (
            [network("STP -> BP"), replace(network("STP -> BP"), output_unit="bar")],
            {"BP": 1.0},
            r"number 2(.|\n)*BP in psi(.|\n)*BP in bar",
        ),
    ],
    ids=["one", "no threshold", "nothing judged", "not computed", "other inputs", "sample time", "unit"],
)
def test_what_is_no_committee_is_refused(wholes: list, thresholds: dict, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        committee(wholes, thresholds)


@pytest.mark.parametrize("asked", [{"each": True}, {"thresholds": {"BP": 1.0}}, {"mean": ["AR", "AR"]}])
def test_a_mean_is_doubted_by_its_spread_alone(asked: dict) -> None:
    with pytest.raises(ConfigError, match="doubted by the spread"):
        committee(WHOLES, **{"mean": ["AR"], **asked})


def test_figures_of_what_is_not_judged_and_thresholds_without_a_right_answer_are_refused() -> None:
    trace = measured(0, WHOLES[0])
    with pytest.raises(ConfigError, match="BP is not judged"):
        doubt_figures(committee(WHOLES, {"AR": 1.0}), [trace], "BP", error=1.0)
    wrong = replace(trace, values=trace.values + np.array([0.0, 50.0]))
    with pytest.raises(ConfigError, match="no answer of the committee is right"):
        doubt_threshold(WHOLES, [wrong], "AR", error=1.0)
