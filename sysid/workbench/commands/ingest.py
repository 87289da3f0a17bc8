"""``sysid ingest``: what is in a file, or in a data set."""

from __future__ import annotations

import difflib
from pathlib import Path

from rich.markup import escape
from rich.table import Table

from sysid.errors import ConfigError
from sysid.ingest import READERS, FileFinding, find_dataset, inspect_file, load_dataset, propose_dataset
from sysid.traces import TraceSet
from sysid.units import Reference
from sysid.workbench.commands.run import console
from sysid.workbench.store import write_bytes


def ingest_command(source: str, *, propose: Path | None) -> None:
    """Show what a file or a data set holds.

    Args:
        source: A file with traces, a data set's name, or its ``dataset.yaml``.
        propose: Where to write the proposed ``dataset.yaml``.

    Raises:
        UserError: If it cannot be read.
    """
    path = Path(source)
    if path.is_file() and path.suffix.lower() not in {".yaml", ".yml"}:
        _show_file(inspect_file(path), propose)
        return
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
    _show_dataset(load_dataset(source), find_dataset(source))


def _is_name(path: Path) -> bool:
    """Whether a word can be the name of a data set: nothing in it says that it is a path."""
    return len(path.parts) == 1 and path.suffix.lower() not in {
        ".yaml",
        ".yml",
        *(suffix for reader in READERS for suffix in reader.suffixes),
    }


def _no_such(path: Path) -> ConfigError:
    folder = path.parent
    there = sorted(file.name for file in folder.iterdir() if file.is_file()) if folder.is_dir() else []
    near = difflib.get_close_matches(path.name, there, n=1)
    return ConfigError(
        "there is no such file",
        where=path,
        expected="a file with traces, the name of a data set, or its dataset.yaml",
        got="nothing at this path" if folder.is_dir() else f"no folder {folder} either",
        remedy=f"did you mean {folder / near[0]}?" if near else "check the path",
    )


def _show_file(found: FileFinding, propose: Path | None) -> None:
    target = console()
    step = f"one sample every {found.sample_time:g} s" if found.time else "no time column"
    target.print(f"{found.path}: read as {found.reader}, {step}", soft_wrap=True)
    table = Table(header_style="bold")
    for heading in ("column", "unit", "from", "to", "missing", "remark"):
        table.add_column(heading, justify="right" if heading in {"from", "to", "missing"} else "left")
    for column in found.columns:
        reference = "" if column.reference is Reference.NONE else f" {column.reference.value}"
        guess = "?" if column.unit_guessed or column.reference_guessed else ""
        remark = column.problem or ("never changes" if column.constant else "")
        unit = f"{column.unit}{reference}{guess}"
        span = (f"{column.minimum:.6g}", f"{column.maximum:.6g}")
        table.add_row(escape(column.name), escape(unit), *span, str(column.missing), escape(remark))
    target.print(table)
    for problem in found.problems:
        target.print(f"look at: {escape(problem)}", soft_wrap=True)
    if propose is None:
        target.print("\nProposed dataset.yaml (a ? above and the comments below mark what was guessed):\n")
        target.print(propose_dataset(found), markup=False, soft_wrap=True)
        return
    if propose.exists():
        raise ConfigError(
            "the file for the proposal is there already",
            where=propose,
            expected="a new file",
            remedy="name another one; nothing was changed",
        )
    write_bytes(propose, propose_dataset(found).encode())
    target.print(f"Proposed data set: {propose}; check it, then load it with: sysid ingest {propose}", soft_wrap=True)


def _show_dataset(traces: TraceSet, path: Path) -> None:
    target = console()
    target.print(f"{traces.name}: {path}, one sample every {traces.sample_time:g} s", soft_wrap=True)
    table = Table(header_style="bold")
    for heading in ("case", "role", "samples", "seconds", *(channel.label for channel in traces.channels)):
        table.add_column(escape(heading), justify="left" if heading in {"case", "role"} else "right")
    for trace in traces:
        low, high = trace.values.min(axis=0), trace.values.max(axis=0)
        spans = [f"{a:.4g} to {b:.4g}" for a, b in zip(low, high, strict=True)]
        table.add_row(trace.name, traces.roles[trace.name].value, str(len(trace)), f"{trace.duration:g}", *spans)
    target.print(table)
    for trace in traces:
        for sentence in trace.provenance:
            target.print(f"{trace.name}: {escape(sentence)}", soft_wrap=True)
    target.print(f"digest {traces.digest}")
