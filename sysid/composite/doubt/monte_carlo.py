"""Monte Carlo test: the whole on many random sequences of the reference, does it diverge, how large are its errors."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid.models import Cascade
from sysid.traces import Trace
from sysid.validation.annotator import Annotator

QUANTILES = (0.5, 0.9, 0.95, 0.99, 1.0)
WORST = 10
"""Sequences that are kept for their plots."""


@dataclass(frozen=True, kw_only=True)
class OfKind:
    """What came of the sequences of one kind.

    Args:
        sequences: How many were run.
        lost: How many were held by a network's bound, or left all numbers.
        within: The share of them under the limit.
        quantiles: Root mean square error of a sequence, by quantile over them, in the output's unit.
    """

    sequences: int
    lost: int
    within: float
    quantiles: dict[float, float]


def kind_of_sequence(name: str) -> str:
    """The kind of a sequence: its name without the number behind it.

    Args:
        name: Of the sequence.

    Returns:
        The kind; the whole name where it is but a number.

    Example:
        >>> [kind_of_sequence(name) for name in ("ramps-017", "S0003", "12")]
        ['ramps', 'S', '12']
    """
    return name.rstrip("0123456789").rstrip("-_. ") or name


@dataclass(frozen=True, kw_only=True)
class MonteCarlo:
    """What came of it.

    Args:
        output: Output that was judged.
        unit: Its unit.
        sequences: How many were run.
        lost: How many were held by a network's bound, or left all numbers.
        quantiles: Root mean square error of a sequence, by quantile over the sequences, in the output's unit.
        within: The share of sequences under the limit.
        limit: The limit, in the output's unit.
        worst: Names of the sequences with the largest errors, the worst first, and their errors.
        by_state: Root mean square error over the samples of a state in a sequence, by state and by quantile over the
            sequences that are in it; empty without states.
        by_kind: The same figures of the sequences of each kind; empty where all are of one.
    """

    output: str
    unit: str
    sequences: int
    lost: int
    quantiles: dict[float, float]
    within: float
    limit: float
    worst: tuple[tuple[str, float], ...]
    by_state: dict[str, dict[float, float]] = field(default_factory=dict)
    by_kind: dict[str, OfKind] = field(default_factory=dict)


def run_monte_carlo(
    cascade: Cascade,
    traces: Sequence[Trace],
    output: str,
    limit: float,
    report: Callable[[int], None] = lambda _: None,
    *,
    annotator: Annotator | None = None,
) -> MonteCarlo:
    """Run a cascade over sequences of the reference.

    Args:
        cascade: The whole.
        traces: The sequences, with the inputs of the whole and the output. What stands before the number of a name is
            the kind of the sequence (``ramps-017``).
        output: Output that is judged.
        limit: Root mean square error that a sequence should stay under, in its unit.
        report: Told how many are done.
        annotator: Says in which state each sample of a sequence is; ``None`` for no figures by state.

    Returns:
        What came of it.
    """
    errors, lost = np.empty(len(traces)), np.zeros(len(traces), dtype=bool)
    states: dict[str, list[float]] = {}
    for i, trace in enumerate(traces):
        run = cascade.simulate_trace(trace)
        squared = (run[output] - trace[output]) ** 2
        errors[i] = np.sqrt(np.mean(squared))
        if annotator is not None:
            for label, error in _by_state(squared, trace, annotator):
                states.setdefault(label, []).append(error)
        lost[i] = any(one.lost > 0 for one in run.activity.values()) or not np.isfinite(errors[i])
        report(i + 1)
    order = np.argsort(-np.nan_to_num(errors, nan=np.inf))
    return MonteCarlo(
        output=output,
        unit=traces[0].channel(output).unit,
        sequences=len(traces),
        lost=int(lost.sum()),
        quantiles=_quantiles(errors),
        within=float(np.mean(errors < limit)),
        limit=limit,
        worst=tuple((traces[i].name, float(errors[i])) for i in order[:WORST]),
        by_state={label: _quantiles(np.array(found)) for label, found in states.items()},
        by_kind=_by_kind([trace.name for trace in traces], errors, lost, limit),
    )


def _quantiles(errors: NDArray[np.float64]) -> dict[float, float]:
    return {q: float(np.quantile(errors, q)) for q in QUANTILES}


def _by_kind(
    names: Sequence[str], errors: NDArray[np.float64], lost: NDArray[np.bool_], limit: float
) -> dict[str, OfKind]:
    kinds = [kind_of_sequence(name) for name in names]
    known = list(dict.fromkeys(kinds))
    members = {kind: np.array([one == kind for one in kinds]) for kind in known} if len(known) > 1 else {}
    return {
        kind: OfKind(
            sequences=int(of.sum()),
            lost=int(lost[of].sum()),
            within=float(np.mean(errors[of] < limit)),
            quantiles=_quantiles(errors[of]),
        )
        for kind, of in members.items()
    }


def _by_state(squared: NDArray[np.float64], trace: Trace, annotator: Annotator) -> Iterator[tuple[str, float]]:
    """Root mean square error over the samples of each state that a sequence is in."""
    numbers = annotator(trace)[annotator.channel].astype(np.int64)
    counts, sums = np.bincount(numbers), np.bincount(numbers, weights=squared)
    for number in np.flatnonzero(counts):
        yield annotator.labels[number], float(np.sqrt(sums[number] / counts[number]))
