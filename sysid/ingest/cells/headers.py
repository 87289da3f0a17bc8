"""What a column header says: name, unit, and what a pressure is measured from."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from sysid.units import Reference
from sysid.written_units import plain_unit

# "p [1]" is a pure number, "p[1]" an element of p.
_INDEX = re.compile(r"^.*?(?:\S\[\s*\d*\s*\]|\[\s*(?!1\s*\])\d*\s*\])\s*$", re.DOTALL)
# "y[k-1]" and "u(k)" are samples, and "y(t)" is a signal: no unit stands so near to a short name.
_ARGUMENT = re.compile(r"^(?:.*\S[\[(]\s*[kn]\s*(?:[+-]\s*\d+\s*)?[\])]|[^\W\d]\w{0,2}[\[(]t[\])])\s*$", re.DOTALL)
_BRACKETS = re.compile(r"^(?P<name>.*?\S)\s*\[(?P<unit>[^\[\]]*)\]\s*$", re.DOTALL)
_PARENTHESES = re.compile(r"^(?P<name>.*?\S)\s*\((?P<unit>[^()]*(?:\([ag]\))?)\)\s*$", re.DOTALL)
_SPOKEN = re.compile(r"^(?P<name>.*?\S)(?:\s+(?P<mark>/|in)|,)\s+(?P<unit>\S+)$", re.DOTALL)
_NODE = re.compile(r"[vViI]\w{0,2}\([^()]*\)")  # a voltage or a current of a circuit: V(out), Id(M1)
_REFERENCE_WORD = re.compile(r"^(?P<unit>.*?\S)\s*(?:\b|\()(?P<word>gauge|absolute|abs|[ga](?=\)$))\)?$", re.IGNORECASE)
_FUSED = {
    "barg": ("bar", Reference.GAUGE),
    "bara": ("bar", Reference.ABSOLUTE),
    "psig": ("psi", Reference.GAUGE),
    "psia": ("psi", Reference.ABSOLUTE),
}

_UNITS_IN_NAMES = frozenset(
    {"bar", "mbar", "barg", "bara", "Pa", "hPa", "kPa", "MPa", "psi", "psig", "psia", "V", "mV", "A", "mA"}
    | {"N", "kN", "Nm", "rpm", "m", "mm", "cm", "s", "ms", "us", "min", "K", "degC", "W", "kW", "Hz", "kHz", "kg"}
    | {"g", "rad", "deg", "%"}
)
_OF_CYCLERS = frozenset(
    {"h", "Ah", "mAh", "Wh", "mWh", "Ohm", "ohm", "mOhm", "kOhm", "uA", "µA", "µV", "uV", "MHz", "mW"}
)
"""Further units behind a stroke, as battery cyclers and potentiostats have them."""
_QUOTIENT = re.compile(r"(?P<name>[^/\s][^/]*)/(?P<unit>\S+)")
_IN_RUSSIAN = frozenset("счВАмНКгтл%")
"""Units of one letter that stand behind a comma, as the Russian standard has it."""
_LASTS = re.compile(r"(?:^|[_. ])(?:t|[Tt]ime|[Zz]eit|[Tt]id|[Ee]lapsed|[Rr]untime|[Dd]uration|[Dd]auer)[_.]min$")
_WRITTEN_OUT = {
    "second": "s", "sec": "s", "millisecond": "ms", "microsecond": "us", "minute": "min", "hour": "h", "volt": "V",
    "millivolt": "mV", "ampere": "A", "amp": "A", "celsius": "degC", "kelvin": "K", "fahrenheit": "degF", "watt": "W",
    "pascal": "Pa", "newton": "N", "meter": "m", "metre": "m", "percent": "%", "hertz": "Hz", "ohm": "ohm",
    "radian": "rad", "degree": "deg",
}  # fmt: skip
"""Units as names end with them that are meant to be read by people, in the singular."""


@dataclass(frozen=True, kw_only=True)
class Header:
    """A column header taken apart.

    Args:
        name: The name without the unit.
        unit: The unit as text that pint can be asked about, or ``None`` if the header names none.
        reference: What a pressure is measured from, if the header says so.
    """

    name: str
    unit: str | None = None
    reference: Reference | None = None


def unit_in_name(name: str) -> str | None:
    """The unit that a name ends with, where it is a usual one.

    Args:
        name: Of a column.

    Returns:
        The unit, or ``None``.

    Example:
        >>> unit_in_name("t_ms"), unit_in_name("p.bar"), unit_in_name("cell_volts"), unit_in_name("ms")
        ('ms', 'bar', 'V', None)
        >>> unit_in_name("time_min")
        'min'
        >>> unit_in_name("flow_min")
    """
    last = re.split(r"[_.]", name)[-1]
    if last == name:
        return None
    word = last.casefold()
    if word == "min" and not _LASTS.search(name):
        return None  # the least of something, or the end of l_min
    return last if last in _UNITS_IN_NAMES else _WRITTEN_OUT.get(word, _WRITTEN_OUT.get(word.removesuffix("s")))


def is_unit(text: str) -> bool:
    """Whether a text is a unit that is known, with or without a reference.

    Args:
        text: For example ``"kPa"``, ``"psi gauge"``, ``"-"``.

    Returns:
        True if it is.
    """
    unit, _ = split_reference(text)
    return plain_unit(unit) is not None


def split_reference(text: str) -> tuple[str, Reference | None]:
    """Take a unit and its reference apart, and write the unit as pint does.

    Args:
        text: For example ``"barg"``, ``"psi gauge"``, ``"kPa abs"``, ``"bar(a)"``, ``"%"``.

    Returns:
        The unit, and the reference if the text names one.

    Example:
        >>> split_reference("kPa abs")
        ('kPa', <Reference.ABSOLUTE: 'absolute'>)
    """
    text = text.strip()
    if text.lower() in _FUSED:
        return _FUSED[text.lower()]
    match = _REFERENCE_WORD.match(text)
    reference = None
    if match:
        reference = Reference.GAUGE if match["word"].lower().startswith("g") else Reference.ABSOLUTE
        text = match["unit"].strip()
    return plain_unit(text) or text, reference


def parse_header(text: str) -> Header:
    """Take a column header apart.

    Square brackets always hold a unit, unless they hold an index, as in ``p[0]``; round ones do only
    if the unit is known, since ``Test (1)`` or ``BP (wagon)`` are names. ``p [1]`` is a pure number. ``p / bar`` (as
    ISO 80000 writes it), ``p in bar`` and ``p, bar`` say a unit too, if it is one that cannot be taken for a name.

    Args:
        text: For example ``"BP [kPa]"``, ``"Tijd (s)"``, ``"BP [psi gauge]"``, ``"STP"``.

    Returns:
        Name, unit and reference.

    Example:
        >>> parse_header("Druck / bar").unit, parse_header("Valve, open").unit
        ('bar', None)
        >>> [parse_header(text).unit for text in ("u(k-1)", "y[k]", "m(t)", "Masse (t)")]
        [None, None, None, 't']
        >>> parse_header("BP [psi gauge]")
        Header(name='BP', unit='psi', reference=<Reference.GAUGE: 'gauge'>)
        >>> parse_header("Test (1)")
        Header(name='Test (1)', unit=None, reference=None)
    """
    if _ARGUMENT.match(text):
        return Header(name=text.strip())
    match = _BRACKETS.match(text)
    if match and not _INDEX.match(text):
        unit, reference = split_reference(match["unit"])
        return Header(name=match["name"].strip(), unit=unit or None, reference=reference)
    match = _PARENTHESES.match(text)
    if match and not match["unit"].strip().isdigit() and is_unit(match["unit"]):
        unit, reference = split_reference(match["unit"])
        return Header(name=match["name"].strip(), unit=unit, reference=reference)
    match = _SPOKEN.match(text.strip())
    if match and _is_spoken(match["unit"], match["mark"]):
        unit, reference = split_reference(match["unit"])
        return Header(name=match["name"].strip(), unit=unit, reference=reference)
    return Header(name=text.strip())


def parse_headers(texts: Sequence[str]) -> list[Header]:
    """Take the headers of a table apart, each in the light of the others.

    Brackets that tell columns of one name apart belong to the names, as those of circuits do: ``V(in)`` is no voltage
    in inches beside ``V(out)`` or ``I(R1)``.

    Args:
        texts: The header of each column.

    Returns:
        Name, unit and reference of each.

    Example:
        >>> [header.name for header in parse_headers(["time", "V(in)", "I(R1)"])]
        ['time', 'V(in)', 'I(R1)']
        >>> [header.unit for header in parse_headers(["t (s)", "U (V)", "U2 (mV)"])]
        ['s', 'V', 'mV']
        >>> [(header.name, header.unit) for header in parse_headers(["time/s", "Ewe/V", "Q/mAh/g", "speed"])]
        [('time', 's'), ('Ewe', 'V'), ('Q', 'mAh/g'), ('speed', None)]
        >>> [header.unit for header in parse_headers(["time", "v km/h", "km/h", "rig/V", "rig/A", "dQ/dV"])]
        [None, None, None, None, None, None]
    """
    headers = _with_quotients(texts, [parse_header(text) for text in texts])
    found = [_PARENTHESES.match(text.strip()) for text in texts]
    nodes = [
        match is not None and _NODE.fullmatch(text.strip()) is not None
        for match, text in zip(found, texts, strict=True)
    ]
    circuit = any(node and header.unit is None for node, header in zip(nodes, headers, strict=True))
    heads = Counter(match["name"] for match in found if match is not None)
    taken = {match["name"] for match, header in zip(found, headers, strict=True) if match and header.unit is None}
    return [
        Header(name=text.strip())
        if match is not None and ((circuit and node) or (heads[match["name"]] > 1 and match["name"] in taken))
        else header
        for text, header, match, node in zip(texts, headers, found, nodes, strict=True)
    ]


def _with_quotients(texts: Sequence[str], headers: Sequence[Header]) -> list[Header]:
    """With the units of quotients, as ISO 80000 and cyclers write them, ``Ewe/V``, where two columns or more have some.

    What stands before the mark is a group where it comes again, and half of a unit where it is one: ``km/h``.
    """
    pairs = [
        _QUOTIENT.fullmatch(text.strip()) if one.unit is None else None
        for text, one in zip(texts, headers, strict=True)
    ]
    said = [None if pair is None else _quotient(pair["name"], pair["unit"]) for pair in pairs]
    names = [one.name for one in said if one is not None]
    if len(names) < 2 or len(set(names)) < len(names):
        return list(headers)
    return [header if one is None else one for header, one in zip(headers, said, strict=True)]


def _quotient(name: str, unit: str) -> Header | None:
    """A name and a usual unit behind a stroke."""
    written = _WRITTEN_OUT.get(unit.casefold(), unit)
    usual = all(part in _UNITS_IN_NAMES | _OF_CYCLERS for part in written.split("/"))
    half = name in _UNITS_IN_NAMES or (len(name) > 1 and is_unit(name)) or re.search(r"\s", name) is not None
    if not usual or half or not is_unit(written):
        return None
    found, reference = split_reference(written)
    return Header(name=name, unit=found, reference=reference)


def _is_spoken(unit: str, mark: str | None) -> bool:
    """Whether a word behind a name is its unit: a single letter may be a name, too."""
    letters = {"s", "h"} if mark != "/" else {"s", "h", "V", "A", "N", "W", "K", "m", "1", "%"}
    return is_unit(unit) if len(unit) > 1 else unit in letters | _IN_RUSSIAN
