"""Limits that are channels, beside measured traces that pass them or do not."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.composite.composite import Composite
from sysid.composite.fixed_members import with_fixed
from sysid.composite.limit_check import check_limits
from sysid.models import NARX, Limit
from sysid.traces import Channel, Trace
from tests.composite.composites import fixed, member


def tank(limit: Limit, instances: tuple[str, ...] = ("",)) -> Composite:
    """A tank that rises by at most one in a sample."""
    most = fixed("level -> most", gains={"level": {1: 1}}, constant=1, low=-99, high=99, rest=1, instances=instances)
    level = member(
        "pump -> level", 0.0, structure=NARX(input_delays=[0], output_delays=1, neurons=2), instances=instances
    )
    return Composite(members=(level,), fixed=(most,), limits={"level": limit})


def seen(asked: Composite, *levels: list[float], names: tuple[str, ...] = ("level",)) -> list[Trace]:
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
    return with_fixed(asked.fixed, traces)


def test_a_limit_that_the_traces_pass_is_named_with_how_far_and_where():
    asked = tank(Limit(low=0, high="most"))
    traces = seen(asked, [0.0, 1.0, 1.5, 2.5], [0.0, 3.0, 3.0, 5.5], [0.0, 2.0, 1.0, 3.0])
    found = check_limits(asked, traces)
    (passed,) = found.limits
    assert (passed.output, passed.limit, passed.trace) == ("level", "most", "t1")
    assert (passed.most, passed.summed) == pytest.approx((2.0, 3.5))
    assert passed.unit == "cm"
    assert found.traces == 3


def test_a_limit_from_below_is_passed_downwards():
    asked = tank(Limit(low="most", high=100))
    (passed,) = check_limits(asked, seen(asked, [1.0, 2.0, 2.5, 3.5])).limits
    assert (passed.most, passed.summed) == pytest.approx((0.5, 0.5))


def test_limits_that_hold_are_counted():
    asked = tank(Limit(low=0, high="most"))
    found = check_limits(asked, seen(asked, [0.0, 1.0, 2.0]))
    (held,) = found.limits
    assert (found.traces, held.most, held.summed) == (1, 0.0, 0.0)


def test_each_instance_has_its_own():
    asked = tank(Limit(low=0, high="most"), instances=("", "9"))
    traces = seen(asked, [0.0, 1.0, 3.0], names=("level", "level9"))
    assert [(one.output, one.limit) for one in check_limits(asked, traces).limits] == [
        ("level", "most"),
        ("level9", "most9"),
    ]


def test_what_was_not_measured_is_not_counted():
    asked = tank(Limit(low=0, high="most"))
    (trace,) = seen(asked, [0.0, 5.0, 5.5])
    masked = Trace(
        name="t", sample_time=1.0, channels=trace.channels, values=trace.values, usable=np.array([True, False, True])
    )
    (passed,) = check_limits(asked, [masked]).limits
    assert passed.summed == 0.0


def test_numbers_are_no_matter_of_the_traces():
    asked = tank(Limit(low=0, high=1))
    assert check_limits(asked, seen(asked, [0.0, 5.0])).limits == ()
