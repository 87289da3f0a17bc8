"""The last fit of a search, planned: how it is trained, how long it takes, and what is kept for it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sysid.estimation import Training
from sysid.estimation.estimators import estimator_of
from sysid.estimation.networks.middle import most_iterations
from sysid.models.store import structure_from_dict
from sysid.reporting.sweep_record import Trial
from sysid.workbench.auto.beyond import Beyond
from sysid.workbench.auto.budget import GOING_ON, REFIT
from sysid.workbench.auto.config import AutoConfig
from sysid.workbench.auto.parts import ENSEMBLE, LAST, UNITED, Parts
from sysid.workbench.auto.plan import FINALISTS, Plan
from sysid.workbench.auto.worth import error, ranked_by
from sysid.workbench.fits.data import Data

SCATTER = 0.1
"""Standard deviation of the logarithm of a network's error over its starts, on the same held-out parts, beyond which it
says as much of the start as of the structure: what is fitted in the end is then the mean of several starts."""
LAST_FITS, LINEAR_LAST, RIPENING = 0.9, 0.25, 3
"""Share of the time that is left which the last fits may train, as they do more than that; of it, that of the best
linear model; and iterations of a network below which it is not begun."""
SURE, LEAST_LAST = 2.0, 0.05
"""Times what the last fits are expected to take that is kept for them, and share of the time that is in any case."""


def refit_share(parts: Parts) -> float:
    """Share of the time that is kept for the last fit.

    Args:
        parts: What is fitted and what chooses.

    Returns:
        More where the chosen network goes on from where its trial had ended.
    """
    return GOING_ON if parts.trained_on else REFIT


@dataclass(frozen=True, kw_only=True, eq=False)
class LastFit:
    """How what is chosen will be fitted.

    Args:
        config: The search.
        data: The traces.
        parts: What is fitted and what chooses.
    """

    config: AutoConfig
    data: Data
    parts: Parts

    def united(self, plan: Plan, chosen: Trial, spent_s: float, beyond: Beyond) -> Mapping[str, Any]:
        """How it is trained where it is the mean of several starts, as of one alone it would say little.

        Args:
            plan: What was tried.
            chosen: What is fitted.
            spent_s: Seconds of the search so far.
            beyond: How far models are apart on other commands.

        Returns:
            Options of its training; none where one start is enough.
        """
        row = estimator_of(structure_from_dict(chosen.structure))
        apart = (
            "ensemble" in chosen.values
            or plan.scattered.get(chosen.number, 0.0) > SCATTER
            or beyond.is_lottery(error(chosen))
        )
        if self.parts.trained_on or not row.unites or not apart:
            return {}
        # As many starts as there is time for: halfway trained, none of them says anything.
        left = LAST_FITS * (plan.budget.ends_s - spent_s)
        return next((way for way in (UNITED, ENSEMBLE) if self._seconds(plan, chosen, way) <= left), {})

    def _seconds(self, plan: Plan, trial: Trial, way: Mapping[str, Any]) -> float:
        """How long a last fit takes by the clock, as its trial tells; NaN where it does not."""
        structure = structure_from_dict(trial.structure)
        more = sum(map(len, self.data.estimation)) / sum(map(len, self.parts.folds[0].fitted))
        slowed = 1.0 if self.config.wall_s is None else plan.budget.slowed
        if estimator_of(structure).linear:
            return slowed * trial.cpu_s * more / len(self.parts.folds)
        if estimator_of(structure).training is not Training:
            return math.nan
        point, samples = plan.points[trial.number], sum(map(len, self.data.estimation))
        models = 1 if structure.for_outputs(self._n_outputs).several_outputs else self._n_outputs
        row = estimator_of(structure)
        iterations = most_iterations(
            Training(**{**point.training, **way}).with_starts(row.starts), n_samples=samples,
            n_parameters=trial.parameters, selects=False, unites=row.unites, twice=row.twice,
        )  # fmt: skip
        return slowed * trial.iteration_s * iterations * more * models

    def kept(self, plan: Plan) -> float:
        """Share of the time that is kept for it: no more than those of the best take, and as much again.

        On a short record that is a few seconds, where a fifth of the time had been kept.

        Args:
            plan: What was tried.

        Returns:
            The share.
        """
        most, wall_s = refit_share(self.parts), self.config.wall_s
        usable = [
            one for one in sorted(plan.trials, key=ranked_by(error, self.config.tolerance)) if math.isfinite(error(one))
        ]
        kinds = {one.number: estimator_of(structure_from_dict(one.structure)) for one in usable}
        best = [one for one in usable if not kinds[one.number].linear][:FINALISTS]
        if wall_s is None or self.parts.trained_on or not best:
            return most
        need = [self._seconds(plan, one, UNITED if kinds[one.number].unites else LAST) for one in best]
        need += [self._seconds(plan, one, {}) / LINEAR_LAST for one in usable if kinds[one.number].linear][:1]
        told = max(need) if all(map(math.isfinite, need)) else math.inf
        return min(most, max(LEAST_LAST, SURE * told / wall_s))

    @property
    def _n_outputs(self) -> int:
        return len(self.config.mapping.outputs)
