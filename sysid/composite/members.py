"""Members: where each stands, on which traces it is fitted, and how it is put in its places."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from collections.abc import Mapping as Dict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import zip_longest
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sysid.models import Cascade, Ends, Limit, Mapping, NARXModel
from sysid.traces import Trace
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.member_config import KnownConfig, MemberConfig, StandingConfig

_T = TypeVar("_T")

Members = dict[str, NARXModel]
"""The members by the output of their first place, the known ones among them."""


def placed_name(member: StandingConfig, channel: str, place: str) -> str:
    """Name of a member's channel in one of its places.

    Args:
        member: The member.
        channel: The channel in the first place.
        place: The place's suffix.

    Returns:
        The channel there.
    """
    return channel if channel in member.shared else f"{channel}{place}"


def placed_outputs(member: StandingConfig) -> list[str]:
    """What a member writes, place after place.

    Args:
        member: The member.

    Returns:
        As many channels as it has places.
    """
    return [placed_name(member, member.mapping.output, place) for place in member.places]


def bounds_of(known: Sequence[KnownConfig]) -> dict[str, Limit]:
    """Between what the known members are held.

    Args:
        known: The known members.

    Returns:
        The limit of each of their outputs, in all their places.
    """
    return {name: Limit(low=one.low, high=one.high) for one in known for name in placed_outputs(one)}


def placed(member: StandingConfig, model: NARXModel, place: str) -> NARXModel:
    """A member's model in one of its places.

    Args:
        member: The member.
        model: Its model, in the first place's names.
        place: The place's suffix.

    Returns:
        The same model over that place's channels.
    """
    # The model's, not the member's: it may read more than it was fitted with (reads).
    inputs = tuple(placed_name(member, name, place) for name in model.mapping.inputs)
    return replace(model, mapping=Mapping(inputs=inputs, output=placed_name(member, member.mapping.output, place)))


def assembled(config: AssemblyConfig, models: Members, *, without: str | None = None) -> Cascade:
    """All members in all their places, wired.

    Args:
        config: The pipeline.
        models: Their models.
        without: Output of a member that is left out: whoever reads it then reads what was measured.

    Returns:
        The cascade.

    Raises:
        ConfigError: If they cannot be wired.
    """
    standing = (member for member in config.standing if member.mapping.output != without)
    return wired(config, [placed(one, models[one.mapping.output], place) for one in standing for place in one.places])


def wired(config: AssemblyConfig, models: Sequence[NARXModel]) -> Cascade:
    """Models in their places as one, at rest and between limits as declared.

    Args:
        config: The pipeline.
        models: Over the channels of their places.

    Returns:
        The cascade.

    Raises:
        ConfigError: If they cannot be wired.
    """
    outputs = {model.mapping.output for model in models}
    read = {name for model in models for name in model.mapping.inputs}
    rest = {name: level for name, level in config.rest.items() if name in outputs | read}
    limits = {name: limit for name, limit in limits_of(config).items() if name in outputs}
    return Cascade(models=tuple(models), rest=rest, limits=limits | bounds_of(config.known))


def limits_of(config: AssemblyConfig) -> dict[str, Limit]:
    """Between what the members are held: in each place as that is declared, or else as in the first.

    Args:
        config: The pipeline.

    Returns:
        The limit of each output that has one; a limit that is a channel is the one at the same place.
    """
    found = {}
    for member in config.members:
        for place, name in zip(member.places, placed_outputs(member), strict=True):
            asked = config.limits.get(name)
            if asked is not None:
                found[name] = Limit(low=asked.low, high=asked.high)
            elif (first := config.limits.get(member.mapping.output)) is not None:
                low, high = (
                    placed_name(member, one, place) if isinstance(one, str) else one for one in (first.low, first.high)
                )
                found[name] = Limit(low=low, high=high)
    return found


def dealt(sets: Sequence[Sequence[_T]]) -> list[_T]:
    """Traces of several data sets in one row: one of each in turn, while it has any.

    Args:
        sets: The traces of each data set.

    Returns:
        All of them.

    Example:
        >>> dealt([["a", "b", "c"], ["d"]])
        ['a', 'd', 'b', 'c']
    """
    return [trace for turn in zip_longest(*sets) for trace in turn if trace is not None]


def own_traces(member: MemberConfig, traces: Sequence[Trace]) -> list[Trace]:
    """What a member is fitted on: trace after trace, each in one of its places in turn.

    Args:
        member: The member.
        traces: Traces of the whole.

    Returns:
        As many traces, with the member's channels under the names of its first place.
    """
    return [in_place(member, trace, member.places[i % len(member.places)]) for i, trace in enumerate(traces)]


def in_place(member: MemberConfig, trace: Trace, place: str) -> Trace:
    """A trace as a member sees it in one of its places.

    Args:
        member: The member.
        trace: A trace of the whole.
        place: The place's suffix.

    Returns:
        Its channels under the names of the first place.
    """
    names = (*member.mapping.inputs, member.mapping.output)
    return seen_from(place, trace, {name: placed_name(member, name, place) for name in names})


def seen_from(place: str, trace: Trace, names: Dict[str, str]) -> Trace:
    """A trace with the channels of one place under other names.

    Args:
        place: The place's suffix, which the trace's name gets.
        trace: A trace of the whole.
        names: Channel there by the name that it gets.

    Returns:
        A trace of these channels alone.
    """
    return replace(
        trace,
        name=f"{trace.name} {place}".strip(),
        channels=tuple(replace(trace.channel(old), name=new) for new, old in names.items()),
        values=trace.columns(list(names.values())),
    )


def simulated_inputs(cascade: Cascade, traces: Sequence[Trace], only: Collection[str] | None = None) -> list[Trace]:
    """Traces in which every channel that a cascade writes holds its free run.

    Args:
        cascade: The cascade, without the member that is to be retrained: its channels stay as measured.
        traces: Measured traces.
        only: The channels that shall; all that it writes by default.

    Returns:
        As many traces, with the same channels.
    """

    def one(trace: Trace) -> Trace:
        run = cascade.simulate_trace(trace)
        values = np.array(trace.values)
        for column, name in enumerate(trace.channel_names):
            if name in (cascade.outputs if only is None else only):
                values[:, column] = run[name]
        said = (*trace.provenance, "what the other members put out stands for what was measured")
        return replace(trace, values=values, provenance=said)

    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(one, traces))


def free_runs(cascade: Cascade, traces: Sequence[Trace], outputs: Sequence[str]) -> list[NDArray[np.float64]]:
    """What the whole puts out on some traces.

    Args:
        cascade: The whole.
        traces: The traces.
        outputs: The outputs.

    Returns:
        Of each trace an array of shape ``(n_samples, n_outputs)``.
    """

    def one(trace: Trace) -> NDArray[np.float64]:
        run = cascade.simulate_trace(trace)
        return np.column_stack([run[name] for name in outputs])

    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(one, traces))


def mean_squares(
    runs: Sequence[NDArray[np.float64]], traces: Sequence[Trace], outputs: Sequence[str]
) -> NDArray[np.float64]:
    """Errors of some free runs.

    Args:
        runs: Of each trace an array of shape ``(n_samples, n_outputs)``.
        traces: The traces.
        outputs: The outputs.

    Returns:
        Mean squared error of each output on each trace, shape ``(n_traces, n_outputs)``.
    """
    return np.array(
        [
            np.mean((run - trace.columns(outputs))[trace.usable_samples] ** 2, axis=0)
            for run, trace in zip(runs, traces, strict=True)
        ]
    )


def geometric_mean(errors: ArrayLike) -> float:
    """What some mean squared errors come to as one figure.

    Args:
        errors: The errors; one that is no number makes the mean none.

    Returns:
        Their geometric mean; an error of zero counts as the least number that there is.

    Example:
        >>> round(geometric_mean([0.5, 2.0]), 12)
        1.0
    """
    return float(np.exp(np.mean(np.log(np.maximum(errors, np.finfo(np.float64).tiny)))))


def score_of(runs: Sequence[NDArray[np.float64]], traces: Sequence[Trace], outputs: Sequence[str]) -> float:
    """How good some free runs are.

    Args:
        runs: Of each trace an array of shape ``(n_samples, n_outputs)``.
        traces: The traces.
        outputs: The outputs.

    Returns:
        Geometric mean over traces and outputs of the mean squared error.
    """
    return geometric_mean(mean_squares(runs, traces, outputs))


def whole_score(cascade: Cascade, traces: Sequence[Trace], outputs: Sequence[str]) -> float:
    """How well the whole does on some traces.

    Args:
        cascade: The whole.
        traces: The traces.
        outputs: Outputs that count.

    Returns:
        Geometric mean over traces and outputs of the mean squared error of the free run.
    """
    return score_of(free_runs(cascade, traces, outputs), traces, outputs)


def written(config: AssemblyConfig, stages: Dict[str, Cascade]) -> dict[str, list[str]]:
    """What the whole is made of, stage by stage: its networks, where they are others than in the stage before.

    What is declared stands in the pipeline, and is the same in all stages: it is counted.

    Args:
        config: The pipeline.
        stages: The whole after each stage.

    Returns:
        Of each stage its networks, each with what it reads and its structure, and how many other members there are.
    """
    found, before = {}, dict[str, str]()
    for stage, whole in stages.items():
        now = _members_written(config, whole)
        if now.keys() != before.keys():
            found[stage] = list(now.values())
        else:
            others = [said for name, said in now.items() if said != before[name]]
            found[stage] = [*others, "the rest as before"] if others else ["all as before"]
        before = now
    return found


def _members_written(config: AssemblyConfig, whole: Cascade) -> dict[str, str]:
    """Each network by its output, and how many members are declared, or are what a mean of several starts is of."""
    networks = {name for one in config.members for name in placed_outputs(one)}
    declared = len({name for one in config.known for name in placed_outputs(one)} & set(whole.outputs))
    found = {}
    for model in whole.models:
        name = Ends.of(model).outputs[0]
        if name in networks:
            found[name] = f"{model.mapping}: {model.structure.label}"
    others = len(whole.models) - len(found) - declared
    counts = {"that the pipeline declares": declared, "of the starts": others}
    return found | {said: f"and {count} {said}" for said, count in counts.items() if count}
