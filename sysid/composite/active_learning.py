"""Active learning: find where the whole is worst, add such sequences to the training data, train again.

The sequences come from a pool that is scored nowhere else, or from a callable that makes them. Others are never trained
on, and say after each round what the added data brought. They choose with the other selection traces, among the states
of a round and between the stages, each round being one: their figures are a little too good, and what counts in the end
is sequences that had no say in anything. The whole begins each round, which trains it end to end, where the round
before has left it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.composite.growth import in_rounds, worst_of
from sysid.composite.plan import ActiveLearning
from sysid.models import Cascade
from sysid.traces import Trace
from sysid.units import in_unit

LEARNED = "active learning"
"""How its stages are called in the report, with the number of the round."""


@dataclass(frozen=True, kw_only=True)
class Assessment:
    """How the whole does on sequences that train nothing.

    Args:
        within: Share of the sequences whose error is under the limit.
        median: Of the sequences' errors, in the outputs' unit.
        rare: The error that 99 % of the sequences stay under.
    """

    within: float
    median: float
    rare: float

    @classmethod
    def at(cls, errors: NDArray[np.float64], limit: float) -> Assessment:
        """What some errors come to.

        Args:
            errors: Of the sequences, shape ``(n_sequences,)``.
            limit: That an error should stay under.

        Returns:
            The assessment.
        """
        return cls(
            within=float(np.mean(errors < limit)),
            median=float(np.median(errors)),
            rare=float(np.quantile(errors, 0.99)),
        )

    def better_than(self, other: Assessment) -> bool:
        """Whether more sequences are within the limit, or as many and the rare ones nearer to it."""
        return (self.within, -self.rare) > (other.within, -other.rare)


@dataclass(frozen=True, kw_only=True)
class Round:
    """One round.

    Args:
        number: 0 is the whole as it was before.
        stage: The stage of the report that it ends with.
        added: Names of the sequences that were added for it, the first first.
        traces: Traces that the whole was trained on in it.
        samples: Samples of these.
        seconds: That its training took.
        assessment: The whole after it, on the sequences that train nothing.
        score: Of the whole after it, on the traces that choose between the stages.
    """

    number: int
    stage: str
    added: tuple[str, ...]
    traces: int
    samples: int
    seconds: float
    assessment: Assessment
    score: float


@dataclass(frozen=True, kw_only=True, eq=False)
class ActiveLearned:
    """What came of it.

    Args:
        asked: What was asked for.
        rounds: All that were done, the state before them first.
        held_out: How many sequences said what a round has brought.
        unit: Of the outputs that were looked at; empty where they differ.
        ended: Why there was no further round.
    """

    asked: ActiveLearning
    rounds: tuple[Round, ...]
    held_out: int
    unit: str
    ended: str

    @property
    def added(self) -> int:
        """How many sequences were added."""
        return sum(len(done.added) for done in self.rounds)

    @property
    def where(self) -> str:
        """Which sequences were added."""
        return "at which the whole was worst" if self.asked.pick == "worst" else "in the order of the pool"

    @property
    def limit(self) -> str:
        """The error that a sequence should stay under, with its unit."""
        return in_unit(f"{self.asked.within:g}", self.unit).strip()

    @property
    def sentence(self) -> str:
        """For the report."""
        first, last, outputs = self.rounds[0].assessment, self.rounds[-1].assessment, ", ".join(self.asked.outputs)
        return (
            f"Grown over {len(self.rounds) - 1} rounds by {self.added} sequences, {self.where}; {self.ended}. On "
            f"{self.held_out} sequences of the pool that train nothing the share with an error of {outputs} under "
            f"{self.limit} goes from {100.0 * first.within:.3g} to {100.0 * last.within:.3g} %, the error "
            f"that 99 % stay under from {in_unit(f'{first.rare:.3g} to {last.rare:.3g}', self.unit)}".strip()
            + "."
        )


Train = Callable[[Cascade, Sequence[Trace], int], tuple[Cascade, float]]
"""Trains a whole, from where it stands, on these traces in a round: the whole after it, and the seconds it took."""


Make = Callable[[int], Sequence[Trace]]
"""Makes sequences for a round of this number: runs of the reference on new inputs. It adds from these and from what the
rounds before it have left of theirs."""


def sequence_errors(whole: Cascade, sequences: Sequence[Trace], outputs: Sequence[str]) -> NDArray[np.float64]:
    """Error of the free run of each sequence.

    Args:
        whole: The whole.
        sequences: The sequences.
        outputs: Outputs that count.

    Returns:
        Root mean square error of the output with the largest one, shape ``(n_sequences,)``.
    """

    def one(trace: Trace) -> float:
        run, counts = whole.simulate_trace(trace), trace.counted(whole.inputs, outputs)
        seen = [(name, own) for name, own in zip(outputs, counts.T, strict=True) if own.any()]
        squares = [float(np.mean((run[name] - trace[name])[own] ** 2)) for name, own in seen]
        return float(np.sqrt(max(squares, default=0.0)))

    with ThreadPoolExecutor(2) as pool:
        errors = np.array(list(pool.map(one, sequences)))
    return np.where(np.isnan(errors), np.inf, errors)


def learn_actively(
    asked: ActiveLearning,
    whole: Cascade,
    train: Train,
    *,
    begins: str,
    estimation: Sequence[Trace],
    pool: Sequence[Trace] | Make,
    held_out: Sequence[Trace],
    score: Callable[[Cascade], float],
    report: Callable[[Round], Any] = lambda _: None,
) -> ActiveLearned:
    """Grow the training data of a whole, round by round.

    Args:
        asked: How.
        whole: The whole as it stands.
        train: Trains it end to end.
        begins: The stage of the report that it stands at.
        estimation: Traces that it was trained on last; every round has them too.
        pool: Sequences to add from; or what makes more of them for a round, given its number.
        held_out: Sequences that say what a round has brought.
        score: The error by which stages are chosen.
        report: Told after every round.

    Returns:
        What each round brought.
    """
    left = [] if callable(pool) else list(pool)
    traces, rounds = list(estimation), list[Round]()

    def done(now: Cascade, stage: str, added: Sequence[Trace], seconds: float) -> None:
        rounds.append(
            Round(
                number=len(rounds),
                stage=stage,
                added=tuple(trace.name for trace in added),
                traces=len(traces),
                samples=sum(map(len, traces)),
                seconds=seconds,
                assessment=Assessment.at(sequence_errors(now, held_out, asked.outputs), asked.within),
                score=score(now),
            )
        )
        report(rounds[-1])

    def look(number: int, now: Cascade) -> list[Trace]:
        left.extend(pool(number) if callable(pool) else ())
        added = _picked(asked, now, left, asked.additions[number - 1])
        left[:] = [trace for trace in left if trace not in added]
        return added

    def learn(number: int, now: Cascade, added: Sequence[Trace]) -> Cascade:
        # Behind the others, not between them: where instances take the traces in turn, each keeps its own.
        traces.extend(added)
        now, seconds = train(now, tuple(traces), number)
        done(now, f"{LEARNED}, round {number}", added, seconds)
        return now

    done(whole, begins, (), 0.0)
    _, ended = in_rounds(
        whole, look=look, train=learn, ended=lambda _: _ended(asked, rounds), nothing="it ended with the pool"
    )
    units = {held_out[0].channel(name).unit for name in asked.outputs}
    unit = units.pop() if len(units) == 1 else ""
    return ActiveLearned(asked=asked, rounds=tuple(rounds), held_out=len(held_out), unit=unit, ended=ended)


def _picked(asked: ActiveLearning, whole: Cascade, left: Sequence[Trace], count: int) -> list[Trace]:
    """What the next round adds: the worst of what is left of the pool, or what comes next."""
    if asked.pick == "next":
        return list(left[:count])
    return [left[k] for k in worst_of(sequence_errors(whole, left, asked.outputs), count)]


def _ended(asked: ActiveLearning, rounds: Sequence[Round]) -> str:
    """Why there is no further round, whatever is left of the pool; empty if nothing speaks against one."""
    best = 0
    for done in rounds[1:]:
        best = done.number if done.assessment.better_than(rounds[best].assessment) else best
    if rounds[best].assessment.within >= asked.until:
        return f"it ended with {100.0 * asked.until:g} % under the limit, as aimed at"
    if (idle := len(rounds) - 1 - best) >= asked.patience:
        return f"it ended after {idle} rounds that brought no improvement"
    return "it ended with the last round that was asked for" if len(rounds) > len(asked.additions) else ""
