"""What a judge found as a section of a report, and as a page of its own."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from pathlib import Path
from typing import Any

from sysid.reporting.charts import chart_pictures
from sysid.reporting.judging.results import JudgementRecord, JudgementResults, judgement_documents, parse_judgement
from sysid.reporting.judging.tables import (
    judgement_charts,
    judgement_headline,
    judgement_tables,
    tolerance_sentences,
)
from sysid.reporting.judging.version_1 import ReadyRecord, ready_section
from sysid.reporting.parts import Document, Part, Section, Verdict, data_set_section, identifier
from sysid.reporting.records import parse_record


def judgement_document(results: JudgementResults) -> Document:
    """The parts of the page.

    Args:
        results: Of the run.

    Returns:
        The parts.
    """
    record = results.judgement
    judged = tuple((subject.name, "; ".join(subject.parts)) for subject in results.subjects)
    verdict = Verdict(headline=judgement_headline(record), tiles=(), points=judged, warnings=())
    sections = [_judgement_section(record, 0, headline=False), *data_set_section(results.data)]
    return Document(results=results, verdict=verdict, sections=tuple(sections))


def _judgement_section(record: JudgementRecord, index: int, *, headline: bool = True) -> Section:
    """What was found as a section; a headline repeats the verdict of its own page."""
    name = identifier(f"{record.title.lower()}-{index}" if index else record.title.lower())
    parts: list[Part] = [judgement_headline(record)] if headline else []
    parts += [text for text in (record.method, *tolerance_sentences(record)) if text]
    tables, charts = judgement_tables(record), chart_pictures(judgement_charts(record), name)
    parts += [*tables[:1], *charts[:1], *tables[1:], *charts[1:]]
    return Section(anchor=name, title=record.title, parts=tuple(parts))


def judgement_sections(folder: Path) -> list[Section]:
    """What judges said of the fits of a run.

    Args:
        folder: The run's folder.

    Returns:
        A section for each.

    Raises:
        ConfigError: If a file is damaged.
    """
    documents = judgement_documents(folder).items()
    return [_section_of(document, file, index) for index, (file, document) in enumerate(documents)]


def judgement_points(folder: Path) -> list[tuple[str, str]]:
    """What of these stands at the head of the report.

    Args:
        folder: The run's folder.

    Returns:
        Title and sentence of each that has one.
    """
    found = [(str(one.get("title", "")), one.get("told")) for one in judgement_documents(folder).values()]
    return [(title, told) for title, told in found if isinstance(told, str) and told]


def _section_of(document: Dict[str, Any], where: Path, index: int) -> Section:
    if "tables" in document or "headline" in document:  # version 1, which carries no number
        return ready_section(parse_record(ReadyRecord, document, where=where), index)
    return _judgement_section(parse_judgement(document, where=where), index)
