"""Block-oriented models: linear blocks and static curves in a row, as of MATLAB's ``nlhw``."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Annotated, Any, Self

from sysid.errors import ConfigError, shortened
from sysid.models.blocks.curves import NONE, Curve
from sysid.models.channels.mapping import Mapping
from sysid.models.orders.lags import per_input, whole
from sysid.models.orders.ranges import IntRange
from sysid.models.orders.structure import AbstractStructure

MOST_STATES = 20
"""Of a block: an order beyond this is a slip of the pen."""


def _check_states(value: object, where: str, example: str) -> None:
    if not whole(value) or not 1 <= value <= MOST_STATES:  # type: ignore[operator]  # a number by the first
        raise ConfigError(
            "not a number of states",
            where=where,
            expected=f"a whole number from 1 to {MOST_STATES}",
            got=shortened(value),
            remedy=f"write for example {example}",
        )


def _delays(given: object) -> tuple[int, ...] | int:
    if whole(given):
        return int(given)  # type: ignore[call-overload,no-any-return]  # a number by the check
    found = per_input(given)
    if not found or not all(map(whole, found)):
        raise ConfigError(
            "not dead times in samples",
            where="delays",
            expected="whole numbers from 0 on, one for each input, or one for all",
            got=shortened(given),
            remedy="write for example delays: 1",
        )
    return tuple(map(int, found))


class BlockStructure(AbstractStructure):
    """What both have in common: dead times, and equations that a grey box runs."""

    delays: int | tuple[int, ...]

    learns_curves = True

    @property
    @abstractmethod
    def smaller(self) -> Self | None:
        """The structure with one state less in its largest blocks, which it contains; ``None`` where there is none."""

    def lags(self, n_inputs: int) -> tuple[int, ...]:
        """The dead time of each input, in samples."""
        return (self.delays,) * n_inputs if isinstance(self.delays, int) else self.delays

    def check_inputs(self, n_inputs: int) -> None:
        """Refuse a number of inputs that the structure is not for."""
        given = self.delays
        if n_inputs < 1:
            raise ConfigError(
                f"{self.kind} needs an input: its curves bend one",
                where="mapping",
                expected="u -> y",
                got="no input",
                remedy="name an input, or fit an ARX model, a NARX network or a neural state space, which need none",
            )
        if not isinstance(given, int) and len(given) != n_inputs:
            raise ConfigError(
                "the dead times do not match the inputs",
                where="delays",
                expected=f"{n_inputs} values, one for each input",
                got=f"{given} and {n_inputs} inputs",
                remedy="write one number for all inputs, or one for each",
            )


@dataclass(frozen=True, kw_only=True)
class HammersteinWiener(BlockStructure):
    """Static curves before and behind a linear block of some states: ``y = h(G f(u))``.

    With a curve before it alone it is a Hammerstein model, with one behind it alone a Wiener model. Learnt curves are
    written ``saturation``, ``dead zone``, ``polynomial 3`` (degree), ``piecewise 8`` (straight pieces, breakpoints),
    ``rounded 4`` (the same with rounded corners), ``network 5`` (neurons); known ones ``absolute``,
    ``{saturation: [0, 5]}``, ``{dead zone: [-1, 1]}`` and ``{table: [[x, y], ...]}`` in units: of the input before the
    block, of the output behind it.

    Args:
        states: States of the linear block; those of several inputs share its poles.
        input: The curve of each input, or one curve for all.
        output: The curve behind the block.
        delays: Dead time in samples, for all inputs or one each; 0 for an output that answers within the sample.

    Raises:
        ConfigError: If a field cannot be used.

    Example:
        >>> HammersteinWiener(states=2, input="piecewise 8").label
        'HW 2, piecewise 8 before'
    """

    states: Annotated[int, IntRange(low=1, high=6)]
    input: Any = NONE
    output: Any = NONE
    delays: Any = 1

    kind = "HammersteinWiener"

    def __post_init__(self) -> None:
        _check_states(self.states, "states", "{kind: HammersteinWiener, states: 2, input: piecewise 8}")
        one = isinstance(self.input, str | dict | Curve) or not isinstance(self.input, Iterable)
        curves = (self.input,) if one else tuple(self.input)
        object.__setattr__(self, "input", tuple(Curve.parse(curve, "input") for curve in curves))
        object.__setattr__(self, "output", Curve.parse(self.output, "output"))
        object.__setattr__(self, "delays", _delays(self.delays))

    def curves(self, n_inputs: int) -> tuple[Curve, ...]:
        """The curve of each input."""
        return self.input * n_inputs if len(self.input) == 1 else self.input  # type: ignore[no-any-return]

    @property
    def smaller(self) -> HammersteinWiener | None:
        """With one state less."""
        return replace(self, states=self.states - 1) if self.states > 1 else None

    def check_mapping(self, mapping: Mapping) -> None:
        """Refuse curves that are not one for each input."""
        super().check_mapping(mapping)
        n = len(mapping.inputs)
        if len(self.input) not in {1, n}:
            raise ConfigError(
                "the curves do not match the inputs", where="input", expected=f"{n} curves, or one for all",
                got=len(self.input), remedy="write a curve for each input of the mapping, or one for all",
            )  # fmt: skip

    @property
    def label(self) -> str:
        """States and curves."""
        kinds = list(dict.fromkeys(map(str, self.input)))
        before = [f"{', '.join(kinds)} before"] if kinds != [NONE] else []
        behind = [f"{self.output} behind"] if self.output.kind != NONE else []
        return ", ".join([f"HW {self.states}", *before, *behind])

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        return {
            "kind": self.kind,
            "states": self.states,
            "input": [curve.to_value() for curve in self.input],
            "output": self.output.to_value(),
            "delays": self.delays if isinstance(self.delays, int) else list(self.delays),
        }


@dataclass(frozen=True, kw_only=True)
class WienerHammerstein(BlockStructure):
    """A static curve between two linear blocks: ``y = G2 f(G1 u)``.

    Args:
        first: States of the block before the curve; those of several inputs share its poles.
        second: States of the block behind it, which answers within the sample.
        curve: The curve, learnt: ``saturation``, ``dead zone``, ``polynomial 3``, ``piecewise 8``, ``rounded 4`` or
            ``network 5``.
        delays: Dead time in samples, for all inputs or one each; 0 for an output that answers within the sample.
        between: Places between two samples at which the curve acts too. What is bent in continuous time has harmonics
            that samples alone fold back into the band: a circuit, or a process that is sampled slowly. Not for a
            network.

    Raises:
        ConfigError: If a field cannot be used.

    Example:
        >>> WienerHammerstein(first=3, second=3, curve="network 5").label
        'WH 3/3, network 5'
    """

    first: Annotated[int, IntRange(low=1, high=6)]
    second: Annotated[int, IntRange(low=1, high=6)]
    curve: Any = "piecewise 8"
    delays: Any = 1
    between: Annotated[int, IntRange(low=0, high=4)] = 0

    kind = "WienerHammerstein"

    def __post_init__(self) -> None:
        for name in ("first", "second"):
            _check_states(getattr(self, name), name, "{kind: WienerHammerstein, first: 3, second: 3}")
        curve = Curve.parse(self.curve, "curve")
        if curve.given or curve.kind == NONE:
            raise ConfigError(
                "what lies between two blocks has no unit", where="curve", expected="a curve that is learnt",
                got=str(curve), remedy="write for example curve: piecewise 8",
            )  # fmt: skip
        if self.between and curve.kind == "network":
            raise ConfigError(
                "a network acts at the samples alone", where="curve", got=str(curve),
                expected="with between, a curve whose parameters are the same at every place",
                remedy="write for example curve: rounded 6",
            )  # fmt: skip
        object.__setattr__(self, "curve", curve)
        object.__setattr__(self, "delays", _delays(self.delays))

    @property
    def smaller(self) -> WienerHammerstein | None:
        """With one state less in the larger block, in both of two that are as large."""
        most = max(self.first, self.second)
        first, second = (n - (n == most) for n in (self.first, self.second))
        return replace(self, first=first, second=second) if most > 1 else None

    @property
    def label(self) -> str:
        """States of both blocks, and the curve."""
        return f"WH {self.first}/{self.second}, {self.curve}{f', {self.between} between' if self.between else ''}"

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        return {
            "kind": self.kind,
            "first": self.first,
            "second": self.second,
            "curve": self.curve.to_value(),
            "delays": self.delays if isinstance(self.delays, int) else list(self.delays),
            **({"between": self.between} if self.between else {}),
        }
