"""The rounds of training end to end: a row says what a round trained, and what it brought."""

from __future__ import annotations

from collections.abc import Sequence

from sysid.estimation import Status
from sysid.reporting.assembly.results import RoundRecord
from sysid.reporting.tables import Table, plain_table

FEW = 3
"""So many outputs a cell names; of more it says how many."""


def rounds_table(rounds: Sequence[RoundRecord]) -> Table:
    """What each round trained, and what it brought.

    Args:
        rounds: The rounds, at least one.

    Returns:
        The table.
    """
    return plain_table(
        "Training end to end, round by round",
        [
            ("Round", ""), ("Trained", "members"), ("As measured", ""), ("Traces", ""), ("Iterations", ""),
            ("Time", "s"), ("Residual", "mean squared"), ("Selection", "at the start"), ("Selection", "as chosen"),
            ("Ended", ""),
        ],
        [
            [
                one.name,
                f"{_few(one.trained)}{', in all instances' if one.all_instances else ''}",
                _few(one.measured),
                one.traces, one.iterations, one.train_time_s, one.loss, one.selection_before, one.selection_after,
                one.status.replace("_", " ").lower(),
            ]
            for one in rounds
        ],
        note="Iterations and residual are those of the state that was chosen (no residual where that is the start); "
        "the time is the whole round's. The residual and the errors on the selection traces (geometric mean over "
        "traces and targets) are squared, in the errors that the round counts as one. Targets and traces are a round's "
        "own: compare within a row.",
        folded=[said for one in rounds for said in round_sentences(one)],
    )  # fmt: skip


def round_sentences(one: RoundRecord) -> list[str]:
    """All that its fit says: which states were looked at, which was chosen, and how it ended."""
    status = Status[one.status].value if one.status in Status.__members__ else one.status
    return [f"Round {one.name}: {said}" for said in (*one.notes, status)]


def _few(outputs: Sequence[str]) -> str:
    return ", ".join(outputs) if len(outputs) <= FEW else f"{len(outputs)} outputs"
