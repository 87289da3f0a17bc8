"""Members: put in their instances, fitted on traces of all of them, left out where others are to be heard."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sysid.composite.fixed_members import fixed_model
from sysid.composite.members import assembled, at_instance, own_traces, simulated_inputs
from sysid.models import Limit
from tests.composite.composites import fixed, models, pipe, trace


def test_a_member_stands_in_all_its_instances():
    whole = assembled(pipe(), models())
    assert set(whole.outputs) == {"BP", "AR", "BP9", "AR9"}
    assert whole.inputs == ("STP",)
    assert whole.member("AR9").mapping.inputs == ("BP9", "STP")
    assert_array_equal(whole.member("AR9").theta, whole.member("AR").theta)
    assert (whole.limits["AR"].high, whole.limits["AR9"].high) == ("BP", "BP9")
    own = assembled(pipe(limits={"AR9": Limit(low=0, high="STP"), "AR": Limit(high="BP")}), models())
    assert (own.limits["AR9"].low, own.limits["AR9"].high) == (0, "STP")


def test_a_limit_may_be_declared_from_what_it_limits_a_sample_ago():
    above = fixed(
        "AR+BP -> AH", gains={"AR": {1: 1}, "BP": 0}, constant=0.4, high=91, rest=91, unit="psi", instances=("", "9")
    )
    declared = pipe(fixed=(above,), limits={"AR": Limit(low=0, high="AH")})
    whole = assembled(declared, models() | {"AH": fixed_model(above, trace())})
    assert (whole.limits["AR"].high, whole.limits["AR9"].high) == ("AH", "AH9")
    run = whole.simulate_trace(trace())
    for name in ("AR", "AR9"):
        assert np.diff(run[name]).max() == pytest.approx(0.4), "it rises no faster than declared"


def test_traces_of_a_member_go_through_its_instances_in_turn():
    member = pipe().members[2]
    first, second, third = own_traces(member, [trace(seed=s) for s in range(3)])
    assert first.channel_names == second.channel_names == ("BP", "STP", "AR")
    assert_array_equal(first["BP"], trace(seed=0)["BP"])
    assert_array_equal(second["BP"], trace(seed=1)["BP9"])
    assert_array_equal(second["STP"], trace(seed=1)["STP"])
    assert_array_equal(third["AR"], trace(seed=2)["AR"])
    assert_array_equal(at_instance(member, trace(), "9")["AR"], trace()["AR9"])
    weights = np.linspace(0.0, 1.0, len(first))
    assert_array_equal(at_instance(member, replace(trace(), weights=weights), "9").weights, weights)


def test_who_reads_a_member_that_is_left_out_reads_what_was_measured():
    others = assembled(pipe(), models(), without="BP")
    assert others.inputs == ("STP", "BP")
    assert others.limits["AR"].high == "BP"
    (changed,) = simulated_inputs(others, [trace()])
    assert_array_equal(changed["BP"], trace()["BP"])
    assert_allclose(changed["BP9"], others.simulate_trace(trace())["BP9"])
