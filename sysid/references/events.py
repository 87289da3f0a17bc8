"""Events as an excitation: rest at the start, away from it in one or several steps, and back."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import numpy as np
import scipy
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from sysid.field_checks import FieldError
from sysid.references.config import InputPort

BLOCK = 8
"""Departures over which levels are spread: about as many as an experiment has."""
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Events(BaseModel):
    """Departures of an input from its start, such as applications of a brake, doses or strokes.

    Args:
        rest: Shortest and longest time at the start between two of them, in seconds; one to two times the times that a
            level is held by default.
        steps: Levels on the way to the farthest, at most; each is held.
        least: Smallest departure, as a share of the way from the start to the end of the range.
        ends: Share of the departures that go to the least or to the end of the range, and not anywhere between.
        back: Share of the departures that are taken back in part first.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
    rest: tuple[float, float] | None = None
    steps: Annotated[int, Field(ge=1, le=100)] = 1
    least: Share = 0.0
    ends: Share = 0.0
    back: Share = 0.0

    @model_validator(mode="after")
    def _rising(self) -> Events:
        if self.rest is not None and not 0.0 < self.rest[0] <= self.rest[1]:
            raise FieldError(
                "no times to rest", expected="two rising seconds, above 0", got=str(list(self.rest)),
                remedy="correct rest",
            )  # fmt: skip
        return self

    def drawn(
        self, rng: np.random.Generator, length: int, h: float, holds: tuple[int, int], port: InputPort
    ) -> NDArray[np.float64]:
        """An input that moves so.

        How far its departures go, in how many steps and whether they are taken back is spread evenly over them, as the
        levels of an ``aprbs`` are: each drawn by itself, few departures may miss an end of the range, or all go there.
        Times are random: spread evenly too, long ones would make up for short ones, and nothing add up for long.

        Args:
            rng: What is random.
            length: Samples.
            h: Seconds between them.
            holds: Shortest and longest time at a level, in samples.
            port: The input.

        Returns:
            Shape ``(length,)``.
        """
        shortest, longest = holds
        rests = (shortest, 2 * longest) if self.rest is None else tuple(max(1, round(one / h)) for one in self.rest)
        x, at, departures = np.full(length, port.begin), 0, _evenly(rng, 5)
        while at < length:
            at += int(rng.integers(rests[0], rests[1] + 1))
            for level in self._levels(port, next(departures)):
                held = int(rng.integers(shortest, longest + 1))
                x[at : at + held] = level
                at += held
        return x

    def _levels(self, port: InputPort, drawn: NDArray[np.float64]) -> list[float]:
        """The levels of one departure in their order, by five numbers from 0 to 1: what differs between departures."""
        end, place, steps, back, kept = drawn.tolist()
        begin, level = port.begin, port.range[0] + place * (port.range[1] - port.range[0])
        far = port.range[1] if level >= begin else port.range[0]
        share = 0.0 if far == begin else self.least + (1.0 - self.least) * (level - begin) / (far - begin)
        if end < self.ends:
            share = (self.least or 1.0) if end < 0.5 * self.ends else 1.0
        count = 1 + int(steps * self.steps)
        shares = np.linspace(max(self.least, share / count), share, count) if count > 1 else np.array([share])
        if back < self.back:
            shares = np.append(shares, share * 0.8 * kept)
        return list((begin + shares * (far - begin)).tolist())


def _evenly(rng: np.random.Generator, columns: int) -> Iterator[NDArray[np.float64]]:
    """Rows of numbers from 0 to 1: of each block that follow each other one in each strip of each column."""
    cube = scipy.stats.qmc.LatinHypercube(columns, rng=rng)
    while True:
        yield from cube.random(BLOCK)
