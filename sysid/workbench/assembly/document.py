"""What came of an assembly, as the tables, charts and sentences of a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from sysid.composite.active_learning import Growth, Look
from sysid.composite.limit_check import LimitCheck
from sysid.composite.limits_held import Holding, holding_table
from sysid.composite.monte_carlo import Stress
from sysid.composite.round import TrainedRound
from sysid.models import Cascade
from sysid.reporting.comparing.published import PublishedTable, read_published
from sysid.reporting.figures.thinning import thin
from sysid.reporting.numbers import number, quantity, seconds
from sysid.traces import Trace
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.lessons import Lesson, lessons_point, lessons_table
from sysid.workbench.assembly.line import LineScores
from sysid.workbench.assembly.member_scores import MemberScores, member_tables
from sysid.workbench.assembly.rounds import rounds_table
from sysid.workbench.assembly.views import (
    export_table,
    growth_charts,
    growth_table,
    limits_table,
    line_chart,
    line_metrics,
    line_point,
    line_table,
    stress_tables,
)

if TYPE_CHECKING:
    from sysid.export import Bundle

COLUMNS = 300
"""Width of the charts in points: enough for the eye, and a page of some hundred kilobytes."""

Scores = Mapping[str, Mapping[str, float]]
"""Mean squared error of the free run of the whole by output and case, in the output's unit squared."""


SELECTION = "selection"
"""Metric of a stage by which one is chosen: its error on the selection traces."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Outcome:
    """What came of a run.

    Args:
        whole: The assembly of the chosen stage.
        stages: Scores by stage, in their order.
        selection: Score of each stage on the selection traces.
        chosen: The stage that was chosen.
        notes: Sentences on how it came about, but for the rounds.
        rounds: The rounds of training end to end, if there were any.
        timing: Seconds of a free run of the whole by case.
        cases: The cases.
        limits: What is declared of limits, beside what was trained on.
        stressed: What came of the random sequences.
        worst: The sequences that the whole did worst on, for their charts.
        growth: What growing the training data brought, if it was asked for.
        unseen: By stage of growth, how it does on the random sequences.
        line: How the places do between those that are modelled, if they were asked for.
        exported: The bundle, if one was asked for.
        holding: Which limits hold the outputs in free run.
        members: The members' candidates by themselves, where there are several or they were fitted one step ahead too.
        lessons: What the stages say of lessons of modelling by parts.
    """

    whole: Cascade
    stages: Mapping[str, Scores]
    selection: Mapping[str, float]
    chosen: str
    notes: Sequence[str]
    rounds: Sequence[TrainedRound]
    timing: Mapping[str, float]
    cases: Sequence[Trace]
    limits: LimitCheck
    stressed: Stress | None
    worst: Sequence[Trace] = ()
    growth: Sequence[Growth] = ()
    unseen: Mapping[str, Look] = field(default_factory=dict)
    line: LineScores | None = None
    exported: Bundle | None = None
    holding: Sequence[Holding] = ()
    members: Sequence[MemberScores] = ()
    lessons: Sequence[Lesson] = ()


def document(config: AssemblyConfig, found: Outcome) -> dict[str, Any]:
    """All of it, as :class:`sysid.reporting.judging.tables.JudgementRecord` has it.

    Args:
        config: The pipeline.
        found: What came of the run.

    Returns:
        JSON values.
    """
    whole = found.whole
    return {
        "title": "The assembly",
        "headline": _headline(config, found),
        "points": _points(config, found),
        "sentences": [
            f"The whole has {len(whole.models)} models and {whole.n_parameters} parameters; it reads "
            f"{', '.join(whole.inputs)} and nothing else.",
            f"The stage was chosen by the error of the whole on the selection traces "
            f"({found.selection[found.chosen]:.3g}, a geometric mean over traces and outputs).",
            *([found.limits.sentence] if found.limits.sentence else []),
            *found.notes,
        ],
        "tables": _tables(config, found),
        "charts": [
            *(chart for one in found.growth for chart in growth_charts(one, found.unseen)),
            *(_chart(whole, trace, name) for name in config.outputs for trace in found.cases),
            *([] if found.line is None else [line_chart(found.line, name) for name in found.line.mse]),
            *([] if found.stressed is None else [_chart(whole, one, found.stressed.output) for one in found.worst]),
        ],
        "scores": [_score(config, name, found) for name in config.outputs],
        "metrics": {
            stage: {SELECTION: found.selection[stage]}
            | {f"{output}/{case}/mse": value for output, by in scores.items() for case, value in by.items()}
            | (line_metrics(found.line) if found.line is not None and stage == found.chosen else {})
            for stage, scores in found.stages.items()
        },
    }


def _tables(config: AssemblyConfig, found: Outcome) -> list[dict[str, Any]]:
    """The stages first, then how they came about, and what else the whole was put to."""
    published = None if config.published_models is None else read_published(config.published_models)
    tables = [_stage_table(config, name, found, published) for name in config.outputs]
    tables += [growth_table(one, found.chosen, found.unseen) for one in found.growth]
    if found.lessons:
        tables.append(lessons_table(found.lessons))
    tables += [table for one in found.members for table in member_tables(one, published)]
    if found.rounds:
        tables.append(rounds_table(found.rounds))
    if found.line is not None:
        tables += [line_table(found.line, output) for output in found.line.mse]
    if found.stressed is not None:
        tables += stress_tables(found.stressed)
    tables.append(_time_table(found.timing, found.cases))
    if found.holding:
        tables.append(holding_table(found.holding))
    if found.limits.passed:
        tables.append(limits_table(found.limits))
    if found.exported is not None:
        tables.append(export_table(found.exported))
    return tables


def _squared(output: str, found: Outcome) -> str:
    """The unit of an output's squared error."""
    return f"{found.cases[0].channel(output).unit}²"


