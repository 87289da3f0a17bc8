"""What is fitted and what chooses: declared selection traces, or parts of the estimation traces held out in turn."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.models import Mapping, Start, StartKind
from sysid.models.contract.beginning import window
from sysid.traces import Role, Trace, TraceSet
from sysid.workbench.fits.data import Data

FOLDS = 4
"""Parts that choose in turn; from so many estimation traces on, whole ones are held out."""
BLOCKS, LEAST = 4, 12
"""Blocks of a trace that a part holds out, and samples of each at least."""
SHORT = 10_000
"""Samples up to which every part chooses in turn; of more, one of them."""
FEWEST = 20
"""Usable samples of a part without which nothing can be chosen."""
SEARCHED = 40_000
"""Samples that are fitted while structures are tried; of a longer record the chosen structure alone sees all."""
A_SECOND, LEAST_SEARCHED = 200, 8_000
"""Where selection traces choose, so many for each second of the search, and in any case so many: in a short search a
network would come to a few iterations on all of them, which tell nothing of it."""
OF_EXACT = 1 / 3
"""Share of these by which structures of records without noise are compared: there a few tell as much as all, and three
times the iterations or structures more."""
FEW = 4
"""Whole traces from which on trials see some of them, and not the beginning of all."""
LITTLE_BEYOND = 0.1
"""Part of the fitted range by which what chooses may go beyond it."""
END = 0.25
"""Share of each trace that an order search chooses on."""
SEARCH = {"max_iterations": 200, "starts": 4}
"""How a network is trained while structures are tried. Of one start its errors say as much as of the structure, and
half of four are dropped early: they take a fifth more iterations than one."""
LAST = {"starts": 12}
"""How the chosen one is trained in the end, where that is another fit, beside what it was tried with: on a short record
minima that fit it alike are far apart on another."""
ENSEMBLE = {"ensemble": 8, "starts": 12}
"""How an ensemble is trained, beside what its structure was tried with: where the last fit has these starts anyway, the
mean of the best owes less to luck than any of them."""
UNITED = {"ensemble": 16, "starts": 24}
"""How the last fit is trained that is an ensemble: twice the starts have 10 % less error on the test record of tanks
and 3 % where their two records change places (geometric means over four structures and three seeds)."""
FURTHER = {"starts": 1, "max_iterations": 2000}
"""How the chosen one is trained on from where its trial had ended, where selection traces chose."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Fold:
    """One way to part the estimation traces.

    Args:
        fitted: What trials are fitted to; no other trace is among them, so that a search cannot see a test case.
        chooses: What they are chosen on.
    """

    fitted: TraceSet
    chooses: tuple[Trace, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Parts:
    """The estimation traces as the search uses them.

    Args:
        folds: Ways to part them: what a trial is worth is the geometric mean over all.
        told: How they were parted, one sentence each.
        partial: Whether the chosen structure has to be fitted once more, to all there is.
        cut: Whether that is for the record's length alone: a network is then trained on from where its trial had ended.
    """

    folds: tuple[Fold, ...]
    told: tuple[str, ...]
    partial: bool
    cut: bool = False

    @property
    def trained_on(self) -> bool:
        """Whether a chosen network goes on from where its trial had ended: no part of the record was held out of it."""
        return self.cut or not self.partial

    @property
    def training(self) -> dict[str, Any]:
        """How a network is trained while structures are tried.

        Declared selection traces choose between its starts too. Parts that are held out do not, nor do they stop it
        early, as the last fit, to all of the record, has none: what is tried is what is done then.
        """
        return SEARCH if self.trained_on else {**SEARCH, "choose_by": "evidence"}


def part(
    data: Data, mapping: Mapping, start: Start, wall_s: float | None = None, *, in_turn: bool = False,
    exact: bool = False,
) -> Parts:  # fmt: skip
    """Part the estimation traces into what is fitted and what chooses.

    Args:
        data: The traces of the pipeline.
        mapping: What goes in, which says where a run's beginning ends.
        start: How each free run begins.
        wall_s: Seconds of the search; ``None`` where iterations are counted.
        in_turn: Whether every part chooses however long the record is: what adds up its errors may be right over one
            part of a movement by chance.
        exact: Whether the records have no noise.

    Returns:
        The parts.

    Raises:
        ConfigError: If too little is left to choose by.
    """
    traces = data.estimation
    if data.selection:
        names = ", ".join(trace.name for trace in data.selection)
        pairs, partial, told = [(list(traces), list(data.selection))], False, f"The selection traces chose: {names}."
    else:
        pairs, told = _held_out(traces, mapping, start, in_turn=in_turn)
        partial = True
    least = min(sum(int(trace.usable_samples.sum()) for trace in chooses) for _, chooses in pairs)
    if least < FEWEST:
        raise ConfigError(
            "the record is too short for a search",
            where=f"data set {data.traces.name}",
            expected=f"{FEWEST} usable samples to choose by, or more",
            got=f"{least}",
            remedy="record for longer, or fit a structure of few parameters with sysid orders or sysid run",
        )
    sentences, total = [told], max(sum(map(len, fitted)) for fitted, _ in pairs)
    most = searched_in(wall_s, exact=exact) if data.selection else SEARCHED
    cut = total > most and bool(data.selection)
    if total > most:
        share, partial = most / total, True
        seen = [_seen(fitted, share) for fitted, _ in pairs]
        pairs = [(some, rest) for (some, _), (_, rest) in zip(seen, pairs, strict=True)]
        sentences.append(f"Trials saw {seen[0][1]} of what is fitted, and what was chosen all of it.")
    return Parts(folds=tuple(_fold(data, *pair) for pair in pairs), told=tuple(sentences), partial=partial, cut=cut)


def searched_in(wall_s: float | None, *, exact: bool = False) -> int:
    """How many samples trials fit where selection traces choose.

    Args:
        wall_s: Seconds of the search; ``None`` where iterations are counted.
        exact: Whether the records have no noise.

    Returns:
        Samples of all traces together.

    Example:
        >>> searched_in(None), searched_in(60.0), searched_in(10.0)
        (40000, 12000, 8000)
    """
    most = SEARCHED if wall_s is None else min(SEARCHED, A_SECOND * wall_s)
    return round(max(LEAST_SEARCHED, OF_EXACT * most if exact else most))


def _seen(fitted: Sequence[Trace], share: float) -> tuple[list[Trace], str]:
    """A share of what is fitted, and which: whole traces where there are many, else the beginning of each."""
    whole = int(share * len(fitted))
    if whole < FEW:
        return [_piece(one, 0, math.ceil(share * len(one))) for one in fitted], f"the first {share:.0%}"
    places = np.linspace(0, len(fitted) - 1, whole).round().astype(int)
    return [fitted[k] for k in places], f"{whole} of the {len(fitted)} traces"


def ends_held_out(traces: Sequence[Trace]) -> tuple[tuple[Trace, ...], tuple[Trace, ...]]:
    """The traces without their ends, and these ends.

    Args:
        traces: Estimation traces.

    Returns:
        What is fitted, and what chooses.
    """
    cuts = [(trace, round((1.0 - END) * len(trace))) for trace in traces]
    fitted = tuple(_piece(trace, 0, cut) for trace, cut in cuts if cut)
    return fitted, tuple(_piece(trace, cut, len(trace)) for trace, cut in cuts if cut < len(trace))


Pairs = list[tuple[list[Trace], list[Trace]]]


def _held_out(traces: Sequence[Trace], mapping: Mapping, start: Start, *, in_turn: bool) -> tuple[Pairs, str]:
    """What is fitted and what chooses, fold by fold, and the rule."""
    if len(traces) >= FOLDS:
        groups = [list(traces[k::FOLDS]) for k in range(FOLDS)]
        pairs = [([one for one in traces if one not in group], group) for group in groups]
        what = f"every {FOLDS}th estimation trace"
    else:
        firsts = [_first(trace, mapping, start) for trace in traces]
        blocks = {_blocks(len(trace), first) for trace, first in zip(traces, firsts, strict=True)}
        pairs = [masked(traces, k, firsts) for k in range(FOLDS)]
        what = f"every {FOLDS}th of {max(blocks)} blocks of {'the' if len(traces) == 1 else 'each'} estimation trace"
    rule = f"No selection traces are declared, so that {what} chose"
    if in_turn or sum(map(len, traces)) <= SHORT:
        return pairs, f"{rule}, all of them in turn, and was not fitted meanwhile."
    return [min(reversed(pairs), key=_beyond)], f"{rule} and was not fitted meanwhile."


def _beyond(pair: tuple[list[Trace], list[Trace]]) -> float:
    """By how much what chooses goes beyond what is fitted, in ranges of that; 0 where it is little.

    A model that is chosen where it cannot know better, as on the record of the largest amplitude, is chosen by chance.
    """
    fitted, chooses = (np.concatenate([one.values[one.usable_samples] for one in some]) for some in pair)
    low, high = fitted.min(axis=0), fitted.max(axis=0)
    over = np.maximum(low - chooses.min(axis=0), chooses.max(axis=0) - high) / np.maximum(high - low, 1e-300)
    return float(over.max()) if over.max() > LITTLE_BEYOND else 0.0


def masked(traces: Sequence[Trace], fold: int, firsts: Sequence[int]) -> tuple[list[Trace], list[Trace]]:
    """Traces whose every fourth block does not count, and the same of which nothing else does.

    Both run over the whole record from the same beginning, so that no block has an initial state of its own to guess.

    Args:
        traces: Estimation traces.
        fold: Which blocks are held out, from 0 to 3.
        firsts: Samples of each from which its run takes its initial state: in both parts, and scored in neither.

    Returns:
        What is fitted, and what chooses.
    """
    fitted, chooses = [], []
    for trace, first in zip(traces, firsts, strict=True):
        held, begins = _held(len(trace), first, fold), np.arange(len(trace)) < first
        fitted.append(replace(trace, usable=_also(trace, ~held | begins)))
        chooses.append(replace(trace, name=f"{trace.name}, held out {fold + 1}", usable=_also(trace, held | begins)))
    return fitted, chooses


def _also(trace: Trace, counts: NDArray[np.bool_]) -> NDArray[np.bool_]:
    return counts if trace.usable is None else (trace.usable.T & counts).T


def _held(n: int, first: int, fold: int) -> NDArray[np.bool_]:
    """Samples of the blocks that a part holds out; the beginning is in the first block."""
    return np.asarray(np.maximum(np.arange(n) - first, 0) * _blocks(n, first) // max(n - first, 1) % FOLDS == fold)


def _blocks(n: int, first: int) -> int:
    return FOLDS * max(1, min(BLOCKS, (n - first) // (FOLDS * LEAST)))


def _first(trace: Trace, mapping: Mapping, start: Start) -> int:
    """Samples from which a run takes its initial state; they are in both parts, and scored in neither.

    A run is scored behind the window that the samples of a part show, and these are fewer than those of the record.
    """
    n = len(trace)
    if start.kind is not StartKind.ESTIMATED:
        return min(start.n_measured, n - 1)
    inputs, known = trace.columns(mapping.inputs), trace.usable_samples
    first, seen = n, window(1, known, inputs, asked=start.n_measured)
    while seen < first:
        first = seen
        parts = [known & (_held(n, first, fold) | (np.arange(n) < first)) for fold in range(FOLDS)]
        seen = min(window(1, part, inputs, asked=start.n_measured) for part in parts)
    return first


def _fold(data: Data, fitted: Sequence[Trace], chooses: Sequence[Trace]) -> Fold:
    roles = {trace.name: Role.ESTIMATION for trace in fitted}
    return Fold(fitted=TraceSet(name=data.traces.name, traces=tuple(fitted), roles=roles), chooses=tuple(chooses))


def _piece(trace: Trace, first: int, last: int) -> Trace:
    return replace(
        trace,
        name=trace.name if first == 0 else f"{trace.name}, from sample {first}",
        values=trace.values[first:last],
        usable=None if trace.usable is None else trace.usable[first:last],
        weights=None if trace.weights is None else trace.weights[first:last],
        start_time=trace.start_time + first * trace.sample_time,
    )
