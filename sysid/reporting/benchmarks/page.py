"""What benchmarks found as a page: verdict first, each figure beside its target and what others have, the protocol."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Final

from sysid.atomic import replacing
from sysid.names import markdown, markdown_block, markdown_code
from sysid.reporting.benchmarks.findings import (
    FINDINGS_FILE,
    Benchmark,
    Benchmarks,
    Finding,
    read_findings,
    verdict_on,
    write_findings,
)
from sysid.reporting.html import readable
from sysid.reporting.markdown import MARK, PAGE, facts_lines, machine, refuse_others, rows_lines
from sysid.reporting.scores import Score

_WORDS: Final = {True: "reached", False: "**missed**", None: ""}


def publish_benchmarks(name: str, into: Path, ran: Sequence[Benchmark]) -> Path:
    """Publish what benchmarks found; what the report holds of other benchmarks stays, with its own date and commit.

    Args:
        name: Name of the report.
        into: Folder of the published reports.
        ran: The benchmarks; one that was run by the same command before is replaced, and so is a figure that another
            command found before.

    Returns:
        The page, with :data:`sysid.reporting.benchmarks.findings.FINDINGS_FILE` beside it.

    Raises:
        ConfigError: If there is another page of that name that is not ours, or the figures beside it are damaged.
    """
    folder = into / name
    refuse_others(folder)
    kept: dict[str, Benchmark] = {}
    if (folder / FINDINGS_FILE).exists():
        kept = {benchmark.command: benchmark for benchmark in read_findings(folder).benchmarks}
    again = {finding.what for benchmark in ran for finding in benchmark.findings}
    again |= {_scored(score) for benchmark in ran for score in benchmark.scores}
    by_command = {command: _without(older, again) for command, older in kept.items()}
    by_command |= {benchmark.command: benchmark for benchmark in ran}
    report = Benchmarks(name=name, benchmarks=[one for one in by_command.values() if one])
    write_findings(folder, report)
    page = folder / PAGE
    with replacing(page) as draft:
        draft.write_text("\n".join(_lines(report)) + "\n", encoding="utf-8", newline="\n")
    return page


def _without(older: Benchmark, again: Collection[str]) -> Benchmark | None:
    """What is left of a benchmark beside figures that were found again: two figures of one thing contradict."""
    left = [finding for finding in older.findings if finding.what not in again]
    scores = [score for score in older.scores if _scored(score) not in again]
    return older.model_copy(update={"findings": left, "scores": scores}) if left or not older.findings else None


def _scored(score: Score) -> str:
    return f"{score.model}: {score.mapping}"


def _lines(report: Benchmarks) -> list[str]:
    title = report.name.replace("-", " ")
    lines = [MARK, f"# {title[:1].upper()}{title[1:]}", ""]
    if report.findings:
        lines += [f"**{markdown(verdict_on(report.findings))}**", "", *_points(report.findings)]
    machines = [machine(benchmark.environment) for benchmark in report.benchmarks]
    rows = {key: "; ".join(dict.fromkeys(one[key] for one in machines)) for key in ("machine", "versions")}
    lines += [*facts_lines({key: markdown(text) for key, text in rows.items()})]
    for benchmark in report.benchmarks:
        lines += ["", *_section(benchmark)]
    return lines


def _points(findings: Sequence[Finding]) -> list[str]:
    """What was missed, and what is open, before anything else."""
    lines = [
        f"- **{word}.** {markdown(finding.what)}: {markdown(finding.ours_text)} against "
        f"{markdown(finding.target_text)}."
        for word, verdict in (("Missed", False), ("Open", None))
        for finding in findings
        if finding.target is not None and finding.met is verdict
    ]
    return [*lines, ""] if lines else []


def _section(benchmark: Benchmark) -> list[str]:
    rows = {
        "run": markdown_code(benchmark.command),
        "date": readable(benchmark.created),
        "commit": machine(benchmark.environment)["commit"],
        "load": "not recorded" if benchmark.load is None else f"{benchmark.load:.1f} when it began",
        **{f"data: {markdown(name)}": f"SHA-256 {digest}" for name, digest in benchmark.data.items()},
    }
    lines = [f"## {markdown(benchmark.title)}", ""]
    if benchmark.findings:
        lines += [*_table(benchmark.findings), ""]
    lines += [*facts_lines(rows), ""]
    # The docstring of our own benchmark: paragraphs and code in it are meant.
    lines += [benchmark.protocol, ""] if benchmark.protocol else []
    return [
        *lines,
        "<details><summary>As printed</summary>",
        "",
        *markdown_block(benchmark.printed),
        "",
        "</details>",
    ]


def _table(findings: Sequence[Finding]) -> list[str]:
    """Figures in rows; columns that nobody fills are left out."""
    columns = {
        "figure": [finding.what for finding in findings],
        "ours": [finding.ours_text for finding in findings],
        "target": [finding.target_text for finding in findings],
        "": [_WORDS[finding.met] if finding.met is not None else _open(finding) for finding in findings],
        "published": [finding.published for finding in findings],
        "peer": [finding.peer for finding in findings],
        "note": [finding.note for finding in findings],
    }
    # The verdict is Markdown already.
    cells = {name: [text if name == "" else markdown(text) for text in texts] for name, texts in columns.items()}
    filled = {name: texts for name, texts in cells.items() if any(texts)}
    return rows_lines([list(filled), ["---"] * len(filled), *zip(*filled.values(), strict=True)])


def _open(finding: Finding) -> str:
    return "" if finding.target is None else "open"
