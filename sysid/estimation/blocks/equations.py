"""Block-oriented structures as equations of a grey box, their parameters where the linear start has them."""

from __future__ import annotations

import re
from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.equations.system import written_name
from sysid.estimation.blocks.linear_start import LinearStart
from sysid.estimation.blocks.sections import Block, Pair
from sysid.models import GreyBox, HammersteinWiener, Mapping, WienerHammerstein
from sysid.models.blocks.curves import NONE, Curve, Text, number, sizeable


def hammerstein_wiener(
    structure: HammersteinWiener, mapping: Mapping, begun: LinearStart, block: Block,
    bends: Dict[str, float] | None = None,
) -> tuple[GreyBox, frozenset[str]]:  # fmt: skip
    """The equations of a Hammerstein-Wiener model.

    Args:
        structure: The structure.
        mapping: Which channels go in, which comes out.
        begun: The linear model.
        block: The same as a block.
        bends: Where parameters of the curve behind it begin; the identity by default.

    Returns:
        The grey box, and the names of the parameters of curves.
    """
    text = Text(taken=frozenset((*mapping.inputs, *mapping.outputs)))
    scaling = begun.scaling
    inputs = _inputs(text, structure.curves(len(mapping.inputs)), mapping, begun, structure.lags(len(mapping.inputs)))
    integrates = begun.integrates
    linear = _write_block(text, block, inputs, "g", fed=begun.constant(block) if integrates else None)
    level = "" if integrates else f" + {text.estimated('level', begun.level)}"
    inside = text.define("inside", f"{linear}{level}")
    in_units = f"{number(scaling.output_offset)} + {number(scaling.output_scale)}"
    curve, tag = structure.output, "h"
    if curve.given:
        right = text.curve(curve, text.define("unbent", f"{in_units}*{inside}"), tag)
    else:
        right = f"{in_units}*({text.curve(curve, inside, tag, bends)})"
    text.lines.append(f"{written_name(mapping.output)} = {right}")
    return _grey(text), frozenset(text.curved)


def wiener_hammerstein(
    structure: WienerHammerstein, mapping: Mapping, begun: LinearStart, pair: Pair
) -> tuple[GreyBox, NDArray[np.float64]]:
    """The equations of a Wiener-Hammerstein model, and where the weights of a network begin that is its curve.

    How large what lies between is no record can say. The largest gain of the first block has a prior that does.

    Args:
        structure: The structure.
        mapping: Which channels go in, which comes out.
        begun: The linear model.
        pair: The blocks, and the curve between them.

    Returns:
        The grey box, and the weights; none for other curves.
    """
    text = Text(taken=frozenset((*mapping.inputs, *mapping.outputs)))
    n = len(mapping.inputs)
    inputs = _inputs(text, (Curve(kind=NONE),) * n, mapping, begun, structure.lags(n))
    like = structure.curve.like(pair.x, pair.y)
    scale, bends = like or (1.0, None)
    weights = structure.curve.weights(pair.x, pair.y / scale) if like else np.zeros(0)
    behind = replace(pair.behind, gains=scale * pair.behind.gains, direct=scale * pair.behind.direct)
    drift = 0.0 if begun.integrates else None
    between = text.define("between", _write_block(text, pair.before, inputs, "g1", known=True, fed=drift))
    acts = text.curve(structure.curve, between, "f", bends)
    bent = text.define("bent", acts)
    more = _between(text, structure.between, pair.before, inputs, names=(between, bent), acts=acts)
    level = text.estimated("level", begun.level)
    behind = replace(
        behind,
        gains=np.pad(behind.gains, ((0, 0), (0, len(more)))),
        direct=np.pad(behind.direct, (0, len(more))),
    )
    linear = _write_block(text, behind, [(bent, True), *((one, True) for one in more)], "g2")
    scaling = begun.scaling
    right = f"{number(scaling.output_offset)} + {number(scaling.output_scale)}*({linear} + {level})"
    text.lines.append(f"{written_name(mapping.output)} = {right}")
    return _grey(text), weights


