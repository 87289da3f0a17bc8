"""A model over lagged regressors as exporters see it: one table of columns, inputs before outputs, one or several."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.export.forms.programs import ProgramForm
from sysid.export.forms.state_space import StateSpaceForm
from sysid.kernels.neurons import NEURONS, Neuron
from sysid.models import NeuralEnsemble, NeuralForm, StateSpace
from sysid.models.cascades.wiring import Member
from sysid.models.channels.ends import Ends
from sysid.models.contract.column_recursion import ColumnRecursion
from sysid.models.grey_box.equation_form import EquationForm


@dataclass(frozen=True, kw_only=True, eq=False)
class LaggedForm:
    r"""``y = clip(w x + c + V s(W x + b))`` in scaled numbers, with the regressors of each column side by side.

    With gates each neuron of a single output multiplies a linear function: ``(v + G x) . s(W x + b)`` in place of
    ``V s(W x + b)``.

    Args:
        ends: Names, units and values at rest of what goes in and comes out.
        lags: Lags of every input, then of every output.
        hidden_weights: ``W``, shape ``(n_neurons, n_regressors)``.
        hidden_bias: ``b``, shape ``(n_neurons,)``.
        readout: ``V``, shape ``(n_outputs, n_neurons)``.
        constant: ``c``, shape ``(n_outputs,)``.
        linear: ``w``, shape ``(n_outputs, n_regressors)``; zeros where the model has no linear part.
        gates: ``G``, shape ``(n_neurons, n_regressors)``; without rows where the neurons have no gates.
        offset: Of every column, in its unit.
        scale: Of every column, in its unit.
        low: Lower bound of the outputs in scaled numbers; ``-inf`` for none.
        high: Upper bound of the outputs in scaled numbers; ``inf`` for none.
        neuron: ``s``.
    """

    ends: Ends
    lags: tuple[tuple[int, ...], ...]
    hidden_weights: NDArray[np.float64]
    hidden_bias: NDArray[np.float64]
    readout: NDArray[np.float64]
    constant: NDArray[np.float64]
    linear: NDArray[np.float64]
    gates: NDArray[np.float64]
    offset: tuple[float, ...]
    scale: tuple[float, ...]
    low: float
    high: float
    neuron: Neuron

    @classmethod
    def of(cls, model: Member) -> LaggedForm:
        """A model, lowered.

        Args:
            model: A model of one output or several.

        Returns:
            The lowered form.

        Raises:
            ConfigError: If the model does not lower to lagged regressors.
        """
        columns = ColumnRecursion.of(model)
        if columns is None:
            raise ConfigError(
                "this kind of model cannot be exported",
                expected="a model over lagged inputs and outputs (ARX, NARX), a state space, or equations",
                got=model.structure.label,
                remedy="write export: null in the pipeline, or fit one of these to what it puts out, and export that",
            )
        ends = Ends.of(model)
        m, k, n = len(ends.outputs), columns.neurons, columns.lags.n_regressors
        cuts = np.cumsum([k * n, k, m * k, m, m * n if columns.linear else 0])
        hidden, bias, readout, constant, linear, gates = np.split(columns.theta, cuts)
        return cls(
            ends=ends,
            lags=columns.lags.inputs,
            hidden_weights=hidden.reshape(k, n),
            hidden_bias=bias,
            readout=readout.reshape(m, k),
            constant=constant,
            linear=linear.reshape(m, n) if columns.linear else np.zeros((m, n)),
            gates=gates.reshape(k if columns.gated else 0, n),
            offset=columns.offset,
            scale=columns.scale,
            low=columns.low,
            high=columns.high,
            neuron=NEURONS[columns.activation],
        )

    @property
    def n_inputs(self) -> int:
        """Number of inputs."""
        return len(self.ends.inputs)

    @property
    def n_outputs(self) -> int:
        """Number of outputs."""
        return len(self.ends.outputs)

    @property
    def neurons(self) -> int:
        """Number of neurons."""
        return len(self.hidden_bias)

    @property
    def gated(self) -> bool:
        """Whether the neurons have gates."""
        return len(self.gates) > 0

    @property
    def adds(self) -> bool:
        """Whether a step can be written as what is added to the last output: where every output reads its last one."""
        return all(1 in own for own in self.lags[self.n_inputs :])


def lowered_form(model: Member, *, spare: bool = False) -> LaggedForm | StateSpaceForm | ProgramForm:
    """A model, lowered to whichever kind it is.

    Args:
        model: The model.
        spare: Whether equations without states have a number all the same.

    Returns:
        The lowered form.

    Raises:
        ConfigError: If it lowers to no kind, or has parameters that differ by case: a file has one value, or an input.
    """
    form = model.recursion
    if form.constants:
        raise ConfigError(
            f"{', '.join(form.constants)} differ by case, and a file runs one",
            where=model.structure.label,
            expected="the model of one case, or one that takes them as inputs",
            got="a model of several cases",
            remedy='export its fit, or model.with_case_inputs(), or model.for_case("run1")',
        )
    if isinstance(form, EquationForm):
        return ProgramForm(ends=model.ends, lowered=form, spare=spare and not form.lowered.states)
    lowered = HIDDEN.get(type(form))
    return LaggedForm.of(model) if lowered is None else lowered(form, model.ends)


HIDDEN: dict[type, Callable[..., StateSpaceForm]] = {
    StateSpace: StateSpaceForm.linear,
    NeuralForm: StateSpaceForm.neural,
    NeuralEnsemble: StateSpaceForm.ensemble,
}
"""Forms that are state spaces, and what they become; those that are no equations either are lagged."""
