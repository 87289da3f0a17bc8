"""What a judge found, as figures under documented keys; and results.json of a run that judged.

A judge says what a model's error does where the model is used. Which figures those are is its own business: it names
them, with their units, and gives their values scene by scene. Tables, charts and sentences are made of them elsewhere.
"""

from __future__ import annotations

import math
from collections.abc import Mapping as Dict
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import Field, model_validator

from sysid.reporting.records import Number, Record, RunResults, parse_record, read_document

FOLDER: Final = "judgements"
"""In the folder of a run: what judges said of its fits, one file each."""

MEND: Final = "run its pipeline again; a judge of another package has to be mended there"


class QuantityRecord(Record):
    """A figure that a judge gives."""

    name: str = Field(description="What it is, in a few words: the head of its column.")
    unit: str = Field(default="", description="Its unit; empty without one.")
    meaning: str = Field(default="", description="In a sentence.")


class CurveRecord(Record):
    """A signal over time, thinned."""

    time: list[Number] = Field(description="Seconds.")
    value: list[Number] = Field(description="In the unit of the quantity.")


class SceneRecord(Record):
    """What became of one scene, with a subject or with the reference."""

    refused: str = Field(default="", description="Why the scene could not be run; then it has no figures.")
    measures: dict[str, Number | str | bool | None] = Field(
        default={}, description="By quantity: what came of it, of the reference and of a subject alike."
    )
    differences: dict[str, Number] = Field(default={}, description="By quantity: a subject against the reference.")
    signals: dict[str, CurveRecord] = Field(default={}, description="By quantity.")


class SensitivityStep(Record):
    """What an artificial error of a size does."""

    size: Number = Field(description="Of the error.")
    error: Number = Field(description="The error figure that it has.")
    differences: dict[str, Number] = Field(description="Largest magnitude over its scenes, by quantity.")


class ToleranceRecord(Record):
    """How large an error may be before a difference passes the limit."""

    quantity: str = Field(description="Key of the difference.")
    reached: Literal["within", "passed", "crossed"] = Field(
        description="Within the limit at every size tried, past it at every size, or passed between two."
    )
    error: Number = Field(default=math.nan, description="The error figure where it passes the limit, if crossed.")


class SensitivityRecord(Record):
    """The reference with an artificial error, by rising size."""

    kind: str = Field(description="Such as bias.")
    meaning: str = Field(default="", description="In a few words.")
    unit: str = Field(description="Of the sizes.")
    steps: list[SensitivityStep]
    tolerances: list[ToleranceRecord] = Field(default=[])


class JudgementRecord(Record):
    """Everything a judge found of some models."""

    schema_version: int = Field(default=2, description="2.")
    title: str = Field(description="What was judged, in a word.")
    method: str = Field(default="", description="What was done, in a sentence or two.")
    reference_name: str = Field(default="reference", description="What the subjects are held against.")
    scenes: list[str] = Field(min_length=1, description="In the order of the tables.")
    headline_scenes: list[str] = Field(default=[], description="Those that the first sentence tells of.")
    quantities: dict[str, QuantityRecord] = Field(
        description="Every key that stands in measures, differences, signals."
    )
    error: str | None = Field(default=None, description="Key of the difference that is the error of the models.")
    limited: list[str] = Field(default=[], description="Keys of the differences that the limit is for.")
    limit: Number = Field(default=math.nan, description="That each of these should stay within, in their unit.")
    reference: dict[str, SceneRecord] = Field(default={}, description="By scene.")
    subjects: dict[str, dict[str, SceneRecord]] = Field(min_length=1, description="By subject and scene.")
    sensitivity: list[SensitivityRecord] = Field(default=[])
    told: str = Field(default="", description="What stands at the head of a report with other sections, in a sentence.")

    @model_validator(mode="after")
    def _named(self) -> JudgementRecord:
        used = {self.error, *self.limited} - {None}
        for by_scene in (self.reference, *self.subjects.values()):
            for one in by_scene.values():
                used |= {*one.measures, *one.differences, *one.signals}
        unknown = sorted(str(key) for key in used - set(self.quantities))
        if unknown:
            raise ValueError(f"quantities does not say what {', '.join(unknown)} is")
        return self

    def run(self, subject: str) -> dict[str, SceneRecord]:
        """The scenes that a subject could be run in."""
        return {name: one for name, one in self.subjects[subject].items() if not one.refused}

    def worst(self, subject: str, quantity: str) -> float:
        """Largest magnitude of a difference over the scenes; NaN without any."""
        values = [abs(one.differences[quantity]) for one in self.run(subject).values() if quantity in one.differences]
        return max(values, default=math.nan)

    def mean(self, subject: str, quantity: str) -> float:
        """Mean of a difference over the scenes; NaN without any."""
        values = [one.differences[quantity] for one in self.run(subject).values() if quantity in one.differences]
        return sum(values) / len(values) if values else math.nan

    def metrics(self) -> dict[str, dict[str, float]]:
        """Numbers to track with each subject: its differences by scene, the worst of those limited, its mean error."""
        return {subject: self._metrics(subject) for subject in self.subjects}

    def _metrics(self, subject: str) -> dict[str, float]:
        found = {f"worst_{key}": self.worst(subject, key) for key in self.limited}
        if self.error is not None:
            found[f"mean_{self.error}"] = self.mean(subject, self.error)
        for scene, one in self.run(subject).items():
            found |= {f"{key}/{scene}": value for key, value in one.differences.items()}
        return {name: value for name, value in found.items() if math.isfinite(value)}


class SubjectRecord(Record):
    """What was judged."""

    name: str = Field(description="What it is called.")
    parts: list[str] = Field(description="Models, and where each comes from.")


class JudgementResults(RunResults):
    """All of results.json of a run that judged."""

    subjects: list[SubjectRecord]
    judgement: JudgementRecord


def parse_judgement(document: Dict[str, Any], *, where: object) -> JudgementRecord:
    """Check what a judge found.

    Args:
        document: Its JSON values.
        where: Named in errors.

    Returns:
        The record.

    Raises:
        ConfigError: If a field is missing or wrong.
    """
    return parse_record(JudgementRecord, document, where=where, what="the figures of the judgement", remedy=MEND)


def judgement_documents(folder: Path) -> dict[Path, dict[str, Any]]:
    """What judges said of the fits of a run, of whichever version.

    Args:
        folder: The run's folder.

    Returns:
        Plain data by file, in the order of the files' names; none for a run that nobody judged.

    Raises:
        ConfigError: If a file is damaged.
    """
    files = sorted((Path(folder) / FOLDER).glob("*.json"))
    return {file: read_document(file, remedy="remove the file, or run its pipeline again") for file in files}
