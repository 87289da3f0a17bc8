"""The chosen structure on all of the record: what was held out is fitted too, once nothing is left to be chosen."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sysid.estimation import FitResult
from sysid.traces import Role, Trace
from sysid.validation import case_results
from sysid.workbench.fits import steps
from sysid.workbench.fits.config import FitConfig, PipelineConfig
from sysid.workbench.fits.data import Data
from sysid.workbench.runner.steps import Work

KEPT = (
    "Of the chosen structure, the fit that was chosen is kept: fitted once more, to all of the record, it is no better."
)
ALL = "Fitted once more, to all of the record, after it was chosen on a part of it."


def refitted(work: Work, fit: FitConfig, config: PipelineConfig, data: Data, *, chosen: FitResult) -> FitResult:
    """Fit the chosen structure to all estimation traces.

    Args:
        work: Told how it goes.
        fit: The structure and its training.
        config: The pipeline, as of the model's outputs.
        data: All traces.
        chosen: The fit that was chosen, of a part of them.

    Returns:
        The new fit, or the chosen one where that does better on all of them.
    """
    watch = work.watch(getattr(fit.training_options(config.seed), "max_time_s", math.inf))
    again = steps.fit_traces(fit, config, data, None, watch)
    ours, theirs = (_error(one, data.estimation, config) for one in (again, chosen))
    better = again.status.comparable and (ours <= theirs or not np.isfinite(theirs))
    found = again if better else chosen
    return replace(found, notes=(*found.notes, ALL if better else KEPT))


def _error(fit: FitResult, traces: Sequence[Trace], config: PipelineConfig) -> float:
    """Mean square of the free run over all traces and outputs, each over its own variance."""
    found = []
    for trace in traces:
        for output, case in case_results(fit.model, trace, Role.ESTIMATION, config.start, 1).items():
            found.append(case.free_run.mse / (float(np.var(trace[output])) or 1.0))
    return float(np.mean(found))
