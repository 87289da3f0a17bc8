"""What is compiled in this process: told as it begins, and how long it has taken so far.

Numba compiles what computes when it is first called after an installation, and keeps it. Who times a few iterations to
say how long all of them will take has to know what of it was that.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cache
from typing import Any

_told: list[Callable[[], None]] = []
_taken: list[float] = [0.0]


def tell_of_compiling(tell: Callable[[], None]) -> None:
    """Have somebody told, once, when something is compiled that was not kept yet.

    Args:
        tell: Called as the first compilation begins.
    """
    _told.append(tell)


def compiled_s() -> float:
    """How long this process has compiled.

    Returns:
        Seconds of the processor; 0 where all that was called had been kept.
    """
    return _taken[0]


@cache
def listen() -> None:
    """Listen to Numba, which has to be imported; once a process."""
    from numba.core import event

    event.register("numba:compile", listener())


def listener() -> Any:
    """Who tells, and adds up.

    Returns:
        A listener of Numba's; all of its events come under the one lock of the compiler.
    """
    from numba.core import event

    class Compilation(event.Listener):  # type: ignore[misc]  # Numba has no types
        """Tells of the first, and times the outermost: what is called is compiled within what calls it."""

        def __init__(self) -> None:
            self._began: list[float] = []

        def on_start(self, _: Any) -> None:
            """Something is compiled, and was not found among what is kept."""
            while _told:
                _told.pop()()
            self._began.append(time.process_time())

        def on_end(self, _: Any) -> None:
            """It is compiled."""
            began = self._began.pop()
            if not self._began:
                _taken[0] += time.process_time() - began

    return Compilation()
