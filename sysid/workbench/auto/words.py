"""Which trial is chosen, and why, in one sentence."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from sysid.estimation.estimators import ESTIMATORS
from sysid.reporting.numbers import number, quantity
from sysid.reporting.sweep_record import Trial
from sysid.validation.resolution import tied
from sysid.workbench.auto.ledger import ALIKE
from sysid.workbench.auto.plan import RIVAL
from sysid.workbench.auto.worth import ranked_by
from sysid.workbench.sweep.trial import FAILED

Error = Callable[[Trial], float]
NEAR = 0.15
"""Part of the least error within which a linear model that cannot be told from it is chosen in its place."""
EXACT = 1e-8
"""Share of the output's range below which an error is none."""


@dataclass(frozen=True, kw_only=True)
class Choice:
    """What was chosen.

    Args:
        chosen: The trial.
        least: The one of the least error.
        linear: The best linear one; ``None`` where none can be used.
        refused: Trials of less error that were passed over, as their free run is not stable.
        nonlinear: Trials that are no linear model.
        finished: Of these the ones that came to a result, whatever it is worth; the others say nothing.
        unusable: Where none of those can be used, how they ended.
        more_within: Over how many of the traces that choose it stays within the tolerance, in words, where that is
            why it comes before one of less error; empty elsewhere.
        stable: The best stable one, where that was passed over for one whose training goes on.
        alone: Of an ensemble the best trial of its structure without one.
        nearer: The one of the least error, where it was passed over as it stands alone on other commands.
    """

    chosen: Trial
    least: Trial
    linear: Trial | None
    refused: int
    nonlinear: int
    finished: int
    unusable: tuple[str, ...] = ()
    more_within: str = ""
    stable: Trial | None = None
    alone: Trial | None = None
    nearer: Trial | None = None


def choose(
    trials: Sequence[Trial],
    error: Error,
    first_stable: Callable[[Sequence[Trial]], tuple[Trial, int]],
    *,
    tolerance: float | None = None,
    goes_on: Callable[[Trial], bool] = lambda _: False,
    beyond: Error = lambda _: 0.0,
) -> Choice:
    """The smallest of those whose error is as good as the least.

    Args:
        trials: All of them; at least one can be used.
        error: What chooses, as a mean square.
        first_stable: The first of some whose free run is stable, and how many were passed over.
        tolerance: As for :func:`~sysid.workbench.auto.worth.ranked_by`.
        goes_on: Whether a trial's training goes on once it is chosen. A network that few iterations have brought far
            ahead of all that is stable is not passed over for what those few iterations have left in it.
        beyond: How far its models are from the middle of all on other commands where they stand alone, a mean square:
            it counts like the error.

    Returns:
        The choice.
    """

    def worth(trial: Trial) -> float:
        return error(trial) + beyond(trial)

    rank = ranked_by(worth, tolerance)

    def outside(trial: Trial) -> float:
        return rank(trial)[0]

    usable = sorted((t for t in trials if math.isfinite(error(t))), key=rank)
    chosen, refused = first_stable(usable)
    limit = worth(chosen) * (1.0 + ALIKE) ** 2
    linear = [t for t in usable if ESTIMATORS[t.structure["kind"]].linear]

    def no_worse(trial: Trial) -> bool:
        return (
            worth(trial) <= limit
            or (trial in linear and cannot_be_told(chosen, trial, error))
            or both_exact(chosen, trial)
        )

    alike = [t for t in usable[refused:] if no_worse(t) and outside(t) <= outside(chosen)]
    more = tolerance is not None and min(map(worth, usable[refused:])) < worth(chosen)
    smallest, _ = first_stable(sorted(alike, key=lambda t: (t.operations, worth(t), t.number)))
    nonlinear = [t for t in trials if not ESTIMATORS[t.structure["kind"]].linear]
    alone = [t for t in usable if t.structure == smallest.structure and "ensemble" not in t.values]
    least = min(usable[refused:], key=error)
    found = Choice(
        nearer=least if not more and error(least) * (1.0 + ALIKE) ** 2 < error(chosen) else None,
        alone=alone[0] if alone and "ensemble" in smallest.values else None,
        chosen=smallest, least=chosen, linear=linear[0] if linear else None, refused=refused, nonlinear=len(nonlinear),
        finished=sum(t.status != FAILED for t in nonlinear),
        unusable=() if any(t.usable for t in nonlinear) else _ended(nonlinear),
        more_within=f"{1.0 - outside(chosen):.0%} of what chose within {tolerance:.0%} of its range" if more else "",
    )  # fmt: skip
    ahead = [k for k, t in enumerate(usable[:refused]) if goes_on(t) and RIVAL**2 * error(t) < error(chosen)]
    if not ahead:
        return found
    first = usable[ahead[0]]
    return replace(found, chosen=first, least=first, refused=ahead[0], more_within="", stable=smallest, nearer=None)


