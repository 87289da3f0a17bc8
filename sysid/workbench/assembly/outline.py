"""What is known of an assembly's steps before any is done: what a dry run says of those that it cannot come to."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

from sysid.composite.candidates import CHOOSING, CHOOSING_TITLE, candidate_name, candidate_title
from sysid.names import slug, task_slug
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.context import OfSeed, new_runs_outlined
from sysid.workbench.assembly.estimates import RoundEstimates
from sysid.workbench.assembly.evaluation import DOUBT, INTERPOLATION, MEMBERS, MONTE_CARLO, SCORING, WHOLE, export_step
from sysid.workbench.fits.data import unmade_data
from sysid.workbench.runner.run import REPORT
from sysid.workbench.runner.steps import Estimate, Outlined


def outline(config: AssemblyConfig, beside: Path, estimates: RoundEstimates) -> list[Outlined]:
    """All steps of an assembly, as far as its pipeline says.

    Args:
        config: The pipeline.
        beside: Folder of its file.
        estimates: How long rounds take that were never trained.

    Returns:
        The steps in order; active learning may end before its last round.
    """
    seeds = config.mean.seeds if config.mean else ()
    again = [_again(one, seed) for seed in seeds for one in _training(config, beside, estimates)]
    return [*_data(config, beside), *_training(config, beside, estimates), *again, *_proof(config, beside), REPORT]


def _again(one: Outlined, seed: int) -> Outlined:
    """A step of the training with another seed; new runs are those of the first."""
    apart = OfSeed(None if one.name.startswith("new-runs") else seed)
    return replace(one, name=apart.name(one.name), title=apart.title(one.title), called=apart.title(one.called))


def _data(config: AssemblyConfig, beside: Path) -> list[Outlined]:
    training = (config.training,) if isinstance(config.training, str) else config.training
    names = [config.data, *training, config.selection, *(config.together.data if config.together else ())]
    learning = config.active_learning
    asks = learning is not None and learning.candidates is not None
    names += [] if learning is None or asks else [learning.data]
    loaded = [_loading(name, beside) for name in dict.fromkeys(names) if name is not None]
    return [*loaded, *([new_runs_outlined(learning, 0, beside)] if learning is not None and asks else [])]


def _loading(name: str, beside: Path) -> Outlined:
    estimate = unmade_data([name], beside=beside) or Estimate(seconds=1.0, basis="typical: its traces are there")
    return Outlined(name=f"data-{slug(name)}", title=f"Loading {name}", estimate=estimate)


def _training(config: AssemblyConfig, beside: Path, estimates: RoundEstimates) -> Iterator[Outlined]:
    plan = config.plan
    if config.warm_start is None:
        yield from _members(config, estimates)
    for number in range(1, len(plan.rounds) + 1):
        name = "together" if number == 1 else f"together-{number}"
        title = f"Training end to end{'' if number == 1 else f', round {number}'}"
        yield Outlined(name=name, title=title, how_long=partial(estimates.of, name))
    if plan.active_learning is not None:
        parts = len(plan.active_learning.rounds)
        for number in range(1, len(plan.active_learning.additions) + 1):
            if config.active_learning is not None and config.active_learning.candidates is not None:
                yield new_runs_outlined(config.active_learning, number, beside)
            for part in range(1, parts + 1):
                suffix = f".{part}" if parts > 1 else ""
                name = f"active-learning-{number}{suffix.replace('.', '-')}"
                title = f"Active learning, round {number}{suffix} at most"
                yield Outlined(name=name, title=title, how_long=partial(estimates.of, name))


def _members(config: AssemblyConfig, estimates: RoundEstimates) -> Iterator[Outlined]:
    plan, many = config.plan, False
    swept = {member.mapping.output for member in config.members if member.sweep is not None}
    for member in config.composite.members:
        variants = [variant for variant in member.variants for _ in range(member.candidates)]
        many = many or len(variants) > 1 or member.output in swept
        for index, variant in enumerate(variants):
            name, title = candidate_name(variant, index), candidate_title(variant, index)
            yield Outlined(name=f"fit-{task_slug(name)}", title=title, called=name)
            if plan.one_step is not None:
                yield Outlined(name=f"fit-{task_slug(f'{name} one step')}", title=f"{title}, one step ahead")
    if many:
        yield Outlined(name=CHOOSING, title=CHOOSING_TITLE)
    if plan.retrain is not None:
        for number in range(plan.retrain.rounds):
            for output in plan.retrain.members:
                mapping = config.composite.member(output).mapping
                title = f"Retraining {mapping} on what the others put out, round {number + 1}"
                name = f"fit-{task_slug(f'{mapping} retrained {number}')}"
                yield Outlined(name=name, title=title, how_long=partial(estimates.of_retraining, output))


def _proof(config: AssemblyConfig, beside: Path) -> Iterator[Outlined]:
    yield SCORING
    yield WHOLE
    if config.monte_carlo is not None:
        yield from (_loading(config.monte_carlo.data, beside), MONTE_CARLO)
    if config.interpolation is not None:
        yield from (_loading(config.interpolation.data, beside), INTERPOLATION)
    if config.doubt is not None:
        yield from (_loading(config.doubt.data, beside), DOUBT)
    if config.export is not None:
        yield export_step(config.export)
    if config.warm_start is None:
        yield MEMBERS
