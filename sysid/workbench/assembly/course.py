"""The course of an assembly's training: alone, chosen together, retrained, end to end, grown; every fit kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import chain

from sysid.composite.active_learning import GROWN, Growth, Round, grow
from sysid.composite.members import Members, assembled, dealt, whole_score
from sysid.composite.round import JointRound
from sysid.composite.stages import (
    model_of,
    reading_more,
    retrain,
)
from sysid.estimation import CascadeFit
from sysid.estimation.result import Status
from sysid.models import Cascade
from sysid.traces import Trace
from sysid.workbench.assembly.begun import begun, read_whole
from sysid.workbench.assembly.candidates import Candidates, fit_candidates
from sysid.workbench.assembly.context import Context, training_code
from sysid.workbench.assembly.material import Material
from sysid.workbench.assembly.rounds import RoundDone
from sysid.workbench.assembly.stage_config import TogetherConfig
from sysid.workbench.fits.record import is_final
from sysid.workbench.runner import events
from sysid.workbench.runner.store import digest, read_json, strict, write_json

BEGUN = "as it was begun from"
ONE_STEP = "each alone, one step ahead"
ALONE, CHOSEN, RETRAINED = "each alone", "chosen together", "retrained"
TOGETHER = "trained end to end"


@dataclass(frozen=True, kw_only=True, eq=False)
class Course:
    """The training of one start.

    Args:
        context: The run.
        material: What it is trained on.
        notes: Sentences on how it came about, but for the rounds of training end to end.
        stages: The whole after each stage.
        candidates: The members' candidates, unless the whole was begun from another one.
        growth: What growing the training data brought, where it was asked for.
        rounds: The rounds of training end to end, those of growth among them.
    """

    context: Context
    material: Material
    notes: list[str] = field(default_factory=list)
    stages: dict[str, Cascade] = field(default_factory=dict)
    candidates: list[Candidates] = field(default_factory=list)
    growth: list[Growth] = field(default_factory=list)
    rounds: list[RoundDone] = field(default_factory=list)

    def run(self) -> None:
        """Go through all stages."""
        estimation, selection = self.material.estimation, self.material.selection
        if self.context.config.begin is not None:
            given, said = read_whole(self.context.beside / self.context.config.begin)
            self.notes.append(said)
            self.stages[BEGUN] = whole = begun(self.context.config, given, estimation[0])
        else:
            models, key = self._members(estimation, selection)
            whole = assembled(self.context.config, self._retrained(models, key, estimation, selection))
        self._grown(self._together(whole))

    def _members(self, estimation: Sequence[Trace], selection: Sequence[Trace]) -> tuple[Members, str]:
        """Every member's candidates; the best of each alone, and those that are best together."""
        config = self.context.config
        found = fit_candidates(self.context, estimation, selection)
        self.candidates.append(found)
        if found.one_step is not None:
            self.stages[ONE_STEP] = assembled(config, found.one_step)
        self.stages[ALONE] = assembled(config, found.models(found.alone))
        if found.choice is not None:
            self.notes.append(found.sentence)
            self.stages[CHOSEN] = assembled(config, found.models(found.chosen))
        return found.models(found.chosen), found.key

    def _retrained(self, models: Members, key: str, estimation: Sequence[Trace], selection: Sequence[Trace]) -> Members:
        asked = self.context.config.retrain
        if asked is None:
            return models
        outputs = self.context.config.choose_on or self.context.config.outputs
        best = whole_score(assembled(self.context.config, models), selection, outputs)
        members = {member.mapping.output: member for member in self.context.config.members}
        for number in range(asked.rounds):
            for name in asked.members:
                member = members[name]
                fit, key = self.context.fit(
                    f"{member.slug}-retrained-{number}",
                    f"Retraining {member.mapping} on what the others put out, round {number + 1}",
                    {
                        "before": key,
                        "member": name,
                        "iterations": asked.max_iterations,
                        "whole": assembled(self.context.config, models).to_dict(),
                    },
                    partial(
                        retrain,
                        self.context.config,
                        member,
                        models,
                        estimation=estimation,
                        selection=selection,
                        max_iterations=asked.max_iterations,
                    ),
                    models.values(),
                )
                changed = {**models, name: model_of(fit)}
                score = whole_score(assembled(self.context.config, changed), selection, outputs)
                verdict = "kept" if score < best else "not kept"
                self.notes.append(
                    f"{name} retrained on what the others put out (round {number + 1}): the whole's error on the "
                    f"selection traces goes from {best:.3g} to {score:.3g}; {verdict}."
                )
                if score < best:
                    models, best = changed, score
        self.stages[RETRAINED] = assembled(self.context.config, models)
        return models

    def _together(self, whole: Cascade) -> Cascade:
        """Every round of training end to end, each from where the one before ended."""
        for number, one in enumerate(self.context.config.joint, start=1):
            suffix = "" if number == 1 else f", round {number}"
            whole, _ = self._trained(
                one,
                reading_more(whole, one.reads),
                self._estimation(one)[: one.traces],
                name="together" if number == 1 else f"together-{number}",
                title=f"Training end to end{suffix}",
                called=str(number),
            )
            self.stages[f"{TOGETHER}{suffix}"] = whole
        return whole

    def _grown(self, whole: Cascade) -> None:
        """Rounds of training end to end on what the whole is worst at, each a stage of its own."""
        asked, rounds = self.context.config.grow, self.context.config.growing
        if asked is None or self.material.pool is None:
            return
        outputs = self.context.config.choose_on or self.context.config.outputs
        last = self.context.config.joint[-1]
        sources, held_out = self.material.pool

        def train(now: Cascade, traces: Sequence[Trace], number: int) -> tuple[Cascade, float]:
            took = 0.0
            for part, one in enumerate(rounds, start=1):
                suffix = f".{part}" if len(rounds) > 1 else ""
                now, seconds = self._trained(
                    one.model_copy(update={"traces": None}),  # what was added is never cut off
                    now,
                    traces,
                    name=f"grown-{number}{suffix.replace('.', '-')}",
                    title=f"Growing, round {number}{suffix}, on {len(traces)} traces",
                    called=f"{number}{suffix} of growth",
                    # By the others alone, a round that has learnt what the pool has of rare things is not taken.
                    chosen_by=held_out,
                )
                took += seconds
            self.stages[f"{GROWN}, round {number}"] = now
            return now, took

        grown = grow(
            asked, whole, train, begins=list(self.stages)[-1], estimation=self._estimation(last)[: last.traces],
            pool=sources, held_out=held_out, report=self._looked,
            score=lambda one: whole_score(one, self.material.choosing, outputs),
        )  # fmt: skip
        self.growth.append(grown)
        self.notes.append(grown.sentence)

    def _looked(self, done: Round) -> None:
        """Tell what the pool's other sequences say after a round of growth."""
        step = self.context.titled(f"Looking at sequences that train nothing, after round {done.number} of growth")
        detail = f"{100.0 * done.look.within:.3g} % within, 99 % under {done.look.rare:.3g}, {done.samples} samples"
        self.context.tell(events.StepStarted(step=step))
        self.context.tell(events.StepDone(step=step, stored=False, detail=detail))

    def _estimation(self, one: TogetherConfig) -> list[Trace]:
        """All traces that a round may be fitted to."""
        return dealt([self.material.estimation, *(self.material.also[name][0] for name in one.also)])

    def _trained(
        self,
        one: TogetherConfig,
        whole: Cascade,
        traces: Sequence[Trace],
        *,
        name: str,
        title: str,
        called: str,
        chosen_by: Sequence[Trace] = (),
    ) -> tuple[Cascade, float]:
        """The whole after a round of training end to end, and the seconds that took; the table has a row more."""
        config = self.context.config
        also = chain.from_iterable(self.material.also[data][1] for data in one.also)
        selection = [*self.material.selection, *also, *chosen_by]
        ready = JointRound.of(config, one, whole, estimation=traces, selection=selection)
        asked_for = one.model_dump(mode="json", exclude={"again", "also"})  # their traces are among the round's
        code = training_code(f"{JointRound.__module__}:JointRound.fit", ready.part.models)
        key = digest(strict({"code": code, "together": asked_for, **ready.terms}))
        fit = self._round(self.context.named(name), self.context.titled(title), key, ready)
        start = None if config.starts == 1 else self.context.start
        self.rounds.append(RoundDone.of(config, one, ready, fit, name=called, start=start))
        if fit.status is Status.UNSTABLE:  # a word in a table is not enough for this
            only = len(config.joint) == 1 and not config.growing
            self.notes.append(fit.status.value if only else f"Round {called}: {fit.status.value}")
        return fit.model, fit.train_time_s

    def _round(self, name: str, step: str, key: str, ready: JointRound) -> CascadeFit:
        """One round, stored under what it depends on."""
        file = self.context.store.path / f"{name}.json"
        self.context.tell(events.StepStarted(step=step))
        stored = not self.context.fresh and self.context.store.is_done(name, key)
        before = CascadeFit.from_dict(read_json(file)) if stored else None
        fit = ready.fit(self.context.reporter(step)) if before is None else ready.put(before)
        if before is None or before.model.to_dict() != fit.model.to_dict():
            write_json(file, fit.to_dict())
            if is_final(fit):
                self.context.store.mark_done(name, key, [file])
        self.context.tell(
            events.StepDone(step=step, stored=stored, detail=f"{fit.train_time_s:.1f} s, {fit.status.value}")
        )
        return fit
