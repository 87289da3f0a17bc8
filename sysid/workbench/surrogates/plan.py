"""What a surrogate is made from: a pipeline of kind ``experiment``, written where it can be read and changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sysid.field_checks import check
from sysid.references.config import ReferenceConfig
from sysid.references.described import Wish, proposed
from sysid.references.design import Counts, Design, drawn
from sysid.references.runs import ReferenceRuns
from sysid.workbench.auto.finish import span
from sysid.workbench.auto.parts import SEARCHED
from sysid.workbench.experiments.config import ExperimentConfig
from sysid.workbench.runner.store import write_bytes
from sysid.yaml_files import yaml_text

RUNNING = 0.2
"""Share of the time in which the reference is run for data; as much again for the proof."""
SEARCHING = 0.4
"""Share of the time in which a model is looked for at least, whatever the rest takes."""
KNOWN = """\
# A search finds smooth maps, and a model that jumps at events (a velocity that flips, a state that is reset) is none.
# Where you know what happens, write it, and it is fitted in place of the search (docs/how/events.md):
# fits:
#   - name: known
#     structure:
#       kind: GreyBox
#       equations: |
#         y = where(event, reset, next)
#         before[k+1] = y
"""
"""What stands below a proposal."""
PROOF = 1000
"""New experiments of the proof where there is time for them."""
FEWEST, ENOUGH, MOST = 8, 12, 60
"""Experiments that are fitted: at least, where they are long, and at most. More samples than a search looks at would
make its trials slow; rounds of growth add what is missing."""


def written(fmu: Path, wish: Wish, folder: Path, *, minutes: float, workers: int, seed: int) -> tuple[Path, list[str]]:
    """The pipeline of an FMU, written; one that is there already is left as it is.

    Args:
        fmu: The reference. **Its code is run once**, to see how long that takes.
        wish: What is said beside its description.
        folder: Where.
        minutes: Time for all.
        workers: Processes.
        seed: Of everything random.

    Returns:
        The file, and what was taken from where.

    Raises:
        ConfigError: If the description does not say enough, or the reference cannot be run.
    """
    file = folder / "experiment.yaml"
    if file.is_file():
        return file, [f"{file} is there already and is taken as it is"]
    fields, duration, notes = proposed(fmu, wish)
    reference = check(ReferenceConfig, fields, where=fmu)
    runs = affordable(reference, Design(duration=duration, seed=seed), minutes=minutes, workers=workers)
    experiment = {"duration": duration, "runs": runs.model_dump(), "seed": seed}
    text = _text(fmu, f"{fmu.stem}-runs", fields, experiment, workers=workers, notes=notes)
    write_bytes(file, text.encode())
    return file, notes


def text_of(fmu: Path, wish: Wish, *, written_as: str, name: str) -> tuple[str, list[str]]:
    """The pipeline of an FMU as text, with as many experiments as usual; nothing is run.

    Args:
        fmu: The reference.
        wish: What is said beside its description.
        written_as: Its path in the pipeline.
        name: Of the pipeline.

    Returns:
        The text, and what was taken from where.

    Raises:
        ConfigError: If the description does not say enough.
    """
    fields, duration, notes = proposed(fmu, wish)
    return _text(fmu, name, {**fields, "fmu": written_as}, {"duration": duration}, workers=2, notes=notes), notes


def _text(
    fmu: Path, name: str, reference: dict[str, Any], experiment: dict[str, Any], *, workers: int, notes: Sequence[str]
) -> str:
    content: dict[str, Any] = {
        **{"kind": "experiment", "name": name, "reference": reference, "experiment": experiment}, "workers": workers,
    }  # fmt: skip
    check(ExperimentConfig, content, where=fmu)
    told = "".join(f"# {one}\n" for one in notes)
    return f"# Proposed for {fmu.name}. An FMU is code, and is run.\n{told}{yaml_text(content)}{KNOWN}"


def affordable(reference: ReferenceConfig, design: Design, *, minutes: float, workers: int) -> Counts:
    """How many experiments there is time for, in which they can be searched too.

    Args:
        reference: Run once to see.
        design: What each is.
        minutes: Time for all.
        workers: Processes.

    Returns:
        By role.
    """
    (case,) = drawn(reference, design, 1, seed=(design.seed, 9), prefix="TRY")
    with ReferenceRuns(config=reference, workers=1) as runs:
        (one,) = runs.run([case])
    each = one.wall_s if np.isfinite(one.wall_s) else reference.time_limit
    most = int(np.clip(SEARCHED * reference.sample_time / design.duration, ENOUGH, MOST))
    count = int(np.clip(RUNNING * 60.0 * minutes * workers / max(each, 1e-3) / 1.5, FEWEST, most))
    return Counts(estimation=count, selection=max(3, count // 4), test=max(3, count // 4))


@dataclass(frozen=True, kw_only=True)
class Times:
    """How the time of a surrogate is spent, in seconds.

    Args:
        whole: What was asked for.
        spent: On experiments, and until they were there.
        proof: On the proof's experiments.
        finish: On scores, export and report.
    """

    whole: float
    spent: float
    proof: float
    finish: float

    @property
    def search(self) -> float:
        """What a model is looked for: all that the rest does not take, but a share of the whole in any case."""
        return max(SEARCHING * self.whole, self.whole - self.spent - self.proof - self.finish)

    def sentence(self, experiments: int) -> str:
        """What is about to be done, for who waits for it.

        Args:
            experiments: Of the proof.

        Returns:
            One sentence; another where it takes longer than was asked for.
        """
        said = (
            f"Time: {span(self.spent)} so far, {span(self.search)} for a model, {span(self.finish)} for "
            f"scores, export and report, {span(self.proof)} for {experiments:,} experiments of the proof"
        )
        whole = self.spent + self.search + self.proof + self.finish
        if whole <= 1.05 * self.whole:
            return f"{said}."
        return (
            f"{said}: about {span(whole)} in all, more than the {span(self.whole)} that were asked for. Fewer "
            "experiments of the proof (--proof) take less."
        )


def times(each: float, *, minutes: float, spent: float, experiments: int, workers: int, finish: float) -> Times:
    """How the time of a surrogate is spent, once its experiments are there.

    Args:
        each: Seconds of a run of the reference.
        minutes: Time for all.
        spent: Seconds until now.
        experiments: Of the proof.
        workers: Processes.
        finish: Seconds of scores, export and report.

    Returns:
        The times.

    Example:
        >>> found = times(0.03, minutes=5.0, spent=4.0, experiments=1000, workers=2, finish=35.0)
        >>> found.search, found.proof
        (246.0, 15.0)
        >>> times(6.0, minutes=5.0, spent=60.0, experiments=1000, workers=2, finish=35.0).search
        120.0
    """
    return Times(whole=60.0 * minutes, spent=spent, proof=experiments * each / workers, finish=finish)


def pairs(options: Sequence[str], flag: str) -> dict[str, tuple[float, float]]:
    """Ranges as they are typed, ``NAME=LOW:HIGH``.

    Args:
        options: As typed.
        flag: For errors.

    Returns:
        By name.

    Raises:
        ConfigError: If one is not of that form.

    Example:
        >>> pairs(["u=0:10"], "--range")
        {'u': (0.0, 10.0)}
    """
    from sysid.errors import ConfigError

    found = {}
    for text in options:
        name, _, span = text.rpartition("=")
        try:
            low, high = (float(part) for part in span.split(":"))
        except ValueError:
            name = ""
        if not name or not low < high:
            raise ConfigError(
                f"{flag} is not a range", where="the command line", expected="NAME=LOW:HIGH, as valve=0:10", got=text,
                remedy="write the name, and two rising numbers",
            )  # fmt: skip
        found[name] = (low, high)
    return found
