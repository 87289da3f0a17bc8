"""Lines that name each of their values, brought into a table.

Boards print ``temp:23.5,hum:40`` for a serial monitor, firmware of printers ``T:20.5 /0.0 B:20.3 /0.0``, programs
``level=info u=1.5`` (logfmt), and InfluxDB writes ``rig,site=a u=1.5,y=2i 1710231300000000000`` (line protocol).
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_NAME = r"(?:[^\W\d]|@)[\w@.%/-]{0,39}"
_PAIR = re.compile(
    rf"(?<![\w.:@%/-])(?P<name>(?:(?:^|(?<=[,;|\t])|(?<=[,;|\t] )){_NAME}(?: {_NAME}){{0,3}}|{_NAME}))\s?[:=]\s*"
    rf'(?:"(?P<quoted>[^"]*)"|(?P<value>{_NUMBER})(?:\s?(?P<unit>[^\s,;|:=\d][^\s,;|:=]{{0,8}}))??'
    rf'|(?!{_NAME}\s?[:=])(?P<word>[^\s,;|"{{}}\[]+))'
    rf"(?=\s*(?:[,;|\t)}}\]]|$)|\s+{_NAME}\s?[:=])"
)
_NUMBERS = re.compile(_NUMBER)
_TARGET = re.compile(rf"(?<![\w.:@%/-])(?P<name>{_NAME})\s?:\s?(?P<value>{_NUMBER})\s?/\s?(?P<target>{_NUMBER})")
_STAMP = re.compile(
    r"\W{0,8}(?P<stamp>[0-9]{4}-[0-9]{2}-[0-9]{2}[T ][0-9]{2}:[0-9]{2}"
    r"(?::[0-9]{2}(?:[.,][0-9]+)?)?(?:Z|[+-][0-9:]{4,6})?"
    r"|[0-9]{1,2}:[0-9]{2}:[0-9]{2}(?:[.,][0-9]+)?(?![0-9:])|[0-9]+(?:\.[0-9]+)?(?=\W*$))"
)
_PART = r"(?:\\.|[^\\\s,=])+"
_POINT = re.compile(
    rf'(?P<series>{_PART}(?:,{_PART}={_PART})*) (?P<fields>{_PART}=(?:"(?:\\.|[^"\\])*"|[^\s,"]+)'
    rf'(?:,{_PART}=(?:"(?:\\.|[^"\\])*"|[^\s,"]+))*)(?: (?P<stamp>-?[0-9]{{10,19}}))?'
)
_FIELD = re.compile(rf'(?P<name>{_PART})=(?:"(?P<text>(?:\\.|[^"\\])*)"|(?P<value>[^\s,"]+))')
_NAMED = re.compile(r"(?<!\w)(?:[^\W\d]|@)\w{0,39}\s?[:=]\s{0,3}[-+.\d]")
_TRUTH = {"t": "true", "f": "false"}
_LOOKED, _FEWEST, _LONGEST = 200, 5, 4000
_SHARE = 0.6
"""Of the lines, how many have the same names at least, where others stand between them, as those that were sent."""
_ALL = 0.9


@dataclass(kw_only=True)
class NamedLine:
    """A line taken apart.

    Args:
        stamp: The time that it begins or ends with; empty where it has none.
        cells: Values by name, in their order.
        units: Units by name, of those that have one.
    """

    stamp: str = ""
    cells: dict[str, str] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)


def names_its_values(lines: Sequence[str]) -> bool:
    """Whether the lines of a file name their values, each of them the same, or in turn.

    Args:
        lines: The first lines.

    Returns:
        Whether they do.

    Example:
        >>> names_its_values(["u:1,y:2"] * 9), names_its_values(["rig: 4", "date: 3", "t,u", *["1,2"] * 9])
        (True, False)
    """
    shown = [line for line in lines[:_LOOKED] if line.strip()]
    if (
        len(shown) < _FEWEST
        or max(map(len, shown)) > _LONGEST
        or not any(mark in line for mark in ":=" for line in shown[-_FEWEST:])
    ):
        return False
    return _form(shown) is not None


def as_table(lines: Iterable[str]) -> tuple[list[str], list[str]]:
    """Such lines as those of a table, with tabs between its cells.

    Args:
        lines: All of them.

    Returns:
        The lines, of which the first has the names; and what should be told.
    """
    kept = [line for line in lines if line.strip()]
    points, wanted = _form(kept[:_LOOKED]) or (False, frozenset())
    found = [(_point if points else _pairs)(line) for line in kept]
    rows = [row for row in found if row is not None and row.cells and (points or not wanted.isdisjoint(row.cells))]
    rows = rows if points else _in_turn(rows)
    rows = _of_one_series(rows) if points else rows
    names = list(dict.fromkeys(name for row in rows for name in row.cells if points or name in wanted))
    units = {name: {row.units.get(name, "") for row in rows if name in row.cells} for name in names}
    heads = [
        f"{name} [{next(iter(units[name]))}]" if len(units[name]) == 1 and units[name] != {""} else name
        for name in names
    ]
    stamped = any(row.stamp for row in rows)
    table = ["\t".join([*["time"] * stamped, *heads])]
    table += ["\t".join([*[row.stamp] * stamped, *(row.cells.get(name, "") for name in names)]) for row in rows]
    left = len(kept) - len([row for row in found if row is not None and row.cells]) if not points else 0
    told = [f"each line names its values: {'line protocol' if points else ', '.join(names[:6])}"]
    return table, told + [f"{left} lines without values left out"] * bool(left)


def _form(lines: Sequence[str]) -> tuple[bool, frozenset[str]] | None:
    """Whether lines are points of line protocol, and else the names that come again; ``None`` where there are none."""
    if sum(_point(line) is not None for line in lines if not line.startswith("#")) >= _ALL * len(lines):
        return True, frozenset()
    found = [_pairs(line) for line in lines]
    counts = Counter(name for row in found if row for name, cell in row.cells.items() if _NUMBERS.fullmatch(cell))
    heads = Counter(tuple(row.cells) for row in found if row and row.cells)
    if not counts or not heads:
        return None
    usual, often = heads.most_common(1)[0]
    turns = len(heads) > 1 and len(usual) == 1 and _in_turn([row for row in found if row and row.cells])
    numbers = {name for name, count in counts.items() if count >= max(_FEWEST, 0.5 * often)}
    own = [row for row in found if row and tuple(row.cells) == usual]
    if not numbers or (turns is False and often < _SHARE * len(lines)) or (often < _FEWEST):
        return None
    if turns is not False:
        return (False, frozenset(numbers)) if turns and sum(heads.values()) >= _ALL * len(lines) else None
    if len(usual) == 1 and not all(row.stamp for row in own) and often < _ALL * len(lines):
        return None
    return (False, frozenset({*usual} & {*numbers} | {n for n in usual if all(n in row.cells for row in own)}))


def _pairs(line: str) -> NamedLine | None:
    """The names and values of a line; ``None`` where a part of it is none."""
    text = _TARGET.sub(
        lambda found: f"{found['name']}:{found['value']} {found['name']}_target:{found['target']}", line.strip()
    )
    row = NamedLine()
    first = len(text)
    for found in _PAIR.finditer(text):
        first = min(first, found.start())
        row.cells.setdefault(found["name"], found["quoted"] or found["value"] or found["word"] or "")
        if found["unit"]:
            row.units[found["name"]] = found["unit"]
    stamp = _STAMP.match(text[:first].rstrip())
    row.stamp = stamp["stamp"] if stamp else ""
    return row


def _point(line: str) -> NamedLine | None:
    found = _POINT.fullmatch(line.strip())
    if found is None:
        return None
    row = NamedLine(stamp=found["stamp"] or "")
    series = re.sub(r"\\(.)", r"\1", found["series"])
    for one in _FIELD.finditer(found["fields"]):
        text = one["text"] if one["value"] is None else re.sub(r"(?<=[0-9])[iu]$", "", one["value"])
        row.cells[f"{series}.{one['name']}"] = _TRUTH.get(text.casefold(), text)
    return row


def _of_one_series(rows: list[NamedLine]) -> list[NamedLine]:
    """Points without the name of their series, where there is one only."""
    series = {name.rpartition(".")[0] for row in rows for name in row.cells}
    if len(series) > 1:
        return rows
    return [replace(row, cells={name.rpartition(".")[2]: text for name, text in row.cells.items()}) for row in rows]


def _in_turn(rows: list[NamedLine]) -> list[NamedLine]:
    """Lines of one value each, whose names come in turn, as one row each turn; as they are where they do not."""
    if not rows or any(len(row.cells) != 1 or row.stamp for row in rows):
        return rows
    names = [next(iter(row.cells)) for row in rows]
    cycle = len(set(names))
    if (
        cycle < 2
        or names[: len(names) // cycle * cycle] != names[:cycle] * (len(names) // cycle)
        or len(set(names[:cycle])) < cycle
    ):
        return rows if cycle == 1 else []
    whole = range(0, len(rows) // cycle * cycle, cycle)
    return [
        NamedLine(
            cells={k: v for row in rows[at : at + cycle] for k, v in row.cells.items()},
            units={k: v for row in rows[at : at + cycle] for k, v in row.units.items()},
        )
        for at in whole
    ]
