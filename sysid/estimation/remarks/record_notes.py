"""What the records of a fit leave open, and what the fit leaves out of them: told for every kind of structure."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.nonparametric.excitation_order import MOST, excitation_order
from sysid.estimation.nonparametric.segments import segments_of
from sysid.estimation.records.informative import informative, own_part, still
from sysid.estimation.remarks.bent_by_noise import bent_by_noise
from sysid.estimation.remarks.between_samples import between_samples
from sysid.estimation.remarks.closed_loop import feedback_told
from sysid.estimation.remarks.error_causes import causes
from sysid.estimation.remarks.error_lags import left_out
from sysid.estimation.remarks.fitted_run import FreeRun
from sysid.estimation.remarks.held_output import held_for, straight_for
from sysid.estimation.remarks.moved_at_first import moved_at_first
from sysid.estimation.remarks.record_drift import drifts_told
from sysid.estimation.remarks.record_levels import levels_told
from sysid.estimation.remarks.record_resolution import resolution_told
from sysid.estimation.remarks.wrapped import jumping, period_of
from sysid.estimation.remarks.wrapped import told as wrapped
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import AbstractModel, Mapping, Start
from sysid.traces import Trace

FAR, FEW = 20.0, 0.01
"""Ranges of all other samples from which a sample is told to be far off, and the most that are, of each side."""
LEAST_SAMPLES = 100
NOTHING = 1e-6
"""Part of its largest direction that the smallest of an input's movements has where it is rounding."""
MOST_TRACES = 20
HIDDEN = 0.1
"""Share of an output's samples whose loss to another one's gaps is told."""
OF_CURVES, LEVELS = 4, 3
"""Order that an input must excite for a curve, which one sine does not; and levels that are too few for one."""
HARDLY_OWN = 0.01
"""Part of an input's movement that others do not explain, below which its effect is told by hardly anything."""
DIVERGED = 1e12
"""Mean squared error, over the output's variance, of a run that is lost: a million times the output's movements."""
WORSE, HARDLY, POOR = 1.1, 0.9, 0.6
"""Mean squared error in free run, over the output's variance, above which a constant does better beyond doubt; above
which it does as well, all but a twentieth of the output's movement; and above which a run is poor."""
AT_FIRST = 0.1, 4.0
"""Error of a run, and times the one that was fitted, from which on it is told that it is one of its beginning."""
NO_INTERVALS = " The intervals of its parameters mean nothing: they take the model for true, and its error for noise."


def undetermined(traces: Sequence[Trace], mapping: Mapping) -> tuple[str, ...]:
    """What the records say nothing of: a channel that never changes, an input that is made of others.

    Args:
        traces: The records that are fitted; masked samples say nothing.
        mapping: Which channels go in, which come out.

    Returns:
        One sentence for each such channel, and for each of which a few samples are far from all others.
    """
    usable = [trace.usable_samples for trace in traces]
    if not any(seen.any() for seen in usable):
        return ()
    inputs = np.concatenate([t.columns(mapping.inputs)[seen] for t, seen in zip(traces, usable, strict=True)])
    outputs = np.concatenate([t.columns(mapping.outputs)[seen] for t, seen in zip(traces, usable, strict=True)])
    told = [
        f"{name} never changes in these records: they say nothing of a response to any input."
        for name, column in zip(mapping.outputs, outputs.T, strict=True)
        if still(column)
    ]
    kept = informative(inputs)
    for j, name in enumerate(mapping.inputs):
        if still(inputs[:, j]):
            told.append(f"{name} never changes in these records: they say nothing of its effect.")
        elif j not in kept:
            names = ", ".join(mapping.inputs[i] for i in kept if i < j)
            told.append(f"{name} is made of {names} in these records: they do not tell their effects apart.")
        elif (rest := own_part(inputs[:, j], inputs[:, [i for i in kept if i < j]])) < HARDLY_OWN:
            names = ", ".join(mapping.inputs[i] for i in kept if i < j)
            told.append(
                f"{name} is nearly made of {names} in these records: {100 * rest:.2g} % of its movement is its own, "
                "and by that alone their effects are told apart. Where they move apart the model is a guess: leave one "
                "of them out, or record them moving apart."
            )
    columns = zip((*mapping.inputs, *mapping.outputs), (*inputs.T, *outputs.T), strict=True)
    return (*told, *(told_ for name, column in columns for told_ in _far_off(name, column)), *wraps(traces, mapping))


