"""A surrogate as torch modules: one step, and a whole free run, on any device and number type.

Both can be scripted (TorchScript), and both leave the graph of derivatives intact. Annotations are evaluated in
this file, because TorchScript does not read them as text.
"""

import numpy as np
import torch
from torch import Tensor, nn

from sysid.export.flags import Flag
from sysid.export.forms.lagged import LaggedForm
from sysid.export.forms.programs import ProgramForm
from sysid.export.forms.stage import Stage
from sysid.export.forms.state_space import StateSpaceForm
from sysid.export.surrogate import Surrogate
from sysid.export.torch.equations import EquationStep


class Limits(nn.Module):
    """The declared limits of a stage's outputs.

    Args:
        stage: The stage.
    """

    outputs: list[int]
    told: list[bool]
    upper: list[bool]
    values: list[float]
    columns: list[int]
    offsets: list[float]
    scales: list[float]

    def __init__(self, stage: Stage) -> None:
        super().__init__()
        form, n = stage.form, stage.form.n_inputs
        self.first = int(stage.targets[0])
        self.offsets = [float(value) for value in form.offset[n:]]
        self.scales = [float(value) for value in form.scale[n:]]
        sides = [(j, side) for j, own in enumerate(stage.limits) for side in own]
        self.outputs = [j for j, _ in sides]
        self.told = [stage.told[j] for j, _ in sides]
        self.upper = [side.upper for _, side in sides]
        self.values = [float(side.value) for _, side in sides]
        self.columns = [-1 if side.column is None else int(side.column) for _, side in sides]

    def forward(self, known: Tensor, scaled: Tensor, outputs: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Hold a stage's outputs.

        Args:
            known: Inputs of the whole and outputs of earlier stages in their units, shape ``(batch, n_known)``.
            scaled: The stage's outputs in scaled numbers, shape ``(batch, n_outputs)``.
            outputs: The same in their units.

        Returns:
            Both within the limits; which outputs are at one, shape ``(batch, n_outputs)``; and whether one is at one
            that is told, shape ``(batch, 1)``.
        """
        together = torch.cat([known, outputs], dim=1)
        channels = list(torch.chunk(together, together.size(1), dim=1))
        numbers = list(torch.chunk(scaled, scaled.size(1), dim=1))
        reached = torch.zeros_like(numbers[0], dtype=torch.bool)
        there = list(torch.chunk(torch.zeros_like(scaled, dtype=torch.bool), scaled.size(1), dim=1))
        for i in range(len(self.outputs)):
            j = self.outputs[i]
            at = self.first + j
            limit = torch.full_like(channels[at], self.values[i])
            if self.columns[i] >= 0:
                limit = channels[self.columns[i]]
            beyond = channels[at] > limit if self.upper[i] else channels[at] < limit
            channels[at] = torch.where(beyond, limit, channels[at])
            numbers[j] = torch.where(beyond, (limit - self.offsets[j]) / self.scales[j], numbers[j])
            there[j] = there[j] | (channels[at] == limit)
            if self.told[i]:
                reached = reached | (channels[at] == limit)
        held = torch.cat(numbers, dim=1), torch.cat(channels[self.first :], dim=1)
        return held[0], held[1], torch.cat(there, dim=1), reached


class LaggedStep(nn.Module):
    """One step of one stage with explicit state.

    Args:
        stage: The stage.
        dtype: Of the numbers; inputs and state must have it too.
    """

    sources: Tensor
    input_offset: Tensor
    input_scale: Tensor
    output_offset: Tensor
    output_scale: Tensor
    regressor_columns: Tensor
    state_columns: Tensor
    hidden_weights: Tensor
    hidden_bias: Tensor
    readout: Tensor
    linear: Tensor
    gates: Tensor
    constant: Tensor

    def __init__(self, stage: Stage, dtype: torch.dtype = torch.float64) -> None:
        super().__init__()
        form, layout = stage.lagged
        numbers = {
            **_scaling(form),
            "hidden_weights": form.hidden_weights.T,
            "hidden_bias": form.hidden_bias,
            "readout": form.readout.T,
            "linear": form.linear.T,
            "gates": form.gates.T,
            "constant": form.constant,
        }
        for name, values in numbers.items():
            self.register_buffer(name, torch.tensor(np.array(values, order="C"), dtype=dtype))
        regressors = [layout.column(channel, lag) for channel, own in enumerate(form.lags) for lag in own]
        self.register_buffer("sources", torch.tensor(stage.known_sources, dtype=torch.long))
        self.register_buffer("regressor_columns", torch.tensor(regressors))
        self.register_buffer("state_columns", torch.tensor(layout.next_columns()))
        self.first, self.size = int(stage.first), int(layout.size)
        self.bounded, self.limited, self.gated = stage.bounded, stage.limited, form.gated
        self.low, self.high = float(form.low), float(form.high)
        self.neuron, self.limits = form.neuron.torch(), Limits(stage)

    def forward(self, known: Tensor, whole_state: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """One step.

        Args:
            known: Inputs of the whole and outputs of earlier stages in their units, shape ``(batch, n_known)``.
            whole_state: State of the whole, shape ``(batch, n_state)``.

        Returns:
            Outputs in their units, shape ``(batch, n_outputs)``, the stage's next state, and whether an output is held
            at a bound, and at a declared limit, both of shape ``(batch, 1)``.
        """
        state = whole_state.narrow(1, self.first, self.size)
        scaled = (known.index_select(1, self.sources) - self.input_offset) / self.input_scale
        x = torch.cat([scaled, state], dim=1).index_select(1, self.regressor_columns)
        hidden = self.neuron(torch.addmm(self.hidden_bias, x, self.hidden_weights))
        total = torch.addmm(torch.addmm(self.constant, x, self.linear), hidden, self.readout)
        if self.gated:
            total = total + (hidden * (x @ self.gates)).sum(dim=1, keepdim=True)
        y = torch.clamp(total, self.low, self.high)
        outputs = y * self.output_scale + self.output_offset
        reached, there = torch.zeros_like(y[:, :1], dtype=torch.bool), torch.zeros_like(y, dtype=torch.bool)
        if self.limited:
            y, outputs, there, reached = self.limits(known, y, outputs)
        held = torch.zeros_like(reached)
        if self.bounded:  # A limit that lies beyond a bound is a limit.
            held = (((y <= self.low) | (y >= self.high)) & ~there).any(dim=1, keepdim=True)
        following = torch.cat([scaled, y, state], dim=1).index_select(1, self.state_columns)
        return outputs, following, held, reached


class StateSpaceStep(nn.Module):
    """One step of a stage that is a state space, linear or neural.

    Args:
        stage: The stage.
        dtype: Of the numbers; inputs and state must have it too.
    """

    sources: Tensor
    input_offset: Tensor
    input_scale: Tensor
    output_offset: Tensor
    output_scale: Tensor
    change: Tensor
    drift: Tensor
    readout: Tensor
    constant: Tensor
    state_weights: Tensor
    state_bias: Tensor
    state_readout: Tensor
    output_weights: Tensor
    output_bias: Tensor
    output_readout: Tensor

    def __init__(self, stage: Stage, dtype: torch.dtype = torch.float64) -> None:
        super().__init__()
        form = stage.state_space
        numbers = {
            **_scaling(form),
            "change": form.change.T,
            "drift": form.drift,
            "readout": form.readout.T,
            "constant": form.constant,
            "state_weights": form.state_neurons.weights.T,
            "state_bias": form.state_neurons.bias,
            "state_readout": form.state_neurons.readout.T,
            "output_weights": form.output_neurons.weights.T,
            "output_bias": form.output_neurons.bias,
            "output_readout": form.output_neurons.readout.T,
        }
        for name, values in numbers.items():
            self.register_buffer(name, torch.tensor(np.array(values, order="C"), dtype=dtype))
        self.register_buffer("sources", torch.tensor(stage.known_sources, dtype=torch.long))
        self.first, self.size = int(stage.first), form.n_state
        self.bounded, self.limited = stage.bounded, stage.limited
        self.low, self.high, self.bound = float(form.low), float(form.high), float(form.bound)
        self.rectified = form.rectified
        self.neuron, self.limits = form.neuron.torch(), Limits(stage)

    def forward(self, known: Tensor, whole_state: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """One step; see :class:`LaggedStep`."""
        state = whole_state.narrow(1, self.first, self.size)
        scaled = (known.index_select(1, self.sources) - self.input_offset) / self.input_scale
        x = torch.cat([state, scaled], dim=1)
        total = torch.addmm(self.constant, x, self.readout)
        total = total + self.neuron(torch.addmm(self.output_bias, x, self.output_weights)) @ self.output_readout
        if self.rectified:
            total = torch.abs(total)
        y = torch.clamp(total, self.low, self.high)
        outputs = y * self.output_scale + self.output_offset
        reached, there = torch.zeros_like(y[:, :1], dtype=torch.bool), torch.zeros_like(y, dtype=torch.bool)
        if self.limited:
            y, outputs, there, reached = self.limits(known, y, outputs)
        held = torch.zeros_like(reached)
        if self.bounded:  # A limit that lies beyond a bound is a limit.
            held = (((y <= self.low) | (y >= self.high)) & ~there).any(dim=1, keepdim=True)
        change = torch.addmm(self.drift, x, self.change)
        change = change + self.neuron(torch.addmm(self.state_bias, x, self.state_weights)) @ self.state_readout
        return outputs, torch.clamp(state + change, -self.bound, self.bound), held, reached


def _step_of(stage: Stage, dtype: torch.dtype) -> nn.Module:
    """The module of a stage."""
    if isinstance(stage.form, ProgramForm):
        return EquationStep(stage, Limits(stage))
    return StateSpaceStep(stage, dtype) if isinstance(stage.form, StateSpaceForm) else LaggedStep(stage, dtype)


def _scaling(form: LaggedForm | StateSpaceForm) -> dict[str, tuple[float, ...]]:
    n = form.n_inputs
    return {
        "input_offset": form.offset[:n],
        "input_scale": form.scale[:n],
        "output_offset": form.offset[n:],
        "output_scale": form.scale[n:],
    }


class SurrogateStep(nn.Module):
    """One step with explicit state.

    Args:
        surrogate: What is run.
        dtype: Of the numbers; inputs and state must have it too.
    """

    declared_low: Tensor
    declared_high: Tensor
    columns: Tensor
    late_places: Tensor
    late_columns: Tensor
    late_offset: Tensor
    late_scale: Tensor

    def __init__(self, surrogate: Surrogate, dtype: torch.dtype = torch.float64) -> None:
        super().__init__()
        self.stages = nn.ModuleList([_step_of(stage, dtype) for stage in surrogate.stages])
        self.register_buffer("declared_low", torch.tensor([port.low for port in surrogate.inputs], dtype=dtype))
        self.register_buffer("declared_high", torch.tensor([port.high for port in surrogate.inputs], dtype=dtype))
        self.selects = surrogate.selects
        self.register_buffer("columns", torch.tensor(surrogate.columns, dtype=torch.int64))
        late = surrogate.late
        self.circular = len(late) > 0
        self.register_buffer("late_places", torch.tensor([one.place for one in late], dtype=torch.int64))
        self.register_buffer("late_columns", torch.tensor([one.column for one in late], dtype=torch.int64))
        self.register_buffer("late_offset", torch.tensor([one.offset for one in late], dtype=dtype))
        self.register_buffer("late_scale", torch.tensor([one.scale for one in late], dtype=dtype))
        self.outside_bit, self.bound_bit = int(Flag.OUTSIDE_RANGE), int(Flag.AT_BOUND)
        self.lost_bit, self.limit_bit = int(Flag.NOT_A_NUMBER), int(Flag.AT_LIMIT)
        self.doubt_bit = int(Flag.IN_DOUBT)
        self.doubtful = [any(stage.doubts) for stage in surrogate.stages]

    def forward(self, u: Tensor, state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """One step.

        Args:
            u: Inputs in their units, shape ``(batch, n_inputs)``.
            state: Shape ``(batch, n_state)``.

        Returns:
            Outputs in their units, shape ``(batch, n_outputs)``, the next state, and the flags, shape ``(batch, 1)``.
        """
        # What is infinite is read as not a number; nothing is added to all others, nor to their derivatives.
        known = u + 0.0 * u
        states: list[Tensor] = []
        held: list[Tensor] = []
        limited: list[Tensor] = []
        doubted = torch.zeros_like(u[:, :1], dtype=torch.bool)
        for i, stage in enumerate(self.stages):
            y, following, at_bound, at_limit = stage(known, state)
            known = torch.cat([known, y], dim=1)
            states.append(following)
            held.append(at_bound)
            if self.doubtful[i]:
                doubted = doubted | at_limit
                at_limit = torch.zeros_like(at_limit)
            limited.append(at_limit)
        outside = ((u < self.declared_low) | (u > self.declared_high)).any(dim=1, keepdim=True)
        flags = outside.to(torch.int32) * self.outside_bit
        flags = flags + torch.cat(held, dim=1).any(dim=1, keepdim=True).to(torch.int32) * self.bound_bit
        flags = flags + torch.isnan(known).any(dim=1, keepdim=True).to(torch.int32) * self.lost_bit
        flags = flags + torch.cat(limited, dim=1).any(dim=1, keepdim=True).to(torch.int32) * self.limit_bit
        flags = flags + doubted.to(torch.int32) * self.doubt_bit
        n_inputs = u.size(1)
        following = torch.cat(states, dim=1)
        if self.circular:
            late = (known.index_select(1, self.late_columns) - self.late_offset) / self.late_scale
            following = following.index_copy(1, self.late_places, late)
        y = known.index_select(1, self.columns) if self.selects else known[:, n_inputs:]
        return y, following, flags


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
