"""What a damping strategy of Levenberg-Marquardt is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True, eq=False)
class AbstractDamping(ABC):
    """How far a step may go: the damped matrix is ``H + factor * diag(scale)``.

    A strategy is a file with a class like this one and a row in the table beside it. All that it remembers are its
    fields, numbers or arrays, so that a fit that was put aside goes on with it.

    Args:
        factor: Damping factor.
        scale: Shape ``(n_parameters,)``; ``None`` before the first step.
    """

    kind: ClassVar[str]
    """How training options name it."""

    factor: float = 1e-3
    scale: NDArray[np.float64] | None = None

    @abstractmethod
    def scaled_by(self, diagonal: NDArray[np.float64]) -> Self:
        """The damping for the next step, before it is tried.

        Args:
            diagonal: Diagonal of the penalised Gauss-Newton matrix, shape ``(n_parameters,)``.

        Returns:
            The damping with a scale.
        """

    @abstractmethod
    def accepted(self, gain: float) -> Self:
        """The damping after a step that was taken.

        Args:
            gain: Actual over predicted decrease of the loss.

        Returns:
            As a rule a smaller one.
        """

    @abstractmethod
    def rejected(self) -> Self:
        """The damping after a step that was not taken; a larger one, or the search for a step never ends."""

    def to_dict(self) -> dict[str, Any]:
        """All that it remembers, as JSON values."""
        return {"kind": self.kind, **asdict(replace(self, scale=None)), "scale": _listed(self.scale)}

    @classmethod
    def from_dict(cls, kept: Mapping[str, Any]) -> Self:
        """As it was.

        Args:
            kept: From :meth:`to_dict`.

        Returns:
            The damping.
        """
        numbers = {name: float(value) for name, value in kept.items() if name not in {"kind", "scale"}}
        scale = None if kept["scale"] is None else np.array(kept["scale"], dtype=np.float64)
        return cls(**numbers, scale=scale)


def _listed(values: NDArray[np.float64] | None) -> list[float] | None:
    return None if values is None else [float(value) for value in values]
