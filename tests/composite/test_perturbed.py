"""A whole that sees a channel a little off parts from itself where a switch hangs by that much, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.composite import committee, doubt_figures, doubt_threshold, fixed_by_equations, fixed_model, perturbed
from sysid.errors import ChannelError, ConfigError
from sysid.export import Flag, Surrogate, expected_flags
from sysid.models import Cascade, Limit
from sysid.testing import simulate_cascade
from sysid.traces import Channel, Trace
from tests.models.cascades.cascades import network

LIKE = Trace(
    name="like", sample_time=0.1, channels=tuple(Channel(name=name, unit="psi") for name in ("u", "R", "y")),
    values=np.zeros((2, 3)),
)  # fmt: skip


def valve(on: float = 1.0) -> Cascade:
    """Goes to 50 psi with a lag once its input is above ``on``, until it is below -1."""
    text = f"R = relay(u, on={on}, off=-1, slope=50)\ny = 0.9*y[k-1] + 5*R"
    models = [fixed_model(one, LIKE, {"R": "1"}) for one in fixed_by_equations(text, unit="psi")]
    return Cascade(models=tuple(models), limits={"R": Limit(low=0.0, high=1.0)})


def record(top: float, by: Cascade) -> Trace:
    """An input that rises to ``top``, holds it, and falls: what a whole makes of it."""
    u = np.concatenate([np.zeros(10), np.full(60, top), np.full(30, -2.0)])
    channels = tuple(Channel(name=name, unit="psi") for name in ("u", "y"))
    values = np.column_stack([u, by.simulate(u[:, None])["y"]])
    return Trace(name=f"to {top}", sample_time=0.1, channels=channels, values=values)


def members() -> list[Cascade]:
    return [valve(), *(perturbed(valve(), "u", by, readers=["R"]) for by in (0.1, -0.1))]


def test_its_readers_see_the_channel_moved_and_nobody_else_does() -> None:
    moved, run = perturbed(valve(), "u", 0.1), valve(0.9)
    for top in (0.5, 0.95, 1.5):
        u = record(top, run)["u"][:, None]
        np.testing.assert_array_equal(moved.simulate(u)["R"], run.simulate(u)["R"])
        np.testing.assert_array_equal(moved.simulate(u)["u"], u[:, 0])
    chain = Cascade(models=(network("STP -> BP", seed=1), network("BP+STP -> AR", seed=2)), rest={"BP": "STP"})
    u = np.full((30, 1), 80.0)
    off = perturbed(chain, "BP", 0.5)
    np.testing.assert_array_equal(off.simulate(u)["BP"], chain.simulate(u)["BP"])
    assert not np.array_equal(off.simulate(u)["AR"], chain.simulate(u)["AR"])
    twin = simulate_cascade(off, u)
    np.testing.assert_allclose(off.simulate(u)["AR"], twin["AR"], rtol=0.0, atol=1e-9)


def test_it_begins_at_rest_with_what_is_read_as_far_off() -> None:
    lag = Cascade(models=(network("STP -> BP", seed=1), network("BP -> AR", seed=2)), rest={"BP": 70.0})
    assert perturbed(lag, "BP", 0.5).rest["BP_seen"] == 70.5
    assert perturbed(lag, "STP", 0.5).rest["STP_seen"] == "STP"


def test_a_switch_that_nearly_moves_is_in_doubt_where_the_mean_of_the_others_says_little() -> None:
    # The plant's switch is at 0.95, the surrogate's at 1: wrong where the input holds between them.
    traces = [record(top, valve(0.95)) for top in (0.5, 0.97, 1.5)]
    right = [record(top, valve(0.95)) for top in (0.5, 0.7, 1.5, 2.0)]
    threshold = doubt_threshold(members(), right, "y", error=1.0, each=True)
    figures = doubt_figures(committee(members(), {"y": max(threshold, 0.5)}, each=True), traces, "y", error=1.0)
    assert figures.wrong > 0.1
    assert figures.flagged > 0.9
    assert figures.false < 0.1


def test_each_doubts_for_itself_whatever_leaves_the_whole() -> None:
    both = committee(members(), {"y": 2.0}, each=True)
    assert {name for name, limit in both.limits.items() if limit.doubt} == {"y_apart_2", "y_apart_3"}
    u = record(1.05, valve())["u"][:, None]
    run = both.simulate(u)
    part = Surrogate.of(both, outputs=["y"])
    flags = expected_flags(part, u, part.compute(u))
    apart = np.maximum(np.abs(run["y"] - run["y_2"]), np.abs(run["y"] - run["y_3"])) >= 2.0
    np.testing.assert_array_equal((flags & Flag.IN_DOUBT) > 0, apart)
    assert 0 < apart.sum() < len(apart)


@pytest.mark.parametrize(
    ("channel", "by", "readers"), [("u", 0.0, None), ("u", np.inf, None), ("y", 0.1, None), ("u", 0.1, ["y"])]
)
def test_what_perturbs_nothing_is_refused(channel: str, by: float, readers: list[str] | None) -> None:
    with pytest.raises(ConfigError, match="nothing is perturbed"):
        perturbed(valve(), channel, by, readers=readers)


def test_a_reader_that_is_not_there_is_refused() -> None:
    with pytest.raises(ChannelError, match="S"):
        perturbed(valve(), "u", 0.1, readers=["S"])