def cannot_be_told(best: Trial, other: Trial, error: Error) -> bool:
    """Whether one's error cannot be told from the least by what chose, nor lies far from it."""
    near = error(other) <= error(best) * (1.0 + NEAR) ** 2
    return near and tied(best.selection_errors, other.selection_errors)


def both_exact(*trials: Trial) -> bool:
    """Whether what several leave is rounding: an error of 1e-16 is no better than one of 1e-14."""
    return all(one.selection_rms_shares and max(one.selection_rms_shares) <= EXACT for one in trials)


def shown_in(unit: str, value: float) -> str:
    """A figure with its unit, as far as it has one."""
    return number(value) if unit == "1" else quantity(value, unit)


def _ended(trials: Sequence[Trial]) -> tuple[str, ...]:
    """How some trials ended, in words, each once."""
    return tuple(sorted({trial.status.lower().replace("_", " ") for trial in trials}))


def _beside_nonlinear(choice: Choice) -> str:
    """What nonlinear models have to do with the choice of a linear one: those that were not done are not worse."""
    if not choice.nonlinear:
        return "no nonlinear model was tried"
    if not choice.finished:
        return f"no nonlinear model came to a result ({choice.nonlinear} begun), so that none may be called worse"
    if choice.unusable:
        none = (
            "the one nonlinear model cannot"
            if choice.nonlinear == 1
            else f"none of {choice.nonlinear} nonlinear ones can"
        )
        return f"{none} be used ({', '.join(choice.unusable)})"
    without = choice.nonlinear - choice.finished
    return "and no nonlinear model does better" + (f" ({without} more came to no result)" if without else "")


def sentence(
    choice: Choice, tried: int, *, again: int = 0, raced: int = 0, unit: str, ended: str, error: Error,
    beyond: Error = lambda _: 0.0,
) -> str:  # fmt: skip
    """Why this one.

    Args:
        choice: What was chosen.
        tried: How many were tried.
        again: The best nonlinear models among them that were trained again from other starts; 0 for none.
        raced: Networks among them that were trained on side by side before the choice.
        unit: Of the output.
        ended: Why the search ended.
        error: What chooses.
        beyond: How far a trial's models are from the middle of all on other commands, a mean square.

    Returns:
        One sentence, and another where some were passed over.
    """
    root = math.sqrt(error(choice.chosen))

    def shown(value: float) -> str:
        return shown_in(unit, value)

    why = f"{choice.chosen.label} has the least free-run error on what chose, {shown(root)} (root mean square)"
    if choice.more_within:
        why = f"{choice.chosen.label} has {choice.more_within}, more than any of less error than its {shown(root)} has"
    elif choice.nearer is not None:
        ours, theirs = (
            f"{shown(math.sqrt(error(one)))} on what chose and {shown(math.sqrt(beyond(one)))}"
            for one in (choice.chosen, choice.nearer)
        )
        why = (
            f"{choice.chosen.label} has a free-run error (root mean square) of {ours} from the middle of all on other "
            f"commands; {choice.nearer.label}, of the least error, has {theirs}"
        )
    elif choice.least.number != choice.chosen.number:
        within = error(choice.chosen) <= error(choice.least) * (1.0 + ALIKE) ** 2
        alike = f"within {ALIKE:.0%} of" if within else "of those that what chose cannot tell from"
        on = " on what chose" if within else ""
        why = (
            f"{choice.chosen.label} is the smallest {alike} the least free-run error{on}: "
            f"{shown(root)} (root mean square) beside {shown(math.sqrt(error(choice.least)))} of "
            f"{choice.least.label}"
        )
    best = "the best nonlinear model" if again == 1 else f"the {again} best nonlinear models"
    finals = f", {best} again from other starts" if again else ""
    finals += f", the {raced} best networks trained on side by side before that" if raced else ""
    parts = [f"{why}, of {tried} tried{finals}"]
    if choice.alone is not None and error(choice.alone):
        less, more = 1.0 - root / math.sqrt(error(choice.alone)), choice.chosen.operations / choice.alone.operations
        parts.append(f"{less:.0%} less than one start of it, for {more:.2g} times the multiplications a step")
    if choice.linear is not None and not ESTIMATORS[choice.chosen.structure["kind"]].linear:
        linear = math.sqrt(error(choice.linear))
        share = 1.0 - root / linear if linear else 0.0  # what is met exactly has no error to better
        gains = f"{share:.0%} less than" if round(share, 2) else "as much as"  # chosen for its size
        parts.append(f"{gains} the best linear model, {choice.linear.label}")
    elif choice.linear is not None:
        parts.append(_beside_nonlinear(choice))
    said = f"{'; '.join(parts)}; {ended}."
    if choice.stable is not None:
        said += (
            f" Its free run was not stable yet: its error is less than half of that of {choice.stable.label}, the best "
            "stable one, and its training goes on. Allow more minutes if it is not stable in the end."
        )
    if choice.refused:
        said += f" {choice.refused} of less error were passed over: their free run is not stable."
    return said
