"""What a benchmark measured, beside what was aimed at and what others have: a file of findings, and how it is read."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from sysid.atomic import replacing
from sysid.reporting.numbers import number
from sysid.reporting.published.figures_file import read_figures
from sysid.reporting.records import Number
from sysid.reporting.scores import Score

FINDINGS_FILE: Final = "findings.json"
"""Beside the page of a published benchmark: the same figures for programs."""


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="allow")


class Finding(_Record):
    """One measured figure.

    Example:
        >>> Finding(what="test record", ours=0.59, unit="V", target=0.588).met
        False
        >>> Finding(what="their time by ours", ours=48.0, unit="x", target=60.0, at_least=True, bound=True).met
    """

    what: str = Field(description="What was measured.")
    ours: Number = Field(description="Our figure; null where there is none, such as of a run that diverged.")
    unit: str = ""
    target: float | None = Field(default=None, description="What was aimed at, in the same unit.")
    at_least: bool = Field(default=False, description="Whether more is better.")
    bound: bool = Field(default=False, description="Whether ours is only known to be at least as good as this.")
    published: str = Field(default="", description="What is published, and where.")
    peer: str = Field(default="", description="What another tool has, measured in the same run.")
    note: str = ""

    @property
    def met(self) -> bool | None:
        """Whether the target is reached; ``None`` without one, or where a bound does not tell."""
        if self.target is None:
            return None
        if math.isnan(self.ours):
            return False
        reached = self.ours >= self.target if self.at_least else self.ours <= self.target
        return None if self.bound and not reached else reached

    @property
    def ours_text(self) -> str:
        """Our figure with its unit."""
        better = ("more than " if self.at_least else "less than ") if self.bound else ""
        return f"{better}{_with_unit(self.ours, self.unit)}"

    @property
    def target_text(self) -> str:
        """The target with its unit; empty without one."""
        if self.target is None:
            return ""
        return f"at {'least' if self.at_least else 'most'} {_with_unit(self.target, self.unit)}"


class Benchmark(_Record):
    """One benchmark: how it was run, on what, and what it found."""

    title: str = Field(description="One line.")
    protocol: str = Field(default="", description="How it measures, in paragraphs.")
    command: str = Field(description="The command that runs it again.")
    created: str = Field(default="", description="When it ended, ISO 8601.")
    environment: dict[str, Any] = Field(default={}, description="As in environment.json.")
    load: float | None = Field(default=None, description="Load of the machine when it began; 0 is an idle one.")
    data: dict[str, str] = Field(default={}, description="SHA-256 of each file or data set that it read, by name.")
    findings: list[Finding] = Field(default=[])
    scores: list[Score] = Field(default=[], description="Errors by case of the peers' models, where it scored some.")
    printed: str = Field(default="", description="Everything that it printed.")


class Benchmarks(_Record):
    """All of findings.json."""

    schema_version: int = 1
    name: str
    benchmarks: list[Benchmark]

    @property
    def findings(self) -> list[Finding]:
        """Of all benchmarks, in order."""
        return [finding for benchmark in self.benchmarks for finding in benchmark.findings]


def verdict_on(findings: Sequence[Finding]) -> str:
    """How many targets were reached, as a sentence.

    Args:
        findings: The findings.

    Returns:
        The sentence.

    Example:
        >>> verdict_on([Finding(what="a", ours=1.0, target=2.0), Finding(what="b", ours=3.0, target=2.0)])
        '1 of 2 targets is reached, 1 is missed.'
    """
    met = [finding.met for finding in findings if finding.target is not None]
    if not met:
        return f"{len(findings)} figures, none of which has a target."
    reached, missed, open_ = met.count(True), met.count(False), met.count(None)
    text = f"{reached} of {len(met)} targets {'is' if reached == 1 else 'are'} reached"
    text += f", {missed} {'is' if missed == 1 else 'are'} missed" if missed else ""
    return text + (f", {open_} could not be decided." if open_ else ".")


def read_findings(folder: Path) -> Benchmarks:
    """The figures of a published benchmark.

    Args:
        folder: Folder of the report.

    Returns:
        The figures.

    Raises:
        ConfigError: If there are none, or they are damaged.
    """
    return read_figures(
        Path(folder) / FINDINGS_FILE,
        TypeAdapter(Benchmarks),
        what="the figures of the benchmark cannot be read",
        expected="what python -m tests.benchmarks NAME --publish=REPORT writes",
        remedy="publish the benchmark again",
    )


def write_findings(folder: Path, found: Benchmarks) -> Path:
    """Write findings.json.

    Args:
        folder: Folder of the report; made if missing.
        found: The figures.

    Returns:
        The file.
    """
    path = Path(folder) / FINDINGS_FILE
    with replacing(path) as draft:
        draft.write_text(found.model_dump_json(indent=1) + "\n", encoding="utf-8", newline="\n")
    return path


def _with_unit(value: float, unit: str) -> str:
    return "none" if math.isnan(value) else f"{number(value)} {unit}".rstrip()
