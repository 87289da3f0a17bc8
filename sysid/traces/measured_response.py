"""A measured frequency response: what a sweep or an analyser gives in place of samples over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class MeasuredResponse:
    """How an output answers an input, by frequency.

    Args:
        name: What it is called.
        frequency: In rad/s, rising, shape ``(n_points,)``.
        values: Output unit per input unit, shape ``(n_points,)``.
        coherence: From 0 to 1, shape ``(n_points,)``; ``None`` where it was not measured.
        notes: What was guessed or left out, one sentence each.

    Raises:
        TraceError: If shapes disagree, a value is not finite, or fewer than two frequencies are there.
    """

    name: str
    frequency: NDArray[np.float64]
    values: NDArray[np.complex128]
    coherence: NDArray[np.float64] | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        w, parts = np.asarray(self.frequency), [np.asarray(self.values)]
        parts += [] if self.coherence is None else [np.asarray(self.coherence)]
        shapes = w.ndim == 1 and len(w) > 1 and all(part.shape == w.shape for part in parts)
        if not (shapes and all(np.isfinite(part).all() for part in (w, *parts)) and w[0] >= 0.0):
            raise TraceError(
                "not a frequency response",
                where=self.name,
                expected="two frequencies or more, from 0 on, with one finite value for each",
                got=f"shapes {', '.join(str(part.shape) for part in (w, *parts))}",
                remedy="give one row for each frequency, without blanks",
            )

    def __len__(self) -> int:
        return len(self.frequency)

    def __str__(self) -> str:
        low, high = self.frequency[[0, -1]] / (2.0 * np.pi)
        head = f"frequency response {self.name}: {len(self)} points from {low:.4g} to {high:.4g} Hz"
        return "\n".join([head + (", with coherence" if self.coherence is not None else ""), *self.notes])

    __repr__ = __str__
