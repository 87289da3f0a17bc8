r"""The numbers of a block-oriented model with a state more in some blocks, whose map is the same.

To a block a pole is added and a zero on it, which cancel: what more states can do begins at what fewer could. As the
sections of a block stand in a row, those of second order first, the last one alone changes. Behind an even number of
states it is new, and nothing is fed to it. An odd number ends with a section of first order,

.. math:: \frac{b}{z - p} = \frac{b z - q b}{(z - p) (z - q)}.
"""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Mapping as Dict

from sysid.models import HammersteinWiener, WienerHammerstein
from sysid.models.blocks.block_oriented import BlockStructure

Name = Callable[[str], str]


def states_of(structure: BlockStructure) -> dict[str, int]:
    """States of each block, by what the names of its parameters begin with.

    Args:
        structure: The structure.

    Returns:
        By ``g``, or by ``g1`` and ``g2``.
    """
    if isinstance(structure, WienerHammerstein):
        return {"g1": structure.first, "g2": structure.second}
    assert isinstance(structure, HammersteinWiener)  # noqa: S101 - there is no third
    return {"g": structure.states}


def grown(
    found: Dict[str, float], smaller: BlockStructure, larger: BlockStructure, *, n_inputs: int, pole: float, name: Name
) -> dict[str, float]:
    """The numbers of the larger structure with which it is the smaller one.

    Args:
        found: Those of the smaller one, by name.
        smaller: The smaller structure.
        larger: The same with a state more in some blocks.
        n_inputs: Inputs of the whole.
        pole: Which pole, and zero, is added.
        name: From the name of a parameter to the one that it has beside those of channels.

    Returns:
        Those of the larger one.
    """
    values, before = dict(found), states_of(smaller)
    for tag, states in states_of(larger).items():
        if states > before[tag]:
            reads = 1 + larger.between if tag == "g2" and isinstance(larger, WienerHammerstein) else n_inputs
            values = _with_pole(values, tag, before[tag], reads, pole=pole, name=name)
            if tag == "g1" and isinstance(larger, WienerHammerstein):
                values = _with_weights(values, states, n_inputs, larger.between, name)
    return values


def _with_pole(
    values: Dict[str, float], tag: str, states: int, reads: int, *, pole: float, name: Name
) -> dict[str, float]:
    """A block of so many states with one more."""
    section = (states + 2) // 2
    first, second, drift = (name(f"{tag}_{end}") for end in (f"a{section}_1", f"a{section}_2", "drift"))
    ends = [f"_{j + 1}" for j in range(reads)] if reads > 1 else [""]
    last, new = ([name(f"{tag}_b{i}{end}") for end in ends] for i in (states, states + 1))
    changed = dict(values)
    if states % 2:
        changed[first], changed[second] = -(values[first] + pole), values[first] * pole
        changed |= {to: -pole * values[of] for of, to in zip(last, new, strict=True)}
    else:
        changed |= {first: pole, **dict.fromkeys(new, 0.0)}
    if drift in values:  # a constant, which passes the new section
        changed[drift] = (1.0 - pole) * values[drift]
    return changed


def _with_weights(values: dict[str, float], states: int, n_inputs: int, between: int, name: Name) -> dict[str, float]:
    """What lies between two samples: the new state is no part of it, those of the inputs come after it."""
    changed = dict(values)
    for place in range(1, between + 1):
        for j in range(n_inputs):
            changed[name(f"g1_w{place}_{states + j + 1}")] = values[name(f"g1_w{place}_{states + j}")]
        changed[name(f"g1_w{place}_{states}")] = 0.0
    return changed
