"""Candidates for each member: fitted alone, the best of each by itself, and those that the whole does best with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from sysid.composite.fixed_members import known_model
from sysid.composite.members import Members, geometric_mean, own_traces
from sysid.composite.stages import Choice, choose_together, fit_member, fit_one_step, model_of
from sysid.errors import ConfigError
from sysid.estimation import FitResult
from sysid.models import Mapping, NARXModel
from sysid.reporting.sweep.record import read_sweep
from sysid.traces import Trace
from sysid.workbench.assembly.context import Context
from sysid.workbench.assembly.member_config import MemberConfig, SweepSource
from sysid.workbench.runner import events
from sysid.workbench.runner.store import digest, strict
from sysid.workbench.sweep.store import TRIALS, TrialStore

SEEDS_OF_A_CANDIDATE = 1000
"""How far the seeds of one candidate are from the next one's of the same structure."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidate:
    """One fit of a member.

    Args:
        member: The member, with the structure of this fit.
        seed: Of its first start.
        model: As it was fitted in free run, or as its training says.
        one_step: Of the same structure, fitted one step ahead; ``None`` where that was not asked for.
        error: Geometric mean over the selection traces of the mean squared error of the model's free run, alone and
            behind measured inputs.
    """

    member: MemberConfig
    seed: int
    model: NARXModel
    one_step: NARXModel | None
    error: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidates:
    """All of a run.

    Args:
        fits: Candidates by the member's output.
        known: The declared members.
        alone: Position of the candidate that is best by itself, by the member's output.
        choice: What the whole does best with; ``None`` where there was nothing to choose.
        key: Digest of all that they depend on.
    """

    fits: dict[str, tuple[Candidate, ...]]
    known: Members
    alone: dict[str, int]
    choice: Choice | None
    key: str

    @property
    def chosen(self) -> dict[str, int]:
        """Position of the candidate that goes on, by the member's output."""
        return self.alone if self.choice is None else self.choice.members

    def models(self, positions: dict[str, int]) -> Members:
        """The members with some of their candidates.

        Args:
            positions: Which, by the member's output.

        Returns:
            Their models, and the declared ones.
        """
        return {name: fits[positions[name]].model for name, fits in self.fits.items()} | self.known

    @property
    def one_step(self) -> Members | None:
        """The members that are best alone as they were fitted one step ahead; ``None`` without such fits."""
        best = {name: fits[self.alone[name]].one_step for name, fits in self.fits.items()}
        models = {name: model for name, model in best.items() if model is not None}
        return {**models, **self.known} if len(models) == len(best) else None

    @property
    def sentence(self) -> str:
        """What the choice came to; empty where there was nothing to choose."""
        if self.choice is None:
            return ""
        changed = [name for name in self.fits if self.chosen[name] != self.alone[name]]
        tried = f"Of {self.choice.tried} wholes tried,"
        if changed:
            return f"{tried} the best has another {', '.join(changed)} than the best alone."
        return f"{tried} none beats the one of the members that are best alone."


def fit_candidates(context: Context, estimation: Sequence[Trace], selection: Sequence[Trace]) -> Candidates:
    """Fit every candidate, each on disk before the next, and let the whole choose.

    Args:
        context: The run.
        estimation: Traces to fit.
        selection: Traces that choose.

    Returns:
        The candidates.
    """
    fits, keys = {}, list[str]()
    asked = [(member, _asked(context, member)) for member in context.config.members]  # what cannot be had is said first
    for member, wanted in asked:
        own = []
        for index, one in enumerate(wanted):
            candidate, key = _fitted(context, one, index, estimation, selection)
            own.append(candidate)
            keys.append(key)
        fits[member.mapping.output] = tuple(own)
    known = {one.mapping.output: known_model(one, estimation[0]) for one in context.config.known}
    alone = {name: int(np.argmin([one.error for one in own])) for name, own in fits.items()}
    choice = _choice(context, fits, known, alone, selection) if max(map(len, fits.values())) > 1 else None
    key = digest(strict([keys, alone if choice is None else choice.members]))
    return Candidates(fits=fits, known=known, alone=alone, choice=choice, key=key)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Asked:
    """A candidate that is to be had: fitted from a seed, or given as a sweep has it."""

    member: MemberConfig
    seed: int
    given: FitResult | None = None


