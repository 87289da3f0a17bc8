"""What was worked out before: fits, advice and searches ask the same of the same records again and again."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from threading import Lock
from typing import Generic, TypeVar

import numpy as np

from sysid.estimation.nonparametric.segments import Segment

T = TypeVar("T")


class Memory(Generic[T]):
    """Results by what they depend on, those that were asked for last.

    Args:
        most: How many a process remembers.
    """

    def __init__(self, most: int) -> None:
        self._most, self._known, self._one_at_a_time = most, dict[str, T](), Lock()

    def get(self, key: str, make: Callable[[], T]) -> T:
        """A result, worked out where it is not known.

        Args:
            key: Of all that it depends on; see :func:`key_of`.
            make: Works it out; what it raises is not remembered.

        Returns:
            It; others have it too, and it must not be changed.
        """
        found = self._known.get(key)
        if found is None:
            found = make()
        with self._one_at_a_time:
            self._known.pop(key, None)
            while len(self._known) >= self._most:
                del self._known[next(iter(self._known))]
            self._known[key] = found  # the last that was asked for goes last
        return found

    def __len__(self) -> int:
        return len(self._known)


def key_of(segments: Sequence[Segment], *further: object) -> str:
    """A key of stretches of a record, and of what else a result depends on.

    Args:
        segments: Samples that count, where they stand, and in which trace.
        further: What has a ``repr`` that tells it from others.

    Returns:
        A digest.
    """
    sha = hashlib.sha256(repr(further).encode())
    for segment in segments:
        sha.update(repr((segment.trace, segment.first, segment.inputs.shape)).encode())
        for signal in (segment.inputs, segment.output, segment.counts()):
            sha.update(np.ascontiguousarray(signal).tobytes())
    return sha.hexdigest()
