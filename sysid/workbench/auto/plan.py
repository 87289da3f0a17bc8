"""Which structures are tried, in which order, and when nothing is gained any more."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

from sysid.estimation.estimators import estimator_of
from sysid.models import ARX, NeuralStateSpace
from sysid.workbench.auto.budget import LARGER, LINEAR, size_of
from sysid.workbench.auto.families import Family, Try, suggested
from sysid.workbench.auto.ledger import Ledger
from sysid.workbench.auto.parts import ENSEMBLE
from sysid.workbench.sweep.search_space import Point

ROUND = 4
"""Trials of a round: the next round knows the results of all before it, whatever the number of workers."""
RIVAL = 2.0
"""Times the least error within which the best of another kind of network is followed too."""
GAIN = 0.02
"""Part of the least error, as a root of a mean square, by which a round has to better it to count as a gain."""
FIRST = 0.4
"""Share of the budget after which what stands next to the best of one kind is left for the other kinds, where these
have yet to be tried."""
PATIENCE = 2
"""Rounds without a gain after which the search ends."""
FINALISTS, AGAIN = 5, 2
"""The best nonlinear models, and how often each is trained again before the choice: the least of many errors
owes something to luck, and the chosen one is trained from other starts too."""
ENSEMBLES = 3
"""Of them those whose starts are united, too, where that can be."""

SPENT = "the budget is spent"
"""Why a search ends that would have tried more."""
MET = "what is linear between its events stays within the tolerance on every trace that chooses"
"""Why a search ends that has found a model of events."""
HELD = "equations of what holds an output stay within the tolerance on every trace that chooses"
"""The same of a model of friction."""
AT_ONCE = "a map without memory stays within the tolerance on every trace that chooses"
"""The same of outputs that follow from inputs at the same time alone."""
TRAINED = 2
"""Linear models that are trained, and take as long as a network at most, before a network is tried."""
TAPS = 10
"""Past values of each input of a model that is taken for want of time."""


@dataclass(kw_only=True, eq=False)
class Plan(Ledger):
    """Asks for trials round by round: linear structures, the first nonlinear ones, then what stands next to the best.

    Nothing depends on when a result comes in, and with a budget of iterations nothing on time.

    Args:
        seed: Of the search.
        again: How often the best are trained again; 0 where what was chosen is not.
        ended: Why it ended, once it has.
        left_out: Linear structures for which there was no time beside the others.
        hurried: Whether nothing usable had come in the time, and the least was tried even so.
    """

    seed: int = 0
    again: int = AGAIN
    ended: str = ""
    left_out: list[str] = field(default_factory=list)
    hurried: bool = False
    _no_time: list[Try] = field(default_factory=list)
    """What was wanted and had no place in the time that there was then."""
    _rounds: Iterator[list[Try]] | None = None

    def ask(self) -> list[Point]:
        """The next round; empty when the search is over."""
        self._rounds = self._rounds or self._all_rounds()
        for tries in self._rounds:
            points = [self._point(one) for one in tries]
            taken = self.budget.take(points)
            if self.budget.most < 1.0 and self.budget.wall_s is not None:
                late = [point.structure for point in points if point not in taken]
                self.left_out += [one.label for one in late if estimator_of(one).linear]
            elif len(taken) < len(points):
                self.ended = SPENT
            self._points |= {point.number: point for point in taken}
            by_number = {point.number: one for point, one in zip(points, tries, strict=True)}
            self._tries += [by_number[point.number] for point in taken]
            self._no_time += [one for number, one in by_number.items() if number not in self._points]
            if taken:
                return taken
        self.ended = self.ended or "nothing that is left to try has a place in the search"
        return []

    def _all_rounds(self) -> Iterator[list[Try]]:
        yield from self._search()
        yield from self._whatever_the_time()
        self.budget.kept = 0.0
        # Of nothing that can be used there are no other starts: the time that was kept for these is for the rest.
        if not math.isfinite(self.least(linear=False)):
            yield [one for one in self._no_time if not estimator_of(one.structure).linear]
        yield from self._finals()
        yield from self._ensembles()

    def _whatever_the_time(self) -> Iterator[list[Try]]:
        """Where nothing usable has come in the time, the least structures one by one, until one is.

        Equations of events are no work at all, those of what holds an output little. In motion what begins at rest
        comes to nothing: one network that learns where it begins is tried. Of linear structures the second has no past
        outputs: it is stable whatever the record, and fitted in no time.
        """
        m, least = self.looked.n_inputs, self._least(linear=True)
        stable = Try(structure=ARX(na=0, nb=(TAPS,) * m, nk=(0,) * m))
        nonlinear = [family for family in self.families if not family.linear]
        events = [one for family in nonlinear for one in family.at_events(self.looked)]
        moving = [one for family in nonlinear for one in family.in_motion(self.looked) if self.looked.in_motion]
        held = [one for family in nonlinear for one in family.held(self.looked)][:1]
        for one in (*events, *held, *moving[:1], *least[:1], stable, *least[1:]):
            if math.isfinite(self.least()):
                return
            if self._possible(one) and all(one.structure != tried.structure for tried in self._tries):
                self.budget.forced, self.hurried = True, one not in events
                yield [one]
                self.hurried &= one not in held or not self._is_met

    def _finals(self) -> Iterator[list[Try]]:
        """The best nonlinear models once more, from other starts."""
        kinds = {family.kind for family in self.families if not family.linear}
        places = [n for n, one in enumerate(self._tries[: len(self.trials)]) if one.structure.kind in kinds]
        best = sorted(places, key=lambda n: self._rank(self.trials[n]))[:FINALISTS]
        finals: list[Try] = []
        for place in best:
            for k in range(self.again if math.isfinite(self.error(self.trials[place])) else 0):
                one = self._tries[place]
                seed = 1_000 * self.seed + 100 * (k + 1)
                finals.append(replace(one, training={**one.training, "seed": seed}))
                self._repeats[self._asked + len(finals)] = place
        if finals:
            yield finals

    def _ensembles(self) -> Iterator[list[Try]]:
        """The best of those once more, the mean of several starts each."""
        able = [n for n in self._told_again if estimator_of(self._tries[n].structure).unites]
        best = sorted(
            (n for n in able if math.isfinite(self.error(self.trials[n]))), key=lambda n: self._rank(self.trials[n])
        )
        found = [
            replace(one, training={**one.training, **ENSEMBLE}) for one in (self._tries[n] for n in best[:ENSEMBLES])
        ]
        self._united |= {self._asked + k + 1 for k in range(len(found))}
        if found:
            yield found

    def _search(self) -> Iterator[list[Try]]:
        nonlinear_first = sorted(self.families, key=lambda family: family.linear)
        for some, ended in self._exact(nonlinear_first):
            self.budget.unlimited = 1
            yield from self._rounds_of(some)
            if self._is_met:
                self.ended = ended
                return
        if self.looked.static:
            yield from self._near_the_best(FIRST)
        # Whatever else adds up drifts, and is close to what was held out by luck.
        if self.looked.integrators:
            self.budget.unlimited = 1
            yield from self._rounds_of([one for family in nonlinear_first for one in family.adds_up(self.looked)])
        # In motion, what begins at rest is far off, however large: what learns where it begins comes first.
        if self.looked.in_motion:
            self.budget.unlimited = 1
            yield from self._rounds_of([one for family in nonlinear_first for one in family.in_motion(self.looked)])
            yield from self._near_the_best(FIRST)
        # At ends it is what runs on through them; where another kind does as well, its least shows at once.
        if self.looked.ends:
            held = [one for family in nonlinear_first for one in family.at_ends(self.looked)]
            kinds = {one.structure.kind for one in held}
            self.budget.unlimited = 1
            yield from self._rounds_of(held)
            yield from self._rounds_of(self._least(linear=True))
            # Networks alone: blocks and polynomials, which take long, may wait.
            rivals = [one for one in self._least(linear=False) if estimator_of(one.structure).initial is not None]
            yield from self._rounds_of([one for one in rivals if one.structure.kind not in kinds])
            yield from self._near_the_best(FIRST)
        # Of records without noise what is linear shows at once by least squares; where the look took much of the time,
        # linear models that are trained would have all of the rest.
        if self.looked.exact and not self.budget.has_room(self.budget.trial * (self.budget.wall_s or 0.0) * TRAINED):
            yield from self._least_squares()
            self.budget.unlimited = 1
            yield from self._rounds_of(self._hidden()[:1])
        yield from self._unasked(linear=True)
        yield from self._larger()
        self.looked = replace(self.looked, states=self._linear_states())
        # On a slow machine linear models alone would have taken all. What trains side by side takes no longer than one.
        self.budget.unlimited = self.budget.side_by_side
        if self.looked.exact:
            # Blocks and polynomials take long, one model for each output, and seldom end stable.
            yield from self._rounds_of(self._hidden())
        yield from self._unasked(linear=False)
        yield from self._near_the_best()

    def _exact(self, families: Sequence[Family]) -> Iterator[tuple[list[Try], str]]:
        """What nothing else gains on where it meets the tolerance, and what is said then.

        A smooth map meets no jump. What sticks and slips is as little smooth: its equations have few numbers, and are
        trained in no time, one by one. Of what has no memory every state is in the way.
        """
        for some, ended in (
            ([one for family in families for one in family.at_events(self.looked)], MET),
            *(([one], HELD) for family in families for one in family.held(self.looked)),
            ([one for family in families for one in family.at_once(self.looked)], AT_ONCE),
        ):
            if some:
                yield some, ended

    def _near_the_best(self, share: float = 1.0) -> Iterator[list[Try]]:
        """What stands next to good ones, as long as it gains.

        Args:
            share: Of the budget, beyond which no round of it begins: other kinds follow.
        """
        stale = 0
        while stale < PATIENCE:
            if share < 1.0 and self.budget.fraction() >= share:
                return
            before, outside = self.least(), self._least_outside()
            wanted = self._next()
            if not wanted:
                if share == 1.0:
                    self.ended = self.ended or "everything next to the best was tried"
                return
            # A round of large networks on a busy machine may last for all of the time that there is.
            self.budget.most = share
            yield wanted
            self.budget.most = 1.0
            gained = math.sqrt(self.least()) < (1.0 - GAIN) * math.sqrt(before) or self._least_outside() < outside
            stale = 0 if gained else stale + 1
        if share == 1.0:
            self.ended = self.ended or f"the last {PATIENCE * ROUND} trials gained less than {GAIN:.0%}"

    def _unasked(self, *, linear: bool) -> Iterator[list[Try]]:
        """The least of each kind, which tells what others cost; then those for which there is time.

        Args:
            linear: Linear structures, which leave time for the others; or those.
        """
        if linear and self.trials and not any(estimator_of(one.structure).linear for one in self._tries):
            yield from self._least_squares()
        yield from self._rounds_of(self._least(linear=linear))
        self.budget.most = LINEAR if linear else 1.0
        yield from self._rounds_of(self._first(linear=linear))
        self.budget.most = 1.0

    def _least_squares(self) -> Iterator[list[Try]]:
        """They cost next to nothing, and without them nobody knows what networks are worth."""
        self.budget.unlimited = 1
        yield from self._rounds_of([one for one in self._first(linear=True) if one.structure.kind == ARX.kind][:1])

    def _hidden(self) -> list[Try]:
        """Networks of states that no output shows."""
        return [one for one in self._first(linear=False) if one.structure.kind == NeuralStateSpace.kind]

    def _larger(self) -> Iterator[list[Try]]:
        """Linear models of more states, round by round, as long as more states gain."""
        self.budget.most = LARGER
        for family in self.families:
            small, large = self._halves(family.kind)
            for tries in family.larger(self.looked):
                if not math.sqrt(large) < (1.0 - GAIN) * math.sqrt(small):
                    break
                small = min(small, large)
                yield from self._rounds_of(tries)
                large = min(self.error(one) for one in self.trials if one.structure["kind"] == family.kind)
        self.budget.most = 1.0

    def _least(self, *, linear: bool) -> list[Try]:
        """The least of each kind, without those that wait."""
        late = {family.kind for family in self.families if family.waits and not family.leads(self.looked)}
        wanted = [one for one in self._first(linear=linear) if one.structure.kind not in late]
        least = dict[str, Try]()
        for one in sorted(wanted, key=lambda one: size_of(one.structure)):
            least.setdefault(one.structure.kind, one)
        return [one for one in wanted if least[one.structure.kind] is one]

    def _first(self, *, linear: bool) -> list[Try]:
        """What is tried unasked."""
        some = [family for family in self.families if family.linear is linear]
        leading = [family for family in some if family.leads(self.looked)]
        rest = sorted((family for family in some if family not in leading), key=lambda family: family.waits)
        first, later = ([one for family in kinds for one in family.first(self.looked)] for kinds in (leading, rest))
        return [*first, *suggested(self.looked, linear=linear), *later]

    def _rounds_of(self, wanted: Sequence[Try]) -> Iterator[list[Try]]:
        new = self._new(wanted, len(wanted))
        if new:
            yield new

    def _next(self) -> list[Try]:
        """What stands next to good nonlinear models: half to the best of all, half to the best of another kind."""
        around = {family.kind: family.around for family in self.families if not family.linear}
        pairs = [pair for pair in zip(self.trials, self._tries, strict=True) if pair[1].structure.kind in around]
        ranked = sorted(pairs, key=lambda pair: self._rank(pair[0]))
        usable = [pair for pair in ranked if math.isfinite(self.error(pair[0]))]
        leading = {kind: usable[0][1].structure.kind == kind for kind in around} if usable else {}
        others = [
            pair
            for pair in usable
            if not leading[pair[1].structure.kind] and self.error(pair[0]) < RIVAL**2 * self.error(usable[0][0])
        ]
        found: list[Try] = []
        for some, most in ((usable, ROUND - ROUND // 2 if others else ROUND), (others, ROUND), (usable, ROUND)):
            for _, one in some:
                found += self._new(around[one.structure.kind](one, self.looked), most - len(found))
        return found
