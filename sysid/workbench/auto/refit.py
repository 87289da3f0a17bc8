"""The chosen structure once more: on all of the record once nothing is left to be chosen, or as long as it gains."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from sysid.estimation import FitResult, Status
from sysid.estimation.fitting import with_stability
from sysid.estimation.networks.starts.choosing import NEAR
from sysid.estimation.results.tolerance import outside, spans_of
from sysid.models import AbstractModel
from sysid.traces import Role, Trace
from sysid.validation import case_results
from sysid.workbench.fits import steps
from sysid.workbench.fits.config import FitConfig, PipelineConfig
from sysid.workbench.fits.data import Data
from sysid.workbench.runner.steps import Work

BETTER, KEPT = (
    "Fitted once more, to all of the record, after it was chosen on a part of it.",
    "The fit that was chosen is kept: its structure fitted once more, to all of the record, {}.",
)
GONE_ON, ENOUGH = (
    "Trained on, with all that is fitted, from where its trial had ended.",
    "The fit that was chosen is kept: trained on from where its trial had ended, it {}.",
)
"""What is said where the last fit is taken, and where it is not."""
NO_BETTER, STRANGE, LOST = "is no better", "stands alone on other commands", "is not stable"
"""Why it is not, the worse the later."""
STARTS_ALONE = "their free run stands alone on other commands"
"""Why starts of it are refused."""


def refitted(
    work: Work, fit: FitConfig, config: PipelineConfig, data: Data, *, chosen: FitResult,
    whole: Callable[[], FitResult], further: bool, tolerance: float | None = None,
    alone: Callable[[AbstractModel], bool] = lambda _: False,
) -> FitResult:  # fmt: skip
    """Fit the chosen structure once more: to all estimation traces, or on from where its trial had ended.

    Args:
        work: Told how it goes.
        fit: The structure and its training.
        config: The pipeline, as of the model's outputs.
        data: All traces.
        chosen: The fit that was chosen, which needs no posterior.
        whole: Gives it with all that a fit has, where it is kept.
        further: Whether it is trained on from where it is, and selection traces, where there are some, say whether that
            was for the better; else it is fitted anew, and all estimation traces do.
        tolerance: Share of each output's range: who stays within it over more of these traces is better, whatever the
            mean error; ``None`` where the error alone says so.
        alone: Whether a model stands alone on other commands. No start is chosen that does where another does not.

    Returns:
        The new fit, or the chosen one where that does better, or is stable and not alone where no start of the new one
        is.
    """
    watch = work.watch(getattr(fit.training_options(config.seed), "max_time_s", math.inf))
    asked = replace(config.stability.options(data.sequences), also=lambda one: not alone(one), unless=STARTS_ALONE)
    again = steps.fit_traces(fit, config, data, chosen if further else None, watch, stability=asked)
    judging = (data.selection if further else ()) or data.estimation
    taken, left = (GONE_ON, ENOUGH) if further else (BETTER, KEPT)
    ours, theirs = (_error(one, judging, config, tolerance) for one in (again, chosen))
    now, before = (_standing(one, alone) for one in (again, chosen))
    if now > before:  # a trial was checked over fewer sequences
        before = _standing(with_stability(chosen, data.estimation, asked), alone)
    led_back = now <= before and _strays(chosen) and not _strays(again) and ours[1] <= (1.0 + NEAR) ** 2 * theirs[1]
    nearer = ours <= theirs or not np.isfinite(theirs[1]) or led_back
    better = now <= before and again.status.comparable and nearer
    why = (NO_BETTER, STRANGE, LOST)[now if now > before else 0]
    found = again if better else with_stability(whole(), data.estimation, asked)
    # What was interrupted is made again by who goes on later, whichever of both is shown until then.
    status = again.status if again.status is Status.INTERRUPTED else found.status
    return replace(found, status=status, notes=(*found.notes, taken if better else left.format(why)))


def _standing(fit: FitResult, alone: Callable[[AbstractModel], bool]) -> int:
    """0, or 1 where a fit stands alone, or 2 where it is not stable: its error on the record says little then."""
    return 2 if fit.status is Status.UNSTABLE else int(alone(fit.model))


def _strays(fit: FitResult) -> bool:
    """Whether the free run leaves its bounds, or hangs on where it began."""
    return fit.status is Status.UNSTABLE or bool((fit.stability or {}).get("apart"))


def _error(
    fit: FitResult, traces: Sequence[Trace], config: PipelineConfig, tolerance: float | None
) -> tuple[int, float]:
    """Traces over which the free run leaves the tolerance, and its mean square, each output's over its own variance."""
    errors, shares = list[float](), list[list[float]]()
    outputs = config.mapping.outputs
    spans = dict(zip(outputs, spans_of(traces, outputs), strict=True))
    for trace in traces:
        cases = case_results(fit.model, trace, Role.ESTIMATION, config.start, 1)
        errors += [case.free_run.mse / (float(np.var(trace[output])) or 1.0) for output, case in cases.items()]
        shares.append([float(np.sqrt(case.free_run.mse) / spans[output]) for output, case in cases.items()])
    return outside(shares, tolerance), float(np.mean(errors))
