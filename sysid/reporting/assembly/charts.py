"""Charts of an assembly: free runs over the reference, errors over training data and over positions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sysid.reporting.assembly.results import ActiveLearningRecord, PositionErrors
from sysid.reporting.assembly.tables import limit_text, picked_text
from sysid.reporting.charts import Chart, Line
from sysid.reporting.figures.thinning import thin
from sysid.reporting.signals import CaseSignals

COLUMNS = 300
"""Width of the charts in points: enough for the eye, and a page of some hundred kilobytes."""


def free_run_charts(signals: Mapping[str, CaseSignals], output: str, unit: str) -> list[Chart]:
    """The reference, and the whole from its inputs alone.

    Args:
        signals: By case.
        output: The output.
        unit: Its unit.

    Returns:
        A chart a case.
    """
    return [
        Chart(
            title=f"{output}, {case}",
            caption=f"{output} of {case}: the reference, and the whole from its inputs alone.",
            x="time (s)",
            y=f"{output} ({unit})",
            lines=[
                _thin("reference", one.time, one.target, target=True),
                _thin("assembly", one.time, one.simulated, target=False),
            ],
        )
        for case, one in signals.items()
    ]


def _thin(name: str, time: np.ndarray, values: np.ndarray, *, target: bool) -> Line:
    x, y = thin(time, values, COLUMNS)
    return Line(name=name, x=x, y=y, how="target" if target else "line")


def active_learning_charts(found: ActiveLearningRecord) -> list[Chart]:
    """Error, and share of sequences within the limit, over samples trained on.

    Args:
        found: The rounds.

    Returns:
        Two charts.
    """
    held_out = [one.held_out for one in found.rounds]
    random = [one.monte_carlo.p99 for one in found.rounds if one.monte_carlo is not None]
    samples = [float(one.samples) for one in found.rounds]
    said = (
        f"on {found.held_out} sequences of the pool that train nothing, over the samples that the whole was trained "
        f"on; each round, a mark, adds sequences {picked_text(found)}."
    )
    outputs = ", ".join(found.outputs)
    return [
        Chart(
            title="Error over data",
            caption=f"Error of {outputs} {said}",
            x="samples trained on",
            y=f"root mean square error of a sequence{f' ({found.unit})' if found.unit else ''}",
            logarithmic="xy",
            lines=[
                Line(name="99 % of the sequences under", x=samples, y=[one.p99 for one in held_out], how="points"),
                Line(name="median", x=samples, y=[one.median for one in held_out], how="points"),
                *(
                    [Line(name="99 % of the random sequences under", x=samples, y=random, how="points")]
                    if len(random) == len(samples)
                    else []
                ),
                Line(name="aimed at", x=samples, y=[found.limit] * len(samples), how="target"),
            ],
        ),
        Chart(
            title="Share over data",
            caption=f"Share with an error of {outputs} under {limit_text(found)} {said}",
            x="samples trained on",
            y="share of the sequences (%)",
            logarithmic="x",
            lines=[
                Line(
                    name=f"under {limit_text(found)}",
                    x=samples,
                    y=[100.0 * one.within for one in held_out],
                    how="points",
                ),
                Line(name="aimed at", x=samples, y=[100.0 * found.aim] * len(samples), how="target"),
            ],
        ),
    ]


def position_chart(found: PositionErrors, output: str) -> Chart:
    """Error over the position.

    Args:
        found: Errors of an output.
        output: The output.

    Returns:
        The chart.
    """
    lines = [Line(name=case, x=found.positions, y=errors) for case, errors in found.mse.items()]
    knots = [position for position, fitted in zip(found.positions, found.fitted, strict=True) if fitted]
    if knots:
        lines.append(Line(name="fitted here", x=knots, y=[0.0] * len(knots), how="marks"))
    return Chart(
        title=f"{output} along the line",
        caption=f"Mean squared error of {output} at every position, from the inputs of the whole alone.",
        x="position",
        y=f"mean squared error of {output}",
        lines=lines,
    )
