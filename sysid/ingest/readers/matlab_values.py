"""MATLAB files of versions 4 to 7.3, by mat-io: arrays, structures, cells, saved ``iddata``, tables, time tables.

Objects whose fields nobody but MATLAB can make sense of are refused with the line that exports them as plain arrays.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Set
from pathlib import Path
from typing import Any

import numpy as np

from sysid.errors import ReaderError
from sysid.extras import need
from sysid.ingest.readers.bounds import check_claim
from sysid.ingest.readers.late import table_of
from sysid.ingest.readers.modelica import is_result, result_tree
from sysid.ingest.readers.reader import damaged
from sysid.ingest.readers.trees.leaves import Leaf, number_of, refused
from sysid.ingest.tables.options import FileOptions
from sysid.ingest.tables.table import RawTable

_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_OBJECT = 0xDD000000
_HEAD = 2
_NOT_NUMBERS = {"cell", "struct", "char", "function_handle", "opaque", "object"}


def read(path: Path, options: FileOptions) -> RawTable:
    """The table of a MATLAB file.

    Args:
        path: The file.
        options: How it is read.

    Returns:
        The columns in its variables.

    Raises:
        ReaderError: If nothing in it can be columns.
        MissingExtraError: If the package that opens it is not installed.
    """
    if _is_hdf5(path):
        from sysid.ingest.readers import hdf5_arrays  # here: most files are none of such

        hdf5_arrays.check_claims(path)
        if not hdf5_arrays.is_of_matlab(path):
            return hdf5_arrays.read(path, options)
    variables = _load(path)
    notes = []
    if is_result(variables):
        tree: Mapping[str, Any] = result_tree(variables, path)
        notes.append("simulation result of Dymola or OpenModelica")
    else:
        tree = {name: _node(value, name, path) for name, value in variables.items()}
    return table_of(tree, path=path, reader="matlab", options=options, notes=notes)


def _is_hdf5(path: Path) -> bool:
    with path.open("rb") as file:
        head = file.read(520)
    return _HDF5_SIGNATURE in (head[:8], head[512:520])


def _load(path: Path) -> dict[str, Any]:
    need("matio", f"reading {path.name}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it sets an option of pandas that is on its way out
        from matio import load_from_mat

        from sysid.ingest.readers.mat5_check import check_mat5

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what it cannot read comes back as an object, which is refused by name
            check_mat5(path)
            there = _listed(path)
            check_claim(path, ((name, shape) for name, (shape, kind) in there.items() if kind not in _NOT_NUMBERS))
            try:
                loaded = load_from_mat(path, add_table_attrs=True)
            except (NotImplementedError, ValueError, KeyError, TypeError, AttributeError):
                loaded = _one_by_one(path, there, load_from_mat)
    except ReaderError:
        raise
    except Exception as error:  # mat-io raises ValueError, TypeError, zlib.error, struct.error ... on damaged files
        raise damaged(path, "MATLAB", error) from error
    return {
        name: refused(_only_matlab(name, str(there[name][1]), path)) if _is_reference(value) else value
        for name, value in loaded.items()
        if not name.startswith("__")
    }


def _listed(path: Path) -> Mapping[str, Any]:
    """Shape and class of every variable."""
    from matio import whosmat

    try:
        found: Mapping[str, Any] = whosmat(path)
    except AttributeError:  # of what Simulink streams into a file of version 7.3, which is a group of HDF5
        from h5py import Dataset, File

        with File(path) as file:
            held = {name: one for name, one in file.items() if isinstance(one, Dataset)}
            kinds = {name: one.attrs.get("MATLAB_class", b"").decode() for name, one in held.items()}
            return {name: (one.shape[::-1], kinds[name]) for name, one in held.items()}
    return found


def _is_reference(value: Any) -> bool:
    """Whether an array only points to an object that the file does not hold in a form that is known."""
    return (
        isinstance(value, np.ndarray) and value.dtype == np.uint32 and value.size > 1 and int(value.flat[0]) == _OBJECT
    )


def _one_by_one(path: Path, there: Mapping[str, Any], load: Callable[..., dict[str, Any]]) -> dict[str, Any]:
    """Every variable that can be read, where one of them cannot."""
    found: dict[str, Any] = {}
    for name, (_, kind) in there.items():
        try:
            found.update(load(path, variable_names=[name], add_table_attrs=True))
        except Exception as error:  # noqa: BLE001 - as above; only this variable is lost
            found[name] = refused(_only_matlab(name, str(kind), path, error))
    if all(isinstance(value, Leaf) for name, value in found.items() if not name.startswith("__")):
        raise next(value.problem for value in found.values() if isinstance(value, Leaf) and value.problem)
    return found


def _node(value: Any, name: str, path: Path) -> Any:
    """What mat-io makes of a variable, as a tree."""
    from matio.utils.matclass import MatlabFunction, MatlabOpaque

    if isinstance(value, MatlabOpaque):
        return _object(value, name, path)
    if isinstance(value, MatlabFunction):
        return None
    if hasattr(value, "toarray"):
        return _sparse(value, name, path)
    if hasattr(value, "columns") and hasattr(value, "index"):
        return _frame(value)
    return _array(value, name, path) if isinstance(value, np.ndarray) else value


def _array(value: Any, name: str, path: Path) -> Any:
    if _is_reference(value):
        return refused(_only_matlab(name, "unknown", path))
    if value.dtype.names is not None:
        records = [
            {field: _node(record[field], field, path) for field in value.dtype.names}
            for record in value.reshape(-1, order="F")
        ]
        return records[0] if len(records) == 1 else records
    if value.dtype.kind in "US":
        texts = [str(text).replace("\0", "").rstrip() for text in value.reshape(-1)]
        return texts[0] if len(texts) == 1 else texts
    if value.dtype.kind == "O" and (table := _table_of_cells(value, path)) is not None:
        return table
    if value.dtype.kind == "O":
        return [_node(item, name, path) for item in value.reshape(-1, order="F")]
    return value


def _table_of_cells(value: Any, path: Path) -> dict[str, Any] | None:
    """A cell array that is a sheet, as ``readcell`` and ``xlsread`` leave it: names above numbers of one each."""
    if value.ndim != 2 or value.shape[0] <= _HEAD or value.shape[1] < 2:
        return None
    head = [_node(cell, "", path) for cell in value[0]]
    if not all(isinstance(name, str) and name for name in head) or len(set(head)) < len(head):
        return None
    numbers = [[number_of(_node(cell, "", path)) for cell in row] for row in value[1:]]
    if any(number is None for row in numbers for number in row):
        return None
    return dict(zip(head, np.array(numbers, dtype=np.float64).T, strict=True))


def _is_known(kind: object, fields: Set[str]) -> bool:
    """Whether an object is of a form that is read: a time series, an ``iddata``, or what holds the samples of one."""
    forms: tuple[Set[str], ...] = ({"Data", "TimeInfo"}, {"Data", "Time"}, {"OutputData"})
    return str(kind).startswith("tsdata.") or any(form <= fields for form in forms)


def _object(value: Any, name: str, path: Path) -> Any:
    """An object of a class: one of the forms that are known by their fields, else refused."""
    properties = value.properties
    if isinstance(properties, np.ndarray) and properties.size == 1:
        properties = properties.reshape(-1)[0]
    # Objects of other classes may hold one another, round and round: they are not walked through.
    if isinstance(properties, Mapping) and _is_known(value.classname, {str(key).strip("_") for key in properties}):
        fields = {str(key).strip("_"): _node(item, str(key), path) for key, item in properties.items()}
        if "Data" in fields and isinstance(fields.get("TimeInfo"), Mapping):
            fields.setdefault("Time", _clock(fields["TimeInfo"], fields["Data"]))
        return fields
    return refused(_only_matlab(name, str(value.classname), path))


def _clock(about: Mapping[str, Any], data: Any) -> Any:
    """The time stamps of a timeseries, which may be said by a start and a step alone."""
    stamps, step, start = about.get("Time"), number_of(about.get("Increment")), number_of(about.get("Start"))
    if (isinstance(stamps, np.ndarray) and stamps.size) or step is None or not np.isfinite(step):
        return stamps
    return (start or 0.0) + step * np.arange(max(np.shape(data), default=0))


def _sparse(value: Any, name: str, path: Path) -> Any:
    check_claim(path, [(name, value.shape)])
    return value.toarray()


def _frame(frame: Any) -> dict[str, Any]:
    """A table or a time table, with the units of its variables."""
    columns: dict[str, Any] = {}
    units = frame.attrs.get("VariableUnits", frame.attrs.get("varUnits", []))
    if frame.index.dtype.kind in "Mm":
        taken = any(str(name).casefold() == "time" for name in frame.columns)
        columns["row times" if taken else "time"] = _stamps(frame.index)
    for at, key in enumerate(frame.columns):
        values = frame[key].to_numpy()
        unit = str(units[at]) if at < len(units) and units[at] else None
        columns[str(key)] = _stamps(values) if values.dtype.kind in "Mm" else Leaf(values=values, unit=unit)
    return columns


def _stamps(stamps: Any) -> Leaf:
    values = np.asarray(stamps)
    if values.dtype.kind == "m":
        return Leaf(values=values / np.timedelta64(1, "ns") / 1e9, unit="s")
    return Leaf(values=values, unit="s")


def _only_matlab(name: str, kind: str, path: Path, error: Exception | None = None) -> ReaderError:
    return ReaderError(
        f"the variable {name} is a MATLAB object, which only MATLAB can read",
        where=path,
        expected="plain numeric arrays, structures, cells, iddata, tables",
        got=f"class {kind}" + (f" ({error})" if error is not None else ""),
        remedy="in MATLAB, for a timeseries ts: t = ts.Time; u = ts.Data; save('plain.mat', 't', 'u'); "
        "for a Simulink Dataset d: ts = d{1}.Values; "
        "for a table T: s = table2struct(T, 'ToScalar', true); save('plain.mat', '-struct', 's'); "
        "for iddata z: u = z.u; y = z.y; Ts = z.Ts; save('plain.mat', 'u', 'y', 'Ts')",
    )
