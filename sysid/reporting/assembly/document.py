"""The page of an assembly: its verdict, its stages and how they came about, made of stored figures."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from sysid.reporting.assembly.ablation import ablation_point, ablation_table
from sysid.reporting.assembly.charts import active_learning_charts, free_run_charts, position_chart
from sysid.reporting.assembly.member_tables import member_tables
from sysid.reporting.assembly.results import (
    AssemblyResults,
    InterpolationRecord,
    LimitCheckRecord,
    MonteCarloRecord,
)
from sysid.reporting.assembly.rounds import rounds_table
from sysid.reporting.assembly.tables import (
    active_learning_table,
    doubt_table,
    equation_table,
    limit_check_table,
    limit_table,
    monte_carlo_tables,
    position_table,
    stage_table,
    time_table,
)
from sysid.reporting.charts import Chart, chart_pictures
from sysid.reporting.numbers import number, quantity, seconds
from sysid.reporting.parts import Document, Part, Section, Verdict, data_set_section
from sysid.reporting.published.tables import PublishedTable, read_published
from sysid.reporting.sections.fit_tables import export_table
from sysid.reporting.signals import MONTE_CARLO_FILE, read_signals
from sysid.reporting.tables import Table, plain_table
from sysid.units import squared

ANCHOR = "the-assembly"


def assembly_document(folder: Path, results: AssemblyResults, workspace: Path | None = None) -> Document:
    """The parts of the page.

    Args:
        folder: The run's folder, with its signals.
        results: Its results.
        workspace: Where the user's own tables of published figures lie; ``None`` is the current folder.

    Returns:
        The parts.

    Raises:
        ConfigError: If the signals are missing or damaged, or the table of published models is not known.
    """
    published = None
    if results.published_models is not None:
        published = read_published(results.published_models, workspace=workspace)
    tables, charts = _tables(results, published), chart_pictures(_charts(folder, results), ANCHOR)
    parts: list[Part] = [*_sentences(results), *tables[:1], *charts[:1], *tables[1:], *charts[1:]]
    sections = [
        Section(anchor=ANCHOR, title="The assembly", parts=tuple(parts)),
        Section(anchor="judged", title="What was judged", parts=(_stages(results), *_known(results))),
        *data_set_section(results.data),
    ]
    verdict = Verdict(headline=headline(results), tiles=(), points=tuple(_points(results)), warnings=())
    return Document(results=results, verdict=verdict, sections=tuple(sections))


def _tables(results: AssemblyResults, published: PublishedTable | None) -> list[Table]:
    """The stages first, then how they came about, and what else the whole was put to."""
    passed = None if results.limit_check is None else limit_check_table(results.limit_check)
    positions = results.interpolation
    exported = export_table(
        [(results.whole.stage, one) for one in results.exports], next((one.unit for one in results.exports), "")
    )
    return [
        *(stage_table(results, output, published) for output in results.outputs),
        *(active_learning_table(one, results.whole.stage) for one in results.active_learning),
        *([ablation_table(results.ablation)] if results.ablation else []),
        *(table for one in results.members for table in member_tables(one, published)),
        *([rounds_table(results.rounds)] if results.rounds else []),
        *(
            []
            if positions is None
            else [position_table(one, positions.run_time_s, name) for name, one in positions.outputs.items()]
        ),
        *([] if results.monte_carlo is None else monte_carlo_tables(results.monte_carlo)),
        *([] if results.doubt is None else [doubt_table(results.doubt)]),
        time_table(results),
        *([limit_table(results.limits)] if results.limits else []),
        *([] if passed is None else [passed]),
        *([] if exported is None else [exported]),
    ]


def _charts(folder: Path, results: AssemblyResults) -> list[Chart]:
    positions, found = results.interpolation, results.monte_carlo
    charts = [chart for one in results.active_learning for chart in active_learning_charts(one)]
    for output, about in results.outputs.items():
        signals = read_signals(folder, list(results.cases), of=output)
        charts += free_run_charts(signals, output, about.unit)
    charts += [] if positions is None else [position_chart(one, name) for name, one in positions.outputs.items()]
    if found is not None:
        worst = [one.name for one in found.worst]
        signals = read_signals(folder, worst, of=found.output, file=MONTE_CARLO_FILE)
        charts += free_run_charts(signals, found.output, found.unit)
    return charts


def _stages(results: AssemblyResults) -> Table:
    return plain_table(
        "What was judged, and what it is made of.",
        [("", ""), ("models", "")],
        [[stage.name, "; ".join(stage.networks)] for stage in results.stages],
    )


def _known(results: AssemblyResults) -> list[Table]:
    return [equation_table(results.equations)] if results.equations else []


def _squared(results: AssemblyResults, output: str) -> str:
    """The unit of an output's squared error."""
    return squared(results.outputs[output].unit)


def headline(results: AssemblyResults) -> str:
    """The verdict in a sentence: the worst case of each output.

    Args:
        results: Of the run.

    Returns:
        The sentence.
    """
    parts = []
    for output, by_case in results.chosen.mse.items():
        worst = max(by_case, key=lambda case: by_case[case])
        error = quantity(by_case[worst], _squared(results, output), missing="diverged")
        parts.append(f"{output} at worst {error} ({worst})")
    return (
        f"From {' and '.join(results.whole.inputs)} alone, {results.whole.stage}: mean squared error of "
        f"{'; '.join(parts)}."
    )


