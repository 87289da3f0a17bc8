"""Each member by itself, behind measured inputs: its candidates on the scored cases, in free run and one step ahead."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.composite.candidates import Candidate, Candidates
from sysid.composite.members import at_instance
from sysid.models import NARXModel
from sysid.reporting.comparing.published import PublishedTable
from sysid.traces import Trace

REPEATS = 5
"""Free runs that are timed."""
Errors = Mapping[str, float]
"""Mean squared error by case, in the output's unit squared."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CandidateScores:
    """A candidate on the scored cases, in the first place of its member.

    Args:
        candidate: The candidate.
        best: Whether it is the best by itself, on the selection traces.
        chosen: Whether the whole has it.
        free_run: Errors of the free run.
        run_time: Seconds of the free run by case, compiled, on one core.
        one_step: Errors one step ahead of the same structure fitted so; ``None`` where it was not.
        closed: Errors of that fit's free run.
    """

    candidate: Candidate
    best: bool
    chosen: bool
    free_run: Errors
    run_time: Mapping[str, float]
    one_step: Errors | None
    closed: Errors | None

    @property
    def name(self) -> str:
        """Structure and seed, and what became of it."""
        said = [word for word, yes in (("best alone", self.best), ("chosen", self.chosen)) if yes]
        name = f"{self.candidate.member.structure.label}, seed {self.candidate.member.training.seed}"
        return f"{name} ({', '.join(said)})" if said else name


@dataclass(frozen=True, kw_only=True, eq=False)
class MemberScores:
    """The candidates of a member on the scored cases.

    Args:
        mapping: The member.
        unit: Of its output.
        candidates: In the order in which they were fitted.
    """

    mapping: str
    unit: str
    candidates: tuple[CandidateScores, ...]

    @property
    def cases(self) -> tuple[str, ...]:
        """The scored cases."""
        return tuple(self.candidates[0].free_run)

    @property
    def best(self) -> CandidateScores:
        """The best by itself."""
        return next(one for one in self.candidates if one.best)


def score_candidates(found: Candidates, cases: Sequence[Trace]) -> list[MemberScores]:
    """Run every candidate by itself.

    Args:
        found: The candidates.
        cases: The scored cases.

    Returns:
        Of each member whose channels all cases have, if it has several candidates or was fitted one step ahead too.
    """
    scored = []
    for name, fits in found.fits.items():
        member = fits[0].member
        needed = {*member.mapping.inputs, member.mapping.output}
        if (len(fits) == 1 and fits[0].one_step is None) or not all(needed <= {*one.channel_names} for one in cases):
            continue
        own = [at_instance(member, trace, member.instances[0]) for trace in cases]
        by_case = {case.name: trace for case, trace in zip(cases, own, strict=True)}
        scored.append(
            MemberScores(
                mapping=str(member.mapping),
                unit=own[0].channel(member.mapping.output).unit,
                candidates=tuple(
                    CandidateScores(
                        candidate=fit,
                        best=index == found.alone[name],
                        chosen=index == found.chosen[name],
                        free_run=_errors(fit.model, by_case, _free_run),
                        run_time={case: _seconds(fit.model, trace) for case, trace in by_case.items()},
                        one_step=None if fit.one_step is None else _errors(fit.one_step, by_case, _one_step),
                        closed=None if fit.one_step is None else _errors(fit.one_step, by_case, _free_run),
                    )
                    for index, fit in enumerate(fits)
                ),
            )
        )
    return scored


def _free_run(model: NARXModel, trace: Trace) -> NDArray[np.float64]:
    return model.simulate(trace.columns(model.mapping.inputs))


def _one_step(model: NARXModel, trace: Trace) -> NDArray[np.float64]:
    return model.predict(trace.columns(model.mapping.inputs), trace[model.mapping.output])


def _errors(
    model: NARXModel, cases: Mapping[str, Trace], run: Callable[[NARXModel, Trace], NDArray[np.float64]]
) -> Errors:
    found = {}
    for case, trace in cases.items():
        error = (run(model, trace) - trace[model.mapping.output])[trace.usable_samples]
        found[case] = float(np.mean(error**2))
    return found


def _seconds(model: NARXModel, trace: Trace) -> float:
    """Median over some free runs after one that is not counted."""
    taken = []
    for _ in range(1 + REPEATS):
        began = time.perf_counter()
        _free_run(model, trace)
        taken.append(time.perf_counter() - began)
    return statistics.median(taken[1:])


