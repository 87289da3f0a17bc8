"""Are records that are scored within what was fitted? A curve that was learnt is a guess where no record has been."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid.models import AbstractModel
from sysid.traces import Trace

MARGIN, SHARE = 0.05, 0.01
"""Part of an input's range by which it may go further; and of a record's samples, those that must to be told."""
LEVELS = 3
"""An input with no more values in the records that were fitted is known at these alone."""


def beyond(model: AbstractModel, fitted: Sequence[Trace], scored: Sequence[Trace]) -> tuple[str, ...]:
    """Inputs that are at values in a record that no record which was fitted has.

    Args:
        model: The model; only one that learns its curves from records is asked.
        fitted: The records that were fitted.
        scored: The others.

    Returns:
        One sentence for each such input, which names the records.
    """
    if not model.structure.learns_curves or not fitted:
        return ()
    told = []
    for name in model.mapping.inputs:
        known = np.unique(np.concatenate([trace[name][trace.usable_of([name])] for trace in fitted]))
        if not len(known):
            continue
        away, most = list[str](), 0.0
        for trace in scored:
            values = trace[name][trace.usable_of([name])]
            share = float(np.mean(_outside(values, known))) if len(values) else 0.0
            away += [trace.name] * (share > SHARE)
            most = max(most, share)
        if away:
            are = ", ".join(f"{value:.4g}" for value in known) if len(known) <= LEVELS else _span(known)
            told.append(
                f"In {', '.join(away[:4])}{' and others' if len(away) > 4 else ''} {name} is at values that no record "
                f"which was fitted has ({are}), in up to {100 * most:.0f} % of the samples: what the model does there "
                "is a guess, and so are its figures. Fit records that go as far."
            )
    return tuple(told)


def _span(known: np.ndarray) -> str:
    return f"{known[0]:.4g} to {known[-1]:.4g}"


def _outside(values: np.ndarray, known: np.ndarray) -> np.ndarray:
    margin = MARGIN * float(known[-1] - known[0])
    if len(known) <= LEVELS:
        return np.asarray(np.abs(values[:, np.newaxis] - known).min(axis=1) > margin)
    return np.asarray((values < known[0] - margin) | (values > known[-1] + margin))
