"""Structures that are known by their fields: saved ``iddata``, ``timeseries``, Simulink's structure with time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sysid.errors import ReaderError
from sysid.ingest.readers.trees.joining import joined_signals
from sysid.ingest.readers.trees.leaves import Leaf, Whole, leaf_of, number_of, refused, texts_of
from sysid.ingest.readers.trees.roles import role_of
from sysid.ingest.readers.trees.stacks import taken_apart
from sysid.ingest.tables.joining import Signal
from sysid.ingest.tables.time_columns import is_called_time

_SECONDS = {
    "": 1.0, "seconds": 1.0, "second": 1.0, "s": 1.0, "sec": 1.0, "milliseconds": 1e-3, "ms": 1e-3,
    "microseconds": 1e-6, "nanoseconds": 1e-9, "minutes": 60.0, "min": 60.0, "hours": 3600.0, "h": 3600.0,
    "days": 86400.0, "weeks": 604800.0, "months": 2629746.0, "years": 31556952.0,
}  # fmt: skip

_NAME, _SAMPLES = ("name", "label", "signalname", "channelname"), ("data", "values", "value", "samples")
_CLOCK = ("time", "t", "raster", "timestamps", "stamps")
_ROWS = 4
"""Rows above which a matrix may have a clock in front."""
_NAMED = {"InputName", "OutputName", "InputUnit", "OutputUnit", "TimeUnit"}


def understood(node: Any, notes: list[str]) -> Any:
    """A tree with the structures that are known replaced by their columns.

    Args:
        node: The tree.
        notes: Where it is told how signals of different clocks are brought together.

    Returns:
        The tree of columns.
    """
    if isinstance(node, list):
        if (records := _records_of_cells(node)) is not None:
            return records
        return _named_signals(node) or [understood(item, notes) for item in node]
    if not isinstance(node, Mapping) or isinstance(node, Whole):
        return node
    for is_one, columns in _FORMS:
        if is_one(node):
            return columns(node)
    node = taken_apart(node, notes) or node
    node = _with_their_clock(node)
    found = {str(key): understood(value, notes) for key, value in node.items()}
    clocked = [str(key) for key, value in node.items() if isinstance(value, Mapping) and _is_clocked(value)]
    return _on_one_clock(found, clocked, notes) if len(clocked) > 1 else found


def _records_of_cells(items: list[Any]) -> list[dict[str, Any]] | None:
    """Cells in cells: a record of nameless columns for each of the outer ones."""
    if not items or not all(isinstance(item, list) and len(item) > 1 for item in items):
        return None
    leaves = [[leaf_of(part) for part in item] for item in items]
    if not all(leaf is not None and leaf.values.dtype.kind in "buif" for row in leaves for leaf in row):
        return None
    return [{f"column_{place + 1}": leaf for place, leaf in enumerate(row)} for row in leaves]


def _with_their_clock(node: Mapping[str, Any]) -> Mapping[str, Any]:
    """Matrices that have the same clock in front of their signals, as Simulink's arrays with time: it is one time."""
    leaves = {str(key): leaf for key, value in node.items() if (leaf := leaf_of(value)) is not None}
    clocked = {
        key: leaf
        for key, leaf in leaves.items()
        if not leaf.vector and not leaf.names and leaf.values.dtype.kind in "uif" and leaf.values.shape[0] > _ROWS
    }
    clocks = [leaf.values[:, 0].astype(np.float64) for leaf in clocked.values()]
    if len(clocks) < 2 or not bool((np.diff(clocks[0]) > 0.0).all()):
        return node
    if any(not np.array_equal(one, clocks[0]) for one in clocks) or any(map(is_called_time, leaves)):
        return node
    if any(role_of(key) or key[-1].isdigit() for key in clocked) or len({key[:-1] or key for key in clocked}) == 1:
        return node  # ze and zv, run1 and run2 are records, of the same columns each
    found: dict[str, Any] = {"time": Leaf(values=clocks[0])}
    for key, value in node.items():
        whole = clocked.get(str(key))
        single = whole is not None and whole.values.shape[1] == 2
        parts = (
            {}
            if whole is None
            else {(key if single else f"{key}_{i + 1}"): whole.values[:, i] for i in range(1, whole.values.shape[1])}
        )
        found |= parts or {str(key): value}
    return found


