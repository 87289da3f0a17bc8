"""Each member by itself, behind measured inputs: its candidates on the scored cases, in free run and one step ahead."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.models import NARXModel
from sysid.reporting.published import PublishedFigure, PublishedTable
from sysid.traces import Trace
from sysid.workbench.assembly.candidates import Candidate, Candidates
from sysid.workbench.assembly.members import in_place

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
        one_step: Errors one step ahead of the same structure fitted so; ``None`` where it was not.
        closed: Errors of that fit's free run.
    """

    candidate: Candidate
    best: bool
    chosen: bool
    free_run: Errors
    one_step: Errors | None
    closed: Errors | None

    @property
    def name(self) -> str:
        """Structure and seed, and what became of it."""
        said = [word for word, yes in (("best alone", self.best), ("chosen", self.chosen)) if yes]
        name = f"{self.candidate.member.structure.label}, seed {self.candidate.seed}"
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
        own = [in_place(member, trace, member.places[0]) for trace in cases]
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


def member_tables(scored: MemberScores, published: PublishedTable | None) -> list[dict[str, Any]]:
    """A member's candidates beside each other, and beside published models of the same structure.

    Args:
        scored: The member.
        published: Published models.

    Returns:
        One table of free runs, and one of fits one step ahead where there are such.
    """
    free, other = list[list[Any]](), list[list[Any]]()
    for index, one in enumerate(scored.candidates):
        label = one.candidate.member.structure.label
        last = all(label != later.candidate.member.structure.label for later in scored.candidates[index + 1 :])
        ask = _Asked(scored, published if last else None, label, tuple(one.free_run))
        free += [[one.name, *one.free_run.values(), one.candidate.error], *ask.rows("free_run", "closed", [None])]
        if one.one_step is not None and one.closed is not None:
            bare = f"{label}, seed {one.candidate.seed}"
            other += [[f"{bare}: one step ahead", *one.one_step.values()], *ask.rows("one_step", "open", [])]
            other += [[f"{bare}: in free run", *one.closed.values()], *ask.rows("free_run", "open", [])]
    cases = [(case, "") for case in scored.candidates[0].free_run]
    tables = [
        {
            "caption": f"{scored.mapping} by itself, behind measured inputs: mean squared error of the free run "
            f"[{scored.unit}²]",
            "head": [("Candidate", ""), *cases, ("Selection", "geometric mean")],
            "rows": free,
            "note": "The selection traces alone say which is the best, and which the whole has.",
        }
    ]
    if other:
        tables.append(
            {
                "caption": f"{scored.mapping} by itself, fitted one step ahead: mean squared error [{scored.unit}²]",
                "head": [("Candidate", ""), *cases],
                "rows": other,
                "note": "One step ahead the past output is the measured one, in free run the network's own.",
            }
        )
    return tables


@dataclass(frozen=True)
class _Asked:
    """Published figures of one structure."""

    scored: MemberScores
    published: PublishedTable | None
    label: str
    cases: tuple[str, ...]

    def rows(self, run: str, loop: str, more: list[Any]) -> list[list[Any]]:
        """The row of what was published of such a model, or none."""
        found = {case: figure for case in self.cases if (figure := self._figure(case, run, loop)) is not None}
        if not found:
            return []
        first = next(iter(found.values()))
        values = [found[case].value if case in found else None for case in self.cases]
        return [[f"{first.source}: {first.label}", *values, *more]]

    def _figure(self, case: str, run: str, loop: str) -> PublishedFigure | None:
        if self.published is None:
            return None
        return self.published.find(
            mapping=self.scored.mapping,
            quantity="mse",
            run=run,
            loop=loop,
            case=case,
            structure=self.label,
            unit=f"{self.scored.unit}^2",
        )