def _headline(config: AssemblyConfig, found: Outcome) -> str:
    parts, scores = [], found.stages[found.chosen]
    for output in config.outputs:
        worst = max(scores[output], key=lambda case: scores[output][case])
        parts.append(f"{output} at worst {quantity(scores[output][worst], _squared(output, found))} ({worst})")
    return f"From {' and '.join(found.whole.inputs)} alone, {found.chosen}: mean squared error of {'; '.join(parts)}."


def _points(config: AssemblyConfig, found: Outcome) -> list[tuple[str, str]]:
    """How good, how good beside what is published, how fast, and where it is weak."""
    scores = found.stages[found.chosen]
    spreads = (_spread(name, scores[name], _squared(name, found)) for name in config.outputs)
    points = [("Accuracy", f"Mean squared error of the free run: {'; '.join(spreads)}.")]
    beside = [_beside(name, scores[name], config) for name in config.outputs if name in config.published]
    points += [("Published", f"{'; '.join(beside)}.")] if beside else []
    lengths = {trace.name: len(trace) * trace.sample_time for trace in found.cases}
    slow = max(found.timing, key=lambda case: found.timing[case] / lengths[case])
    points.append(
        (
            "Speed",
            f"A free run of {quantity(lengths[slow], 's')} ({slow}) takes {seconds(found.timing[slow])} on one core.",
        )
    )
    points += [lessons_point(found.lessons)] if found.lessons else []
    points += [line_point(found.line)] if found.line else []
    stressed = found.stressed
    if stressed is not None:
        points.append(
            (
                "Weakness",
                f"Of {stressed.sequences} random sequences {stressed.lost} diverge and "
                f"{number(100.0 * stressed.within)} % stay within {stressed.limit:g} {stressed.unit} (root mean "
                f"square of {stressed.output}); the worst is {stressed.worst[0][0]} with "
                f"{quantity(stressed.worst[0][1], stressed.unit)}.",
            )
        )
    return points


