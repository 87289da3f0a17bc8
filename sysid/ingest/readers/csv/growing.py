"""An array that grows at its end, without a second copy when it is whole."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


class Growing:
    """Numbers that come in parts.

    Args:
        dtype: Of the numbers.
        expected: How many are expected; memory that is not written to costs none.
    """

    def __init__(self, dtype: type[np.generic], expected: int = 0) -> None:
        self._buffer = np.empty(max(expected, 0), dtype=dtype)
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def extend(self, part: NDArray[Any]) -> None:
        """Add a part.

        Args:
            part: One-dimensional.
        """
        end = self._count + len(part)
        if end > len(self._buffer):
            grown = np.empty(max(end, len(self._buffer) * 5 // 4), dtype=self._buffer.dtype)
            grown[: self._count] = self._buffer[: self._count]
            self._buffer = grown
        self._buffer[self._count : end] = part
        self._count = end

    def whole(self) -> NDArray[Any]:
        """All of them, as a view."""
        return self._buffer[: self._count]
