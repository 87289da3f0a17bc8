"""The figures of a bundle for which nobody brought any: its model over the cases, as it is run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sysid.export.manifest import CascadeMetrics, Metrics
from sysid.models import AbstractModel, Cascade, Start
from sysid.traces import TraceSet


def side_by_side(source: AbstractModel | Cascade) -> bool:
    """Whether models stand beside each other: none reads another, so that each is judged as it is alone."""
    inputs = set(source.inputs)
    own = {name: limit for model in source.models for name, limit in model.limits.items()}
    return dict(source.limits) == own and all(set(model.inputs) <= inputs for model in source.models)


def own_figures(
    source: AbstractModel | Cascade, traces: TraceSet, start: Start | None, outputs: Sequence[str] | None = None
) -> Metrics | CascadeMetrics | None:
    """Free run and one step ahead over every case; not timed, so that the same fit and traces give the same bytes.

    Args:
        source: The model, or several.
        traces: The cases.
        start: How the free runs begin; at rest by default, and always for models that read each other.
        outputs: Those that leave it; all by default.

    Returns:
        The figures; ``None`` where the cases have no output.
    """
    from sysid.validation import CascadeEvaluation, evaluate_cascade, evaluate_outputs

    measured = [channel.name for channel in traces.channels]
    judged = [name for name in outputs or source.outputs if name in measured]
    if not judged:
        return None
    with np.errstate(all="ignore"):  # a free run that leaves all numbers has figures that are none, which is told
        if isinstance(source, Cascade) and not (start is not None and side_by_side(source)):
            return evaluate_cascade(source, traces, outputs=judged, repeats=0)
        whole = [model for model in source.models if set(model.outputs) <= set(measured)]
        found = {
            output: one
            for model in whole
            for output, one in evaluate_outputs(model, traces, start or Start(), repeats=0).items()
            if output in judged
        }
    if len(found) == 1:
        return next(iter(found.values()))
    return CascadeEvaluation(outputs=found, activity={}) if found else None
