"""What historians and control systems say of each value: columns of quality, whose bad rows hold no measurement."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.table import RawTable

_CALLED = re.compile(
    r"(?:(?P<of>.+?)[ _.:/-]+)?(?:opc[ _]?|value[ _]?|data[ _]?|signal[ _]?)?"
    r"(?:quality(?:[ _]?code)?|qualität|qualitaet|qualité|calidad|qual|validity|gültigkeit|is[ _]?good|is[ _]?valid)",
    re.IGNORECASE,
)
_GOOD = re.compile(r"(?:good|gut|bon|bonne|buena|valid|gültig|ok)\b.*", re.IGNORECASE)
_BAD = re.compile(
    r"(?:bad|schlecht|mauvais|mala|invalid|ungültig|no good|not good|not ok|nok|comm(?:unication)? (?:fail|error)).*",
    re.IGNORECASE,
)
_TRUE = re.compile(r"valid|gültig|is[ _]?good", re.IGNORECASE)
_OPC_GOOD, _OPC_UNCERTAIN = 192.0, 64.0
_OPC = {*(4.0 * k for k in range(8)), 64.0, 68.0, 80.0, 84.0, 88.0, 192.0, 216.0}
"""The numbers by which OPC says the quality: bad below 64, uncertain from there on, good from 192 on."""


def is_quality(column: RawColumn) -> bool:
    """Whether a column says of values how good they are.

    Args:
        column: Of any reader.

    Returns:
        Whether its name and all that it says are of that kind.
    """
    return _CALLED.fullmatch(column.name.strip()) is not None and _bad(column) is not None


def without_bad_values(table: RawTable) -> RawTable:
    """A table in which what its columns of quality call bad is missing.

    A column that is called by the name of another and quality (``level.quality``) is of that one, ``quality`` alone of
    all; words that are neither good nor bad (``Uncertain``) change nothing.

    Args:
        table: From any reader.

    Returns:
        The table; as it is where nothing is bad. What is missing is told.
    """
    columns, notes = list(table.columns), list(table.notes)
    for said in table.columns:
        found = _CALLED.fullmatch(said.name.strip())
        bad = _bad(said) if found else None
        if found is None or bad is None or not bad.any():
            continue
        of = [i for i, column in enumerate(columns) if _is_of(column, found["of"], table)]
        lost = 0
        for index in of:
            values = np.where(bad, np.nan, columns[index].values)
            lost += int(np.sum(np.isfinite(columns[index].values) & bad))
            columns[index] = replace(columns[index], values=values)
        if lost:
            many = "a value is" if lost == 1 else f"{lost} values are"
            notes.append(f"{many} missing, as {said.name} calls {'it' if lost == 1 else 'them'} bad")
    return replace(table, columns=tuple(columns), notes=tuple(notes))


def _is_of(column: RawColumn, name: str | None, table: RawTable) -> bool:
    if column.name == table.time or column.problem is not None or is_quality(column):
        return False
    return name is None or re.split(r"[ _.:/-](?:value|pv|wert)$", column.name, flags=re.IGNORECASE)[0] == name


def _bad(column: RawColumn) -> NDArray[np.bool_] | None:
    """Which rows are bad; ``None`` where the column says nothing of quality."""
    if column.words is not None:
        if not column.words.complete or not any(_GOOD.fullmatch(text) for text in column.words.texts):
            return None
        bad = np.array([*(_BAD.fullmatch(text) is not None for text in column.words.texts), False])
        return np.asarray(bad[column.words.codes], dtype=np.bool_)
    values = column.values
    if column.problem is not None or not np.isfinite(values).all() or not len(values):
        return None
    different = set(np.unique(values).tolist())
    # Of a number that is called quality, 0 may be the good one.
    if different <= {0.0, 1.0} and _TRUE.search(column.name):
        return np.asarray(values == 0.0, dtype=np.bool_)
    return np.asarray(values < _OPC_UNCERTAIN, dtype=np.bool_) if _OPC_GOOD in different <= _OPC else None
