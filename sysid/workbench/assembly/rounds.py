"""The rounds of training end to end as a table of the report: a row says what a round trained, and what it brought."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sysid.composite.round import TrainedRound

FEW = 3
"""So many outputs a cell names; of more it says how many."""


def rounds_table(rounds: Sequence[TrainedRound]) -> dict[str, Any]:
    """What each round trained, and what it brought.

    Args:
        rounds: The rounds, at least one.

    Returns:
        A table, as :class:`sysid.reporting.judging.tables.TableRecord` has it.
    """
    return {
        "caption": "Training end to end, round by round",
        "head": [
            ["Round", ""], ["Trained", "members"], ["As measured", ""], ["Traces", ""], ["Iterations", ""],
            ["Time", "s"], ["Residual", "mean squared"], ["Selection", "at the start"], ["Selection", "as chosen"],
            ["Ended", ""],
        ],
        "rows": [
            [
                one.name,
                f"{_few(one.trained)}{', everywhere' if one.shared else ''}",
                _few(one.measured),
                one.traces, one.iterations, one.fit.train_time_s, one.loss, one.before, one.after,
                one.fit.status.name.replace("_", " ").lower(),
            ]
            for one in rounds
        ],
        "note": "Iterations and residual are those of the state that was chosen (no residual where that is the start); "
        "the time is the whole round's. The residual and the errors on the selection traces (geometric mean over "
        "traces and targets) are squared, in the errors that the round counts as one. Targets and traces are a round's "
        "own: compare within a row.",
        "folded": [said for one in rounds for said in one.sentences],
    }  # fmt: skip


def _few(outputs: Sequence[str]) -> str:
    return ", ".join(outputs) if len(outputs) <= FEW else f"{len(outputs)} outputs"
