"""The line of an assembly: what runs along it, what stands at a position, and how positions are scored."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sysid.composite.members import assembled
from sysid.errors import ConfigError
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.workbench.assembly.interpolation import (
    StoredInterpolation,
    interpolation_of,
    positions_of,
    score_interpolation,
)
from sysid.workbench.assembly.proof_config import InterpolationConfig
from tests.composite.composites import models, pipe, trace
from tests.workbench.assembly.test_config import TWO_PLACES, config

ASKED = InterpolationConfig(channel="BP", knots={"BP": 1, "BP9": 9}, outputs=("AR",), data="positions")


def whole():
    return assembled(pipe(), models())


def positions(n: int = 120) -> TraceSet:
    """The whole's own line as the reference, at three positions, with half a unit added at position 4."""
    line = interpolation_of(ASKED, whole())
    traces = {}
    for seed, name in enumerate(("A", "B")):
        handle = trace(n=n, seed=seed)["STP"]
        run = line.simulate(handle[:, None], [1.0, 4.0, 9.0])
        names = ("STP", "AR1", "AR4", "AR9")
        values = np.column_stack([handle, run["AR"].T + np.array([0.0, 0.5, 0.0])])
        channels = tuple(Channel(name=one, unit="psi") for one in names)
        traces[name] = Trace(name=name, sample_time=0.1, channels=channels, values=values)
    return TraceSet(name="positions", traces=tuple(traces.values()), roles=dict.fromkeys(traces, Role.VALIDATION))


def test_what_the_knots_need_runs_along_and_what_the_outputs_need_stands_at_a_place():
    line = interpolation_of(ASKED, whole())
    assert set(line.along.outputs) == {"BP", "BP9"}
    assert line.at_place.outputs == ("AR",)
    assert set(line.at_place.inputs) == {"BP", "STP"}
    assert line.at_place.limits["AR"].high == "BP"
    assert dict(line.knots) == {"BP": 1.0, "BP9": 9.0}


@pytest.mark.parametrize("rest", [{}, {"BP": "STP", "BP9": "STP", "AR": "STP"}], ids=["at 90", "at the handle"])
def test_at_a_knot_it_begins_as_the_whole_does(rest):
    """What reads earlier samples of the channel finds its level there, not its first sample."""
    composite = pipe(rest=rest)
    one, command = assembled(composite, models()), trace()["STP"][:, None]
    run, there = interpolation_of(ASKED, one).simulate(command, [1.0]), one.simulate(command)
    assert_allclose(run["AR"][0], there["AR"], atol=1e-9)


def test_it_knows_what_it_was_trained_on():
    line, fitted = interpolation_of(ASKED, whole()), [trace(seed=5), trace(seed=6)]
    stored = StoredInterpolation.of(ASKED, line, next(iter(positions())), fitted)
    values = np.concatenate([one["STP"] for one in fitted])
    assert stored.ranges == {"STP": (values.min(), values.max())}


def test_positions_are_the_numbers_behind_an_output():
    assert positions_of(next(iter(positions())), "AR") == {1.0: "AR1", 4.0: "AR4", 9.0: "AR9"}


def test_each_position_is_scored_by_itself():
    line, cases = interpolation_of(ASKED, whole()), positions()
    scores = score_interpolation(ASKED, line, cases)
    assert scores.positions["AR"].tolist() == [1.0, 4.0, 9.0]
    assert scores.seen["AR"].tolist() == [True, False, True]
    for case in ("A", "B"):
        assert_allclose(scores.mse["AR"][case], [0.0, 0.25, 0.0], atol=1e-12)


def test_data_without_positions_are_refused():
    line = interpolation_of(ASKED, whole())
    cases = positions()
    bare = replace(cases, traces=tuple(replace(t, channels=t.channels[:1], values=t.values[:, :1]) for t in cases))
    with pytest.raises(ConfigError, match="no position of the line"):
        score_interpolation(ASKED, line, bare)


@pytest.mark.parametrize(
    ("line", "match"),
    [
        pytest.param("knots: {BP: 9, BP9: 1}, outputs: [AR]", "no line", id="knots out of order"),
        pytest.param("knots: {BP: 1, BP8: 9}, outputs: [AR]", "which no member writes", id="a stranger"),
        pytest.param("knots: {BP: 1, BP9: 9}, outputs: [AR], judged: [BP]", "is not had at a position", id="judged"),
    ],
)
def test_a_line_that_cannot_be_is_refused(line, match):
    with pytest.raises(ConfigError, match=match):
        config(TWO_PLACES + f"interpolation: {{channel: BP, data: positions, {line}}}\n")


def test_outputs_that_do_not_follow_from_the_channel_are_refused():
    with pytest.raises(ConfigError, match="cannot be had at a position"):
        interpolation_of(ASKED.model_copy(update={"channel": "BP9"}), whole())
