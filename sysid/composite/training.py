"""Training a composite: members alone, chosen together, retrained, end to end in rounds, by active learning.

Each stage begins from the members of the one before, and the whole is scored after each, so that one sees what it
brought. What stands in the end is the stage that does best on the selection traces.
"""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain

from sysid.composite.active_learning import LEARNED, ActiveLearned, Round, learn_actively
from sysid.composite.candidates import Candidates, Given, fit_candidates
from sysid.composite.composite import Composite
from sysid.composite.fixed.equations import unit_contradictions_of
from sysid.composite.fixed_members import with_fixed
from sysid.composite.keeper import Keeper, MakeAll, Task
from sysid.composite.limit_check import LimitCheck, check_limits
from sysid.composite.members import Members, assembled, dealt, whole_score
from sysid.composite.parameters import values_in
from sysid.composite.plan import Retraining, RoundPlan, TrainingPlan
from sysid.composite.rounds.rehearsal import rehearse
from sysid.composite.rounds.round import JointRound, TrainedRound
from sysid.composite.stages import model_of, reading_more, retrain
from sysid.composite.training_data import TrainingData
from sysid.composite.warm_start import started_from
from sysid.errors import ConfigError
from sysid.estimation import CascadeFit, FitResult
from sysid.estimation.results.result import Status
from sysid.models import Cascade
from sysid.traces import Trace

BEGUN = "as it was begun from"
ONE_STEP = "each alone, one step ahead"
ALONE, CHOSEN, RETRAINED = "each alone", "chosen together", "retrained"
TOGETHER = "trained end to end"


