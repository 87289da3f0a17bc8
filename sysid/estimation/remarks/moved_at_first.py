"""Inputs that move while the first state is estimated and no more: their effect and that state are told as one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid.estimation.remarks.fitted_run import FreeRun
from sysid.models import Mapping
from sysid.models.contract.beginning import LEAST_BEFORE, MOVES
from sysid.traces import Trace


def moved_at_first(mapping: Mapping, traces: Sequence[Trace], runs: Sequence[FreeRun]) -> tuple[str, ...]:
    """That no input moves in what is scored of the records, and some do before it.

    A step that comes a few samples after a record began is such a one. What the output does then may as well be that it
    did not begin at rest, so that gain and dead time are told by next to nothing; and what is scored is noise.

    Args:
        mapping: Which channels go in.
        traces: The records that were fitted.
        runs: Free runs over them.

    Returns:
        One sentence, or none.
    """
    names, longest = dict[str, None](), 0
    for trace, run in zip(traces, runs, strict=True):
        inputs, usable = trace.columns(mapping.inputs), trace.usable_of(mapping.inputs)
        far = np.ptp(inputs[usable], axis=0) if usable.any() else np.zeros(inputs.shape[1])
        last = max(run.first - 1, 0)  # of what stood before the run: a step may come with its first sample
        scored = inputs[last:][usable[last:]]
        if not len(scored) or (np.ptp(scored, axis=0) > MOVES * far).any():
            return ()
        names |= dict.fromkeys(name for name, moves in zip(mapping.inputs, far, strict=True) if moves > 0.0)
        longest = max(longest, run.first)
    if not names:
        return ()
    return (
        f"{' and '.join(names)} moves within the first {longest} samples of a record alone, which give its first state "
        "and are not scored: an effect of it and a beginning out of rest look alike there, so that gain and dead time "
        "are hardly told, and a fit in percent of the rest is one of noise. Record "
        f"{LEAST_BEFORE} samples or more before it moves; or, where the record begins at rest, write start: "
        "first-sample (start: rest, where it stood at its rest value).",
    )
