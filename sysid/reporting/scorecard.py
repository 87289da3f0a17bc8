"""A scorecard in Markdown: our free-run errors and the published ones, from the results of runs and not from memory.

``python -m sysid.reporting.scorecard runs/service-brake runs/combined-brake`` prints it.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from sysid.reporting.comparison import with_published
from sysid.reporting.numbers import number, seconds
from sysid.reporting.published import read_published
from sysid.reporting.results import FitRecord, Results, read_results


def scorecard(run_folders: Sequence[Path]) -> str:
    """One table for each run: the chosen fit by case, with the published figure and the ratio of the two.

    Args:
        run_folders: Folders of finished runs.

    Returns:
        Markdown.

    Raises:
        ConfigError: If a folder holds no results.
    """
    tables = []
    for folder in run_folders:
        stored = read_results(Path(folder))
        table = None if stored.published is None else read_published(stored.published)
        tables.append(_table(with_published(stored, table)))
    return "\n\n".join(tables) + "\n"


def _table(results: Results) -> str:
    fit = results.best_fit or results.fits[0]
    title = f"{fit.mapping.replace('->', '→')}, free-run mse [{fit.unit}²]"
    rows = [
        [title, *fit.cases, "training", f"{number(_simulated(fit))} s take"],
        ["---"] * (len(fit.cases) + 3),
        [
            f"{fit.label}, {fit.loop.value} loop",
            *(number(case.free_run.mse, missing="diverged") for case in fit.cases.values()),
            seconds(fit.train_time_s),
            seconds(max(fit.cases.values(), key=lambda case: case.simulated_s).run_time_s),
        ],
    ]
    published = [(case.published or {}).get("free_run") for case in fit.cases.values()]
    known = [figure for figure in published if figure is not None]
    if known:
        source = ", ".join(dict.fromkeys(f"{figure.source}: {figure.label}" for figure in known))
        cells = ["" if figure is None else number(figure.value) for figure in published]
        ratios = ["" if figure is None else number(figure.ratio, digits=2) for figure in published]
        rows += [[f"published ({source})", *cells, "", ""], ["ours divided by it", *ratios, "", ""]]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _simulated(fit: FitRecord) -> float:
    return max(case.simulated_s for case in fit.cases.values())


if __name__ == "__main__":
    sys.stdout.write(scorecard([Path(argument) for argument in sys.argv[1:]]))
