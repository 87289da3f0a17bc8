"""The scorecard: our errors, the published ones and the best peer's, from published reports and not from memory.

    python -m sysid.reporting.scorecard reports/service-brake reports/public-benchmarks [--into README.md]

With ``--into`` it stands between the line ``<!-- scorecard: (the command) -->`` and ``<!-- end of the scorecard -->``.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from sysid.atomic import replacing
from sysid.errors import ConfigError
from sysid.names import markdown
from sysid.reporting.benchmarks.findings import FINDINGS_FILE, Finding, read_findings
from sysid.reporting.kinds import read_run, run_scores
from sysid.reporting.markdown import rows_lines
from sysid.reporting.numbers import number
from sysid.reporting.records import RESULTS_FILE
from sysid.reporting.scores import SCORES_FILE, Score, read_scores
from sysid.units import squared

_SETTING: Final = re.compile(r", (?:(?:ARX|TF|NARX|NSS) .*|n = \d+|full)$|(?<=: time of ).*?(?= to )")
"""What tells findings on the same record apart: a structure, a number of samples, a tool."""

_SOURCE: Final = re.compile(r"(?:;| \([^()]*(?:et al\.|jax-sysid|tried)).*$")
"""Where a figure is from, which its report says."""

PLACE: Final = re.compile(r"(<!-- scorecard: (?P<command>[^\n]*) -->\n).*?(<!-- end of the scorecard -->)", re.DOTALL)


def scorecard(folders: Sequence[Path]) -> str:
    """Two tables: errors of the free run by case, and what benchmarks found beside published figures.

    Args:
        folders: Folders of published reports, or of runs.

    Returns:
        Markdown.

    Raises:
        ConfigError: If figures are damaged, or a folder has none.
    """
    ours: list[Score] = []
    peers: list[Score] = []
    findings: list[Finding] = []
    for folder in map(Path, folders):
        if (folder / FINDINGS_FILE).exists():
            found = read_findings(folder)
            findings += found.findings
            peers += [score for benchmark in found.benchmarks for score in benchmark.scores]
        if (folder / SCORES_FILE).exists() or not (folder / FINDINGS_FILE).exists():
            ours += _scores(folder)
    tables = [_errors(ours, peers), _benchmarks(findings)]
    return "\n\n".join("\n".join(table) for table in tables if table) + "\n"


def _scores(folder: Path) -> list[Score]:
    """Of a published report, or of the folder of a run of any kind."""
    if (folder / RESULTS_FILE).exists() and not (folder / SCORES_FILE).exists():
        return run_scores(read_run(folder))
    return read_scores(folder)


def place(text: str, path: Path) -> str:
    """A page with the scorecard where it belongs.

    Args:
        text: The scorecard.
        path: The page.

    Returns:
        The page's text.

    Raises:
        ConfigError: If the page has no place for it.
    """
    page = path.read_text(encoding="utf-8")
    if PLACE.search(page) is None:
        raise ConfigError(
            "the page has no place for the scorecard",
            where=path,
            expected="<!-- scorecard: (the command) --> and <!-- end of the scorecard -->, on lines of their own",
            got="no such lines",
            remedy="add the two lines where it shall stand",
        )
    return PLACE.sub(lambda found: f"{found[1]}\n{text}\n{found[3]}", page)


def _errors(ours: Sequence[Score], peers: Sequence[Score]) -> list[str]:
    """Three rows a mapping: ours, what is published, the best of the peers."""
    if not ours:
        return []
    cases = list(dict.fromkeys(case for score in ours for case in score.mse))
    rows = [["free run, mean squared error", *cases], ["---"] * (len(cases) + 1)]
    for score in ours:
        scale, of_squares = _scale(score), squared(score.unit)
        unit = of_squares if scale == 1.0 else f"10⁻³ {of_squares}"
        rows.append(
            [
                f"**{markdown(score.mapping)}** [{unit}]: {markdown(score.model)}",
                *_cells(score.mse, cases, scale),
            ]
        )
        if score.published:
            rows.append([f"published ({markdown(score.source)})", *_cells(score.published, cases, scale)])
        rivals = [peer for peer in peers if (peer.mapping, peer.unit) == (score.mapping, score.unit)]
        if rivals:
            best = min(rivals, key=Score.typical)
            rows.append([f"best of {len(rivals)} peers: {markdown(best.model)}", *_cells(best.mse, cases, scale)])
    return rows_lines(rows)


def _scale(score: Score) -> float:
    """Small errors are printed in thousandths."""
    return 1.0 if score.typical(without=()) > 1.0 else 1e3


def _cells(errors: dict[str, float], cases: Sequence[str], scale: float) -> list[str]:
    return [number(scale * errors[case], missing="diverges") if case in errors else "" for case in cases]


def _benchmarks(findings: Sequence[Finding]) -> list[str]:
    """On each record our least error beside the published one, and of each comparison of times the closest."""
    kept: dict[tuple[str, str, bool], Finding] = {}
    for one in findings:
        if not one.published and not (one.peer and one.target is not None):
            continue
        key = (_SETTING.sub("", one.what), one.unit, one.at_least)
        # What a peer was measured on too comes first.
        if key not in kept or _rank(one) < _rank(kept[key]):
            kept[key] = one
    if not kept:
        return []
    rows = [["benchmark (sources in its report)", "ours", "published", "peer"], ["---"] * 4]
    rows += [[markdown(one.what), one.ours_text, *map(_brief, (one.published, one.peer))] for one in kept.values()]
    return rows_lines(rows)


def _rank(one: Finding) -> tuple[bool, float]:
    """What is shown of several findings on a record comes first; where more is better, that is what is worst for us."""
    lost = -math.inf if one.at_least else math.inf
    return (not one.peer, lost if math.isnan(one.ours) else one.ours)


def _brief(text: str) -> str:
    return markdown(_SOURCE.sub("", text))


def main(arguments: Sequence[str]) -> None:
    """Print the scorecard, or write it into a page."""
    folders = [Path(argument) for argument in arguments if not argument.startswith("--")]
    pages = folders[-1:] if "--into" in arguments else []
    text = scorecard([folder for folder in folders if folder not in pages])
    for page in pages:
        changed = place(text, page)
        with replacing(page) as draft:
            draft.write_text(changed, encoding="utf-8", newline="\n")
    if not pages:
        sys.stdout.write(text)


if __name__ == "__main__":
    main(sys.argv[1:])
