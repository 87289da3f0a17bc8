"""Who sits in an ensemble where selection traces choose: forward selection with replacement.

From the best candidates of a multistart the pick that lowers the error of the whole on the selection traces most is
cast next, until none lowers it by :data:`WORTH` (Caruana et al. 2004, "Ensemble selection from libraries of models",
section 2.1). A network that sticks or runs away on some inputs takes the mean with it, though: the whole has to pass
the check of its free run, where there is one, and where it does not, picks are cast once more and it has to after every
pick.

Limits: the selection traces choose more often than between single starts, so that their score is the less a figure of
accuracy.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Generic, TypeVar

import numpy as np

ELIGIBLE = 40
"""Candidates that may be picked, best on the selection traces first."""

WORTH = 0.01
"""Least share by which a pick has to lower the error: neurons that bring less are not worth their run time."""

Whole = TypeVar("Whole")
"""What a ballot is about: networks, or their runs, of which the mean is taken as well."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Ensemble(Generic[Whole]):
    """Who was selected.

    Args:
        picks: For each member its place among the candidates and its picks, in the order of their first pick.
        model: The united network, or what stands for it.
        score: Its error on the selection traces.
    """

    picks: dict[int, int]
    model: Whole
    score: float


def elect(
    models: Sequence[Whole],
    scores: Sequence[float],
    score: Callable[[Whole], float],
    *,
    unite: Callable[[Sequence[Whole], Sequence[int]], Whole],
    picks: int,
    origins: Sequence[int] | None = None,
    accept: Callable[[Whole], bool] = lambda _: True,
    workers: int = 1,
    on_pick: Callable[[int], None] = lambda _: None,
) -> Ensemble[Whole] | None:
    """Make the picks one after the other, each for the member that helps most.

    A check of a free run costs as much as a pick. The one that matters is that of the network that comes out: picks are
    first cast unchecked, and only where that network fails they are cast once more, with a check after every one.

    Args:
        models: The candidates, all of one structure and scaling.
        scores: Error of each on the selection traces; one that is not finite is not eligible.
        score: The error of a model on them.
        unite: The mean of some, by the picks of each.
        picks: At most so many.
        origins: The start that each candidate comes from; by default each is its own.
        accept: Whether a united network may stand; where picks are cast once more, whoever would make it one that may
            not is passed over from then on, and with him all that come from the same start.
        workers: Models that are run at the same time.
        on_pick: Called with the number of each pick that is about to be cast.

    Returns:
        The ensemble, of one member where no second pick helps; ``None`` where not even one may stand.
    """
    ballot = partial(
        _cast,
        models,
        scores,
        score,
        unite=unite,
        picks=picks,
        origins=origins or range(len(models)),
        workers=workers,
        on_pick=on_pick,
    )
    unchecked = ballot(accept=lambda _: True)
    return unchecked if unchecked is None or accept(unchecked.model) else ballot(accept=accept)


def _cast(
    models: Sequence[Whole],
    scores: Sequence[float],
    score: Callable[[Whole], float],
    *,
    unite: Callable[[Sequence[Whole], Sequence[int]], Whole],
    picks: int,
    origins: Sequence[int],
    accept: Callable[[Whole], bool],
    workers: int,
    on_pick: Callable[[int], None],
) -> Ensemble[Whole] | None:
    """The picks made, each checked; see :func:`elect`."""
    order = sorted((i for i, value in enumerate(scores) if np.isfinite(value)), key=lambda i: scores[i])
    eligible, found = order[:ELIGIBLE], dict(enumerate(scores))
    ensemble: Ensemble[Whole] | None = None
    with ThreadPoolExecutor(workers) as pool:
        for pick in range(1, picks + 1):
            on_pick(pick)
            selected = Counter(ensemble.picks) if ensemble else Counter[int]()
            networks = {i: _of(models, selected + Counter([i]), unite) for i in eligible}
            if ensemble:
                found = dict(zip(eligible, pool.map(score, networks.values()), strict=True))
            bar = (1.0 - WORTH) * ensemble.score if ensemble else np.inf
            better = sorted((i for i in eligible if found[i] < bar), key=found.__getitem__)
            cast, barred = _first_accepted(better, origins, networks, accept)
            if cast is None:
                break
            # the very network that was accepted: a check that knows it need not run again
            tally = dict(selected + Counter([cast]))
            ensemble = Ensemble(picks=tally, model=networks[cast], score=found[cast])
            eligible = [i for i in eligible if origins[i] not in barred]
    return ensemble


def _first_accepted(
    ranked: Sequence[int],
    origins: Sequence[int],
    networks: Mapping[int, Whole],
    accept: Callable[[Whole], bool],
) -> tuple[int | None, set[int]]:
    """Who is picked, and the starts that are passed over from now on."""
    barred: set[int] = set()
    for i in ranked:
        if origins[i] in barred:
            continue
        if accept(networks[i]):
            return i, barred
        barred.add(origins[i])
    return None, barred


def _of(
    models: Sequence[Whole], picks: Counter[int], unite: Callable[[Sequence[Whole], Sequence[int]], Whole]
) -> Whole:
    return unite([models[i] for i in picks], list(picks.values()))