def member_tables(scored: MemberScores, published: PublishedTable | None) -> list[dict[str, Any]]:
    """A member's candidates beside each other, and beside published models of the same structure.

    Args:
        scored: The member.
        published: Published models.

    Returns:
        One table of free runs; of fits one step ahead where there are such, and of run times where such are published.
    """
    asked = [_Asked(scored, published, one.candidate.member.structure.label) for one in scored.candidates]
    # What is published of a structure stands behind the last of its seeds.
    last = [all(one.label != later.label for later in asked[index + 1 :]) for index, one in enumerate(asked)]
    rows = list(zip(scored.candidates, asked, last, strict=True))
    found = [_free_table(scored, rows), _one_step_table(scored, rows), _time_table(scored, rows)]
    return [table for table in found if table is not None]


def _free_table(scored: MemberScores, rows: Rows) -> dict[str, Any]:
    said = list[list[Any]]()
    for one, asked, last in rows:
        said.append([one.name, *one.free_run.values(), one.candidate.error])
        said += asked.errors("free_run", "closed", [None]) if last else []
    return {
        "caption": f"{scored.mapping} by itself, behind measured inputs: mean squared error of the free run "
        f"[{scored.unit}²]",
        "head": [("Candidate", ""), *((case, "") for case in scored.cases), ("Selection", "geometric mean")],
        "rows": said,
        "note": "The selection traces alone say which is the best, and which the whole has.",
    }


def _one_step_table(scored: MemberScores, rows: Rows) -> dict[str, Any] | None:
    said = list[list[Any]]()
    for one, asked, last in rows:
        for how, errors, run in (
            ("one step ahead", one.one_step, "one_step"),
            ("in free run", one.closed, "free_run"),
        ):
            if errors is not None:
                said.append([f"{asked.label}, seed {one.candidate.member.training.seed}: {how}", *errors.values()])
                said += asked.errors(run, "open", []) if last else []
    if not said:
        return None
    return {
        "caption": f"{scored.mapping} by itself, fitted one step ahead: mean squared error [{scored.unit}²]",
        "head": [("Candidate", ""), *((case, "") for case in scored.cases)],
        "rows": said,
        "note": "One step ahead the past output is the measured one, in free run the network's own.",
    }


def _time_table(scored: MemberScores, rows: Rows) -> dict[str, Any] | None:
    said, published = list[list[Any]](), list[list[Any]]()
    for one, asked, last in rows:
        if last:
            beside = asked.run_times()
            published += beside
            said += [[asked.label, *(1e3 * taken for taken in one.run_time.values())], *beside]
    if not published:
        return None
    return {
        "caption": f"{scored.mapping} by itself: run time of the free run [ms]",
        "head": [("Structure", ""), *((case, "") for case in scored.cases)],
        "rows": said,
        "note": f"Compiled, on one core; median of {REPEATS} runs after one that is not counted. Published ones are of "
        "another machine.",
    }


@dataclass(frozen=True)
class _Asked:
    """Published figures of one structure."""

    scored: MemberScores
    published: PublishedTable | None
    label: str

    def errors(self, run: str, loop: str, more: list[Any]) -> list[list[Any]]:
        """The row of what was published of such a model's errors, or none."""
        return self._row("mse", f"{self.scored.unit}^2", run, loop, more=more)

    def run_times(self) -> list[list[Any]]:
        """The row of its published run times in milliseconds, or none."""
        return self._row("run_time", "s", "free_run", "closed", scale=1e3)

    def _row(
        self, quantity: str, unit: str, run: str, loop: str, *, scale: float = 1.0, more: Sequence[Any] = ()
    ) -> list[list[Any]]:
        if self.published is None:
            return []
        found = {}
        for case in self.scored.cases:
            figure = self.published.find(
                mapping=self.scored.mapping, quantity=quantity, run=run, loop=loop, case=case, structure=self.label,
                unit=unit,
            )  # fmt: skip
            if figure is not None:
                found[case] = figure
        if not found:
            return []
        first = next(iter(found.values()))
        values = [scale * found[case].value if case in found else None for case in self.scored.cases]
        return [[f"{first.source}: {first.label}", *values, *more]]


Rows = Sequence[tuple[CandidateScores, _Asked, bool]]
"""Each candidate, what was published of its structure, and whether it is the last one of it."""