def _score(config: AssemblyConfig, output: str, found: Outcome) -> dict[str, Any]:
    """The errors of an output by case, for a scorecard."""
    whole, published = found.whole, config.published.get(output)
    return {
        "mapping": f"{'+'.join(whole.inputs)} -> {output}",
        "unit": found.cases[0].channel(output).unit,
        "model": f"{len(whole.models)} models as one, {whole.n_parameters} parameters",
        "mse": dict(found.stages[found.chosen][output]),
        "published": {} if published is None else dict(published.mse),
        "source": "" if published is None else published.source,
    }


def _spread(output: str, by_case: Mapping[str, float], unit: str) -> str:
    low, high = min(by_case, key=lambda case: by_case[case]), max(by_case, key=lambda case: by_case[case])
    return f"{output} between {number(by_case[low])} ({low}) and {quantity(by_case[high], unit)} ({high})"


def _beside(output: str, by_case: Mapping[str, float], config: AssemblyConfig) -> str:
    published = config.published[output]
    ratios = [by_case[case] / value for case, value in published.mse.items() if case in by_case]
    reached = sum(ratio <= published.target for ratio in ratios)
    below = sum(ratio <= 1.0 for ratio in ratios)
    aim = "" if published.target == 1.0 else f" ({published.target:g} of it, which was aimed at, on {reached})"
    return f"{output} at or below {published.source} on {below} of {len(ratios)} cases{aim}"


def _stage_table(
    config: AssemblyConfig, output: str, found: Outcome, table: PublishedTable | None = None
) -> dict[str, Any]:
    cases = [trace.name for trace in found.cases]
    rows: list[list[Any]] = [
        [
            f"{stage} (chosen)" if stage == found.chosen else stage,
            *(scores[output][case] for case in cases),
            found.selection[stage],
        ]
        for stage, scores in found.stages.items()
    ]
    published = config.published.get(output)
    if published is not None:
        rows.append([published.source, *(published.mse.get(case) for case in cases), None])
        aimed = [_share(published.mse.get(case), published.target) for case in cases]
        rows.append([f"aimed at: {published.target:g} of it", *aimed, None])
    if table is not None and config.published_whole is not None:
        unit = f"{found.cases[0].channel(output).unit}^2"
        wholes = table.by_variant(
            mapping=config.published_whole, quantity="mse", run="free_run", signal=output, unit=unit
        )
        rows += [
            [said, *(by[case].value if case in by else None for case in cases), None] for said, by in wholes.items()
        ]
    return {
        "caption": f"{output}: mean squared error of the free run of the whole [{_squared(output, found)}]",
        "head": [["Stage", ""], *([case, ""] for case in cases), ["Selection", "geometric mean"]],
        "rows": rows,
        "note": "From the inputs of the whole alone. No case had a say in any choice.",
    }


def _share(value: float | None, target: float) -> float | None:
    return None if value is None else value * target


def _time_table(timing: Mapping[str, float], cases: Sequence[Trace]) -> dict[str, Any]:
    lengths = {trace.name: len(trace) * trace.sample_time for trace in cases}
    return {
        "caption": "Run time of the whole, compiled, on one core",
        "head": [["Case", ""], ["Length", "s"], ["Run", "ms"], ["Per simulated second", "µs"]],
        "rows": [[case, lengths[case], 1e3 * t, 1e6 * t / lengths[case]] for case, t in timing.items()],
        "note": "Median of five runs after one that is not counted.",
    }


def _chart(whole: Cascade, trace: Trace, output: str) -> dict[str, Any]:
    run = whole.simulate_trace(trace)
    lines = []
    for name, values in (("reference", trace[output]), ("assembly", run[output])):
        kept = thin(trace.time, np.asarray(values), COLUMNS)
        lines.append({"name": name, "x": kept[0].tolist(), "y": kept[1].tolist(), "target": name == "reference"})
    unit = trace.channel(output).unit
    return {
        "title": f"{output}, {trace.name}",
        "caption": f"{output} of {trace.name}: the reference, and the whole from its inputs alone.",
        "x": "time (s)",
        "y": f"{output} ({unit})",
        "lines": lines,
    }
