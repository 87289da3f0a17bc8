"""Scored records in which nothing happens: a share of what moves there is a share of noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid.models import Mapping
from sysid.traces import Trace

PART = 0.2
"""Part of an output's standard deviation in the records that were fitted, below which it counts as standing."""


def still(mapping: Mapping, fitted: Sequence[Trace], scored: Sequence[Trace]) -> tuple[str, ...]:
    """Scored records in which no input moves, and the output hardly does.

    Args:
        mapping: Which channels go in, which come out.
        fitted: The records that were fitted.
        scored: The others.

    Returns:
        One sentence for each output of which there are some, which names the records.
    """
    if not mapping.inputs or not fitted:
        return ()
    held = [t for t in scored if t.usable_samples.any() and all(np.ptp(_usable(t, u)) == 0.0 for u in mapping.inputs)]
    told = []
    for name in mapping.outputs:
        whole = float(np.std(np.concatenate([_usable(trace, name) for trace in fitted])))
        names = [trace.name for trace in held if np.std(_usable(trace, name)) < PART * whole]
        if names:
            told.append(
                f"In {', '.join(names[:4])}{' and others' if len(names) > 4 else ''} no input moves, and {name} hardly "
                "does: a fit in percent is there one of noise, whatever the model. Look at the error in its unit, and "
                "score records in which inputs move."
            )
    return tuple(told)


def _usable(trace: Trace, channel: str) -> np.ndarray:
    return trace[channel][trace.usable_of([channel])]