def wraps(traces: Sequence[Trace], mapping: Mapping) -> list[str]:
    """Which channels wrap, as angles and counters do.

    Args:
        traces: The records.
        mapping: Which channels go in, which come out.

    Returns:
        One sentence for each.
    """
    found = list[str]()
    for one in mapping.each:
        segments = segments_of(traces, one)
        moved = [jumping(segment.inputs) for segment in segments]
        for name, parts, beside in (
            *((name, [s.inputs[:, j] for s in segments], ()) for j, name in enumerate(one.inputs)),
            (one.output, [s.output for s in segments], moved),
        ):
            period = period_of(parts, beside)
            found += [] if period is None else [wrapped(name, *period)]
    return list(dict.fromkeys(found))


def _far_off(name: str, column: NDArray[np.float64]) -> list[str]:
    """A few samples so far from all others that squared errors see nothing else: a fault of the recording."""
    if len(column) < LEAST_SAMPLES:
        return []
    low, high = np.quantile(column, [FEW, 1.0 - FEW], method="nearest")
    away = np.maximum(low - column, column - high)
    far = away > FAR * (high - low)
    if not far.any() or high == low:
        return []
    return [
        f"{int(far.sum())} of {len(column)} samples of {name} lie up to {float(away.max() / (high - low)):.3g} times "
        "the range of all others away from them, and squared errors see nothing else. If they are faults of the "
        f"recording, mask them (repairs: {{mask: [{{channel: {name}, start: ..., stop: ...}}]}})."
    ]


def outnumbered(model: AbstractModel, traces: Sequence[Trace]) -> tuple[str, ...]:
    """Whether a model has more parameters than the records have numbers to tell of them.

    Args:
        model: The fitted model.
        traces: The records that were fitted.

    Returns:
        None, or a sentence.
    """
    samples = sum(int(trace.usable_samples.sum()) for trace in traces)
    if model.n_together < samples * len(model.mapping.outputs):
        return ()
    return (
        f"The model has {model.n_together} parameters and the records have {samples} samples: most of them are not "
        "told by the records, and a close fit says nothing. Record longer, or take a smaller model.",
    )


def hidden(traces: Sequence[Trace], mapping: Mapping) -> tuple[str, ...]:
    """Which outputs lose samples, as others of the same model lack them there.

    Args:
        traces: The records that are fitted, with the masks that they have.
        mapping: Which channels go in, which come out.

    Returns:
        One sentence for each output of which a tenth or more is lost.
    """
    together = sum(int(trace.usable_of(mapping.channels).sum()) for trace in traces)
    told = []
    for name in mapping.outputs:
        alone = sum(int(trace.usable_of((*mapping.inputs, name)).sum()) for trace in traces)
        if alone and together <= (1.0 - HIDDEN) * alone:
            told.append(
                f"{name} loses {100 * (1 - together / alone):.0f} % of its samples ({alone - together} of {alone}): "
                "other outputs of the same model are missing there, and it fits samples that all of them have. Fit "
                f"each output by itself ({'+'.join(mapping.inputs)} -> {name}), or a structure that counts them apart: "
                "a neural state space, equations."
            )
    return tuple(told)


def underexcited(model: AbstractModel, traces: Sequence[Trace]) -> tuple[str, ...]:
    """Whether an input moves in too few ways to tell all coefficients of its effect.

    Args:
        model: The fitted model: of a linear one the coefficients of each input count, of one that learns its
            curves from the records, more than one sine has.
        traces: The records that were fitted.

    Returns:
        One sentence for each such input.
    """
    asked: dict[int, int] = {}
    for (_, j), ratio in model.ratios.items():
        # Of an equation with past outputs the noise excites the denominator.
        of_input = len(ratio.B) if ratio.past_outputs else len(ratio.B) + len(ratio.F) - 1
        asked[j] = max(asked.get(j, 0), of_input if ratio.asks is None else ratio.asks)
    if not model.ratios and model.structure.learns_curves:
        asked = dict.fromkeys(range(len(model.mapping.inputs)), OF_CURVES)
    told = []
    for j, needed in asked.items():
        # Masked samples too: what the inputs did there is known, and moves the samples that count.
        parts = [trace[model.mapping.inputs[j]] for trace in traces]
        if not 0 < needed <= MOST or sum(map(len, parts)) < LEAST_SAMPLES or still(np.concatenate(parts)):
            continue
        order, _ = excitation_order(parts, needed, seen=NOTHING)
        if order < needed:
            told.append(
                f"{model.mapping.inputs[j]} moves in too few ways: it excites order {order}, and the model asks "
                f"for {needed} to tell its effect. The records tell what it does at these frequencies alone; at "
                "all others the model is free. Excite it with more (sysid.excite), or fit fewer coefficients."
            )
    return tuple(told)


