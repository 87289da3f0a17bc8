"""Such a loop as equations of a grey box, which every export knows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from sysid.equations.system import as_term, written_name
from sysid.estimation.loops.loop import Found, Loop, Scaled
from sysid.kernels.loop import DEAD_ZONE, RELAY, TINY, WAITS
from sysid.models import Mapping, VectorGreyBox
from sysid.models.blocks.curves import Text


def grey_box_of(found: Found, mapping: Mapping) -> VectorGreyBox:
    """The equations, their numbers where they were found: nothing is left to estimate.

    Args:
        found: What was found.
        mapping: Names of inputs and outputs, those of the records in their order.

    Returns:
        The structure.
    """
    return _Written(loop=found.loop, scaled=found.scaled, mapping=mapping).grey_box()


@dataclass(frozen=True, kw_only=True, eq=False)
class _Written:
    loop: Loop
    scaled: Scaled
    mapping: Mapping

    def grey_box(self) -> VectorGreyBox:
        """The structure."""
        begins = {f"x{i}": value for i, value in enumerate(self._part("begins"))}
        if self.loop.kind == RELAY:
            begins["on"] = float(self._part("on")[0] > 0.5)
        return VectorGreyBox(
            equations="\n".join(self._lines()),
            parameters={self._own(name): {"start": value, "fixed": True} for name, value in self._numbers().items()},
            initial={self._own(name): {"start": value, "fixed": True} for name, value in begins.items()},
        )

    def _own(self, name: str) -> str:
        """A name that no channel has."""
        return Text(taken=frozenset(self.mapping.channels)).name(f"l_{name}")

    def _part(self, name: str) -> list[float]:
        values: list[float] = self.loop.part(name, len(self.mapping.inputs)).tolist()
        return values

    @property
    def _n(self) -> range:
        return range(self.loop.states)

    @property
    def _modes(self) -> range:
        """States that the element drives: all but an integral that waits."""
        return range(self.loop.states - (self.loop.kind == WAITS))

    @property
    def _m(self) -> range:
        return range(len(self.mapping.inputs))

    def _numbers(self) -> dict[str, float]:
        """The numbers of the equations, by name."""
        loop, m = self.loop, len(self.mapping.inputs)
        keeps, fed = loop.moves()
        drives, low_high = self._part("drives"), self._part("limits")
        numbers = {f"keeps{i}": keeps[i] for i in self._modes} | {f"fed{i}": fed[i] for i in self._modes}
        numbers |= {f"drives{i}_{j}": drives[i * m + j] for i in self._modes for j in self._m}
        numbers |= {f"sees{i}": value for i, value in enumerate(self._part("sees"))}
        numbers |= {f"sees_u{j}": value for j, value in enumerate(self._part("sees_inputs"))}
        numbers |= {"low": low_high[0], "high": low_high[1]}
        if loop.kind == DEAD_ZONE:
            numbers["leads"] = self._part("leads")[0] * loop.steps
        if loop.kind == WAITS:
            numbers |= {f"winds{i}": value / loop.steps for i, value in enumerate(self._part("winds"))}
            numbers |= {f"winds_u{j}": value / loop.steps for j, value in enumerate(self._part("winds_inputs"))}
            numbers["winds"] = self._part("winds_by")[0] / loop.steps
        numbers |= {
            f"reads{k}_{i}": float(loop.read[i, k]) for k in range(loop.read.shape[1]) for i in range(loop.states + 1)
        }
        return {name: float(value) for name, value in numbers.items()}

    def _lines(self) -> Iterator[str]:
        own, scaled = self._own, self.scaled
        for j, name in enumerate(self.mapping.inputs):
            yield f"{own(f'u{j}')} = ({written_name(name)} - {as_term(scaled.begin[j])})/{as_term(scaled.reach[j])}"
        inputs = [own(f"u{j}") for j in self._m]
        for i in self._modes:
            yield f"{own(f'drive{i}')} = {_sum([own(f'drives{i}_{j}') for j in self._m], inputs)}"
        yield f"{own('seen')} = {_sum([own(f'sees_u{j}') for j in self._m], inputs)}"
        if self.loop.kind == WAITS:
            yield f"{own('winding')} = {own('winds')} + {_sum([own(f'winds_u{j}') for j in self._m], inputs)}"
        now, on = [own(f"x{i}") for i in self._n], own("on")
        if self.loop.kind == RELAY:
            yield f"{own('z')} = {self._sees(now)}"
            yield f"{own('on_0')} = where({own('z')} < {own('low')}, 1, where({own('z')} > {own('high')}, 0, {on}))"
        for step in range(self.loop.steps):
            after = [own(f"x{i}_{step}") for i in self._n]
            yield from self._relay(now, after, step) if self.loop.kind == RELAY else self._static(now, after, step)
            now = after
        for k, name in enumerate(self.mapping.outputs):
            read = _sum([own(f"reads{k}_{i}") for i in self._n], now)
            shares = f"{read} + {own(f'reads{k}_{self.loop.states}')}"
            yield f"{written_name(name)} = {as_term(scaled.rest[k])} + {as_term(scaled.span[k])}*({shares})"
        for i in self._n:
            yield f"{own(f'x{i}')}[k+1] = {now[i]}"
        if self.loop.kind == RELAY:
            yield f"{on}[k+1] = {own(f'on_{self.loop.steps}')}"

    def _sees(self, states: Sequence[str]) -> str:
        """What the element sees where the states are so."""
        return f"{self._own('seen')} + {_sum([self._own(f'sees{i}') for i in self._n], states)}"

    def _moved(self, state: str, i: int, element: str) -> str:
        own = self._own
        return f"{own(f'keeps{i}')}*{state} + {own(f'fed{i}')}*({own(f'drive{i}')} + {element})"

    def _static(self, now: Sequence[str], after: Sequence[str], step: int) -> Iterator[str]:
        own, low, high = self._own, self._own("low"), self._own("high")
        element = "deadzone" if self.loop.kind == DEAD_ZONE else "clamp"
        z, first, ahead, acts = (own(f"{name}_{step}") for name in ("z", "first", "ahead", "acts"))
        yield f"{z} = {self._sees(now)}"
        yield f"{first} = {element}({z}, {low}, {high})"
        fixed = ""
        if self.loop.kind == WAITS:
            gain, last = own(f"gain_{step}"), self.loop.states - 1
            yield f"{gain} = {own('winding')} + {_sum([own(f'winds{i}') for i in self._n], now)}"
            beyond = f"{z} > {high} and {gain} > 0 or {z} < {low} and {gain} < 0"
            yield f"{after[last]} = {now[last]} + where({beyond}, 0, {gain})"
            fixed = f" + {own(f'sees{last}')}*{after[last]}"
        terms = [f"{own(f'sees{i}')}*({self._moved(now[i], i, first)})" for i in self._modes]
        yield f"{ahead} = {own('seen')}{fixed} + {' + '.join(terms)}"
        leads = ""
        if self.loop.kind == DEAD_ZONE:
            leads = f" + {own('leads')}*({element}({ahead}, {low}, {high}) - {first})"
        yield f"{acts} = {element}(0.5*({z} + {ahead}), {low}, {high}){leads}"
        for i in self._modes:
            yield f"{after[i]} = {self._moved(now[i], i, acts)}"

    def _relay(self, now: Sequence[str], after: Sequence[str], step: int) -> Iterator[str]:
        own, low, high, tiny = self._own, self._own("low"), self._own("high"), f"{TINY:g}"
        before = own("z") if step == 0 else own(f"z_{step - 1}")
        on, z, reach, late = (own(f"{name}_{step}") for name in ("on", "z", "reach", "late"))
        moved = [own(f"moved{i}_{step}") for i in self._n]
        for i in self._n:
            yield f"{moved[i]} = {self._moved(now[i], i, on)}"
        yield f"{reach} = {self._sees(moved)}"
        goes_off = f"min(({reach} - {high})/max({reach} - {before}, {tiny}), 1)"
        goes_on = f"min(({low} - {reach})/max({before} - {reach}, {tiny}), 1)"
        off = f"where({on} > 0.5 and {reach} > {high}, -{goes_off}, 0)"
        yield f"{late} = where({on} < 0.5 and {reach} < {low}, {goes_on}, {off})"
        yield f"{own(f'on_{step + 1}')} = where({late} > 0, 1, where({late} < 0, 0, {on}))"
        for i in self._n:
            yield f"{after[i]} = {moved[i]} + {own(f'fed{i}')}*{late}"
        yield f"{z} = {self._sees(after)}"


def _sum(factors: Sequence[str], terms: Sequence[str]) -> str:
    return " + ".join(f"{factor}*{term}" for factor, term in zip(factors, terms, strict=True))
