"""Static curves of block-oriented models: how each is written, and the expression that it becomes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from collections.abc import Mapping as Dict
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, shortened
from sysid.models.grey_box.declared import Parameter
from sysid.models.grey_box.grey_box import Table

NONE = "none"
SIZES = {"polynomial": (2, 9), "piecewise": (1, 50), "rounded": (1, 50), "network": (1, 100)}
"""Curves with a size: degree, breakpoints, neurons; the least and the most."""
LIMITED = {"saturation": 0.8, "dead zone": 0.1}
"""Curves with two limits, and where these start: shares of the range of what they see."""
PLAIN = (NONE, "absolute", *LIMITED)
STEEP = 0.02
"""Part of its largest bend that the slope of a curve has to be, if it is to begin as that of some values."""
SMALL = 1e-3
"""Part of others below which a start is 0."""
RIDGE = 1e-2
"""Weight of a neuron's share in where a network begins, over that of a sample's error."""
WIDTH, SHARPEST = 0.1, 0.003
"""How wide a rounded breakpoint starts and how sharp it may get, as shares of the range of what the curve sees."""
REACH = 0.9
"""Breakpoints start evenly between plus and minus this share of the range of what the curve sees."""


@dataclass(frozen=True, kw_only=True)
class Curve:
    """A static curve.

    Args:
        kind: ``none``, ``absolute``, ``saturation``, ``dead zone``, ``polynomial``, ``piecewise``, ``rounded``,
            ``network`` or ``table``.
        size: Degree, breakpoints or neurons.
        limits: Limits that are given, in the channel's unit; ``None`` where they are learnt.
        points: Of a table that is given.
    """

    kind: str
    size: int = 0
    limits: tuple[float, float] | None = None
    points: tuple[tuple[float, float], ...] = ()

    @classmethod
    def parse(cls, written: object, where: str) -> Curve:
        """A curve from what people write.

        Args:
            written: ``"piecewise 8"``, or a curve that is given: ``{saturation: [0, 5]}``, ``{table: [[x, y], ...]}``.
            where: The field, for the error's text.

        Returns:
            The curve.

        Raises:
            ConfigError: If it is none.

        Example:
            >>> Curve.parse("polynomial 3", "input"), str(Curve.parse({"saturation": [0, 5]}, "input"))
            (Curve(kind='polynomial', size=3, limits=None, points=()), 'saturation 0 to 5')
        """
        found = None
        if isinstance(written, Curve):
            again = {"table": list(written.points)} if written.points else written.kind
            again = f"{written.kind} {written.size}" if written.size or written.kind in SIZES else again
            found = cls.parse({written.kind: list(written.limits)} if written.limits else again, where)
            if found == written:
                return found
            written, found = repr(written), None
        if isinstance(written, str):
            kind, _, size = written.rpartition(" ")
            if written in PLAIN:
                found = cls(kind=written)
            elif kind in SIZES and size.isdigit() and SIZES[kind][0] <= int(size) <= SIZES[kind][1]:
                found = cls(kind=kind, size=int(size))
        elif isinstance(written, Dict) and len(written) == 1:
            ((kind, given),) = written.items()
            rows = np.array(given, dtype=np.float64) if _numbers(given) else np.zeros(0)
            if kind in LIMITED and rows.shape == (2,) and rows[0] < rows[1]:
                found = cls(kind=kind, limits=(float(rows[0]), float(rows[1])))
            elif kind == "table" and _is_table(rows):
                found = cls(kind=kind, points=tuple((float(x), float(y)) for x, y in rows))
        if found is None:
            sized = ", ".join(f"{kind} N (N from {low} to {high})" for kind, (low, high) in SIZES.items())
            raise ConfigError(
                "not a static curve",
                where=where,
                expected=f"{', '.join(PLAIN)}, {sized}, {{saturation: [low, high]}}, {{dead zone: [low, high]}} or "
                "{table: [[x, y], ...]} with x rising",
                got=shortened(written),
                remedy=f"write for example {where}: piecewise 8",
            )
        return found

    @property
    def given(self) -> bool:
        """Whether its numbers are known, in units."""
        return self.limits is not None or self.kind in {"table", "absolute"}

    def like(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[float, dict[str, float]] | None:
        """Where a learnt curve begins that comes close to some values: ``scale * (x + weights @ bends) + constant``.

        Args:
            x: Shape ``(n,)``, from -1 to 1.
            y: Shape ``(n,)``.

        Returns:
            The scale, and where parameters begin, by the ends of their names (a network's weights are given by
            :meth:`weights`); ``None`` for a curve with limits, or that has no slope where it is straight.
        """
        if self.kind == "polynomial":
            bends = [x**n for n in range(2, self.size + 1)]
        elif self.kind == "piecewise":
            bends = [np.maximum(x - place, 0.0) for place in _places(self.size)]
        elif self.kind == "rounded":
            bends = [WIDTH * np.logaddexp(0.0, (x - place) / WIDTH) for place in _places(self.size)]
        elif self.kind == "network":
            bends = []
        else:
            return None
        scale, *weights = np.linalg.lstsq(np.column_stack([x, *bends, np.ones(len(x))]), y, rcond=None)[0][:-1]
        steepest = float(np.abs(weights).max(initial=y.std() / x.std() if self.kind == "network" else abs(scale)))
        if not STEEP * steepest < abs(scale):
            return None
        word, first = ("c", 2) if self.kind == "polynomial" else ("slope", 1)
        found = {f"{word}{n}": sizeable(one / scale, 1.0) for n, one in enumerate(weights, start=first)}
        return float(scale), found

    def weights(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Weights of a network that comes close to some values with the identity beside it.

        Args:
            x: As for :meth:`like`.
            y: Likewise, with a slope of 1 on the whole.

        Returns:
            As ``net`` has them, of what ranges from -1 to 1; empty for other curves.
        """
        if self.kind != "network":
            return np.zeros(0)
        k = self.size
        slopes, biases = np.full(k, 0.7 * k), 0.7 * k * np.linspace(-1.0, 1.0, k) if k > 1 else np.zeros(1)
        columns = np.column_stack([np.tanh(np.outer(x, slopes) + biases), x, np.ones(len(x))])
        # Held small: neurons that are alike would take large parts of each other away.
        held = RIDGE * len(x) ** 0.5 * np.eye(k + 2)[:k]
        found = np.linalg.lstsq(np.concatenate([columns, held]), np.concatenate([y - x, np.zeros(k)]), rcond=None)[0]
        return np.concatenate([np.column_stack([slopes, biases]).ravel(), found[:-1], [0.0]])

    def to_value(self) -> Any:
        """As it is written."""
        if self.limits is not None:
            return {self.kind: list(self.limits)}
        if self.points:
            return {self.kind: [list(point) for point in self.points]}
        return str(self)

    def __str__(self) -> str:
        if self.limits is not None:
            return f"{self.kind} {self.limits[0]:g} to {self.limits[1]:g}"
        return f"{self.kind} {self.size}" if self.size else self.kind


