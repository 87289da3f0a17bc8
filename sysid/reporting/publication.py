"""A run as a page of text with a few figures: small enough for version control, and read where the code is read."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator, Sequence
from collections.abc import Mapping as Dict
from pathlib import Path
from typing import Any, Final

from sysid.atomic import replacing
from sysid.errors import ConfigError
from sysid.reporting.comparison import with_published
from sysid.reporting.document import Document, build_document
from sysid.reporting.html import readable
from sysid.reporting.parts import Part, Picture, Section
from sysid.reporting.published import read_published
from sysid.reporting.results import Results, read_results
from sysid.reporting.tables import Cell, Table, facts, scored_cases

PAGE: Final = "README.md"
"""Name of the page in its folder, so that whoever opens the folder sees it."""

MARK: Final = "<!-- made by sysid publish -->"
"""First line of every page that this file makes; a folder without it is somebody else's."""

LEFT_OUT: Final = ("fit-", "frequency-response", "residuals")
"""Beginnings of the anchors of sections that only the whole report has."""

SIZE_LIMIT: Final = 600_000
"""Bytes of all figures together; what would go beyond is left to the whole report."""


def publish_run(run_folder: Path, into: Path, *, name: str | None = None, workspace: Path | None = None) -> Path:
    """Publish the report of a run; nothing is fitted or simulated.

    Args:
        run_folder: The run's folder.
        into: Folder of the published reports.
        name: Name of the report; the pipeline's by default.
        workspace: Where the user's own tables of published figures lie; ``None`` is the current folder.

    Returns:
        The page, ``<into>/<name>/README.md``, with its figures beside it.

    Raises:
        ConfigError: If the folder holds no results, or there is another page of that name that is not ours.
    """
    folder = Path(run_folder)
    stored = read_results(folder)
    published = None if stored.published is None else read_published(stored.published, workspace=workspace)
    results = with_published(stored, published)
    document = build_document(folder, results, published)
    chosen = name or results.pipeline
    target = into / chosen
    _refuse_others(target)
    into.mkdir(parents=True, exist_ok=True)
    # A folder of its own that takes the place of the old one whole: no figure of an older run stays behind.
    with tempfile.TemporaryDirectory(dir=into, prefix=f".{chosen}-") as scratch:
        draft = Path(scratch) / chosen
        draft.mkdir()
        text = _page(document, results, chosen, f"sysid publish {run_folder} --as {chosen}", draft)
        (draft / PAGE).write_text(text, encoding="utf-8", newline="\n")
        if target.exists():
            target.rename(Path(scratch) / "before")
        draft.rename(target)
    return target / PAGE


def publish_text(
    name: str, into: Path, *, parts: Dict[str, str], commands: Sequence[str], created: str, environment: Dict[str, Any]
) -> Path:
    """Publish what commands have printed, such as benchmarks, with what they were run on.

    Args:
        name: Name of the report.
        into: Folder of the published reports.
        parts: What was printed, by heading.
        commands: The commands that print it again.
        created: When it was printed, ISO 8601.
        environment: The machine and the packages, as in ``environment.json``.

    Returns:
        The page.

    Raises:
        ConfigError: If there is another page of that name that is not ours.
    """
    _refuse_others(into / name)
    known = dict(facts(dict(environment)))
    rows = {"run": "<br>".join(f"`{command}`" for command in commands), "date": readable(created), **_machine(known)}
    lines = [MARK, f"# {name}", "", "| | |", "|---|---|", *(f"| {key} | {text} |" for key, text in rows.items())]
    for heading, text in parts.items():
        lines += ["", f"## {heading}", "", "```text", text.rstrip("\n"), "```"]
    page = into / name / PAGE
    with replacing(page) as draft:
        draft.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
    return page


def _machine(environment: Dict[str, str]) -> dict[str, str]:
    packages = filter(None, (f"sysid {environment.get('sysid', '?')}", environment.get("packages", "")))
    return {
        "commit": environment.get("commit", "not recorded"),
        "machine": f"{environment.get('cpu', 'not recorded')}, {environment.get('cores', '?')} cores",
        "versions": ", ".join(packages),
    }


