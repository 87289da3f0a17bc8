"""Does a record begin where its start says that it does? A fit that takes it for granted is told by how much not."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np

from sysid.errors import TraceError
from sysid.estimation.linear.arx import fit_arx
from sysid.estimation.records.informative import informative
from sysid.models import ARX, AbstractModel, ARXModel, Start, StartKind, beginning
from sysid.traces import Trace
from sysid.units import in_unit

ESTIMATED = Start(kind=StartKind.ESTIMATED)
BEYOND, LEAST = 5.0, 1e-3
"""How many times the later errors, and what part of the output's range, the first ones must be to be told."""
MOST_TOLD = 5

LAGS = 10
"""Past inputs of the ARX model that is asked."""


def equilibrium_notes(model: AbstractModel, traces: Sequence[Trace], start: Start) -> tuple[str, ...]:
    """What is to be said of records that do not begin as they were declared to.

    The free run from the declared start is compared with the record over the window that a start would be estimated on,
    and that with the errors of the free run from the estimated one, after it. A model that was fitted to what the start
    said may have bent to it: a small ARX model that takes nothing for granted is asked as well, unless the model
    says itself where its records begin.

    Args:
        model: A model fitted to the records.
        traces: The records.
        start: What was declared.

    Returns:
        One sentence for each record that is off, none for an estimated or a measured start.
    """
    if start.kind not in {StartKind.REST, StartKind.FIRST_SAMPLE}:
        return ()
    asked = [model] if model.structure.learns_start else [model, *_plain_models(traces, model)]
    told = []
    for trace in traces:
        found = [sentence for one in asked for sentence in _of(one, trace, start)]
        told += found[:1]
    return _few(told)


def begun_otherwise(models: Sequence[AbstractModel], traces: Sequence[Trace], start: Start) -> tuple[str, ...]:
    """The same of records that several models are run over: each record is told once, by the first model that shows it.

    Args:
        models: Models whose free runs are compared.
        traces: The records.
        start: What was declared.

    Returns:
        One sentence for each record that is off.
    """
    told = (next((one for model in models for one in equilibrium_notes(model, [trace], start)), "") for trace in traces)
    return _few([one for one in told if one])


def _few(told: list[str]) -> tuple[str, ...]:
    rest = len(told) - MOST_TOLD
    return (*told[:MOST_TOLD], *([f"{rest} more records do not begin so."] if rest > 0 else []))


def _plain_models(traces: Sequence[Trace], model: AbstractModel) -> list[AbstractModel]:
    """An ARX model of the records, where they are long enough for one and none of its poles is slower than they are.

    Such a one may be an integrator, which rests anywhere: its equilibrium is where no plant ever was. Nor is one asked
    of records that begin with their step: its rows begin behind it, and its gain is anything.
    """
    edge = 1.0 - 1.0 / max(len(trace) for trace in traces)
    m = len(model.mapping.inputs)
    lags = max(1, min(LAGS, min(len(trace) for trace in traces) // (4 * (1 + m))))
    orders = ARX(na=min(2, lags), nb=(lags,) * m, nk=(0,) * m)
    models: list[AbstractModel] = []
    if len(informative(np.concatenate([trace.columns(model.mapping.inputs)[lags:] for trace in traces]))) < m:
        return models
    for mapping in model.mapping.each:
        try:
            found = fit_arx(traces, mapping, orders, start=ESTIMATED).model
        except TraceError:
            continue
        if np.abs(cast("ARXModel", found).poles).max(initial=0.0) < edge:
            models.append(found)
    return models


def _of(model: AbstractModel, trace: Trace, start: Start) -> list[str]:
    inputs, output = trace.columns(model.mapping.inputs), model.measured(trace)
    usable = trace.usable_of(model.mapping.channels)
    begun = beginning(model, inputs, output, ESTIMATED, usable, case=trace.name)
    n = begun.first
    if n == 0:
        return []
    stood = model.recursion.cased(start.history(inputs, output, model.resting, usable), trace.name)
    declared = model.simulate(inputs[:n], stood)
    after = model.simulate(inputs[n:], begun.history) - output[n:]
    off = np.abs(declared - output[:n])[usable[:n]].reshape(-1, len(model.mapping.outputs))
    later = after[usable[n:]].reshape(-1, len(model.mapping.outputs))
    if not len(off) or not len(later) or not np.isfinite(off).all() or not np.isfinite(later).all():
        return []
    found, said = [], f"start: {start.kind.value}"
    so = f"where the model does with {said}" if model.structure.learns_start else f"in equilibrium, as {said} declares"
    ranges = np.ptp(output[usable].reshape(len(output[usable]), -1), axis=0)
    for j, unit in enumerate(model.ends.output_units):
        level, most = float(np.sqrt(np.mean(later[:, j] ** 2))), float(off[:, j].max())
        if most > max(BEYOND * level, LEAST * float(ranges[j])):
            found.append(
                f"{trace.name} does not begin {so}: over its first {n} samples the free run is up to "
                f"{in_unit(f'{most:.3g}', unit)} off, and afterwards, from an estimated state, "
                f"{in_unit(f'{level:.3g}', unit)}. For such a record write start: estimated."
            )
    return found
