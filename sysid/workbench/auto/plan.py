"""Which structures are tried, in which order, and when nothing is gained any more."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from sysid.errors import ConfigError
from sysid.estimation import Training
from sysid.estimation.estimators import estimator_of
from sysid.reporting.sweep_record import Trial
from sysid.workbench.auto.budget import Budget
from sysid.workbench.auto.families import FAMILIES, Family, Try, suggested
from sysid.workbench.auto.look import Looked
from sysid.workbench.runner.store import digest
from sysid.workbench.sweep.search_space import Point

ROUND = 4
"""Trials of a round: the next round knows the results of all before it, whatever the number of workers."""
GAIN = 0.02
"""Part of the least error, as a root of a mean square, by which a round has to better it to count as a gain."""
PATIENCE = 2
"""Rounds without a gain after which the search ends."""
ALIKE = 0.03
"""Part of the least error within which another one counts as no worse; of those the smallest is chosen."""


@dataclass(kw_only=True, eq=False)
class Plan:
    """Asks for trials round by round: linear structures, the first networks, then what stands next to the best.

    Nothing depends on when a result comes in, and with a budget of iterations nothing on time.

    Args:
        looked: What is in the record.
        budget: What may be spent.
        error: What chooses, as a mean square; infinite for what cannot be used.
        training: Options that every network is trained with.
        families: What there is to try.
        ended: Why it ended, once it has.
    """

    looked: Looked
    budget: Budget
    error: Callable[[Trial], float]
    training: Mapping[str, Any] = field(default_factory=dict)
    families: Sequence[Family] = field(default_factory=lambda: FAMILIES)
    ended: str = ""
    trials: list[Trial] = field(default_factory=list)
    _tries: list[Try] = field(default_factory=list)
    _points: list[Point] = field(default_factory=list)
    _seen: set[str] = field(default_factory=set)
    _rounds: Iterator[list[Try]] | None = None
    _asked: int = 0

    def ask(self) -> list[Point]:
        """The next round; empty when the search is over."""
        self._rounds = self._rounds or self._all_rounds()
        for tries in self._rounds:
            points = [self._point(one) for one in tries]
            taken = self.budget.take(points)
            if len(taken) < len(points):
                self.ended = "the budget is spent"
            by_number = {point.number: one for point, one in zip(points, tries, strict=True)}
            self._tries += [by_number[point.number] for point in taken]
            self._points += taken
            if taken:
                return taken
        self.ended = self.ended or "nothing that is left to try has a place in the search"
        return []

    def tell(self, trials: Sequence[Trial]) -> None:
        """The results of the last round, in its order."""
        self.trials += trials
        self.budget.tell(trials)

    def least(self, *, linear: bool | None = None) -> float:
        """The least error so far, as a mean square.

        Args:
            linear: Among linear models alone, or networks alone; among all by default.

        Returns:
            The error; infinite where there is none.
        """
        kinds = {family.kind for family in self.families if linear is None or family.linear is linear}
        errors = [self.error(t) for t in self.trials if t.structure["kind"] in kinds]
        return min(errors, default=math.inf)

    def _all_rounds(self) -> Iterator[list[Try]]:
        for linear in (True, False):
            wanted = suggested(self.looked, linear=linear)
            wanted += [one for family in self.families if family.linear is linear for one in family.first(self.looked)]
            yield from self._rounds_of(wanted)
        stale = 0
        while stale < PATIENCE:
            before = self.least()
            wanted = self._next()
            if not wanted:
                self.ended = self.ended or "everything next to the best was tried"
                return
            yield wanted
            stale = 0 if math.sqrt(self.least()) < (1.0 - GAIN) * math.sqrt(before) else stale + 1
        self.ended = self.ended or f"the last {PATIENCE * ROUND} trials gained less than {GAIN:.0%}"

    def _rounds_of(self, wanted: Sequence[Try]) -> Iterator[list[Try]]:
        new = self._new(wanted, len(wanted))
        if new:
            yield new

    def _next(self) -> list[Try]:
        """What stands next to the best networks, the best one's neighbours first."""
        around = {family.kind: family.around for family in self.families if not family.linear}
        ranked = sorted(
            (pair for pair in zip(self.trials, self._tries, strict=True) if pair[1].structure.kind in around),
            key=lambda pair: (self.error(pair[0]), pair[0].number),
        )
        found: list[Try] = []
        for trial, one in ranked:
            if math.isfinite(self.error(trial)):
                found += self._new(around[one.structure.kind](one, self.looked), ROUND - len(found))
            if len(found) >= ROUND:
                break
        return found

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
        values = {"structure": one.structure.label, **one.training}
        return Point(number=self._asked, structure=one.structure, training=training, values=values)
