"""Stress, growth, line and exported files as tables, charts and points of the report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sysid.composite.active_learning import Growth, Look
from sysid.composite.limit_check import LimitCheck
from sysid.composite.monte_carlo import Stress
from sysid.reporting.numbers import number, seconds
from sysid.workbench.assembly.line import LineScores

if TYPE_CHECKING:
    from sysid.export import Bundle


def stress_tables(found: Stress) -> list[dict[str, Any]]:
    """What came of the random sequences, and state by state where there are states.

    Args:
        found: What came of them.

    Returns:
        One or two tables, as :class:`sysid.reporting.judging.tables.TableRecord` has them.
    """
    rows: list[list[Any]] = [
        [f"{100.0 * q:g} % of the sequences at most, {found.unit}", value] for q, value in found.quantiles.items()
    ]
    rows.append([f"share of sequences under {found.limit:g} {found.unit}", found.within])
    rows.append(["sequences that diverged", found.lost])
    rows += [[f"worst: {name}, {found.unit}", value] for name, value in found.worst]
    tables: list[dict[str, Any]] = [
        {
            "caption": f"{found.output} on {found.sequences} random sequences of the reference",
            "head": [["", ""], ["Root mean square error", ""]],
            "rows": rows,
            "note": "A sequence diverged if a network was held at its bound, far outside what it was trained on.",
        }
    ]
    if found.by_state:
        tables.append(
            {
                "caption": f"{found.output} on the random sequences, state by state",
                "head": [["State", ""], *([f"{100.0 * q:g} % at most", found.unit] for q in found.quantiles)],
                "rows": [[label, *by.values()] for label, by in found.by_state.items()],
                "note": "Root mean square error over the samples of a state in a sequence; "
                "quantiles over the sequences that are in the state.",
            }
        )
    return tables


def export_table(bundle: Bundle) -> dict[str, Any]:
    """The exported files, and how each compares with the whole.

    Args:
        bundle: Where they lie.

    Returns:
        A table, as :class:`sysid.reporting.judging.tables.TableRecord` has it.
    """
    units = sorted({str(output["unit"]) for output in bundle.outputs})
    return {
        "caption": f"Exported to {bundle.folder.name}/: each file against the whole, on every case and on random input",
        "head": [["", ""], ["Largest difference", ", ".join(units)], ["Tolerance", ", ".join(units)]],
        "rows": [[f"{one.name} ({one.format})", one.largest_difference, one.tolerance] for one in bundle.files],
    }


def limits_table(found: LimitCheck) -> dict[str, Any]:
    """The limits that measured traces pass, and by how much.

    Args:
        found: What came of holding them beside each other.

    Returns:
        A table, as :class:`sysid.reporting.judging.tables.TableRecord` has it.
    """
    return {
        "caption": "Limits that training traces pass",
        "head": [["Limit", ""], ["Holds", ""], ["In a sample", "at most"], ["Over a trace", "sum"], ["Trace", ""]],
        "rows": [[one.limit, f"{one.output} ({one.unit})", one.most, one.summed, one.trace] for one in found.passed],
        "note": "So far the output is held back from where it was measured. A limit that is passed by much is none of "
        "the system's: correct what is declared.",
    }


def growth_table(grown: Growth, chosen: str, unseen: Mapping[str, Look] | None = None) -> dict[str, Any]:
    """What each round brought.

    Args:
        grown: The growth.
        chosen: The stage that was chosen.
        unseen: By stage, how it does on the random sequences of the stress, where there are such.

    Returns:
        A table, as :class:`sysid.reporting.judging.tables.TableRecord` has it.
    """
    asked, seen = grown.asked, unseen or {}
    judged = [["Random sequences", "% under their limit"], ["99 % of them", "under"]] if seen else []
    note = " The random sequences are those further on, which had no say in anything." if seen else ""
    return {
        "caption": "How much data bought how much accuracy",
        "head": [
            ["Round of growth", ""], ["Added", "sequences"], ["Trained on", "traces"], ["Trained on", "samples"],
            ["Training", "s"], [f"Under {grown.limit}", "% of sequences"],
            ["Median error", grown.unit or "rms"], ["99 % under", grown.unit or "rms"], ["Selection", "geometric mean"],
            *judged,
        ],
        "rows": [
            [
                f"{one.number} (chosen)" if one.stage == chosen else str(one.number),
                len(one.added), one.traces, one.samples, one.seconds if one.number else None,
                100.0 * one.look.within, one.look.median, one.look.rare, one.score,
                *_shown(seen, one.stage),
            ]
            for one in grown.rounds
        ],
        "note": f"Root mean square error of {', '.join(asked.outputs)}, the largest counts, on {grown.held_out} "
        "sequences of the pool that train nothing, but choose with the selection traces. Added were "
        f"sequences {grown.where}; {grown.ended}. Round 0 is the whole as it was {grown.rounds[0].stage}.{note}",
    }  # fmt: skip


def _shown(seen: Mapping[str, Look], stage: str) -> list[float | None]:
    """A stage on the random sequences, if there are such."""
    if not seen:
        return []
    return [100.0 * seen[stage].within, seen[stage].rare] if stage in seen else [None, None]


def growth_charts(grown: Growth, unseen: Mapping[str, Look] | None = None) -> list[dict[str, Any]]:
    """Error, and share of sequences within the limit, over samples trained on.

    Args:
        grown: The growth.
        unseen: By stage, how it does on the random sequences of the stress, where there are such.

    Returns:
        Two charts, as :class:`sysid.reporting.judging.tables.ChartRecord` has them.
    """
    asked, looks = grown.asked, [one.look for one in grown.rounds]
    rare = [unseen[one.stage].rare for one in grown.rounds if one.stage in unseen] if unseen else []
    samples = [float(one.samples) for one in grown.rounds]
    said = (
        f"on {grown.held_out} sequences of the pool that train nothing, over the samples that the whole was trained "
        f"on; each round, a mark, adds sequences {grown.where}."
    )

    def line(name: str, values: list[float], *, target: bool = False) -> dict[str, Any]:
        return {"name": name, "x": samples, "y": values, "target": target, "points": not target}

    return [
        {
            "title": "Error over data",
            "caption": f"Error of {', '.join(asked.outputs)} {said}",
            "x": "samples trained on",
            "y": f"root mean square error of a sequence{f' ({grown.unit})' if grown.unit else ''}",
            "logarithmic": True,
            "lines": [
                line("99 % of the sequences under", [one.rare for one in looks]),
                line("median", [one.median for one in looks]),
                *([line("99 % of the random sequences under", rare)] if len(rare) == len(looks) else []),
                line("aimed at", [asked.within] * len(looks), target=True),
            ],
        },
        {
            "title": "Share over data",
            "caption": f"Share with an error of {', '.join(asked.outputs)} under {grown.limit} {said}",
            "x": "samples trained on",
            "y": "share of the sequences (%)",
            "logarithmic": "x",
            "lines": [
                line(f"under {grown.limit}", [100.0 * one.within for one in looks]),
                line("aimed at", [100.0 * asked.until] * len(looks), target=True),
            ],
        },
    ]


def line_table(scores: LineScores, output: str) -> dict[str, Any]:
    """Errors of an output at places that nothing was fitted at.

    Args:
        scores: The scores.
        output: The output.

    Returns:
        A table.
    """
    unseen, places = ~scores.seen[output], scores.places[output]
    rows: list[list[Any]] = []
    for case, errors in scores.mse[output].items():
        own = errors[unseen]
        worst = places[unseen][np.argmax(own)] if len(own) else None
        at_knots = errors[~unseen]
        rows.append(
            [
                case,
                float(own.mean()) if len(own) else None,
                float(own.max()) if len(own) else None,
                worst,
                float(at_knots.mean()) if len(at_knots) else None,
                1e3 * scores.timing[case],
            ]
        )
    return {
        "caption": f"{output} at {int(unseen.sum())} places that nothing was fitted at",
        "head": [
            ["Case", ""], ["Mean over unseen places", ""], ["Worst unseen place", ""], ["which", "place"],
            ["Mean over the knots", ""], [f"All {len(places)} places", "ms"],
        ],
        "rows": rows,
        "note": "Mean squared error of the free run from the inputs of the whole alone, in the output's unit squared; "
        "wall time of one batched run of all places on two threads, after one that is not counted.",
    }  # fmt: skip


def line_chart(scores: LineScores, output: str) -> dict[str, Any]:
    """Error over the place.

    Args:
        scores: The scores.
        output: The output.

    Returns:
        A chart.
    """
    places = scores.places[output]
    lines: list[dict[str, Any]] = [
        {"name": case, "x": places.tolist(), "y": errors.tolist()} for case, errors in scores.mse[output].items()
    ]
    knots = places[scores.seen[output]]
    if len(knots):
        lines.append({"name": "fitted here", "x": knots.tolist(), "y": [0.0] * len(knots), "marks": True})
    return {
        "title": f"{output} along the line",
        "caption": f"Mean squared error of {output} at every place, from the inputs of the whole alone.",
        "x": "place",
        "y": f"mean squared error of {output}",
        "lines": lines,
    }


def line_metrics(scores: LineScores) -> dict[str, float]:
    """Numbers to track with the chosen stage.

    Args:
        scores: The scores.

    Returns:
        Mean and largest error over the places that nothing was fitted at, by output and case.
    """
    found = {}
    for output, by_case in scores.mse.items():
        for case, errors in by_case.items():
            own = errors[~scores.seen[output]]
            if len(own):
                found[f"{output}/{case}/unseen places/mse"] = float(own.mean())
                found[f"{output}/{case}/unseen places/worst mse"] = float(own.max())
    return found


def line_point(scores: LineScores) -> tuple[str, str]:
    """For the verdict.

    Args:
        scores: The scores.

    Returns:
        Keyword and sentence.
    """
    said = []
    for output, by_case in scores.mse.items():
        unseen, places = ~scores.seen[output], scores.places[output]
        worst = max(by_case, key=lambda case: float(by_case[case][unseen].max(initial=0.0)))
        errors = by_case[worst][unseen]
        if len(errors):
            said.append(
                f"{output} at {len(errors)} places that nothing was fitted at is at worst "
                f"{number(float(errors.max()))} ({worst}, place {places[unseen][np.argmax(errors)]:g})"
            )
    slow = max(scores.timing, key=lambda case: scores.timing[case])
    said.append(f"all places of {slow} together take {seconds(scores.timing[slow])} on two threads")
    return "Everywhere", f"{'; '.join(said)}."
