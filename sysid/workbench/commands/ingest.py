"""``sysid ingest``: what is in a file, or in a data set."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.table import Table

from sysid.atomic import write_bytes
from sysid.content import nearest_file
from sysid.errors import ConfigError
from sysid.ingest import READERS, FileFinding, inspect_file, propose_dataset
from sysid.ingest.assembling.in_units import stamps_in_seconds
from sysid.ingest.inspecting.findings import ColumnFinding
from sysid.ingest.readers.text_source import bare_stem
from sysid.reporting.figures.record_picture import record_picture
from sysid.traces import TraceSet
from sysid.units import Reference
from sysid.workbench.commands.pictures import kept_picture
from sysid.workbench.commands.reader_options import as_typed, files_from
from sysid.workbench.runner.console import console
from sysid.workbench.runner.naming import nearby
from sysid.workbench.schemas import schema_line

_PATHS = {".yaml", ".yml", *(suffix for reader in READERS for suffix in reader.suffixes)}
"""Endings of what can be shown: a word that ends so is a path."""

_SIDE_BY_SIDE = 6
"""Channels whose ranges stand beside the cases; more of them have a table of their own."""


def ingest_command(
    source: str, *, propose: Path | None, given: Mapping[str, Any] | None = None, split: str | None = None
) -> None:
    """Show what a file or a data set holds; ``given`` are options of the readers, as plain data."""
    path = Path(source)
    if path.is_file() and path.suffix.lower() not in {".yaml", ".yml"}:
        with as_typed(whole=False):
            found = inspect_file(path, files=files_from(given or {}))
        _show_file(found, propose, _shares(split))
        return
    if split is not None:
        raise ConfigError(
            "only a file is split", where="option --split", expected="a file with traces", got=source,
            remedy="name the file; a data set has the roles of its cases in its dataset.yaml",
        )  # fmt: skip
    if given:
        raise ConfigError(
            "only a file is read with options of the command line",
            where=source,
            expected="a file with traces",
            got=", ".join(given),
            remedy="name the file; a data set has them in its dataset.yaml, under source: files:",
        )
    if propose is not None and not _is_name(path):
        raise _no_such(path)
    if propose is not None:
        raise ConfigError(
            "only a file can have a data set proposed",
            where=source,
            expected="a file with traces",
            remedy="name the file, or leave --propose out",
        )
    if not path.exists() and not _is_name(path):
        raise _no_such(path)
    from sysid.ingest import find_dataset, load_dataset  # here: a file that is looked into needs none of it

    _show_dataset(load_dataset(source), find_dataset(source))


def _is_name(path: Path) -> bool:
    """Whether a word can be the name of a data set: nothing in it says that it is a path."""
    return len(path.parts) == 1 and path.suffix.lower() not in _PATHS


def _no_such(path: Path) -> ConfigError:
    folder = path.parent
    if path.is_dir():
        files = sorted(one.name for one in path.iterdir() if one.is_file()) or ["no file"]
        return ConfigError(
            "a folder is no record",
            where=path,
            expected="a file with traces, the name of a data set, or its dataset.yaml",
            got=f"a folder with {', '.join(files[:3])}{' ...' * (len(files) > 3)}",
            remedy="name one of its files; the others are further cases of the dataset.yaml that --propose writes",
        )
    near = nearest_file(path, _PATHS)
    return ConfigError(
        "there is no such file",
        where=path,
        expected="a file with traces, the name of a data set, or its dataset.yaml",
        got="nothing at this path" if folder.is_dir() else f"no folder {folder} either",
        remedy=f"did you mean {near}?" if near else "check the path",
    )


def _shares(text: str | None) -> list[float]:
    try:
        return [] if text is None else [float(part) for part in text.split(",")]
    except ValueError:
        raise ConfigError(
            "not a split into shares", where="option --split", expected="one share, or two or three that add up to 1",
            got=text, remedy="write for example --split 0.7, or --split 0.6,0.2,0.2",
        ) from None  # fmt: skip


def _show_file(found: FileFinding, propose: Path | None, split: Sequence[float] = ()) -> None:
    proposal = propose_dataset(found, folder=None if propose is None else propose.parent, split=split)
    if propose is not None and propose.exists():
        raise ConfigError(
            "the file for the proposal is there already",
            where=propose,
            expected="a new file",
            remedy="name another one; nothing was changed",
        )
    target = console()
    told = f" ({found.time_told})" if found.time_told else ""
    step = f"one every {found.sample_time:g} s{told}, {(found.samples - 1) * found.sample_time:g} s in all"
    if found.time.step is not None and found.time_guessed:
        step = f"no time stamps: {found.time.step:g} s between them is a guess"
    target.print(f"{found.path}: read as {found.reader}, {found.samples} samples, {step}", soft_wrap=True)
    table = Table(header_style="bold")
    for heading in ("column", "unit", "from", "to", "missing", "remark"):
        table.add_column(heading, justify="right" if heading in {"from", "to", "missing"} else "left")
    for column in found.columns:
        reference = "" if column.reference is Reference.NONE else f" {column.reference.value}"
        guess = "?" if column.unit_guessed or column.reference_guessed else ""
        said = f"the file says {column.said}, which is no unit that is known" if column.said else ""
        still = "never changes" if column.constant else ""
        remark = column.problem or column.aside or said or column.far or still or _steps(column)
        empty = math.isnan(column.minimum)
        unit = "" if empty else f"{column.unit}{reference}{guess}"
        span = ("", "") if empty else (f"{column.minimum:.6g}", f"{column.maximum:.6g}")
        table.add_row(column.name, unit, *span, str(column.missing), remark)
    target.print(table)
    for problem in found.problems:
        target.print(f"look at: {problem}", soft_wrap=True)
    if propose is not None:
        write_bytes(propose, (schema_line(propose) + proposal).encode())
    target.print(f"picture: {_picture(found, Path() if propose is None else propose.parent)}", soft_wrap=True)
    if propose is None:
        target.print("\nProposed dataset.yaml (each ? above and the comments below mark what was guessed):\n")
        target.print(proposal, markup=False, soft_wrap=True)
        place = Path("datasets", bare_stem(found.path), "dataset.yaml")
        again = shlex.join(("sysid", "ingest", str(found.path), "--propose", str(place)))
        target.print(f"Next: {again}", markup=False, soft_wrap=True)
        return
    target.print(f"Proposed data set: {propose}; check it, then load it with: sysid ingest {propose}", soft_wrap=True)


def _steps(column: ColumnFinding) -> str:
    return f"comes in steps of {column.step:.3g}: coarse, see sysid advise" if column.step else ""


def _picture(found: FileFinding, folder: Path) -> str:
    """Draw the channels into a folder, and say where, or why not."""
    if not found.channels:
        return "none, as there is no column to draw"
    first = found.cases[0].finding if found.cases else found
    files, table = first.files.model_copy(update={"time": first.time}), first.table
    labels = {column.name: f"{column.name} [{column.unit}]" for column in found.channels}
    drawing = record_picture(
        stamps_in_seconds(table, files),
        {label: table.find(name).values for name, label in labels.items()},
        title=found.path.name,
        description=", ".join(labels.values()),
    )
    return kept_picture(folder / f"{bare_stem(found.path)}.ingest.svg", drawing)


def _channel_table(traces: TraceSet) -> Table:
    """A line a channel, with its range over all cases: side by side, many of them could not be read."""
    table = Table(header_style="bold")
    for heading in ("channel", "unit", "from", "to"):
        table.add_column(heading, justify="left" if heading in {"channel", "unit"} else "right")
    for index, channel in enumerate(traces.channels):
        low, high = (end(float(end(trace.values[:, index])) for trace in traces) for end in (min, max))
        reference = "" if channel.reference is Reference.NONE else f" {channel.reference.value}"
        table.add_row(channel.name, f"{channel.unit}{reference}", f"{low:.4g}", f"{high:.4g}")
    return table


def _show_dataset(traces: TraceSet, path: Path) -> None:
    target = console()
    target.print(f"{traces.name}: {nearby(path)}, one sample every {traces.sample_time:g} s", soft_wrap=True)
    table = Table(header_style="bold")
    wide = len(traces.channels) > _SIDE_BY_SIDE
    across = () if wide else tuple(channel.label for channel in traces.channels)
    for heading in ("case", "role", "samples", "seconds", *across):
        table.add_column(heading, justify="left" if heading in {"case", "role"} else "right")
    for trace in traces:
        low, high = trace.values.min(axis=0), trace.values.max(axis=0)
        spans = [] if wide else [f"{a:.4g} to {b:.4g}" for a, b in zip(low, high, strict=True)]
        table.add_row(trace.name, traces.roles[trace.name].value, str(len(trace)), f"{trace.duration:g}", *spans)
    target.print(table)
    if wide:
        target.print(_channel_table(traces))
    for trace in traces:
        for sentence in trace.provenance:
            target.print(f"{trace.name}: {sentence}", soft_wrap=True)
    target.print(f"digest {traces.digest}")
    from sysid import models  # here: what only looks into a file needs nothing that computes

    *inputs, output = [channel.name for channel in traces.channels]
    mapping = models.Mapping(inputs=tuple(inputs), output=output)
    look = shlex.join(("sysid", "advise", traces.name, "--mapping", str(mapping)))
    target.print(f"Next: {look}  (inputs -> outputs: yours may be others)", markup=False, soft_wrap=True)
