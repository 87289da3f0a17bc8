"""Each member by itself, behind measured inputs: its candidates on the scored cases, in free run and one step ahead."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.composite.candidates import Candidate, Candidates
from sysid.composite.members import at_instance
from sysid.models import NARXModel
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
