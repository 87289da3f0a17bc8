"""MATLAB files: version 4 to 7.2 through SciPy, version 7.3 (which is HDF5) through pymatreader.

MATLAB's own objects (``timeseries``, ``table``, ``datetime``, Simulink data sets) are stored in a form
that only MATLAB reads: they are refused with the line that exports them as plain arrays.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from sysid.errors import ReaderError
from sysid.ingest.options import FileOptions, RepairOptions
from sysid.ingest.readers.nested import columns_of
from sysid.ingest.readers.reader import Reader, damaged
from sysid.ingest.table import RawColumn, RawTable, of_one_length, recognise_time

_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_PLAIN = {"double", "single", "logical", "char", "struct", "cell", "sparse"} | {
    f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)
}


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    with path.open("rb") as file:
        head = file.read(520)
    version_73 = _HDF5_SIGNATURE in (head[:8], head[512:520])
    opaque, tree = _load_73(path) if version_73 else _load_5(path)
    columns = columns_of(tree, where=str(path), group=options.group)
    columns += [_refused(name, kind, path) for name, kind in opaque.items()]
    columns_alike = of_one_length(columns, where=str(path))
    return RawTable(source=path, reader="matlab", columns=columns_alike, time=recognise_time(columns_alike))


READER = Reader(name="matlab", suffixes=(".mat",), read=_read, options=frozenset({"group"}))


def _load_5(path: Path) -> tuple[dict[str, str], dict[str, Any]]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatlabFunction, MatlabObject, MatlabOpaque, MatReadWarning

    try:
        with warnings.catch_warnings():
            # SciPy gives every object the name None, and warns when there are two.
            warnings.simplefilter("ignore", MatReadWarning)
            loaded = loadmat(path, simplify_cells=True)
    except Exception as error:  # SciPy raises ValueError, TypeError, zlib.error and more on damaged files
        raise damaged(path, "MATLAB", error) from error
    opaque: dict[str, str] = {}
    tree: dict[str, Any] = {}
    for name, value in loaded.items():
        if isinstance(value, MatlabOpaque):
            record = value.reshape(-1)[0]
            opaque[_text(record["s0"])] = _text(record["s2"])
        elif isinstance(value, MatlabObject | MatlabFunction):
            opaque[name] = str(getattr(value, "classname", "function_handle"))
        elif not name.startswith("__"):
            tree[name] = value
    return opaque, tree


def _text(value: Any) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)


def _load_73(path: Path) -> tuple[dict[str, str], dict[str, Any]]:
    import h5py
    from pymatreader import read_mat

    try:
        with h5py.File(path, "r") as file:
            kinds = {name: _kind_73(item) for name, item in file.items() if not name.startswith("#")}
        plain = [name for name, kind in kinds.items() if kind in _PLAIN]
        tree = read_mat(str(path), variable_names=plain) if plain else {}
    except (OSError, KeyError, ValueError, RuntimeError) as error:
        raise damaged(path, "MATLAB 7.3", error) from error
    return {name: kind for name, kind in kinds.items() if kind not in _PLAIN}, tree


def _kind_73(item: Any) -> str:
    kind = item.attrs.get("MATLAB_class", b"double")
    text = kind.decode() if isinstance(kind, bytes) else str(kind)
    # An object may call itself what it likes; this attribute says how it is stored.
    return f"object {text}" if item.attrs.get("MATLAB_object_decode", 0) else text


def _refused(name: str, kind: str, path: Path) -> RawColumn:
    problem = ReaderError(
        f"the variable {name} is a MATLAB object, which only MATLAB can read",
        where=path,
        expected="plain numeric arrays, or structures of them",
        got=f"class {kind}",
        remedy="in MATLAB, for a timeseries ts: t = ts.Time; u = ts.Data; save('plain.mat', 't', 'u'); "
        "for a table T: s = table2struct(T, 'ToScalar', true); save('plain.mat', '-struct', 's')",
    )
    return RawColumn(name=name, values=np.full(1, np.nan), problem=problem)
