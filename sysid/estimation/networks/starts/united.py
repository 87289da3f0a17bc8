"""Several starts of one fit as one model: who belongs to it, and the choice between it and a single start.

Fits of one structure from other starts explain a short record alike and differ elsewhere, and the error of their mean
is never above the mean of their errors (its square; Krogh and Vedelsby 1995, "Neural network ensembles, cross
validation, and active learning": by as much as the members differ).

Selection traces elect the members (``election.py``). Where there are none, the best starts at their ends count alike,
without those who stand alone: the members are run on over the records' inputs *backwards*, which nobody measured, and
whoever is there :data:`ALONE` times as far from the median of all as they are in the median is left out. So is who
leaves :data:`BEHIND` times the error of the best on the records themselves.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.networks.starts.cautious import pays
from sysid.estimation.networks.starts.choosing import Choice, choose, rank, refusal
from sysid.estimation.networks.starts.multistart import Candidate, Network, Place
from sysid.estimation.networks.training import Training
from sysid.traces import Trace

ALONE = 1.5
"""Times the median distance from the median of all members beyond which one stands alone. On three simulated plants
with 3 % of noise, two structures and three seeds each, the mean of eight starts less these has 13 % less error on
unseen records than the best start by the evidence (geometric mean); 1.2 and 2 do nearly as well, 3 has 3 % less, all
eight have 20 % more."""
FEWEST = 3
"""Members without which there is no median to stand apart from."""
BEHIND = 2.0
"""Times the least error on the records, as a root of a mean square, beyond which a start is left out."""


def elects(training: Training, selection: Sequence[Trace]) -> bool:
    """Whether selection traces elect the members.

    Args:
        training: How starts are trained.
        selection: The traces.

    Returns:
        Whether there are some, and they choose.
    """
    return training.choose_by == "selection" and bool(selection)


def ends_of(candidates: Sequence[Candidate], choose_by: str) -> list[Candidate]:
    """Every start as it stood in the end.

    Args:
        candidates: Every start at every look.
        choose_by: As for :func:`~sysid.estimation.networks.starts.choosing.rank`.

    Returns:
        One of each start, of those that improved, the best first.
    """
    usable = [one for one in candidates if one.solution.status.usable]
    # Of a start that was fitted a second time, cautiously, the fit that stands before the other.
    order = sorted(usable, key=lambda one: (one.place is not Place.LAST, one.cautious, one.solution.state.iteration))
    return sorted({one.number: one for one in order}.values(), key=lambda one: rank(one, choose_by))


def stable_of(
    candidates: Sequence[Candidate], vet: Callable[[Network], bool] | None, most: int
) -> tuple[list[Candidate], tuple[int, ...]]:
    """The first candidates whose free runs are stable: where one member runs away, so does the mean.

    Args:
        candidates: The best first.
        vet: Whether a model's free run is stable; ``None`` for all.
        most: So many at most.

    Returns:
        They, and the numbers of those that were passed over.
    """
    kept, left = list[Candidate](), list[int]()
    for one in candidates:
        if len(kept) == most:
            break
        if vet is None or vet(one.model):
            kept.append(one)
        else:
            left.append(one.number)
    return kept, tuple(left)


def distances(
    runs: Sequence[NDArray[np.float64]], among: Sequence[NDArray[np.float64]] | None = None
) -> NDArray[np.float64]:
    """How far each start is from the median of all.

    Args:
        runs: What each does over the records' inputs backwards, in scaled numbers, all of one shape.
        among: Those of which the median is taken; all by default.

    Returns:
        Roots of mean squares, shape ``(n_starts,)``; infinite for a run that is not finite, which does not count.
    """
    finite = [run for run in (runs if among is None else among) if np.isfinite(run).all()]
    middle = np.median(finite, axis=0) if finite else np.nan
    with np.errstate(all="ignore"):
        away = np.array([np.sqrt(np.mean((run - middle) ** 2)) for run in runs])
    return np.where(np.isfinite(away), away, np.inf)


def stand_together(near: Sequence[bool], backwards: Sequence[NDArray[np.float64]]) -> list[bool]:
    """Who neither stands alone nor is far behind.

    Args:
        near: Of each start whether it is not far behind on the records.
        backwards: What each does over the records' inputs backwards, in scaled numbers, all of one shape.

    Returns:
        Whether, for each.
    """
    if sum(near) < FEWEST:
        return list(near)
    away = distances(backwards, [run for run, one in zip(backwards, near, strict=True) if one])
    limit = ALONE * np.median(away[list(near)])
    return [one and bool(distance <= limit) for one, distance in zip(near, away, strict=True)]


def keep_up(candidates: Sequence[Candidate], n_samples: int) -> list[bool]:
    """Who is not far behind on the records.

    Args:
        candidates: Starts.
        n_samples: Samples that count.

    Returns:
        Of each whether it is within :data:`BEHIND` of the least error, or the least does not pay for the parameters
        that it has more (:func:`~sysid.estimation.networks.starts.cautious.pays`).
    """
    if not candidates:
        return []
    best = min(candidates, key=lambda one: one.loss)
    return [one.loss <= BEHIND**2 * best.loss or not pays(best, one, n_samples) for one in candidates]


@dataclass(frozen=True, kw_only=True, eq=False)
class AbstractUnited(ABC):
    """The ensemble as one more candidate of its multistart.

    Args:
        candidate: It.
        left_out: Starts that stand alone, or far behind.
        unstable: Starts that were refused, as a rule as their own free run is not stable.
        elected: Whether selection traces found it, and tell what it is worth; it is asked for, and taken, elsewhere.
    """

    candidate: Candidate
    left_out: tuple[int, ...]
    unstable: tuple[int, ...]
    elected: bool

    @property
    @abstractmethod
    def made(self) -> str:
        """What it is of its members, and what it costs, in words; to follow "An ensemble:"."""

    def choice(self, candidates: Sequence[Candidate], by: str, vet: Callable[[Network], bool] | None) -> Choice:
        """The choice between it and all starts.

        Args:
            candidates: All starts, at every look.
            by: As for :func:`~sysid.estimation.networks.starts.choosing.rank`.
            vet: Whether a model's free run is stable; an ensemble must be.

        Returns:
            The choice.
        """
        everyone = (*candidates, self.candidate)
        if self.elected:
            return choose(everyone, by, vet)
        stable = None if vet is None else vet(self.candidate.model)
        if stable is False:
            found = choose(candidates, by, vet)
            return replace(found, stable=(*found.stable, False))
        looked = (*(None for _ in candidates), stable)
        return Choice(chosen=self.candidate, stable=looked, by=by, refusal=refusal(vet))

    def notes(self, choice: Choice) -> tuple[str, ...]:
        """What is said of it.

        Args:
            choice: What was chosen in the end.

        Returns:
            Sentences.
        """
        if choice.chosen is not self.candidate:
            unstable = choice.stable[-1] is False
            why = choice.refusal.replace("their", "its") if unstable else "a single start does as well"
            members = len(set(self.candidate.members))
            return (f"The ensemble of {members} starts was not taken: {why}.",)
        left = _left_out("they stand alone or far behind", self.left_out)
        left += _left_out(choice.refusal.replace("their", "their own"), self.unstable)
        return (f"An ensemble: {self.made}.{left}",)


def told(training: Training, whole: AbstractUnited | None, choice: Choice) -> tuple[str, ...]:
    """What is said of an ensemble that was asked for, also where there is none.

    Args:
        training: How starts were trained.
        whole: The ensemble, where one was made.
        choice: What was chosen in the end.

    Returns:
        Sentences.
    """
    if whole is not None:
        return whole.notes(choice)
    none = (
        "No ensemble was made: of its starts one alone does as well as any mean of several, or fewer than two are left."
    )
    return (none,) * (training.ensemble > 1)


def _left_out(why: str, numbers: Sequence[int]) -> str:
    """Who was left out, as a sentence; nothing where nobody was."""
    return f" Left out, as {why}: start {', '.join(str(number + 1) for number in numbers)}." if numbers else ""
