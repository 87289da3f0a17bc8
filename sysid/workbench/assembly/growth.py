"""Grown by finding where the whole is worst: train, look, add the worst sequences to the training, train again.

The sequences come from a pool that is scored nowhere else. Its cases with ``role: estimation`` are what is added from;
those with ``role: selection`` are never trained on, and say after each round what the added data brought. Members begin
each round where the round before has left them, so that a round costs a small part of the first training.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.models import Cascade, NARXModel
from sysid.traces import Trace
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.member_config import MemberConfig
from sysid.workbench.assembly.members import Members, assembled, whole_score
from sysid.workbench.assembly.stage_config import GrowConfig


@dataclass(frozen=True, kw_only=True)
class Look:
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
    def at(cls, errors: NDArray[np.float64], limit: float) -> Look:
        """What some errors come to.

        Args:
            errors: Of the sequences, shape ``(n_sequences,)``.
            limit: That an error should stay under.

        Returns:
            The look.
        """
        return cls(
            within=float(np.mean(errors < limit)),
            median=float(np.median(errors)),
            rare=float(np.quantile(errors, 0.99)),
        )

    def better_than(self, other: Look) -> bool:
        """Whether more sequences are within the limit, or as many and the rare ones nearer to it."""
        return (self.within, -self.rare) > (other.within, -other.rare)


@dataclass(frozen=True, kw_only=True)
class Round:
    """One round.

    Args:
        number: 0 is the whole as it was before.
        added: Names of the sequences that were added for it, the worst first.
        samples: Samples that the members were trained on in it.
        look: The whole after it, on the sequences that train nothing.
        score: Of the whole after it, on the selection traces.
    """

    number: int
    added: tuple[str, ...]
    samples: int
    look: Look
    score: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Growth:
    """What came of it.

    Args:
        rounds: All that were done, the state before them first.
        best: Number of the round whose members are kept.
        models: Those members.
        key: Digest of what they depend on.
        limit: Error that a sequence should stay under.
        outputs: Outputs that were looked at.
    """

    rounds: tuple[Round, ...]
    best: int
    models: Members
    key: str
    limit: float
    outputs: tuple[str, ...]

    @property
    def added(self) -> frozenset[str]:
        """Names of the sequences that had been added by the round that is kept."""
        return frozenset(name for done in self.rounds[: self.best + 1] for name in done.added)

    @property
    def sentence(self) -> str:
        """For the report."""
        first, kept = self.rounds[0], self.rounds[self.best]
        share = f"from {100.0 * first.look.within:.3g} to {100.0 * kept.look.within:.3g} %"
        return (
            f"Grown over {len(self.rounds) - 1} rounds, {sum(len(r.added) for r in self.rounds)} sequences added where "
            f"the whole was worst; round {self.best} is kept. On sequences of the pool that train nothing the share "
            f"with an error under {self.limit:g} ({', '.join(self.outputs)}) goes {share}."
        )


Fit = Callable[[MemberConfig, Members, Sequence[Trace], int, str], tuple[NARXModel, str]]
"""Trains a member on traces in a round, from where it stands: the model and the digest of what it depends on."""


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
        run, counted = whole.simulate_trace(trace), trace.usable_samples
        return max(float(np.sqrt(np.mean((run[name] - trace[name])[counted] ** 2))) for name in outputs)

    with ThreadPoolExecutor(2) as pool:
        errors = np.array(list(pool.map(one, sequences)))
    return np.where(np.isnan(errors), np.inf, errors)


def grow(
    config: AssemblyConfig,
    models: Members,
    key: str,
    fit: Fit,
    *,
    estimation: Sequence[Trace],
    selection: Sequence[Trace],
    pool: Sequence[Trace],
    held_out: Sequence[Trace],
    report: Callable[[Round], Any] = lambda _: None,
) -> Growth:
    """Grow the training data of an assembly, round by round.

    Args:
        config: The pipeline, with ``grow``.
        models: The members as they stand.
        key: Digest of what they depend on.
        fit: Trains a member.
        estimation: Traces that they were trained on.
        selection: Traces that choose between states of a fit.
        pool: Sequences to add from.
        held_out: Sequences that say what a round has brought.
        report: Told after every round.

    Returns:
        The members of the best round, and what each round brought.
    """
    asked = config.grow
    if asked is None:
        raise TypeError("the pipeline grows nothing")
    members = {member.mapping.output: member for member in config.members}
    scored = config.choose_on or config.outputs
    left, added, rounds = list(pool), list[Trace](), list[Round]()

    def done(number: int, worst: Sequence[Trace], now: Members) -> None:
        whole = assembled(config, now)
        rounds.append(
            Round(
                number=number,
                added=tuple(trace.name for trace in worst),
                samples=sum(map(len, estimation)) + sum(map(len, added)),
                look=Look.at(sequence_errors(whole, held_out, asked.outputs), asked.within),
                score=whole_score(whole, selection, scored),
            )
        )
        report(rounds[-1])

    done(0, (), models)
    best, kept = 0, (models, key)
    while left and not _finished(asked, rounds, best):
        errors = sequence_errors(assembled(config, models), left, asked.outputs)
        worst = [left[i] for i in np.argsort(-errors, kind="stable")[: asked.add]]
        left = [trace for trace in left if trace not in worst]
        added += worst
        for name in asked.members:
            member = members[name]
            own = (*estimation[: member.traces], *added)
            model, key = fit(member.model_copy(update={"traces": None}), models, own, len(rounds), key)
            models = {**models, name: model}
        done(len(rounds), worst, models)
        if rounds[-1].look.better_than(rounds[best].look):
            best, kept = len(rounds) - 1, (models, key)
    return Growth(
        rounds=tuple(rounds), best=best, models=kept[0], key=kept[1], limit=asked.within, outputs=asked.outputs
    )


def _finished(asked: GrowConfig, rounds: Sequence[Round], best: int) -> bool:
    """Whether the figures hold, have stopped improving, or the rounds are done."""
    done = len(rounds) - 1
    return done >= asked.rounds or rounds[best].look.within >= asked.until or done - best >= asked.patience