def _asked(context: Context, member: MemberConfig) -> list[_Asked]:
    """Every candidate of a member: of each structure from each seed, and the best of its sweep."""
    own = [
        _Asked(member=variant, seed=context.config.seed + SEEDS_OF_A_CANDIDATE * number)
        for variant in member.variants
        for number in range(member.candidates)
    ]
    return own if member.sweep is None else [*own, *_swept(context, member, member.sweep)]


def _swept(context: Context, member: MemberConfig, source: SweepSource) -> list[_Asked]:
    """The best fits of a sweep, as they are."""
    folder = (context.beside / source.run).resolve()
    record, trials = read_sweep(folder), TrialStore(path=folder / TRIALS)
    if Mapping.parse(record.mapping) != member.mapping:
        raise ConfigError(
            "the sweep is of another mapping than the member",
            where=folder,
            expected=str(member.mapping),
            got=record.mapping,
            remedy="name a sweep of the member's mapping",
        )
    found = list[_Asked]()
    for trial in sorted(record.tried_in_full, key=lambda one: (record.choice(one), one.number)):
        if len(found) == source.keep:
            break
        stored = trials.read(trial.key)
        fit = None if stored is None else FitResult.from_dict(stored["fit"])
        if fit is not None and isinstance(fit.model, NARXModel):
            found.append(_Asked(member=member.of_structure(fit.model.network), seed=fit.seed or 0, given=fit))
    if not found:
        raise ConfigError(
            "the sweep has no network to take",
            where=folder,
            expected=f"fits of {member.mapping} that were trained to the end, in {TRIALS}",
            got=f"{len(record.trials)} trials",
            remedy="run the sweep again: sysid sweep NAME",
        )
    return found


def _fitted(
    context: Context, asked: _Asked, index: int, estimation: Sequence[Trace], selection: Sequence[Trace]
) -> tuple[Candidate, str]:
    """One candidate, and the digest of what it depends on."""
    member, seed, given = asked.member, asked.seed, asked.given
    # Not all of the traces: what is declared beside a member leaves its fit as it was.
    own = (*own_traces(member, estimation[: member.traces]), *own_traces(member, selection))
    terms: dict[str, Any] = {
        "member": member.model_dump(mode="json", exclude={"candidates", "alternatives", "sweep"}),
        "seed": seed,
        "data": [trace.digest for trace in own],
    }
    title = f"{member.mapping}, candidate {index + 1}, {member.structure.label}"
    if given is None:
        fit, key = context.fit(
            f"{member.slug}-{index}",
            f"Fitting {title}",
            terms,
            partial(fit_member, member, estimation, selection, seed=seed),
        )
    else:
        fit, key = given, digest(strict(given.model.to_dict()))
    ahead, one_step = context.config.one_step, None
    if ahead is not None:
        open_loop, _ = context.fit(
            f"{member.slug}-{index}-one-step",
            f"Fitting {title}, one step ahead",
            terms | {"one_step": ahead.model_dump(mode="json")},
            partial(fit_one_step, member, ahead, estimation, selection, seed=seed),
        )
        one_step = model_of(open_loop)
    model = model_of(fit)
    error = _alone(member, model, selection)
    return Candidate(member=member, seed=seed, model=model, one_step=one_step, error=error), key


def _alone(member: MemberConfig, model: NARXModel, selection: Sequence[Trace]) -> float:
    """A model's error by itself, behind measured inputs."""
    errors = [
        float(np.mean((model.simulate(t.columns(model.mapping.inputs)) - t[model.mapping.output]) ** 2))
        for t in own_traces(member, selection)
    ]
    return geometric_mean(errors)


def _choice(
    context: Context,
    fits: dict[str, tuple[Candidate, ...]],
    known: Members,
    alone: dict[str, int],
    selection: Sequence[Trace],
) -> Choice:
    """Which candidates the whole does best with."""
    step = context.titled("Choosing the members by the error of the whole")
    context.tell(events.StepStarted(step=step))
    models = {name: [one.model for one in own] for name, own in fits.items()}
    choice = choose_together(
        context.config,
        {**models, **{name: [model] for name, model in known.items()}},
        {**alone, **dict.fromkeys(known, 0)},
        selection,
        report=lambda text: context.tell(events.StepProgress(step=step, fraction=None, detail=text)),
    )
    context.tell(events.StepDone(step=step, stored=False, detail=f"{choice.tried} wholes, best {choice.score:.3g}"))
    return choice
