"""The stages before members are trained through each other: functions of members and traces that give members.

Each stage begins from the members of the one before: members that are good alone, the choice by the error of the
whole, retraining on what really comes from upstream, and circles that close with weights of zero.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from sysid.composite.composite import Composite, Member
from sysid.composite.keeper import Report
from sysid.composite.members import (
    Members,
    assembled,
    network_of,
    own_traces,
    simulated_inputs,
    whole_score,
)
from sysid.composite.plan import OneStep
from sysid.errors import ConfigError
from sysid.estimation import FitResult, Training, fitting
from sysid.estimation.networks.initialise import Layout
from sysid.estimation.networks.warm_start import grown, widened
from sysid.estimation.results.result import Loop, Status
from sysid.models import AbstractModel, Cascade, NARXModel
from sysid.traces import Trace

SWEEPS = 3
"""How often the choice goes through all members at most; it mostly settles in the second."""


def fit_member(
    member: Member,
    traces: Sequence[Trace],
    selection: Sequence[Trace],
    report: Report = lambda _: None,
    *,
    initial: FitResult | None = None,
) -> FitResult:
    """Fit one member alone, behind measured inputs.

    Args:
        member: The member; its structure is fitted, not the alternatives.
        traces: Traces of the whole to fit.
        selection: Traces of the whole that choose between its starts.
        report: Told after every iteration.
        initial: A fit to start from instead.

    Returns:
        The fit, over the names of its first instance.
    """
    return fitting.fit(
        own_traces(member, traces[: member.traces]),
        member.mapping,
        member.structure,
        member.training,
        rest_output=member.rest,
        selection=own_traces(member, selection),
        initial=initial,
        stability=member.stability,
        on_progress=report,
    )


def one_step_of(member: Member, asked: OneStep) -> Member:
    """A member that is trained one step ahead: with the same lags and neurons, on measured past output.

    Args:
        member: The member.
        asked: How.

    Returns:
        The member.
    """
    own = member.training
    training = Training(
        loop=Loop.OPEN, max_iterations=asked.max_iterations, starts=asked.starts,
        workers=own.workers, stride=own.stride, seed=own.seed,
    )  # fmt: skip
    return replace(member, training=training, stability=None)


def model_of(fit: FitResult) -> NARXModel:
    """The network of a member's fit."""
    model = network_of(fit.model)
    if model is None:
        raise TypeError(f"{fit.model.mapping} is no NARX")
    return model


@dataclass(frozen=True, kw_only=True)
class Choice:
    """Which candidate of each member the whole does best with.

    Args:
        members: Position of the candidate by the member's output.
        score: Of the whole, on the selection traces.
        tried: How many wholes were run.
    """

    members: dict[str, int]
    score: float
    tried: int


def choose_together(
    composite: Composite,
    candidates: Mapping[str, Sequence[AbstractModel]],
    alone: Mapping[str, int],
    selection: Sequence[Trace],
    *,
    outputs: Sequence[str],
    report: Callable[[str], None] = lambda _: None,
) -> Choice:
    """Choose the members by the error of the whole, one member at a time until none changes.

    Args:
        composite: What is declared.
        candidates: Models by the member's output, those of the fixed submodels among them.
        alone: Where the search starts: the best of each by itself.
        selection: Traces that choose.
        outputs: Outputs whose error chooses.
        report: Told what is being tried.

    Returns:
        The choice; never worse on the selection traces than the start.
    """
    chosen, tried = dict(alone), 1
    best = whole_score(_with(composite, candidates, chosen), selection, outputs)
    for _ in range(SWEEPS):
        before = dict(chosen)
        for name, models in candidates.items():
            for index in range(len(models)):
                if index == chosen[name]:
                    continue
                report(f"{name}, candidate {index + 1} of {len(models)}, best {best:.3g}")
                tried += 1
                score = whole_score(_with(composite, candidates, {**chosen, name: index}), selection, outputs)
                if score < best:
                    best, chosen = score, {**chosen, name: index}
        if chosen == before:
            break
    return Choice(members=chosen, score=best, tried=tried)


