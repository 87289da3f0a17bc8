"""Linear models in other forms: an object of python-control, and the system in continuous time."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np

from sysid.errors import ConfigError
from sysid.models.contract.base import AbstractModel
from sysid.models.contract.several_outputs import SeveralOutputs
from sysid.models.converting.continuous import ContinuousStateSpace, rates
from sysid.models.converting.realisation import Ratios, observer_row
from sysid.models.converting.to_control import Matrices, delayed, in_powers_of_z, state_space, transfer_function


class LinearForms(AbstractModel):
    """A linear model of one output, which is a ratio of polynomials from each input."""

    def to_control(self, *, continuous: bool = False, pade_order: int = 3) -> Any:
        """The model as an object of python-control, from deviations of the inputs to deviations of the output.

        Args:
            continuous: Give the system in continuous time (:meth:`continuous`), as a ``control.StateSpace``.
            pade_order: Order of the Padé approximation that stands for a dead time in continuous time.

        Returns:
            A ``control.TransferFunction`` of one row, one column an input, in the model's own time;
            :func:`sysid.models.converting.to_control.state_space` is the state space that is run.

        Raises:
            ConfigError: If the model has no input, or no continuous form where that is asked for.
        """
        _check_inputs(self)
        if continuous:
            return self.continuous().to_control(pade_order=pade_order)
        pairs, discrete = [], True
        for _, ratio in sorted(self.ratios.items()):
            discrete = ratio.discrete
            B = ratio.B if len(ratio.B) else np.zeros(1)
            if discrete:
                pairs.append(in_powers_of_z(np.concatenate([np.zeros(int(ratio.delay)), B]), ratio.F))
            else:
                pairs.append(delayed((B[::-1], ratio.F[::-1]), ratio.delay * self.sample_time, pade_order))
        return transfer_function(pairs, self.mapping, self.sample_time if discrete else 0.0)

    def continuous(self) -> ContinuousStateSpace:
        """The continuous system whose samples the model gives when its inputs are held, as ``d2c`` by zoh.

        Returns:
            The system in the channels' units, its dead times beside it in seconds. Of many poles its coefficients carry
            fewer digits than the model.

        Raises:
            ConfigError: If the model has no input; if a pole is zero or negative; if an input has more coefficients
                than the system has poles, so that it acts as no continuous system of this order does.
        """
        _check_inputs(self)
        T, m = self.sample_time, len(self.mapping.inputs)
        parts: dict[str, Ratios] = {}
        delays = [0.0] * m
        for (_, j), ratio in self.ratios.items():
            delay = int(ratio.delay)
            late = max(delay - 1, 0)  # what is sampled and held comes one sample late by itself
            delays[j] = late * T
            B = np.concatenate([np.zeros(delay - late), ratio.B])
            if len(B) > len(ratio.F):
                raise ConfigError(
                    "no continuous system of this order gives the discrete one",
                    where=f"the input {self.mapping.inputs[j]}",
                    expected=f"at most {len(ratio.F) - delay + late} coefficients behind its dead time, since "
                    f"there are {len(ratio.F) - 1} poles",
                    got=len(ratio.B),
                    remedy="fit it with fewer coefficients (nb, zeros), or a transfer function with domain: continuous",
                )
            parts.setdefault(ratio.of_denominator, (ratio.F, {}))[1][j] = B
        A, B, C, D = observer_row(parts.values(), m)
        remedy = "fit fewer poles, or a transfer function with domain: continuous: such a pole mostly describes noise"
        A, B = rates(A, B, T, remedy=remedy)
        return ContinuousStateSpace(A=A, B=B, C=C, D=D, delays=tuple(delays), mapping=self.mapping)


class VectorLinearForms(SeveralOutputs):
    """A linear model of several outputs, which is a state space."""

    @property
    @abstractmethod
    def matrices(self) -> Matrices:
        """``A``, ``B``, ``C`` and ``D`` of the recursion that is run, in the channels' units."""

    @abstractmethod
    def continuous(self) -> ContinuousStateSpace:
        """The continuous system whose samples the model gives when its inputs are held, as ``d2c`` by zoh."""

    def to_control(self, *, continuous: bool = False, pade_order: int = 3) -> Any:
        """The model as a ``control.StateSpace`` in the channels' units, from deviations to deviations.

        Args:
            continuous: Give the continuous form, not the discrete one.
            pade_order: Order of the Padé approximation that stands for its dead times.

        Returns:
            The state space.

        Raises:
            ConfigError: If there is no continuous form.
        """
        return self.continuous().to_control(pade_order=pade_order) if continuous else state_space(self)


def _check_inputs(model: AbstractModel) -> None:
    if not model.mapping.inputs:
        raise ConfigError(
            "a time series is no system from inputs to outputs",
            where=str(model.mapping),
            expected="a model with inputs",
            got="none",
            remedy="take its poles and its predictions, or fit a mapping with an input",
        )
