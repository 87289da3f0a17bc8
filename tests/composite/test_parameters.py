"""What is estimated in equations of a whole: found again with its interval, and one value wherever it acts."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sysid.composite import (
    Composite,
    FixedMember,
    RoundPlan,
    TrainedComposite,
    TrainingData,
    TrainingPlan,
    fixed_by_equations,
    started_from,
    train,
    train_round,
)
from sysid.composite.parameters import trained_equations, values_in
from sysid.errors import ConfigError
from sysid.estimation import CascadeFit, JointTraining
from sysid.models import NARX, Limit, Mapping
from sysid.traces import Trace
from tests.composite.composites import SHORT, member, tank_trace

FLOW = "flow = k*sqrt(max(upper[k-1] - share*lower[k-1], 0))\nupper = upper[k-1] + 0.1*pump - flow"
KNOWN = {"k": {"start": 0.1, "low": 0, "unit": "cm^0.5/s"}, "share": {"start": 0.1, "low": 0, "high": 1}}
TRUTH = {"k": 0.15, "share": 0.3}
LOWER = member("flow -> lower", 0.0, structure=NARX(input_delays=[0], output_delays=1, neurons=0), training=SHORT)


def plan(**changes) -> TrainingPlan:
    training = JointTraining(max_iterations=12, checkpoints=2, workers=1)
    asked = {"targets": {"upper": 0.01, "lower": 0.01}, "training": training}
    return TrainingPlan(outputs=("upper", "lower"), rounds=(RoundPlan(**asked | changes),))


def tanks(**changes) -> Composite:
    fixed = fixed_by_equations(FLOW, parameters=KNOWN, unit="cm")
    return Composite(**{"members": (LOWER,), "fixed": fixed} | changes)


def noisy(seed: int) -> Trace:
    found = tank_trace(seed)
    values = found.values.copy()
    values[:, 1:] += 0.01 * np.random.default_rng(seed).standard_normal((len(values), 2))
    return replace(found, values=values)


def trained(seed: int = 0, composite: Composite | None = None, asked: TrainingPlan | None = None) -> TrainedComposite:
    data = TrainingData(estimation=[noisy(seed), noisy(seed + 1)], selection=[noisy(seed + 2)])
    return train(composite or tanks(), asked or plan(), data)


@pytest.fixture(scope="module")
def found() -> TrainedComposite:
    return trained()


def test_the_truth_is_within_the_intervals(found):
    for one in (found, trained(10), trained(20)):
        (fit,) = (round_.fit for round_ in one.rounds)
        assert fit.uncertainty.names == ("k [cm^0.5/s]", "share")
        assert_allclose(fit.uncertainty.values, list(one.parameters.values()), rtol=1e-12)
        truth, wide = np.array(list(TRUTH.values())), fit.uncertainty.standard_deviations
        assert (abs(fit.uncertainty.values - truth) < 3.0 * wide).all()
        assert (wide < 0.01 * truth).all()


def test_it_is_told_and_survives_storing(found):
    (fit,) = (one.fit for one in found.rounds)
    assert any(f"share = {found.parameters['share']:.5g} ±" in note for note in found.notes)
    again = CascadeFit.from_dict(json.loads(json.dumps(fit.to_dict())))
    assert again.told_of_equations == fit.told_of_equations
    assert values_in(again.model) == found.parameters
    kept = replace(fit, uncertainty=None, warnings=("The start was kept.",))
    assert CascadeFit.from_dict(json.loads(json.dumps(kept.to_dict()))).told_of_equations == kept.warnings


def test_a_bound_that_binds_and_a_prior_are_as_in_a_grey_box():
    known = {"k": {"start": 0.1, "low": 0, "high": 0.12}, "share": {"start": 0.25, "prior": 1e-6}}
    one = trained(composite=tanks(fixed=fixed_by_equations(FLOW, parameters=known, unit="cm")))
    assert one.parameters["k"] == 0.12
    assert one.parameters["share"] == pytest.approx(0.25, abs=1e-5)
    assert any("k stands at its bound" in note for note in one.notes)


def test_a_parameter_is_one_in_equations_and_limits_and_where_a_round_does_not_look():
    """The first round trains by the flow alone: what else has its parameter has the value that it found."""
    composite = tanks(limits={"lower": Limit(high="9 + share*lower[k-1]")})
    start = trained(composite=composite).model
    moved = {one.mapping.output: one.parameters for one in start.models if one.mapping.output in {"flow", "lower high"}}
    assert moved["flow"]["share"] == moved["lower high"]["share"] != 0.1
    alone = plan(targets={"upper": 0.01}, measured=("lower",), members=("flow",)).rounds[0]
    seen = TrainingData(estimation=[noisy(5)], selection=[noisy(6)]).with_fixed(composite)
    fit = train_round(composite, alone, start, estimation=seen.estimation, selection=seen.selection)
    assert fit.model.member("lower high").parameters["share"] == fit.model.member("flow").parameters["share"]
    assert fit.model.member("flow").parameters != start.member("flow").parameters


def test_a_limit_may_be_a_parameter():
    """Water runs over the upper edge of the lower tank, whose height is not known."""
    edge = 1.3
    over = [replace(one, values=np.minimum(one.values, [np.inf, np.inf, edge])) for one in map(noisy, range(3))]
    members = [replace(LOWER, mapping=Mapping.parse(one)) for one in ("pump -> upper", "upper -> lower")]
    composite = Composite(
        members=members, limits={"lower": Limit(high="edge")}, parameters={"edge": {"start": 1, "low": 0}}
    )
    assert [str(one.mapping) for one in composite.fixed] == ["lower -> lower high"]
    data = TrainingData(estimation=over[:2], selection=over[2:])
    found = train(composite, plan(), data)
    assert found.parameters["edge"] == pytest.approx(edge, abs=0.02)


def test_a_whole_to_begin_from_gives_its_values_and_the_prior_stays_as_declared(found):
    (like,) = TrainingData(estimation=[noisy(0)], selection=[noisy(1)]).with_fixed(tanks()).estimation
    begun = started_from(tanks(), found.model, like)
    assert values_in(begun) == found.parameters
    assert begun.member("flow").grey.free[0].start == 0.1
    narrow = tanks(fixed=fixed_by_equations(FLOW, parameters=KNOWN | {"share": {"start": 0.1, "high": 0.2}}, unit="cm"))
    assert values_in(started_from(narrow, found.model, like))["share"] == 0.2


def test_equations_that_share_a_parameter_are_trained_together():
    fixed = fixed_by_equations("a = p*u; b = p*q*u; c = q*u; d = r*u; e = 2*u", parameters=dict.fromkeys("pqr", 1.0))
    assert [one.output for one in trained_equations(fixed, None)] == ["a", "b", "c", "d"]
    assert [one.output for one in trained_equations(fixed, ["a"])] == ["a", "b", "c"]
    assert [one.output for one in trained_equations(fixed, ["d", "e"])] == ["d"]


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"parameters": {"loose": 1.0}}, "nothing reads the parameter loose"),
        ({"parameters": {"k": 1.0}}, "k is declared in two ways"),
        ({"limits": {"lower": Limit(high="flow*upper")}, "parameters": {"flow": 1.0}},
         "flow is a parameter and a channel"),
    ],
)  # fmt: skip
def test_parameters_that_cannot_be_are_refused(changes, says):
    with pytest.raises(ConfigError, match=says):
        tanks(**changes)


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        (plan(members=("lower",)), "no round estimates the parameter k"),
        (plan(targets={"lower": 0.01}, measured=("flow",)), "no round estimates the parameter k"),
        (TrainingPlan(outputs=("lower",)), "no round estimates the parameter k"),
        (plan(members=("lower", "flow"), share_weights=True), "shares weights estimates no parameters"),
    ],
)
def test_a_plan_that_leaves_them_where_they_start_is_refused(asked, says):
    with pytest.raises(ConfigError, match=says):
        trained(asked=asked)


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"equation": "where(u > p, 1, 0)", "parameters": {"p": 1}}, "nothing moves with p, which only decides"),
        ({"equation": "p*u", "parameters": {"p": {"start": 1, "per": "case"}}}, "a value per case"),
        ({"gains": {"u": 1}, "parameters": {"p": 1}}, "the gains of u -> y are not those of its inputs"),
        ({"equation": "2*u", "parameters": {"p": 1}}, "p"),
    ],
)
def test_equations_that_cannot_have_them_are_refused(fields, says):
    with pytest.raises(ConfigError, match=says):
        FixedMember(mapping=Mapping.parse("u -> y"), rest=0.0, **fields)
