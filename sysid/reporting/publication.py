"""A run as a page of text with a few figures: small enough for version control, and read where the code is read."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Final

from sysid.atomic import replacing_folder
from sysid.errors import ConfigError
from sysid.names import markdown, markdown_code
from sysid.reporting.html import readable
from sysid.reporting.kinds import read_run, run_document, run_scores
from sysid.reporting.markdown import (
    MARK,
    PAGE,
    Drawings,
    facts_lines,
    machine,
    refuse_others,
    section_lines,
)
from sysid.reporting.parts import Document
from sysid.reporting.records import RunResults
from sysid.reporting.results import Results
from sysid.reporting.scores import write_scores
from sysid.reporting.sections.fit_tables import worst_case
from sysid.reporting.sections.overview import overview_cases

LEFT_OUT: Final = ("fit-", "frequency-response", "residuals")
"""Beginnings of the anchors of sections that only the whole report has."""
BUNDLE: Final = "bundle"
"""The folder of the frozen surrogate, in a run's folder and beside a page."""
LINE: Final = "line.json"
"""The file of a frozen line, every position of it, likewise."""
FROZEN: Final = f"""
The frozen surrogate lies beside this page, in [{BUNDLE}]({BUNDLE}): what it was exported as, with its card, its range
and how far each file is from the model. `sysid simulate` runs it.
"""
FROZEN_LINE: Final = f"""
The frozen line lies beside this page, in [{LINE}]({LINE}): `sysid simulate` with `--positions` and this folder runs
every position of it in one call.
"""


def publish_run(
    run_folder: Path, into: Path, *, name: str | None = None, workspace: Path | None = None, bundle: bool = False
) -> Path:
    """Publish the report of a run, of fits or of a judgement; nothing is fitted or simulated.

    Args:
        run_folder: The run's folder.
        into: Folder of the published reports.
        name: Name of the report; the pipeline's by default.
        workspace: Where the user's own tables of published figures lie; ``None`` is the current folder.
        bundle: Whether the frozen surrogate that the run left, exported or as a line, goes with the page.

    Returns:
        The page, ``<into>/<name>/README.md``, with its figures beside it, and ``scores.json`` for programs; the
        surrogate in ``bundle``, or as ``line.json``.

    Raises:
        ConfigError: If the folder holds no results, or no surrogate that was asked for, or there is another page of
            that name that is not ours.
        BundleError: If the bundle is damaged.
    """
    document = run_document(Path(run_folder), read_run(Path(run_folder)), workspace=workspace)
    scores = run_scores(document.results, workspace=workspace)
    frozen = _frozen(Path(run_folder)) if bundle else ()
    chosen = name or document.results.pipeline
    target = into / chosen
    refuse_others(target)
    # A folder of its own that takes the place of the old one whole: no figure of an older run stays behind.
    with replacing_folder(target) as draft:
        command = f"sysid publish {run_folder} --as {chosen}{' --bundle' if frozen else ''}"
        text = _page(document, chosen, command, draft)
        for left in frozen:
            if left.is_dir():
                _copy(left, draft / BUNDLE)
                text += FROZEN
            else:
                shutil.copyfile(left, draft / LINE)
                text += FROZEN_LINE
        (draft / PAGE).write_text(text, encoding="utf-8", newline="\n")
        if scores:
            write_scores(draft, scores)
    return target / PAGE


def _copy(folder: Path, target: Path) -> None:
    """Copy a folder; what the system refuses is raised as it is, which ``shutil.copytree`` makes a list of texts of."""
    target.mkdir()
    for file in sorted(folder.iterdir()):
        if file.is_dir():
            _copy(file, target / file.name)
        else:
            shutil.copyfile(file, target / file.name)


def _frozen(run_folder: Path) -> list[Path]:
    """What a run left for use: its bundle, whole, and its line."""
    from sysid.export import read_bundle

    folder, line = run_folder / BUNDLE, run_folder / LINE
    found = [read_bundle(folder).folder] if folder.is_dir() else []
    found += [line] if line.is_file() else []
    if not found:
        raise ConfigError(
            "there is no bundle to publish",
            where=folder,
            expected=f"the bundle that a run leaves whose pipeline says export, or the {LINE} of one with a line",
            got="neither",
            remedy="run a pipeline with an export or a line, or leave --bundle out",
        )
    return found


def _page(document: Document, name: str, command: str, folder: Path) -> str:
    lines = [MARK, f"# {markdown(name)}", "", markdown(document.results.description), ""]
    lines += [f"**{markdown(document.verdict.headline)}**", ""]
    lines += [f"- **{markdown(word)}.** {markdown(sentence)}" for word, sentence in document.verdict.points]
    lines += [f"- **Warning.** {markdown(warning)}" for warning in document.verdict.warnings]
    lines += ["", *_provenance(document, command), ""]
    drawings = Drawings(folder=folder, shown=lambda drawing: _belongs(drawing, document.results))
    for section in document.sections:
        if not section.anchor.startswith(LEFT_OUT):
            lines += section_lines(section, drawings)
    lines += ["", "The whole report, with the cases of every fit: run the command above and open `report/index.html`."]
    return "\n".join(lines) + "\n"


def _provenance(document: Document, command: str) -> list[str]:
    results = document.results
    commands = {"run": markdown_code(results.command), "published": markdown_code(command)}
    rows = {
        "date": readable(results.created),
        "seed": "none" if results.seed is None else str(results.seed),
        **machine(results.environment),
        "data": f"{results.data.name}, SHA-256 {results.data.digest}" if results.data.digest else results.data.name,
    }
    return facts_lines(commands | {key: markdown(text) for key, text in rows.items()})


def _belongs(drawing: str, results: RunResults) -> bool:
    """Of the pictures of single cases of fits only that of the case where the chosen fit is weakest."""
    if not isinstance(results, Results) or not drawing.startswith(("case-", "overview-")):
        return True
    best = results.best_fit
    if best is None:
        return drawing.startswith("overview-") and drawing.endswith("-0")
    worst = worst_case(best)
    cases = list(best.cases)
    if drawing.startswith("overview-"):
        cases = overview_cases(results.mappings()[best.mapping], results.drawn)
    return drawing.endswith(f"-{cases.index(worst) if worst in cases else 0}")
