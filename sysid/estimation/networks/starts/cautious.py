r"""A second, cautious fit of a short record, which counts errors that persist as fewer samples.

Residuals of a free run persist. The evidence counts them by their correlation time, but grants each parameter some
independent samples (:data:`~sysid.estimation.least_squares.evidence.SAMPLES_PER_PARAMETER`): otherwise what a rough
model leaves, which persists too, would pass for noise, and the model would stay rough. On a record of a few samples per
parameter that switches the correction off. A network then learns the noise by heart, and its run over other commands
may be anything. Which of the two a record needs cannot be seen before it is fitted.

So both are fitted, from the same start. The cautious fit grants samples to those parameters alone that the data
determine. Selection traces choose between the two as between all starts. Without such traces the other fit has to pay
for what it has more: with mean squared errors :math:`E`, effective parameters :math:`\gamma`, and :math:`N/\tau`
independent samples by the cautious fit's correlation time, it is taken where

.. math:: \frac{N}{\tau} \ln\frac{E_\text{cautious}}{E_\text{other}}
    > (\gamma_\text{other} - \gamma_\text{cautious}) \ln\frac{N}{\tau},

which is the information criterion of Schwarz (1978, "Estimating the dimension of a model") over independent samples.

Limits: two fits in place of one, where there are fewer than :data:`SHORT` samples per parameter; the criterion judges
two local minima, and knows nothing of commands that the record does not hold.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from sysid.estimation.networks.starts.choosing import Choice, rank
from sysid.estimation.networks.starts.multistart import Candidate, Multistart, Place

TINY = 1e-300
"""A loss in the place of none."""


def begun(
    multistart: Multistart, seen: Sequence[Candidate], ends: Sequence[int]
) -> tuple[Multistart, Sequence[int]] | None:
    """What cautious fits have in common with the others, and the starts that they begin with.

    Args:
        multistart: The multistart.
        seen: Its candidates.
        ends: Starts that came to their end.

    Returns:
        Both; ``None`` where none is wanted: the record is long enough, or the fit goes on from a given one.
    """
    if not multistart.twice or multistart.stop.is_set() or multistart.left("") <= 0.0:
        return None
    best = min(seen, key=lambda one: rank(one, multistart.training.choose_by))
    done = {-1: sum(multistart.iterations.values())}
    own = replace(multistart, cautious=True, resume=None, name=f"{multistart.name}cautious ", iterations=done)
    return own, [best.number] if multistart.least == 1 else ends


def beside(cautious: Candidate, seen: Sequence[Candidate], multistart: Multistart) -> list[Candidate]:
    """The candidates that a cautious fit is set against.

    Args:
        cautious: The fit.
        seen: The other candidates.
        multistart: The multistart.

    Returns:
        All of them, or where several are fitted cautiously those of the same start.
    """
    return [one for one in seen if multistart.least == 1 or one.number == cautious.number]


def placed(cautious: Candidate, seen: Sequence[Candidate], n_samples: int) -> Candidate:
    """A cautious fit with its place where no selection traces choose.

    Args:
        cautious: The fit.
        seen: The other candidates.
        n_samples: Samples that count.

    Returns:
        The candidate, before all others or after them.
    """
    best = min(seen, key=lambda one: rank(one, "evidence"))
    if cautious.solution.evidence is None or best.solution.evidence is None:
        return replace(cautious, place=Place.LAST)
    return replace(cautious, place=Place.LAST if pays(best, cautious, n_samples) else Place.FIRST)


def pays(closer: Candidate, other: Candidate, n_samples: int) -> bool:
    """Whether the smaller error of a fit pays for the parameters that it has more.

    Args:
        closer: The fit that is closer to the records.
        other: The other one; where it is cautious, its correlation time counts samples.
        n_samples: Samples that count.

    Returns:
        Whether, by the criterion above; where evidence is missing, it does.
    """
    theirs, ours = closer.solution.evidence, other.solution.evidence
    if theirs is None or ours is None:
        return True
    independent = max(n_samples / ours.correlation_time, math.e)
    gained = independent * (math.log(max(other.loss, TINY)) - math.log(max(closer.loss, TINY)))
    return gained > (theirs.total_effective_parameters - ours.total_effective_parameters) * math.log(independent)


WHY = {
    Place.FIRST: "since the smaller error of the other does not pay for the parameters that it has more (their "
    "evidences count samples differently, and say nothing beside each other)",
    Place.LAST: "since no other that was looked at has a stable free run",
}
"""Why a cautious fit was taken without selection traces, by its place."""
ONE_START = (
    "One start of a short record says as much of the start as of the record: of three or more (starts: 5) the one in "
    "the middle of all is taken."
)
"""What is said where there was one."""


def told(choice: Choice, candidates: Sequence[Candidate], n_samples: int) -> tuple[str, ...]:
    """What a fit says of it.

    Args:
        choice: The candidate that was chosen.
        candidates: All of them.
        n_samples: Samples that count.

    Returns:
        None, or a sentence.
    """
    fits = {one.number: one for one in candidates if one.cautious}
    if not fits:
        return ()
    short = f"The record is short: {n_samples:,} samples for {len(min(fits.items())[1].solution.theta)} parameters."
    what = "cautious fit was made, which counts errors that persist as fewer samples"
    if len(fits) > 1:
        taken = sum(one.place is Place.FIRST for one in fits.values())
        end = f"{taken} of them were taken, {WHY[Place.FIRST]}" if taken else "none of them was taken"
        return (f"{short} So a second, {what}, of each of {len(fits)} starts; {end}.",)
    chosen, end = choice.chosen, "it was not taken"
    if chosen.cautious:
        why = "by its error on the selection traces" if choice.by_selection else WHY[chosen.place]
        end = f"it was taken, {why}"
    told = f"{short} So a second, {what}; {end}."
    if choice.by_selection or len({one.number for one in candidates}) > 1:
        return (told,)
    return (f"{told} {ONE_START}",)