@dataclass(frozen=True, kw_only=True)
class Retrained:
    """A member that was trained again on what the others put out.

    Args:
        output: The member's.
        round: Of the retraining, from 1 on.
        before: The whole's error on the selection traces before.
        after: The same with the retrained member.
    """

    output: str
    round: int
    before: float
    after: float

    @property
    def kept(self) -> bool:
        """Whether the whole has it."""
        return self.after < self.before

    @property
    def sentence(self) -> str:
        """For the report."""
        return (
            f"{self.output} retrained on what the others put out (round {self.round}): the whole's error on the "
            f"selection traces goes from {self.before:.3g} to {self.after:.3g}; {'kept' if self.kept else 'not kept'}."
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class TrainedComposite:
    """What a training came to.

    Args:
        stages: The whole after each stage, in their order.
        selection: Score of each stage on the traces that choose (geometric mean over traces and outputs of the mean
            squared error of the free run).
        candidates: The members' candidates; ``None`` where the whole was begun from another one.
        retrained: Members that were trained again.
        rounds: The rounds of training end to end, those of active learning among them.
        active_learning: What active learning brought; ``None`` without it.
        limits: What is declared of limits, beside all that was fitted.
        units: What contradicts itself in the units of equations that are fixed.
    """

    stages: Dict[str, Cascade]
    selection: Dict[str, float]
    candidates: Candidates | None = None
    retrained: tuple[Retrained, ...] = ()
    rounds: tuple[TrainedRound, ...] = ()
    active_learning: ActiveLearned | None = None
    limits: LimitCheck
    units: tuple[str, ...] = ()

    @property
    def chosen(self) -> str:
        """The stage that does best on the traces that choose."""
        return _best(self.selection)

    @property
    def model(self) -> Cascade:
        """The whole of that stage."""
        return self.stages[self.chosen]

    @property
    def parameters(self) -> dict[str, float]:
        """What the equations of :attr:`model` have for parameters that are estimated, by name, in their units."""
        return values_in(self.model)

    @property
    def notes(self) -> list[str]:
        """Sentences on how it came about, but for the rounds that ended as they should."""
        alone = len(self.rounds) == 1
        unstable = [one for one in self.rounds if one.fit.status is Status.UNSTABLE]
        said = [one.fit.status.value if alone else f"Round {one.name}: {one.fit.status.value}" for one in unstable]
        choice = [] if self.candidates is None or self.candidates.choice is None else [self.candidates.sentence]
        learned = [] if self.active_learning is None else [self.active_learning.sentence]
        estimated = [f"Round {one.name}: {told}" for one in self.rounds for told in one.fit.told_of_equations]
        return [*self.units, *choice, *(one.sentence for one in self.retrained), *said, *estimated, *learned]


def train(
    composite: Composite,
    plan: TrainingPlan,
    data: TrainingData,
    *,
    begin: Cascade | None = None,
    given: Given | None = None,
    keeper: Keeper | None = None,
) -> TrainedComposite:
    """Train a composite through all stages of a plan.

    Args:
        composite: What is declared.
        plan: The stages.
        data: The traces, without what the fixed submodels say; that is added.
        begin: A trained whole to go on from: its networks stand where the members would be fitted.
        given: By the member's output, fits that are candidates as they are.
        keeper: Where fits are kept, and who hears of them; nowhere and nobody by default.

    Returns:
        Every stage, and which one does best.

    Raises:
        ConfigError: If the members cannot be wired, or a stage cannot be trained so; said before anything is fitted.
        ChannelError: If a trace lacks a channel.
    """
    for one in plan.all_rounds:
        if strangers := [name for name in one.also if name not in data.also]:
            raise ConfigError(
                f"also names {', '.join(strangers)}, which the training data lack",
                where="also",
                expected=f"some of {', '.join(data.also) or 'none'}",
                got=", ".join(one.also),
                remedy="add the traces to the training data's also, or take the name out",
            )
    if plan.active_learning is not None and data.pool is None:
        raise ConfigError(
            "active learning has nothing to add from",
            where="pool",
            expected="a pool of sequences, or a callable that makes them",
            got="none",
            remedy="give the training data a pool",
        )
    seen = data.with_fixed(composite)
    rehearse(composite, plan, seen.estimation[0])
    training = _Training(composite=composite, plan=plan, data=seen, keeper=keeper or MakeAll())
    training.run(begin, given)
    selection = {name: whole_score(one, seen.choosing, plan.outputs) for name, one in training.stages.items()}
    whole = training.stages[_best(selection)]
    return TrainedComposite(
        stages=training.stages,
        selection=selection,
        candidates=training.candidates[0] if training.candidates else None,
        retrained=tuple(training.retrained),
        rounds=tuple(training.rounds),
        active_learning=training.active_learning[0] if training.active_learning else None,
        limits=check_limits(
            composite, with_fixed(composite.fixed, data.fitted, values_in(whole)) if composite.free else seen.fitted
        ),
        units=tuple(unit_contradictions_of(composite.fixed, seen.estimation[0])),
    )


def _best(selection: Dict[str, float]) -> str:
    return min(selection, key=lambda stage: selection[stage])


@dataclass(frozen=True, kw_only=True, eq=False)
class _Training:
    """A training on its way: what it has, stage after stage."""

    composite: Composite
    plan: TrainingPlan
    data: TrainingData
    keeper: Keeper
    stages: dict[str, Cascade] = field(default_factory=dict)
    candidates: list[Candidates] = field(default_factory=list)
    retrained: list[Retrained] = field(default_factory=list)
    rounds: list[TrainedRound] = field(default_factory=list)
    active_learning: list[ActiveLearned] = field(default_factory=list)

    def run(self, begin: Cascade | None, given: Given | None) -> None:
        """Go through all stages."""
        if begin is not None:
            self.stages[BEGUN] = whole = started_from(self.composite, begin, self.data.estimation[0])
        else:
            models = self._members(given)
            if self.plan.retrain is not None:
                models = self._retrain(models, self.plan.retrain)
            whole = assembled(self.composite, models)
        for number, one in enumerate(self.plan.rounds, start=1):
            suffix = "" if number == 1 else f", round {number}"
            name = "together" if number == 1 else f"together-{number}"
            traces = self._estimation(one)[: one.traces]
            title = f"Training end to end{suffix}"
            whole, _ = self._round(one, whole, traces, name=name, title=title, called=str(number))
            self.stages[f"{TOGETHER}{suffix}"] = whole
        self._learn_actively(whole)

    def _members(self, given: Given | None) -> Members:
        """Every member's candidates; the best of each alone, and those that are best together."""
        data = self.data
        found = fit_candidates(
            self.composite, self.plan, data.estimation, data.selection, given=given, keeper=self.keeper
        )
        self.candidates.append(found)
        if found.one_step is not None:
            self.stages[ONE_STEP] = assembled(self.composite, found.one_step)
        self.stages[ALONE] = assembled(self.composite, found.models(found.alone))
        if found.choice is not None:
            self.stages[CHOSEN] = assembled(self.composite, found.models(found.chosen))
        return found.models(found.chosen)

    def _retrain(self, models: Members, asked: Retraining) -> Members:
        """Members trained again, each kept where the whole does better with it."""
        data, best = self.data, self._score(models)
        for number in range(asked.rounds):
            for output in asked.members:
                member = self.composite.member(output)
                task = Task(
                    name=f"{member.mapping} retrained {number}",
                    title=f"Retraining {member.mapping} on what the others put out, round {number + 1}",
                    terms={
                        "member": member.terms,
                        "iterations": asked.max_iterations,
                        "whole": assembled(self.composite, models).to_dict(),
                        "estimation": [trace.digest for trace in data.estimation[: member.traces]],
                        "selection": [trace.digest for trace in data.selection],
                    },
                    runs=(retrain, *{type(model) for model in models.values()}),
                    make=partial(
                        retrain, self.composite, output, models,
                        estimation=data.estimation, selection=data.selection, max_iterations=asked.max_iterations,
                    ),
                    kind=FitResult,
                    limit_s=member.training.max_time_s,
                )  # fmt: skip
                changed = {**models, output: model_of(self.keeper.keep(task))}
                done = Retrained(output=output, round=number + 1, before=best, after=self._score(changed))
                self.retrained.append(done)
                if done.kept:
                    models, best = changed, done.after
        self.stages[RETRAINED] = assembled(self.composite, models)
        return models

    def _score(self, models: Members) -> float:
        return whole_score(assembled(self.composite, models), self.data.selection, self.plan.outputs)

    def _learn_actively(self, whole: Cascade) -> None:
        """Rounds of training end to end on what the whole is worst at, each a stage of its own."""
        asked, pool = self.plan.active_learning, self.data.pool
        if asked is None or pool is None:
            return
        last, held_out = self.plan.rounds[-1], self.data.held_out

        def learn(now: Cascade, traces: Sequence[Trace], number: int) -> tuple[Cascade, float]:
            took = 0.0
            for part, one in enumerate(asked.rounds, start=1):
                suffix = f".{part}" if len(asked.rounds) > 1 else ""
                now, seconds = self._round(
                    replace(one, traces=None),  # what was added is never cut off
                    now,
                    traces,
                    name=f"active-learning-{number}{suffix.replace('.', '-')}",
                    title=f"Active learning, round {number}{suffix}, on {len(traces)} traces",
                    called=f"{number}{suffix} of active learning",
                    # By the others alone, a round that has learnt what the pool has of rare things is not taken.
                    chosen_by=held_out,
                )
                took += seconds
            self.stages[f"{LEARNED}, round {number}"] = now
            return now, took

        learned = learn_actively(
            asked, whole, learn, begins=list(self.stages)[-1], estimation=self._estimation(last)[: last.traces],
            pool=pool, held_out=held_out, report=self._looked,
            score=lambda one: whole_score(one, self.data.choosing, self.plan.outputs),
        )  # fmt: skip
        self.active_learning.append(learned)

    def _looked(self, done: Round) -> None:
        """Tell what the sequences that train nothing say after a round of active learning."""
        title = f"Assessing sequences that train nothing, after round {done.number} of active learning"
        now = done.assessment
        detail = f"{100.0 * now.within:.3g} % within, 99 % under {now.rare:.3g}, {done.samples} samples"
        self.keeper.say(title)
        self.keeper.say(title, detail, done=True)

    def _estimation(self, one: RoundPlan) -> list[Trace]:
        """All traces that a round may be fitted to."""
        return dealt([self.data.estimation, *(self.data.also[name][0] for name in one.also)])

    def _round(
        self,
        one: RoundPlan,
        whole: Cascade,
        traces: Sequence[Trace],
        *,
        name: str,
        title: str,
        called: str,
        chosen_by: Sequence[Trace] = (),
    ) -> tuple[Cascade, float]:
        """The whole after a round of training end to end, and the seconds that took."""
        also = chain.from_iterable(self.data.also[data][1] for data in one.also)
        selection = [*self.data.selection, *also, *chosen_by]
        started = reading_more(whole, one.reads)
        ready = JointRound.of(self.composite, one, started, estimation=traces, selection=selection)
        task = Task(
            name=name,
            title=title,
            terms={"together": one.terms, **ready.terms},
            runs=(f"{JointRound.__module__}:JointRound.fit", *{type(model) for model in ready.part.models}),
            make=lambda report: ready.put(ready.fit(report)),
            kind=CascadeFit,
            put=ready.put,
            limit_s=ready.training.max_time_s,
        )
        fit = self.keeper.keep(task)
        self.rounds.append(TrainedRound.of(self.composite, one, ready, fit, called))
        return fit.model, fit.train_time_s
