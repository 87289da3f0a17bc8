"""The choice between the candidates of a multistart: by selection traces or evidence, and only what is stable.

Of those alike one is taken that forgets where it began: of a record without noise, starts that all follow it to a
hundredth differ in what they do beyond it, and one that does not forget has a second place to stand there.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sysid.estimation.networks.starts.multistart import Candidate, Network, Place
from sysid.estimation.results.result import NOT_STABLE


def rank(candidate: Candidate, choose_by: str) -> tuple[bool, int, int, float]:
    """Sorting key, best first; fits that did not improve come last.

    Args:
        candidate: The candidate.
        choose_by: ``selection``, where a tolerance is declared by the traces on which it is left first, or
            ``evidence``; without selection traces the distance from the middle of all starts where that was asked, the
            evidence where it was not, without evidence the loss. Or ``loss``, which comes after selection traces too,
            and before the evidence.

    Returns:
        The key.
    """
    place = candidate.place
    if choose_by != "evidence" and np.isfinite(candidate.score):
        value, place = candidate.score, Place.BY_EVIDENCE
    elif choose_by == "selection" and np.isfinite(candidate.away):
        value, place = candidate.away, Place.FIRST
    elif choose_by != "loss" and candidate.solution.evidence is not None:
        value = -candidate.log_evidence
    else:
        value = candidate.loss
    return not candidate.solution.status.usable, candidate.outside if choose_by == "selection" else 0, place, value


VETTED = 10
"""Best candidates that are looked at for one whose free run is stable."""
LOOKS = 2
"""Of them how many may be looks at the same start: what runs away at one look mostly does at the next."""


NEAR = 0.2
"""Share of its error by which a model that forgets where it began may be worse than one that does not."""
EXACT = 1e-2
"""Root mean square of a scaled output, within which two fits follow their record as well as anybody asks."""


def refusal(vet: Callable[[Network], bool] | None) -> str:
    """Why candidates were refused, in words.

    Args:
        vet: Who asked; a check of the free run has it in its ``refusal``.

    Returns:
        To follow "as" or a colon.
    """
    return str(getattr(vet, "refusal", NOT_STABLE))


@dataclass(frozen=True, kw_only=True, eq=False)
class Choice:
    """Which candidate was chosen.

    Args:
        chosen: The candidate.
        stable: Of each candidate, whether its free run was found stable; ``None`` where it was not looked at.
        by: As for :func:`rank`.
        refusal: Why some were refused, in words.
        forgetful: Whether it was taken in place of one alike that hangs on where it began.
    """

    chosen: Candidate
    stable: tuple[bool | None, ...]
    by: str
    refusal: str = NOT_STABLE
    forgetful: bool = False

    @property
    def by_selection(self) -> bool:
        """Whether selection traces chose."""
        return self.by != "evidence" and bool(np.isfinite(self.chosen.score))


def choose(candidates: Sequence[Candidate], choose_by: str, vet: Callable[[Network], bool] | None = None) -> Choice:
    """Choose the best candidate, or the best stable one among the best.

    Args:
        candidates: At least one.
        choose_by: As for :func:`rank`.
        vet: Whether a model's free run is stable; ``None`` takes the best as it is.

    Returns:
        The choice; the best of all where none that was looked at is stable.
    """
    order = sorted(range(len(candidates)), key=lambda i: rank(candidates[i], choose_by))
    found: dict[int, bool] = {}
    chosen, forgetful = order[0], None
    if vet is not None:
        looked = _few_of_each(candidates, order)[:VETTED]
        for place, i in enumerate(looked):
            found[i] = vet(candidates[i].model)
            if found[i]:
                forgetful = _one_that_forgets(candidates, looked[place:], choose_by, vet)
                chosen = i if forgetful is None else forgetful
                found[chosen] = True
                break
    stable = tuple(found.get(i) for i in range(len(candidates)))
    return Choice(
        chosen=candidates[chosen], stable=stable, by=choose_by, refusal=refusal(vet), forgetful=forgetful is not None
    )


def _one_that_forgets(
    candidates: Sequence[Candidate], places: Sequence[int], choose_by: str, vet: Callable[[Network], bool]
) -> int | None:
    """Of stable candidates alike the first that forgets where it began, if the first of all does not.

    Where most of them do not, the system itself may integrate or lock.
    """
    apart: Callable[[Network], int] | None = getattr(vet, "apart", None)
    first = places[0]
    if apart is None or not apart(candidates[first].model):
        return None
    scored = choose_by != "evidence" and np.isfinite(candidates[first].score)
    error = {i: candidates[i].score if scored else candidates[i].solution.curve[-1].mse for i in places}
    limit = max((1.0 + NEAR) ** 2 * error[first], 0.0 if scored else EXACT**2)
    near = [i for i in places if candidates[i].solution.status.usable and error[i] <= limit]
    forget = [i for i in near if vet(candidates[i].model) and not apart(candidates[i].model)]
    return forget[0] if 2 * len(forget) >= len(near) else None


def _few_of_each(candidates: Sequence[Candidate], order: Sequence[int]) -> list[int]:
    """The candidates in order, of each start the best looks."""
    seen: Counter[tuple[int, bool]] = Counter()
    found = []
    for i in order:
        start = candidates[i].number, candidates[i].cautious
        seen[start] += 1
        if seen[start] <= LOOKS:
            found.append(i)
    return found
