"""Events as an excitation: rest at the start, away from it in one or several steps, and back."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from sysid.field_checks import FieldError
from sysid.references.config import InputPort

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
        x, at = np.full(length, port.begin), 0
        while at < length:
            at += int(rng.integers(rests[0], rests[1] + 1))
            held = int(rng.integers(shortest, longest + 1))
            for number, level in enumerate(self._levels(rng, port)):
                held = int(rng.integers(shortest, longest + 1)) if number else held
                x[at : at + held] = level
                at += held
        return x

    def _levels(self, rng: np.random.Generator, port: InputPort) -> list[float]:
        """The levels of one departure, in their order."""
        begin, drawn = port.begin, float(rng.uniform(*port.range))
        end = port.range[1] if drawn >= begin else port.range[0]
        share = 0.0 if end == begin else self.least + (1.0 - self.least) * (drawn - begin) / (end - begin)
        if self.ends and rng.random() < self.ends:
            share = float(rng.choice([self.least or 1.0, 1.0]))
        count = int(rng.integers(1, self.steps + 1)) if self.steps > 1 else 1
        shares = np.linspace(max(self.least, share / count), share, count) if count > 1 else np.array([share])
        if self.back and rng.random() < self.back:
            shares = np.append(shares, share * rng.uniform(0.0, 0.8))
        # One level as it was drawn: to go there by its share would move its last digit.
        return [drawn] if self == Events(rest=self.rest) else (begin + shares * (end - begin)).tolist()
