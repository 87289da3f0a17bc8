"""A fitted grey box: equations, the parameters that were found, and what the records said of its states."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from sysid.equations import RUNGE_KUTTA, Lowered
from sysid.equations.written import renamed
from sysid.errors import ConfigError, did_you_mean
from sysid.models.channels.history import History
from sysid.models.channels.mapping import Mapping
from sysid.models.channels.scaling import Scaling, VectorScaling, scaling_from_dict
from sysid.models.contract.base import AbstractModel
from sysid.models.contract.flat import as_many
from sysid.models.contract.several_outputs import SeveralOutputs
from sysid.models.grey_box.case_values import CaseValues
from sysid.models.grey_box.equation_form import EquationForm
from sysid.models.grey_box.equation_programs import StateTerms
from sysid.models.grey_box.grey_box import GreyBox, lowered

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
    cases: tuple[str, ...] = ()

    structure_field = "grey"
    clamp = np.inf
    """Bound of the output: none."""

    def __post_init__(self) -> None:
        theta = np.array(self.theta, dtype=np.float64)
        theta.setflags(write=False)
        object.__setattr__(self, "theta", theta)
        for name in ("norms", "levels", "spans", "input_units", "cases"):
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
        """Every parameter with a name that all cases share, in its unit; those that were fixed too."""
        found = dict(zip((one.name for one in self.grey.free), map(float, self.theta), strict=False))
        return {one.name: found.get(one.name, one.start) for one in self.grey.named if not one.per}

    @cached_property
    def case_values(self) -> CaseValues | None:
        """Parameters that differ by case, and their values; ``None`` where none does."""
        by_case = self.grey.by_case
        if not self.cases:
            return None
        places = np.array([self.grey.free.index(one) for one in by_case], dtype=np.int64)
        p = self.n_of_form
        values = np.vstack([self.theta[places], self.theta[p:].reshape(-1, len(by_case))])
        differ = np.maximum(values.std(axis=0), np.abs(values.mean(axis=0)))
        return CaseValues(
            names=tuple(one.name for one in by_case),
            places=places,
            low=np.array([one.low for one in by_case]),
            high=np.array([one.high for one in by_case]),
            scale=np.array([
                one.prior or float(d) or one.scale for one, d in zip(by_case, differ, strict=True)
            ]),
            cases=self.cases,
            values=values,
            grouped=self.grey.grouped,
        )  # fmt: skip

    @property
    def n_of_form(self) -> int:
        """Parameters and weights of the equations, each once; behind them stand those of further cases."""
        return len(self.theta) - max(len(self.cases) - 1, 0) * len(self.grey.by_case)

    @property
    def by_case(self) -> dict[str, dict[str, float]]:
        """Of each parameter that differs by case, its value in every case that was fitted, in its unit."""
        found = self.case_values
        if found is None:
            return {}
        columns = zip(found.names, found.values.T.tolist(), strict=True)
        return {name: dict(zip(found.cases, column, strict=True)) for name, column in columns}

    def for_case(self: _ModelT, name: str) -> _ModelT:
        """The plain model of one case, in which its values are parameters like all others.

        Args:
            name: Of the case, or of a record of it.

        Returns:
            The model.

        Raises:
            ConfigError: If there are no parameters by case, or that one was not fitted.
        """
        found = self.case_values
        row = None if found is None else found.row(name)
        if found is None or row is None:
            raise ConfigError(
                f"there is no case {name}" if found else "no parameter differs by case", where="for_case",
                expected=f"one of {', '.join(self.cases)}" if found else "a parameter with per: case", got=name,
                remedy=did_you_mean(name, self.cases, "name one of these" if found else "use the model as it is"),
            )  # fmt: skip
        theta = self.theta[: self.n_of_form].copy()
        theta[found.places] = found.values[row]
        named = tuple(replace(one, per=None) for one in self.grey.named)
        return replace(self, grey=replace(self.grey, parameters=named, cases=()), theta=theta, cases=())

    def with_case_inputs(self: _ModelT) -> _ModelT:
        """The plain model of all cases: what differs by case goes in, as inputs behind the others.

        Returns:
            The model; itself where nothing differs.
        """
        found, by_case = self.case_values, self.grey.by_case
        if found is None:
            return self
        named = tuple(one for one in self.grey.named if not one.per)
        more = len(by_case)
        return replace(
            self,
            grey=replace(self.grey, parameters=named, cases=()),
            theta=np.delete(self.theta[: self.n_of_form], found.places),
            cases=(),
            mapping=Mapping(inputs=(*self.mapping.inputs, *found.names), outputs=self.mapping.outputs),
            input_units=(*self.input_units, *(one.unit or "1" for one in by_case)),
            scaling=replace(
                self.scaling,
                input_offset=(*self.scaling.input_offset, *[0.0] * more),
                input_scale=(*self.scaling.input_scale, *[1.0] * more),
            ),
        )

    @property
    def variants(self) -> tuple[AbstractModel, ...]:
        """Itself, or the plain model of each case where parameters differ."""
        return tuple(self.for_case(case) for case in self.cases) or (self,)

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
            theta=np.concatenate([self.theta[: self.n_of_form], fixed, self.norms]),
            scaling=self.scaling,
            terms=self.state_terms,
            substeps=self.substeps,
            sample_time=self.sample_time,
            widths=np.zeros(len(low.switches)),
            several=self.structure.several_outputs,
            cases=self.case_values,
        )

    @property
    def state_terms(self) -> StateTerms:
        """What is known of the states."""
        begins = self.grey.begins
        # Past samples of what is computed begin where it is said to have stood; those of a state are at equilibrium.
        stood = {name: one for name, one in begins.items() if name not in self.grey.system.states}
        given = [begins.get(name) or stood.get(name.rpartition("[k-")[0]) for name in self.lowered.states]
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

    def over(self, mapping: Mapping) -> Self:
        """The same model over other channels: its equations have their names; see the base class."""
        ours, theirs = ((*one.inputs, *one.outputs) for one in (self.mapping, mapping))
        if ours == theirs:
            return self
        names = dict(zip(ours, theirs, strict=True))
        begins = tuple(replace(one, name=names.get(one.name, one.name)) for one in self.grey.begins.values())
        equations = renamed(self.grey.system.equations, names)
        return replace(self, mapping=mapping, grey=replace(self.grey, equations=equations, initial=begins))

    def with_theta(self: _ModelT, theta: Array) -> _ModelT:
        """The same model with other parameters."""
        return replace(self, theta=as_many(theta, len(self.theta)))

    def output_moves(
        self,
        factor: Array,
        inputs: Array,
        history: History,
        measured: Array | None = None,  # noqa: ARG002 - one step ahead nothing is predicted
    ) -> Array:
        """How the free run moves with the parameters; see the base class.

        A state that is estimated from several samples stays where it is, and so does a parameter by case; a state at
        rest moves with the parameters.
        """
        form, p = self.recursion.of_case(history), self.n_of_form
        if self.case_values is not None:
            places = self.case_values.columns(history.case, p)
            factor = np.where(places[:, None] >= 0, factor[places], 0.0)
        if len(history.output) > 1:
            x, S = form.state(history), np.zeros((len(self.levels), p))
        else:
            past = form.given(history.inputs, history.inputs)[0]
            x, S = form.resting_moves(past, history.output.reshape(1, -1)[0], p)
        _, J = form.moved(form.given(inputs, history.inputs), x, S, p)
        return np.asarray((J if self.structure.several_outputs else J[:, 0]) @ factor)

    def _written(self) -> dict[str, Any]:
        return {
            "substeps": self.substeps,
            "solver": self.solver,
            "norms": list(self.norms),
            "levels": list(self.levels),
            "spans": list(self.spans),
            "scaling": self.scaling.to_dict(),
            "theta": self.theta.tolist(),
        } | ({"cases": list(self.cases)} if self.cases else {})

    @staticmethod
    def _read(fields: Dict[str, Any]) -> dict[str, Any]:
        return {name: fields[name] for name in ("substeps", "norms", "levels", "spans")} | {
            "theta": np.array(fields["theta"], dtype=np.float64),
            "scaling": scaling_from_dict(fields["scaling"]),
            "solver": fields.get("solver", RUNGE_KUTTA),  # the only one, once
            "cases": tuple(fields.get("cases", ())),
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class GreyBoxModel(EquationModel):
    """A fitted grey box of one output.

    Args:
        grey: The equations.
        theta: Parameters that were estimated, then the weights of networks, in their units. Of parameters by case the
            first case's stand among them, those of the further cases behind the weights, case by case.
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
        cases: Names of the cases, where parameters differ by case.
    """

    scaling: Scaling
    output_unit: str
    rest_output: float


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
