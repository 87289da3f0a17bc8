"""An experiment over frequency: a measured frequency response, or input and output spectra."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError


@dataclass(frozen=True, kw_only=True, eq=False)
class Spectrum:
    """One experiment over frequency, in the channels' units, in steady state.

    Args:
        frequency: In rad/s, shape ``(n_points,)``.
        inputs: Input spectra, shape ``(n_points, n_inputs)``; for a measured frequency response 1 for its input and
            0 for the others.
        output: Output spectrum, shape ``(n_points,)``.
        weights: Weight of each point's squared error, shape ``(n_points,)``; all ones if not given.

    Raises:
        TraceError: If shapes disagree or a value is not finite.
    """

    frequency: NDArray[np.float64]
    inputs: NDArray[np.complex128]
    output: NDArray[np.complex128]
    weights: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "frequency", np.asarray(self.frequency, dtype=np.float64))
        object.__setattr__(self, "inputs", np.asarray(self.inputs, dtype=np.complex128))
        object.__setattr__(self, "output", np.asarray(self.output, dtype=np.complex128))
        n = len(self.frequency)
        shapes = (self.inputs.shape[:1], self.output.shape, np.shape(self.point_weights))
        finite = all(np.isfinite(part).all() for part in (self.frequency, self.inputs, self.output))
        if self.inputs.ndim != 2 or set(shapes) != {(n,)} or not finite or n == 0:
            raise TraceError(
                "not a spectrum",
                expected="finite values, inputs of shape (n_points, n_inputs), and one output and weight per frequency",
                got=f"shapes {self.inputs.shape} and {self.output.shape} for {n} frequencies",
                remedy="give one row per frequency",
            )

    @property
    def point_weights(self) -> NDArray[np.float64]:
        """The weights as an array."""
        return np.ones(len(self.frequency)) if self.weights is None else np.asarray(self.weights, dtype=np.float64)

    @classmethod
    def of_response(
        cls,
        frequency: NDArray[np.float64],
        response: NDArray[np.complex128],
        *,
        weights: NDArray[np.float64] | None = None,
    ) -> tuple[Spectrum, ...]:
        """Measured frequency responses, one experiment for each input.

        Args:
            frequency: In rad/s, shape ``(n_points,)``.
            response: Output unit per input unit, shape ``(n_points, n_inputs)``, or ``(n_points,)`` of one input.
            weights: As in the class.

        Returns:
            One spectrum per input.
        """
        response = np.asarray(response, dtype=np.complex128)
        response = response[:, np.newaxis] if response.ndim == 1 else response
        unit = np.eye(response.shape[1], dtype=np.complex128)
        return tuple(
            cls(
                frequency=frequency, inputs=np.tile(unit[j], (len(response), 1)), output=response[:, j], weights=weights
            )
            for j in range(response.shape[1])
        )