def _between(
    text: Text, places: int, before: Block, inputs: Sequence[Input], *, names: tuple[str, str], acts: str
) -> list[str]:
    """What the curve makes of what lies between two samples, at some places on the way to the next.

    There the first block's output is a sum of its states and of what it reads, with weights of its own. It begins as
    far on the way as the first state goes until the next sample.

    Args:
        text: The equations.
        places: How many places there are.
        before: The first block.
        inputs: What it reads.
        names: Of what lies between at the sample, and of what the curve makes of it.
        acts: The curve of it.

    Returns:
        Names of what the curve makes of it at each place.
    """
    section = before.sections[0]
    moves = [(section[0] if len(section) == 1 else -section[0]) - 1.0, *np.eye(1, before.states - 1)[0].tolist()]
    terms = [text.name(f"g1_x{i + 1}") for i in range(before.states)] + [read for read, _ in inputs]
    between, bent = names
    found = []
    for place in range(1, places + 1):
        share = place / (places + 1)
        weights = [
            text.estimated(f"g1_w{place}_{i}", share * move)
            for i, move in enumerate([*moves, *before.gains[0].tolist()], start=1)
        ]
        ahead = " + ".join(f"{weight}*{term}" for weight, term in zip(weights, terms, strict=True))
        here = text.define(f"{between}_{place}", f"{between} + {ahead}")
        found.append(text.define(f"{bent}_{place}", re.sub(rf"\b{between}\b", here, acts)))
    return found


Input = tuple[str, bool]
"""What a block reads, and whether within the sample."""


def _inputs(
    text: Text, curves: Sequence[Curve], mapping: Mapping, begun: LinearStart, lags: Sequence[int]
) -> list[Input]:
    """What each input is behind its curve, in scaled numbers."""
    found, scaling = [], begun.scaling
    for j, (name, curve, lag) in enumerate(zip(mapping.inputs, curves, lags, strict=True)):
        tag = f"f{j + 1}" if len(mapping.inputs) > 1 else "f"
        read = written_name(name) + (f"[k-{lag - 1}]" if lag > 1 else "")
        offset, scale = scaling.input_offset[j], scaling.input_scale[j]
        if curve.kind == "table":
            values = np.array([y for _, y in curve.points])
            offset, scale = float(values.max() + values.min()) / 2.0, float(np.ptp(values)) / 2.0
        if curve.given:
            read = text.curve(curve, read, tag)
        scaled = text.define(f"{tag}_in", f"({read} - {number(offset)})/{number(scale)}")
        found.append((scaled if curve.given else text.define(f"{tag}_out", text.curve(curve, scaled, tag)), lag == 0))
    return found


def _write_block(
    text: Text, block: Block, inputs: Sequence[Input], tag: str, *, known: bool = False, fed: float | None = None
) -> str:
    """Write a block; what its output is, as an expression.

    Its states and parameters have the tag in their names; where its largest gain is known, that has a prior as wide as
    it is large; ``fed`` is the constant that its last state is fed at first, of which an integrator makes a slope.
    """
    states = [text.name(f"{tag}_x{i + 1}") for i in range(block.states)]
    largest = float(np.abs(block.gains).max(initial=0.0)) if known else 0.0
    sizes = float(np.abs([*block.gains.ravel(), *block.direct]).max(initial=0.0))
    at = 0
    for number_, section in enumerate(block.sections, start=1):
        behind = states[at + len(section)] if at + len(section) < block.states else ""
        for i, coefficient in enumerate(section):
            name = text.estimated(f"{tag}_a{number_}_{i + 1}", coefficient)
            own = f"{name}*{states[at]}" if len(section) == 1 else f"-{name}*{states[at]}"
            terms = [own, states[at + 1] if i == 0 and len(section) > 1 else behind]
            for j, (read, _) in enumerate(inputs):
                gain = block.gains[at + i, j]
                wanted = f"{tag}_b{at + i + 1}" + (f"_{j + 1}" if len(inputs) > 1 else "")
                prior = largest if abs(gain) == largest > 0.0 else None
                terms.append(f"{text.estimated(wanted, sizeable(gain, sizes), prior=prior)}*{read}")
            if fed is not None and at + i == block.states - 1:
                terms.append(text.estimated(f"{tag}_drift", fed))
            text.lines.append(f"{states[at + i]}[k+1] = {' + '.join(term for term in terms if term)}")
        at += len(section)
    direct = []
    for j, (read, now) in enumerate(inputs):
        if now:
            wanted = f"{tag}_d{j + 1}" if len(inputs) > 1 else f"{tag}_d"
            direct.append(f"{text.estimated(wanted, sizeable(block.direct[j], sizes))}*{read}")
    return " + ".join([states[0], *direct])


def _grey(text: Text) -> GreyBox:
    return GreyBox(
        equations="\n".join(text.lines), parameters=tuple(text.parameters), tables={n: list(p) for n, p in text.tables}
    )
