"""Traces out to files that our readers read back exactly."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.atomic import replacing
from sysid.errors import ConfigError, UserError
from sysid.extras import need
from sysid.ingest.cells.headers import parse_header
from sysid.names import csv_cell
from sysid.traces import Channel, Trace
from sysid.units import Reference
from sysid.written_units import plain_unit

TAKEN = ("time", "usable")
"""Names of columns that are no channels."""


def write_trace(trace: Trace, path: str | Path) -> Path:
    """Write a trace to a file; its ending says which format.

    Args:
        trace: The trace.
        path: Ending in ``.csv`` or ``.parquet``.

    Returns:
        The path.

    Raises:
        ConfigError: If the ending is another.
        UserError: If the file cannot be written, or a CSV header cannot hold a channel's name.
    """
    path = Path(path)
    writers = {".csv": write_csv, ".parquet": write_parquet}
    if path.suffix.lower() not in writers:
        raise ConfigError(
            "no writer knows this kind of file",
            where=path,
            expected=f"a name that ends in {' or '.join(writers)}",
            got=path.suffix or "a name without an ending",
            remedy="change the ending",
        )
    return writers[path.suffix.lower()](trace, path)


def write_csv(trace: Trace, path: str | Path, *, plain: bool = False) -> Path:
    """Write a trace as CSV: UTF-8, commas, units in the header, every digit of float64.

    Args:
        trace: The trace.
        path: The file.
        plain: Whether its first line is that of the columns, for readers that know no comments; else a comment has what
            columns cannot say.

    Returns:
        The path.

    Raises:
        UserError: If the file cannot be written, or the header cannot hold a channel's name.
    """
    path = Path(path)
    for channel in trace.channels:
        _check_name(channel, path)
    text = io.StringIO(newline="")
    if not plain:
        text.write(f"# sysid: {_head(trace)}\n")
    writer = csv.writer(text, lineterminator="\n")
    columns = _columns(trace)
    writer.writerow([csv_cell(label) for label, _ in columns])
    writer.writerows(zip(*(map(repr, values.tolist()) for _, values in columns), strict=True))
    try:
        with replacing(path) as draft:
            draft.write_text(text.getvalue(), encoding="utf-8", newline="")
    except OSError as error:
        raise _unwritable(path, error) from error
    return path


def write_parquet(trace: Trace, path: str | Path) -> Path:
    """Write a trace as Parquet: units and references in the metadata of each field.

    Args:
        trace: The trace.
        path: The file.

    Returns:
        The path.

    Raises:
        UserError: If the file cannot be written.
        MissingExtraError: If pyarrow is not installed.
    """
    path = Path(path)
    need("pyarrow", f"writing {path.name}")
    import pyarrow as pa
    from pyarrow import parquet

    described = [Channel(name="time", unit="s"), *trace.channels]
    arrays = [values for _, values in _columns(trace)]
    described += [Channel(name=name, unit="1") for name in _mask_names(trace)]
    fields = [
        pa.field(
            channel.name,
            pa.float64(),
            metadata={
                "unit": channel.unit,
                "reference": channel.reference.value,
                "description": channel.description,
            },
        )
        for channel in described
    ]
    table = pa.table(arrays, schema=pa.schema(fields, metadata={"sysid": _head(trace)}))
    try:
        with replacing(path) as draft:
            parquet.write_table(table, draft)
    except OSError as error:
        raise _unwritable(path, error) from error
    return path


def _columns(trace: Trace) -> Sequence[tuple[str, NDArray[np.float64]]]:
    columns = [("time [s]", trace.time)]
    columns += [(channel.label, trace[channel.name]) for channel in trace.channels]
    if trace.usable is not None:
        masks = trace.usable.reshape(len(trace), -1).T.astype(np.float64)
        columns += [(f"{name} [1]", mask) for name, mask in zip(_mask_names(trace), masks, strict=True)]
    return columns


def _mask_names(trace: Trace) -> list[str]:
    """What the columns are called that say which samples count, of all channels or of each."""
    if trace.usable is None:
        return []
    return ["usable"] if trace.usable.ndim == 1 else [f"usable {name}" for name in trace.channel_names]


def _head(trace: Trace) -> str:
    """What the columns cannot say; the digest tells whether the file was changed since."""
    return json.dumps(
        {
            "name": trace.name,
            "sample_time": trace.sample_time,
            "start_time": trace.start_time,
            "channels": [[c.name, c.unit, c.reference.value, c.description] for c in trace.channels],
            "masked": trace.usable is not None,
            "provenance": list(trace.provenance),
            "digest": trace.digest,
        }
    )


def _check_name(channel: Channel, path: Path) -> None:
    header = parse_header(channel.label)
    reference = header.reference or Reference.NONE
    unit = plain_unit(channel.unit) or channel.unit  # what a header says as people do is read as pint writes it
    readable = (header.name, header.unit, reference) == (channel.name, unit, channel.reference)
    if not readable or "\r" in channel.name or channel.name in TAKEN:
        raise UserError(
            "a CSV header cannot hold this channel",
            where=f"{path}, channel {channel.name!r}",
            expected="a name that reads back from 'name [unit]', and is not time or usable",
            got=channel.label,
            remedy="rename the channel, or write .parquet",
        )


def _unwritable(path: Path, error: OSError) -> UserError:
    return UserError(
        "the file cannot be written",
        where=path,
        expected="a folder that may be written to, with room left",
        got=error,
        remedy="choose another place, or make room",
    )