def _is_table(rows: NDArray[np.float64]) -> bool:
    pairs = rows.ndim == 2 and rows.shape[1] == 2 and len(rows) > 1
    return pairs and bool((np.diff(rows[:, 0]) > 0.0).all()) and bool(np.ptp(rows[:, 1]) > 0.0)


def _numbers(given: object) -> bool:
    rows = given if isinstance(given, list | tuple) else ()
    flat = [one for row in rows for one in (row if isinstance(row, list | tuple) else [row])]
    even = len({len(row) if isinstance(row, list | tuple) else 0 for row in rows}) == 1
    return even and all(
        isinstance(one, int | float) and not isinstance(one, bool) and abs(one) < np.inf for one in flat
    )


@dataclass(kw_only=True)
class Text:
    """Equations as they are put together.

    Args:
        taken: Names of channels: none of the others may be one of these.
        lines: The equations.
        parameters: What they know and estimate.
        tables: Given curves.
        curved: Names of the parameters of curves.
    """

    taken: frozenset[str]
    lines: list[str] = field(default_factory=list)
    parameters: list[Parameter] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    curved: set[str] = field(default_factory=set)

    def name(self, wanted: str) -> str:
        """A name that no channel has."""
        while wanted in self.taken:
            wanted += "_"
        return wanted

    def define(self, wanted: str, right: str) -> str:
        """A name for an expression."""
        found = self.name(wanted)
        self.lines.append(f"{found} = {right}")
        return found

    def estimated(
        self, wanted: str, start: float, *, curve: bool = False, prior: float | None = None, low: float = -math.inf
    ) -> str:
        """A parameter; its name."""
        found = self.name(wanted)
        self.parameters.append(Parameter(name=found, start=float(start), prior=prior, low=low))
        if curve:
            self.curved.add(found)
        return found

    def curve(self, curve: Curve, x: str, tag: str, begun: Dict[str, float] | None = None) -> str:
        """What a curve makes of a value.

        Args:
            curve: The curve.
            x: The value: in units where the curve is given, else some -1 to 1.
            tag: Part of the names of its parameters.
            begun: Where parameters of a learnt curve begin (:meth:`Curve.like`); the identity by default.

        Returns:
            The expression.
        """
        found = _CURVES[curve.kind](self, curve, x, tag)
        starts = {self.name(f"{tag}_{end}"): value for end, value in (begun or {}).items()}
        self.parameters = [replace(one, start=starts.get(one.name, one.start)) for one in self.parameters]
        return found


