"""Outputs in units, held within bounds and declared limits to the last digit, and what is raised where they are."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sysid.export.flags import Flag
from sysid.export.forms.stage import Side, Stage
from sysid.export.onnx.flags import Cause, Watched
from sysid.export.onnx.holds import bounded, within
from sysid.export.onnx.nodes import Nodes
from sysid.export.wide.whole import WideForm


@dataclass(frozen=True, kw_only=True)
class LimitedRow:
    """A channel that is computed: its stage, which output of it, and between which scaled numbers the model holds it.

    Infinite is a bound that can never be what holds it.
    """

    stage: Stage
    output: int
    low: float
    high: float

    @property
    def sides(self) -> tuple[Side, ...]:
        """Its declared limits."""
        return self.stage.limits[self.output]

    @property
    def by_channels(self) -> bool:
        """Whether another channel is one of them."""
        return any(side.column is not None for side in self.sides)

    @property
    def told(self) -> bool:
        """Whether it is told that it is at a limit."""
        return self.stage.told[self.output] and bool(self.sides)

    @property
    def limit_flag(self) -> Flag:
        """What it raises there."""
        return Flag.IN_DOUBT if self.stage.doubts[self.output] else Flag.AT_LIMIT

    @property
    def bounded(self) -> bool:
        """Whether its bounds can be what holds it."""
        return bool(np.isfinite(self.low) or np.isfinite(self.high))

    @property
    def offset(self) -> float:
        """From scaled numbers to its unit."""
        return float(self.stage.form.offset[self.stage.form.n_inputs + self.output])

    @property
    def scale(self) -> float:
        """See :attr:`offset`."""
        return float(self.stage.form.scale[self.stage.form.n_inputs + self.output])

    def ends(self, dtype: np.dtype[Any]) -> list[tuple[float, Flag | None]]:
        """Between which numbers it is held, in its unit, and what each raises; by a channel is not looked at.

        Args:
            dtype: Of the graph; bounds are rounded as it rounds numbers.

        Returns:
            The lower and the upper one.
        """
        sides = () if self.by_channels else self.sides
        top, bottom = (
            float(dtype.type(next((side.value for side in sides if side.upper is upper), default)))
            for upper, default in ((True, np.inf), (False, -np.inf))
        )
        found: list[tuple[float, Flag | None]] = []
        for bound in (self.low, self.high):
            there = float(dtype.type(bound) * dtype.type(self.scale) + dtype.type(self.offset))
            end = max(min(there, top), bottom)  # the lower wins
            at_limit = self.limit_flag if self.told else None
            found.append((end, at_limit if end in (top, bottom) else Flag.AT_BOUND))
        return found


def limited_rows(form: WideForm) -> dict[int, LimitedRow]:
    """The channels that are needed in units, by place among what is computed.

    Args:
        form: The whole.

    Returns:
        The rows.
    """
    n, every = len(form.surrogate.inputs), []
    for stage in form.surrogate.stages:
        for j in range(stage.form.n_outputs):
            below, above = form.idle_bounds(stage, j)
            low, high = -np.inf if below else stage.form.low, np.inf if above else stage.form.high
            every.append(LimitedRow(stage=stage, output=j, low=low, high=high))
    needed = {c - n for c in form.surrogate.columns} | {i for i, row in enumerate(every) if row.told or row.bounded}
    for i in reversed(range(len(every))):  # what limits a channel is computed before it
        if i in needed:
            needed |= {side.column - n for side in every[i].sides if side.column is not None and side.column >= n}
    return {i: every[i] for i in sorted(needed)}


class Limits:
    """Channels held within bounds and numbers, all at once; then within channels, each after what holds it.

    Args:
        nodes: The graph.
        rows: The channels, in the order of ``values``.
        u: The inputs in units.
        n_inputs: Their number.
        values: The channels, not yet held.
    """

    def __init__(self, nodes: Nodes, rows: Dict[int, LimitedRow], u: str, n_inputs: int, values: str) -> None:
        self.nodes, self.rows, self.n_inputs = nodes, rows, n_inputs
        self.ends = [row.ends(nodes.dtype) for row in rows.values()]
        low, high = (np.array([ends[side][0] for ends in self.ends]) for side in (0, 1))
        held = within(nodes, values, low, high, "held")
        self.known = [(u, n_inputs), (held, len(rows))]
        self.places = {channel: (1, at) for at, channel in enumerate(rows)}
        self.watched, self.reached = [self._watched(held, [*rows], before=False)], list[Cause]()
        for turn, own in enumerate(self._turns()):
            self._turn(nodes.within(f"{nodes.prefix}turn{turn}_"), own)

    def values(self, own: Sequence[int], name: str) -> str:
        """Some channels, held."""
        return self._taken(self.nodes, [self.places[channel] for channel in own], name)

    def _taken(self, nodes: Nodes, places: Sequence[tuple[int, int]], name: str) -> str:
        used = sorted({value for value, _ in places})
        return nodes.rows_of(
            [self.known[value] for value in used], [(used.index(value), row) for value, row in places], name
        )

    def _watched(self, name: str, own: Sequence[int], *, before: bool) -> Watched:
        """Channels that raise flags at numbers; those that a channel holds do as they are before that."""
        every, order = [*self.rows.values()], [*self.rows]
        at = [order.index(channel) for channel in own]
        ends = tuple(np.array([self.ends[i][side][0] for i in at]) for side in (0, 1))
        flags = tuple(
            [self.ends[i][side][1] if every[i].by_channels is before else None for i in at] for side in (0, 1)
        )
        return Watched.held(name, (ends[0], ends[1]), (flags[0], flags[1]), self.nodes.dtype, lost=not before)

    def _turns(self) -> list[list[int]]:
        """Which channels are held by others in which turn."""
        turn: dict[int, int] = {}
        for i in sorted(self.rows):
            if self.rows[i].by_channels:
                channels = [side.column - self.n_inputs for side in self.rows[i].sides if side.column is not None]
                turn[i] = max(1 + turn.get(channel, -1) for channel in channels)
        return [[i for i in self.rows if turn.get(i) == one] for one in range(1 + max(turn.values(), default=-1))]

    def _turn(self, nodes: Nodes, own: list[int]) -> None:
        """Hold some of the channels."""
        first, limits = self._first_and_limits(nodes, own)
        value, at = first, []
        for upper, limit in limits.items():
            value = bounded(nodes, value, limit, "below" if upper else "above", upper=upper, exact=True)
        for upper, limit in limits.items():
            at.append(nodes.add("Equal", [value, limit], f"at_limit{int(upper)}"))
        self.known.append((value, len(own)))
        self.places |= {channel: (len(self.known) - 1, row) for row, channel in enumerate(own)}
        if not any(self.rows[i].told or self.rows[i].bounded for i in own):
            return
        reached = at[0] if len(at) == 1 else nodes.add("Or", at, "at_limit")
        told = [self.rows[i].limit_flag if self.rows[i].told else None for i in own]
        if any(told):
            self.reached.append((reached, told))
        if any(self.rows[i].bounded for i in own):
            # At a limit it does not matter what was held before: no number is at no bound.
            free = nodes.add("Where", [reached, nodes.numbers("none", np.nan), first], "free")
            self.watched.append(self._watched(free, own, before=True))

    def _first_and_limits(self, nodes: Nodes, own: list[int]) -> tuple[str, dict[bool, str]]:
        """Channels not yet held, and what they may not be above and below, taken together."""
        first = [self.places[i] for i in own]
        sides = {
            upper: [next((one for one in self.rows[i].sides if one.upper is upper), None) for i in own]
            for upper in (True, False)
        }
        taken, cut = [*first], {"first": len(own)}
        for upper, found in sides.items():
            columns = [None if side is None else side.column for side in found]
            if any(column is not None for column in columns):
                spare = next(self._place(column) for column in columns if column is not None)
                taken += [spare if column is None else self._place(column) for column in columns]
                cut["high_channels" if upper else "low_channels"] = len(own)
        parts = dict(zip(cut, nodes.cut(self._taken(nodes, taken, "taken"), cut), strict=True))
        limits = {}
        for upper, found in sides.items():
            if any(found):
                name = "high" if upper else "low"
                limits[upper] = self._limits(nodes, found, parts.get(f"{name}_channels", ""), name)
        return parts["first"], limits

    def _limits(self, nodes: Nodes, sides: Sequence[Side | None], channels: str, name: str) -> str:
        """What channels are held by on one side: channels, numbers, or what holds nothing."""
        numbers = [np.nan if side is None or side.column is not None else side.value for side in sides]
        is_channel = [side is not None and side.column is not None for side in sides]
        if not channels or all(is_channel):
            return channels or nodes.column(f"{name}_numbers", numbers)
        mask = nodes.truths(f"{name}_is_channel", is_channel)
        return nodes.add("Where", [mask, channels, nodes.column(f"{name}_numbers", numbers)], f"{name}_limits")

    def _place(self, column: int) -> tuple[int, int]:
        return (0, column) if column < self.n_inputs else self.places[column - self.n_inputs]
