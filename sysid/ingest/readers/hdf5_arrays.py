"""HDF5 and netCDF: every array of one or two dimensions, by the conventions CF of netCDF.

Attributes say the unit (``units``), how numbers are packed (``scale_factor``, ``add_offset``) and what stands
for a missing one (``_FillValue``, ``missing_value``). netCDF 3 is read by SciPy, netCDF 4 is HDF5.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.extras import need
from sysid.ingest.readers.bounds import check_claim
from sysid.ingest.readers.late import table_of
from sysid.ingest.readers.marks import NETCDF_3
from sysid.ingest.readers.reader import damaged
from sysid.ingest.readers.trees.leaves import Leaf, step_in
from sysid.ingest.tables.options import FileOptions
from sysid.ingest.tables.table import RawTable
from sysid.units import Reference

_CF = {"scale_factor", "add_offset"}
_LIKE_SCALES = re.compile(
    r"(?:.*[_ .])?(?:gain|offset|scale|scaling|factor|slope|intercept|sensitivity|lsb|bias)(?:[_ .]?(?:factor|value))?",
    re.IGNORECASE,
)
_SINCE = re.compile(r"\s*(\w+)\s+since\s+(.+)", re.IGNORECASE | re.DOTALL)
_POWERS = re.compile(r"(?=.*\d)[A-Za-z]+(?:-?[1-9])?(?: [A-Za-z]+(?:-?[1-9])?)*")
_COLUMN_NAMES = ("columns", "column_names", "channel_names", "channels", "names")
_DAMAGES = (OSError, RuntimeError, ValueError, KeyError, TypeError, AttributeError)
"""What h5py raises on damaged files."""


def read(path: Path, options: FileOptions) -> RawTable:
    """The arrays of an HDF5 or netCDF file.

    Args:
        path: The file.
        options: How it is read.

    Returns:
        The table, or its records.

    Raises:
        ReaderError: If it is damaged, or holds no columns.
    """
    with path.open("rb") as file:
        classic = file.read(3) == NETCDF_3
    tree, metadata, notes = _classic_tree(path) if classic else _hdf5_tree(path)
    return table_of(
        tree, path=path, reader="hdf5", options=options, separator="/", short=False, metadata=metadata, notes=notes
    )


def check_claims(path: Path) -> None:
    """Refuse a file whose arrays claim more than a file may hold.

    Args:
        path: The file.

    Raises:
        ReaderError: If they do, or it is no whole HDF5 file.
    """
    need("h5py", f"reading {path.name}")
    import h5py

    shapes: list[tuple[str, tuple[int, ...]]] = []

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.shape is not None:
            shapes.append((name, (*item.shape, len(item.dtype.names or ()) or 1)))

    try:
        with h5py.File(path, "r") as file:
            file.visititems(visit)
    except _DAMAGES as error:
        raise damaged(path, "HDF5", error) from error
    check_claim(path, shapes)


def is_of_matlab(path: Path) -> bool:
    """Whether an HDF5 file was written by MATLAB.

    Args:
        path: The file.

    Returns:
        True if all of its variables say so.
    """
    need("h5py", f"reading {path.name}")
    import h5py

    try:
        with h5py.File(path, "r") as file:
            items = [item for name, item in file.items() if not name.startswith("#")]
            return bool(items) and all("MATLAB_class" in item.attrs for item in items)
    except _DAMAGES as error:
        raise damaged(path, "HDF5", error) from error


def _hdf5_tree(path: Path) -> tuple[dict[str, Any], dict[str, str], list[str]]:
    need("h5py", f"reading {path.name}")
    import h5py

    check_claims(path)
    notes: list[str] = []
    try:
        with h5py.File(path, "r") as file:
            text = _text(file.attrs.get("sysid"))
            tree = _group(file, notes, seen=set())
            return _lone_table(tree) or tree, {"sysid": text} if text else {}, notes
    except _DAMAGES as error:
        raise damaged(path, "HDF5", error) from error


class _Table(dict[str, Any]):
    """The fields of one data set."""


def _lone_table(tree: Any) -> _Table | None:
    """The table of a file that holds nothing else."""
    while isinstance(tree, dict) and not isinstance(tree, _Table):
        inner = [value for value in tree.values() if isinstance(value, dict)]
        if len(inner) != 1 or any(isinstance(value, Leaf) for value in tree.values()):
            return None
        tree = inner[0]
    return tree if isinstance(tree, _Table) else None


def _group(group: Any, notes: list[str], seen: set[int]) -> dict[str, Any]:
    import h5py

    tree: dict[str, Any] = {}
    steps = {key: group.attrs[key] for key in group.attrs if np.size(group.attrs[key]) == 1}
    tree.update({f"{key}": value for key, value in steps.items() if isinstance(value, np.generic | int | float)})
    for name in group:
        if isinstance(group.get(name, getlink=True), h5py.ExternalLink):
            continue  # what another file holds is not asked for
        item = group.get(name)
        identity = h5py.h5o.get_info(item.id).addr if item is not None else 0
        if isinstance(item, h5py.Group) and identity not in seen:  # a link may lead back
            tree[name] = _group(item, notes, seen | {identity})
        elif isinstance(item, h5py.Dataset):
            tree[name] = _dataset(name, item, notes)
    return tree


def _dataset(name: str, item: Any, notes: list[str]) -> Any:
    if item.shape is None or item.is_virtual or item.external:
        return None
    if item.dtype.names:  # a table: one column per field
        table = item[()]
        read = {field: _numbers_or_words(table[field], item.dtype[field]) for field in item.dtype.names}
        return _Table({field: array for field, array in read.items() if array is not None})
    if item.dtype.kind not in "buif":
        words = _numbers_or_words(item[()], item.dtype)
        return None if words is None else Leaf(values=words)
    attributes = {key: item.attrs[key] for key in item.attrs if _is_said(key)}
    leaf = _leaf(name, np.asarray(item[()]), attributes, notes)
    names, units = _texts(attributes, _COLUMN_NAMES), _texts(attributes, ("units", "unit"))
    return replace(leaf, names=names, units=units if len(units) > 1 else ())


def _numbers_or_words(array: Any, kind: np.dtype[Any]) -> NDArray[Any] | None:
    """Numbers as they are, text as strings, and nothing of references, enumerations and blobs."""
    import h5py

    if kind.kind in "buif" or h5py.check_string_dtype(kind) is None or np.ndim(array) != 1:
        return np.asarray(array) if kind.kind in "buif" else None
    return np.array([_text(cell) or "" for cell in array], dtype=np.str_)


def _texts(attributes: Mapping[str, Any], keys: Sequence[str]) -> tuple[str, ...]:
    """The texts of the first attribute of some names; none where they are no texts."""
    found = next((np.ravel(attributes[key]) for key in keys if key in attributes), ())
    texts = [_text(text) for text in found]
    return () if None in texts else tuple(map(str, texts))


def _is_said(key: str) -> bool:
    # Others may be references that only the library that wrote them follows.
    return key in _COLUMN_NAMES or step_in(key, 1.0) is not None or key in {
        "units", "unit", "description", "long_name", "reference", "scale_factor", "add_offset", "_FillValue",
        "missing_value", "valid_min", "valid_max", "valid_range", "standard_name", "_Unsigned",
    } or _LIKE_SCALES.fullmatch(key) is not None  # fmt: skip


def _classic_tree(path: Path) -> tuple[dict[str, Any], dict[str, str], list[str]]:
    from scipy.io import netcdf_file

    notes: list[str] = []
    tree: dict[str, Any] = {}
    try:
        with netcdf_file(path, "r", mmap=False) as file:
            check_claim(path, ((name, variable.shape) for name, variable in file.variables.items()))
            for name, variable in file.variables.items():
                attributes = dict(variable._attributes)
                array = np.asarray(variable.data)
                if array.dtype.kind in "buif":
                    tree[name] = _leaf(name, array.astype(array.dtype.newbyteorder("=")), attributes, notes)
            number = {key: value for key, value in file._attributes.items() if np.size(value) == 1}
            tree |= {key: value for key, value in number.items() if isinstance(value, np.generic | int | float)}
    except ReaderError:
        raise
    except Exception as error:  # SciPy raises TypeError, ValueError, KeyError, struct errors ... on damaged files
        raise damaged(path, "netCDF", error) from error
    return tree, {}, notes


def _leaf(name: str, array: NDArray[Any], attributes: Mapping[str, Any], notes: list[str]) -> Leaf:
    unit = _text(attributes.get("units")) or _text(attributes.get("unit"))
    reference = _text(attributes.get("reference"))
    since = _SINCE.fullmatch(unit) if unit else None
    if since is not None:
        unit = since[1]
        notes.append(f"{name}: {since[1]} since {since[2].strip()}")
    unit = _cf_unit(unit) if unit else None
    if array.size == 1:
        return Leaf(values=_unpacked(name, array, attributes, notes))
    return Leaf(
        values=_unpacked(name, array, attributes, notes),
        unit=unit,
        reference=Reference(reference) if reference in {item.value for item in Reference} else None,
        description=_text(attributes.get("description")) or _text(attributes.get("long_name")) or "",
        step=next((step for key, value in attributes.items() if (step := step_in(key, _number(value)))), None),
    )


def _cf_unit(unit: str) -> str:
    """A unit in the words of CF, ``kg m-3``, as it is written elsewhere: ``kg * m**-3``."""
    if not _POWERS.fullmatch(unit):
        return unit
    return " * ".join(re.sub(r"(?<=[A-Za-z])(-?\d+)$", r"**\1", part) for part in unit.split())


def _unpacked(name: str, array: NDArray[Any], attributes: Mapping[str, Any], notes: list[str]) -> NDArray[Any]:
    """The values that packed numbers stand for, NaN for missing ones."""
    if _text(attributes.get("_Unsigned")) == "true" and array.dtype.kind == "i":
        array = array.view(array.dtype.str.replace("i", "u"))
    stand_ins = [
        value for key in ("_FillValue", "missing_value") for value in np.atleast_1d(attributes.get(key, []))
        if np.asarray(value).dtype.kind in "buif"
    ]  # fmt: skip
    scale, offset = (_number(attributes.get(key)) for key in ("scale_factor", "add_offset"))
    bounds = _valid(attributes)
    other = {key: _number(attributes[key]) for key in attributes if key not in _CF and _LIKE_SCALES.fullmatch(key)}
    if any(value is not None and value not in {0.0, 1.0} for value in other.values()):
        told = ", ".join(f"{key} = {value:g}" for key, value in other.items() if value is not None)
        notes.append(f"{name}: {told} beside it: not applied, as no convention says how it is meant")
    if not stand_ins and scale is None and offset is None and bounds is None:
        return array
    missing = np.zeros(array.shape, dtype=np.bool_)
    for value in stand_ins:
        missing |= _stands_for(array, np.asarray(value))
    if bounds is not None:
        missing |= (array < bounds[0]) | (array > bounds[1])
    values = array.astype(np.float64)
    if scale is not None or offset is not None:
        values = values * (1.0 if scale is None else scale) + (0.0 if offset is None else offset)
        told = f"counts * {1.0 if scale is None else scale:g} + {0.0 if offset is None else offset:g}"
        notes.append(f"{name}: unpacked as {told} (CF attributes)")
    if missing.any():
        values[missing] = np.nan
    return values


def _stands_for(array: NDArray[Any], value: NDArray[Any]) -> NDArray[np.bool_]:
    """Where a stand-in is; one of the attributes may have fewer digits than the values: 1e20 is 1.00000002e20 then."""
    if array.dtype.kind != "f" or value.dtype.kind != "f":
        return np.asarray(array == value.astype(array.dtype))
    fewest = max(np.finfo(array.dtype).eps, np.finfo(value.dtype).eps)
    return np.asarray((np.abs(array - value.astype(np.float64)) <= fewest * abs(float(value))) | (array == value))


def _valid(attributes: Mapping[str, Any]) -> tuple[float, float] | None:
    span = np.atleast_1d(attributes.get("valid_range", []))
    low = span[0] if len(span) == 2 else attributes.get("valid_min")
    high = span[1] if len(span) == 2 else attributes.get("valid_max")
    if low is None and high is None:
        return None
    return (-np.inf if low is None else float(np.ravel(low)[0]), np.inf if high is None else float(np.ravel(high)[0]))


def _number(value: Any) -> float | None:
    array = np.atleast_1d(value) if value is not None else np.zeros(0)
    return float(array[0]) if array.size == 1 and array.dtype.kind in "buif" else None


def _text(value: Any) -> str | None:
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.reshape(-1)[0]
    if isinstance(value, bytes):
        return value.decode("utf-8", errors="replace")
    return str(value) if isinstance(value, str) else None
