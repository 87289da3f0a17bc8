"""Which inputs say anything: one that never changes, or is made of others, leaves its own transfer function open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.linear.poles import sections_of
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.records.informative import informative
from sysid.estimation.results.result import FitResult
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import Domain, Mapping, Scaling, TransferFunction, TransferFunctionModel
from sysid.models.linear.polynomial import PolynomialModel
from sysid.models.linear.polynomial_orders import AbstractPolynomial
from sysid.models.linear.state_space_polynomials import state_space_names
from sysid.models.orders.structure import AbstractStructure

S = TypeVar("S", bound=AbstractStructure)


@dataclass(frozen=True, kw_only=True, eq=False)
class Determined:
    """The inputs that data determine a response to.

    Args:
        kept: Their places among all inputs; one at least.
        moves: Whether that one says anything.
    """

    kept: tuple[int, ...]
    moves: bool = True

    @classmethod
    def of(cls, experiments: Sequence[Experiment]) -> Determined:
        """Look at some records.

        Args:
            experiments: The records; masked samples say nothing.

        Returns:
            What they determine.
        """
        seen = [e.inputs if e.usable is None else e.inputs[e.usable] for e in experiments]
        whole = np.concatenate(seen) if sum(map(len, seen)) else np.concatenate([e.inputs for e in experiments])
        found = informative(whole)
        return cls(kept=found or (0,) * (whole.shape[1] > 0), moves=bool(found) or not whole.shape[1])

    def narrowed(self, orders: S) -> S:
        """The structure of the inputs that are kept.

        Args:
            orders: Of all inputs.

        Returns:
            Their structure.
        """
        each = {name: getattr(orders, name) for name in orders.per_input}
        own = {name: tuple(of[j] for j in self.kept) for name, of in each.items() if of and isinstance(of, tuple)}
        return cast("S", replace(cast("Any", orders), **own))

    def mapping(self, mapping: Mapping) -> Mapping:
        """From the inputs that are kept."""
        return replace(mapping, inputs=tuple(mapping.inputs[j] for j in self.kept))

    def only(self, experiment: Experiment) -> Experiment:
        """A record with the inputs that are kept.

        Args:
            experiment: With all inputs.

        Returns:
            The record.
        """
        own = list(self.kept)
        history = replace(experiment.history, inputs=experiment.history.inputs[:, own])
        return replace(experiment, inputs=experiment.inputs[:, own], history=history)

    def widened(
        self,
        model: TransferFunctionModel,
        orders: TransferFunction,
        mapping: Mapping,
        scaling: Scaling,
        units: tuple[str, ...],
    ) -> TransferFunctionModel:
        """The model over all inputs: the others have no effect.

        Args:
            model: Of the inputs that are kept.
            orders: Of all inputs.
            mapping: With all inputs.
            scaling: Of all inputs.
            units: Of all inputs.

        Returns:
            The model.
        """
        at = {j: place for place, j in enumerate(self.kept)}
        sections, taps, delays, offsets, scales = [], [], [], [], []
        for j, (poles, zeros) in enumerate(zip(orders.poles, orders.zeros, strict=True)):
            if j in at:
                sections.append(model.sections[at[j]])
                taps.append(model.taps[at[j]])
                delays.append(model.delays[at[j]])
                offsets.append(model.scaling.input_offset[at[j]])
                scales.append(model.scaling.input_scale[at[j]])
                continue
            rates = _places(poles)
            places = rates if orders.domain is Domain.DISCRETE else np.log(rates) / model.sample_time
            sections.append(sections_of(places.astype(np.complex128), orders.domain))
            taps.append(np.zeros(zeros + 1))
            delays.append(0 if orders.delays is None else orders.delays[j])
            offsets.append(scaling.input_offset[j])
            scales.append(scaling.input_scale[j])
        return replace(
            model,
            orders=replace(orders, delays=tuple(delays)),
            sections=tuple(sections),
            taps=tuple(taps),
            scaling=replace(model.scaling, input_offset=tuple(offsets), input_scale=tuple(scales)),
            mapping=mapping,
            input_units=units,
        )

    def polynomials(
        self, fit: FitResult, orders: AbstractPolynomial, mapping: Mapping, scaling: Scaling, units: tuple[str, ...]
    ) -> FitResult:
        """A fit of polynomials over all inputs: the others have no effect, and nothing is known of it.

        Args:
            fit: Of the inputs that are kept; where none moves, of the first.
            orders: Of all inputs.
            mapping: With all inputs.
            scaling: Of all inputs.
            units: Of all inputs.

        Returns:
            The fit.
        """
        model = cast("PolynomialModel", fit.model)
        known = dict(zip(model.orders.names(model.mapping.inputs), model.theta.tolist(), strict=True))
        known |= dict.fromkeys((name for name in known if not self.moves and name.startswith("B(")), 0.0)
        names = orders.names(mapping.inputs)
        for j, name in enumerate(mapping.inputs):
            if j not in self.kept and orders.denominators[j]:
                places = np.poly(_places(orders.denominators[j]))[1:]
                known |= {f"F({name}, {lag})": float(at) for lag, at in enumerate(places, start=1)}
        theta = np.array([known.get(name, 0.0) for name in names])
        wide = replace(model, orders=orders, theta=theta, scaling=scaling, mapping=mapping, input_units=units)
        return replace(fit, model=wide, uncertainty=self.known(fit.uncertainty, names, theta))

    def states(self, fit: FitResult, mapping: Mapping, scaling: Any, units: tuple[str, ...]) -> FitResult:
        """A fit of a state space over all inputs; see :meth:`polynomials`.

        Args:
            fit: Of the inputs that are kept; where none moves, of the first.
            mapping: With all inputs.
            scaling: Of all inputs.
            units: Of all inputs.

        Returns:
            The fit.
        """
        model = cast("Any", fit.model)
        own, at = model.orders, list(self.kept)
        B, D = (np.zeros((len(old), len(mapping.inputs))) for old in (model.system.B, model.system.D))
        if self.moves:
            B[:, at], D[:, at] = model.system.B, model.system.D
            offset = np.array(scaling.input_offset)
            offset[at] = model.scaling.input_offset  # those that an integrator adds up are counted from its level
            scaling = replace(scaling, input_offset=tuple(offset.tolist()))
        nk = np.full(len(mapping.inputs), own.shortest)
        nk[at] = own.nk or own.shortest
        orders = replace(own, nk=tuple(nk.tolist()) if own.nk else ())
        wide = replace(
            model, orders=orders, system=replace(model.system, B=B, D=D), mapping=mapping, scaling=scaling,
            input_units=units,
        )  # fmt: skip
        names = state_space_names(orders, mapping)
        nothing = np.zeros(len(names))
        return replace(fit, model=wide, uncertainty=self.known(fit.uncertainty, names, nothing))

    def known(
        self, uncertainty: Uncertainty | None, names: tuple[str, ...], others: NDArray[np.float64]
    ) -> Uncertainty | None:
        """What is known of all parameters where some are not determined.

        Args:
            uncertainty: Of those that are; where no input moves, of all.
            names: Of all, in their order.
            others: Values of those that are not determined, at their places.

        Returns:
            The uncertainty; the covariance of the others is not a number.
        """
        if uncertainty is None:
            return None
        there = [k for k, name in enumerate(uncertainty.names) if self.moves or not name.startswith("B(")]
        at = [names.index(uncertainty.names[k]) for k in there]
        values, covariance = others.copy(), np.full((len(names), len(names)), np.nan)
        values[at] = uncertainty.values[there]
        covariance[np.ix_(at, at)] = uncertainty.covariance[np.ix_(there, there)]
        return replace(uncertainty, names=names, values=values, covariance=covariance)


def _places(n: int) -> NDArray[np.float64]:
    """Poles that nothing is known of: quick ones, apart from each other."""
    return np.linspace(0.2, 0.5, n)
