"""Parameters that differ by case, exported: they go in as inputs, constant over a record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sysid.models import AbstractModel, Start, beginning
from sysid.models.grey_box.grey_box_model import EquationModel
from sysid.traces import Channel, Trace, TraceSet

if TYPE_CHECKING:
    from sysid.estimation.results.result import FitResult

DESCRIPTION = "a parameter by case, estimated; constant over a record, the range is that of the cases that were fitted"


def with_case_inputs(fit: FitResult, traces: TraceSet, start: Start) -> tuple[FitResult, TraceSet]:
    """A fit and its records as they are exported.

    Args:
        fit: The fit.
        traces: The records.
        start: How the free run over each begins.

    Returns:
        Both; where parameters differ by case, the model with these as inputs, and records with a channel for each: the
        values of their cases, or those that their first samples show.

    Raises:
        ConfigError: If a record is of a case that was not fitted, and its start shows no sample of it.
    """
    model = fit.model
    if not isinstance(model, EquationModel) or not model.cases:
        return fit, traces
    channels = tuple(
        Channel(name=one.name, unit=one.unit or "1", description=DESCRIPTION) for one in model.grey.by_case
    )
    each = tuple(_with_channels(trace, model, channels, start) for trace in traces)
    return replace(fit, model=model.with_case_inputs()), replace(traces, traces=each)


def _with_channels(trace: Trace, model: AbstractModel, channels: Sequence[Channel], start: Start) -> Trace:
    inputs, output = trace.columns(model.mapping.inputs), model.measured(trace)
    begun = beginning(model, inputs, output, start, trace.usable_of(model.mapping.channels), case=trace.name)
    constants = np.tile(begun.history.constants, (len(trace), 1))
    there = [i for i, one in enumerate(trace.channels) if one.name not in {more.name for more in channels}]
    return replace(
        trace,
        channels=(*(trace.channels[i] for i in there), *channels),
        values=np.hstack([trace.values[:, there], constants]),
    )
