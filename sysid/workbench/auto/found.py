"""What the trials of a search came to: what was chosen, how it is fitted in the end, and what is told of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from sysid.estimation.estimators import estimator_of
from sysid.models import AbstractModel
from sysid.models.store import structure_from_dict
from sysid.reporting.sweep_record import SweepRecord, Trial
from sysid.workbench.auto.beyond import Beyond
from sysid.workbench.auto.last_fit import LAST_FITS, LINEAR_LAST, RIPENING
from sysid.workbench.auto.parts import Parts
from sysid.workbench.auto.words import shown_in
from sysid.workbench.auto.worth import error
from sysid.workbench.fits.fit_steps import GivenFit

FOUND, LINEAR = "best found", "best linear"
"""Names of the fits that a search hands to the pipeline."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Found:
    """What the trials came to.

    Args:
        record: All of them.
        shown: By the name of the fit: what was chosen, and the best linear model where that is another.
        fits: Their fits, as they were made, one a model.
        training: Their options.
        parts: What was fitted and what chose.
        kept: Share of the budget that is left to the last fit, at least.
        ends_s: Seconds by the clock by which the last fit has to be over; infinite where iterations are counted.
        slowed: Seconds by the clock that a second of training takes.
        told: What a reader has to know.
        beyond: How far models are apart on other commands: what the record does not show.
        unit: Of errors.
        hurried: Of that, that there was no search, as the time was up before structures were compared; empty elsewhere.
        needs_s: Seconds that a search takes at least, where there was no time for one; 0 elsewhere.
        spent: Whether it ended as its budget was spent, before it had tried all that it wanted.
        done_now: Trials that this session has done itself.
    """

    record: SweepRecord
    shown: Mapping[str, Trial]
    fits: Mapping[str, list[GivenFit]]
    training: Mapping[str, Mapping[str, Any]]
    parts: Parts
    kept: float
    ends_s: float
    slowed: float
    told: tuple[str, ...]
    beyond: Beyond
    unit: str
    hurried: str
    needs_s: float
    spent: bool
    done_now: int

    @property
    def judged_by(self) -> dict[str, Any]:
        """What :meth:`alone` and :meth:`warning` depend on beside the model."""
        terms = {"error": error(self.shown[FOUND]), "spread": self.beyond.spread, "models": self.beyond.models}
        return {"beyond": self.beyond.digest, **terms} if self.beyond.models else {}

    def alone(self, model: AbstractModel) -> bool:
        """Whether a model of what was chosen stands alone on other commands.

        Args:
            model: Of all outputs, or of one.

        Returns:
            Whether it does.
        """
        return self.beyond.alone(model, error(self.shown[FOUND]))

    def warning(self, model: AbstractModel) -> str:
        """What the record does not show of a model of what was chosen.

        Args:
            model: As for :meth:`alone`.

        Returns:
            A warning; empty where it shows enough.
        """
        return self.beyond.sentence_of(model, error(self.shown[FOUND]), partial(shown_in, self.unit))

    def last_fits_s(self, spent_s: float, samples: int) -> dict[str, float]:
        """How long each of the last fits may take, so that they end in time.

        A linear fit is not cut short everywhere: it is done again only where what its trial took, over all samples,
        leaves time enough. What was chosen has the rest.

        Args:
            spent_s: Seconds of the search so far.
            samples: Of all that is fitted.

        Returns:
            By name seconds by the clock; 0 for what is kept as its trial has it.
        """
        if not math.isfinite(self.ends_s):
            return dict.fromkeys(self.shown, math.inf)
        left, found = LAST_FITS * (self.ends_s - spent_s), dict[str, float]()
        more = samples / sum(len(trace) for trace in self.parts.folds[0].fitted) / len(self.parts.folds)
        for name, trial in reversed(list(self.shown.items())):  # the linear one first, which is short
            need = self.slowed * trial.cpu_s * more
            share = left if name == FOUND else LINEAR_LAST * left
            linear = estimator_of(structure_from_dict(trial.structure)).linear
            enough = need <= share if linear else not share <= RIPENING * trial.iteration_s * more * self.slowed
            found[name] = max(share, 0.0) if enough else 0.0
            left -= min(need, found[name]) if linear else 0.0
        return found
