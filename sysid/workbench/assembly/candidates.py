"""Candidates for each member: fitted alone, the best of each by itself, and those that the whole does best with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from sysid.models import NARXModel
from sysid.traces import Trace
from sysid.workbench import events
from sysid.workbench.assembly.context import Context
from sysid.workbench.assembly.known import known_model
from sysid.workbench.assembly.member_config import MemberConfig
from sysid.workbench.assembly.members import Members, own_traces
from sysid.workbench.assembly.stages import Choice, choose_together, fit_member, fit_one_step, model_of
from sysid.workbench.store import digest, strict

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
    for member in context.config.members:
        own = []
        for place, variant in enumerate(member.variants):
            for number in range(variant.candidates):
                index = place * variant.candidates + number
                seed = context.config.seed + SEEDS_OF_A_CANDIDATE * number
                candidate, key = _fitted(context, variant, estimation, selection, index=index, seed=seed)
                own.append(candidate)
                keys.append(key)
        fits[member.mapping.output] = tuple(own)
    known = {one.mapping.output: known_model(one, estimation[0]) for one in context.config.known}
    alone = {name: int(np.argmin([one.error for one in own])) for name, own in fits.items()}
    choice = _choice(context, fits, known, alone, selection) if max(map(len, fits.values())) > 1 else None
    key = digest(strict([keys, alone if choice is None else choice.members]))
    return Candidates(fits=fits, known=known, alone=alone, choice=choice, key=key)


def _fitted(
    context: Context,
    member: MemberConfig,
    estimation: Sequence[Trace],
    selection: Sequence[Trace],
    *,
    index: int,
    seed: int,
) -> tuple[Candidate, str]:
    """One candidate, and the digest of what it depends on."""
    # Not all of the traces: what is declared beside a member leaves its fit as it was.
    own = (*own_traces(member, estimation[: member.traces]), *own_traces(member, selection))
    terms: dict[str, Any] = {
        "member": member.model_dump(mode="json", exclude={"candidates", "alternatives"}),
        "seed": seed,
        "data": [trace.digest for trace in own],
    }
    title = f"{member.mapping}, candidate {index + 1}, {member.structure.label}"
    fit, key = context.fit(
        f"{member.slug}-{index}",
        f"Fitting {title}",
        terms,
        partial(fit_member, member, estimation, selection, seed=seed),
    )
    asked, one_step = context.config.one_step, None
    if asked is not None:
        open_loop, _ = context.fit(
            f"{member.slug}-{index}-one-step",
            f"Fitting {title}, one step ahead",
            terms | {"one_step": asked.model_dump(mode="json")},
            partial(fit_one_step, member, asked, estimation, selection, seed=seed),
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
    return float(np.exp(np.mean(np.log(np.maximum(errors, np.finfo(np.float64).tiny)))))


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