def sizeable(value: float, among: float) -> float:
    """A start that is small beside others as 0: how large a parameter starts says what a large change of it is.

    Example:
        >>> sizeable(1e-9, 0.5), sizeable(0.1, 0.5)
        (0.0, 0.1)
    """
    return float(value) if abs(value) > SMALL * among else 0.0


def number(value: float) -> str:
    """A number as equations have it.

    Example:
        >>> number(2.0), number(-0.5)
        ('2.0', '(-0.5)')
    """
    return f"({float(value)!r})" if value < 0.0 else repr(float(value))


def _limited(function: str) -> Callable[[Text, Curve, str, str], str]:
    def write(text: Text, curve: Curve, x: str, tag: str) -> str:
        if curve.limits is not None:
            low, high = map(number, curve.limits)
        else:
            start = LIMITED[curve.kind]
            low, high = (
                text.estimated(f"{tag}_{side}", sign * start, curve=True) for side, sign in (("low", -1), ("high", 1))
            )
        return f"{function}({x}, {low}, {high})"

    return write


def _polynomial(text: Text, curve: Curve, x: str, tag: str) -> str:
    terms = [f"{text.estimated(f'{tag}_c{n}', 0.0, curve=True)}*{x}^{n}" for n in range(2, curve.size + 1)]
    return " + ".join([x, *terms])


def _places(size: int) -> Sequence[float]:
    """Where breakpoints start."""
    return np.linspace(-REACH, REACH, size + 2)[1:-1].tolist() if size > 1 else [0.01]


def _piecewise(text: Text, curve: Curve, x: str, tag: str) -> str:
    terms = [
        f"{text.estimated(f'{tag}_slope{i}', 0.0, curve=True)}"
        f"*max({x} - {text.estimated(f'{tag}_at{i}', place, curve=True)}, 0)"
        for i, place in enumerate(_places(curve.size), start=1)
    ]
    return " + ".join([x, *terms])


def _rounded(text: Text, curve: Curve, x: str, tag: str) -> str:
    """Straight pieces whose corners are rounded: ``s log(1 + exp((x - at)/s))``, written so that nothing overflows."""
    terms = []
    for i, place in enumerate(_places(curve.size), start=1):
        slope = text.estimated(f"{tag}_slope{i}", 0.0, curve=True)
        at = text.estimated(f"{tag}_at{i}", place, curve=True)
        width = text.estimated(f"{tag}_width{i}", WIDTH, curve=True, low=SHARPEST)
        terms.append(f"{slope}*(max({x} - {at}, 0) + {width}*log(1 + exp(-abs({x} - {at})/{width})))")
    return " + ".join([x, *terms])


def _table(text: Text, curve: Curve, x: str, tag: str) -> str:
    name = text.name(f"{tag}_table")
    text.tables.append((name, curve.points))
    return f"{name}({x})"


_CURVES: dict[str, Callable[[Text, Curve, str, str], str]] = {
    NONE: lambda text, curve, x, tag: x,  # noqa: ARG005
    "absolute": lambda text, curve, x, tag: f"abs({x})",  # noqa: ARG005
    "saturation": _limited("clamp"),
    "dead zone": _limited("deadzone"),
    "polynomial": _polynomial,
    "piecewise": _piecewise,
    "rounded": _rounded,
    "network": lambda text, curve, x, tag: f"{x} + net({x}, neurons={curve.size}, scale=1)",  # noqa: ARG005
    "table": _table,
}
"""By kind how it is written. All that are learnt are the identity where a fit starts."""
