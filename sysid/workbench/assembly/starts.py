"""The whole training, from several starts: the best on the selection traces, or the mean of a committee of them.

What a record does not determine each start fills in its own way. One that goes astray there shows on traces that it
was not fitted to, and those that do not go astray are wrong in ways of their own, of which a mean keeps the less the
more of them there are. The committee is grown one start at a time, as long as the error of its mean on the selection
traces falls: Caruana, Niculescu-Mizil, Crew and Ksikes, "Ensemble selection from libraries of models", ICML 2004, in
its plainest form, each start at most once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.composite.active_learning import Growth
from sysid.composite.members import free_runs, score_of, whole_score
from sysid.models import Cascade, mean_of
from sysid.traces import Trace
from sysid.workbench.assembly.candidates import Candidates
from sysid.workbench.assembly.context import Context
from sysid.workbench.assembly.course import Course
from sysid.workbench.assembly.material import Material
from sysid.workbench.assembly.rounds import RoundDone
from sysid.workbench.runner import events

Runs = Sequence[NDArray[np.float64]]
"""Free runs of a whole on some traces, an array of shape ``(n_samples, n_outputs)`` of each."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Trained:
    """What a run has trained.

    Args:
        stages: Wholes by what they are called: of one start its stages, of several each one's best, and their mean.
        notes: Sentences on how they came about, but for the rounds of training end to end.
        candidates: The members' candidates; of several starts those of the best one; ``None`` of a whole that was begun
            from another one.
        growth: What growing the training data brought, where it was asked for.
        rounds: The rounds of training end to end; of several starts those of the chosen ones.
    """

    stages: dict[str, Cascade]
    notes: tuple[str, ...]
    candidates: Candidates | None
    growth: tuple[Growth, ...]
    rounds: tuple[RoundDone, ...]


def train(context: Context, material: Material) -> Trained:
    """Train the whole from all its starts.

    Args:
        context: The run.
        material: What it is trained on.

    Returns:
        What came of it.
    """
    courses = []
    for number in range(1, context.config.starts + 1):
        courses.append(Course(context=context.of_start(number), material=material))
        courses[-1].run()
    if len(courses) == 1:
        (only,) = courses
        return Trained(
            stages=only.stages, notes=tuple(only.notes), candidates=_candidates(only), growth=tuple(only.growth),
            rounds=tuple(only.rounds),
        )  # fmt: skip
    return _the_best_of(courses, context, material)


def _the_best_of(courses: Sequence[Course], context: Context, material: Material) -> Trained:
    """Each start as it does best on the selection traces, and the mean of the committee."""
    config, traces = context.config, material.choosing
    outputs, step = config.choose_on or config.outputs, f"Choosing among {len(courses)} starts"
    context.tell(events.StepStarted(step=step))
    stages, notes = {}, []
    for course in courses:
        scores = {stage: whole_score(whole, traces, outputs) for stage, whole in course.stages.items()}
        best = min(scores, key=lambda stage: scores[stage])
        stages[f"start {course.context.start}"] = course.stages[best].upstream_of(config.wanted)
        notes.append(
            f"Start {course.context.start} (seed {course.context.config.seed}) does best on the selection traces "
            f"{best}: {scores[best]:.3g}."
        )
    wholes = list(stages.values())
    chosen = committee([free_runs(one, traces, outputs) for one in wholes], traces, outputs, config.committee)
    called = f"start {chosen[0] + 1}"
    if len(chosen) > 1:
        called = f"mean of starts {', '.join(str(index + 1) for index in chosen)}"
        stages[called] = mean_of([wholes[index] for index in chosen], config.wanted)
    elif config.committee > 1:
        notes.append(f"No mean of {called} and another one does better on the selection traces than {called} alone.")
    context.tell(events.StepDone(step=step, stored=False, detail=called))
    notes += [
        f"Start {index + 1}, {note[:1].lower()}{note[1:]}" for index in sorted(chosen) for note in courses[index].notes
    ]
    rounds = tuple(one for index in sorted(chosen) for one in courses[index].rounds)
    first = courses[chosen[0]]
    return Trained(
        stages=stages, notes=tuple(notes), candidates=_candidates(first), growth=tuple(first.growth), rounds=rounds
    )


def _candidates(course: Course) -> Candidates | None:
    return course.candidates[0] if course.candidates else None


def committee(wholes: Sequence[Runs], traces: Sequence[Trace], outputs: Sequence[str], most: int) -> list[int]:
    """Of which wholes to take the mean: the best one, and others as long as the mean gets better.

    Args:
        wholes: Free runs of each whole.
        traces: The traces, which choose.
        outputs: The outputs.
        most: How many at most.

    Returns:
        Positions of the wholes, in the order in which they were taken.
    """
    chosen: list[int] = []
    best = np.inf
    while len(chosen) < min(most, len(wholes)):
        scores = {
            index: score_of(_means([wholes[i] for i in (*chosen, index)]), traces, outputs)
            for index in range(len(wholes))
            if index not in chosen
        }
        index = min(scores, key=lambda one: scores[one])
        if chosen and not scores[index] < best:
            break
        chosen, best = [*chosen, index], scores[index]
    return chosen


def _means(wholes: Sequence[Runs]) -> Runs:
    """Trace by trace the mean of what some wholes put out."""
    return [np.mean(runs, axis=0) for runs in zip(*wholes, strict=True)]
