"""A recursion as torch modules: one step, and a whole free run, on any device and number type.

Both can be scripted (TorchScript), and both leave the graph of derivatives intact. Annotations are evaluated in
this file, because TorchScript does not read them as text.
"""

import numpy as np
import torch
from torch import Tensor, nn

from sysid.export.layout import StateLayout
from sysid.models import AbstractModel


class RecursionStep(nn.Module):
    """One step with explicit state.

    Args:
        model: The model.
        dtype: Of the numbers; inputs and state must have it too.
    """

    input_offset: Tensor
    input_scale: Tensor
    regressor_columns: Tensor
    state_columns: Tensor
    hidden_weights: Tensor
    hidden_bias: Tensor
    readout: Tensor
    linear: Tensor
    constant: Tensor

    def __init__(self, model: AbstractModel, dtype: torch.dtype = torch.float64) -> None:
        super().__init__()
        layout, recursion = StateLayout.of(model), model.recursion
        scaling = recursion.scaling
        numbers = {
            "input_offset": scaling.input_offset,
            "input_scale": scaling.input_scale,
            "hidden_weights": recursion.hidden_weights.T,
            "hidden_bias": recursion.hidden_bias,
            "readout": recursion.readout[:, np.newaxis],
            "linear": recursion.linear[:, np.newaxis],
            "constant": [recursion.constant],
        }
        for name, values in numbers.items():
            self.register_buffer(name, torch.tensor(np.array(values), dtype=dtype))
        self.register_buffer("regressor_columns", torch.tensor(layout.regressor_columns(recursion.lags)))
        self.register_buffer("state_columns", torch.tensor(layout.next_columns()))
        self.low, self.high = float(recursion.low), float(recursion.high)
        self.output_offset, self.output_scale = float(scaling.output_offset), float(scaling.output_scale)

    def forward(self, u: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """One step.

        Args:
            u: Inputs in their units, shape ``(batch, n_inputs)``.
            state: Shape ``(batch, n_state)``.

        Returns:
            Output in its unit, shape ``(batch, 1)``, and the next state.
        """
        scaled = (u - self.input_offset) / self.input_scale
        x = torch.cat([scaled, state], dim=1).index_select(1, self.regressor_columns)
        hidden = torch.tanh(torch.addmm(self.hidden_bias, x, self.hidden_weights))
        total = torch.addmm(torch.addmm(self.constant, x, self.linear), hidden, self.readout)
        y = torch.clamp(total, self.low, self.high)
        following = torch.cat([scaled, y, state], dim=1).index_select(1, self.state_columns)
        return y * self.output_scale + self.output_offset, following


class RecursionSequence(nn.Module):
    """A free run of any length.

    Args:
        model: The model.
        dtype: Of the numbers; inputs and state must have it too.
    """

    def __init__(self, model: AbstractModel, dtype: torch.dtype = torch.float64) -> None:
        super().__init__()
        self.step = RecursionStep(model, dtype)

    def forward(self, u: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """A free run.

        Args:
            u: Inputs in their units, shape ``(time, batch, n_inputs)``, at least one sample.
            state: Shape ``(batch, n_state)``.

        Returns:
            Output in its unit, shape ``(time, batch, 1)``, and the state after the last sample.
        """
        outputs: list[Tensor] = []
        for sample in u.unbind(0):
            y, state = self.step(sample, state)
            outputs.append(y)
        return torch.stack(outputs), state
