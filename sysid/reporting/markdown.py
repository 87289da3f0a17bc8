"""Sections of a report as Markdown with drawings beside it: what is read where the code is read."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from collections.abc import Mapping as Dict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from sysid.errors import ConfigError
from sysid.names import markdown
from sysid.reporting.parts import Gallery, Part, Picture, Section
from sysid.reporting.tables import Cell, Table, facts

PAGE: Final = "README.md"
"""Name of the page in its folder, so that whoever opens the folder sees it."""

MARK: Final = "<!-- made by sysid publish -->"
"""First line of every page that is published; a folder without it is somebody else's."""

SIZE_LIMIT: Final = 600_000
"""Bytes of all drawings of a page together; what would go beyond is left to the whole report."""


@dataclass(kw_only=True)
class Drawings:
    """Where the drawings of a page go, and how much room there is left.

    Args:
        folder: The page's folder.
        shown: Whether a drawing of that name belongs into the page.
        room: Bytes that are left.
    """

    folder: Path
    shown: Callable[[str], bool]
    room: int = field(default=SIZE_LIMIT)

    def draw(self, part: Picture) -> list[str]:
        """Write a drawing beside the page; the lines that show it, none where it is left out."""
        name = _name(part)
        # Standing alone, an SVG needs the name space that it does without inside HTML.
        text = part.svg.replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1)
        if not self.shown(name) or len(text) > self.room:
            return []
        self.room -= len(text)
        (self.folder / f"{name}.svg").write_text(text + "\n", encoding="utf-8", newline="\n")
        return [f"![{markdown(part.caption)}]({name}.svg)", "", f"*{markdown(part.caption)}*", ""]


def section_lines(section: Section, drawings: Drawings) -> list[str]:
    """A heading and what stands under it.

    Args:
        section: The section.
        drawings: Where its drawings go.

    Returns:
        Lines of Markdown.
    """
    lines = [f"## {markdown(section.title)}", ""]
    for part in section.parts:
        lines += _part(part, drawings)
    return lines


def table_lines(table: Table) -> list[str]:
    """A table with its caption above, and its note and what is folded away below.

    Args:
        table: The table.

    Returns:
        Lines of Markdown.
    """
    head = [markdown(" ".join(filter(None, (name, f"({below})" if below else "")))) for name, below in table.head]
    rows = [[_cell(cell) for cell in row] for row in table.rows]
    lines = [markdown(table.caption), "", *rows_lines([head, ["---"] * len(head), *rows])]
    lines += ["", f"*{markdown(table.note)}*"] if table.note else []
    return [*lines, "", *_folded(table.folded)] if table.folded else lines


def rows_lines(rows: Iterable[Sequence[str]]) -> list[str]:
    """Rows of cells that are Markdown already."""
    return [f"| {' | '.join(row)} |" for row in rows]


def facts_lines(rows: Dict[str, str]) -> list[str]:
    """Names and texts as a table without a head; texts are Markdown already."""
    return rows_lines([["", ""], ["---", "---"], *rows.items()])


def machine(environment: Dict[str, Any]) -> dict[str, str]:
    """Commit, machine and versions.

    Args:
        environment: As in ``environment.json``.

    Returns:
        Texts by name.
    """
    known = dict(facts(dict(environment)))
    packages = filter(None, (f"sysid {known.get('sysid', '?')}", known.get("packages", "")))
    return {
        "commit": known.get("commit", "not recorded"),
        "machine": f"{known.get('cpu', 'not recorded')}, {known.get('cores', '?')} cores",
        "versions": ", ".join(packages),
    }


def refuse_others(target: Path) -> None:
    """Leave a folder of somebody else alone.

    Args:
        target: Where a page would go.

    Raises:
        ConfigError: If something is there that was not published.
    """
    page = target / PAGE
    if not target.exists() or (page.is_file() and page.read_text(encoding="utf-8").startswith(MARK)):
        return
    raise ConfigError(
        "there is something else where the report would go",
        where=target,
        expected="no such folder, or one that sysid publish made",
        got="a folder that it did not make",
        remedy="give another name with --as, or move the folder away",
    )


def _part(part: Part, drawings: Drawings) -> list[str]:
    if isinstance(part, Table):
        return [] if part.caption.startswith("Notes of the fits") else [*table_lines(part), ""]
    if isinstance(part, Gallery):
        return [line for drawing in part.pictures for line in drawings.draw(drawing)]
    return drawings.draw(part) if isinstance(part, Picture) else [markdown(part), ""]


def _folded(sentences: Sequence[str]) -> list[str]:
    """Sentences that open when they are asked for; the empty lines keep them Markdown."""
    inside = [line for sentence in sentences for line in ("", markdown(sentence))]
    return ["<details><summary>In words</summary>", *inside, "", "</details>"]


def _name(part: Picture) -> str:
    found = re.search(r'aria-labelledby="(\S+)-title', part.svg)
    return "figure" if found is None else found.group(1)


def _cell(cell: Cell) -> str:
    text = f"**{markdown(cell.text)}**" if cell.mark == "best" and cell.text else markdown(cell.text)
    return f"{text}<br><sub>{markdown(cell.below)}</sub>" if cell.below else text
