"""Candidates for each member: fitted alone, the best of each by itself, and those that the whole does best with."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from sysid.composite.composite import Composite, Member
from sysid.composite.fixed_members import fixed_model
from sysid.composite.keeper import Decision, Keeper, MakeAll, Report, Sample, Task
from sysid.composite.members import Members, assembled, geometric_mean, network_of, own_traces
from sysid.composite.plan import TrainingPlan
from sysid.composite.stages import Choice, choose_together, fit_member, model_of, one_step_of
from sysid.errors import ConfigError
from sysid.estimation import FitResult, Training
from sysid.models import AbstractModel, NARXModel
from sysid.traces import Trace

SEEDS_OF_A_CANDIDATE = 1000
"""How far the seeds of one candidate are from the next one's of the same structure."""

SAMPLED = 4
"""Traces on which a fit is timed."""

CHOOSING, CHOOSING_TITLE = "choosing", "Choosing the members by the error of the whole"


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidate:
    """One fit of a member.

    Args:
        member: The member, with the structure and the seed of this fit.
        model: As it was fitted in free run, or as its training says.
        one_step: Of the same structure, fitted one step ahead; ``None`` where that was not asked for.
        error: Geometric mean over the selection traces of the mean squared error of the model's free run, alone and
            behind measured inputs.
    """

    member: Member
    model: NARXModel
    one_step: NARXModel | None
    error: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidates:
    """All of a run.

    Args:
        fits: Candidates by the member's output.
        fixed: The fixed submodels.
        alone: Position of the candidate that is best by itself, by the member's output.
        choice: What the whole does best with; ``None`` where there was nothing to choose.
    """

    fits: dict[str, tuple[Candidate, ...]]
    fixed: Members
    alone: dict[str, int]
    choice: Choice | None

    @property
    def chosen(self) -> dict[str, int]:
        """Position of the candidate that goes on, by the member's output."""
        return self.alone if self.choice is None else self.choice.members

    def models(self, positions: dict[str, int]) -> Members:
        """The members with some of their candidates.

        Args:
            positions: Which, by the member's output.

        Returns:
            Their models, and the fixed ones.
        """
        return {**{name: fits[positions[name]].model for name, fits in self.fits.items()}, **self.fixed}

    @property
    def one_step(self) -> Members | None:
        """The members that are best alone as they were fitted one step ahead; ``None`` without such fits."""
        best = {name: fits[self.alone[name]].one_step for name, fits in self.fits.items()}
        models = {name: model for name, model in best.items() if model is not None}
        return {**models, **self.fixed} if len(models) == len(best) else None

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


Given = Mapping[str, Sequence[FitResult]]
"""By the member's output, fits that are candidates as they are."""


def fit_candidates(
    composite: Composite,
    plan: TrainingPlan,
    estimation: Sequence[Trace],
    selection: Sequence[Trace],
    *,
    given: Given | None = None,
    keeper: Keeper | None = None,
) -> Candidates:
    """Fit every candidate, each kept before the next, and let the whole choose.

    Args:
        composite: What is declared.
        plan: Which outputs choose, and whether fits one step ahead stand beside.
        estimation: Traces to fit.
        selection: Traces that choose.
        given: Candidates that are there already, behind the others.
        keeper: Where fits are kept; nowhere by default.

    Returns:
        The candidates.

    Raises:
        ConfigError: If a member has no candidate, or a given one is no network of its mapping.
    """
    keeper = keeper or MakeAll()
    asked = {one.output: _asked(one, (given or {}).get(one.output, ())) for one in composite.members}
    tasks = [
        task
        for wanted in asked.values()
        for index, one in enumerate(wanted)
        for task in _tasks(one, index, plan, estimation, selection)
    ]
    found = iter(keeper.keep_all(tasks))
    fits = {
        output: tuple(_candidate(one, found, plan, selection) for one in wanted) for output, wanted in asked.items()
    }
    fixed = {one.output: fixed_model(one, estimation[0]) for one in composite.fixed}
    alone = {name: int(np.argmin([one.error for one in own])) for name, own in fits.items()}
    alone_best = Candidates(fits=fits, fixed=fixed, alone=alone, choice=None)
    if max(map(len, fits.values())) == 1:
        return alone_best
    return replace(alone_best, choice=_choice(composite, plan, alone_best, selection, keeper))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Asked:
    """A candidate that is to be had: fitted, or given as it is."""

    member: Member
    given: FitResult | None = None


def _asked(member: Member, given: Sequence[FitResult]) -> list[_Asked]:
    """Every candidate of a member: of each structure from each seed, and the given ones."""
    seeds = [member.training.seed + SEEDS_OF_A_CANDIDATE * number for number in range(member.candidates)]
    own = [_Asked(member=variant.trained(seed=seed)) for variant in member.variants for seed in seeds]
    for fit in given:
        if network_of(fit.model) is None or fit.model.mapping != member.mapping:
            raise ConfigError(
                f"a candidate that is given is no network {member.mapping}",
                where="given",
                expected=f"fits of {member.mapping} with a NARX",
                got=str(fit.model.mapping),
                remedy="leave it out",
            )
        own.append(_Asked(member=member.of_structure(model_of(fit).network).trained(seed=fit.seed or 0), given=fit))
    if not own:
        raise ConfigError(
            f"{member.mapping} has no candidates",
            where="candidates",
            expected="candidates from 1 on, or fits that are given",
            got="none",
            remedy="leave candidates out, for one",
        )
    return own


