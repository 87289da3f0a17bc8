"""A new workspace: the three folders, a small data set of its own, and a first pipeline."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.atomic import replacing
from sysid.errors import ConfigError
from sysid.traces import Channel, Trace

TEMPLATE = Path(__file__).parent / "template"
CASES = {"EST": 1, "SEL": 2, "VAL": 3}
"""Cases of the tank and the seed of each."""


def make_workspace(folder: Path) -> list[Path]:
    """Fill a folder with what a first run needs.

    Args:
        folder: Made if it is not there; nothing that is there is overwritten.

    Returns:
        The files made.

    Raises:
        ConfigError: If a file of the workspace is there already.
    """
    from sysid.ingest import write_csv
    from sysid.workbench.schemas import write_schemas

    templates = sorted(file for file in TEMPLATE.rglob("*") if file.is_file())
    targets = [folder / file.relative_to(TEMPLATE) for file in templates]
    records = {folder / "datasets" / "tank" / f"{name.lower()}.csv": name for name in CASES}
    refuse_taken(folder, {to: file.read_bytes() for file, to in zip(templates, targets, strict=True)}, records)
    for source, target in zip(templates, targets, strict=True):
        with replacing(target) as draft:
            shutil.copyfile(source, draft)
    schemas = write_schemas(folder)
    for file, name in records.items():
        if not file.exists():
            write_csv(tank(name), file)
    return [*targets, *schemas, *records]


def refuse_taken(folder: Path, files: Mapping[Path, bytes], more: Iterable[Path] = ()) -> None:
    """Overwrite nothing: but what a call that was cut off has left is whole and the same, and may stand.

    Args:
        folder: Of the workspace.
        files: What would be written.
        more: What would be written after it.

    Raises:
        ConfigError: If a file is there already.
    """
    there = [file for file in files if file.exists()]
    if not all(file.exists() for file in (*files, *more)):
        there = [file for file in there if not (file.is_file() and file.read_bytes() == files[file])]
    if there:
        raise ConfigError(
            "the folder has files of a workspace already",
            where=folder,
            expected="a folder without them",
            got=", ".join(str(file.relative_to(folder)) for file in there),
            remedy="name another folder; nothing was changed",
        )


def tank(case: str, n_samples: int = 1500) -> Trace:
    """One experiment with the two tanks of the first pipeline.

    Args:
        case: One of ``CASES``.
        n_samples: Seconds.

    Returns:
        Pump voltage and level of the lower tank, sampled every second.
    """
    rng = np.random.default_rng(CASES[case])
    pump = _steps(rng, n_samples)
    level = _level(pump) + 0.02 * rng.standard_normal(n_samples)
    return Trace(
        name=case,
        sample_time=1.0,
        channels=(Channel(name="pump", unit="V"), Channel(name="level", unit="cm")),
        values=np.column_stack([pump, np.round(level, 4)]),
    )


def _steps(rng: np.random.Generator, n_samples: int) -> NDArray[np.float64]:
    """A voltage that jumps to a random level and stays there for half a minute to two minutes."""
    pump = np.empty(n_samples)
    at = 0
    while at < n_samples:
        length = int(rng.integers(30, 120))
        pump[at : at + length] = np.round(rng.uniform(2.0, 8.0), 2)
        at += length
    return pump


def _level(pump: NDArray[np.float64]) -> NDArray[np.float64]:
    """Torricelli's law in two tanks, by Euler steps of 0.1 s, from the steady state of the first voltage."""
    gain, outflow, step = 0.16, 0.28, 0.1
    upper = lower = (gain * pump[0] / outflow) ** 2
    level = np.empty(len(pump))
    for n, voltage in enumerate(pump):
        level[n] = lower
        for _ in range(10):
            flow = outflow * upper**0.5
            lower = max(lower + step * (flow - outflow * lower**0.5), 0.0)
            upper = max(upper + step * (gain * voltage - flow), 0.0)
    return level
