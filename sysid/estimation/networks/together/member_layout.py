"""Where the parameters of a cascade's member stand, what draws them, and the basis in which they are trained.

The same prior, start and basis as for a network that is fitted alone (``initialise.py``, ``basis.py``), for members of
one output or of several.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.evidence import Group
from sysid.estimation.networks.basis import RegressorBasis
from sysid.estimation.networks.initialise import READOUT_SPREAD, Layout
from sysid.models import Ends, Lags, Member
from sysid.models.contract.column_recursion import ColumnRecursion

MAX_ROWS = 50_000
"""Samples that the basis is scaled to; more say nothing new about the range of a regressor."""


@dataclass(frozen=True, kw_only=True)
class MemberLayout:
    """Where each part of the flat parameters of a member stands: ``[W | b | readouts | c | w | gates]``.

    Args:
        name: The outputs, for the names of groups.
        inputs: Lags of the columns that are inputs.
        outputs: Lags of the columns that are the member's own outputs.
        neurons: Number of neurons.
        linear: Whether there is a linear part.
        gated: Whether the neurons have gates; of a member with one output.
    """

    name: str
    inputs: tuple[tuple[int, ...], ...]
    outputs: tuple[tuple[int, ...], ...]
    neurons: int
    linear: bool
    gated: bool = False

    @classmethod
    def of(cls, model: Member, columns: ColumnRecursion) -> MemberLayout:
        """The layout of a member and of what it lowers to."""
        ends = Ends.of(model)
        n = len(ends.inputs)
        lags = columns.lags.inputs
        return cls(
            name="+".join(ends.outputs),
            inputs=lags[:n],
            outputs=lags[n:],
            neurons=columns.neurons,
            linear=columns.linear,
            gated=columns.gated,
        )

    @property
    def lags(self) -> Lags:
        """The regressors in order; the lags of all outputs, one output after the other, stand as those of one."""
        return Lags(inputs=self.inputs, output=tuple(lag for lags in self.outputs for lag in lags))

    @property
    def plain(self) -> Layout:
        """The layout of a network with these regressors and a single output."""
        return Layout(lags=self.lags, neurons=self.neurons, linear=self.linear, gated=self.gated)

    @property
    def count(self) -> int:
        """Number of parameters."""
        r, k, m = self.lags.n_regressors, self.neurons, len(self.outputs)
        return k * (r + 1) + m * (k + 1 + (r if self.linear else 0)) + (k * r if self.gated else 0)

    @property
    def gates(self) -> int:
        """Where the gates begin."""
        return self.count - (self.neurons * self.lags.n_regressors if self.gated else 0)

    def centre(self) -> NDArray[np.float64]:
        """What the prior draws the parameters to: every output stays as it is."""
        r, m = self.lags.n_regressors, len(self.outputs)
        centre = np.zeros(self.count)
        column = r - len(self.lags.output)
        for j, lags in enumerate(self.outputs):
            if self.linear and 1 in lags:
                centre[self.gates - m * r + j * r + column + lags.index(1)] = 1.0
            column += len(lags)
        return centre

    def draw(self, rng: np.random.Generator, centre: NDArray[np.float64]) -> NDArray[np.float64]:
        """A random start; see :meth:`Layout.draw`.

        Args:
            rng: Source of randomness.
            centre: Where the linear part starts, shape ``(n_parameters,)``.

        Returns:
            Flat parameters.
        """
        plain = self.plain
        whole = plain.draw(rng, np.zeros(plain.n_parameters))
        drawn = whole[: plain.readout.stop]
        more = READOUT_SPREAD * rng.standard_normal(self.neurons * (len(self.outputs) - 1))
        theta = centre.copy()
        theta[: len(drawn) + len(more)] = np.concatenate([drawn, more])
        theta[self.gates :] = whole[plain.gates]
        return theta

    def groups(self, first: int) -> list[Group]:
        """Groups of weights that share a prior, as for a network alone; each output's readout and linear part is one.

        Args:
            first: Where the member's parameters begin among those of all.

        Returns:
            The groups, their members counted over all.
        """
        r, k, m = self.lags.n_regressors, self.neurons, len(self.outputs)
        by_regressor = np.arange(k * r).reshape(k, r)
        places = {f"hidden {i}": by_regressor[:, i] for i in range(r)} | {"bias": np.arange(k * r, k * (r + 1))}
        if self.gated:
            places |= {f"gate {i}": self.gates + by_regressor[:, i] for i in range(r)}
        readout, constants = k * (r + 1), k * (r + 1 + m)
        for j in range(m):
            suffix = f" {j}" if m > 1 else ""
            own = [[constants + j], range(constants + m + j * r, constants + m + (j + 1) * r) if self.linear else []]
            places[f"readout{suffix}"] = np.arange(readout + j * k, readout + (j + 1) * k)
            places[f"linear{suffix}"] = np.concatenate([np.asarray(part, dtype=np.int64) for part in own])
        return [Group(name=f"{self.name}: {name}", members=first + at) for name, at in places.items() if len(at)]

    def to_plain(self, basis: RegressorBasis) -> NDArray[np.float64]:
        """The linear map from parameters in a basis to parameters over the plain regressors.

        Args:
            basis: The basis.

        Returns:
            Shape ``(n_parameters, n_parameters)``.
        """
        r, k, m = self.lags.n_regressors, self.neurons, len(self.outputs)
        P = np.eye(self.count)
        shift = basis.matrix @ basis.centre
        constants = k * (r + 1 + m)
        # Each row of weights with the constant that takes up the shift of its regressors.
        rows = [(neuron * r, k * r + neuron) for neuron in range(k)]
        rows += [(constants + m + j * r, constants + j) for j in range(m if self.linear else 0)]
        rows += [(self.gates + neuron * r, k * (r + 1) + neuron) for neuron in range(k if self.gated else 0)]
        for first, constant in rows:
            weights = slice(first, first + r)
            P[weights, weights] = basis.matrix.T
            P[constant, weights] = -shift
        return P


def basis_of(model: Member, layout: MemberLayout, records: Sequence[dict[str, NDArray[np.float64]]]) -> RegressorBasis:
    """Levels and rates of a member, scaled to some records.

    Args:
        model: The member.
        layout: Its layout.
        records: Channels by name, in their units, each of shape ``(n_samples,)``.

    Returns:
        The basis; the plain one where the member has no linear part, which takes up the shift.
    """
    columns = ColumnRecursion.of(model)
    if not layout.linear or columns is None:
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
