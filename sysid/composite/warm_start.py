"""Warm start from a trained whole: its networks as they stand, under what is declared now.

Hours of training lie in a frozen whole. Where a switch was declared wrongly, or traces are added, its networks are a
far better beginning than fits from nothing, whatever they read: they are taken as they stand, at each instance with its
own weights (with those of the first where the whole has none there, as a line has one cylinder for all its positions),
and what is declared beside them is the composite's, not theirs.
"""

from __future__ import annotations

from sysid.composite.composite import Composite, Member
from sysid.composite.fixed_members import fixed_model
from sysid.composite.members import network_of, placed, wired
from sysid.composite.parameters import values_in
from sysid.errors import ConfigError
from sysid.models import NARX, Cascade, NARXModel
from sysid.traces import Trace


def started_from(composite: Composite, given: Cascade, like: Trace) -> Cascade:
    """What is declared, with the networks of a given whole.

    Args:
        composite: What is declared.
        given: A whole that has a network for each member in each of its instances, or in the first of them.
        like: A trace of the whole, for units.

    Returns:
        The whole: those networks, and the fixed submodels as they are declared, parameters of the same name as given.

    Raises:
        ConfigError: If a member is not there, is of another kind or reads what nothing here writes.
    """
    networks = [_network(given, member, there) for member in composite.members for there in member.instances]
    known = [(one, fixed_model(one, like, values=values_in(given))) for one in composite.fixed]
    fixed = [placed(one, model, there) for one, model in known for there in one.instances]
    whole = wired(composite, [*networks, *fixed])
    declared = {
        one.channel(name, there) for one in composite.standing for there in one.instances for name in one.mapping.inputs
    }
    for model in networks:
        output = model.mapping.output
        if strangers := [name for name in model.mapping.inputs if name not in {*whole.outputs, *declared}]:
            raise ConfigError(
                f"{output} of the whole to begin from reads {', '.join(strangers)}, which nothing here writes",
                where="begin",
                expected="networks that read what members or the inputs of the whole give them",
                got=str(model.mapping),
                remedy="declare it as a fixed submodel, or fit the whole anew without begin",
            )
    return whole


def _network(given: Cascade, member: Member, instance: str) -> NARXModel:
    """The given network of a member in one of its instances."""
    output, asked = member.channel(member.output, instance), member.structure
    first = member.instances[0]
    at = instance if output in given.outputs else first
    there = member.channel(member.output, at)
    found = network_of(given.member(there)) if there in given.outputs else None
    if found is not None:
        own = found.network
        inputs = {member.channel(name, at) for name in member.mapping.inputs}
        if _said(own) == _said(asked) and inputs <= set(found.mapping.inputs):
            return found if at == instance else placed(member, found, instance)
    raise ConfigError(
        f"the whole to begin from has no such {output}",
        where="begin",
        expected=f"a network {member.mapping} with {_said(asked)}, which may read more",
        got="none" if found is None else f"{found.mapping} with {_said(found.network)}",
        remedy="name a whole that has it, or fit this one anew without begin",
    )


def _said(structure: NARX) -> str:
    return f"{structure.neurons} {'gated ' if structure.gated else ''}{structure.activation} neurons"