def _named_signals(items: list[Any]) -> dict[str, Leaf]:
    """Structures with a name and the samples of one signal each, as measurement tools save their channels.

    They may bring their clock, where all have the same. Names that say what records are for are none of signals.
    """
    found, clocks = dict[str, Leaf](), list[Leaf]()
    for item in items:
        fields = {str(key).casefold(): value for key, value in item.items()} if isinstance(item, Mapping) else {}
        name = next((text for key in _NAME for text in texts_of(fields.get(key))), "")
        vectors = {key: leaf for key, value in fields.items() if (leaf := leaf_of(value)) is not None and leaf.vector}
        numbers = {key: leaf for key, leaf in vectors.items() if leaf.values.dtype.kind in "buif"}
        samples = [key for key in _SAMPLES if key in numbers]
        clock = [key for key in _CLOCK if key in numbers]
        if not name or name in found or role_of(name) or len(samples) != 1 or len(numbers) > 1 + len(clock):
            return {}
        unit = next((text for key in ("unit", "units") for text in texts_of(fields.get(key))), None)
        found[name] = replace(numbers[samples[0]], unit=unit or numbers[samples[0]].unit)
        clocks += [numbers[key] for key in clock]
    same = all(np.array_equal(one.values, clocks[0].values) for one in clocks)
    lengths = {len(leaf.values) for leaf in (*found.values(), *clocks)}
    if len(found) < 2 or len(lengths) > 1 or not same or len(clocks) not in {0, len(found)} or "time" in found:
        return {}
    return {**({"time": clocks[0]} if clocks else {}), **found}


def _is_clocked(node: Mapping[str, Any]) -> bool:
    return _is_timeseries(node) or _is_structure_with_time(node)


def _on_one_clock(found: dict[str, Any], clocked: list[str], notes: list[str]) -> dict[str, Any]:
    """Signals that were saved apart, each with a clock of its own, at the stamps of the fastest one.

    Records stay apart: a word in their name says so, they hold the same signals, or are of other times.
    """
    parts = {key: {name: leaf for name, one in found[key].items() if (leaf := leaf_of(one))} for key in clocked}
    clocks = [part["time"].values.astype(np.float64) for part in parts.values() if "time" in part]
    if len(clocks) < len(parts) or any(part["time"].unit != "s" for part in parts.values()):
        return found
    names = [name for part in parts.values() for name in part if name != "time"]
    records = len(set(names)) < len(names) or any(map(role_of, clocked))
    together = max(clock[0] for clock in clocks) < min(clock[-1] for clock in clocks)
    if records or not together or all(np.array_equal(clocks[0], clock) for clock in clocks):
        return found
    signals = [
        Signal(name=key if key == name else f"{key}.{name}", group="", values=column, stamps=clock, unit=leaf.unit)
        for (key, part), clock in zip(parts.items(), clocks, strict=True)
        for name, leaf in part.items()
        for column in np.atleast_2d(leaf.values.T)
        if name != "time" and len(column) == len(clock)
    ]
    columns, told = joined_signals(signals, Path())
    notes += told
    return {**{key: one for key, one in found.items() if key not in clocked}, **columns}


def _is_iddata(node: Mapping[str, Any]) -> bool:
    return "OutputData" in node and ("InputData" in node or "Ts" in node)


def _iddata(node: Mapping[str, Any]) -> Any:
    if texts_of(node.get("Domain"))[:1] in {("Frequency",), ("frequency",)}:
        problem = ReaderError(
            "the file holds frequency-domain data",
            expected="iddata over time",
            got="Domain = 'Frequency'",
            remedy="in MATLAB: z = ifft(z); and save z again",
        )
        return {"OutputData": refused(problem)}
    outputs, inputs = _experiments(node.get("OutputData")), _experiments(node.get("InputData"))
    count = max(len(outputs), len(inputs))
    records = [_experiment(node, _at(inputs, index), _at(outputs, index), index) for index in range(count)]
    if count == 1:
        return records[0]
    names = texts_of(node.get("ExperimentName"))
    return dict(zip(names, records, strict=True)) if len(set(names)) == count else records


def _is_frd(node: Mapping[str, Any]) -> bool:
    return "ResponseData" in node and "Frequency" in node


def _frd(node: Mapping[str, Any]) -> dict[str, Any]:
    """The responses of an ``frd`` or ``idfrd`` that was saved as a structure, an array of outputs, inputs, frequencies.

    Its sample time is the model's, and says nothing of the rows.
    """
    frequency, held = leaf_of(node["Frequency"]), node["ResponseData"]
    values = held.values if isinstance(held, Leaf) else held
    if frequency is None or not isinstance(values, np.ndarray) or values.dtype.kind not in "buifc":
        return {str(key): value for key, value in node.items()}
    said = " ".join(texts_of(node.get("FrequencyUnit", node.get("Units")))) or "rad/TimeUnit"
    unit = {"rad/TimeUnit": "rad/s", "cycles/TimeUnit": "Hz"}.get(said, said)
    if said.endswith("TimeUnit") and _SECONDS.get(" ".join(texts_of(node.get("TimeUnit"))).casefold()) != 1.0:
        unit = ""  # of another unit of time, which a person has to say
    columns: dict[str, Any] = {"Frequency": Leaf(values=frequency.values.reshape(-1), unit=unit or None)}
    if values.ndim != 3 or max(values.shape[:2]) == 1:
        return columns | {"ResponseData": Leaf(values=values.reshape(-1))}
    pairs = np.ndindex(values.shape[:2])
    return columns | {f"ResponseData({i + 1},{j + 1})": Leaf(values=values[i, j]) for i, j in pairs}


def _experiments(value: Any) -> list[Any]:
    return list(value) if isinstance(value, list) else [value]


