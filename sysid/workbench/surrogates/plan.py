"""What a surrogate is made from: a pipeline of kind ``experiment``, written where it can be read and changed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sysid.atomic import write_bytes
from sysid.errors import ConfigError
from sysid.field_checks import check
from sysid.names import slug
from sysid.references.config import ReferenceConfig
from sysid.references.described import Wish
from sysid.references.design import Counts, Design, drawn
from sysid.references.guessed import GUESS, range_told
from sysid.references.proposal import proposed
from sysid.references.runs import ReferenceRuns
from sysid.references.sources import Source
from sysid.references.told import reasons_of
from sysid.workbench.auto.finish import MOST_KEPT, span
from sysid.workbench.auto.parts import searched_in
from sysid.workbench.experiments.config import ExperimentConfig
from sysid.yaml_files import read_yaml, yaml_text

RUNNING = 0.2
"""Share of the time in which the reference is run for data; as much again for the proof."""
SEARCHING = 0.4
"""Share of the time in which a model is looked for at least, whatever the rest takes."""
BUSY = 1.5
"""Seconds by the clock that a second of work takes from which on a busy machine is named as the reason."""
TRIES = 3
"""Experiments that are run before any is asked for, at most: one, where that gives a record."""
WARMED = 0.05
"""Share of the time up to which a first run is made twice, all of it: what it had to load is no time of the others."""
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
"""Experiments that are fitted: at least, where they are long, and at most. More samples than trials fit in the time
would make look, scores and report slow, and leave none for the search; rounds of growth add what is missing."""
RECORDS = 1.0
"""Of them for each second of the whole: ninety short records took half a minute to be loaded, looked at and scored."""


def written(
    source: Source, wish: Wish, folder: Path, *, minutes: float, workers: int, seed: int
) -> tuple[Path, list[str]]:
    """The pipeline of a reference, written; one that is there already is left as it is.

    Args:
        source: The reference. **Its code is run once**, to see how long that takes.
        wish: What is said beside it.
        folder: Where.
        minutes: Time for all.
        workers: Processes.
        seed: Of everything random.

    Returns:
        The file, and what was taken from where.

    Raises:
        ConfigError: If something is not said, or the reference cannot be run.
    """
    file = folder / "experiment.yaml"
    if file.is_file():
        return file, [f"{file} is there already and is taken as it is"]
    found = proposed(source, wish)
    content: dict[str, Any] = {"name": f"{slug(source.name)}-runs", "workers": workers, **found.content}
    content["experiment"] = {"seed": seed, **content["experiment"]}
    config = check(ExperimentConfig, content, where=source.file)
    if "runs" not in content["experiment"]:
        runs = affordable(config.reference, config.experiment, minutes=minutes, workers=workers)
        content["experiment"]["runs"] = runs.model_dump()
    write_bytes(file, _text(source, content, found.notes).encode())
    return file, list(found.notes)


def guesses_of(file: Path) -> list[str]:
    """What of a pipeline is no more than a guess, as its first lines say, and was not written otherwise since.

    Args:
        file: The pipeline.

    Returns:
        A sentence for each input.
    """
    told = [line.removeprefix("# ") for line in file.read_text("utf-8-sig").splitlines() if line.startswith("# ")]
    ports = (read_yaml(file).get("reference") or {}).get("inputs") or {}
    ranges = [range_told(name, *port["range"]) for name, port in ports.items() if "range" in port]
    return [one for one in told if any(one.startswith(f"{some} {GUESS}") for some in ranges)]


def text_of(source: Source, wish: Wish, *, name: str, places: Mapping[str, str]) -> tuple[str, list[str]]:
    """The pipeline of a reference as text, with as many experiments as usual; nothing is run.

    Args:
        source: The reference.
        wish: What is said beside it.
        name: Of the pipeline.
        places: Fields of the reference that are written otherwise: its folder, or its FMU, seen from the pipeline.

    Returns:
        The text, and what was taken from where.

    Raises:
        ConfigError: If something is not said.
    """
    found = proposed(source, wish)
    content = {"workers": 2, **found.content, "name": name}
    check(ExperimentConfig, content, where=source.file)
    content["reference"] = {**content["reference"], **places}
    return _text(source, content, found.notes), list(found.notes)


def _text(source: Source, content: Mapping[str, Any], notes: Sequence[str]) -> str:
    first = ("kind", "name", "description", "reference", "experiment", "workers")
    ordered = {name: content[name] for name in (*first, *content) if name in content}
    told = "".join(f"# {one}\n" for one in notes)
    head = f"# Proposed for {source.text}. It is code, and is run.\n{told}"
    return f"{head}{yaml_text(ordered)}{'' if 'fits' in content else KNOWN}"


def affordable(reference: ReferenceConfig, design: Design, *, minutes: float, workers: int) -> Counts:
    """How many experiments there is time for, in which they can be searched too.

    Args:
        reference: Run once to see.
        design: What each is.
        minutes: Time for all.
        workers: Processes.

    Returns:
        By role.

    Raises:
        ConfigError: If none of :data:`TRIES` experiments gives a record.
    """
    cases = drawn(reference, design, TRIES, seed=(design.seed, 9), prefix="TRY")
    with ReferenceRuns(config=reference, workers=TRIES) as runs:
        (one,) = runs.run(cases[:1])
        # Of one that fails nobody knows whether it always does; one that hangs is not waited for one after the other.
        more = runs.run(cases[1:]) if one.trace is None else []
        # The first run of a process loads and compiles what the others find: eight of sixty were afforded for it.
        warm = runs.seconds_warm(one, most=WARMED * 60.0 * minutes)
    if one.trace is None and all(other.trace is None for other in more):
        raise ConfigError(
            f"the reference gave no record of {TRIES} experiments", where=reference.kind,
            expected="outputs of experiments within the ranges", got=reasons_of([one, *more]),
            remedy="run the reference by itself with such inputs first; nothing was written",
        )  # fmt: skip
    each = warm if one.trace is not None else next(other.wall_s for other in more if other.trace is not None)
    each = each if np.isfinite(each) else reference.time_limit
    seen = min(searched_in(60.0 * minutes) * reference.sample_time / design.duration, RECORDS * 60.0 * minutes)
    most = int(np.clip(seen, ENOUGH, MOST))
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
        apart: Whether the proof's experiments were asked for, and take their time beside the whole.
        slowed: Seconds by the clock that a second of work takes, as busy as the machine is.
    """

    whole: float
    spent: float
    proof: float
    finish: float
    apart: bool = False
    slowed: float = 1.0

    @property
    def asked(self) -> float:
        """What was asked for, with what the proof takes beside it."""
        return self.whole + (self.proof if self.apart else 0.0)

    @property
    def shared(self) -> float:
        """What search and finish have together: all that the rest does not take, and of that some in any case."""
        return max(SEARCHING * self.whole, self.asked - self.spent - self.proof - self.finish) + self.finish

    @property
    def search(self) -> float:
        """What a model is looked for: a search gives what follows it no more than a half of what both have."""
        return max(self.shared - self.finish, (1.0 - MOST_KEPT) * self.shared)

    def sentence(self, experiments: int, most: int | None = None) -> str:
        """What is about to be done, for who waits for it.

        Args:
            experiments: Of the proof.
            most: So many where what comes before it takes less; no more by default.

        Returns:
            One sentence; another where it takes longer than was asked for.
        """
        proof = (
            f"and, on top of them, {span(self.proof)} for the {experiments:,} experiments that --proof asks for"
            if self.apart
            else f"{span(self.proof)} for {experiments:,} experiments of the proof"
            f"{' or more' if most is not None and most > experiments else ''}"
        )
        said = (
            f"Time: {span(self.spent)} so far, {span(self.search)} for a model, {span(self.finish)} for "
            f"scores, export and report, {proof}"
        )
        whole = self.spent + self.search + self.proof + self.finish
        if whole <= 1.05 * self.asked:
            return f"{said}: about {span(whole)} in all." if self.apart else f"{said}."
        given = f"the {span(self.whole)} that were asked for"
        return f"{said}: about {span(whole)} in all, more than {given}. {self._helps}."

    @property
    def _helps(self) -> str:
        """What makes it shorter: what takes most says so."""
        if self.proof >= self.finish and not self.apart:
            return "Fewer experiments of the proof (--proof) take less"
        if self.slowed >= BUSY:
            return f"The machine is busy: a second of work takes {self.slowed:.2g} s now"
        return "There is room for it in more --minutes"


def times(
    each: float, *, minutes: float, spent: float, experiments: int, workers: int, finish: float, apart: bool = False,
    slowed: float = 1.0,
) -> Times:  # fmt: skip
    """How the time of a surrogate is spent, once its experiments are there.

    Args:
        each: Seconds of a run of the reference.
        minutes: Time for all.
        spent: Seconds until now.
        experiments: Of the proof.
        workers: Processes.
        finish: Seconds of scores, export and report.
        apart: Whether these experiments were asked for, and take their time beside the minutes.
        slowed: Seconds by the clock that a second of work takes.

    Returns:
        The times.

    Example:
        >>> found = times(0.03, minutes=5.0, spent=4.0, experiments=1000, workers=2, finish=35.0)
        >>> found.search, found.proof
        (246.0, 15.0)
        >>> times(6.0, minutes=5.0, spent=60.0, experiments=1000, workers=2, finish=35.0).search
        120.0
    """
    proof = experiments * each / workers
    return Times(whole=60.0 * minutes, spent=spent, proof=proof, finish=finish, apart=apart, slowed=slowed)
