"""``sysid ingest --annotate``: states along the traces of a data set, shown, and written as a data set of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rich.table import Table

from sysid.atomic import write_bytes
from sysid.errors import ConfigError
from sysid.ingest import load_dataset, write_trace
from sysid.names import slug
from sysid.traces import TraceSet
from sysid.units import Reference
from sysid.validation.annotator import Annotator
from sysid.workbench.annotation import annotated_set, find_annotator
from sysid.workbench.runner.console import console
from sysid.yaml_files import yaml_text


def annotate_command(source: str, *, annotator: str, out: Path | None) -> None:
    """Annotate a data set; without a folder the states are shown and nothing is written."""
    path = Path(source)
    if path.is_file() and path.suffix.lower() not in {".yaml", ".yml"}:
        raise ConfigError(
            "a file alone does not say what its channels are",
            where=source,
            expected="the name of a data set, or its dataset.yaml",
            remedy=f"describe it first: sysid ingest {source} --propose dataset.yaml",
        )
    found = find_annotator(annotator, where="--annotate")
    traces = annotated_set(load_dataset(source), found)
    target = console()
    target.print(_table(traces, found))
    if out is None:
        target.print("Write the traces with their states: add --out FOLDER")
        return
    target.print(f"Data set: {_write(traces, found, annotator, out)}", soft_wrap=True)


def _table(traces: TraceSet, annotator: Annotator) -> Table:
    """Share of the time in each state, by case."""
    states = {trace.name: trace[annotator.channel].astype(np.int64) for trace in traces}
    seen = [k for k in range(len(annotator.labels)) if any((column == k).any() for column in states.values())]
    table = Table(title=f"{traces.name}: share of the time in each state", title_justify="left", header_style="bold")
    table.add_column("case")
    table.add_column("changes", justify="right")
    for k in seen:
        table.add_column(annotator.labels[k], justify="right")
    for name, column in states.items():
        shares = [f"{100.0 * np.mean(column == k):.1f} %" for k in seen]
        table.add_row(name, str(int(np.count_nonzero(np.diff(column)))), *shares)
    return table


def _write(traces: TraceSet, annotator: Annotator, name: str, out: Path) -> Path:
    """The annotated traces as files with their description; nothing that is there is written over."""
    description = out / "dataset.yaml"
    if description.exists():
        raise ConfigError(
            "the folder holds a data set already",
            where=description,
            expected="a new folder",
            remedy="name another one; nothing was changed",
        )
    cases = {}
    for trace in traces:
        file = f"{slug(trace.name)}.parquet"
        out.mkdir(parents=True, exist_ok=True)
        write_trace(trace, out / file)
        cases[trace.name] = {"role": traces.roles[trace.name].value, "file": file}
    fields = {
        "name": f"{traces.name}-{slug(name)}",
        "description": f"{traces.name} with the states that {name} finds: "
        + ", ".join(f"{k} {label}" for k, label in enumerate(annotator.labels)),
        "sample_time": traces.sample_time,
        "channels": [
            {"name": channel.name, "unit": channel.unit, "description": channel.description}
            | ({} if channel.reference is Reference.NONE else {"reference": channel.reference.value})
            for channel in traces.channels
        ],
        "source": {"files": {}},
        "cases": cases,
        "provenance": traces.source or f"The data set {traces.name}.",
    }
    write_bytes(description, yaml_text(fields).encode())
    return description