def _tasks(
    asked: _Asked, index: int, plan: TrainingPlan, estimation: Sequence[Trace], selection: Sequence[Trace]
) -> list[Task[FitResult]]:
    """The fits of one candidate: in free run, unless it is given, and one step ahead, if that is asked for."""
    member, tasks = asked.member, list[Task[FitResult]]()
    title = candidate_title(member, index)
    if asked.given is None:
        tasks.append(_task(member, candidate_name(member, index), title, estimation, selection))
    if plan.one_step is not None:
        name = f"{candidate_name(member, index)} one step"
        tasks.append(_task(one_step_of(member, plan.one_step), name, f"{title}, one step ahead", estimation, selection))
    return tasks


def candidate_name(member: Member, index: int) -> str:
    """What a candidate's fit is stored as.

    Args:
        member: The member.
        index: Which of its candidates, from 0 on.

    Returns:
        The name.
    """
    return f"{member.mapping} {index}"


def candidate_title(member: Member, index: int) -> str:
    """What a candidate's fit is for people.

    Args:
        member: The member, with the candidate's structure.
        index: Which of its candidates, from 0 on.

    Returns:
        For example ``"Fitting pump -> upper, candidate 1, NARX 1/1/4"``.
    """
    return f"Fitting {member.mapping}, candidate {index + 1}, {member.structure.label}"


def _candidate(asked: _Asked, found: Iterator[FitResult], plan: TrainingPlan, selection: Sequence[Trace]) -> Candidate:
    """One candidate, its fits being those that come next."""
    member = asked.member
    model = model_of(next(found) if asked.given is None else asked.given)
    one_step = None if plan.one_step is None else model_of(next(found))
    return Candidate(member=member, model=model, one_step=one_step, error=_alone(member, model, selection))


def _task(
    member: Member, name: str, title: str, estimation: Sequence[Trace], selection: Sequence[Trace]
) -> Task[FitResult]:
    """A fit of a member alone."""
    # Not all of the traces: what is declared beside a member leaves its fit as it was.
    own = (*own_traces(member, estimation[: member.traces]), *own_traces(member, selection))
    return Task(
        name=name,
        title=title,
        terms={"member": member.terms, "data": [trace.digest for trace in own]},
        runs=(fit_member,),
        make=partial(fit_member, member, estimation, selection),
        kind=FitResult,
        limit_s=member.training.max_time_s,
        amount={
            "structure": member.structure.to_dict(),
            "training": str(replace(member.training, seed=0)),
            "samples": [len(trace) for trace in own],
        },
        sample=sample_fit(member, estimation[: member.traces], selection[:1]),
    )


def sample_fit(member: Member, estimation: Sequence[Trace], selection: Sequence[Trace]) -> Sample:
    """A fit of a member on a few of its traces, by which the whole fit is timed.

    Args:
        member: The member.
        estimation: All traces that it is fitted to.
        selection: Traces that choose between its starts.

    Returns:
        The fit.
    """
    some = estimation[:SAMPLED]

    def fit(training: Training, report: Report) -> FitResult:
        return fit_member(replace(member, training=training), some, selection, report)

    return Sample(training=member.training, fit=fit, share=sum(map(len, some)) / sum(map(len, estimation)))


def _alone(member: Member, model: NARXModel, selection: Sequence[Trace]) -> float:
    """A model's error by itself, behind measured inputs."""
    errors = [
        float(np.mean((model.simulate(t.columns(model.mapping.inputs)) - t[model.mapping.output]) ** 2))
        for t in own_traces(member, selection)
    ]
    return geometric_mean(errors)


def _choice(
    composite: Composite, plan: TrainingPlan, found: Candidates, selection: Sequence[Trace], keeper: Keeper
) -> Choice:
    """Which candidates the whole does best with."""
    models = {name: [one.model for one in own] for name, own in found.fits.items()}
    both: Mapping[str, Sequence[AbstractModel]] = {**models, **{name: [model] for name, model in found.fixed.items()}}
    alone = {**found.alone, **dict.fromkeys(found.fixed, 0)}

    def make(say: Callable[[str], None]) -> dict[str, Any]:
        return asdict(choose_together(composite, both, alone, selection, outputs=plan.outputs, report=say))

    decided = keeper.decide(
        Decision(
            name=CHOOSING,
            title=CHOOSING_TITLE,
            terms={
                "models": {name: [model.to_dict() for model in own] for name, own in both.items()},
                "whole": assembled(composite, {name: own[alone[name]] for name, own in both.items()}).to_dict(),
                "outputs": list(plan.outputs),
                "selection": [trace.digest for trace in selection],
            },
            runs=(choose_together, *{type(model) for own in both.values() for model in own}),
            make=make,
            outcome=lambda choice: f"{choice['tried']} wholes, best {choice['score']:.3g}",
        )
    )
    return Choice(**decided)
