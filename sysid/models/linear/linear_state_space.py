"""Linear state spaces in innovations form: hidden states, and a model of the noise."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from dataclasses import fields as dataclass_fields
from functools import cached_property
from typing import Annotated, Any, Final, Literal, Self

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.errors import ConfigError, shortened
from sysid.models.channels.mapping import Mapping
from sysid.models.channels.scaling import Scaling, VectorScaling, scaling_from_dict
from sysid.models.contract.flat import as_many
from sysid.models.contract.ratio import Ratio
from sysid.models.converting.continuous import ContinuousStateSpace, rates
from sysid.models.converting.to_control import Matrices
from sysid.models.linear.innovation_moves import InnovationModel
from sysid.models.linear.innovations import Innovations
from sysid.models.linear.linear_forms import LinearForms, VectorLinearForms
from sysid.models.linear.state_space import Filter, StateSpace
from sysid.models.linear.state_space_polynomials import polynomials
from sysid.models.orders.lags import MOST, whole
from sysid.models.orders.ranges import IntRange
from sysid.models.orders.structure import AbstractStructure

MOST_STATES = 100
"""A subspace method compresses matrices of some times as many columns."""
AUTO: Final = "auto"
"""Dead times that are searched."""


@dataclass(frozen=True, kw_only=True)
class LinearStateSpace(AbstractStructure):
    """States of ``x(t+1) = A x + B u + K e``, ``y = C x + D u + c + e``, as of MATLAB's ``ssest`` and ``n4sid``.

    Args:
        states: Number of states.
        feedthrough: Whether the output depends on inputs of the same sample (``D``). One that is sampled from a plant
            does not; a dead time of one sample is in the structure.
        noise: Whether the noise is modelled (``K``): one step ahead is then a Kalman filter's prediction. Without it
            noise is added to the output, and the free run is what is fitted.
        intercept: Fit a constant output.
        nk: Dead time of each input in samples: the first lag at which it acts, as of ARX, not among the states. Without
            any it is the shortest that there is, 1, or 0 with ``feedthrough``; ``"auto"`` searches for it.

    Raises:
        ConfigError: If the number of states or a dead time cannot be used.

    Example:
        >>> LinearStateSpace(states=4).label, LinearStateSpace(states=2, nk=(5,)).label
        ('SS 4', 'SS 2 nk 5')
    """

    states: Annotated[int, IntRange(low=1, high=10)]
    feedthrough: bool = False
    noise: bool = True
    intercept: bool = True
    nk: tuple[int, ...] | Literal["auto"] = ()

    kind = "SS"
    per_input = ("nk",)

    def __post_init__(self) -> None:
        if not whole(self.states) or not 1 <= self.states <= MOST_STATES:
            raise ConfigError(
                "not a number of states",
                where="states",
                expected=f"a whole number from 1 to {MOST_STATES}",
                got=shortened(self.states),
                remedy=f"write for example {{kind: {self.kind}, states: 4}}",
            )
        if self.nk == AUTO:
            return
        self._listed(*self.per_input)
        if not all(whole(k) and self.shortest <= k <= MOST for k in self.nk):
            direct = " (0 with feedthrough: true)" * (not self.feedthrough)
            raise ConfigError(
                "not the dead times of a state space",
                where="nk",
                expected=f"for each input a whole number of samples from {self.shortest}{direct} to {MOST:,}, or "
                f"{AUTO} to search for them",
                got=shortened(self.nk),
                remedy=f"write for example {{kind: {self.kind}, states: 4, nk: [3]}}, or nk: {AUTO}",
            )

    @property
    def label(self) -> str:
        """The states, and what is not the default."""
        words = ["direct"] * self.feedthrough + ["without noise model"] * (not self.noise)
        dead = ["nk", *("?" if self.nk == AUTO else map(str, self.nk))] if self.nk else []
        return " ".join([self.kind, str(self.states), *words, *dead])

    @property
    def shortest(self) -> int:
        """The dead time in samples of states that nothing stands before."""
        return 0 if self.feedthrough else 1

    def shifts(self, n_inputs: int) -> tuple[int, ...]:
        """By how many samples each input comes later than states without a dead time have it.

        Args:
            n_inputs: Inputs.

        Returns:
            One number for each input; zeros where the dead times are yet to be found.
        """
        if self.nk == AUTO or not self.nk:
            return (0,) * n_inputs
        return tuple(int(k) - self.shortest for k in self.nk)

    def check_inputs(self, n_inputs: int) -> None:
        """Refuse dead times that are not one for each input; see the base class."""
        if self.nk and self.nk != AUTO:
            super().check_inputs(n_inputs)

    def for_outputs(self, n_outputs: int) -> LinearStateSpace:
        """One state space for all outputs, where there are several: what each says of the states is used for all."""
        if n_outputs == 1 or self.several_outputs:
            return self
        return VectorStateSpace(**{field.name: getattr(self, field.name) for field in dataclass_fields(self)})

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        fields = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return {"kind": self.kind, **fields, "nk": self.nk if self.nk == AUTO else list(self.nk)}

    def n_parameters(self, n_inputs: int, n_outputs: int = 1) -> int:
        """Parameters that tell systems apart: entries of all matrices less those of a change of coordinates.

        Args:
            n_inputs: Inputs.
            n_outputs: Outputs.

        Returns:
            The number.

        Example:
            >>> LinearStateSpace(states=4).n_parameters(1)
            13
        """
        gain = self.states * n_outputs * self.noise
        direct = n_inputs * n_outputs * self.feedthrough
        return self.states * (n_inputs + n_outputs) + gain + direct + n_outputs * self.intercept


@dataclass(frozen=True, kw_only=True, eq=False)
class _StateSpaceModel(InnovationModel):
    """What a fitted state space is, of one output or of several."""

    orders: LinearStateSpace
    system: Innovations
    scaling: Scaling | VectorScaling
    mapping: Mapping
    sample_time: float
    input_units: tuple[str, ...]

    structure_field = "orders"

    @property
    def structure(self) -> LinearStateSpace:
        """The number of states."""
        return self.orders

    @property
    def n_parameters(self) -> int:
        """Parameters that tell systems apart, whatever the coordinates of the state."""
        return self.orders.n_parameters(len(self.mapping.inputs), len(self.mapping.outputs))

    @cached_property
    def recursion(self) -> StateSpace:
        """The form that is run."""
        form = StateSpace.of(self.lowered, self.scaling, noise=self.orders.noise)
        if self._steady is None:
            return form
        late = self.orders.shifts(len(self.mapping.inputs))
        T, back = (scipy.linalg.block_diag(part, np.eye(sum(late))) for part in self._steady)
        return replace(form, filter=Filter(system=self.system.behind(late), towards=T, back=back))

    @cached_property
    def lowered(self) -> Innovations:
        """The system with the dead times among its states, as it is run freely."""
        return self._run_freely.behind(self.orders.shifts(len(self.mapping.inputs)))

    @cached_property
    def _steady(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Coordinates for free runs, where those of the fit lose digits there, and back."""
        return self.system.steady() if self.orders.noise else None

    @property
    def _run_freely(self) -> Innovations:
        return self.system if self._steady is None else self.system.in_coordinates(*self._steady)

    @property
    def vector(self) -> NDArray[np.float64]:
        """Every entry of its matrices, in scaled numbers, as :attr:`Innovations.entries`."""
        return self.system.entries

    def with_theta(self, theta: NDArray[np.float64]) -> Self:
        """The same model with other numbers, in the order of :attr:`vector`."""
        return replace(self, system=self.system.at(as_many(theta, len(self.system.entries))))

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Poles in the z plane, shape ``(states,)``."""
        return self.system.poles()

    @property
    def pole_radius(self) -> float:
        """Magnitude of the largest pole."""
        return self.system.radius

    def continuous(self) -> ContinuousStateSpace:
        """The continuous system whose samples it is, inputs held between them, as ``d2c`` by zoh.

        Returns:
            The system in the channels' units, its dead times beside it.

        Raises:
            ConfigError: If a pole is zero or lies on the negative real axis.
        """
        system, late = self._run_freely, self.orders.shifts(len(self.mapping.inputs))
        remedy = (
            "fit fewer states, or a continuous transfer function (domain: continuous): such a pole mostly describes "
            "noise"
        )
        A, B = rates(system.A, system.B / np.array(self.scaling.input_scale), self.sample_time, remedy=remedy)
        gain = np.atleast_1d(self.scaling.output_scale)[:, np.newaxis]
        return ContinuousStateSpace(
            A=A, B=B, C=gain * system.C, D=gain * system.D / np.array(self.scaling.input_scale),
            delays=tuple(k * self.sample_time for k in late), mapping=self.mapping,
        )  # fmt: skip

    @property
    def matrices(self) -> Matrices:
        """The state space in the channels' units."""
        gain, scale = np.atleast_1d(self.scaling.output_scale)[:, np.newaxis], np.array(self.scaling.input_scale)
        return self.lowered.A, self.lowered.B / scale, gain * self.lowered.C, gain * self.lowered.D / scale

    @property
    def kalman_gain(self) -> NDArray[np.float64]:
        """``K`` from innovations in the outputs' units, for the state of :attr:`matrices`."""
        return np.asarray(self.lowered.K / np.array(self.scaling.output_scale))

    def _written(self) -> dict[str, Any]:
        return {"scaling": self.scaling.to_dict(), "system": self.system.to_dict()}

    @staticmethod
    def _read(fields: Dict[str, Any]) -> dict[str, Any]:
        return {
            "scaling": scaling_from_dict(fields["scaling"]),
            "system": Innovations.from_dict(fields["system"]),
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearStateSpaceModel(_StateSpaceModel, LinearForms):
    """A fitted state space of one output.

    Args:
        orders: The structure.
        system: The matrices, in scaled numbers, of inputs that come their dead times late.
        scaling: Between units and scaled numbers.
        mapping: Which channels go in, which comes out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_unit: Unit of the output.
        rest_output: Output at rest, in its unit.
    """

    scaling: Scaling
    output_unit: str
    rest_output: float

    def ratio(self, j: int) -> Ratio:
        """From one input to the output, in ``1/z``; all inputs share the denominator."""
        F, numerators, _ = polynomials(self.system)
        gain = self.scaling.output_scale / self.scaling.input_scale[j]
        first = self.orders.shortest
        late = self.orders.shifts(len(self.mapping.inputs))[j]
        return Ratio(
            B=gain * numerators[0, j, first:], F=F, delay=first + late, discrete=True,
            of_numerator=f"B({self.mapping.inputs[j]}, ", of_denominator="F(",
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class VectorStateSpace(LinearStateSpace):
    """A linear state space that all outputs of a mapping share; see :class:`LinearStateSpace`.

    What one output says of the states is used for the others, in the fit and one step ahead.

    Example:
        >>> VectorStateSpace(states=6).label
        'VectorSS 6'
    """

    kind = "VectorSS"
    several_outputs = True


@dataclass(frozen=True, kw_only=True, eq=False)
class VectorStateSpaceModel(_StateSpaceModel, VectorLinearForms):
    """A fitted state space of several outputs.

    Args:
        orders: The structure.
        system: The matrices, in scaled numbers, of inputs that come their dead times late.
        scaling: Between units and scaled numbers.
        mapping: Which channels go in, which come out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_units: Unit of each output.
        rest_outputs: Each output at rest, in its unit.
    """

    orders: VectorStateSpace
    scaling: VectorScaling
    output_units: tuple[str, ...]
    rest_outputs: tuple[float, ...]

    @property
    def ratios(self) -> dict[tuple[int, int], Ratio]:
        """From each input to each output, in ``1/z``; all share the denominator."""
        F, numerators, _ = polynomials(self.system)
        first, late = self.orders.shortest, self.orders.shifts(len(self.mapping.inputs))
        gains = np.array(self.scaling.output_scale)[:, np.newaxis] / np.array(self.scaling.input_scale)
        return {
            (o, j): Ratio(
                B=gains[o, j] * numerators[o, j, first:], F=F, delay=first + late[j], discrete=True,
                of_numerator=f"B({output}, {name}, ", of_denominator="F(",
            )
            for o, output in enumerate(self.mapping.outputs)
            for j, name in enumerate(self.mapping.inputs)
        }  # fmt: skip
