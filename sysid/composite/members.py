"""Members put in their instances and wired, the traces that each is fitted on, and how well the whole does."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from collections.abc import Mapping as Dict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import zip_longest
from typing import TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sysid.composite.composite import Composite, Member
from sysid.composite.fixed.member import FixedMember, Standing
from sysid.estimation.estimators import JOINING
from sysid.models import AbstractModel, Cascade, Limit, Mapping, NARXModel
from sysid.traces import Trace

_T = TypeVar("_T")

_Model = TypeVar("_Model", bound=AbstractModel)

Members = Dict[str, AbstractModel]
"""The members by the output of their first instance, the fixed ones among them."""


def bounds_of(fixed: Sequence[FixedMember]) -> dict[str, Limit]:
    """Between what fixed submodels are held.

    Args:
        fixed: The submodels.

    Returns:
        The limit of each of their outputs, in all their instances.
    """
    return {name: Limit(low=one.low, high=one.high) for one in fixed for name in one.outputs}


def network_of(model: object) -> NARXModel | None:
    """A model as a member that is trained with others.

    Args:
        model: Any model.

    Returns:
        The same; ``None`` where the table of estimators says that such models are not trained together.
    """
    kind = getattr(getattr(model, "structure", None), "kind", None)
    return cast("NARXModel", model) if kind in JOINING else None


def placed(member: Standing, model: _Model, instance: str) -> _Model:
    """A member's model in one of its instances.

    Args:
        member: The member.
        model: Its model, in the first instance's names.
        instance: The instance's suffix.

    Returns:
        The same model over that instance's channels.
    """
    # The model's, not the member's: it may read more than it was fitted with (reads).
    inputs = tuple(member.channel(name, instance) for name in model.mapping.inputs)
    return model.over(Mapping(inputs=inputs, output=member.channel(member.output, instance)))


def assembled(composite: Composite, models: Members, *, without: str | None = None) -> Cascade:
    """All members in all their instances, wired.

    Args:
        composite: What is declared.
        models: Their models.
        without: Output of a member that is left out: whoever reads it then reads what was measured.

    Returns:
        The cascade.

    Raises:
        ConfigError: If they cannot be wired.
    """
    standing = (member for member in composite.standing if member.output != without)
    return wired(composite, [placed(one, models[one.output], there) for one in standing for there in one.instances])


def wired(composite: Composite, models: Sequence[AbstractModel]) -> Cascade:
    """Models in their instances as one, at rest and between limits as declared.

    Args:
        composite: What is declared.
        models: Over the channels of their instances.

    Returns:
        The cascade.

    Raises:
        ConfigError: If they cannot be wired.
    """
    outputs = {model.mapping.output for model in models}
    read = {name for model in models for name in model.mapping.inputs}
    rest = {name: level for name, level in composite.rest.items() if name in outputs | read}
    limits = {name: limit for name, limit in limits_of(composite).items() if name in outputs}
    return Cascade(models=tuple(models), rest=rest, limits=limits | bounds_of(composite.fixed))


def limits_of(composite: Composite) -> dict[str, Limit]:
    """Between what the members are held: in each instance as that is declared, or else as in the first.

    Args:
        composite: What is declared.

    Returns:
        The limit of each output that has one; a limit that is a channel is the one of the same instance.
    """
    found = {}
    for member in composite.members:
        for instance, name in zip(member.instances, member.outputs, strict=True):
            if (limit := composite.limits.get(name) or limit_of_the_first(composite, member, instance)) is not None:
                found[name] = limit
    return found


def limit_of_the_first(composite: Composite, member: Member, instance: str) -> Limit | None:
    """The limit of a member's first instance, as it is for another one.

    Args:
        composite: What is declared.
        member: The member.
        instance: Suffix of the instance.

    Returns:
        The limit; a channel is the one of that instance. ``None`` where the first has none.
    """
    first = composite.limits.get(member.output)
    if first is None:
        return None
    low, high = (member.channel(one, instance) if isinstance(one, str) else one for one in (first.low, first.high))
    return Limit(low=low, high=high)


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


def own_traces(member: Standing, traces: Sequence[Trace]) -> list[Trace]:
    """What a member is fitted on: trace after trace, each in one of its instances in turn.

    Args:
        member: The member.
        traces: Traces of the whole.

    Returns:
        As many traces, with the member's channels under the names of its first instance.
    """
    count = len(member.instances)
    return [at_instance(member, trace, member.instances[i % count]) for i, trace in enumerate(traces)]


def at_instance(member: Standing, trace: Trace, instance: str) -> Trace:
    """A trace as a member sees it in one of its instances.

    Args:
        member: The member.
        trace: A trace of the whole.
        instance: The instance's suffix.

    Returns:
        Its channels under the names of the first instance.
    """
    names = (*member.mapping.inputs, member.output)
    return seen_from(instance, trace, {name: member.channel(name, instance) for name in names})


def seen_from(instance: str, trace: Trace, names: Dict[str, str]) -> Trace:
    """A trace with the channels of one instance under other names.

    Args:
        instance: The instance's suffix, which the trace's name gets.
        trace: A trace of the whole.
        names: Channel there by the name that it gets.

    Returns:
        A trace of these channels alone.
    """
    return replace(
        trace,
        name=f"{trace.name} {instance}".strip(),
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
            [np.mean((run[:, j] - trace[name])[trace.usable_of([name])] ** 2) for j, name in enumerate(outputs)]
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


def _score_of(runs: Sequence[NDArray[np.float64]], traces: Sequence[Trace], outputs: Sequence[str]) -> float:
    """Geometric mean over traces and outputs of the mean squared errors of some free runs."""
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
    return _score_of(free_runs(cascade, traces, outputs), traces, outputs)
