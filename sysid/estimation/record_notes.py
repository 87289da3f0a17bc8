"""What the records of a fit leave open, and what the fit leaves out of them: told for every kind of structure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from sysid.models import AbstractModel, History, Mapping, Start, beginning
from sysid.traces import Trace

STILL = 8.0 * np.finfo(np.float64).eps
"""How far a channel moves, relative to its size, below which it never changes."""
SAME = 1e-9
"""Part of an input that others do not explain, below which it is made of them."""

FAR, FEW = 20.0, 0.01
"""Ranges of all other samples from which a sample is told to be far off, and the most that are, of each side."""
LAGS = 5
"""Past errors and inputs that are taken out of the error, before the input of the same sample is looked at."""
LEAST_SAMPLES = 100
MOST_SAMPLES = 20_000
"""Samples of a record that are looked at: more would not make the finding any surer."""
LEAST_ERROR = 1e-2
"""Part of the output's standard deviation that the error must have to be worth an explanation."""
MOST_TRACES = 20
WORSE, HARDLY = 1.1, 0.9
"""Mean squared error in free run, over the output's variance, above which a constant does better beyond doubt; and
above which it does as well, all but a twentieth of the output's movement."""
SHARE, SURE = 0.2, 1e-6
"""Part of the error that an input of the same sample must explain, and how improbable that is by chance."""
NEARLY_ALL = 0.9
"""Part of what is new in an output that an input of the same sample explains, from which one may be the other."""


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
        if _still(column)
    ]
    kept = informative(inputs)
    for j, name in enumerate(mapping.inputs):
        if _still(inputs[:, j]):
            told.append(f"{name} never changes in these records: they say nothing of its effect.")
        elif j not in kept:
            names = ", ".join(mapping.inputs[i] for i in kept if i < j)
            told.append(f"{name} is made of {names} in these records: they do not tell their effects apart.")
    columns = zip((*mapping.inputs, *mapping.outputs), (*inputs.T, *outputs.T), strict=True)
    return (*told, *(told_ for name, column in columns for told_ in _far_off(name, column)))


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
        "recording, leave their cells empty and mask them (repairs: {nan: mask})."
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
    if model.n_parameters < samples * len(model.mapping.outputs):
        return ()
    return (
        f"The model has {model.n_parameters} parameters and the records have {samples} samples: most of them are not "
        "told by the records, and a close fit says nothing. Record longer, or take a smaller model.",
    )


def informative(inputs: NDArray[np.float64]) -> tuple[int, ...]:
    """The inputs whose effects records tell: those that move, and are not made of ones before them.

    Args:
        inputs: All that count, shape ``(n_samples, n_inputs)``.

    Returns:
        Their places, in order.
    """
    kept: list[int] = []
    for j, column in enumerate(inputs.T):
        if not _still(column) and not (kept and _made_of(column, inputs[:, kept])):
            kept.append(j)
    return tuple(kept)


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeRun:
    """The free run over a record that was fitted, from where it is scored on.

    Args:
        inputs: Shape ``(n_samples, n_inputs)``.
        output: As measured, shape ``(n_samples, n_outputs)``.
        simulated: Likewise.
        usable: Which samples are not masked, shape ``(n_samples,)``.
        history: What the run began with.
    """

    inputs: NDArray[np.float64]
    output: NDArray[np.float64]
    simulated: NDArray[np.float64]
    usable: NDArray[np.bool_]
    history: History

    @classmethod
    def of(cls, model: AbstractModel, trace: Trace, start: Start) -> FreeRun:
        """The run over a record, or over its beginning where that is long.

        Args:
            model: The fitted model.
            trace: The record.
            start: What stands before it.

        Returns:
            The run.
        """
        inputs, output, usable = trace.columns(model.mapping.inputs), model.measured(trace), trace.usable_samples
        begun = beginning(model, inputs, output, start, usable, case=trace.name)
        window = slice(begun.first, begun.first + MOST_SAMPLES)
        shape = (-1, len(model.mapping.outputs))
        return cls(
            inputs=inputs[window],
            output=output[window].reshape(shape),
            simulated=model.simulate(inputs[window], begun.history).reshape(shape),
            usable=usable[window],
            history=begun.history,
        )


def contradicted(model: AbstractModel, traces: Sequence[Trace], start: Start) -> tuple[str, ...]:
    """What the free run says against a model, over the very records that it was fitted to.

    Args:
        model: The fitted model.
        traces: The records; the first so many are looked at.
        start: What stands before each.

    Returns:
        One sentence for each output whose free run a constant beats or equals, and for each input that acts at once
        where the model lets it act only later, or lets it without being asked.
    """
    runs = [FreeRun.of(model, trace, start) for trace in traces[:MOST_TRACES]]
    longest = max(runs, key=lambda run: len(run.output))
    return (*_beside_a_constant(model, runs), *_acts_at_once(model, longest))


