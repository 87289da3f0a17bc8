"""Scaling: the affine map between the channels' units and the model's own numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class Scaling:
    """``scaled = (value - offset) / scale`` for each input and for the output.

    Args:
        input_offset: One per input, in its unit.
        input_scale: One per input, in its unit, positive.
        output_offset: In the output's unit.
        output_scale: In the output's unit, positive.
    """

    input_offset: tuple[float, ...]
    input_scale: tuple[float, ...]
    output_offset: float
    output_scale: float

    @classmethod
    def identity(cls, n_inputs: int) -> Scaling:
        """Values as they are.

        Args:
            n_inputs: Number of inputs.

        Returns:
            Offsets 0 and scales 1.
        """
        return cls(input_offset=(0.0,) * n_inputs, input_scale=(1.0,) * n_inputs, output_offset=0.0, output_scale=1.0)

    @classmethod
    def to_unit_range(cls, inputs: Sequence[NDArray[np.float64]], outputs: Sequence[NDArray[np.float64]]) -> Scaling:
        """Map the range seen in the records onto -1 to 1 (MATLAB's ``mapminmax``).

        Args:
            inputs: Each record's inputs, shape ``(n_samples, n_inputs)``.
            outputs: Each record's output, shape ``(n_samples,)``.

        Returns:
            The scaling; a channel that does not vary keeps scale 1.
        """
        low = np.min([record.min(axis=0) for record in inputs], axis=0)
        high = np.max([record.max(axis=0) for record in inputs], axis=0)
        y_low, y_high = min(y.min() for y in outputs), max(y.max() for y in outputs)
        half = np.where(high > low, (high - low) / 2.0, 1.0)
        return cls(
            input_offset=tuple(float(value) for value in (high + low) / 2.0),
            input_scale=tuple(float(value) for value in half),
            output_offset=float(y_high + y_low) / 2.0,
            output_scale=float(y_high - y_low) / 2.0 if y_high > y_low else 1.0,
        )

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        return {
            "input_offset": list(self.input_offset),
            "input_scale": list(self.input_scale),
            "output_offset": self.output_offset,
            "output_scale": self.output_scale,
        }

    @classmethod
    def from_dict(cls, fields: Mapping[str, Any]) -> Scaling:
        """The scaling that :meth:`to_dict` wrote.

        Args:
            fields: What it wrote.

        Returns:
            The scaling.
        """
        return cls(
            input_offset=tuple(fields["input_offset"]),
            input_scale=tuple(fields["input_scale"]),
            output_offset=fields["output_offset"],
            output_scale=fields["output_scale"],
        )

    def scale_inputs(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Inputs in the model's numbers, shape ``(n_samples, n_inputs)``."""
        scaled = np.ascontiguousarray(inputs - np.array(self.input_offset))
        scaled /= np.array(self.input_scale)  # in place: of a long record each copy is many MB
        return scaled

    def scale_output(self, output: NDArray[np.float64]) -> NDArray[np.float64]:
        """Outputs in the model's numbers, any shape."""
        scaled = output - self.output_offset
        scaled /= self.output_scale  # in place, as above
        return scaled

    def unscale_output(self, output: NDArray[np.float64]) -> NDArray[np.float64]:
        """Outputs in the channel's unit, any shape."""
        values = output * self.output_scale
        values += self.output_offset
        return values

    def unscale_columns(self, columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Scaled outputs, shape ``(n_samples, 1)``, in the channel's unit and without that axis."""
        return self.unscale_output(columns[:, 0])

    @property
    def error_unit(self) -> float:
        """A squared error of 1 in scaled numbers, as errors are told: in the output's unit squared."""
        return self.output_scale**2


@dataclass(frozen=True, kw_only=True)
class VectorScaling:
    """``scaled = (value - offset) / scale`` for every input and every one of several outputs.

    Args:
        input_offset: One per input, in its unit.
        input_scale: One per input, in its unit, positive.
        output_offset: One per output, in its unit.
        output_scale: One per output, in its unit, positive.
    """

    input_offset: tuple[float, ...]
    input_scale: tuple[float, ...]
    output_offset: tuple[float, ...]
    output_scale: tuple[float, ...]

    @classmethod
    def of(cls, scalings: Sequence[Scaling]) -> VectorScaling:
        """Scalings of single outputs of the same inputs, side by side."""
        return cls(
            input_offset=scalings[0].input_offset,
            input_scale=scalings[0].input_scale,
            output_offset=tuple(one.output_offset for one in scalings),
            output_scale=tuple(one.output_scale for one in scalings),
        )

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        return {name: list(getattr(self, name)) for name in self.__dataclass_fields__}

    @classmethod
    def from_dict(cls, fields: Mapping[str, Any]) -> VectorScaling:
        """The scaling that :meth:`to_dict` wrote."""
        return cls(**{name: tuple(fields[name]) for name in cls.__dataclass_fields__})

    def scale_inputs(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Inputs in the model's numbers, shape ``(n_samples, n_inputs)``."""
        scaled = np.ascontiguousarray(inputs - np.array(self.input_offset))
        scaled /= np.array(self.input_scale)  # in place: of a long record each copy is many MB
        return scaled

    def scale_output(self, output: NDArray[np.float64]) -> NDArray[np.float64]:
        """Outputs in the model's numbers, the last axis that of the outputs."""
        scaled = np.asarray(output - np.array(self.output_offset))
        scaled /= np.array(self.output_scale)
        return scaled

    def unscale_output(self, output: NDArray[np.float64]) -> NDArray[np.float64]:
        """Outputs in the channels' units, the last axis that of the outputs."""
        values = np.asarray(output * np.array(self.output_scale))
        values += np.array(self.output_offset)
        return values

    def unscale_columns(self, columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Scaled outputs, shape ``(n_samples, n_outputs)``, in the channels' units."""
        return self.unscale_output(columns)

    @property
    def error_unit(self) -> float:
        """A squared error of 1 in scaled numbers, as errors are told: several outputs have no unit in common."""
        return 1.0


def scaling_from_dict(fields: Mapping[str, Any]) -> Scaling | VectorScaling:
    """The scaling of one output, or of several, that was written.

    Args:
        fields: What ``to_dict`` wrote.

    Returns:
        The scaling.
    """
    return (VectorScaling if isinstance(fields["output_scale"], list) else Scaling).from_dict(fields)
