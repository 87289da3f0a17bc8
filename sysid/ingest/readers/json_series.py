"""Answers of data bases of time series (Prometheus, Grafana): a name each, and pairs of stamp and value."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_PAIRS = ("values", "datapoints", "value")
_MILLISECONDS = 1e11
"""From here on a stamp counts milliseconds since 1970."""


def series_in(node: Any) -> Any:
    """What an answer holds, as rows or columns by name; the same where it is none of such.

    Series of the same stamps are columns behind them; others are rows of time, signal and value.

    Args:
        node: JSON as it was read.

    Returns:
        The columns, or the rows.
    """
    items = node
    if isinstance(node, Mapping) and isinstance(node.get("data"), Mapping):
        items = node["data"].get("result")
    if not isinstance(items, list) or not items or not all(isinstance(item, Mapping) for item in items):
        return node
    found = [(name, pairs) for item in items if (name := _name(item)) and (pairs := _pairs(item))]
    names = [name for name, _ in found]
    if len(found) < len(items) or len(set(names)) < len(names):
        return node
    stamps = [[stamp for stamp, _ in pairs] for _, pairs in found]
    if all(one == stamps[0] for one in stamps):
        return {"time": stamps[0], **{name: [value for _, value in pairs] for name, pairs in found}}
    return [{"time": t, "signal": name, "value": value} for name, pairs in found for t, value in pairs]


def _name(item: Mapping[str, Any]) -> str:
    """What a series is called: its target, or its metric with what tells it from others."""
    metric = item.get("metric")
    if not isinstance(metric, Mapping):
        return item["target"] if isinstance(item.get("target"), str) else ""
    labels = ",".join(f"{key}={text}" for key, text in metric.items() if key != "__name__")
    name = str(metric.get("__name__", ""))
    return f"{name}{{{labels}}}" if name and labels else name or labels


def _pairs(item: Mapping[str, Any]) -> list[tuple[float, Any]]:
    """Stamp and value, in the order of Prometheus or of Grafana; none where they are not pairs of numbers."""
    rows: list[Any] = next((item[key] for key in _PAIRS if isinstance(item.get(key), list)), [])
    if not rows or not all(isinstance(row, list) and len(row) == 2 for row in rows):
        return []
    grafana = "datapoints" in item
    pairs = [(row[1], row[0]) if grafana else (row[0], row[1]) for row in rows]
    if not all(isinstance(stamp, int | float) for stamp, _ in pairs):
        return []
    late = all(stamp >= _MILLISECONDS for stamp, _ in pairs)
    found = [(stamp / 1000.0 if late else stamp, _number(value)) for stamp, value in pairs]
    return [] if any(isinstance(value, str) for _, value in found) else found


def _number(value: Any) -> Any:
    """A value as a number; Prometheus writes texts, so that NaN can be one of them."""
    if not isinstance(value, str):
        return value
    try:
        return float(value)
    except ValueError:
        return value
