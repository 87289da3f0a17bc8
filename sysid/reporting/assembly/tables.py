"""Tables of an assembly: its stages, active learning, the Monte Carlo test, limits, run times, exported files."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sysid.reporting.assembly.results import (
    ActiveLearningRecord,
    ActivityRecord,
    AssemblyResults,
    DoubtRecord,
    EquationRecord,
    LimitCheckRecord,
    LimitRecord,
    MonteCarloRecord,
    PositionErrors,
    SequenceErrors,
)
from sysid.reporting.published.tables import PublishedTable
from sysid.reporting.tables import Table, plain_table
from sysid.units import squared

Value = int | float | str | None
"""Of a plain table."""


def mse_value(value: float) -> float | str:
    """A mean squared error of a free run, or that it diverges."""
    return value if math.isfinite(value) else "diverges"


def stage_table(results: AssemblyResults, output: str, published: PublishedTable | None = None) -> Table:
    """Errors of an output by stage and case, with published figures below.

    Args:
        results: Of the run.
        output: The output.
        published: Published models.

    Returns:
        The table.
    """
    cases, of_squares = list(results.cases), squared(results.outputs[output].unit)
    rows: list[list[Value]] = [
        [
            f"{stage.name} (chosen)" if stage.name == results.whole.stage else stage.name,
            *(mse_value(stage.mse[output][case]) for case in cases),
            stage.selection,
        ]
        for stage in results.stages
    ]
    beside = results.published.get(output)
    if beside is not None:
        rows.append([beside.source, *(beside.mse.get(case) for case in cases), None])
        aimed = [beside.mse[case] * beside.target if case in beside.mse else None for case in cases]
        rows.append([f"aimed at: {beside.target:g} of it", *aimed, None])
    if published is not None and results.published_whole is not None:
        wholes = published.by_variant(
            mapping=results.published_whole,
            quantity="mse",
            run="free_run",
            signal=output,
            unit=f"{results.outputs[output].unit}^2",
        )
        rows += [
            [said, *(by[case].value if case in by else None for case in cases), None] for said, by in wholes.items()
        ]
    return plain_table(
        f"{output}: mean squared error of the free run of the whole [{of_squares}]",
        [("Stage", ""), *((case, "") for case in cases), ("Selection", "geometric mean")],
        rows,
        note="From the inputs of the whole alone. No case had a say in any choice.",
    )


def time_table(results: AssemblyResults) -> Table:
    """Run time of the chosen whole by case.

    Args:
        results: Of the run.

    Returns:
        The table.
    """
    return plain_table(
        "Run time of the whole, compiled, on one core",
        [("Case", ""), ("Length", "s"), ("Run", "ms"), ("Per simulated second", "µs")],
        [
            [name, case.duration_s, 1e3 * case.run_time_s, 1e6 * case.run_time_s / case.duration_s]
            for name, case in results.cases.items()
        ],
        note="Median of five runs after one that is not counted.",
    )


def monte_carlo_tables(found: MonteCarloRecord) -> list[Table]:
    """What came of the random sequences, kind by kind and state by state where there are such.

    Args:
        found: What came of them.

    Returns:
        One table to three.
    """
    rows: list[list[Value]] = [
        [f"{100.0 * q:g} % of the sequences at most, {found.unit}", value] for q, value in found.quantiles.items()
    ]
    rows.append([f"share of sequences under {found.limit:g} {found.unit}", found.within])
    rows.append(["sequences that diverged", found.lost])
    rows += [[f"worst: {one.name}, {found.unit}", one.rmse] for one in found.worst]
    tables = [
        plain_table(
            f"{found.output} on {found.sequences} random sequences of the reference",
            [("", ""), ("Root mean square error", "")],
            rows,
            note="A sequence diverged if a network was held at its bound, far outside what it was trained on.",
        )
    ]
    if found.by_kind:
        tables.append(
            plain_table(
                f"{found.output} on the random sequences, kind by kind",
                [
                    ("Kind", ""),
                    ("Sequences", ""),
                    ("Diverged", ""),
                    (f"Under {found.limit:g} {found.unit}", "%"),
                    *((f"{100.0 * q:g} % at most", found.unit) for q in found.quantiles),
                ],
                [
                    [kind, one.sequences, one.lost, 100.0 * one.within, *one.quantiles.values()]
                    for kind, one in found.by_kind.items()
                ],
                note="Root mean square error of a sequence; its kind is its name without the number.",
            )
        )
    if found.by_state:
        tables.append(
            plain_table(
                f"{found.output} on the random sequences, state by state",
                [("State", ""), *((f"{100.0 * q:g} % at most", found.unit) for q in found.quantiles)],
                [[label, *by.values()] for label, by in found.by_state.items()],
                note="Root mean square error over the samples of a state in a sequence; "
                "quantiles over the sequences that are in the state.",
            )
        )
    return tables


def doubt_table(found: DoubtRecord) -> Table:
    """What the flag IN_DOUBT is worth.

    Args:
        found: The flag.

    Returns:
        The table.
    """
    error, threshold = (f"{value:.3g} {found.unit}" for value in (found.error, found.threshold))
    return plain_table(
        f"Where {found.output} is in doubt: from a {found.of} of {threshold} on",
        [("", ""), ("Samples", ""), (f"Wrong by over {error}", "%"), ("Of these in doubt", "%"),
         ("Of the others in doubt", "%")],
        [
            [one.data, one.samples, 100.0 * one.wrong, 100.0 * one.flagged if one.wrong else None, 100.0 * one.false]
            for one in found.on
        ],
        note=f"The threshold was found on {found.on[0].data}.",
    )  # fmt: skip


def active_learning_table(found: ActiveLearningRecord, chosen: str) -> Table:
    """What each round brought.

    Args:
        found: The rounds.
        chosen: The stage that was chosen.

    Returns:
        The table.
    """
    random = any(one.monte_carlo is not None for one in found.rounds)
    more = [("Random sequences", "% under their limit"), ("99 % of them", "under")] if random else []
    note = " The random sequences are those further on, which had no say in anything." if random else ""
    unit = found.unit or "rms"
    return plain_table(
        "How much data bought how much accuracy",
        [
            ("Round", "of active learning"), ("Added", "sequences"), ("Trained on", "traces"),
            ("Trained on", "samples"),
            ("Training", "s"), (f"Under {limit_text(found)}", "% of sequences"), ("Median error", unit),
            ("99 % under", unit), ("Selection", "geometric mean"), *more,
        ],
        [
            [
                f"{one.number} (chosen)" if one.stage == chosen else str(one.number),
                len(one.added), one.traces, one.samples, one.train_time_s if one.number else None,
                100.0 * one.held_out.within, one.held_out.median, one.held_out.p99, one.selection,
                *(_random(one.monte_carlo) if random else []),
            ]
            for one in found.rounds
        ],
        note=f"Root mean square error of {', '.join(found.outputs)}, the largest counts, on {found.held_out} "
        "sequences of the pool that train nothing, but choose with the selection traces. Added were "
        f"sequences {picked_text(found)}; {found.ended}. Round 0 is the whole as it was {found.rounds[0].stage}.{note}",
    )  # fmt: skip


def _random(found: SequenceErrors | None) -> list[float | None]:
    return [None, None] if found is None else [100.0 * found.within, found.p99]


def limit_text(found: ActiveLearningRecord) -> str:
    """The error that a sequence should stay under, with its unit."""
    return f"{found.limit:g} {found.unit}".strip()


def picked_text(found: ActiveLearningRecord) -> str:
    """Which sequences were added."""
    return "at which the whole was worst" if found.pick == "worst" else "in the order of the pool"


def equation_table(found: Sequence[EquationRecord]) -> Table:
    """What is known of the plant and not fitted.

    Args:
        found: At least one.

    Returns:
        The table, the equations as a pipeline has them.
    """
    several = any(one.instances != [""] for one in found)
    rows: list[list[Value]] = [[one.equation, "" if one.unit == "1" else one.unit] for one in found]
    for row, one in zip(rows, found, strict=True) if several else ():
        row.append(", ".join(name or "nothing" for name in one.instances))
    estimated = any(one.parameters for one in found)
    for row, one in zip(rows, found, strict=True) if estimated else ():
        row.append(", ".join(f"{name} = {value:.5g}" for name, value in one.parameters.items()))
    return plain_table(
        "What is known and fixed",
        [
            ("Equation", ""),
            ("Unit", "of what it gives"),
            *([("Instances", "its names end in")] if several else []),
            *([("Estimated", "in its own unit")] if estimated else []),
        ],
        rows,
        note="[k-1] is the value a sample before. As the pipeline has them: sysid equations PIPELINE.",
    )


def limit_table(found: Sequence[LimitRecord]) -> Table:
    """The limits and how often they act.

    Args:
        found: At least one.

    Returns:
        The table.
    """
    rows: list[list[Value]] = []
    for one in found:
        for side, limit in (("lower", one.low), ("upper", one.high)):
            if limit is not None:
                shown = limit if isinstance(limit, str) else f"{limit:g} {one.unit}"
                shares = [_held(one.cases, side), _held(one.sequences, side)]
                rows.append([f"{one.output} at its {side} limit", shown, *shares])
    return plain_table(
        "Limits that hold an output in free run",
        [("", ""), ("Limit", ""), ("Scored cases", "% of samples"), ("Random sequences", "% of samples")],
        rows,
        note="A limit that is a channel follows what is declared of the system: an output rests on it while "
        "nothing flows.",
    )


def _held(activity: ActivityRecord | None, side: str) -> float | None:
    if activity is None:
        return None
    return 100.0 * (activity.low if side == "lower" else activity.high) / activity.samples


def limit_check_table(found: LimitCheckRecord) -> Table | None:
    """The limits that measured traces pass, and by how much; ``None`` where none is passed."""
    if not found.passed:
        return None
    return plain_table(
        "Limits that training traces pass",
        [("Limit", ""), ("Holds", ""), ("In a sample", "at most"), ("Over a trace", "sum"), ("Trace", "")],
        [[one.limit, f"{one.output} ({one.unit})", one.most, one.summed, one.trace] for one in found.passed],
        note="So far the output is held back from where it was measured. A limit that is passed by much is none of "
        "the system's: correct what is declared.",
    )


def position_table(found: PositionErrors, run_time_s: dict[str, float], output: str) -> Table:
    """Errors of an output at positions that nothing was fitted at.

    Args:
        found: Its errors.
        run_time_s: Seconds of a run of all positions, by case.
        output: The output.

    Returns:
        The table.
    """
    rows: list[list[Value]] = []
    for case, errors in found.mse.items():
        at = list(zip(found.positions, found.fitted, errors, strict=True))
        own = [(error, position) for position, fitted, error in at if not fitted]
        knots = [error for _, fitted, error in at if fitted]
        worst = max(own, default=(None, None))
        rows.append([case, _mean([error for error, _ in own]), *worst, _mean(knots), 1e3 * run_time_s[case]])
    return plain_table(
        f"{output} at {found.fitted.count(False)} positions that nothing was fitted at",
        [
            ("Case", ""), ("Mean over unseen positions", ""), ("Worst unseen position", ""), ("which", "position"),
            ("Mean over the knots", ""), (f"All {len(found.positions)} positions", "ms"),
        ],
        rows,
        note="Mean squared error of the free run from the inputs of the whole alone, in the output's unit squared; "
        "wall time of one batched run of all positions on two threads, after one that is not counted.",
    )  # fmt: skip


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None