def _beside_a_constant(model: AbstractModel, runs: Sequence[FreeRun]) -> list[str]:
    y = np.concatenate([run.output[run.usable] for run in runs])
    simulated = np.concatenate([run.simulated[run.usable] for run in runs])
    told = []
    for i, name in enumerate(model.mapping.outputs):
        if len(y) < LEAST_SAMPLES or _still(y[:, i]):
            continue
        with np.errstate(over="ignore", invalid="ignore"):
            ratio = float(np.mean((simulated[:, i] - y[:, i]) ** 2) / np.var(y[:, i]))
        if not ratio <= HARDLY:
            fit = f"fit {100.0 * (1.0 - np.sqrt(ratio)):.0f} %" if np.isfinite(ratio) else "it diverges"
            how = "hardly better" if ratio <= WORSE else "worse"
            told.append(
                f"Over the records that were fitted the free run of {name} is {how} "
                f"than a constant ({fit}). Try other orders, more starts, a fit of the free run (loop: closed, noise: "
                f"false, OE) or more iterations; or the inputs say little of {name}."
            )
    return told


def _acts_at_once(model: AbstractModel, run: FreeRun) -> list[str]:
    """Inputs that act within their sample where the model lets them act only later.

    The error of the free run is explained by its own past and past inputs, and then by the inputs of the same sample as
    well: an F test says whether they explain more than chance would.
    """
    error, usable = run.output - run.simulated, run.usable
    few = usable.sum() < LEAST_SAMPLES + LAGS * (1 + run.inputs.shape[1])
    if few or not np.isfinite(error).all():
        return []
    told = []
    for j in informative(run.inputs[usable]):
        name = model.mapping.inputs[j]
        for i, target in enumerate(model.mapping.outputs):
            if _has_path(model, run, j, i):
                told += _read_backwards(model, run, j, i)
                continue
            if np.std(error[usable, i]) <= LEAST_ERROR * np.std(run.output[usable, i]):
                continue
            share = _share(error[:, i], run.inputs, j, usable)
            if share > 0.0:
                told.append(
                    f"{100 * share:.0f} % of what is new in the error of {target} moves with {name} of the same sample."
                    f" Either {name} acts at once, which this model leaves out (give it the lag 0: nk: 0, delays: 0, "
                    f"input_delays from 0, feedthrough: true), or it is fed back from {target}."
                )
    return told


def _read_backwards(model: AbstractModel, run: FreeRun, j: int, i: int) -> list[str]:
    """Whether a model that lets inputs act at once, unasked, may have learnt the controller and not the plant."""
    share = _share(run.output[:, i], run.inputs, j, run.usable) if model.structure.acts_at_once else 0.0
    if share < NEARLY_ALL:
        return []
    name, target = model.mapping.inputs[j], model.mapping.outputs[i]
    return [
        f"{100 * share:.0f} % of what is new in {target} moves with {name} of the same sample, and the model takes "
        f"{name} to act at once. Where {name} is set by a controller that reads {target}, that is the controller read "
        "backwards and no plant: fit a structure whose inputs act from lag 1 on (NARX input_delays: 1, ARX nk: 1)."
    ]


def _still(column: NDArray[np.float64]) -> bool:
    return bool(np.ptp(column) <= STILL * np.abs(column).max(initial=0.0))


def _made_of(column: NDArray[np.float64], others: NDArray[np.float64]) -> bool:
    basis = _unit(np.column_stack([others, np.ones(len(column))]))
    left = column - basis @ np.linalg.lstsq(basis, column, rcond=None)[0]
    return bool(np.linalg.norm(left) <= SAME * np.linalg.norm(column - column.mean()))


def _unit(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    tiny = float(np.finfo(np.float64).tiny)
    lengths = np.maximum(np.sqrt(np.sum(columns**2, axis=0)), tiny)
    return np.asarray(columns / lengths, dtype=np.float64)


def _has_path(model: AbstractModel, run: FreeRun, j: int, i: int) -> bool:
    """Whether an output of the model moves with an input of the same sample."""
    few = run.inputs[: LAGS + 1]
    moved = few.copy()
    moved[-1, j] += np.std(run.inputs[:, j]) or 1.0
    before, after = (model.simulate(u, run.history).reshape(len(u), -1)[-1, i] for u in (few, moved))
    return bool(before != after)


def _share(error: NDArray[np.float64], inputs: NDArray[np.float64], j: int, usable: NDArray[np.bool_]) -> float:
    """The part of the error's innovation that an input of the same sample explains; 0 where chance may do it."""
    past = [np.roll(column, lag) for column in (error, *inputs.T) for lag in range(1, LAGS + 1)]
    whole = np.logical_and.reduce([np.roll(usable, lag) for lag in range(LAGS + 1)])
    whole[:LAGS] = False
    base = np.column_stack([*past, np.ones(len(error))])[whole]
    basis, _ = np.linalg.qr(_unit(base))
    left, new = (x[whole] - basis @ (basis.T @ x[whole]) for x in (error, inputs[:, j]))
    free = len(left) - base.shape[1] - 1
    if free < LEAST_SAMPLES or np.linalg.norm(new) <= SAME * np.linalg.norm(inputs[whole, j]):
        return 0.0
    both = float(left @ left) * float(new @ new)
    share = float(left @ new) ** 2 / max(both, float(np.finfo(np.float64).tiny))
    by_chance = float(special.fdtrc(1, free, share * free / max(1.0 - share, float(np.finfo(np.float64).eps))))
    return share if share > SHARE and by_chance < SURE else 0.0
