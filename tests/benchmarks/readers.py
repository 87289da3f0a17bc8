"""Long files to a TraceSet: processor time beside pandas' and pyarrow's own readers, and how much memory that takes.

    python -m tests.benchmarks readers [--large]

A CSV file of 3 million rows and three columns (some 150 MB) and a Parquet file of 10 million samples of three columns;
with ``--large`` a CSV file of 1 GB too. Made here from seed 0, kept nowhere. Each reading is a process of its own that
has read a short file of the kind before, so that no import is counted; ours ends with a checked trace of a data set,
that of a peer with a table. The three take turns. Medians of five (of 1 GB: of three) of processor time, all threads;
memory is the peak of the process less what it had before. The digest of the file, which ours puts into the provenance
of every trace, is timed by itself too: no reader can be faster than it where it is asked for.
"""

from __future__ import annotations

import hashlib
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sysid.reporting.numbers import number
from tests.benchmarks._findings import found

CHUNK = 500_000
DESCRIPTION = """\
name: long
sample_time: 0.001
channels: [{{name: u, unit: V}}, {{name: y, unit: m}}]
source: {{files: {{time: "t [s]"}}}}
cases: {{LONG: {{role: estimation, file: {name}}}}}
"""


def ours(file: Path) -> object:
    """The file as a data set, as ``sysid run`` reads it."""
    from sysid.ingest import load_dataset

    description = file.with_suffix(".yaml")
    description.write_text(DESCRIPTION.format(name=file.name), encoding="utf-8")
    return load_dataset(description)


def pandas(file: Path) -> object:
    """The file as a frame of pandas."""
    import pandas as pd

    return pd.read_csv(file) if file.suffix == ".csv" else pd.read_parquet(file)


def pyarrow(file: Path) -> object:
    """The file as a table of Arrow."""
    from pyarrow import csv, parquet

    return csv.read_csv(file) if file.suffix == ".csv" else parquet.read_table(file)


def digest(file: Path) -> object:
    """The SHA-256 of the file."""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256")


READERS: dict[str, Callable[[Path], object]] = {"ours": ours, "pandas": pandas, "pyarrow": pyarrow, "digest": digest}


def memory(key: str) -> int:
    """A line of the memory of this process, in bytes."""
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith(key))


def child(reader: str, short: Path, file: Path) -> None:
    """Read the file once and print what it took."""
    read = READERS[reader]
    read(short)
    Path("/proc/self/clear_refs").write_text("5", encoding="utf-8")  # the peak so far is forgotten
    before, wall, processor = memory("VmRSS"), time.perf_counter(), time.process_time()
    kept = read(file)
    took = {"processor": time.process_time() - processor, "wall": time.perf_counter() - wall}
    del kept
    print(json.dumps({**took, "memory": memory("VmHWM") - before}))


def samples(first: int, last: int) -> np.ndarray:
    """Rows of a record: time, a stepped input, a noisy output."""
    rng = np.random.default_rng([0, first])
    rows = np.arange(first, last)
    return np.column_stack([0.001 * rows, np.sin(0.01 * rows) + rng.normal(size=len(rows)), rng.normal(size=len(rows))])


def make_csv(file: Path, rows: int) -> None:
    """Write a CSV file of so many rows, some 50 characters each."""
    import pyarrow as pa
    from pyarrow import csv

    schema = pa.schema([(name, pa.float64()) for name in ("t [s]", "u [V]", "y [m]")])
    with csv.CSVWriter(file, schema) as out:
        for first in range(0, rows, CHUNK):
            block = samples(first, min(first + CHUNK, rows))
            block[:, 0] = np.rint(block[:, 0] * 1e3) / 1e3  # the digits that a logger writes
            out.write(pa.table([*block.T], schema=schema))


def make_parquet(file: Path, rows: int) -> None:
    """Write a Parquet file of so many rows, a row group a million."""
    import pyarrow as pa
    from pyarrow import parquet

    schema = pa.schema([(name, pa.float64()) for name in ("t [s]", "u [V]", "y [m]")])
    with parquet.ParquetWriter(file, schema) as out:
        for first in range(0, rows, 1_000_000):
            block = samples(first, min(first + 1_000_000, rows))
            out.write_table(pa.table([*block.T], schema=schema))


@dataclass(frozen=True)
class Job:
    """One file to be read."""

    name: str
    suffix: str
    rows: int
    repeats: int

    @property
    def make(self) -> Callable[[Path, int], None]:
        """What writes it."""
        return make_csv if self.suffix == ".csv" else make_parquet


JOBS = (
    Job("CSV of 3 million rows", ".csv", 3_000_000, 5),
    Job("Parquet of 10 million samples", ".parquet", 10_000_000, 5),
)
LARGE = Job("CSV of 1 GB", ".csv", 22_500_000, 3)


def measure(job: Job, folder: Path) -> None:
    """Time one file by all readers in turn, and say what was found."""
    short, file = folder / f"short{job.suffix}", folder / f"long{job.suffix}"
    job.make(short, 20_000)
    job.make(file, job.rows)
    print(f"\n{job.name}: {number(file.stat().st_size / 1e6)} MB, {job.rows:,} rows, 3 columns\n")
    taken: dict[str, list[dict[str, float]]] = {reader: [] for reader in READERS}
    for _ in range(job.repeats):
        for reader, runs in taken.items():
            words = [sys.executable, str(Path(__file__)), "--child", reader, str(short), str(file)]
            done = subprocess.run(words, capture_output=True, text=True, check=True)
            runs.append(json.loads(done.stdout))
    median = {r: {k: statistics.median(one[k] for one in runs) for k in runs[0]} for r, runs in taken.items()}
    for reader, took in median.items():
        note = f"by the clock {number(took['wall'])} s; memory {number(took['memory'] / 1e6)} MB"
        found(f"{job.name}: {reader}", took["processor"], "s", note=note)
    for peer in ("pandas", "pyarrow"):
        ratio = median["ours"]["processor"] / median[peer]["processor"]
        found(f"{job.name}: ours, divided by {peer}", ratio, "x", target=1.5)
    held = 8 * 3 * job.rows
    found(f"{job.name}: memory, divided by the samples", median["ours"]["memory"] / held, "x", target=3.0)


def main(options: list[str]) -> None:
    """Make the files and measure."""
    for job in (*JOBS, *((LARGE,) if "--large" in options else ())):
        with tempfile.TemporaryDirectory() as folder:
            measure(job, Path(folder))


if __name__ == "__main__":
    if "--child" in sys.argv:
        child(sys.argv[2], Path(sys.argv[3]), Path(sys.argv[4]))
    else:
        main(sys.argv[1:])
