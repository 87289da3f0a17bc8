"""What keeps a surrogate from being better: too few experiments, too little time, or a structure that cannot."""

from __future__ import annotations

import numpy as np

from sysid.estimation import Status
from sysid.reporting.fit_records import FitRecord
from sysid.reporting.results import Results
from sysid.traces import Role
from sysid.workbench.auto.run import Searched
from sysid.workbench.surrogates.proof import Proof

WANTED = 0.99
"""Share of the proof's experiments within the tolerance below which it is said what limits it."""
CLEARLY = 2.0
"""Standard errors of the proof's share by which that of what was fitted has to be above it to be clearly more."""
KNOWLEDGE = (
    "where something switches, sticks or stops, smooth maps come near it and no nearer: write what you know as "
    "equations, sampled as finely as its events ask (docs/how/events.md)"
)
"""What helps where a structure cannot."""
CUT_SHORT = {Status.TIME_LIMIT.name, Status.MAX_ITERATIONS.name, Status.INTERRUPTED.name}
"""How a training ends that still gained."""


def limits(
    results: Results, shown: Proof, *, searched: Searched | None = None, iterations: int | None = None
) -> list[str]:
    """What limits a surrogate, as its fit and its proof show beside each other, and what helps.

    Args:
        results: Of the fit that was exported.
        shown: How it does on new experiments.
        searched: What came of the search; ``None`` of fits that were given. Where there was no time for one, that
            limits it, and is told.
        iterations: Its budget, where that is no time.

    Returns:
        A sentence; none where it is good enough, or where nobody knows.
    """
    fits = _exported(results, shown.outputs)
    if shown.share >= WANTED or fits is None or (searched and searched.hurried):
        return []
    own, status = _fitted(fits, shown), {one.status for one in fits}
    if not np.isfinite(own):
        return []
    within = f"within {100.0 * shown.tolerance:g} %"
    beside = f"{100.0 * own:.0f} % of the experiments that were fitted are {within}"
    budget, more, or_so = "time", "More --minutes", ", or a quieter machine"
    if iterations is not None:
        budget, more, or_so = "its iterations", f"More than {iterations:,} iterations", ""
    chance = (shown.share * (1.0 - shown.share) / len(shown.errors)) ** 0.5
    if own >= min(WANTED, shown.share + 0.5 * (1.0 - shown.share)) and own > shown.share + CLEARLY * chance:
        return [
            f"what limits it is data: {beside}, and {100.0 * shown.share:.0f} % of new ones. More experiments help: "
            "--rounds 4, more runs in experiment.yaml, or more --minutes"
        ]
    if status & CUT_SHORT:
        return [
            f"what limits it is {budget}: {fits[0].label} still gained when its training had to end, and {beside}. "
            f"{more} help{or_so}"
        ]
    if searched and searched.spent:
        tried = len(searched.record.trials)
        return [
            f"what limits it is the search, which ended after {tried} trials as its budget was spent: the training of "
            f"{fits[0].label}, the best of them, had come to its end, and {beside}. {more} try other structures; "
            f"{KNOWLEDGE}"
        ]
    return [
        f"what limits it is structure: the training of {fits[0].label} had come to its end, and {beside}. Another "
        f"--seed begins elsewhere; {KNOWLEDGE}"
    ]


def _exported(results: Results, outputs: tuple[str, ...]) -> list[FitRecord] | None:
    """The fit of each output, of what was chosen; ``None`` where none was."""
    best = results.best
    if best is None:
        return None
    by_name = {one.name: one for one in results.fits}
    names = next((one.fits for one in results.systems if best.name in one.fits.values()), {outputs[0]: best.name})
    found = [by_name[names[output]] for output in outputs if names.get(output) in by_name]
    return found if len(found) == len(outputs) else None


def _fitted(fits: list[FitRecord], shown: Proof) -> float:
    """Share of the experiments that were fitted in which every output is within the tolerance; NaN without any."""
    names = [name for name, case in fits[0].cases.items() if case.role is Role.ESTIMATION]
    within = [
        all(
            np.sqrt(one.cases[name].free_run.mse) <= shown.tolerance * span
            for one, span in zip(fits, shown.spans, strict=True)
        )
        for name in names
    ]
    return float(np.mean(within)) if within else float("nan")
