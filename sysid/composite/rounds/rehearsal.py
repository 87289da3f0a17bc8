"""Rehearsal: the whole is wired once by members that know nothing, so that what cannot run is said before any fit."""

from __future__ import annotations

import numpy as np

from sysid.composite.composite import Composite, Member
from sysid.composite.fixed_members import fixed_model
from sysid.composite.members import Members, assembled
from sysid.composite.parameters import trained_equations
from sysid.composite.plan import RoundPlan, TrainingPlan
from sysid.composite.rounds.shared_weights import SharedWeights
from sysid.composite.stages import reading_more
from sysid.errors import ConfigError
from sysid.models import Cascade, NARXModel, Scaling, parameter_count
from sysid.traces import Trace


def rehearse(composite: Composite, plan: TrainingPlan, like: Trace) -> None:
    """Wire all members as every stage will.

    Args:
        composite: What is declared.
        plan: The stages.
        like: A trace of the training data, with what the fixed submodels say, for units and the sample time.

    Raises:
        ConfigError: If they cannot be wired: in a circle within one sample, for one; or a stage names what no member
            writes; or a round cannot share weights.
        ChannelError: If the trace lacks a channel of a member's first instance.
    """
    networks = {member.output: untaught(member, like) for member in composite.members}
    models: Members = {**networks} | {fixed.output: fixed_model(fixed, like) for fixed in composite.fixed}
    whole = assembled(composite, models)
    for output in plan.retrain.members if plan.retrain else ():
        composite.member(output)
    asked = plan.active_learning.outputs if plan.active_learning else ()
    _check_known(whole.outputs, "outputs", (*plan.outputs, *asked))
    for one in plan.all_rounds:
        _check_names(composite, one, whole.outputs)
        whole = reading_more(whole, one.reads)
        if one.share_weights:
            SharedWeights.of(composite, one, whole)
    _check_estimated(composite, plan, whole)


def _check_names(composite: Composite, asked: RoundPlan, outputs: tuple[str, ...]) -> None:
    """Refuse a round that names what nothing writes."""
    free = [one.output for one in composite.fixed if one.free]
    for name in asked.members or ():
        if name not in free:
            composite.member(name)
    _check_known(outputs, "targets", tuple(asked.targets))
    _check_known(outputs, "measured", asked.measured)
    _check_known(outputs, "reads", tuple(name for output, more in asked.reads.items() for name in (output, *more)))


def _check_estimated(composite: Composite, plan: TrainingPlan, whole: Cascade) -> None:
    """Refuse parameters that would stay where they start."""
    trained = {
        parameter.name
        for one in plan.rounds
        if not one.share_weights
        for moved in (whole.upstream_of(one.targets, given=one.measured).outputs if composite.free else (),)
        for equation in trained_equations(composite.fixed, one.members or None)
        if not set(equation.outputs).isdisjoint(moved)
        for parameter in equation.free
    }
    if left := [name for name in composite.free if name not in trained]:
        raise ConfigError(
            f"no round estimates the parameter {left[0]}",
            where=f"parameters, {left[0]}",
            expected="a round of training end to end with a target that depends on it, and no members, or the output "
            "of its equation among them",
            got=f"{len(plan.rounds)} rounds",
            remedy="add such a round, or write fixed: true",
        )


def _check_known(outputs: tuple[str, ...], where: str, names: tuple[str, ...]) -> None:
    if strangers := [name for name in names if name not in outputs]:
        raise ConfigError(
            f"{where} names {', '.join(strangers)}, which no member writes",
            where=where,
            expected=f"some of {', '.join(outputs)}",
            got=", ".join(names),
            remedy="correct the name, or add a member",
        )


def untaught(member: Member, like: Trace) -> NARXModel:
    """A member with parameters of zero.

    Args:
        member: The member.
        like: A trace of the training data, for units and the sample time.

    Returns:
        Its model.
    """
    structure, inputs = member.structure, member.mapping.inputs
    count = parameter_count(
        structure.lags(len(inputs)), structure.neurons, linear=structure.feedthrough, gated=structure.gated
    )
    return NARXModel(
        network=structure,
        theta=np.zeros(count),
        scaling=Scaling.identity(len(inputs)),
        mapping=member.mapping,
        sample_time=like.sample_time,
        input_units=tuple(like.channel(name).unit for name in inputs),
        output_unit=like.channel(member.output).unit,
        rest_output=member.rest,
    )
