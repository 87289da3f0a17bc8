"""What a run says of its fits beyond their figures: residuals, static curves, and whether a linear model is enough."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

from sysid.errors import TraceError
from sysid.estimation import FitResult
from sysid.estimation.estimators import estimator_of
from sysid.estimation.records.experiment import Experiment
from sysid.models.blocks.curve_values import curve_values, has_curves
from sysid.traces import Role
from sysid.validation import Linearity, analyse_residuals, judge_linearity
from sysid.workbench.fits.config import PipelineConfig
from sysid.workbench.fits.data import Data
from sysid.workbench.runner.events import FitReady

GROUPS: Final = {"estimation": (Role.ESTIMATION,), "unseen": (Role.VALIDATION, Role.TEST)}
"""Cases whose residuals are analysed together, by their role."""


def residuals(fit: FitResult, data: Data, config: PipelineConfig) -> dict[str, Any]:
    """Analyse what a fit leaves one step ahead, on the cases that it was fitted to and on those it never saw.

    Args:
        fit: The fit.
        data: The traces.
        config: The pipeline, as of one output.

    Returns:
        The contents of ``residuals.json``: by group its ``cases``, and its ``analysis`` or the ``reason`` why there is
        none.
    """
    groups: dict[str, Any] = {}
    for name, roles in GROUPS.items():
        traces = [trace for trace in data.traces if data.traces.roles[trace.name] in roles]
        if not traces:
            continue
        groups[name] = {"cases": [trace.name for trace in traces], "analysis": None, "reason": ""}
        try:
            groups[name]["analysis"] = analyse_residuals(
                fit.model, traces, config.start, output=config.mapping.output
            ).to_dict()
        except TraceError as error:
            # A short trace or a model that diverges one step ahead is a finding; the run goes on.
            groups[name]["reason"] = str(error)
    return {"groups": groups}


def curves(fit: FitResult, data: Data, config: PipelineConfig) -> dict[str, Any] | None:
    """The static curves of a block-oriented model over the records that it was fitted to.

    Args:
        fit: The fit.
        data: The traces.
        config: The pipeline, as of one output.

    Returns:
        The contents of ``curves.json``; ``None`` for a model without curves.
    """
    if not has_curves(fit.model):
        return None
    runs = [Experiment.for_model(trace, fit.model, config.start) for trace in data.traces.with_role(Role.ESTIMATION)]
    found = curve_values(fit.model, [(run.inputs, run.history) for run in runs])
    return {"curves": [curve.drawn().to_dict() for curve in found]}


def linearity(fits: Sequence[FitReady], chosen: str | None) -> dict[str, Any] | None:
    """Judge whether a linear model is enough for the data of a run.

    Args:
        fits: The fits that are ready.
        chosen: Name of the fit that was chosen, or of the system that it is part of.

    Returns:
        The verdict as JSON values, of several outputs on each; ``None`` unless there are linear models and networks
        that may be compared.
    """
    usable: dict[str, list[FitReady]] = {}
    for ready in fits:
        if ready.fit.status.comparable:
            usable.setdefault(ready.output, []).append(ready)
    each = {output: _judged(some, chosen) for output, some in usable.items()}
    found = {output: one for output, one in each.items() if one is not None}
    return Linearity.of_outputs(found).to_dict() if found else None


def _judged(fits: Sequence[FitReady], chosen: str | None) -> Linearity | None:
    """The verdict on one output, where there are models of both kinds."""
    linear, networks = (
        {
            ready.config.name: ready.evaluation
            for ready in fits
            if estimator_of(ready.fit.model.structure).linear is asked
        }
        for asked in (True, False)
    )
    if not linear or not networks:
        return None
    selects = not any(math.isnan(ready.selection_mse) for ready in fits)

    def rank(ready: FitReady) -> tuple[bool, bool, float]:
        mse = ready.selection_mse if selects else ready.evaluation.mean_mse(Role.ESTIMATION)
        return chosen not in {ready.config.name, ready.system}, math.isnan(mse), mse

    return judge_linearity(linear, networks, ranked=[ready.config.name for ready in sorted(fits, key=rank)])
