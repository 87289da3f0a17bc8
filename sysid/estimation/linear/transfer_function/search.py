"""The search for the poles of a transfer function: dead times, several starts, the best one refined.

A structure may not fit the estimation record worse than one that it contains. So the structures with one zero or one
pole less are fitted first, each as it would be alone; their minima are starts, and where the search ends above one of
them all the same, it goes on from there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from sysid.errors import FitDivergedError
from sysid.estimation.clock import now
from sysid.estimation.least_squares.state import Iteration
from sysid.estimation.linear import slow_poles
from sysid.estimation.linear.delay_search import FEW, READ_BACKWARDS
from sysid.estimation.linear.pole_starts import PoleStart
from sysid.estimation.linear.transfer_function.between_samples import between_samples
from sysid.estimation.linear.transfer_function.delays import delays_of_least_error, found_delays
from sysid.estimation.linear.transfer_function.integrators import near_ones_put
from sysid.estimation.linear.transfer_function.pole_moves import filled_up, next_smaller, slowness
from sysid.estimation.linear.transfer_function.problem import AbstractProblem, Score
from sysid.estimation.linear.transfer_function.runs import (
    EXACT,
    Candidate,
    Delays,
    End,
    Watch,
    long_run,
    short_run,
    tried,
)
from sysid.estimation.linear.transfer_function.words import of_level, of_speed, of_stability, of_starts
from sysid.estimation.linear.variable_projection import Sections
from sysid.estimation.nonparametric.dead_time import descend
from sysid.estimation.results.result import FitResult, Loop
from sysid.models import AbstractModel, TransferFunction
from sysid.models.orders import intersample

NEAR_BEST = 1.1
"""Loss, relative to the least, up to which a minimum may be chosen by selection traces."""
SAME, NEAR = 1e-9, 1e-6
"""Relative difference of two losses that is none; and of one that was not run to its end."""
QUICK = 4
"""Steps over all samples by which a dead time is compared with its neighbours."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Reached:
    """Where the search in one structure ended.

    Args:
        problem: In which: with poles anywhere where the data ask for it.
        end: The minimum.
        notes: What a reader should know.
    """

    problem: AbstractProblem
    end: End
    notes: tuple[str, ...]


def solve(own: AbstractProblem, began: float, on_iteration: Callable[[Iteration], None], score: Score) -> FitResult:
    """Search dead times, run all starts to their minima, and take the best.

    Args:
        own: Data and structure.
        began: When the fit began, by ``sysid.estimation.clock.now``.
        on_iteration: Called after every iteration of the final run.
        score: What chooses between the minima of all starts, smaller is better; ``None`` to choose by the loss.

    Returns:
        The fit.

    Raises:
        FitDivergedError: If no start gives a finite free run.
    """
    watch = Watch(began=began, on_iteration=on_iteration)
    part = own.part() if own.training.max_iterations else None
    from_part = None if part is None else _from_part(own, part, watch, score)
    if from_part is None:
        delays, told = found_delays(own)
        reached = _reached(own, delays, watch, score, {})
    else:
        reached, told = from_part
    if reached is None:
        raise FitDivergedError("no start gives a finite free run", remedy="lower the number of poles")
    if own.between and own.orders.delays is None:
        reached = replace(reached, end=between_samples(reached.problem, reached.end, watch, score))
    end, unit = reached.end, own.scaling.output_scale**2
    model, uncertainty = reached.problem.model(end)
    fast, slow = (*of_speed(model), *own.at_end(end)), own.told(end)
    radius = slowness(end.sections, own.orders.domain, own.terms.sample_time)
    return FitResult(
        model=model,
        status=end.status,
        loop=Loop.CLOSED,
        history={
            "iteration": np.array([float(entry.iteration) for entry in end.curve]),
            "mse": np.array([entry.mse * unit for entry in end.curve]),
        },
        train_time_s=now() - began,
        seed=own.training.seed,
        uncertainty=uncertainty,
        notes=(
            *reached.notes,
            f"Dead times in samples: {', '.join(f'{k:.6g}' for k in end.delays)}."
            + intersample.told(own.orders.moving(own.terms.mapping.inputs), own.terms.mapping.inputs),
            *(told if reached.problem is own else ()),
            *end.notes,
            *slow,
            *of_level(model),
            of_stability(model),
            *fast,
        ),
        warnings=(
            *fast,
            *slow_poles.warnings(radius, end.lengths, slow),
            *(one for one in told if one == READ_BACKWARDS),
        ),
    )


