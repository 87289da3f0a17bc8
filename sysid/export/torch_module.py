"""A surrogate as torch modules: one step, and a whole free run, on any device and number type.

Both can be scripted (TorchScript), and both leave the graph of derivatives intact. Annotations are evaluated in
this file, because TorchScript does not read them as text.
"""

import numpy as np
import torch
from torch import Tensor, nn

from sysid.export.flags import Flag
from sysid.export.surrogate import Stage, Surrogate
from sysid.models import StateSpace


class StageStep(nn.Module):
    """One step of one stage with explicit state.

    Args:
        stage: The stage.
        dtype: Of the numbers; inputs and state must have it too.
    """

    sources: Tensor
    input_offset: Tensor
    input_scale: Tensor
    regressor_columns: Tensor
    state_columns: Tensor
    hidden_weights: Tensor
    hidden_bias: Tensor
    readout: Tensor
    linear: Tensor
    constant: Tensor

    def __init__(self, stage: Stage, dtype: torch.dtype = torch.float64) -> None:
        super().__init__()
        layout, recursion = stage.layout, stage.recursion
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
            self.register_buffer(name, torch.tensor(np.array(values, order="C"), dtype=dtype))
        self.register_buffer("sources", torch.tensor(stage.sources))
        self.register_buffer("regressor_columns", torch.tensor(layout.regressor_columns(recursion.lags)))
        self.register_buffer("state_columns", torch.tensor(layout.next_columns()))
        self.first, self.size = int(stage.first), int(layout.size)
        self.bounded = stage.bounded
        self.low, self.high = float(recursion.low), float(recursion.high)
        self.output_offset, self.output_scale = float(scaling.output_offset), float(scaling.output_scale)

    def forward(self, known: Tensor, whole_state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """One step.

        Args:
            known: Inputs of the whole and outputs of earlier stages in their units, shape ``(batch, n_known)``.
            whole_state: State of the whole, shape ``(batch, n_state)``.

        Returns:
            Output in its unit, shape ``(batch, 1)``, the stage's next state, and whether the output is held at a
            bound, shape ``(batch, 1)``.
        """
        state = whole_state.narrow(1, self.first, self.size)
        scaled = (known.index_select(1, self.sources) - self.input_offset) / self.input_scale
        x = torch.cat([scaled, state], dim=1).index_select(1, self.regressor_columns)
        hidden = torch.tanh(torch.addmm(self.hidden_bias, x, self.hidden_weights))
        total = torch.addmm(torch.addmm(self.constant, x, self.linear), hidden, self.readout)
        y = torch.clamp(total, self.low, self.high)
        held = (y <= self.low) | (y >= self.high) if self.bounded else torch.zeros_like(y, dtype=torch.bool)
        following = torch.cat([scaled, y, state], dim=1).index_select(1, self.state_columns)
        return y * self.output_scale + self.output_offset, following, held


class LinearStep(nn.Module):
    """One step of a stage that is a state space.

    Args:
        stage: The stage.
        form: Its state space.
        dtype: Of the numbers; inputs and state must have it too.
    """

    sources: Tensor
    input_offset: Tensor
    input_scale: Tensor
    transition: Tensor
    readout: Tensor
    constant: Tensor

    def __init__(self, stage: Stage, form: StateSpace, dtype: torch.dtype = torch.float64) -> None:
        super().__init__()
        scaling = form.scaling
        numbers = {
            "input_offset": scaling.input_offset,
            "input_scale": scaling.input_scale,
            "transition": np.concatenate([form.A, form.B], axis=1).T,
            "readout": np.concatenate([form.C, form.D])[:, np.newaxis],
            "constant": [form.constant],
        }
        for name, values in numbers.items():
            self.register_buffer(name, torch.tensor(np.array(values, order="C"), dtype=dtype))
        self.register_buffer("sources", torch.tensor(stage.sources))
        self.first, self.size = int(stage.first), form.n_state
        self.bounded = stage.bounded
        self.low, self.high = float(form.low), float(form.high)
        self.output_offset, self.output_scale = float(scaling.output_offset), float(scaling.output_scale)

    def forward(self, known: Tensor, whole_state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """One step; see :class:`StageStep`."""
        state = whole_state.narrow(1, self.first, self.size)
        scaled = (known.index_select(1, self.sources) - self.input_offset) / self.input_scale
        x = torch.cat([state, scaled], dim=1)
        y = torch.clamp(torch.addmm(self.constant, x, self.readout), self.low, self.high)
        held = (y <= self.low) | (y >= self.high) if self.bounded else torch.zeros_like(y, dtype=torch.bool)
        return y * self.output_scale + self.output_offset, x @ self.transition, held


class SurrogateStep(nn.Module):
    """One step with explicit state.

    Args:
        surrogate: What is run.
        dtype: Of the numbers; inputs and state must have it too.
    """

    declared_low: Tensor
    declared_high: Tensor

    def __init__(self, surrogate: Surrogate, dtype: torch.dtype = torch.float64) -> None:
        super().__init__()
        self.stages = nn.ModuleList(
            [
                LinearStep(stage, stage.form, dtype) if isinstance(stage.form, StateSpace) else StageStep(stage, dtype)
                for stage in surrogate.stages
            ]
        )
        self.register_buffer("declared_low", torch.tensor([port.low for port in surrogate.inputs], dtype=dtype))
        self.register_buffer("declared_high", torch.tensor([port.high for port in surrogate.inputs], dtype=dtype))
        self.outside_bit, self.bound_bit = int(Flag.OUTSIDE_RANGE), int(Flag.AT_BOUND)
        self.lost_bit = int(Flag.NOT_A_NUMBER)

    def forward(self, u: Tensor, state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """One step.

        Args:
            u: Inputs in their units, shape ``(batch, n_inputs)``.
            state: Shape ``(batch, n_state)``.

        Returns:
            Outputs in their units, shape ``(batch, n_outputs)``, the next state, and the flags, shape ``(batch, 1)``.
        """
        known = u
        states: list[Tensor] = []
        held: list[Tensor] = []
        for stage in self.stages:
            y, following, at_bound = stage(known, state)
            known = torch.cat([known, y], dim=1)
            states.append(following)
            held.append(at_bound)
        outside = ((u < self.declared_low) | (u > self.declared_high)).any(dim=1, keepdim=True)
        flags = outside.to(torch.int32) * self.outside_bit
        flags = flags + torch.cat(held, dim=1).any(dim=1, keepdim=True).to(torch.int32) * self.bound_bit
        flags = flags + torch.isnan(known).any(dim=1, keepdim=True).to(torch.int32) * self.lost_bit
        n_inputs = u.size(1)
        return known[:, n_inputs:], torch.cat(states, dim=1), flags


class SurrogateSequence(nn.Module):
    """A free run of any length.

    Args:
        surrogate: What is run.
        dtype: Of the numbers; inputs and state must have it too.
    """

    def __init__(self, surrogate: Surrogate, dtype: torch.dtype = torch.float64) -> None:
        super().__init__()
        self.step = SurrogateStep(surrogate, dtype)

    def forward(self, u: Tensor, state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """A free run.

        Args:
            u: Inputs in their units, shape ``(time, batch, n_inputs)``, at least one sample.
            state: Shape ``(batch, n_state)``.

        Returns:
            Outputs in their units, shape ``(time, batch, n_outputs)``, the state after the last sample, and the
            flags, shape ``(time, batch, 1)``.
        """
        outputs: list[Tensor] = []
        flags: list[Tensor] = []
        for sample in u.unbind(0):
            y, state, raised = self.step(sample, state)
            outputs.append(y)
            flags.append(raised)
        return torch.stack(outputs), state, torch.stack(flags)
