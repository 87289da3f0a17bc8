"""Which dead times: descents from likely places, on the same samples for all, and what is to be said of the search."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np

from sysid.errors import ConfigError
from sysid.estimation.nonparametric.dead_time import AROUND, descend

FEW = 4
"""Dead times up to which every combination is tried, whatever a correlation says."""
MOST_COMBINATIONS = 30
"""Combinations of dead times up to which all are tried; above, one input at a time."""
MOVE = 0.1
"""Part of what chance does not do from which a dead time is moved: the way to the true one has many such steps."""
LITTLE, LESS, CHANCE = 1e-4, 0.2, 20.0
"""Part of a constant's loss from which an error is worth an explanation; part of a loss that a response within the
sample must take away to be taken for one; and how much less, in twice the log likelihood, chance does not do."""
READ_BACKWARDS = (
    "The output answers within the sample: a dead time of 0 leaves clearly less than 1. Where a controller sets the "
    "input from the output of its own sample, this is the controller read backwards: give delays: 1 then. An "
    "input that moves between samples looks the same: domain: continuous with intersample: foh says so."
)


def check_max_delay(most: int | None, *, searched: bool, field: str) -> None:
    """Refuse a bound of a search that is not made.

    Args:
        most: Largest dead time that is asked to be tried; ``None`` for the usual.
        searched: Whether the structure leaves dead times open.
        field: Of the structure, which says so.

    Raises:
        ConfigError: If dead times are given, and a largest one to try beside them.
    """
    if most is not None and not searched:
        raise ConfigError(
            "no dead time is searched for", where="max_delay", expected=f"nothing, beside {field} that are given",
            got=most, remedy=f"leave max_delay out, or write {field}: auto",
        )  # fmt: skip


def searched_delays(
    places: Sequence[Sequence[int]],
    least: int,
    most: int,
    loss_at: Callable[[tuple[int, ...], int], float],
    loss_near: Callable[[tuple[int, ...], int], float] | None = None,
    *,
    gain: float = 0.0,
) -> tuple[tuple[int, ...], tuple[str, ...]]:
    """Dead times with the least loss.

    Losses are compared on the same samples: those whose inputs are in the record for the longest dead time.

    Args:
        places: For each input the dead times about which to look, the likeliest first.
        least: The shortest that is tried.
        most: The longest.
        loss_at: The loss of some dead times where so many first samples of each record do not count.
        loss_near: The same of dead times next to others that were looked at, which may take less; ``loss_at`` by
            default.
        gain: Part of a loss below which one is no better than another: of an input without effect each place leaves
            something else by chance, and the shortest is as good.

    Returns:
        The dead times, and what is to be said of the search.
    """
    m = len(places)
    places = [[min(max(place, least), most) for place in of] for of in places]
    few = range(least, min(FEW, most) + 1)
    known: dict[tuple[int, ...], float] = {}
    reach = [min(most, max(FEW, *(place for of in places for place in of)) + 2 * AROUND)]

    def loss(delays: tuple[int, ...], by: Callable[[tuple[int, ...], int], float] = loss_near or loss_at) -> float:
        if delays not in known:
            known[delays] = by(delays, reach[0])
        return known[delays]

    informed = [(least,) * m, (few[-1],) * m]
    informed += [tuple(of[min(i, len(of) - 1)] for of in places) for i in range(max(len(of) for of in places))]
    few_each = list(itertools.product(few, repeat=m)) if len(few) ** m <= MOST_COMBINATIONS else []
    for start in dict.fromkeys(informed):
        loss(start, loss_at)
    ranked = sorted(dict.fromkeys([*informed, *few_each]), key=loss)
    best, *others = (descend(start, least, reach[0], loss, MOVE * gain) for start in ranked[:2])
    best = next((other for other in others if loss(other) < (1.0 - gain) * loss(best)), best)
    while max(best) == reach[0] < most:  # at the end of what was compared: further
        reach[0] = min(most, 2 * reach[0])
        known.clear()
        best = descend(best, least, reach[0], loss, MOVE * gain)
    for j in range(m if gain else 0):
        short = (*best[:j], least, *best[j + 1 :])
        if best[j] > least + FEW and loss(short, loss_at) <= (1.0 + gain) * loss(best):
            best = short
    if max(best) < most:
        return best, ()
    return best, (
        f"The dead time of {max(best)} samples is the longest that was tried: the true one may be longer. Longer "
        "records, or max_delay, allow more.",
    )


def without_dead_time(
    delays: tuple[int, ...],
    least: int,
    loss_at: Callable[[tuple[int, ...], int], float],
    constant: tuple[float, int],
) -> tuple[int, ...]:
    """Dead times where those inputs have none that clearly act within the sample.

    One that is sampled from a plant does not, and a dead time of 0 costs a coefficient at the other end: it has to pay.

    Args:
        delays: The dead times with the least loss.
        least: The shortest of the search.
        loss_at: As for :func:`searched_delays`.
        constant: The loss of a constant, and how many samples it is of.

    Returns:
        The dead times.
    """
    scale, count = constant
    best, loss = delays, loss_at(delays, max(delays))
    for j, delay in enumerate(delays):
        if delay != least or loss <= LITTLE * scale:
            continue
        trial = (*best[:j], 0, *best[j + 1 :])
        less = loss_at(trial, max(delays))
        if less < (1.0 - LESS) * loss and count * np.log(loss / max(less, LITTLE**2 * scale)) > CHANCE:
            best, loss = trial, less
    return best