def _from_part(
    own: AbstractProblem, part: AbstractProblem, watch: Watch, score: Score
) -> tuple[Reached, tuple[str, ...]] | None:
    """The minimum over all samples next to that of a part of them, and what is to be said of its dead times.

    Returns:
        Both; ``None`` where the part misleads: poles or dead times stand at its edge, or a start that was found
        over all samples leads further down.
    """
    delays, told = found_delays(part)
    if own.orders.delays is None and max(delays) + FEW >= part.delay_range()[1]:
        return None
    found = _reached(part, delays, watch.unseen(), score, {})
    if found is None or found.problem is not part:
        return None
    sections = found.end.sections
    radius = slowness(sections, own.orders.domain, own.terms.sample_time)
    if radius >= slow_poles.largest_pole(found.end.lengths):
        return None
    if own.orders.delays is None:
        delays = _delays_near(own, delays, sections)
    provider = own.provider(delays)
    begun = tried(PoleStart(name="stretches", sections=sections), delays, provider)
    end = long_run(begun, own.training, watch)
    rivals = [tried(start, delays, provider) for start in own.starts(provider, few=True)]
    rival = short_run(min(rivals, key=lambda one: one.loss).start, delays, provider, own.training)
    if not end.loss * provider.n_samples * (1.0 - NEAR) <= rival.loss:
        return None
    problem, end = _free_poles(own, end, delays, watch, score)
    end = end if problem.training.stable is own.training.stable else _snapped(problem, end, np.inf)
    return Reached(problem=problem, end=end, notes=(*found.notes, part.about_part())), told


def _delays_near(own: AbstractProblem, delays: Delays, sections: Sections) -> tuple[int, ...]:
    """Dead times of least error over all samples, by descent from those of a part of them and its poles."""
    (least, most), begun = own.delay_range(), tuple(map(int, delays))
    reach, quick = min(most, max(begun) + FEW), replace(own.training, short_iterations=QUICK)
    start, known = PoleStart(name="stretches", sections=sections), dict[Delays, float]()

    def loss(of: Delays) -> float:
        if of not in known:
            known[of] = short_run(start, of, own.provider(of, unknown=reach), quick).loss
        return known[of]

    return descend(begun, least, reach, loss)


def _reached(
    own: AbstractProblem,
    delays: Delays,
    watch: Watch,
    score: Score,
    known: dict[TransferFunction, Reached | None],
) -> Reached | None:
    """The minimum in this structure, not above that of any which it contains; ``None`` where none is finite."""
    smaller = _smaller(own, delays, watch, known)
    least = min(smaller, key=lambda one: one.end.loss, default=None)
    provider = own.provider(delays)
    starts = own.starts(provider, few=False, alone=least is None)
    if least is not None:
        sections = filled_up(least.end.sections, own.orders, own.terms.sample_time)
        starts.append(PoleStart(name=least.problem.orders.label, sections=sections))
    candidates = [short_run(start, delays, provider, own.training) for start in starts]
    best = min(candidates, key=lambda candidate: candidate.loss)
    if not np.isfinite(best.loss):
        return None
    end = _chosen(own, candidates, score, watch) if score else long_run(best, own.training, watch)
    problem, end = _free_poles(own, end, delays, watch, score)
    if least is not None:
        problem, end = _not_above(own, least, problem, end, watch, slack=1.0 if score is None else NEAR_BEST)
    ceiling = np.inf if least is None or least.end.loss < end.loss else least.end.loss
    end = end if problem.training.stable is own.training.stable else _snapped(problem, end, ceiling)
    notes = of_starts(candidates, best, own.scaling.output_scale**2)
    return Reached(problem=problem, end=end, notes=notes)


def _smaller(
    own: AbstractProblem, delays: Delays, watch: Watch, known: dict[TransferFunction, Reached | None]
) -> list[Reached]:
    """What the structures that this one contains reach, each as it would alone."""
    found = []
    wanted = own.training.max_iterations and not own.goes_on
    for orders in next_smaller(replace(own.orders, delays=delays)) if wanted else []:
        if orders not in known and now() - watch.began < own.training.max_time_s:
            known[orders] = _reached(own.with_orders(orders), delays, watch.unseen(), None, known)
        reached = known.get(orders)
        if reached is not None:
            found.append(reached)
    return found


def _not_above(
    own: AbstractProblem, least: Reached, problem: AbstractProblem, end: End, watch: Watch, *, slack: float
) -> tuple[AbstractProblem, End]:
    """The end, or where a run from the minimum of a smaller structure ends if it lies above that."""
    ceiling = least.end.loss * slack * (1.0 + SAME) + EXACT * least.end.power
    if end.loss <= ceiling:
        return problem, end
    other = least.problem.with_orders(replace(own.orders, delays=least.end.delays))
    provider = other.provider(least.end.delays)
    sections = filled_up(least.end.sections, own.orders, own.terms.sample_time)
    begun = tried(PoleStart(name=least.problem.orders.label, sections=sections), least.end.delays, provider)
    if not np.isfinite(begun.loss):
        return problem, end
    found = long_run(begun, own.training, watch)
    if not found.loss < end.loss:
        return problem, end
    same = other.training.stable is own.training.stable
    return own if same else other, replace(found, notes=least.end.notes)


def _snapped(own: AbstractProblem, end: End, ceiling: float) -> End:
    """The end with poles at 1 that are no further from there than the records can tell."""
    snapped = own.at_one(end)
    return end if snapped.loss > ceiling * (1.0 + SAME) + EXACT * end.power else snapped


