"""What is trained together: the parameters of networks in their bases, and those of equations over their scales."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.estimation.least_squares.evidence import Group, Prior
from sysid.estimation.networks.basis import RegressorBasis
from sysid.estimation.networks.equation_layout import EquationLayout
from sysid.estimation.networks.initialise import Layout
from sysid.estimation.parameters.named import Named, check_alike, precision_of
from sysid.models import Ends, Member
from sysid.models.contract.column_recursion import ColumnRecursion
from sysid.models.grey_box.declared import Parameter

Array = NDArray[np.float64]
Places = NDArray[np.int64]

MAX_ROWS = 50_000
"""Samples that the basis is scaled to; more say nothing new about the range of a regressor."""


@dataclass(frozen=True, kw_only=True, eq=False)
class JointLayout:
    """The members that are trained together, one after the other.

    Args:
        members: Their layouts.
        places: Of each where its parameters stand among those that are trained: equations that share a parameter have
            it at one place.
        to_plain: From what is trained to plain parameters: sparse, a block for each member.
    """

    members: tuple[Layout | EquationLayout, ...]
    places: tuple[Places, ...]
    to_plain: scipy.sparse.csr_array

    @classmethod
    def of(
        cls, models: Sequence[Member], records: Sequence[dict[str, Array]], shared: Collection[str] = ()
    ) -> JointLayout:
        """The layout of some members.

        Args:
            models: The members that are trained, in the order of the parameters.
            records: What their bases are scaled to: channels by name, in their units, each of shape ``(n_samples,)``.
            shared: Parameters of equations that are one wherever they have this name.

        Returns:
            The layout.

        Raises:
            ConfigError: If one of them has other terms in another equation, or an equation cannot be trained.
        """
        layouts = list[Layout | EquationLayout]()
        places, blocks, known, count = list[Places](), list[Array](), dict[str, tuple[int, Parameter]](), 0
        for model in models:
            columns = ColumnRecursion.of(model)
            if columns is None:
                continue
            if columns.equation is None:
                network = Layout.of_member(model, columns)
                layouts.append(network)
                blocks.append(_basis(model, columns, network, records).to_plain(network))
                places.append(count + np.arange(network.n_parameters))
                count += network.n_parameters
                continue
            equation = EquationLayout.of(model)
            layouts.append(equation)
            blocks.append(np.diag(equation.scale))
            own = []
            for one in equation.parameters:
                at, same = known.get(one.name, (count, one)) if one.name in shared else (count, one)
                check_alike(one, same)
                known[one.name] = (at, one)
                own.append(at)
                count = max(count, at + 1)
            places.append(np.array(own, dtype=np.int64))
        to_plain = scipy.sparse.csr_array(scipy.sparse.block_diag(blocks))
        every = np.concatenate(places)
        if count < len(every):
            one_each = (np.ones(len(every)), (np.arange(len(every)), every))
            to_plain = to_plain @ scipy.sparse.csr_array(one_each, shape=(len(every), count))
        return cls(members=tuple(layouts), places=tuple(places), to_plain=to_plain)

    @property
    def count(self) -> int:
        """Number of what is trained."""
        return int(self.to_plain.shape[1])

    @property
    def named(self) -> tuple[Named, ...]:
        """The parameters of equations, each once; those of one name that are not shared by the equation's output."""
        found = dict[int, tuple[Parameter, str]]()
        for layout, places in zip(self.members, self.places, strict=True):
            if isinstance(layout, EquationLayout):
                for at, one in zip(places.tolist(), layout.parameters, strict=True):
                    found.setdefault(at, (one, layout.name))
        names = [one.name for one, _ in found.values()]
        return tuple(
            Named(parameter=one, place=at, case=output if names.count(one.name) > 1 else "")
            for at, (one, output) in found.items()
        )

    @property
    def scale(self) -> Array:
        """Of each of what is trained; 1 of the parameters of networks, shape ``(n_trained,)``."""
        scale = np.ones(self.count)
        for one in self.named:
            scale[one.place] = one.parameter.scale
        return scale

    @property
    def bounds(self) -> tuple[Array, Array] | None:
        """Between what each is held, over its scale; ``None`` without equations."""
        if not self.named:
            return None
        low, high = np.full(self.count, -np.inf), np.full(self.count, np.inf)
        for one in self.named:
            low[one.place], high[one.place] = np.array([one.parameter.low, one.parameter.high]) / one.parameter.scale
        return low, high

    def in_basis(self, theta: Array) -> Array:
        """Plain parameters as what is trained.

        Args:
            theta: Plain parameters of all members, shape ``(n_parameters,)``.

        Returns:
            Shape ``(n_trained,)``.
        """
        first, found = 0, np.empty(self.count)
        for layout, places in zip(self.members, self.places, strict=True):
            own = slice(first, first + layout.n_parameters)
            if layout.n_parameters:
                found[places] = np.linalg.solve(self.to_plain[own][:, places].toarray(), theta[own])
            first = own.stop
        return found

    def centre(self) -> Array:
        """What the prior draws to, as it is trained, shape ``(n_trained,)``."""
        return self.in_basis(np.concatenate([layout.centre() for layout in self.members]))

    def prior(self, *, alpha: float, beta: float) -> Prior:
        """The prior a fit begins with: every network's own groups, and what is declared of each parameter.

        Args:
            alpha: Precision of every group of a network.
            beta: Precision of the residuals.

        Returns:
            The prior.
        """
        groups, alphas, seen = list[Group](), list[float](), set[int]()
        for layout, places in zip(self.members, self.places, strict=True):
            if isinstance(layout, Layout):
                own = layout.groups(int(places[0]))
                groups += own
                alphas += [alpha] * len(own)
                continue
            for at, one in zip(places.tolist(), layout.parameters, strict=True):
                if at not in seen:
                    groups.append(Group(name=f"{layout.name}: {one.name}", members=np.array([at]), known=True))
                    alphas.append(precision_of(one))
                seen.add(at)
        return Prior(centre=self.centre(), groups=tuple(groups), alphas=np.array(alphas), beta=beta)


def _basis(
    model: Member, columns: ColumnRecursion, layout: Layout, records: Sequence[dict[str, Array]]
) -> RegressorBasis:
    """Levels and rates of a member, scaled to some records; the plain basis without a linear part to take up shifts."""
    if not layout.linear:
        return RegressorBasis.identity(layout.lags)
    ends, depth = Ends.of(model), columns.lags.depth
    names = (*ends.inputs, *ends.outputs)
    rows = []
    for record in records:
        z = np.column_stack([record[name] for name in names])
        z = (z - np.array(columns.offset)) / np.array(columns.scale)
        z = np.concatenate([np.repeat(z[:1], depth, axis=0), z])
        n = len(z) - depth
        pairs = zip(columns.lags.input_channel, columns.lags.input_lag, strict=True)
        rows.append(np.column_stack([z[depth - lag : depth - lag + n, column] for column, lag in pairs]))
    regressors = np.concatenate(rows)
    return RegressorBasis.incremental(layout.lags, regressors[:: 1 + len(regressors) // MAX_ROWS])
