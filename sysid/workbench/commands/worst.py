"""``sysid worst``: what a frozen surrogate is worst at among new sequences, kept as a data set to train on."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.atomic import write_bytes
from sysid.errors import ConfigError
from sysid.export.bundle import Bundle
from sysid.export.reading import read_bundle
from sysid.ingest import DatasetDescription, find_dataset, read_description
from sysid.units import in_unit
from sysid.workbench.runner import events
from sysid.workbench.runner.console import console
from sysid.workbench.runner.naming import meant
from sysid.workbench.runner.screen import Screen
from sysid.workbench.worst import Kept, drawn, errors_of, kept_text

QUANTILES = (0.5, 0.9, 0.99)


def worst_command(bundle: Path, *, like: str, case: str | None, seeds: str, output: str, keep: int, into: Path) -> None:
    """Run a surrogate beside the reference on new sequences, and write those that it is worst at as a data set."""
    numbers, file, source = _seeds(seeds), into / "dataset.yaml", find_dataset(like)
    if file.exists():
        raise ConfigError("there is a data set already", where=file, remedy="name another folder with --into")
    if not 1 <= keep <= len(numbers):
        raise ConfigError(
            "so many cannot be kept",
            where="option --keep",
            expected=f"1 to {len(numbers)}, as there are seeds",
            got=keep,
        )
    surrogate, described = read_bundle(meant(bundle)), read_description(source)
    sequences = drawn(described, case, numbers, where=source)
    errors = _searched(surrogate, sequences, output, source)
    kept = Kept.of(list(sequences.cases), errors, keep)
    unit = next(str(entry["unit"]) for entry in surrogate.outputs if entry["name"] == output)
    said = (
        f"The {keep} of {len(numbers)} new sequences (seeds {numbers[0]} to {numbers[-1]}, drawn as "
        f"{case or next(iter(described.cases))} of {described.name} is) that the surrogate with digest "
        f"{str(surrogate.metadata['digest'])[:12]} is worst at, by {output}: {len(kept.training)} for training, "
        f"{len(kept.choosing)} that choose."
    )
    words = ["sysid", "worst", str(bundle), "--like", like, *(["--case", case] if case else []), "--seeds", seeds]
    command = shlex.join([*words, "--output", output, "--keep", str(keep), "--into", str(into)])
    text = kept_text(sequences, kept, name=into.resolve().name, description=said)
    write_bytes(file, f"# Made by:  {command}\n{text}".encode())
    figures = ", ".join(f"{100 * q:g} % at most {np.quantile(errors, q):.3g}" for q in QUANTILES)
    out = console()
    worst, least = (in_unit(f"{error:.3g}", unit) for error in (errors.max(), np.sort(errors)[-keep]))
    out.print(f"{output} on {len(errors)} sequences: {figures}, the worst {worst}", soft_wrap=True)
    out.print(f"{keep} of them, from {least} on, kept in {file}", soft_wrap=True)


def _searched(surrogate: Bundle, sequences: DatasetDescription, output: str, source: Path) -> NDArray[np.float64]:
    screen, step = Screen(console()), "Running the surrogate beside the reference"
    screen(events.StepStarted(step=step))
    try:
        return errors_of(
            surrogate, sequences, output, where=source,
            progress=lambda name, index, count: screen(
                events.StepProgress(step=step, fraction=index / count, detail=f"{name} ({index + 1} of {count})")
            ),
        )  # fmt: skip
    finally:
        screen.close()


def _seeds(text: str) -> range:
    found = re.fullmatch(r"(\d+):(\d+)", text.strip())
    if found is None or int(found[2]) < int(found[1]):
        raise ConfigError(
            "these are no seeds",
            where="option --seeds",
            expected="the first and the last, as 130000:132999",
            got=text,
        )
    return range(int(found[1]), int(found[2]) + 1)