def _free_poles(
    own: AbstractProblem, end: End, delays: Delays, watch: Watch, score: Score
) -> tuple[AbstractProblem, End]:
    """The same without bounds on the poles, where the data ask for it: plants that integrate, or are unstable.

    A pole beyond the edge is taken where the one within is significantly worse, and one at 1 where that is not.
    """
    free = own.unbounded() if own.training.stable is None else None
    if free is None:
        return own, end
    domain, sample_time, provider = own.orders.domain, own.terms.sample_time, free.provider(delays)
    slowest = slowness(end.sections, domain, sample_time)
    # A search among stable poles may put a dead time in place of an integrator: the shortest is asked, too.
    asked = {delays} if own.orders.delays is not None else {delays, (own.delay_range()[0],) * len(delays)}
    suggested = [free.free_starts(free.provider(one))[0].sections for one in sorted(asked)]
    if max(slowest, *(slowness(sections, domain, sample_time) for sections in suggested)) < own.asked_from(end):
        return own, end
    told: tuple[str, ...] = ()
    if own.orders.delays is None:  # those of a plant that cannot integrate need not be those of one that does
        delays, told = delays_of_least_error(free)
        provider = free.provider(delays)
    starts = [*free.free_starts(provider), PoleStart(name="the best bounded one", sections=end.sections)]
    runs = (short_run(start, delays, provider, free.training) for start in starts)
    best = min(runs, key=lambda run: run.loss)
    if not np.isfinite(best.loss):
        return own, end
    found = replace(long_run(best, free.training, watch), notes=told)
    free, found = _about_its_level(free, found, watch)
    # Poles may be anywhere in a plant that few samples say much of, but not for the sake of their noise: beyond
    # chance, the gain must be one that as many parameters as there are, fitted to it, could not have.
    if not end.worse_than(found, free=sum(own.orders.poles) + provider.n_taps):
        found = free.at_one(found)
        if not (own.held_back(slowest, end) and _is_clearly_better(found, end, own)):
            return own, end
    # Free poles are fitted from a free state. What begins where a start says has to follow from there as well: a
    # pole that is off 1 by little has an equilibrium where no plant ever was.
    judge = score or own.as_scored
    if judge is not None:
        there = (found, free.at_one(found), free.at_one(found, every=True))
        found = min(there, key=lambda one: judge(free.model(one)[0]))
        if not judge(free.model(found)[0]) < judge(own.model(end)[0]):
            return own, end
    return free, found


def _is_clearly_better(found: End, end: End, own: AbstractProblem) -> bool:
    """Whether an end with a pole at 1 beats one whose pole its bound holds back, which is no less free.

    It has to beat chance alone, of which errors that hang together have more.
    """
    at_one = abs(slowness(found.sections, own.orders.domain, own.terms.sample_time) - 1.0) <= slow_poles.INTEGRATES
    return at_one and slow_poles.significantly_better(found.errors, end.errors, parameters=0, scale=end.power)


def _about_its_level(free: AbstractProblem, found: End, watch: Watch) -> tuple[AbstractProblem, End]:
    """The same with the input at which the plant stands fitted too, where it is another than zero.

    Without it a pole a little off 1 makes the ramp, from a state as far away: a plant that grows, or one that settles.
    """
    near = slow_poles.REACH / max(len(record.target) for record in found.provider.records)
    put = near_ones_put(found.sections, free.orders.domain, free.terms.sample_time, near)
    there = replace(found, theta=found.provider.poles.theta(put))
    plain = free.at_one(found, every=True)  # the other poles as they are best there: a level has to beat that
    level = free.levelled(there)
    if level is None:
        return free, found
    begun = tried(PoleStart(name="level", sections=there.sections), found.delays, level.provider(found.delays))
    if not np.isfinite(begun.loss):
        return free, found
    other = level.at_one(long_run(begun, free.training, watch), every=True)
    # Each pole that leaves 1 brings a state of its own to bend a ramp by.
    bent = int(np.count_nonzero(found.theta != there.theta)) - 1
    if not plain.worse_than(other) or other.worse_than(found, free=max(bent, 0)):
        return free, found
    return level, replace(other, notes=found.notes)


def _chosen(
    own: AbstractProblem, candidates: list[Candidate], score: Callable[[AbstractModel], float], watch: Watch
) -> End:
    """The best by score of the minima that the starts lead to; one much worse than another is no fit."""
    ends = [(one, long_run(one, own.training, watch)) for one in candidates if np.isfinite(one.loss)]
    least = min(end.loss for _, end in ends)
    near = [(one, end) for one, end in ends if end.loss <= NEAR_BEST * least]
    scores = [score(own.model(end)[0]) for _, end in near]
    one, end = near[int(np.argmin(scores))]
    return replace(end, notes=(f"Chosen among {len(near)} minima by the selection traces: {one.start.name}.",))
