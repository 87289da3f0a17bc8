"""The report of a run that judged models: its results.json and its page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from sysid.atomic import replacing
from sysid.errors import ConfigError
from sysid.reporting.document import Document
from sysid.reporting.html import render_html
from sysid.reporting.judging.tables import JudgementRecord, judgement_sections
from sysid.reporting.parts import Section
from sysid.reporting.results import RESULTS_FILE
from sysid.reporting.tables import Cell, Table
from sysid.reporting.verdict import Verdict

SCHEMA_VERSION: Final = 1


class SceneRecord(BaseModel):
    """What the models were judged on."""

    model_config = ConfigDict(frozen=True, extra="allow")
    name: str = Field(description="The data set, or the judge, which brings its own scenes.")
    digest: str = Field(default="", description="SHA-256 of the data set.")
    others: dict[str, str] = Field(default={}, description="SHA-256 of the other data sets that were read, by name.")


class SubjectRecord(BaseModel):
    """What was judged."""

    model_config = ConfigDict(frozen=True, extra="allow")
    name: str
    parts: list[str] = Field(description="Models, and where each comes from.")


class JudgementResults(BaseModel):
    """All of results.json of a run that judged."""

    model_config = ConfigDict(frozen=True, extra="allow", protected_namespaces=())
    schema_version: int = SCHEMA_VERSION
    kind: str = Field(description="Kind of the pipeline: the judge's name.")
    pipeline: str
    description: str = ""
    command: str = Field(description="The command that makes the run again.")
    created: str = Field(description="Date and time, ISO 8601.")
    environment: dict[str, Any]
    seed: int | None = None
    start: dict[str, Any] | None = None
    data: SceneRecord
    subjects: list[SubjectRecord]
    judgement: JudgementRecord


def read_judgement_results(folder: Path) -> JudgementResults | None:
    """The results of a run that judged.

    Args:
        folder: The run's folder.

    Returns:
        The results; ``None`` where the folder holds no results, or those of a run that fitted.

    Raises:
        ConfigError: If they are damaged or from a newer release.
    """
    path = Path(folder) / RESULTS_FILE
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        # Whoever reads results of fits says what is wrong with such a file.
        return None
    if not isinstance(document, dict) or "judgement" not in document:
        return None
    version = document.get("schema_version")
    try:
        if not isinstance(version, int) or version > SCHEMA_VERSION:
            raise ConfigError(
                "the results were written by a newer release",
                where=path,
                expected=f"schema_version up to {SCHEMA_VERSION}",
                got=version,
                remedy="upgrade the workbench, or make the report with the release that made the run",
            )
        return JudgementResults.model_validate(document)
    except ValidationError as error:
        raise ConfigError(
            "the results are damaged",
            where=path,
            expected="the results of a judgement",
            got=f"{error.errors()[0]['loc']}: {error.errors()[0]['msg']}",
            remedy="run the pipeline again; it goes on from what is finished",
        ) from error


def write_judgement_results(folder: Path, results: JudgementResults) -> Path:
    """Write results.json.

    Args:
        folder: The folder it goes into; made if missing.
        results: The results.

    Returns:
        The file.
    """
    path = Path(folder) / RESULTS_FILE
    with replacing(path) as draft:
        draft.write_text(results.model_dump_json(indent=1) + "\n", encoding="utf-8")
    return path


def judgement_document(results: JudgementResults) -> Document:
    """The parts of the page.

    Args:
        results: Of the run.

    Returns:
        The parts.
    """
    judgement = results.judgement
    judged = tuple((subject.name, "; ".join(subject.parts)) for subject in results.subjects)
    points = tuple(judgement.points) or judged
    verdict = Verdict(headline=judgement.headline, tiles=(), points=points, warnings=())
    # The headline stands in the verdict already.
    sections = judgement_sections([judgement.model_copy(update={"headline": ""})])
    if points is not judged:
        sections.append(_subjects(judged))
    sections += _data(results.data)
    return Document(results=results, verdict=verdict, sections=tuple(sections))


def _subjects(judged: tuple[tuple[str, str], ...]) -> Section:
    rows = tuple((Cell(text=name, header=True), Cell(text=parts)) for name, parts in judged)
    table = Table(caption="What was judged, and what it is made of.", head=(("", ""), ("models", "")), rows=rows)
    return Section(anchor="judged", title="What was judged", parts=(table,))


def _data(data: SceneRecord) -> list[Section]:
    if not data.digest:
        return []
    digests = {data.name: data.digest, **data.others}
    rows = tuple((Cell(text=name, header=True), Cell(text=digest)) for name, digest in digests.items())
    table = Table(caption="Data sets that were read.", head=(("data set", ""), ("SHA-256", "")), rows=rows)
    return [Section(anchor="data", title="Traces", parts=(table,))]


def write_judgement_report(folder: Path, results: JudgementResults) -> Path:
    """Write the page of a run that judged.

    Args:
        folder: The run's folder.
        results: Its results.

    Returns:
        The page, ``report/index.html``; ``report/results.json`` beside it holds the same numbers.
    """
    page = render_html(judgement_document(results))
    write_judgement_results(folder / "report", results)
    path = folder / "report" / "index.html"
    with replacing(path) as draft:
        draft.write_text(page, encoding="utf-8")
    return path
