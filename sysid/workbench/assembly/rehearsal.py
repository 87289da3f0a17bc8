"""Rehearsal: the whole is wired once by members that know nothing, so that what cannot run is said before any fit."""

from __future__ import annotations

import numpy as np

from sysid.composite.fixed_members import known_model
from sysid.composite.members import assembled
from sysid.composite.shared_weights import Everywhere
from sysid.composite.stages import reading_more
from sysid.models import NARX, NARXModel, Scaling, parameter_count
from sysid.traces import Trace
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.member_config import MemberConfig


def rehearse(config: AssemblyConfig, like: Trace) -> None:
    """Wire all members as every stage will.

    Args:
        config: The pipeline.
        like: A trace of the training data, with what the known members say, for units and the sample time.

    Raises:
        ConfigError: If they cannot be wired: in a circle within one sample, for one; or a round cannot be trained
            everywhere.
        ChannelError: If the trace lacks a channel of a member's first place.
    """
    models = {member.mapping.output: _untaught(member, like) for member in config.members}
    models |= {known.mapping.output: known_model(known, like) for known in config.known}
    whole = assembled(config, models)
    for one in (*config.joint, *config.growing):
        whole = reading_more(whole, one.reads)
        if one.everywhere:
            Everywhere.of(config, one, whole)


def _untaught(member: MemberConfig, like: Trace) -> NARXModel:
    """A member with parameters of zero."""
    structure, inputs = member.structure, member.mapping.inputs
    if not isinstance(structure, NARX):
        raise TypeError(f"{member.mapping} is no NARX")  # refused when the YAML was read
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
        output_unit=like.channel(member.mapping.output).unit,
        rest_output=member.rest,
    )