def held(model: AbstractModel, traces: Sequence[Trace]) -> tuple[str, ...]:
    """Which outputs are measured more slowly than they are recorded, and records that were interpolated.

    Args:
        model: The fitted model.
        traces: The records that were fitted.

    Returns:
        One sentence for each such output.
    """
    each = {mapping.output: segments_of(traces, mapping) for mapping in model.mapping.each}
    found = {name: held_for(segments) for name, segments in each.items()}
    straight = max(map(straight_for, each.values()), default=1) if max(found.values(), default=1) == 1 else 1
    drawn = (
        f"All channels go in straight lines of {straight} samples ({straight * traces[0].sample_time:.3g} s): they "
        "were interpolated. The samples between were never measured, and intervals are too narrow: take every "
        f"{straight}th sample.",
    ) * (straight > 1)
    return drawn + tuple(
        f"{name} changes only after {samples} samples ({samples * traces[0].sample_time:.3g} s): it is measured more "
        "slowly than it is recorded, and the model takes the hold for the plant's own lag, in intervals that are too "
        f"narrow. Count new values alone, by repairs: {{repeats: {{{name}: mask}}}}, and fit a structure that needs no "
        "measured past: a transfer function, a neural state space."
        for name, samples in found.items()
        if samples > 1
    )


def between_levels(model: AbstractModel, traces: Sequence[Trace]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Which inputs take so few values that what a model makes of all others is not learnt.

    Args:
        model: The fitted model; only one that learns curves from records has something to learn of levels.
        traces: The records that were fitted.

    Returns:
        One sentence for each such input: first of switches, which are 0 or 1 and never at others, then of the others,
        which may well be.
    """
    if not model.structure.learns_curves:
        return (), ()
    switches, others = list[str](), list[str]()
    for name in model.mapping.inputs:
        levels = np.unique(np.concatenate([trace[name][trace.usable_of([name])] for trace in traces]))
        if 1 < len(levels) <= LEVELS:
            at = ", ".join(f"{value:.6g}" for value in levels)
            told = f"{name} is only ever {at} in these records: what the model makes of other values is a guess."
            (switches if {*levels.tolist()} == {0.0, 1.0} else others).append(told)
    return tuple(switches), tuple(others)


def contradicted(
    model: AbstractModel,
    traces: Sequence[Trace],
    start: Start,
    training: object = None,
    *,
    uncertainty: Uncertainty | None = None,
    trained: float | None = None,
) -> tuple[str, ...]:
    """What the free run says against a model, over the very records that it was fitted to.

    Args:
        model: The fitted model.
        traces: The records; the first so many are looked at.
        start: What stands before each.
        training: How it was fitted.
        uncertainty: Of its parameters, where the fit knows one.
        trained: Mean squared error of the free run that was fitted, whose first states were fitted with it; ``None``
            where something else was.

    Returns:
        One sentence for each output whose free run a constant beats or equals, for each that acts on the inputs, and
        for each input that acts at a lag which the model leaves out, or at once without being asked; or that nothing
        moves where the run is scored.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # a run that is lost, and its squares, are beyond any number
        runs = [FreeRun.of(model, trace, start) for trace in traces[:MOST_TRACES]]
        told = moved_at_first(model.mapping, traces[:MOST_TRACES], runs) or _lost_at_first(model, runs, trained)
        return told or _against(model, traces, runs, start, training=training, uncertainty=uncertainty)


def _lost_at_first(model: AbstractModel, runs: Sequence[FreeRun], trained: float | None) -> tuple[str, ...]:
    """That a run is poor for its first state alone: what is left of it then says nothing of orders, inputs and lags."""
    ratios = _beside_constants(runs)
    if trained is None or len(model.mapping.outputs) > 1 or not ratios or _lost(ratios[0]):
        return ()
    (name,), spread = model.mapping.outputs, np.var(np.concatenate([run.output[run.usable, 0] for run in runs]))
    fitted = trained / float(spread)
    if not AT_FIRST[0] < ratios[0] > AT_FIRST[1] * fitted:
        return ()
    fits = [f"{100.0 * (1.0 - np.sqrt(ratio)):.0f} %" for ratio in (ratios[0], fitted)]
    return (
        f"Over the records that were fitted the free run of {name} has a fit of {fits[0]} for how it begins: with the "
        f"first states that were fitted beside the parameters it is {fits[1]}. The model does not forget them, and the "
        "first samples do not tell them. Record from rest, fit fewer poles, or write start: {estimated: ...} with more "
        "samples. The level of its free run is not to be trusted.",
    )


def _against(
    model: AbstractModel,
    traces: Sequence[Trace],
    runs: Sequence[FreeRun],
    start: Start,
    *,
    training: object,
    uncertainty: Uncertainty | None,
) -> tuple[str, ...]:
    longest = max(runs, key=lambda run: len(run.output))
    fed = feedback_told(model, traces, longest, training)
    levels = levels_told(model, traces[:MOST_TRACES], runs)
    drifts = drifts_told(model, traces[:MOST_TRACES], runs)
    steps = resolution_told(model, runs)
    # Beside a drift, and steps of a converter, what moves together says little of lags.
    known = {**steps, **drifts}
    sooner = {} if known else between_samples(model, longest, fed)
    lags = [] if known else [*sooner.values(), *left_out(model, longest, fed, but=sooner)]
    ratios = _beside_constants(runs)
    bent = None if fed or known or levels else bent_by_noise(model, traces[:MOST_TRACES], runs, start)
    judged = longest if bent is None else max(bent.runs, key=lambda run: len(run.output))
    # A lag that is left out is a cause, and the nearer one; not of a run that has next to nothing of the output.
    worth = not lags or min(ratios.values(), default=0.0) > POOR
    told = {*known, *(i for i, ratio in ratios.items() if _lost(ratio))}
    rest = (*lags, *(causes(bent.model if bent else model, judged, (*fed, *levels), but=told) if worth else ()))
    poor = _told_beside_constants(model, ratios, uncertainty)
    return (*poor, *fed.values(), *levels.values(), *known.values(), *([bent.told] if bent else []), *rest)


def _beside_constants(runs: Sequence[FreeRun]) -> dict[int, float]:
    """Mean squared error of free runs, over the output's variance, by the place of each output that moves."""
    y = np.concatenate([run.output[run.usable] for run in runs])
    simulated = np.concatenate([run.simulated[run.usable] for run in runs])
    if len(y) < LEAST_SAMPLES:
        return {}
    return {
        i: float(np.mean((simulated[:, i] - y[:, i]) ** 2) / np.var(y[:, i]))
        for i in range(y.shape[1])
        if not still(y[:, i])
    }


def _lost(ratio: float) -> bool:
    return not ratio < DIVERGED


def _told_beside_constants(
    model: AbstractModel, ratios: Dict[int, float], uncertainty: Uncertainty | None
) -> list[str]:
    told = []
    bounded = uncertainty is not None and bool(np.isfinite(uncertainty.standard_deviations).any())
    for i, ratio in ratios.items():
        name = model.mapping.outputs[i]
        if not ratio <= HARDLY:
            fit = "it diverges" if _lost(ratio) else f"fit {100.0 * (1.0 - np.sqrt(ratio)):.0f} %"
            worse = not ratio <= WORSE
            how = "worse" if worse else "hardly better"
            told.append(
                f"Over the records that were fitted the free run of {name} is {how} "
                f"than a constant ({fit}). Try other orders, more starts, a fit of the free run (loop: closed, noise: "
                f"false, OE) or more iterations; or the inputs say little of {name}."
                + NO_INTERVALS
                * (worse and bounded)
            )
    return told
