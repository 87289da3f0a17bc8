"""Simulation results of Dymola and OpenModelica: trajectories by variable name in a MATLAB 4 file.

The file holds matrices of trajectories (``data_1`` for what is constant, ``data_2`` ...), and an index that
says for each name in which matrix and column it stands; a negative column is the variable with its sign changed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.readers.trees.leaves import Leaf

_UNIT = re.compile(r"\[\s*([^\[\]|:#]+?)\s*(?:[|:#][^\[\]]*)?\]\s*$")


def is_result(variables: Mapping[str, Any]) -> bool:
    """Whether the variables of a MATLAB file are a simulation result.

    Args:
        variables: Names to arrays.

    Returns:
        True if they are.
    """
    known = {"name", "dataInfo", "data_2"} <= set(variables) or {"names", "data"} <= set(variables)
    return known and any(key.casefold() == "aclass" for key in variables)


def result_tree(variables: Mapping[str, Any], path: Path) -> dict[str, Leaf]:
    """The trajectories of a simulation result.

    Args:
        variables: Names to arrays, texts as rows of characters.
        path: The file, for errors.

    Returns:
        Time and the variables that change by name, then what is constant.

    Raises:
        ReaderError: If the index does not fit the matrices.
    """
    try:
        return _trajectories(variables) if "dataInfo" in variables else _plotted(variables)
    except (IndexError, KeyError, ValueError, TypeError) as error:
        raise ReaderError(
            "the index of a simulation result does not fit its matrices",
            where=path,
            expected="a result file of Dymola or OpenModelica: name, description, dataInfo, data_1, data_2",
            got=f"{type(error).__name__}: {error}",
            remedy="simulate again, or export the result as CSV in the simulation tool",
        ) from error


def _trajectories(variables: Mapping[str, Any]) -> dict[str, Leaf]:
    kind = next(value for key, value in variables.items() if key.casefold() == "aclass")
    transposed = _is_transposed(kind)
    index = np.asarray(variables["dataInfo"])
    index = (index.T if transposed else index).astype(np.int64)
    names = _texts(variables["name"], len(index), transposed=transposed, first=lambda text: text.casefold() == "time")
    about = [""] * len(index)
    key = next((key for key in variables if key.casefold().startswith("descri")), None)
    if key is not None:
        about = _texts(variables[key], len(index), transposed=transposed, first=lambda text: "time" in text.casefold())
    tables = {
        int(key[5:]): (value.T if transposed else value)
        for key, value in variables.items()
        if re.fullmatch(r"data_\d+", key) and isinstance(value, np.ndarray) and value.ndim == 2
    }
    # What all trajectories share is the abscissa of the matrix of trajectories.
    rows = len(tables[2])
    moving: dict[str, Leaf] = {}
    still: dict[str, Leaf] = {}
    for name, text, (table, place) in zip(names, about, index[:, :2].tolist(), strict=True):
        matrix = tables[table or 2]
        values = np.sign(place) * matrix[:, abs(place) - 1] if place else matrix[:, 0]
        unit, said = _unit(text)
        if table != 1 and len(values) == rows:
            unit = unit or ("s" if not moving and name.casefold() == "time" else None)
            moving[name] = Leaf(values=values, unit=unit, description=said, names=(name,))
        else:
            constant = float(values[0])
            aside = f"a parameter, {constant:g} throughout"
            still[name] = Leaf(values=np.full(rows, constant), unit=unit, description=said, aside=aside, names=(name,))
    return moving | still


def _plotted(variables: Mapping[str, Any]) -> dict[str, Leaf]:
    """What Dymola saves of the variables that are plotted: names and one matrix."""
    kind = next(value for key, value in variables.items() if key.casefold() == "aclass")
    transposed = _is_transposed(kind)
    matrix = variables["data"].T if transposed else variables["data"]
    names = _texts(
        variables["names"], matrix.shape[1], transposed=transposed, first=lambda text: text.casefold() == "time"
    )
    units = ["s" if name.casefold() == "time" else None for name in names]
    return {
        name: Leaf(values=matrix[:, at], unit=unit, names=(name,))
        for at, (name, unit) in enumerate(zip(names, units, strict=True))
    }


def _is_transposed(kind: Any) -> bool:
    return "bintrans" in "".join(_characters(kind).reshape(-1).tolist()).casefold()


def _unit(text: str) -> tuple[str | None, str]:
    match = _UNIT.search(text)
    return (match[1], text[: match.start()].strip()) if match else (None, text.strip())


def _characters(texts: Any) -> NDArray[np.str_]:
    rows = [str(text) for text in np.asarray(texts).reshape(-1)]
    width = max((len(row) for row in rows), default=0)
    return np.array([list(row.ljust(width)) for row in rows], dtype=np.str_).reshape(len(rows), width)


def _texts(value: Any, count: int, *, transposed: bool, first: Any) -> list[str]:
    """The texts in a matrix of characters, which tools have laid out in more ways than one.

    The first is known to speak of time: of the layouts that give as many texts as there are variables, the
    one in which it does is right.
    """
    characters = _characters(value)
    flat = "".join(characters.reshape(-1).tolist())
    upright = ["".join(row) for row in characters.tolist()]
    lying = ["".join(row) for row in characters.T.tolist()]
    cut = [flat[at * (len(flat) // count) : (at + 1) * (len(flat) // count)] for at in range(count)]
    layouts = [layout for layout in ((lying, upright) if transposed else (upright, lying)) if len(layout) == count]
    cleaned = [[text.replace("\0", " ").strip() for text in layout] for layout in (*layouts, cut)]
    return next((layout for layout in cleaned if first(layout[0])), cleaned[0])
