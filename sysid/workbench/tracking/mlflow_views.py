"""How the fits of a mapping are shown first in MLflow: which columns, in which order, and which charts.

MLflow keeps such views as tags of an experiment; its page opens one that is named in the address. What stands in a
view is the page's own words (``ExperimentPageUIState`` and ``RunsChartsCardConfig`` in its source); a page that does
not know some of them leaves them out.
"""

from __future__ import annotations

import base64
import json
import zlib
from bisect import bisect_left
from collections.abc import Sequence
from typing import Any, Final

from sysid.workbench.tracking.fit_values import OUTPUT, TARGET

VIEW: Final = "sysid"
"""Name of the view in the address of its page."""

TAG: Final = f"mlflow.sharedViewState.{VIEW}"
"""Tag of an experiment that holds the view."""

CASES_TAG: Final = "sysid.cases"
"""Tag of an experiment that holds the names of all cases that its fits were run on."""

TITLE: Final = "Fits, best first"

TAG_LIMIT: Final = 5000
"""Characters that MLflow takes in a tag of an experiment (``MAX_EXPERIMENT_TAG_VAL_LENGTH``)."""

ORDER: Final = "mean_free_run_mse"
"""Metric that the fits are sorted by, least first."""

COLUMNS: Final = {
    "metrics": (ORDER, "worst_free_run_mse", "mean_nrmse_fit", "mean_run_time_s", "parameters", "train_time_s"),
    "tags": ("fit", "output_unit", "status", "pipeline"),
    "attributes": ("Dataset", "Models"),
}
"""What matters first stands first."""

NAME_WIDTH: Final = 330
"""Pixels for a name such as ``NARX 4/4/20 · closed · BP+AR -> BC``, which MLflow would cut in half."""

METRIC_WIDTH: Final = 150
"""Pixels for the name of a metric: with :data:`ORDER_WIDTH`, the number of parameters still fits on a wide screen."""

ORDER_WIDTH: Final = 170
"""Pixels for the metric that sorts, which has a mark beside its name."""

LAYOUT: Final = {
    "at a glance": (3, 360),
    "learning": (1, 360),
    "outputs over the target": (1, 420),
    "target and output": (2, 420),
}
"""Charts side by side and their height in pixels, by section."""


def view_tag(cases: Sequence[str], created_ms: int) -> str:
    """The view of a mapping's fits as the value of its tag.

    Args:
        cases: Names of the cases, as they stand in metrics and pictures.
        created_ms: When the experiment was made, in milliseconds.

    Returns:
        Text; cases are left out from the end until it fits into a tag.
    """

    def shown(count: int) -> str:
        state = json.dumps(_state(cases[:count]), separators=(",", ":")).encode()
        packed = "deflate;" + base64.b64encode(zlib.compress(state, 9)).decode()
        return json.dumps({"name": TITLE, "createdAt": created_ms, "state": packed})

    # The first count behind which one more case is too many.
    return shown(bisect_left(range(len(cases)), True, key=lambda count: len(shown(count + 1)) > TAG_LIMIT))


def column(kind: str, name: str) -> str:
    """A column's name in MLflow's page.

    Example:
        >>> column("metrics", "parameters")
        'metrics.`parameters`'
    """
    return f"{kind}.`{name}`"


def _state(cases: Sequence[str]) -> dict[str, Any]:
    columns = [column(kind, name) for kind, names in COLUMNS.items() for name in names]
    sections = [
        ("at a glance", _overview()),
        ("learning", [_line("learning_curve_mse", scale="log")]),
        ("outputs over the target", [_line(f"{TARGET}/{case}", f"{OUTPUT}/{case}") for case in cases]),
        ("target and output", [_images(f"target and output/{case}") for case in cases]),
        ("free_run_mse", [_bar(f"free_run_mse/{case}") for case in cases]),
        ("nrmse_fit", [_bar(f"nrmse_fit/{case}") for case in cases]),
    ]
    return {
        "orderByKey": column("metrics", ORDER),
        "orderByAsc": True,
        "selectedColumns": columns,
        "columnOrder": ["attributes.`Run Name`", *columns],
        "columnWidths": {"attributes.`Run Name`": NAME_WIDTH}
        | {column("metrics", name): ORDER_WIDTH if name == ORDER else METRIC_WIDTH for name in COLUMNS["metrics"]},
        "runsHiddenMode": "FIRST_20_RUNS",
        "isAccordionReordered": True,
        "compareRunSections": [
            {"uuid": name, "name": name, "display": True, "isReordered": True, "deleted": False, "isGenerated": False}
            | dict(zip(("columns", "cardHeight"), LAYOUT.get(name, (3, 320)), strict=True))
            for name, _ in sections
        ],
        "compareRunCharts": [
            {"uuid": f"{name}-{place}", "metricSectionId": name, "deleted": False, "isGenerated": False, **chart}
            for name, charts in sections
            for place, chart in enumerate(charts)
        ],
    }


def _overview() -> list[dict[str, Any]]:
    size, time, fit = ({"key": key, "type": "METRIC"} for key in ("parameters", "mean_run_time_s", "mean_nrmse_fit"))
    return [
        _bar("mean_nrmse_fit"),
        _bar(ORDER),
        {"type": "SCATTER", "displayName": "Accuracy against size", "xaxis": size, "yaxis": fit},
        {"type": "SCATTER", "displayName": "Accuracy against run time", "xaxis": time, "yaxis": fit},
        {
            "type": "PARALLEL",
            "displayName": "Figures side by side",
            "selectedParams": [],
            "selectedMetrics": ["parameters", "train_time_s", "mean_run_time_s", "worst_free_run_mse", ORDER],
            "showAllRuns": False,
        },
    ]


def _bar(metric: str) -> dict[str, Any]:
    return {"type": "BAR", "metricKey": metric, "runsCountToCompare": 20}


def _line(*metrics: str, scale: str = "linear") -> dict[str, Any]:
    chosen = {"metricKey": metrics[0], "selectedMetricKeys": list(metrics)}
    # A line of which nothing is said is smoothed over 70 points: it then lies beside its own values.
    return {"type": "LINE", **chosen, "scaleType": scale, "xAxisKey": "step", "lineSmoothness": 0}


def _images(key: str) -> dict[str, Any]:
    return {"type": "IMAGE", "imageKeys": [key], "step": 0, "runsCountToCompare": 10}


def show(client: Any, experiment: str, cases: Sequence[str]) -> None:
    """Let the page of an experiment show first what matters first, and all cases known so far.

    Args:
        client: A client of the tracking store.
        experiment: Its identifier.
        cases: Names of cases that are new perhaps.
    """
    found = client.get_experiment(experiment)
    known = [case for case in found.tags.get(CASES_TAG, "").split("|") if case]
    both = list(dict.fromkeys([*known, *cases]))
    value = view_tag(both, found.creation_time)
    if both != known or found.tags.get(TAG) != value:
        # A list of cases as long as a tag may be is not one that anybody looks through.
        client.set_experiment_tag(experiment, CASES_TAG, "|".join(both)[:TAG_LIMIT])
        client.set_experiment_tag(experiment, TAG, value)
