"""Limits that are channels, beside measured traces that pass them or do not."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.composite.fixed_members import with_known
from sysid.composite.limit_check import check_limits
from sysid.traces import Channel, Trace
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.views import limits_table

NARX = {"kind": "NARX", "input_delays": [0], "output_delays": 1, "neurons": 2}


def config(limit: dict[str, object], places: tuple[str, ...] = ("",)) -> AssemblyConfig:
    """A tank that rises by at most one in a sample."""
    return AssemblyConfig.model_validate(
        {
            "kind": "assembly",
            "name": "tank",
            "data": "tank",
            "training": "tank",
            "outputs": ["level"],
            "members": [{"mapping": "pump -> level", "structure": NARX, "rest": 0, "places": places}],
            "known": [
                {
                    "mapping": "level -> most", "gains": {"level": {1: 1}}, "constant": 1, "low": -99, "high": 99,
                    "rest": 1, "places": places,
                }
            ],
            "limits": {"level": limit},
        }
    )  # fmt: skip


def seen(asked: AssemblyConfig, *levels: list[float], names: tuple[str, ...] = ("level",)) -> list[Trace]:
    channels = tuple(Channel(name=name, unit="cm") for name in ("pump", *names))
    traces = [
        Trace(
            name=f"t{number}",
            sample_time=1.0,
            channels=channels,
            values=np.column_stack([np.zeros(len(level)), *[level] * len(names)]),
        )
        for number, level in enumerate(levels)
    ]
    return with_known(asked.known, traces)


def test_a_limit_that_the_traces_pass_is_named_with_how_far_and_where():
    asked = config({"low": 0, "high": "most"})
    traces = seen(asked, [0.0, 1.0, 1.5, 2.5], [0.0, 3.0, 3.0, 5.5], [0.0, 2.0, 1.0, 3.0])
    found = check_limits(asked, traces)
    (passed,) = found.limits
    assert (passed.output, passed.limit, passed.trace) == ("level", "most", "t1")
    assert (passed.most, passed.summed) == pytest.approx((2.0, 3.5))
    assert found.sentence == (
        "Training traces (3) pass 1 of 1 limits that are channels, most the furthest: level would be held back by "
        "3.5 cm over t1."
    )
    assert limits_table(found)["rows"] == [["most", "level (cm)", passed.most, passed.summed, "t1"]]


def test_a_limit_from_below_is_passed_downwards():
    asked = config({"low": "most", "high": 100})
    (passed,) = check_limits(asked, seen(asked, [1.0, 2.0, 2.5, 3.5])).limits
    assert (passed.most, passed.summed) == pytest.approx((0.5, 0.5))


def test_limits_that_hold_are_counted():
    asked = config({"low": 0, "high": "most"})
    found = check_limits(asked, seen(asked, [0.0, 1.0, 2.0]))
    assert found.sentence == "No training trace (1) passes a limit that is a channel (1)."
    assert found.passed == []


def test_each_place_has_its_own():
    asked = config({"low": 0, "high": "most"}, places=("", "9"))
    traces = seen(asked, [0.0, 1.0, 3.0], names=("level", "level9"))
    assert [(one.output, one.limit) for one in check_limits(asked, traces).limits] == [
        ("level", "most"),
        ("level9", "most9"),
    ]


def test_what_was_not_measured_is_not_counted():
    asked = config({"low": 0, "high": "most"})
    (trace,) = seen(asked, [0.0, 5.0, 5.5])
    masked = Trace(
        name="t", sample_time=1.0, channels=trace.channels, values=trace.values, usable=np.array([True, False, True])
    )
    (passed,) = check_limits(asked, [masked]).limits
    assert passed.summed == 0.0


def test_numbers_are_no_matter_of_the_traces():
    asked = config({"low": 0, "high": 1})
    assert check_limits(asked, seen(asked, [0.0, 5.0])).sentence is None
