"""Records in closed loop: what a fit makes of noise that goes through a controller into the inputs.

A direct estimate, by the error one step ahead, is as good as in open loop if the model of the noise is right and inputs
act a sample late (Ljung 1999, "System identification", section 13.4). The error of a free run moves with inputs that a
controller set: a fit of it is biased.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid.estimation.nonparametric.feedback import feedback_of
from sysid.estimation.records.informative import informative
from sysid.estimation.remarks.error_lags import at_lag, has_path
from sysid.estimation.remarks.fitted_run import FreeRun
from sysid.estimation.results.result import Loop
from sysid.models import AbstractModel, Mapping
from sysid.traces import Trace

LEAST_SAMPLES = 100
WORTH = 0.1
"""Part of the output's standard deviation that an error must have for its way through a controller to matter."""
UNBIASED = "SSARX"
"""The weighting of a subspace method that takes the noise out of the inputs first."""


def feedback_told(
    model: AbstractModel, traces: Sequence[Trace], run: FreeRun, training: object = None
) -> dict[int, str]:
    """Which outputs act on the inputs, and what that means for this fit.

    Args:
        model: The fitted model.
        traces: The records that were fitted.
        run: Its free run over one of them.
        training: How it was fitted.

    Returns:
        A sentence for each such output, by its place.
    """
    kept, told = informative(run.inputs[run.usable]), dict[int, str]()
    if not kept or run.usable.sum() < LEAST_SAMPLES:
        return told
    names = tuple(model.mapping.inputs[j] for j in kept)
    for i, output in enumerate(model.mapping.outputs):
        error, measured = (run.output - run.simulated)[run.usable, i], run.output[run.usable, i]
        early = [model.mapping.inputs[j] for j in kept if has_path(model, run, j, i)]
        # Of a free run that is as good as the record itself nothing is left that could go through a controller.
        if not early and float(np.std(error)) <= WORTH * float(np.std(measured)):
            continue
        found = feedback_of(traces, Mapping(inputs=names, output=output))
        if not isinstance(found, str) and found.found:
            told[i] = _said(model, output, names, early if found.at_once else [], _by_prediction(model, training))
    return told


def _by_prediction(model: AbstractModel, training: object) -> bool:
    """Whether it was the error one step ahead that was fitted, with a model of the noise in it."""
    if not model.recursion.predicts or getattr(training, "loop", Loop.OPEN) is Loop.CLOSED:
        return False
    return getattr(training, "method", "") != "subspace" or getattr(training, "weighting", "") == UNBIASED


def _said(model: AbstractModel, output: str, names: Sequence[str], early: Sequence[str], direct: bool) -> str:
    acts = f"{output} acts on {' and '.join(names)} in these records"
    begun = f"{acts}: they are of a closed loop (or the inputs are recorded late, or move between samples)"
    if early:
        late = "feedthrough: false" if getattr(model.structure, "feedthrough", False) else at_lag(model, 1)
        return (
            f"{begun}, within the sample, and the model takes {' and '.join(early)} to act at once. What it has learnt "
            f"there is the controller read backwards: let inputs act from lag 1 on{f' ({late})' if late else ''}."
        )
    if direct:
        return (
            f"{begun}, and the fit is right only as far as its model of the noise is. Its residuals one step ahead "
            "should be white; if not, allow the noise more orders (ARX lags, BJ, states)."
        )
    return (
        f"{begun}, and this fit takes the noise for white: where it is not, the fit is biased by what goes through the "
        "controller. Fit one step ahead with a model of the noise (ARX with enough lags, ARMAX, BJ, SS with noise: "
        "true, a network with loop: open), with inputs from lag 1 on; or record with a set point that moves more."
    )