def _points(results: AssemblyResults) -> list[tuple[str, str]]:
    """How good, how good beside what is published, how fast, and where it is weak."""
    mse = results.chosen.mse
    spreads = (_spread(name, mse[name], _squared(results, name)) for name in results.outputs)
    points = [("Accuracy", f"Mean squared error of the free run: {'; '.join(spreads)}.")]
    beside = [_beside(name, mse[name], results) for name in results.outputs if name in results.published]
    points += [("Published", f"{'; '.join(beside)}.")] if beside else []
    slow = max(results.cases, key=lambda case: results.cases[case].run_time_s / results.cases[case].duration_s)
    length, taken = quantity(results.cases[slow].duration_s, "s"), seconds(results.cases[slow].run_time_s)
    points.append(("Speed", f"A free run of {length} ({slow}) takes {taken} on one core."))
    points += [ablation_point(results.ablation)] if results.ablation else []
    points += [] if results.interpolation is None else [_position_point(results.interpolation)]
    points += [] if results.monte_carlo is None else [("Weakness", _weakness(results.monte_carlo))]
    return points


def _spread(output: str, by_case: Mapping[str, float], unit: str) -> str:
    low, high = min(by_case, key=lambda case: by_case[case]), max(by_case, key=lambda case: by_case[case])
    return f"{output} between {number(by_case[low])} ({low}) and {quantity(by_case[high], unit)} ({high})"


def _beside(output: str, by_case: Mapping[str, float], results: AssemblyResults) -> str:
    published = results.published[output]
    ratios = [by_case[case] / value for case, value in published.mse.items() if case in by_case]
    reached = sum(ratio <= published.target for ratio in ratios)
    below = sum(ratio <= 1.0 for ratio in ratios)
    aim = "" if published.target == 1.0 else f" ({published.target:g} of it, which was aimed at, on {reached})"
    return f"{output} at or below {published.source} on {below} of {len(ratios)} cases{aim}"


def _weakness(found: MonteCarloRecord) -> str:
    return (
        f"Of {found.sequences} random sequences {found.lost} diverge and {number(100.0 * found.within)} % stay within "
        f"{found.limit:g} {found.unit} (root mean square of {found.output}); the worst is {found.worst[0].name} with "
        f"{quantity(found.worst[0].rmse, found.unit, missing='no number')}.{_weakest_kind(found)}"
    )


def _weakest_kind(found: MonteCarloRecord) -> str:
    """Of several kinds the one with the fewest under the limit: an average over kinds hides it."""
    if not found.by_kind:
        return ""
    kind, one = min(found.by_kind.items(), key=lambda item: item[1].within)
    return f" Of the {one.sequences} sequences of the kind {kind} {number(100.0 * one.within)} % do."


def _position_point(found: InterpolationRecord) -> tuple[str, str]:
    said = []
    for output, one in found.outputs.items():
        unseen = [
            (error, case, position)
            for case, errors in one.mse.items()
            for error, position, fitted in zip(errors, one.positions, one.fitted, strict=True)
            if not fitted
        ]
        if unseen:
            error, case, position = max(unseen)
            said.append(
                f"{output} at {one.fitted.count(False)} positions that nothing was fitted at is at worst "
                f"{number(error)} ({case}, position {position:g})"
            )
    slow = max(found.run_time_s, key=lambda case: found.run_time_s[case])
    said.append(f"all positions of {slow} together take {seconds(found.run_time_s[slow])} on two threads")
    return "All positions", f"{'; '.join(said)}."


def _sentences(results: AssemblyResults) -> list[str]:
    whole = results.whole
    return [
        f"The whole has {whole.models} models and {whole.parameters} parameters; it reads {', '.join(whole.inputs)} "
        "and nothing else.",
        _choice(results),
        *([] if results.limit_check is None else limit_check_sentences(results.limit_check)),
        *results.notes,
        *([] if results.doubt is None else [f"What is exported raises the flag IN_DOUBT: {results.doubt.sentence}."]),
    ]


def _choice(results: AssemblyResults) -> str:
    chosen = results.chosen
    if not results.mean:
        return (
            f"The stage was chosen by the error of the whole on the selection traces ({chosen.selection:.3g}, a "
            "geometric mean over traces and outputs)."
        )
    parts = [f"{stage.name} {stage.selection:.3g}" for stage in results.stages if stage.name in results.mean]
    return (
        f"The mean answers, as the pipeline says. On the selection traces its error is {chosen.selection:.3g} (a "
        f"geometric mean over traces and outputs), that of what it is the mean of: {', '.join(parts)}."
    )


def limit_check_sentences(found: LimitCheckRecord) -> list[str]:
    """How many limits that are channels the training traces pass, and which the furthest.

    Args:
        found: By how much each is passed.

    Returns:
        A sentence; none where no limit is a channel.
    """
    if not found.limits:
        return []
    if not (passed := found.passed):
        return [f"No training trace ({found.traces}) passes a limit that is a channel ({len(found.limits)})."]
    worst = passed[0]
    return [
        f"Training traces ({found.traces}) pass {len(passed)} of {len(found.limits)} limits that are channels, "
        f"{worst.limit} the furthest: {worst.output} would be held back by {worst.summed:.2g} {worst.unit} over "
        f"{worst.trace}."
    ]
