"""A whole to go on from: networks that are trained already, under what is declared now.

Hours of training lie in a frozen whole. Where a switch was declared wrongly, or traces are added, its networks are a
far better beginning than fits from nothing, whatever they read: they are taken as they stand, at each place with its
own weights, and what is declared beside them is the pipeline's, not theirs.
"""

from __future__ import annotations

from pathlib import Path

from sysid.composite.fixed_members import known_model
from sysid.composite.members import placed, placed_name, wired
from sysid.errors import ConfigError
from sysid.models import NARX, Cascade, NARXModel
from sysid.traces import Trace
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.member_config import MemberConfig


def read_whole(bundle: Path) -> tuple[Cascade, str]:
    """The whole of a bundle.

    Args:
        bundle: Its folder or its zip, as a run of an assembly leaves it, or ``sysid publish`` beside a report.

    Returns:
        The whole, and a sentence on where it comes from.

    Raises:
        BundleError: If the bundle is damaged or lacking.
        ConfigError: If it is no assembly's.
    """
    from sysid.export import read_bundle

    read = read_bundle(bundle)
    if not isinstance(read.model, Cascade):
        raise ConfigError(
            "there is no whole to begin from",
            where=bundle,
            expected="the bundle of an assembly",
            got=f"one model, {read.model.mapping}",
            remedy="name the bundle of a run of kind assembly",
        )
    command = (read.metadata.get("provenance") or {}).get("command", "an unknown command")
    digest = str(read.metadata["digest"])[:12]
    return read.model, f"Begun from the networks of {bundle.name} ({command}; digest {digest}...)."


def begun(config: AssemblyConfig, given: Cascade, like: Trace) -> Cascade:
    """The pipeline's whole with the networks of a given one.

    Args:
        config: The pipeline.
        given: A whole that has a network for each member in each of its places.
        like: A trace of the whole, for units.

    Returns:
        The whole: those networks, and the known members as the pipeline declares them.

    Raises:
        ConfigError: If a member is not there, is of another kind or reads what nothing here writes.
    """
    networks = [_network(given, member, place) for member in config.members for place in member.places]
    known = [placed(one, known_model(one, like), place) for one in config.known for place in one.places]
    whole = wired(config, [*networks, *known])
    declared = {
        placed_name(one, name, place) for one in config.standing for place in one.places for name in one.mapping.inputs
    }
    for model in networks:
        output = model.mapping.output
        if strangers := [name for name in model.mapping.inputs if name not in {*whole.outputs, *declared}]:
            raise ConfigError(
                f"{output} of the whole to begin from reads {', '.join(strangers)}, which nothing here writes",
                where="begin",
                expected="networks that read what members or the inputs of the pipeline give them",
                got=str(model.mapping),
                remedy="declare it under known, or fit the whole anew without begin",
            )
    return whole


def _network(given: Cascade, member: MemberConfig, place: str) -> NARXModel:
    """The given network of a member in one of its places."""
    output = placed_name(member, member.mapping.output, place)
    found = given.member(output) if output in given.outputs else None
    asked = member.structure
    if isinstance(found, NARXModel) and isinstance(asked, NARX):
        own = found.network
        inputs = {placed_name(member, name, place) for name in member.mapping.inputs}
        if (own.neurons, own.gated) == (asked.neurons, asked.gated) and inputs <= set(found.mapping.inputs):
            return found
    raise ConfigError(
        f"the whole to begin from has no such {output}",
        where="begin",
        expected=f"a network {member.mapping} with {_said(asked)}, which may read more",
        got="none" if not isinstance(found, NARXModel) else f"{found.mapping} with {_said(found.network)}",
        remedy="name a whole that has it, or fit this one anew without begin",
    )


def _said(structure: object) -> str:
    if not isinstance(structure, NARX):
        return "no neurons"
    return f"{structure.neurons} {'gated ' if structure.gated else ''}neurons"
