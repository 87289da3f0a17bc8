"""A fit of a pipeline on its way: its models, its outputs and their figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from sysid.estimation import FitResult
from sysid.workbench.fits import steps
from sysid.workbench.fits.config import FitConfig
from sysid.workbench.fits.outputs import FitModel, FitOutput
from sysid.workbench.runner import events
from sysid.workbench.runner.steps import Done
from sysid.workbench.runner.store import digest


@dataclass(frozen=True, kw_only=True, eq=False)
class Scored:
    """One output of a fit and its figures, on their way."""

    output: FitOutput
    of: FitConfig
    model: FitModel
    fit: Done[FitResult]
    scores: Done[steps.Scores]
    folder: Path

    @property
    def pair(self) -> tuple[FitResult, steps.Scores]:
        """The fit and its figures."""
        return self.fit.value, self.scores.value

    def ready(self) -> events.FitReady:
        """What is told of it."""
        fit, scores = self.pair
        return events.FitReady(
            config=self.output.fit,
            pipeline=self.output.config,
            key=self.scores.key,
            fit=fit,
            evaluation=scores.evaluation,
            selection_mse=scores.selection_mse,
            stored=self.fit.stored and self.scores.stored,
            folder=self.folder,
            system=None if self.of.name == self.output.fit.name else self.of.name,
            model_slug=self.model.fit.slug,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Fitted:
    """A fit: its models, and its outputs in the mapping's order."""

    config: FitConfig
    models: Mapping[str, Done[FitResult]]
    outputs: tuple[Scored, ...]

    @property
    def pairs(self) -> list[tuple[FitResult, steps.Scores]]:
        """Fit and figures of each output."""
        return [one.pair for one in self.outputs]

    @property
    def ready(self) -> list[events.FitReady]:
        """What is told of each output."""
        return [one.ready() for one in self.outputs]

    @property
    def scores_key(self) -> str:
        """What the figures of all outputs depend on."""
        keys = [one.scores.key for one in self.outputs]
        return keys[0] if len(keys) == 1 else digest(keys)
