"""Tables and charts of what a judge found, whatever it is about: the figures say themselves what they are."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sysid.reporting.charts import Chart, Line
from sysid.reporting.judging.results import JudgementRecord, SensitivityRecord
from sysid.reporting.numbers import number
from sysid.reporting.tables import Table, plain_table

Value = int | float | str | None
Head = list[tuple[str, str]]


def judgement_tables(record: JudgementRecord) -> list[Table]:
    """A summary first, then how large an error may be, each subject scene by scene, and what came of every scene.

    Args:
        record: What was found.

    Returns:
        The tables.
    """
    return [
        *([summary_table(record)] if record.limited or record.error else []),
        *([sensitivity_table(record)] if record.sensitivity else []),
        *(differences_table(record, subject) for subject in record.subjects if _keys(record, "differences")),
        *([measures_table(record)] if _keys(record, "measures") else []),
    ]


def summary_table(record: JudgementRecord) -> Table:
    """Mean error and worst differences of each subject over all scenes, and in how many it stays within the limit."""
    error = [] if record.error is None else [record.error]
    limit = f"all within {record.limit:g} {_limit_unit(record)}".strip()
    rows: list[list[Value]] = []
    for subject, scenes in record.subjects.items():
        run = record.run(subject)
        within = sum(all(abs(one.differences[key]) <= record.limit for key in record.limited) for one in run.values())
        rows.append(
            [
                subject,
                *(record.mean(subject, key) for key in error),
                *(record.worst(subject, key) for key in record.limited),
                *([f"{within} of {len(run)}"] if record.limited else []),
                str(len(scenes) - len(run)),
            ]
        )
    head: Head = [("model", ""), *(_column(record, key, "mean") for key in error)]
    head += [_column(record, key, "worst") for key in record.limited]
    head += [(limit, "scenarios")] if record.limited else []
    return plain_table(
        "What each model's error does, over all scenarios.", [*head, ("not possible", "scenarios")], rows
    )


def sensitivity_table(record: JudgementRecord) -> Table:
    """What artificial errors of rising size do, and at which each difference passes the limit."""
    rows: list[list[Value]] = []
    for one in record.sensitivity:
        rows += [
            [
                one.kind,
                f"{step.size:g} {one.unit}",
                step.error,
                *(step.differences.get(key, math.nan) for key in record.limited),
            ]
            for step in one.steps
        ]
    for one in record.sensitivity:
        found = {tolerance.quantity: tolerance.error for tolerance in one.tolerances}
        passed = f"{one.kind}: passes {record.limit:g} {_limit_unit(record)} at"
        rows.append([passed, _unit(record, record.error), None, *(found.get(key, math.nan) for key in record.limited)])
    meanings = "; ".join(f"{one.kind}, {one.meaning}" for one in record.sensitivity if one.meaning)
    return plain_table(
        "How large an error may be: worst consequence by size.",
        [
            ("error", ""),
            ("size", ""),
            *([_column(record, record.error)] if record.error else [("error figure", "")]),
            *(_column(record, key, "worst") for key in record.limited),
        ],
        rows,
        note=f"The {record.reference_name} with an artificial error{f' ({meanings})' if meanings else ''}. The last "
        "rows give the error at which each figure passes the limit; empty where none of the sizes does, or all do.",
    )


def differences_table(record: JudgementRecord, subject: str) -> Table:
    """A subject against the reference, scene by scene, and why a scene could not be run."""
    keys = _keys(record, "differences")
    refused = any(one.refused for one in record.subjects[subject].values())
    rows: list[list[Value]] = [
        [
            scene,
            *(one.differences.get(key) for key in keys),
            *([one.refused or None] if refused else []),
        ]
        for scene, one in record.subjects[subject].items()
    ]
    head: Head = [("scenario", ""), *(_column(record, key) for key in keys)]
    return plain_table(
        f"{subject} against the {record.reference_name}, by scenario.",
        [*head, *([("not possible", "")] if refused else [])],
        rows,
    )


def measures_table(record: JudgementRecord) -> Table:
    """What came of every scene, with the reference and with each subject."""
    keys = _keys(record, "measures")
    rows: list[list[Value]] = []
    for scene in record.scenes:
        sides = {record.reference_name: record.reference.get(scene)}
        sides |= {subject: record.run(subject).get(scene) for subject in record.subjects}
        told = [(name, one) for name, one in sides.items() if one is not None and one.measures]
        rows += [
            [scene if index == 0 else "", name, *(_said(one.measures.get(key)) for key in keys)]
            for index, (name, one) in enumerate(told)
        ]
    head: Head = [("scenario", ""), ("model", ""), *(_column(record, key) for key in keys)]
    return plain_table("What came of each scenario.", head, rows)


def judgement_charts(record: JudgementRecord) -> list[Chart]:
    """What an error costs, and the signals of every scene.

    Args:
        record: What was found.

    Returns:
        The charts.
    """
    return [*([_cost_chart(record)] if record.error and record.limited else []), *_signal_charts(record)]


def _cost_chart(record: JudgementRecord) -> Chart:
    error = str(record.error)
    lines = [line for one in record.sensitivity for line in _steps(record, one)]
    for subject in record.subjects:
        for key in record.limited:
            pairs = ((o.differences[error], abs(o.differences[key])) for o in record.run(subject).values())
            points = sorted(pair for pair in pairs if min(pair) > 0.0)
            name = f"{subject}: {record.quantities[key].name}"
            lines.append(Line(name=name, x=[p[0] for p in points], y=[p[1] for p in points], how="marks"))
    ends = [step.error for one in record.sensitivity for step in one.steps]
    if ends and math.isfinite(record.limit):
        name = f"{record.limit:g} {_limit_unit(record)}"
        lines.append(Line(name=name, x=[min(ends), max(ends)], y=[record.limit] * 2, how="target"))
    return Chart(
        title="What an error costs",
        caption="Consequence against the error of the models. Lines: artificial errors of the "
        f"{record.reference_name}, worst scenario; marks: each model in each scenario.",
        x=f"{record.quantities[error].name} [{_unit(record, error)}]",
        y=f"consequence [{_limit_unit(record)}]",
        logarithmic="xy",
        lines=lines,
    )


def _steps(record: JudgementRecord, one: SensitivityRecord) -> list[Line]:
    return [
        Line(
            name=f"{record.quantities[key].name}, {one.kind}",
            x=[step.error for step in one.steps],
            y=[step.differences.get(key, math.nan) for step in one.steps],
        )
        for key in record.limited
    ]


def _signal_charts(record: JudgementRecord) -> list[Chart]:
    charts = []
    for scene in record.scenes:
        reference = record.reference.get(scene)
        for key in _keys(record, "signals"):
            own = {name: record.run(name)[scene].signals for name in record.subjects if scene in record.run(name)}
            curves = {name: signals[key] for name, signals in own.items() if key in signals}
            trusted = None if reference is None else reference.signals.get(key)
            if not curves:
                continue
            named = record.quantities[key].name
            lines = [Line(name=name, x=one.time, y=one.value) for name, one in curves.items()]
            if trusted is not None:
                lines.insert(0, Line(name=record.reference_name, x=trusted.time, y=trusted.value, how="target"))
            charts.append(
                Chart(
                    title=f"{named.capitalize()}: {scene}",
                    caption=f"{named.capitalize()}, {scene}: the {record.reference_name} and each model.",
                    x="time [s]",
                    y=f"{named} [{_unit(record, key)}]",
                    lines=lines,
                )
            )
    return charts


def judgement_headline(record: JudgementRecord) -> str:
    """What the first sentence says: in the scenes that it tells of, how far each subject is from the reference."""
    told = []
    for subject in record.subjects:
        run = record.run(subject)
        scenes = [name for name in record.headline_scenes or record.scenes if name in run]
        parts = [f"{scene} {_differs(record, run[scene].differences)}" for scene in scenes]
        told.append(f"{subject}: {'; '.join(part.strip() for part in parts) or 'no scenario could be run'}")
    return f"Against the {record.reference_name}. {'. '.join(told)}."


def _differs(record: JudgementRecord, differences: dict[str, float]) -> str:
    keys = record.limited or [key for key in differences if key != record.error]
    said = [
        f"{differences[key]:+.2f} {_unit(record, key)} in {record.quantities[key].name}".replace("-", "−")
        for key in keys
        if key in differences
    ]
    text = ", ".join(said)
    if record.error in differences:
        return f"{text} at {number(differences[str(record.error)])} {_unit(record, record.error)}".strip()
    return text


def tolerance_sentences(record: JudgementRecord) -> list[str]:
    """How large an error may be before the consequence passes the limit; none where nobody tried."""
    told = [one for one in record.sensitivity if one.tolerances]
    if not told:
        return []
    words = {"within": "stays within it at every size tried", "passed": "passes it at every size tried"}
    parts = [
        f"as {one.meaning or one.kind}, "
        + " and ".join(
            f"{record.quantities[found.quantity].name} "
            + words.get(found.reached, f"up to {number(found.error, digits=2)} {_unit(record, record.error)}")
            for found in one.tolerances
        )
        for one in told
    ]
    limit = f"{record.limit:g} {_limit_unit(record)}"
    return [f"How large an error may be before the consequence passes {limit}: {'; '.join(parts)}."]


def _keys(record: JudgementRecord, part: str) -> Sequence[str]:
    """The quantities of one part of the scenes, in the order in which the judge declares them."""
    sides = [*record.reference.values(), *(one for by in record.subjects.values() for one in by.values())]
    used = {key for one in sides for key in getattr(one, part)}
    return [key for key in record.quantities if key in used]


def _unit(record: JudgementRecord, key: str | None) -> str:
    return "" if key is None else record.quantities[key].unit


def _limit_unit(record: JudgementRecord) -> str:
    return _unit(record, record.limited[0] if record.limited else None)


def _column(record: JudgementRecord, key: str, what: str = "") -> tuple[str, str]:
    quantity = record.quantities[key]
    return quantity.name, ", ".join(part for part in (quantity.unit, what) if part)


def _said(value: float | str | bool | None) -> Value:
    return ("yes" if value else "no") if isinstance(value, bool) else value