def _refuse_others(target: Path) -> None:
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


def _page(document: Document, results: Results, name: str, command: str, folder: Path) -> str:
    lines = [MARK, f"# {name}", "", results.description, ""]
    lines += [f"**{_arrow(document.verdict.headline)}**", ""]
    lines += [f"- **{word}.** {_arrow(sentence)}" for word, sentence in document.verdict.points]
    lines += [f"- **Warning.** {warning}" for warning in document.verdict.warnings]
    lines += ["", *_provenance(results, command)]
    room = [SIZE_LIMIT]
    for section in document.sections:
        if not section.anchor.startswith(LEFT_OUT):
            lines += _section(section, results, folder, room)
    lines += ["", "The whole report, with every case of every fit: run the command above and open `report/index.html`."]
    return "\n".join(lines) + "\n"


def _provenance(results: Results, command: str) -> list[str]:
    rows = {
        "run": f"`{results.command}`",
        "published": f"`{command}`",
        "date": readable(results.created),
        "seed": str(results.seed),
        **_machine(dict(facts(results.environment))),
        "data": f"{results.data.name}, SHA-256 {results.data.digest}",
    }
    return ["| | |", "|---|---|", *(f"| {key} | {_escape(text)} |" for key, text in rows.items()), ""]


def _section(section: Section, results: Results, folder: Path, room: list[int]) -> list[str]:
    lines = [f"## {section.title}", ""]
    for part in section.parts:
        lines += _part(part, results, folder, room)
    return lines


def _part(part: Part, results: Results, folder: Path, room: list[int]) -> list[str]:
    if isinstance(part, Table):
        return [] if part.caption.startswith("Notes of the fits") else [*_table(part), ""]
    if isinstance(part, Picture):
        name = _name(part)
        # Standing alone, an SVG needs the name space that it does without inside HTML.
        text = part.svg.replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1)
        if not _shown(name, results) or len(text) > room[0]:
            return []
        room[0] -= len(text)
        (folder / f"{name}.svg").write_text(text + "\n", encoding="utf-8", newline="\n")
        return [f"![{_escape(part.caption)}]({name}.svg)", "", f"*{_arrow(part.caption)}*", ""]
    return [_arrow(part), ""]


def _name(part: Picture) -> str:
    found = re.search(r'aria-labelledby="(\S+)-title', part.svg)
    return "figure" if found is None else found.group(1)


def _shown(name: str, results: Results) -> bool:
    """Of the pictures of single cases only that of the case where the chosen fit is weakest."""
    best = results.best_fit
    if not name.startswith("case-") or best is None:
        return not name.startswith("case-")
    judged = scored_cases(best) or best.cases
    worst = max(judged, key=lambda case: judged[case].free_run.mse)
    return name.endswith(f"-{list(best.cases).index(worst)}")


def _table(table: Table) -> list[str]:
    head = [_escape(" ".join(filter(None, (name, f"({below})" if below else "")))) for name, below in table.head]
    rows = [[_cell(cell) for cell in row] for row in table.rows]
    lines = [f"{_arrow(table.caption)}", "", *_rows([head, ["---"] * len(head), *rows])]
    return [*lines, "", f"*{_arrow(table.note)}*"] if table.note else lines


def _rows(rows: list[list[str]]) -> Iterator[str]:
    return (f"| {' | '.join(row)} |" for row in rows)


def _cell(cell: Cell) -> str:
    text = f"**{_escape(cell.text)}**" if cell.mark == "best" and cell.text else _escape(cell.text)
    return f"{text}<br><sub>{_escape(cell.below)}</sub>" if cell.below else text


def _escape(text: str) -> str:
    return _arrow(text).replace("|", "\\|").replace("\n", " ")


def _arrow(text: str) -> str:
    return text.replace("->", "→").replace("<", "&lt;")
