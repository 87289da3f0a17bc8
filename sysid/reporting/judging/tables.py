"""What a judge found: tables and charts as stored values, and how they become a section of a report.

A judge says what a model's error does where the model is used. Which figures those are is its own business: here they
are tables, charts and sentences.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from sysid.errors import ConfigError
from sysid.reporting.figures.style import MARKERS, PALETTE, TARGET, new_figure, series_style, styled
from sysid.reporting.parts import Part, Section, identifier, picture
from sysid.reporting.scores import Score
from sysid.reporting.tables import Cell, Table, figure_cell

FOLDER: Final = "judgements"
"""In the folder of a run: what judges said of its fits, one file each."""


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="allow")


class TableRecord(_Record):
    """A table."""

    caption: str
    head: list[tuple[str, str]] = Field(description="Names of the columns, each with a second line, such as its unit.")
    rows: list[list[int | float | str | None]] = Field(
        description="Counts, numbers, words, or null for what there is not."
    )
    note: str = ""
    folded: list[str] = Field(default=[], description="Sentences for whoever asks further; folded away below it.")


class LineRecord(_Record):
    """One series of a chart."""

    name: str
    x: list[float]
    y: list[float]
    target: bool = Field(default=False, description="Whether it is what the others are held against.")
    marks: bool = Field(default=False, description="Marks without a line.")
    points: bool = Field(default=False, description="A line with a mark at each of its points.")


class ChartRecord(_Record):
    """A chart."""

    title: str
    caption: str
    x: str = Field(description="What the x axis is, with its unit.")
    y: str = Field(description="What the y axis is, with its unit.")
    logarithmic: bool | Literal["x"] = Field(default=False, description="Both axes, or the x axis alone.")
    lines: list[LineRecord]


class JudgementRecord(_Record):
    """Everything a judge said of some models."""

    title: str
    headline: str
    points: list[tuple[str, str]] = Field(default=[], description="Keyword and sentence, for the verdict.")
    sentences: list[str] = []
    tables: list[TableRecord] = []
    charts: list[ChartRecord] = []
    scores: list[Score] = Field(default=[], description="Errors by case of what was chosen, for a scorecard.")
    metrics: dict[str, dict[str, float]] = Field(default={}, description="By model, numbers to track with it.")


def parse_judgement(document: Any, *, where: object) -> JudgementRecord:
    """Check what a judge said.

    Args:
        document: Its JSON values.
        where: Named in errors.

    Returns:
        The record.

    Raises:
        ConfigError: If a field is missing or wrong.
    """
    try:
        return JudgementRecord.model_validate(document)
    except ValidationError as error:
        first = error.errors()[0]
        raise ConfigError(
            "the judgement cannot be used",
            where=where,
            expected=first["msg"],
            got=f"{'.'.join(str(part) for part in first['loc'])}: {first['input']!r:.80}",
            remedy="run its pipeline again; a judge of another package has to be mended there",
        ) from error


def read_judgements(folder: Path) -> list[JudgementRecord]:
    """What judges said of the fits of a run.

    Args:
        folder: The run's folder.

    Returns:
        In the order of the files' names; none for a run that nobody judged.

    Raises:
        ConfigError: If a file is damaged.
    """
    found = []
    for file in sorted((Path(folder) / FOLDER).glob("*.json")):
        try:
            document = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError) as error:
            raise ConfigError(
                "the judgement cannot be read",
                where=file,
                expected="JSON in UTF-8",
                got=error,
                remedy="remove the file, or run its pipeline again",
            ) from error
        found.append(parse_judgement(document, where=file))
    return found


def judgement_sections(records: list[JudgementRecord]) -> list[Section]:
    """Judgements as sections of a report.

    Args:
        records: The judgements.

    Returns:
        One section for each.
    """
    return [_section(record, index) for index, record in enumerate(records)]


def _section(record: JudgementRecord, index: int) -> Section:
    name = identifier(f"{record.title.lower()}-{index}" if index else record.title.lower())
    parts: list[Part] = [text for text in (record.headline, *record.sentences) if text]
    parts += [_table(table) for table in record.tables[:1]]
    charts = [
        picture(_figure(chart), chart.title, chart.caption, f"{name}-chart-{number}")
        for number, chart in enumerate(record.charts)
    ]
    parts += charts[:1]
    parts += [_table(table) for table in record.tables[1:]]
    parts += charts[1:]
    return Section(anchor=name, title=record.title, parts=tuple(parts))


def _table(table: TableRecord) -> Table:
    rows = tuple(tuple(_cell(value, first=k == 0) for k, value in enumerate(row)) for row in table.rows)
    head, folded = tuple(table.head), tuple(table.folded)
    return Table(caption=table.caption, head=head, rows=rows, note=table.note, folded=folded)


def _cell(value: float | str | None, *, first: bool) -> Cell:
    if value is None:
        return Cell(text="")
    if isinstance(value, int):  # a count has no significant digits
        return Cell(text=str(value), value=value, mark="number")
    return Cell(text=value, header=first) if isinstance(value, str) else figure_cell(value)


def _figure(chart: ChartRecord) -> Figure:
    """A chart; series differ in colour, dashes and marks, so that it is read in grey too."""
    with styled():
        figure = new_figure(7.6, 3.6)
        axes = figure.subplots()
        for index, line in enumerate(chart.lines):
            _draw(axes, line, index)
        if chart.logarithmic:
            axes.set_xscale("log")
        if chart.logarithmic is True:
            axes.set_yscale("log")
        axes.set_xlabel(chart.x)
        axes.set_ylabel(chart.y)
        if chart.lines:
            axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.2)
        return figure


def _draw(axes: Axes, line: LineRecord, index: int) -> None:
    x, y = np.array(line.x), np.array(line.y)
    if line.target:
        axes.plot(x, y, color=TARGET, linewidth=1.6, label=line.name)
    elif line.marks:
        colour, mark = PALETTE[index % len(PALETTE)], MARKERS[index % len(MARKERS)]
        axes.plot(x, y, color=colour, marker=mark, linestyle="none", markersize=5, label=line.name)
    else:
        axes.plot(x, y, **(series_style(index) | ({} if line.points else {"marker": ""})), label=line.name)
