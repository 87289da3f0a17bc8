"""The stages of an assembly's training: functions of members and traces that give members, and touch no folder.

Each stage begins from the members of the one before, and the whole is scored after each, so that one sees what it
brought: members that are good alone, the choice by the error of the whole, retraining on what really comes from
upstream, and training end to end.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sysid.composite.members import (
    Members,
    assembled,
    own_traces,
    simulated_inputs,
    whole_score,
)
from sysid.errors import ConfigError
from sysid.estimation import FitProgress, FitResult, fit_narx
from sysid.estimation.networks.initialise import Layout
from sysid.estimation.networks.warm_start import grown, widened
from sysid.estimation.result import Loop, Status
from sysid.models import NARX, Cascade, NARXModel
from sysid.traces import Trace
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.member_config import MemberConfig
from sysid.workbench.assembly.stage_config import OneStepConfig
from sysid.workbench.fields import TrainingConfig

Report = Callable[[FitProgress], None]
SWEEPS = 3
"""How often the choice goes through all members at most; it mostly settles in the second."""


def fit_member(
    member: MemberConfig,
    traces: Sequence[Trace],
    selection: Sequence[Trace],
    report: Report,
    *,
    seed: int,
    initial: FitResult | None = None,
    max_iterations: int | None = None,
) -> FitResult:
    """Fit one member alone.

    Args:
        member: The member.
        traces: Traces of the whole to fit.
        selection: Traces of the whole that choose between its starts.
        report: Told after every iteration.
        seed: Of its first start.
        initial: A fit to start from instead.
        max_iterations: Iterations, where they are not those of the member's training.

    Returns:
        The fit, over the names of its first place.
    """
    training = member.training_options(seed)
    if max_iterations is not None:
        training = replace(training, max_iterations=max_iterations, starts=1, prelude=0)
    structure = member.structure
    if not isinstance(structure, NARX):
        raise TypeError(f"{member.mapping} is no NARX")  # refused when the YAML was read
    return fit_narx(
        own_traces(member, traces[: member.traces]),
        member.mapping,
        structure,
        training,
        rest_output=member.rest,
        selection=own_traces(member, selection),
        initial=initial,
        on_progress=report,
    )


def fit_one_step(
    member: MemberConfig,
    asked: OneStepConfig,
    traces: Sequence[Trace],
    selection: Sequence[Trace],
    report: Report,
    *,
    seed: int,
) -> FitResult:
    """Fit one member alone, one step ahead.

    Args:
        member: The member.
        asked: How.
        traces: Traces of the whole to fit.
        selection: Traces of the whole that choose between its starts, by their error one step ahead.
        report: Told after every iteration.
        seed: Of its first start.

    Returns:
        The fit, over the names of its first place.
    """
    options: dict[str, Any] = {"loop": Loop.OPEN, "max_iterations": asked.max_iterations, "starts": asked.starts}
    given = member.training
    if given is not None:
        options |= {name: getattr(given, name) for name in ("workers", "stride") if name in given.model_fields_set}
    training = TrainingConfig(**options)
    return fit_member(member.model_copy(update={"training": training}), traces, selection, report, seed=seed)


def model_of(fit: FitResult) -> NARXModel:
    """The network of a member's fit."""
    if not isinstance(fit.model, NARXModel):
        raise TypeError(f"{fit.model.mapping} is no NARX")
    return fit.model


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
    config: AssemblyConfig,
    candidates: Mapping[str, Sequence[NARXModel]],
    alone: Mapping[str, int],
    selection: Sequence[Trace],
    *,
    report: Callable[[str], None] = lambda _: None,
) -> Choice:
    """Choose the members by the error of the whole, one member at a time until none changes.

    Args:
        config: The pipeline.
        candidates: Models by the member's output.
        alone: Where the search starts: the best of each by itself.
        selection: Traces that choose.
        report: Told what is being tried.

    Returns:
        The choice; never worse on the selection traces than the start.
    """
    outputs = config.choose_on or config.outputs
    chosen, tried = dict(alone), 1
    best = whole_score(_with(config, candidates, chosen), selection, outputs)
    for _ in range(SWEEPS):
        before = dict(chosen)
        for name, models in candidates.items():
            for index in range(len(models)):
                if index == chosen[name]:
                    continue
                report(f"{name}, candidate {index + 1} of {len(models)}, best {best:.3g}")
                tried += 1
                score = whole_score(_with(config, candidates, {**chosen, name: index}), selection, outputs)
                if score < best:
                    best, chosen = score, {**chosen, name: index}
        if chosen == before:
            break
    return Choice(members=chosen, score=best, tried=tried)


def _with(config: AssemblyConfig, candidates: Mapping[str, Sequence[NARXModel]], chosen: Mapping[str, int]) -> Cascade:
    return assembled(config, {name: models[chosen[name]] for name, models in candidates.items()})


def retrain(
    config: AssemblyConfig,
    member: MemberConfig,
    models: Members,
    report: Report,
    *,
    estimation: Sequence[Trace],
    selection: Sequence[Trace],
    max_iterations: int,
) -> FitResult:
    """Train one member again, from where it stands, on the free run of all others.

    Args:
        config: The pipeline.
        member: The member.
        models: All members.
        report: Told after every iteration.
        estimation: Traces to fit.
        selection: Traces that choose, likewise with what the others put out.
        max_iterations: Of the training.

    Returns:
        The fit.
    """
    name = member.mapping.output
    member = member.of_structure(models[name].network)  # of its candidates' structures the one that was chosen
    others = assembled(config, models, without=name)
    start = FitResult(
        model=models[name], status=Status.MAX_ITERATIONS, loop=member.training_options(0).loop, history={},
        train_time_s=0.0, seed=0,
    )  # fmt: skip
    return fit_member(
        member, simulated_inputs(others, estimation[: member.traces]), simulated_inputs(others, selection), report,
        seed=config.seed, initial=start, max_iterations=max_iterations,
    )  # fmt: skip


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
        networks = {name: model for name, model in models.items() if isinstance(model, NARXModel)}
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
    network = NARX(
        input_delays=[delays[name] for name in model.mapping.inputs],
        output_delays=delays[output],
        neurons=model.network.neurons,
        feedthrough=model.network.feedthrough,
        gated=model.network.gated,
    )
    count = Layout.of(network, len(lags.inputs)).n_parameters
    longer = replace(model, network=network, theta=np.zeros(count))
    return replace(longer, theta=grown(model.recursion, longer.recursion, longer.theta))