def _at(values: list[Any], index: int) -> Any:
    return values[index] if index < len(values) else None


def _experiment(node: Mapping[str, Any], inputs: Any, outputs: Any, index: int) -> Whole:
    second = _SECONDS.get(" ".join(texts_of(node.get("TimeUnit"))).casefold())
    record = Whole()
    stamps, step = leaf_of(_of(node, "SamplingInstants", index)), number_of(_of(node, "Ts", index))
    start = number_of(_of(node, "Tstart", index))
    rows = max((_rows(data) for data in (inputs, outputs)), default=0)
    if stamps is not None and len(stamps.values) == rows:
        record["time"] = Leaf(values=stamps.values.astype(float) * (second or 1.0), unit="s")
    elif step is not None and start is not None and np.isfinite(start):
        record["time"] = Leaf(values=(start + step * np.arange(rows)) * (second or 1.0), unit="s")
    elif step is not None:
        record["Ts"] = step * (second or 1.0)
    for letter, kind, data in (("u", "Input", inputs), ("y", "Output", outputs)):
        matrix = data.values if isinstance(data, Leaf) else data
        if not isinstance(matrix, np.ndarray) or matrix.size < 2:
            continue
        matrix = matrix.reshape(-1, 1) if matrix.ndim == 1 or 1 in matrix.shape else matrix
        names, units = texts_of(node.get(f"{kind}Name")), texts_of(node.get(f"{kind}Unit"))
        for column in range(matrix.shape[1]):
            name = names[column] if column < len(names) and names[column] else f"{letter}{column + 1}"
            unit = units[column] if column < len(units) and units[column] else None
            record[name if name not in record else f"{name} ({kind.lower()})"] = Leaf(
                values=matrix[:, column], unit=unit
            )
    return record


def _of(node: Mapping[str, Any], field: str, index: int) -> Any:
    """A field of an ``iddata``, which is a cell of one for each experiment where there are several."""
    value = node.get(field)
    return _at(value, index) if isinstance(value, list) else value


def _rows(data: Any) -> int:
    return (
        max(data.shape)
        if isinstance(data, np.ndarray) and data.ndim == 2 and 1 in data.shape
        else (len(data) if isinstance(data, np.ndarray) and data.ndim else 0)
    )


def _is_plain_iddata(node: Mapping[str, Any]) -> bool:
    return leaf_of(node.get("y")) is not None and not _NAMED.isdisjoint(node)


def _plain_iddata(node: Mapping[str, Any]) -> Any:
    """A structure with the fields that ``iddata`` goes by for short: ``u``, ``y``, ``Ts`` with names and units."""
    stamps = node.get("SamplingInstants", node.get("t", node.get("time")))
    return _iddata({**node, "InputData": node.get("u"), "OutputData": node["y"], "SamplingInstants": stamps})


def _is_timeseries(node: Mapping[str, Any]) -> bool:
    return leaf_of(node.get("Time")) is not None and leaf_of(node.get("Data")) is not None


def _timeseries(node: Mapping[str, Any]) -> Any:
    stamps, data = leaf_of(node["Time"]), leaf_of(node["Data"])
    if stamps is None or data is None:
        return node
    name = next(iter(texts_of(node.get("Name"))), "") or "Data"
    info = node.get("DataInfo")
    unit = next(iter(texts_of(info.get("Units"))), None) if isinstance(info, Mapping) else None
    about = node.get("TimeInfo")
    clock = next(iter(texts_of(about.get("Units"))), "s") if isinstance(about, Mapping) else "s"
    second = _SECONDS.get(clock.casefold())
    return {
        "time": Leaf(values=stamps.values * second if second else stamps.values, unit="s" if second else clock),
        name: Leaf(values=data.values, unit=unit or data.unit or None),
    }


def _is_structure_with_time(node: Mapping[str, Any]) -> bool:
    signals = node.get("signals")
    each = signals if isinstance(signals, list) else [signals]
    return "time" in node and any(isinstance(one, Mapping) and "values" in one for one in each)


def _structure_with_time(node: Mapping[str, Any]) -> Any:
    signals = node["signals"] if isinstance(node["signals"], list) else [node["signals"]]
    columns: dict[str, Any] = {}
    if (stamps := leaf_of(node["time"])) is not None:
        columns["time"] = Leaf(values=stamps.values, unit="s")
    for index, signal in enumerate(signals):
        if isinstance(signal, Mapping) and "values" in signal:
            label = next(iter(texts_of(signal.get("label"))), "") or f"signal_{index + 1}"
            columns[label if label not in columns else f"{label} ({index + 1})"] = signal["values"]
    return columns


_FORMS: tuple[tuple[Callable[[Mapping[str, Any]], bool], Callable[[Mapping[str, Any]], Any]], ...] = (
    (_is_frd, _frd),
    (_is_iddata, _iddata),
    (_is_plain_iddata, _plain_iddata),
    (_is_timeseries, _timeseries),
    (_is_structure_with_time, _structure_with_time),
)
"""By what a structure is known, and the columns it stands for."""
