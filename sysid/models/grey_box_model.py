"""A fitted grey box: equations, the parameters that were found, and what the records said of its states."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from sysid.equations import RUNGE_KUTTA, Lowered
from sysid.models.base import AbstractModel, SeveralOutputs
from sysid.models.equation_form import EquationForm, StateTerms
from sysid.models.grey_box import GreyBox, VectorGreyBox, lowered
from sysid.models.history import History
from sysid.models.mapping import Mapping
from sysid.models.scaling import Scaling, VectorScaling

Array = NDArray[np.float64]


_ModelT = TypeVar("_ModelT", bound="EquationModel")


@dataclass(frozen=True, kw_only=True, eq=False)
class EquationModel(AbstractModel):
    """What fitted grey boxes of one output and of several have in common; both have the fields below."""

    grey: GreyBox
    theta: Array
    norms: tuple[float, ...]
    levels: tuple[float, ...]
    spans: tuple[float, ...]
    substeps: int
    scaling: Scaling | VectorScaling
    mapping: Mapping
    sample_time: float
    input_units: tuple[str, ...]
    solver: str = RUNGE_KUTTA

    clamp = np.inf
    """Bound of the output: none."""

    def __post_init__(self) -> None:
        theta = np.array(self.theta, dtype=np.float64)
        theta.setflags(write=False)
        object.__setattr__(self, "theta", theta)
        for name in ("norms", "levels", "spans", "input_units"):
            object.__setattr__(self, name, tuple(getattr(self, name)))

    @property
    def structure(self) -> GreyBox:
        """The equations."""
        return self.grey

    @property
    def n_parameters(self) -> int:
        """Parameters that were estimated, weights included."""
        return len(self.theta)

    @property
    def parameters(self) -> dict[str, float]:
        """Every parameter with a name, in its unit; those that were fixed too."""
        found = dict(zip((one.name for one in self.grey.free), map(float, self.theta), strict=False))
        return {one.name: found.get(one.name, one.start) for one in self.grey.named}

    @cached_property
    def lowered(self) -> Lowered:
        """The programs."""
        return lowered(self.grey, self.mapping.inputs, self.mapping.outputs, self.sample_time, self.solver)

    @cached_property
    def recursion(self) -> EquationForm:
        """The form that is run."""
        low = self.lowered
        fixed = [one.start for one in self.grey.fixed]
        return EquationForm(
            lowered=low,
            theta=np.concatenate([self.theta, fixed, self.norms]),
            scaling=self.scaling,
            terms=self.state_terms,
            substeps=self.substeps,
            sample_time=self.sample_time,
            widths=np.zeros(len(low.switches)),
            several=self.structure.several_outputs,
        )

    @property
    def state_terms(self) -> StateTerms:
        """What is known of the states."""
        begins, names = self.grey.begins, self.lowered.states
        given = [begins.get(name) for name in names]
        return StateTerms(
            level=np.array(
                [level if one is None else one.start for one, level in zip(given, self.levels, strict=True)]
            ),
            scale=np.array(self.spans, dtype=np.float64),
            low=np.array([-np.inf if one is None else one.low for one in given], dtype=np.float64),
            high=np.array([np.inf if one is None else one.high for one in given], dtype=np.float64),
            declared=np.array([one is not None for one in given], dtype=np.bool_),
            fixed=np.array([one is not None and one.fixed for one in given], dtype=np.bool_),
        )

    def with_theta(self: _ModelT, theta: Array) -> _ModelT:
        """The same model with other parameters."""
        return replace(self, theta=theta)

    def output_moves(
        self,
        factor: Array,
        inputs: Array,
        history: History,
        measured: Array | None = None,  # noqa: ARG002 - one step ahead nothing is predicted
    ) -> Array:
        """How the free run moves with the parameters; see the base class.

        A state that is estimated from several samples stays where it is; one at rest moves with the parameters.
        """
        form, p = self.recursion, len(self.theta)
        if len(history.output) > 1:
            x, S = form.state(history), np.zeros((len(self.levels), p))
        else:
            past = form.given(history.inputs, history.inputs)[0]
            x, S = form.resting_moves(past, history.output.reshape(1, -1)[0], p)
        _, J = form.moved(form.given(inputs, history.inputs), x, S, p)
        return np.asarray((J if self.structure.several_outputs else J[:, 0]) @ factor)

    def _fields(self) -> dict[str, Any]:
        """What is stored of either kind."""
        return {
            "structure": self.grey.to_dict(),
            "mapping": str(self.mapping),
            "sample_time": self.sample_time,
            "input_units": list(self.input_units),
            "substeps": self.substeps,
            "solver": self.solver,
            "norms": list(self.norms),
            "levels": list(self.levels),
            "spans": list(self.spans),
            "scaling": self.scaling.to_dict(),
            "theta": self.theta.tolist(),
        }

    @staticmethod
    def _read(fields: Dict[str, Any]) -> dict[str, Any]:
        """The arguments that are the same for either kind."""
        given = ("sample_time", "substeps", "norms", "levels", "spans", "input_units")
        found = {name: fields[name] for name in given}
        theta = np.array(fields["theta"], dtype=np.float64)
        found["solver"] = fields.get("solver", RUNGE_KUTTA)  # the only one, once
        return found | {"theta": theta, "mapping": Mapping.parse(fields["mapping"])}


@dataclass(frozen=True, kw_only=True, eq=False)
class GreyBoxModel(EquationModel):
    """A fitted grey box of one output.

    Args:
        grey: The equations.
        theta: Parameters that were estimated, then the weights of networks, in their units.
        norms: Levels and scales of what networks see.
        levels: An ordinary value of each state, in its unit.
        spans: How far each ordinarily goes from there.
        substeps: Steps of the solver from sample to sample.
        solver: ``runge-kutta``, or ``rosenbrock``.
        scaling: Of the output; the equations themselves are in units.
        mapping: Which channels go in, which comes out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_unit: Unit of the output.
        rest_output: Output at rest, in its unit.
    """

    scaling: Scaling
    output_unit: str
    rest_output: float

    def to_dict(self) -> dict[str, Any]:
        """Everything needed to build the model again."""
        return self._fields() | {"output_unit": self.output_unit, "rest_output": self.rest_output}

    @classmethod
    def from_dict(cls, fields: Dict[str, Any]) -> GreyBoxModel:
        """The model that :meth:`to_dict` wrote."""
        structure = {key: value for key, value in fields["structure"].items() if key != "kind"}
        return cls(
            grey=GreyBox(**structure),
            scaling=Scaling.from_dict(fields["scaling"]),
            output_unit=fields["output_unit"],
            rest_output=fields["rest_output"],
            **cls._read(fields),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class VectorGreyBoxModel(EquationModel, SeveralOutputs):
    """A fitted grey box of several outputs; its other fields are those of :class:`GreyBoxModel`.

    Args:
        output_units: Unit of each output.
        rest_outputs: Each output at rest, in its unit.
    """

    scaling: VectorScaling
    output_units: tuple[str, ...]
    rest_outputs: tuple[float, ...]

    def to_dict(self) -> dict[str, Any]:
        """Everything needed to build the model again."""
        return self._fields() | {"output_units": list(self.output_units), "rest_outputs": list(self.rest_outputs)}

    @classmethod
    def from_dict(cls, fields: Dict[str, Any]) -> VectorGreyBoxModel:
        """The model that :meth:`to_dict` wrote."""
        structure = {key: value for key, value in fields["structure"].items() if key != "kind"}
        return cls(
            grey=VectorGreyBox(**structure),
            scaling=VectorScaling.from_dict(fields["scaling"]),
            output_units=tuple(fields["output_units"]),
            rest_outputs=tuple(fields["rest_outputs"]),
            **cls._read(fields),
        )
