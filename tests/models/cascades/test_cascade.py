"""Cascades: wired by name, run as one, started from rest, held by limits."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sysid.errors import ChannelError, ConfigError, TraceError
from sysid.kernels import cascade as kernel
from sysid.models import (
    Cascade,
    History,
    Limit,
    Mapping,
    cascade_from_dict,
)
from sysid.testing import simulate_cascade
from sysid.traces import Channel, Trace
from tests.models.cascades.cascades import CASCADES, block, command, lag, linear, network, service


@pytest.mark.parametrize("cascade", CASCADES.values(), ids=CASCADES)
def test_the_compiled_pass_equals_the_slow_twin(cascade):
    inputs = command(inputs=len(cascade.inputs))
    expected, run = simulate_cascade(cascade, inputs), cascade.simulate(inputs)
    for name in cascade.outputs:
        assert_allclose(run[name], expected[name], rtol=0.0, atol=1e-9, err_msg=name)
        assert np.ptp(run[name]) > 0.01, "a signal that does not move proves nothing"


def test_the_whole_is_its_members_one_after_the_other():
    cascade, u = service(), command()
    run = cascade.simulate(u)
    known = {"STP": u[:, 0]}
    rest = {"STP": u[0, 0], "BP": u[0, 0], "AR": u[0, 0], "BC": 0.0}
    for model in cascade.models:
        names = model.mapping.inputs
        history = History.at_rest(inputs=[rest[name] for name in names], output=rest[model.mapping.output])
        known[model.mapping.output] = model.simulate(np.column_stack([known[name] for name in names]), history)
        assert_allclose(run[model.mapping.output], known[model.mapping.output], rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("seed", range(4))
def test_the_order_of_declaration_does_not_matter(seed):
    cascade, u = CASCADES["the emergency reservoir too"], command()
    models = list(cascade.models)
    np.random.default_rng(seed).shuffle(models)
    shuffled = Cascade(models=models)
    for name in cascade.outputs:
        assert_array_equal(shuffled.simulate(u)[name], cascade.simulate(u)[name])


def test_a_member_reads_the_upstream_output_of_the_same_sample():
    direct = replace(linear("BP -> BC"), coefficients=np.array([1.0, 0.0, 0.0, 0.0]))
    run = Cascade(models=(direct, linear("STP -> BP"))).simulate(command())
    assert_array_equal(run["BC"], run["BP"])


@pytest.mark.parametrize(
    ("models", "match"),
    [
        pytest.param([], "there is no model", id="none"),
        pytest.param([linear("STP -> BP"), linear("AR -> BP")], "BP is computed twice", id="one channel twice"),
        pytest.param([linear("STP -> BP"), block("STP -> AR+BP")], "BP is computed twice", id="twice, one of several"),
        pytest.param(
            [linear("STP+BC -> BP"), linear("BP -> AR"), linear("AR -> BC")],
            "a circle: .* needs ",
            id="circle",
        ),
        pytest.param(
            [linear("STP -> BP"), replace(linear("BP -> AR"), sample_time=0.2)], "times differ", id="sample times"
        ),
        pytest.param(
            [linear("STP -> BP"), replace(linear("BP -> AR"), input_units=("kPa",))], "in psi and in kPa", id="units"
        ),
    ],
)  # fmt: skip
def test_wiring_that_cannot_run_is_refused(models, match):
    with pytest.raises(ConfigError, match=match):
        Cascade(models=models)


def test_a_circle_is_named_by_its_members():
    models = [linear("STP -> BP"), linear("BP+BC -> AR"), linear("AR -> BC")]
    with pytest.raises(ConfigError, match=r"a circle: (AR needs BC, BC needs AR|BC needs AR, AR needs BC)"):
        Cascade(models=models)


def test_a_limit_is_computed_before_what_it_limits():
    cascade = CASCADES["a limit made of what it limits, a sample ago"]
    assert cascade.outputs == ("BP", "x", "AR", "BC")
    run = cascade.simulate(command())
    assert np.diff(run["AR"]).max() == pytest.approx(0.4), "AR rises no faster than declared"
    assert run.activity["AR"].high > 5


def test_a_limit_that_needs_what_it_limits_at_the_same_sample_is_refused():
    with pytest.raises(ConfigError, match=r"a circle: (AR needs BP, BP needs AR|BP needs AR, AR needs BP)"):
        replace(service(), limits={"BP": Limit(high="AR")})
    with pytest.raises(ChannelError, match="missing channel BP"):
        replace(service(), limits={"BP": Limit(high="BP")})


def test_limits_that_are_whole_numbers_run_what_is_compiled_already():
    """For another type of number it would all be compiled once more, in ten seconds and more."""
    runs, compiled = [], []
    for limits in ({"BP": Limit(low=0.0, high=50.0)}, {"BP": Limit(low=0, high=50)}):
        runs.append(Cascade(models=service().models[:1], limits=limits).simulate(command()).values)
        compiled.append(len(kernel.run.signatures))
    assert compiled[0] == compiled[1]
    assert_array_equal(runs[0], runs[1])


def test_an_output_may_limit_the_next_one_of_its_model_and_not_the_one_before():
    cascade = CASCADES["a network of several outputs"]
    run = replace(cascade, limits={"ER": Limit(high="AR")}).simulate(command())
    assert np.all(run["ER"] <= run["AR"])
    assert run.activity["ER"].high > 5
    with pytest.raises(ChannelError, match="missing channel ER"):
        replace(cascade, limits={"AR": Limit(high="ER")})


@pytest.mark.parametrize(
    ("fields", "match"),
    [
        pytest.param({"rest": {"XX": 1.0}}, "missing channel XX", id="rest of a stranger"),
        pytest.param({"rest": {"AR": "XX"}}, "missing channel XX", id="rest at the level of a stranger"),
        pytest.param({"rest": {"STP": "BP"}}, "missing channel BP", id="an input at the level of an output"),
        pytest.param({"limits": {"STP": Limit(low=0.0)}}, "missing channel STP", id="limits of an input"),
        pytest.param({"limits": {"BP": Limit(high="XX")}}, "missing channel XX", id="limit that is a stranger"),
    ],
)
def test_levels_and_limits_must_name_channels_that_are_known(fields, match):
    with pytest.raises(ChannelError, match=match):
        replace(service(), **fields)


class TestRest:
    """Where a run begins."""

    def test_inputs_stand_at_their_first_sample_and_outputs_at_their_levels(self):
        cascade = service()
        assert cascade.levels(np.array([85.0])).tolist() == [85.0, 85.0, 85.0, 0.0]

    def test_a_run_may_begin_elsewhere(self):
        cascade, u = service(), command()
        elsewhere = cascade.simulate(u, rest={"AR": 70.0, "STP": 80.0})
        declared = replace(cascade, rest={"BP": "STP", "AR": 70.0, "STP": 80.0})
        assert_array_equal(elsewhere.values, declared.simulate(u).values)
        # The reservoir is charged at the handle's first position, not at where it stood before.
        assert declared.levels(u[0]).tolist() == [80.0, u[0, 0], 70.0, 0.0]

    def test_an_output_may_have_the_level_of_another_wherever_that_begins(self):
        follows = replace(service(), rest={"BP": "STP", "AR": "BP", "BC": "AR"})
        u = command()
        assert follows.levels(u[0]).tolist() == [u[0, 0]] * 4
        assert follows.levels(u[0], {"BP": 70.0}).tolist() == [u[0, 0], 70.0, 70.0, 70.0]
        assert follows.levels(u[0], {"BP": 70.0, "AR": 60.0}).tolist() == [u[0, 0], 70.0, 60.0, 60.0]
        part = follows.upstream_of(["AR"], given=["BP"])
        assert part.rest == {"AR": "BP"} and part.levels(np.array([65.0])).tolist() == [65.0, 65.0]
        with pytest.raises(ConfigError, match="follow each other in a circle"):
            replace(service(), rest={"BP": "AR", "AR": "BC", "BC": "BP"})

    def test_a_part_without_the_output_that_one_follows_begins_at_the_same_level(self):
        beside = Cascade(models=(linear("STP -> BP"), linear("STP -> AR")), rest={"BP": 12.0, "AR": "BP"})
        assert beside.upstream_of(["AR"]).rest == {"AR": 12.0}

    def test_nothing_is_taken_from_a_measured_output(self):
        cascade, u = service(), command()
        names = ("STP", "BP", "AR", "BC")
        values = np.column_stack([u, np.full((len(u), 3), 1e3)])
        trace = Trace(
            name="a", sample_time=0.1, channels=tuple(Channel(name=n, unit="psi") for n in names), values=values
        )
        assert_array_equal(cascade.simulate_trace(trace).values, cascade.simulate(u).values)


class TestLimits:
    """Outputs held between declared values, and counted."""

    def test_they_hold_and_are_counted(self):
        cascade, u = CASCADES["limits"], command()
        run = cascade.simulate(u)
        assert run["BC"].min() >= 0.0
        assert np.all(run["BC"] <= run["BP"])
        assert np.all(run["AR"] <= run["BP"])
        assert 70.0 <= run["BP"].min() <= run["BP"].max() <= 82.0
        activity = run.activity
        assert activity["AR"].high == np.count_nonzero(run["AR"] == run["BP"]) > 0
        assert activity["BP"].low == np.count_nonzero(run["BP"] == 70.0)
        assert activity["BP"].high == np.count_nonzero(run["BP"] == 82.0)
        assert activity["BP"].low + activity["BP"].high > 0
        assert "limit" in activity["AR"].sentence

    def test_without_them_nothing_is_held(self):
        activity = service().simulate(command()).activity
        assert {(a.low, a.high, a.lost) for a in activity.values()} == {(0, 0, 0)}
        assert activity["BC"].sentence == "never held"

    def test_a_network_that_leaves_its_range_is_counted_as_lost(self):
        wild = network("STP -> BP", seed=1)
        wild = replace(wild, theta=20.0 * np.abs(wild.theta))
        activity = Cascade(models=(wild,)).simulate(command()).activity["BP"]
        assert activity.lost > 0.9 * activity.samples
        assert "network's bound" in activity.sentence

    def test_a_model_with_a_state_of_its_own_is_held_alike(self):
        run = Cascade(models=(lag("STP -> BP"),), limits={"BP": Limit(low=72.0, high="STP")}).simulate(command())
        free = Cascade(models=(lag("STP -> BP"),)).simulate(command())
        assert_allclose(run["BP"], np.maximum(np.minimum(free["BP"], free["STP"]), 72.0), rtol=0.0, atol=1e-12)
        assert run.activity["BP"].low == np.count_nonzero(run["BP"] == 72.0) > 0
        assert run.activity["BP"].high == np.count_nonzero((free["BP"] > free["STP"]) & (free["STP"] >= 72.0)) > 0


def test_a_circle_through_the_past_runs_in_the_order_of_what_is_read_now():
    cascade = CASCADES["a circle through the past"]
    assert cascade.inputs == ("STP",)
    assert cascade.outputs == ("BP", "AR", "BC")


def test_a_model_with_a_state_of_its_own_beside_a_circle_is_refused():
    circle = CASCADES["a circle through the past"].models
    with pytest.raises(ConfigError, match="read lagged samples"):
        Cascade(models=(*circle, lag("BP -> ER")))


def test_a_model_with_a_state_of_its_own_is_wired_like_any_other():
    models = (network("BP+AR -> BC", seed=5), lag("BP -> AR"), network("STP -> BP", seed=1))
    u = command()
    run = Cascade(models=models, rest={"BP": "STP"}).simulate(u)
    bp = models[2].simulate(u, History.at_rest(inputs=u[0], output=u[0, 0]))
    ar = models[1].simulate(bp[:, np.newaxis], History.at_rest(inputs=[u[0, 0]], output=90.0))
    at_rest = History.at_rest(inputs=[u[0, 0], 90.0], output=0.0)
    bc = models[0].simulate(np.column_stack([bp, ar]), at_rest)
    assert_allclose(run["BC"], bc, rtol=0.0, atol=1e-10)
    assert np.ptp(run["AR"]) > 1.0


@pytest.mark.parametrize("cascade", CASCADES.values(), ids=CASCADES)
def test_a_stored_cascade_is_the_cascade(cascade):
    again = cascade_from_dict(json.loads(json.dumps(cascade.to_dict())))
    inputs = command(inputs=len(cascade.inputs))
    assert_array_equal(again.simulate(inputs).values, cascade.simulate(inputs).values)
    assert again.label == cascade.label


@pytest.mark.parametrize(
    "fields", [pytest.param({"structure": {"kind": "NARX"}}, id="a model"), pytest.param({}, id="nothing")]
)
def test_what_is_no_cascade_is_refused(fields):
    with pytest.raises(ConfigError, match="not a stored cascade"):
        cascade_from_dict(fields)


def test_a_run_says_which_channels_it_has():
    run = service().simulate(command())
    assert "BC" in run and "STP" in run
    assert "XX" not in run


def test_members_are_found_and_replaced_by_their_outputs():
    cascade = service()
    other = network("BP -> AR", seed=9)
    replaced = cascade.with_member(other)
    assert replaced.member("AR") is other
    assert replaced.member("BC") is cascade.member("BC")
    with pytest.raises(ChannelError, match="missing channel XX"):
        cascade.member("XX")
    with pytest.raises(ConfigError, match="no member to replace"):
        cascade.with_member(network("BP -> ER"))


def test_the_part_that_an_output_depends_on_runs_as_in_the_whole():
    cascade = Cascade(
        models=(linear("STP -> BP"), network("BP -> AR"), network("BP+AR -> BC"), linear("AR -> ER")),
        rest={"BP": "STP"},
        limits={"BC": Limit(low=0.0, high=40.0), "ER": Limit(low=0.0)},
    )
    part = cascade.upstream_of(["BC"])
    assert set(part.outputs) == {"BP", "AR", "BC"}
    assert part.rest == {"BP": "STP"} and set(part.limits) == {"BC"}
    run = cascade.simulate(command())
    for name in part.outputs:
        assert_array_equal(part.simulate(command())[name], run[name])
    behind = cascade.upstream_of(["BC"], given=["AR"])
    assert set(behind.outputs) == {"BP", "BC"}
    assert set(behind.inputs) == {"STP", "AR"}


def test_a_channel_that_holds_an_output_belongs_to_its_part():
    cascade = Cascade(
        models=(linear("STP -> BP"), linear("STP -> AR"), network("BP -> BC")), limits={"BC": Limit(high="AR")}
    )
    assert set(cascade.upstream_of(["BC"]).outputs) == {"BP", "AR", "BC"}


@pytest.mark.parametrize("shape", [(5, 2), (5, 1, 1), (0, 1)], ids=str)
def test_inputs_of_the_wrong_shape_are_refused(shape):
    with pytest.raises(TraceError, match="inputs do not fit the cascade"):
        service().simulate(np.zeros(shape))


@pytest.mark.parametrize(("sample_time", "unit", "said"), [(0.2, "psi", "sample time"), (0.1, "kPa", "unit")])
def test_a_trace_whose_numbers_mean_something_else_is_refused(sample_time, unit, said):
    channels = (Channel(name="STP", unit=unit),)
    trace = Trace(name="a", sample_time=sample_time, channels=channels, values=command())
    with pytest.raises(ConfigError, match=f"another {said}"):
        service().simulate_trace(trace)


@pytest.mark.parametrize("text", ["STP", "STP -> BP+STP", "STP -> "], ids=str)
def test_mappings_that_cannot_be_are_refused(text):
    with pytest.raises(ConfigError, match="not a mapping"):
        Mapping.parse(text)


def test_a_run_becomes_a_trace():
    run = service().simulate(command())
    trace = run.trace("a")
    assert trace.channel_names == ("STP", "BP", "AR", "BC")
    assert_array_equal(trace["BC"], run["BC"])
    with pytest.raises(ChannelError, match="missing channel XX"):
        run["XX"]
