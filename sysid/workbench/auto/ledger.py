"""What a search has asked for and been told, and what of it may be chosen."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from sysid.errors import ConfigError
from sysid.estimation import Training
from sysid.estimation.estimators import estimator_of
from sysid.models import LinearStateSpace
from sysid.reporting.sweep_record import Trial
from sysid.workbench.auto.budget import Budget, size_of
from sysid.workbench.auto.families import FAMILIES, Family, Try
from sysid.workbench.auto.look import Looked
from sysid.workbench.auto.worth import Rank, ranked_by, scatter, with_repeats
from sysid.workbench.runner.store import digest
from sysid.workbench.sweep.search_space import Point
from sysid.workbench.sweep.trial import NOT_DONE

ALIKE = 0.03
"""Part of the least error within which another one counts as no worse; of those the smallest is chosen."""


@dataclass(kw_only=True, eq=False)
class Ledger:
    """Points, their trials, and their errors.

    Args:
        looked: What is in the record.
        budget: What may be spent.
        error: What chooses, as a mean square; infinite for what cannot be used.
        training: Options that every nonlinear model is trained with.
        families: What there is to try.
        tolerance: As for :func:`~sysid.workbench.auto.worth.ranked_by`.
    """

    looked: Looked
    budget: Budget
    error: Callable[[Trial], float]
    training: Mapping[str, Any] = field(default_factory=dict)
    families: Sequence[Family] = field(default_factory=lambda: FAMILIES)
    tolerance: float | None = None
    trials: list[Trial] = field(default_factory=list)
    scattered: dict[int, float] = field(default_factory=dict)
    """By the number of a trial that was repeated, how far its starts are apart, as
    :func:`~sysid.workbench.auto.worth.scatter` has it."""
    _tries: list[Try] = field(default_factory=list)
    _seen: set[str] = field(default_factory=set)
    _points: dict[int, Point] = field(default_factory=dict)
    _repeats: dict[int, int] = field(default_factory=dict)
    """By the number of a repeated point, the place of its trial."""
    _told_again: list[int] = field(default_factory=list)
    _united: set[int] = field(default_factory=set)
    """Numbers of points that are ensembles of those."""
    _asked: int = 0

    def tell(self, trials: Sequence[Trial]) -> None:
        """The results of the last round, in its order."""
        self.budget.tell(trials)
        again = [trial for trial in trials if trial.number in self._repeats]
        repeated = [trial for trial in again if trial.reason != NOT_DONE]
        self.trials += [trial for trial in trials if trial.number not in self._repeats]
        for place in dict.fromkeys(self._repeats[trial.number] for trial in repeated):
            own = [trial for trial in repeated if self._repeats[trial.number] == place]
            self.scattered[self.trials[place].number] = scatter([self.trials[place], *own])
            self.trials[place] = with_repeats(self.trials[place], own)
            self._told_again.append(place)

    def least(self, *, linear: bool | None = None) -> float:
        """The least error so far, as a mean square.

        Args:
            linear: Among linear models alone, or the others alone; among all by default.

        Returns:
            The error; infinite where there is none.
        """
        kinds = {family.kind for family in self.families if linear is None or family.linear is linear}
        errors = [self.error(t) for t in self.trials if t.structure["kind"] in kinds]
        return min(errors, default=math.inf)

    @property
    def _rank(self) -> Rank:
        return ranked_by(self.error, self.tolerance)

    def _least_outside(self) -> float:
        """The least share of what chooses that something does not stay within the tolerance on."""
        return min((self._rank(trial)[0] for trial in self.trials), default=math.inf)

    @property
    def _is_met(self) -> bool:
        """Whether something stays within the tolerance on all that chooses."""
        return self.tolerance is not None and self._least_outside() == 0.0

    @property
    def points(self) -> Mapping[int, Point]:
        """What was tried, by number."""
        return self._points

    @property
    def n_again(self) -> int:
        """Nonlinear models that were trained again."""
        return len(self._told_again)

    @property
    def candidates(self) -> list[Trial]:
        """What may be chosen: linear models, and nonlinear ones that did well again, where some did, or united.

        One that came to nothing again does not take away what all others have found, and one for which the time was up
        is worth what it was.
        """
        kinds = {family.kind for family in self.families if family.linear}
        again = {n for n in self._told_again if math.isfinite(self.error(self.trials[n]))}
        late = set(self._repeats.values()) - set(self._told_again)
        return [
            t
            for n, t in enumerate(self.trials)
            if n in again | late or not again or t.number in self._united or t.structure["kind"] in kinds
        ]

    def starts_of(self, trial: Trial) -> list[int]:
        """The numbers of points that are one trial: its own, and those of its repeats from other starts.

        Args:
            trial: The trial.

        Returns:
            The numbers.
        """
        return [trial.number, *(n for n, place in self._repeats.items() if self.trials[place].number == trial.number)]

    def _halves(self, kind: str) -> tuple[float, float]:
        """The least errors of the smaller and of the larger half of what was tried of a kind."""
        tried = [one for one in zip(self._tries, self.trials, strict=True) if one[0].structure.kind == kind]
        errors = [self.error(trial) for _, trial in sorted(tried, key=lambda one: size_of(one[0].structure))]
        middle = (len(errors) + 1) // 2
        return min(errors[:middle], default=math.inf), min(errors[middle:], default=math.inf)

    def _linear_states(self) -> int:
        """The fewest states of a linear state space that is no worse than the best of them; 0 where there is none."""
        found = [one for one in self.trials if one.structure["kind"] == LinearStateSpace.kind]
        least = min(map(self.error, found), default=math.inf)
        alike = [one for one in found if math.isfinite(least) and self.error(one) <= (1.0 + ALIKE) ** 2 * least]
        return min((int(one.structure["states"]) for one in alike), default=0)

    def _new(self, wanted: Sequence[Try], n: int) -> list[Try]:
        """The first of some that were not tried and can be."""
        found: list[Try] = []
        for one in wanted:
            name = digest({"structure": one.structure.to_dict(), "training": dict(one.training)})
            if len(found) < n and name not in self._seen and self._possible(one):
                self._seen.add(name)
                found.append(one)
        return found

    def _possible(self, one: Try) -> bool:
        """Whether the structure is one for these inputs and outputs, and has fewer parameters than samples."""
        n = self.looked.n_outputs
        structure = one.structure.for_outputs(n)
        try:
            structure.check_inputs(self.looked.n_inputs)
            structure.check_outputs(n if structure.several_outputs else 1)
        except ConfigError:
            return False
        return True

    def _point(self, one: Try) -> Point:
        self._asked += 1
        row = estimator_of(one.structure)
        training = {**self.training, **one.training} if row.training is Training else dict(one.training)
        if row.training is not Training and hasattr(row.training, "max_time_s") and "max_time_s" in self.training:
            training["max_time_s"] = self.training["max_time_s"]
        n = self.looked.n_outputs
        if "max_time_s" in training and not one.structure.for_outputs(n).several_outputs:
            training["max_time_s"] = round(training["max_time_s"] / n, 3)  # a model an output, one after the other
        values = {"structure": one.structure.label, **one.training}
        return Point(number=self._asked, structure=one.structure, training=training, values=values)
