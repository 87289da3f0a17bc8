"""Version 1 of results.json of assemblies and judgements: tables, charts and sentences that were stored ready-made."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from sysid.reporting.charts import Chart, Line, chart_pictures
from sysid.reporting.judging.results import SubjectRecord
from sysid.reporting.parts import Document, Part, Section, Verdict, data_set_section, identifier
from sysid.reporting.records import Record, RunResults
from sysid.reporting.scores import Score
from sysid.reporting.tables import Table, plain_table


class TableRecord(Record):
    """A table."""

    caption: str
    head: list[tuple[str, str]] = Field(description="Names of the columns, each with a second line, such as its unit.")
    rows: list[list[int | float | str | None]] = Field(
        description="Counts, numbers, words, or null for what there is not."
    )
    note: str = ""
    folded: list[str] = Field(default=[], description="Sentences for whoever asks further; folded away below it.")

    def table(self) -> Table:
        """As a part of a page."""
        return plain_table(self.caption, self.head, self.rows, note=self.note, folded=self.folded)


class LineRecord(Record):
    """One series of a chart."""

    name: str
    x: list[float]
    y: list[float]
    target: bool = Field(default=False, description="Whether it is what the others are held against.")
    marks: bool = Field(default=False, description="Marks without a line.")
    points: bool = Field(default=False, description="A line with a mark at each of its points.")

    def line(self) -> Line:
        """As a series of a chart."""
        how = {"target": self.target, "marks": self.marks, "points": self.points}
        kinds: list[Literal["target", "marks", "points"]] = ["target", "marks", "points"]
        return Line(name=self.name, x=self.x, y=self.y, how=next((kind for kind in kinds if how[kind]), "line"))


class ChartRecord(Record):
    """A chart."""

    title: str
    caption: str
    x: str = Field(description="What the x axis is, with its unit.")
    y: str = Field(description="What the y axis is, with its unit.")
    logarithmic: bool | Literal["x"] = Field(default=False, description="Both axes, or the x axis alone.")
    lines: list[LineRecord]

    def chart(self) -> Chart:
        """As it is drawn."""
        return Chart(
            title=self.title,
            caption=self.caption,
            x=self.x,
            y=self.y,
            lines=[line.line() for line in self.lines],
            logarithmic="x" if self.logarithmic == "x" else "xy" if self.logarithmic else "",
        )


class ReadyRecord(Record):
    """What was found, ready-made."""

    title: str
    headline: str
    points: list[tuple[str, str]] = Field(default=[], description="Keyword and sentence, for the verdict.")
    sentences: list[str] = Field(default=[])
    tables: list[TableRecord] = Field(default=[])
    charts: list[ChartRecord] = Field(default=[])
    scores: list[Score] = Field(default=[], description="Errors by case of what was chosen, for a scorecard.")
    metrics: dict[str, dict[str, float]] = Field(default={}, description="By model, numbers to track with it.")


class ReadyResults(RunResults):
    """All of results.json."""

    subjects: list[SubjectRecord]
    judgement: ReadyRecord


def ready_section(record: ReadyRecord, index: int) -> Section:
    """What was found as a section of a report.

    Args:
        record: What was found.
        index: Of the judgements in the page, from 0 on.

    Returns:
        The section.
    """
    name = identifier(f"{record.title.lower()}-{index}" if index else record.title.lower())
    parts: list[Part] = [text for text in (record.headline, *record.sentences) if text]
    tables = [table.table() for table in record.tables]
    charts = chart_pictures([chart.chart() for chart in record.charts], name)
    parts += [*tables[:1], *charts[:1], *tables[1:], *charts[1:]]
    return Section(anchor=name, title=record.title, parts=tuple(parts))


def ready_document(results: ReadyResults) -> Document:
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
    sections = [ready_section(judgement.model_copy(update={"headline": ""}), 0)]
    if points is not judged:
        table = plain_table("What was judged, and what it is made of.", [("", ""), ("models", "")], judged)
        sections.append(Section(anchor="judged", title="What was judged", parts=(table,)))
    sections += data_set_section(results.data)
    return Document(results=results, verdict=verdict, sections=tuple(sections))
