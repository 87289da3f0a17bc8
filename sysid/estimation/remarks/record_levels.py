"""Records whose output stands at levels that their inputs do not explain: no model with one level follows them all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid.errors import UserError
from sysid.estimation.nonparametric.remembered import remembered_response
from sysid.estimation.remarks.fitted_run import FreeRun
from sysid.models import AbstractModel
from sysid.traces import Trace

WORTH = 0.1
"""Part of the output's standard deviation that the error must have to be worth a cause."""
EXPLAINED, LAGS = 0.9, 64
"""Part of the output that its inputs must explain about the levels, and samples within which they have to do so."""
ERROR, NOISE = 0.5, 3.0
"""How far levels must be apart: part of the error, and times what is left beside them (in standard deviations)."""


def levels_told(model: AbstractModel, traces: Sequence[Trace], runs: Sequence[FreeRun]) -> dict[int, str]:
    """Which outputs stand at other levels from record to record.

    The response to the inputs is estimated with a level for each record, and the levels are held beside the error.

    Args:
        model: The fitted model.
        traces: The records that were fitted.
        runs: Its free runs over them.

    Returns:
        A sentence for each such output, by its place.
    """
    told = dict[int, str]()
    if len(traces) < 2 or not model.mapping.inputs:
        return told
    for i, mapping in enumerate(model.mapping.each):
        # Within a record: beside levels that are far apart, what goes on at each is nothing.
        pairs = [(run.output[run.usable, i], run.simulated[run.usable, i]) for run in runs if run.usable.any()]
        spread = float(np.sqrt(np.mean([np.var(y) for y, _ in pairs]))) if pairs else 0.0
        error = float(np.sqrt(np.mean([np.mean((y - s) ** 2) for y, s in pairs]))) if pairs else 0.0
        if not error > WORTH * spread:
            continue
        try:
            response = remembered_response(traces, mapping, longest=LAGS)
        except UserError:
            continue
        if response.explained < EXPLAINED or not response.settled:
            continue
        parts = []
        for trace in traces:
            left = trace[mapping.output] - response.simulate(trace.columns(mapping.inputs))
            seen = trace.usable_samples & (np.arange(len(trace)) >= response.lags[-1])
            parts += [left[seen]] if seen.any() else []
        levels = np.array([part.mean() for part in parts])
        noise = np.sqrt(np.mean([part.var() for part in parts])) if parts else np.inf
        if len(levels) > 1 and np.std(levels) > max(ERROR * min(error, spread), NOISE * noise):
            told[i] = (
                f"{mapping.output} stands at other levels from record to record (from {levels.min():.4g} to "
                f"{levels.max():.4g} beside what {' and '.join(mapping.inputs)} explains), and a model with one level "
                "cannot follow them all. Take its own level off each record, give what moves it as an input, or fit "
                "what has a level of its own in each: ARMAX with integrated: true, one state more (SS)."
            )
    return told
