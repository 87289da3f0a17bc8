"""Subspace estimates of records: horizons, orders and candidates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.linear.segments import Segment
from sysid.estimation.linear.subspace.projections import Weighting, arx_orders, project
from sysid.estimation.linear.subspace.system import realise
from sysid.estimation.linear.subspace.windows import Windows
from sysid.estimation.linear.subspace.yardstick import Yardstick
from sysid.models.linear.innovations import Innovations

Array = NDArray[np.float64]

LONGEST = 40
"""Samples of past, and of future, that are looked at at most where nobody chose how many."""

WORK, ENOUGH = 1.6e10, 20_000
"""Products that a factorisation may take where nobody chose a horizon, some seconds; and samples of a record that are
enough to choose it."""

SHARE = 6
"""Windows have at most a sixth as many columns as there are samples."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Subspace:
    """Data ready for any subspace method.

    Args:
        windows: The compressed data.
        feedthrough: Whether outputs depend on inputs of the same sample.
        noise: Whether the noise is modelled.
    """

    windows: Windows
    feedthrough: bool
    noise: bool

    @classmethod
    def of(
        cls, segments: Sequence[Segment], *, states: int, horizon: int | None, feedthrough: bool, noise: bool
    ) -> Subspace:
        """Compress some records.

        Args:
            segments: The records.
            states: How many states are asked for.
            horizon: Samples of past and of future; ``None`` takes the order of a long ARX model
                by Akaike's criterion.
            feedthrough: Whether outputs depend on inputs of the same sample.
            noise: Whether the noise is modelled.

        Returns:
            The data.

        Raises:
            TraceError: If no record is long enough.
        """
        if horizon is None:
            past, future = _horizons(segments, states)
        else:
            past = future = horizon
        windows = Windows.of(segments, past, future)
        return cls(windows=windows, feedthrough=feedthrough, noise=noise)

    @cached_property
    def yardstick(self) -> Yardstick:
        """What the ARX model over the past leaves unexplained."""
        return Yardstick.of(self.windows, self.windows.past, feedthrough=self.feedthrough)

    def singular_values(self) -> Array:
        """Canonical correlations of past and future, descending: those that stand out count the states."""
        return project(self.windows, Weighting.CVA, feedthrough=self.feedthrough).singular_values

    def estimate(self, states: int, weighting: Weighting) -> Innovations:
        """The system that one method finds.

        Args:
            states: How many states.
            weighting: Which method.

        Returns:
            The system.
        """
        found = project(self.windows, weighting, feedthrough=self.feedthrough)
        n = min(states, found.to_state.shape[1])
        system = realise(self.windows, found, n, feedthrough=self.feedthrough, noise=self.noise)
        return system.padded(states)

    def order(self, most: int) -> int:
        """The number of states by the criterion of Bauer (2001, "Order estimation for subspace methods").

        Args:
            most: How many at most.

        Returns:
            The number, at least 1.
        """
        sizes, N = self.singular_values(), self.windows.n_rows
        each = self.windows.n_inputs + 2 * self.windows.n_outputs
        found = []
        for n in range(1, most + 1):
            following = float(sizes[n]) ** 2 if n < len(sizes) else 0.0
            found.append(following + n * each * np.log(max(N, 2)) / N)
        return 1 + int(np.argmin(found))


def _horizons(segments: Sequence[Segment], states: int) -> tuple[int, int]:
    """Samples of past and of future: the order of the best long ARX model, as far as the records allow."""
    p, width = segments[0].outputs.shape[1], segments[0].outputs.shape[1] + segments[0].inputs.shape[1]
    least = max(-(-states // p) + 1, 3)
    pieces = [piece for segment in segments for piece in segment.pieces()]
    total, longest = sum(map(len, pieces)), max(map(len, pieces), default=0)
    columns = min(total // SHARE, int(np.sqrt(WORK / max(total, 1))))
    most = max(min(LONGEST, columns // (2 * width), longest // 3), least)
    looked = [piece.first(ENOUGH) for piece in pieces]
    ahead = Windows.of(looked, max(min(LONGEST, total // (SHARE * width), longest // 3), least), 1)
    past = max(1 + int(np.argmin(arx_orders(ahead))), least)
    if past <= most:
        return past, past
    future = max(most, least)
    return max(min(past, columns // width - future), least), future
