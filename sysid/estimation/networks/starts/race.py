"""The starts of a fit side by side: all for some of the iterations, the better half further (successive halving)."""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.networks.starts import cautious
from sysid.estimation.networks.starts.advancing import advance
from sysid.estimation.networks.starts.halving import better_half, rungs_of, turns
from sysid.estimation.networks.starts.multistart import Candidate, Multistart, check_samples

FEWEST = 5
"""Iterations for which there has to be time in its first part for a start to be begun, or that part where it has fewer:
where an iteration is slow, few starts that come somewhere tell more than many that stand where they began."""


def run_race(multistart: Multistart) -> list[Candidate]:
    """Train the starts; an interruption from the keyboard ends the race, and what there is comes back.

    Threads suffice: the kernels and BLAS release the interpreter.

    Args:
        multistart: What they have in common.

    Returns:
        Every start at every rung that it reached; before them the cautious fits of a short record.

    Raises:
        TraceError: If no sample counts.
    """
    check_samples(multistart.provider)
    training = multistart.training
    rungs = rungs_of(training)
    numbers = list(range(training.n_starts))
    latest: dict[int, Candidate] = {}
    seen: list[Candidate] = []
    total = turns(training.n_starts, rungs, training.workers, multistart.least)
    # The limit of BLAS threads is the process's: held here, it does not depend on which start ends first.
    with one_blas_thread():
        for rung, share in enumerate(rungs):
            before = rungs[rung - 1] if rung else 0.0
            seconds = training.max_time_s * (share - before) / total
            reached: dict[int, Candidate] = {}
            for some in _one_by_one(multistart, numbers) if rung == 0 else [numbers]:
                _rung(multistart, some, latest, (share, seconds), reached)
                more = len(some) < len(numbers)
                if multistart.stop.is_set() or (
                    more and any(multistart.enough(reached[n]) for n in some if n in reached)
                ):
                    break
            if rung == 0:  # the time of those that were left out is the others'
                total = turns(len(reached), rungs, training.workers, multistart.least)
            seen += [candidate for n, candidate in sorted(reached.items()) if candidate is not latest.get(n)]
            if multistart.stop.is_set():
                break
            latest = reached
            order = sorted(reached.values(), key=lambda c: (not c.solution.status.usable, c.loss))
            numbers = [candidate.number for candidate in better_half(order, multistart.least)]
        return [*_cautious(multistart, seen, list(latest)), *seen]


def _cautious(multistart: Multistart, seen: Sequence[Candidate], ends: Sequence[int]) -> list[Candidate]:
    """Starts of a short record fitted once more, each with its place among the others."""
    begun = cautious.begun(multistart, seen, ends)
    if begun is None:
        return []
    own, numbers = begun
    reached: dict[int, Candidate] = {}
    _rung(own, numbers, {}, (1.0, math.inf), reached)
    n_samples = multistart.provider.n_samples
    return [cautious.placed(one, cautious.beside(one, seen, multistart), n_samples) for one in reached.values()]


def _one_by_one(multistart: Multistart, numbers: Sequence[int]) -> list[Sequence[int]]:
    """Starts in the order in which they are looked at first."""
    alone = multistart.alone
    return [one for one in (*([n] for n in numbers[:alone]), numbers[alone:]) if one]


def _rung(
    multistart: Multistart,
    numbers: Sequence[int],
    latest: dict[int, Candidate],
    limits: tuple[float, float],
    reached: dict[int, Candidate],
) -> None:
    """One rung of the race, to a share of the iterations within some seconds.

    Workers leave what they reach in a table: an interruption loses none of it.
    """
    share, seconds = limits
    begun: list[threading.Event] = []

    def work(number: int) -> None:
        ended = threading.Event()
        begun.append(ended)
        try:
            if not multistart.stop.is_set() and (latest or _in_time(multistart, reached, share, seconds)):
                reached[number] = advance(multistart, number, latest.get(number), share, seconds)
        finally:
            ended.set()

    with ThreadPoolExecutor(
        min(multistart.training.workers, len(numbers))
    ) as pool:  # leaving it waits for those that run
        try:
            for future in [pool.submit(work, number) for number in numbers]:
                future.result()
        except KeyboardInterrupt:
            multistart.stop.set()
        except BaseException:
            multistart.stop.set()  # nobody waits for the others
            raise
    for ended in begun:  # the pool does not know of a thread during whose start it was interrupted
        ended.wait()
    if not reached and not latest:  # interrupted before anything had begun: the start as it is
        reached[numbers[0]] = advance(multistart, numbers[0], None, share, seconds)


def _in_time(multistart: Multistart, reached: dict[int, Candidate], share: float, seconds: float) -> bool:
    """Whether there is time for another start, by what an iteration of those before it took."""
    curves = [one.solution.curve[-1] for one in list(reached.values())]
    each = [one.elapsed_s / one.iteration for one in curves if one.iteration]
    first = min(FEWEST, max(1, round(share * multistart.training.max_iterations)))
    return not each or min(each) * first <= seconds
