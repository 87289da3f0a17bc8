"""Which dead times: descents from likely places, on the same samples for all, and what is to be said of the search."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

from sysid.estimation.nonparametric.dead_time import AROUND, descend

FEW = 4
"""Dead times up to which every combination is tried, whatever a correlation says."""
MOST_COMBINATIONS = 30
"""Combinations of dead times up to which all are tried; above, one input at a time."""


def searched_delays(
    places: Sequence[Sequence[int]], least: int, most: int, loss_at: Callable[[tuple[int, ...], int], float]
) -> tuple[tuple[int, ...], tuple[str, ...]]:
    """Dead times with the least loss.

    Losses are compared on the same samples: those whose inputs are in the record for the longest dead time.

    Args:
        places: For each input the dead times about which to look, the likeliest first.
        least: The shortest that is tried.
        most: The longest.
        loss_at: The loss of some dead times where so many first samples of each record do not count.

    Returns:
        The dead times, and what is to be said of the search.
    """
    m = len(places)
    places = [[min(max(place, least), most) for place in of] for of in places]
    few = range(least, min(FEW, most) + 1)
    known: dict[tuple[int, ...], float] = {}
    reach = [min(most, max(FEW, *(place for of in places for place in of)) + 2 * AROUND)]

    def loss(delays: tuple[int, ...]) -> float:
        if delays not in known:
            known[delays] = loss_at(delays, reach[0])
        return known[delays]

    if len(few) ** m <= MOST_COMBINATIONS:
        starts: list[tuple[int, ...]] = [tuple(k) for k in itertools.product(few, repeat=m)]
    else:
        starts = [(least,) * m, (few[-1],) * m]
    starts += [tuple(of[min(i, len(of) - 1)] for of in places) for i in range(max(len(of) for of in places))]
    ranked = sorted(dict.fromkeys(starts), key=loss)
    best = min((descend(start, least, reach[0], loss) for start in ranked[:2]), key=loss)
    while max(best) == reach[0] < most:  # at the end of what was compared: further
        reach[0] = min(most, 2 * reach[0])
        known.clear()
        best = descend(best, least, reach[0], loss)
    if max(best) < most:
        return best, ()
    return best, (
        f"The dead time of {max(best)} samples is the longest that was tried: the true one may be longer. Longer "
        "records, or max_delay, allow more.",
    )
