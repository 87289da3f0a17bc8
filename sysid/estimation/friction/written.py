"""Motion against dry friction as equations of a grey box, which every export knows.

A step is that of Moreau: what the forces would make of the speed loses what friction takes, and no more than all of it,
which is a dead zone of the speed. So it stands where it is held, and its run is continuous in every number: they are
found by the error of the free run. J. J. Moreau, "Unilateral contact and dry friction in finite freedom dynamics", in
Nonsmooth Mechanics and Applications, CISM 302, 1988.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from sysid.equations.system import as_term, written_name
from sysid.estimation.friction.found import Beside, Friction
from sysid.models import Mapping, VectorGreyBox
from sysid.models.blocks.curves import Text

STEPS = 5
"""From sample to sample."""
LAG = 0.3
"""Share by which a drive follows its command in a step, to begin with."""
LAGS = 0.1
"""Share of how the speed changes from which on what is left of it is told by a drive that lags."""
END = 0.1
"""What a spring at an end adds, as a share of what the inputs do, to begin with; and how far from rest, as a share of
the range, it begins."""


def grey_boxes_of(found: Friction, mapping: Mapping) -> list[VectorGreyBox]:
    """Equations of such a motion, the first what is likeliest.

    Args:
        found: What was found.
        mapping: Names of inputs and outputs, those of the records in their order.

    Returns:
        With friction that is more at rest; with a drive that lags behind its command, slowed down by the motion, and
        a spring at either end; with both.
    """
    ways = ((True, False), (False, True)) if found.left < LAGS else ((False, True), (True, False))
    return [
        _Written(found=found, mapping=mapping, sticks=one, lags=other).grey_box()
        for one, other in (*ways, (True, True))
    ]


@dataclass(frozen=True, kw_only=True)
class _Written:
    found: Friction
    mapping: Mapping
    sticks: bool
    lags: bool

    def grey_box(self) -> VectorGreyBox:
        """The structure."""
        states = ["speed", "place", *(f"sum_{n}" for n in range(len(self._sums))), *(["drive"] if self.lags else [])]
        return VectorGreyBox(
            equations="\n".join(self._lines()),
            parameters={self._own(name): value for name, value in self._parameters().items()},
            initial={self._own(one): {"start": 0.0, "fixed": True} for one in states},
        )

    @property
    def _sums(self) -> list[Beside]:
        return [one for one in self.found.beside if one.by_inputs]

    def _own(self, name: str) -> str:
        """A name that no channel has."""
        return Text(taken=frozenset(self.mapping.channels)).name(f"f_{name}")

    def _parameters(self) -> dict[str, Any]:
        found, size = self.found, max(map(abs, (*self.found.by_inputs, *self.found.by_beside)))
        given: dict[str, Any] = {f"push_{n}": value for n, value in enumerate(found.by_inputs)}
        given |= {f"by_{n}": value for n, value in enumerate(found.by_beside)}
        given |= {"drag": {"start": found.drag, "low": 0.0}, "pull": found.pull, "bias": 0.0}
        given |= {"held": {"start": found.held, "low": 0.0}}
        if self.sticks:
            given["more"] = {"start": max(found.more, 0.1 * found.held), "low": 0.0}
            given["slow"] = {"start": found.slow, "low": 1e-3, "high": 10.0}
        if self.lags:
            given |= {"lag": {"start": LAG, "low": 1e-3, "high": 1.0}, "back": {"start": 0.0, "low": 0.0}}
            given |= {side: {"start": END * size, "low": 0.0} for side in ("upper", "lower")}
            given |= {"at_upper": END, "at_lower": -END}
        for n, one in enumerate(self._sums):
            given |= {f"in_{n}_{j}": value for j, value in enumerate(one.by_inputs)}
            given[f"follow_{n}"] = one.by_speed
        given |= {f"shows_{n}": one.by_speed for n, one in enumerate(found.beside) if not one.by_inputs}
        return given

    def _lines(self) -> Iterator[str]:
        own, found = self._own, self.found
        for j, name in enumerate(map(written_name, self.mapping.inputs)):
            yield f"{own(f'u_{j}')} = ({name} - {as_term(found.begins[j])})/{as_term(found.reach[j])}"
        pushes = " + ".join(f"{own(f'push_{j}')}*{own(f'u_{j}')}" for j in range(len(found.begins)))
        yield f"{own('push')} = {pushes} + {own('bias')}"
        names = ["speed", "place", "drive", *(f"sum_{n}" for n in range(len(self._sums)))]
        now = {name: own(name) for name in names}
        for k in range(STEPS):
            after = {name: own(f"{name}_{k}") for name in names}
            yield from self._step(now, after, k)
            now = after
        places = list(map(written_name, self.mapping.outputs))
        yield f"{places[found.output]} = {as_term(found.rest[found.output])} + {as_term(found.span)}*{now['place']}"
        yield from self._beside(now, places)
        for name in names:
            if name != "drive" or self.lags:
                yield f"{own(name)}[k+1] = {now[name]}"

    def _beside(self, now: dict[str, str], places: Sequence[str]) -> Iterator[str]:
        sums = 0
        for n, one in enumerate(self.found.beside):
            value = f"{self._own(f'shows_{n}')}*{now['speed']}" if not one.by_inputs else now[f"sum_{sums}"]
            sums += bool(one.by_inputs)
            yield f"{places[one.output]} = {as_term(self.found.rest[one.output])} + {as_term(one.size)}*{value}"

    def _step(self, now: dict[str, str], after: dict[str, str], k: int) -> Iterator[str]:
        own, found = self._own, self.found
        drive = own("push")
        if self.lags:
            behind = f"{drive} - {own('back')}*{now['speed']} - {now['drive']}"
            yield f"{after['drive']} = {now['drive']} + {own('lag')}*({behind})"
            drive = after["drive"]
        force = f"{drive} - {own('drag')}*{now['speed']} - {own('pull')}*{now['place']}"
        force += "".join(f" + {own(f'by_{n}')}*{now[f'sum_{n}']}" for n in range(len(self._sums)))
        if self.lags:
            force += f" - {own('upper')}*max({now['place']} - {own('at_upper')}, 0)"
            force += f" + {own('lower')}*max({own('at_lower')} - {now['place']}, 0)"
        held = own("held")
        if self.sticks:
            yield f"{own(f'held_{k}')} = {held} + {own('more')}*exp(-({now['speed']}/{own('slow')})^2)"
            held = own(f"held_{k}")
        yield f"{own(f'free_{k}')} = deadzone({now['speed']} + ({force})/{STEPS}, -{held}/{STEPS}, {held}/{STEPS})"
        step, rest = found.fastest / found.span / STEPS, found.rest[found.output]
        place = f"{now['place']} + {as_term(step)}*{own(f'free_{k}')}"
        for end, kept in zip(found.ends, ("max", "min"), strict=True):
            place = place if end is None else f"{kept}({place}, {as_term((end - rest) / found.span)})"
        yield f"{after['place']} = {place}"
        yield f"{after['speed']} = ({after['place']} - {now['place']})/{as_term(step)}"
        for n in range(len(self._sums)):
            brought = " + ".join(f"{own(f'in_{n}_{j}')}*{own(f'u_{j}')}" for j in range(len(found.begins)))
            brought += f" + {own(f'follow_{n}')}*{after['speed']}"
            yield f"{after[f'sum_{n}']} = {now[f'sum_{n}']} + ({brought})/{STEPS}"
