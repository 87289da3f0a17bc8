"""What a stage of a surrogate reads: samples of inputs, numbers of the state, channels of now, and terms of these."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.export.forms.incremental import Term
from sysid.export.forms.stage import Stage
from sysid.export.surrogate import Surrogate


@dataclass(frozen=True, order=True)
class InputTerm:
    """A sample of an input of the whole in scaled numbers, or the difference of two.

    Args:
        older: The sample that is taken from it, so many steps ago; -1 for none. Levels are laid before rates.
        lag: How many steps ago.
        column: The input.
        offset: In its unit.
        scale: In its unit.
        first: Where its delay line begins in the state; -1 without one.
        length: Samples of the line.
    """

    older: int
    lag: int
    column: int
    offset: float
    scale: float
    first: int = -1
    length: int = 0


@dataclass(frozen=True, order=True)
class Past:
    """A number of the state.

    Args:
        column: Where it stands.
    """

    column: int


@dataclass(frozen=True, order=True)
class Now:
    """What a stage before computes at this sample, in the numbers of that stage.

    Args:
        channel: Its place among what is computed.
    """

    channel: int


Reading = InputTerm | Past | Now


class BlockTerms:
    """Readings and terms of a stage as they are found.

    Args:
        surrogate: The whole.
        stage: The stage.
        rates: Whether differences of inputs are readings of their own.
    """

    def __init__(self, surrogate: Surrogate, stage: Stage, *, rates: bool) -> None:
        self.surrogate, self.stage, self.rates = surrogate, stage, rates
        self.n_inputs = len(surrogate.inputs)
        self.readings: list[Reading] = []
        self.rows: list[tuple[dict[int, float], float]] = []

    def add(self, parts: Iterable[tuple[Reading, float]], shift: float = 0.0) -> int:
        """Add a term: a weighted sum of readings; gives back its place."""
        row: dict[int, float] = {}
        for reading, weight in parts:
            if reading not in self.readings:
                self.readings.append(reading)
            at = self.readings.index(reading)
            row[at] = row.get(at, 0.0) + weight
        self.rows.append((row, shift))
        return len(self.rows) - 1

    def now(self, column: int, offset: float, scale: float) -> int:
        """Add a channel at this sample, in other numbers than those of who computes it."""
        if column < self.n_inputs:
            return self.add([(InputTerm(-1, 0, column, offset, scale), 1.0)])
        slope, shift = affine(self.surrogate, column, offset, scale)
        return self.add([(Now(column - self.n_inputs), slope)], shift)

    def lagged(self, term: Term) -> int:
        """Add a term of a lagged model."""
        form, layout = self.stage.lagged
        line = layout.lines[term.channel]
        source = self.stage.sources[term.channel] if term.channel < form.n_inputs else self.n_inputs
        if source < self.n_inputs:
            first = self.stage.first + line.first if line.length else -1
            place = (source, line.offset, line.scale, first, line.length)
            if self.rates or term.older is None:
                return self.add([(InputTerm(-1 if term.older is None else term.older, term.lag, *place), 1.0)])
            return self.add([(InputTerm(-1, term.lag, *place), 1.0), (InputTerm(-1, term.older, *place), -1.0)])
        parts: list[tuple[Reading, float]] = []
        shift = 0.0
        for lag, sign in ((term.lag, 1.0), (term.older, -1.0)):
            if lag is None:
                continue
            if lag:
                parts.append((Past(self.stage.first + line.column(lag)), sign))
            else:
                slope, shift = affine(self.surrogate, source, line.offset, line.scale)
                parts.append((Now(source - self.n_inputs), slope))
        return self.add(parts, shift)

    def tables(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Selection and shift."""
        selection = np.zeros((len(self.rows), len(self.readings)))
        for i, (row, _) in enumerate(self.rows):
            for at, weight in row.items():
                selection[i, at] = weight
        return selection, np.array([shift for _, shift in self.rows], dtype=np.float64)


def affine(surrogate: Surrogate, column: int, offset: float, scale: float) -> tuple[float, float]:
    """Slope and shift from the scaled numbers of who computes a channel to others.

    Args:
        surrogate: The whole.
        column: The channel, which is computed.
        offset: Of the other numbers, in its unit.
        scale: The same.

    Returns:
        Slope and shift.
    """
    stage = next(one for one in surrogate.stages if column in one.targets)
    at = stage.form.n_inputs + stage.targets.index(column)
    own_offset, own_scale = stage.form.offset[at], stage.form.scale[at]
    return own_scale / scale, (own_offset - offset) / scale
