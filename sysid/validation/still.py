"""Scored records in which nothing, or little, happens: a share of what moves there is a share of little."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid.models import Mapping
from sysid.traces import Trace

PART = 0.2
"""Part of an output's standard deviation in the records that were fitted, below which it counts as standing."""


def still(mapping: Mapping, fitted: Sequence[Trace], scored: Sequence[Trace]) -> tuple[str, ...]:
    """Scored records in which the output hardly moves.

    Args:
        mapping: Which channels go in, which come out.
        fitted: The records that were fitted.
        scored: The others.

    Returns:
        One sentence for each output of which there are some, which names the records.
    """
    if not mapping.inputs or not fitted:
        return ()
    some = [trace for trace in scored if trace.usable_samples.any()]
    held = {trace.name for trace in some if all(np.ptp(_usable(trace, u)) == 0.0 for u in mapping.inputs)}
    told = []
    for name in mapping.outputs:
        whole = float(np.std(np.concatenate([_usable(trace, name) for trace in fitted])))
        quiet = [trace for trace in some if np.std(_usable(trace, name)) < PART * whole]
        names = _named([trace for trace in quiet if trace.name in held])
        if names:
            told.append(
                f"In {names} no input moves, and {name} hardly does: a fit in percent is there one of noise, whatever "
                "the model. Look at the error in its unit, and score records in which inputs move."
            )
        moved = [trace for trace in quiet if trace.name not in held]
        if moved:
            most = 100.0 * max(float(np.std(_usable(trace, name))) for trace in moved) / whole
            told.append(
                f"In {_named(moved)} {name} moves by no more than {most:.2g} % of what it does in the records that "
                "were fitted: a fit in percent is there one of little, and an error that is small elsewhere is worse "
                "than a constant. Look at the error in its unit."
            )
    return tuple(told)


def _named(traces: Sequence[Trace]) -> str:
    return ", ".join(trace.name for trace in traces[:4]) + (" and others" if len(traces) > 4 else "")


def _usable(trace: Trace, channel: str) -> np.ndarray:
    return trace[channel][trace.usable_of([channel])]
