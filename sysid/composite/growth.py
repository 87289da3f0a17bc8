"""The rounds by which training data grow, whatever is trained: look for what is worst, add it, train again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

S = TypeVar("S")
X = TypeVar("X")


def worst_of(errors: NDArray[np.float64], count: int, *, beyond: float = -np.inf) -> list[int]:
    """The places of the largest of some errors.

    Args:
        errors: Shape ``(n,)``.
        count: How many at most.
        beyond: Only those above it.

    Returns:
        The largest first; of equal ones the first.

    Example:
        >>> worst_of(np.array([0.1, 0.4, 0.2, 0.4]), 3, beyond=0.15)
        [1, 3, 2]
    """
    return [int(k) for k in np.argsort(-errors, kind="stable")[:count] if errors[k] > beyond]


def in_rounds(
    begun: S,
    *,
    look: Callable[[int, S], Sequence[X]],
    train: Callable[[int, S, Sequence[X]], S],
    ended: Callable[[Sequence[S]], str],
    nothing: str,
) -> tuple[list[S], str]:
    """Let training data grow.

    Args:
        begun: What is there before the first round.
        look: Gives what a round adds, told its number from 1 on and what the round before has left.
        train: Gives what the round comes to, told the same and what it adds.
        ended: Says why there is no further round, told all that came so far; empty where there is one.
        nothing: What is said where a round has nothing to add.

    Returns:
        What was there before, and after each round; and why it ended.

    Example:
        >>> in_rounds(1, look=lambda n, x: [n], train=lambda n, x, added: x + len(added), nothing="none",
        ...           ended=lambda all: "three" if all[-1] == 3 else "")
        ([1, 2, 3], 'three')
    """
    found = [begun]
    while not (why := ended(found)):
        number = len(found)
        if not (added := look(number, found[-1])):
            return found, nothing
        found.append(train(number, found[-1], added))
    return found, why