def _with(
    composite: Composite, candidates: Mapping[str, Sequence[AbstractModel]], chosen: Mapping[str, int]
) -> Cascade:
    return assembled(composite, {name: models[chosen[name]] for name, models in candidates.items()})


def retrain(
    composite: Composite,
    output: str,
    models: Members,
    report: Report = lambda _: None,
    *,
    estimation: Sequence[Trace],
    selection: Sequence[Trace],
    max_iterations: int,
) -> FitResult:
    """Train one member again, from where it stands, on the free run of all others.

    Args:
        composite: What is declared.
        output: The member's.
        models: All members.
        report: Told after every iteration.
        estimation: Traces to fit.
        selection: Traces that choose, likewise with what the others put out.
        max_iterations: Of the training.

    Returns:
        The fit.
    """
    # Of its candidates' structures the one that was chosen.
    member = composite.member(output).of_structure(cast("NARXModel", models[output]).network)
    others = assembled(composite, models, without=output)
    start = FitResult(
        model=models[output], status=Status.MAX_ITERATIONS, loop=member.training.loop, history={},
        train_time_s=0.0, seed=0,
    )  # fmt: skip
    return fit_member(
        replace(member.trained(max_iterations=max_iterations, starts=1, pretraining=0), stability=None),
        simulated_inputs(others, estimation[: member.traces]),
        simulated_inputs(others, selection),
        report,
        initial=start,
    )


def reading_more(cascade: Cascade, reads: Mapping[str, Mapping[str, tuple[int, ...]]]) -> Cascade:
    """The same whole with members that read more, with weights of zero: closed circles that run as the chain did.

    Args:
        cascade: The whole.
        reads: By the output of a member, lags of each channel that it reads more: of another, of one that it reads
            already, or of its own output.

    Returns:
        The cascade.

    Raises:
        ConfigError: If a member is no network of one output, or reads one of the lags already.
    """
    for output, more in reads.items():
        models = {name: cascade.member(name) for name in (output, *more)}
        asked = {name: network_of(model) for name, model in models.items()}
        networks = {name: model for name, model in asked.items() if model is not None}
        if len(networks) < len(models):
            raise ConfigError(
                f"{', '.join(sorted(set(models) - set(networks)))} cannot take part in a circle",
                where="reads",
                expected="outputs of fitted networks",
                got=f"{output}: {', '.join(more)}",
                remedy="name such outputs",
            )
        model = networks[output]
        longer = {name: lags for name, lags in more.items() if name in (output, *model.mapping.inputs)}
        model = _reading_further_back(model, longer) if longer else model
        new = {name: lags for name, lags in more.items() if name not in longer}
        cascade = cascade.with_member(widened(model, new, networks) if new else model)
    return cascade


def _reading_further_back(model: NARXModel, more: Mapping[str, tuple[int, ...]]) -> NARXModel:
    """A network with more lags of channels that it reads, its own output among them, with weights of zero for them."""
    lags, output = model.recursion.lags, model.mapping.output
    delays = {**dict(zip(model.mapping.inputs, lags.inputs, strict=True)), output: lags.output}
    known = [f"{name} {lag}" for name, some in more.items() for lag in some if lag in delays[name]]
    if known:
        raise ConfigError(
            f"{model.mapping} reads some of these lags already",
            where="reads",
            expected="lags that it does not read",
            got=", ".join(known),
            remedy="leave them out",
        )
    delays |= {name: tuple(sorted({*delays[name], *some})) for name, some in more.items()}
    network = replace(
        model.network,
        input_delays=tuple(delays[name] for name in model.mapping.inputs),
        output_delays=delays[output],
    )
    count = Layout.of(network, len(lags.inputs)).n_parameters
    longer = replace(model, network=network, theta=np.zeros(count))
    return replace(longer, theta=grown(model.recursion, longer.recursion, longer.theta))
