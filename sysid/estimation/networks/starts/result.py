"""What several starts found, as the result of a fit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.networks.starts import multistart as starts
from sysid.estimation.networks.starts.choosing import Choice, rank
from sysid.estimation.networks.training import Training
from sysid.estimation.results.attempts import Attempt
from sysid.estimation.results.result import FitResult, Status
from sysid.models import History

MIDDLE = (
    "the least distance from the middle of all on the records' inputs backwards (of a short record neither the error "
    "nor the evidence tells which start is right elsewhere)"
)
"""How a start of a short record is chosen, in words."""
MOST_NAMES = 3
"""Records that a sentence names."""


def multistart_status(
    chosen: starts.Candidate,
    candidates: Sequence[starts.Candidate],
    left: Sequence[str],
    *,
    interrupted: bool,
) -> Status:
    """How a multistart ended.

    Args:
        chosen: The candidate chosen.
        candidates: All of them.
        left: Names of the records over which its free run leaves its bounds.
        interrupted: Whether it was.

    Returns:
        The status.
    """
    if interrupted:
        return Status.INTERRUPTED
    if left:
        return Status.UNSTABLE
    status = chosen.solution.status
    # Of a start that was given up for others its iterations did not run out: they were not wanted.
    given_up = status is Status.MAX_ITERATIONS
    alike = [c for c in candidates if c.cautious == chosen.cautious and (given_up or c.number == chosen.number)]
    later = any(c.solution.state.iteration > chosen.solution.state.iteration for c in alike)
    return Status.STOPPED_EARLY if later else status


def left_on(
    model: starts.Network, names: Iterable[str], runs: Iterable[tuple[NDArray[np.float64], History | None]]
) -> tuple[str, ...]:
    """The records over which a free run leaves its bounds.

    Args:
        model: The model.
        names: Of the records.
        runs: Inputs and history of each.

    Returns:
        The names of those over which it does.
    """

    def lost(inputs: NDArray[np.float64], history: History | None) -> bool:
        scaled = np.asarray(model.scaling.scale_output(model.simulate(inputs, history)))
        return not max(float(scaled.max()), -float(scaled.min())) < model.clamp * (1.0 - 1e-9)  # without a copy

    return tuple(dict.fromkeys(name for name, run in zip(names, runs, strict=True) if lost(*run)))


def left_told(left: Sequence[str]) -> tuple[str, ...]:
    """What a fit says of records over which its free run leaves its bounds, whatever random sequences say of it.

    Args:
        left: Their names.

    Returns:
        None, or a sentence.
    """
    if not left:
        return ()
    names = ", ".join(left[:MOST_NAMES]) + (f" and {len(left) - MOST_NAMES} more" if len(left) > MOST_NAMES else "")
    one = len(left) == 1
    return (
        f"Unstable: over the record{'s' * (not one)} {names}, which {'was' if one else 'were'} given to the fit, its "
        "free run leaves its bounds.",
    )


def multistart_result(
    choice: Choice,
    candidates: Sequence[starts.Candidate],
    training: Training,
    status: Status,
    seconds: float,
    *,
    left: Sequence[str] = (),
) -> FitResult:
    """What a multistart found.

    Args:
        choice: The candidate chosen.
        candidates: All of them, for the attempts.
        training: How they were trained.
        status: How it ended.
        seconds: Wall time.
        left: Names of the records over which the free run leaves its bounds.

    Returns:
        The result.
    """
    chosen = choice.chosen
    curve = chosen.solution.curve
    scale = chosen.model.scaling.error_unit
    return FitResult(
        model=chosen.model,
        status=status,
        loop=training.loop,
        history={
            "iteration": np.array([entry.iteration for entry in curve], dtype=np.float64),
            "mse": np.array([entry.mse * scale for entry in curve]),
            "effective_parameters": np.array([entry.effective_parameters for entry in curve]),
            "elapsed_s": np.array([entry.elapsed_s for entry in curve]),
        },
        train_time_s=seconds,
        seed=chosen.seed,
        evidence=chosen.solution.evidence,
        attempts=_attempts(choice, candidates),
        notes=(*_notes(choice, candidates, training), *left_told(left)),
        warnings=left_told(left),
    )


def _attempts(choice: Choice, candidates: Sequence[starts.Candidate]) -> tuple[Attempt, ...]:
    scale = choice.chosen.model.scaling.error_unit
    found = [
        Attempt(
            start=candidate.number + 1,
            seed=candidate.seed,
            iterations=candidate.solution.state.iteration,
            elapsed_s=candidate.solution.curve[-1].elapsed_s,
            estimation_mse=candidate.solution.curve[-1].mse * scale,
            selection_mse=candidate.score,
            log_evidence=candidate.log_evidence,
            away=candidate.away,
            effective_parameters=candidate.solution.curve[-1].effective_parameters,
            stable=stable,
            chosen=candidate is choice.chosen,
            members=tuple(number + 1 for number in candidate.members),
            without=candidate.without,
            cautious=candidate.cautious,
            status=candidate.solution.status.name,
        )
        for candidate, stable in zip(candidates, choice.stable, strict=True)
    ]
    return tuple(sorted(found, key=lambda attempt: (attempt.start, attempt.iterations)))


def _notes(choice: Choice, candidates: Sequence[starts.Candidate], training: Training) -> tuple[str, ...]:
    notes = []
    if training.n_starts > 1:
        compared = choice.by == "selection" and any(np.isfinite(c.away) for c in candidates)
        raced = [c for c in candidates if choice.by_selection or compared or not c.cautious]
        one = min((c for c in raced if not c.members), key=lambda c: rank(c, choice.by))
        by_evidence = choice.by != "loss" and one.solution.evidence is not None
        how = "the largest evidence" if by_evidence else "the least error on the estimation traces"
        how = "the least error on the selection traces (geometric mean)" if choice.by_selection else how
        if compared:
            how = MIDDLE
        begun = len({one.number for one in candidates if not one.members})
        alone = choice.by_selection or not choice.chosen.members
        taken = "Chosen" if alone and choice.chosen in raced else "Ranked"
        notes.append(f"{taken} by {how} among {begun} starts looked at {len(raced)} times.")
        if begun < training.n_starts and np.isfinite(training.max_time_s):
            notes.append(
                f"Of {training.n_starts} starts {begun} had a place in {training.max_time_s:.3g} s, as iterations are "
                "slow; more time (max_time_s) lets the others begin."
            )
    if choice.chosen.members and np.isfinite(choice.chosen.score):
        single = [
            c.score
            for c, stable in zip(candidates, choice.stable, strict=True)
            if not c.members and stable is not False and np.isfinite(c.score)
        ]
        notes.append(
            f"An ensemble of {len(choice.chosen.members)} picks: its error on the selection traces is "
            f"{choice.chosen.score:.3g}, that of the best single start {min(single, default=np.nan):.3g}."
        )
    refused = sum(stable is False for stable in choice.stable)
    if refused and any(choice.stable):
        notes.append(f"{refused} that ranked higher were passed over: {choice.refusal}.")
    if choice.forgetful:
        notes.append(
            "It was taken in place of one that follows the record as well: what that puts out hangs on where it began."
        )
    return tuple(notes)
