"""A committee answers as its first member, and doubts where the others say something else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sysid.composite import committee, doubt_figures, doubt_threshold
from sysid.errors import ConfigError
from sysid.export import Flag, Surrogate, expected_flags
from sysid.models import Cascade, Limit
from sysid.models.store import cascade_from_dict
from sysid.testing import simulate_cascade
from sysid.traces import Channel, Trace
from tests.models.cascades import network


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
    ],
    ids=["one", "no threshold", "nothing judged", "not computed", "other inputs"],
)
def test_what_is_no_committee_is_refused(wholes: list, thresholds: dict, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        committee(wholes, thresholds)


def test_figures_of_what_is_not_judged_and_thresholds_without_a_right_answer_are_refused() -> None:
    trace = measured(0, WHOLES[0])
    with pytest.raises(ConfigError, match="BP is not judged"):
        doubt_figures(committee(WHOLES, {"AR": 1.0}), [trace], "BP", error=1.0)
    wrong = replace(trace, values=trace.values + np.array([0.0, 50.0]))
    with pytest.raises(ConfigError, match="no answer of the committee is right"):
        doubt_threshold(WHOLES, [wrong], "AR", error=1.0)
