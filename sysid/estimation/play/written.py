"""Such a plant as equations of a grey box: play as it is, the rest as polynomials that begin at least squares."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sysid.equations.system import written_name
from sysid.estimation.play.found import Array, Play, Records, monomials, played
from sysid.models import Mapping, VectorGreyBox
from sysid.models.blocks.curves import Text

DEGREES, MOST_TERMS = (5, 3), 260
"""Of the polynomials, the likeliest first, and their terms at most, all outputs together."""


def grey_boxes_of(found: Play, records: Records, mapping: Mapping) -> list[VectorGreyBox]:
    """Equations of an input with play: each output is a polynomial of outputs before it and of inputs.

    Where all records begin alike, what the outputs were before the first sample, and where the input's follower stood,
    are numbers to estimate like the others.

    Args:
        found: The play.
        records: As it was found in.
        mapping: Names of inputs and outputs, those of the records in their order.

    Returns:
        One structure a degree.
    """
    n = records[0][0].shape[1] + len(found.states)
    sizes = {degree: len(monomials(n, degree)) * records[0][1].shape[1] for degree in DEGREES}
    return [
        _Written(found=found, records=records, mapping=mapping, degree=degree).grey_box()
        for degree, size in sizes.items()
        if size <= MOST_TERMS
    ]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Written:
    found: Play
    records: Records
    mapping: Mapping
    degree: int

    def grey_box(self) -> VectorGreyBox:
        """The structure."""
        given = [self._given(u, y) for u, y in self.records]
        lows, highs = (op([op(one, axis=0) for one in given], axis=0) for op in (np.min, np.max))
        middle, half = 0.5 * (lows + highs), np.where(highs > lows, 0.5 * (highs - lows), 1.0)
        terms = monomials(len(middle), self.degree)
        scaled = (np.vstack(given) - middle) / half
        powers = np.column_stack([np.prod(scaled[:, list(one)], axis=1) for one in terms])
        spans = np.ptp(np.concatenate([y for _, y in self.records]), axis=0)
        before = [np.array([self._base(y, j) for j in range(len(spans))]).T for _, y in self.records]
        changes = (np.vstack([y[1:] for _, y in self.records]) - np.vstack(before)) / spans
        factors = np.linalg.lstsq(powers, changes, rcond=None)[0]
        parameters: dict[str, Any] = {
            self._own(f"c_{j}_{n}"): float(factors[n, j]) for j in range(len(spans)) for n in range(len(terms))
        }
        firsts = self.records[0]
        parameters |= {self._own(f"from_{j}"): float(firsts[1][0, j]) for j in self.found.states}
        begin = float(firsts[0][0, self.found.input])
        parameters |= {self._own("stood"): begin, self._own("width"): {"start": self.found.width, "low": 0.0}}
        states = {f"was_{j}": float(firsts[1][0, j]) for j in self.found.states} | {"kept": begin, "runs": 0.0}
        return VectorGreyBox(
            equations="\n".join(self._lines(terms, middle, half, spans)), parameters=parameters,
            initial={self._own(name): {"start": value, "fixed": True} for name, value in states.items()},
        )  # fmt: skip

    def _base(self, y: Array, j: int) -> Array:
        """What a polynomial is added to: the output before, of a state; of another its first value."""
        return y[:-1, j] if j in self.found.states else np.full(len(y) - 1, self.records[0][1][0, j])

    def _given(self, u: Array, y: Array) -> Array:
        """What the polynomials are of, at each sample but the first: inputs, with play, and outputs before it."""
        moved = u[1:].copy()
        moved[:, self.found.input] = played(u[:, self.found.input], self.found.width)[1:]
        return np.hstack([moved, y[:-1][:, list(self.found.states)]])

    def _own(self, name: str) -> str:
        """A name that no channel has."""
        return Text(taken=frozenset(self.mapping.channels)).name(f"p_{name}")

    def _lines(self, terms: Sequence[tuple[int, ...]], middle: Array, half: Array, spans: Array) -> Iterator[str]:
        own = self._own
        inputs, outputs = ([written_name(one) for one in some] for some in (self.mapping.inputs, self.mapping.outputs))
        moved, width = inputs[self.found.input], own("width")
        stood = f"where({own('runs')} > 0.5, {own('kept')}, {own('stood')})"
        yield f"{own('stem')} = min(max({stood}, {moved} - {width}), {moved} + {width})"
        for j in self.found.states:
            yield f"{own(f'before_{j}')} = where({own('runs')} > 0.5, {own(f'was_{j}')}, {own(f'from_{j}')})"
        given = [own("stem") if k == self.found.input else one for k, one in enumerate(inputs)]
        given += [own(f"before_{j}") for j in self.found.states]
        for k, one in enumerate(given):
            yield f"{own(f'x_{k}')} = ({one} - ({middle[k]:.13g}))/{half[k]:.13g}"
        for j, output in enumerate(outputs):
            parts = ["*".join([own(f"c_{j}_{n}"), *(own(f"x_{k}") for k in one)]) for n, one in enumerate(terms)]
            base = own(f"before_{j}") if j in self.found.states else f"({self.records[0][1][0, j]:.13g})"
            yield f"{output} = {base} + {spans[j]:.13g}*({' + '.join(parts)})"
            if j in self.found.states:
                yield f"{own(f'was_{j}')}[k+1] = {output}"
        yield f"{own('kept')}[k+1] = {own('stem')}"
        yield f"{own('runs')}[k+1] = 1"
