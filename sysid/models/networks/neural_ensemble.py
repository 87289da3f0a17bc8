"""The form of several neural state spaces side by side, whose output is the mean of theirs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from sysid.errors import ConfigError, shortened
from sysid.models.networks.neural_form import NeuralForm, Seen
from sysid.models.orders.lags import whole


def check_shares(shares: tuple[int, ...]) -> None:
    """Refuse weights of members that are none.

    Args:
        shares: What was given.

    Raises:
        ConfigError: If there is none, or one is no whole number above 0.
    """
    if not shares or not all(whole(one) and one > 0 for one in shares):
        raise ConfigError(
            "not the shares of an ensemble's members",
            where="shares",
            expected="whole numbers from 1 on, one a member",
            got=shortened(shares),
            remedy="write (1, 1, 1) for the mean of three, or leave it out",
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class NeuralEnsemble(NeuralForm):
    r"""``y(t) = r(sum_m w_m y_m(t))``, the states side by side; ``r`` is the absolute value where there is one.

    A sensor that cannot tell a sign is one of the whole: what is averaged has its sign, and all members have the same.

    A member's states depend on no other's, so that their block in the state equation is all that there is. From a
    history each member finds its own state: all of them together would be more numbers than a few samples show. Where
    the output hides a sign, members are asked for theirs with either sign alike, and the run that is closer counts.

    Args:
        sizes: Of one member.
        theta: The members' flat parameters, one after the other.
        shares: Weight of each member in the mean, as whole numbers: how often it was picked.
    """

    shares: tuple[int, ...]

    @property
    def _count(self) -> int:
        return len(self.shares) * self.sizes.count

    @cached_property
    def members(self) -> tuple[NeuralForm, ...]:
        """Each by itself, as it was fitted."""
        return tuple(
            NeuralForm(
                sizes=self.sizes,
                theta=theta,
                scaling=self.scaling,
                activation=self.activation,
                rectified=self.rectified,
                bound=self.bound,
            )
            for theta in np.split(self.theta, len(self.shares))
        )

    @cached_property
    def _signed(self) -> tuple[NeuralForm, ...]:
        return tuple(replace(member, rectified=False) for member in self.members)

    @property
    def weights(self) -> NDArray[np.float64]:
        """Weight of each member; they sum to 1."""
        return np.array(self.shares) / sum(self.shares)

    @cached_property
    def joined(self) -> NeuralForm:
        """The same as one neural state space: its matrices have a block a member on their diagonal."""
        s, n = self.sizes, len(self.shares)
        wide = replace(
            s, states=n * s.states, neurons=n * s.neurons, output_neurons=n * s.output_neurons, integrators=0
        )
        theta = np.empty(wide.count)
        for part in ("linear", "hidden", "output_hidden"):
            theta[getattr(wide, part)] = np.ravel(self._rows(part, np.ones(n), blocks=True))
        theta[wide.readout] = block_diag(*self._parts("readout", s.states)).ravel()
        theta[wide.output_linear] = np.ravel(self._rows("output_linear", self.weights, blocks=False))
        readouts = self._parts("output_readout", s.outputs)
        theta[wide.output_readout] = np.ravel(np.hstack([w * v for w, v in zip(self.weights, readouts, strict=True)]))
        theta[wide.start] = np.concatenate([member.theta[s.start] for member in self.members])
        return NeuralForm(
            sizes=wide,
            theta=theta,
            scaling=self.scaling,
            activation=self.activation,
            rectified=self.rectified,
            bound=self.bound,
            low=self.low,
            high=self.high,
        )

    def _parts(self, name: str, rows: int) -> list[NDArray[np.float64]]:
        part = getattr(self.sizes, name)
        return [member.theta[part].reshape(rows, -1) if rows else np.zeros((0, 0)) for member in self.members]

    def _rows(self, name: str, weights: NDArray[np.float64], *, blocks: bool) -> NDArray[np.float64]:
        """Rows that take ``[x; u; 1]``: with blocks each member's stand below each other, else they are summed."""
        s = self.sizes
        parts = [w * member.theta[getattr(s, name)].reshape(-1, s.row)
                 for w, member in zip(weights, self.members, strict=True)]  # fmt: skip
        states, others = [part[:, : s.states] for part in parts], [part[:, s.states :] for part in parts]
        if blocks:
            return np.hstack([block_diag(*states), np.vstack(others)])
        return np.hstack([*states, np.sum(others, axis=0)])

    def resting(self, inputs: NDArray[np.float64], output: NDArray[np.float64]) -> NDArray[np.float64]:
        """The members' states at rest, one after the other; see the base class."""
        return np.concatenate([member.resting(inputs, output) for member in self.members])

    def corrected(
        self,
        scaled: NDArray[np.float64],
        output: NDArray[np.float64],
        x: NDArray[np.float64],
        known: NDArray[np.bool_] | None = None,
    ) -> NDArray[np.float64]:
        """The members' states before some samples, each found by itself; see the base class."""
        seen, parts = Seen.of(scaled, output, known), np.split(x, len(self.shares))
        pairs = list(zip(self.members, parts, strict=True))
        alone = np.concatenate([member.corrected(scaled, output, part, known) for member, part in pairs])
        if not self.rectified:
            return alone
        found = [alone]
        for signs in self.all_signs:
            states = [
                member.search(seen, part).found([member.descended_with(signs, seen, part)]) for member, part in pairs
            ]
            found.append(np.concatenate(states))
        return min(found, key=self.search(seen, x).total)

    def run(self, scaled: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Scaled outputs over some scaled inputs; see the base class."""
        n, total = self.sizes.states, np.zeros((len(scaled), self.sizes.outputs))
        for at, (member, weight) in enumerate(zip(self._signed, self.weights, strict=True)):
            total += weight * member.run(scaled, x[at * n : (at + 1) * n])
        return np.clip(np.abs(total) if self.rectified else total, self.low, self.high)

    def path(self, scaled: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
        """The states that a run visits, the members' side by side; see the base class."""
        parts = zip(self.members, np.split(x, len(self.shares)), strict=True)  # views, which the runs write
        return np.hstack([member.path(scaled, part) for member, part in parts])
