"""The rounds of training end to end as a table of the report: a row says what a round trained, and what it brought."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sysid.composite.members import placed_outputs
from sysid.composite.round import JointRound
from sysid.estimation import CascadeFit
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.stage_config import TogetherConfig

FEW = 3
"""So many outputs a cell names; of more it says how many."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RoundDone:
    """A round that was trained.

    Args:
        name: What it is called: ``2``, or ``2.1 of growth``.
        start: Which of the pipeline's starts it belongs to; ``None`` of a single one.
        trained: Outputs of the members that it trained, each in its first place.
        everywhere: Whether it trained them in all of their places.
        measured: Outputs that were as measured.
        traces: How many traces it was fitted to.
        before: Error on the selection traces where it started.
        after: The same of the state that was chosen.
        fit: What came of it.
    """

    name: str
    start: int | None
    trained: tuple[str, ...]
    everywhere: bool
    measured: tuple[str, ...]
    traces: int
    before: float
    after: float
    fit: CascadeFit

    @classmethod
    def of(
        cls,
        config: AssemblyConfig,
        asked: TogetherConfig,
        ready: JointRound,
        fit: CascadeFit,
        *,
        name: str,
        start: int | None,
    ) -> RoundDone:
        """Say what a round did.

        Args:
            config: The pipeline.
            asked: The round.
            ready: What it trained, and on what.
            fit: What came of it.
            name: What it is called.
            start: Which start it belongs to, of several.

        Returns:
            The round.
        """
        return cls(
            name=name,
            start=start,
            trained=tuple(
                one.mapping.output for one in config.members if not set(placed_outputs(one)).isdisjoint(ready.trained)
            ),
            everywhere=asked.everywhere,
            measured=asked.measured,
            traces=len(ready.estimation),
            before=ready.error(ready.whole),
            after=ready.error(fit.model),
            fit=fit,
        )

    @property
    def iterations(self) -> int:
        """How far the state that was chosen had come; 0 is where the round started."""
        return int(self.fit.history["iteration"][-1]) if len(self.fit.history["iteration"]) else 0

    @property
    def loss(self) -> float | None:
        """Mean squared residual of that state; ``None`` where no step was worth taking, which leaves no curve."""
        return float(self.fit.history["loss"][-1]) if len(self.fit.history["loss"]) else None

    @property
    def sentences(self) -> list[str]:
        """All that its fit says: which states were looked at, which was chosen, and how it ended."""
        called = f"Round {self.name}" if self.start is None else f"Start {self.start}, round {self.name}"
        return [f"{called}: {said}" for said in (*self.fit.notes, self.fit.status.value)]


def rounds_table(rounds: Sequence[RoundDone]) -> dict[str, Any]:
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
                one.name if one.start is None else f"{one.name} of start {one.start}",
                f"{_few(one.trained)}{', everywhere' if one.everywhere else ''}",
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
