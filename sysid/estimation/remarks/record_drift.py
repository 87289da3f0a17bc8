"""What moves an output slowly, or at once, and is none of its inputs: a drift, a jump of level."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import UserError
from sysid.estimation.linear.slow_poles import INTEGRATES
from sysid.estimation.nonparametric.remembered import remembered_response
from sysid.estimation.remarks.fitted_run import FreeRun
from sysid.kernels.linear import slowed
from sysid.models import AbstractModel, Mapping, TransferFunctionModel
from sysid.traces import Trace
from sysid.units import in_unit

Array = NDArray[np.float64]

FEWEST, SHARE = 60, 0.25
"""Samples from which a trend is looked for, and part of the output's standard deviation from which it is told."""
SURE, SURE_OF_JUMP = 8.0, 6.0
"""How many times a drift, and a jump, is larger than by chance, in standard deviations."""
MOST_CORRELATED = 0.999
LAGS, SLOW = 128, 1.0 - 1.0 / 256
"""Samples within which the output must have answered its inputs: what answers longer may as well be a plant that
integrates; and the pole of a model that answers longer all the same, as it has made the drift its own."""
WITH_SUM, AS_STEEP = 0.6, 0.5
"""Part of what a drift does about its line that the sum of an input must explain, and how well it must explain the
line, too."""
BY_LINE = 0.5
"""Part of a drift that the error of a free run must have: any other model that follows it has said it."""


@dataclass(frozen=True, kw_only=True)
class Trend:
    """What moves a signal besides its inputs.

    Args:
        size: From beginning to end, or of the jump, in the signal's unit.
        at: The sample from which on it stands at another level; ``None`` for a drift.
    """

    size: float
    at: int | None = None


def trend_of(left: Array, spread: float) -> Trend | None:
    """The drift or jump of what the inputs leave of an output.

    Args:
        left: Shape ``(n_samples,)``, from where on it is known.
        spread: The output's standard deviation, in the same unit.

    Returns:
        The trend; ``None`` where it is small, or may be noise that lasts.
    """
    n = len(left)
    if n < FEWEST:
        return None
    t, centred = np.linspace(-0.5, 0.5, n), left - left.mean()
    slope = float(t @ centred / (t @ t))
    line = float(np.sum((centred - slope * t) ** 2))
    at, jump, rest = _jump(centred)
    step = np.where(np.arange(n) < at, 0.0, jump)
    chance = np.sqrt(line / n / _effective(centred - slope * t)) * np.sqrt(12.0)
    # Of the difference of two means, over parts that may be of unequal length.
    parts = n / np.sqrt(at * (n - at))
    chance_of_jump = parts * np.sqrt(rest / n / _effective(centred - step + step.mean()))
    if abs(jump) > max(SHARE * spread, SURE_OF_JUMP * chance_of_jump) and rest < 0.7 * line:
        return Trend(size=jump, at=at)
    return Trend(size=slope) if abs(slope) > max(SHARE * spread, SURE * chance) else None


def _effective(x: Array) -> float:
    """How many independent samples a coloured one is worth, by its first correlation."""
    r = float(x[1:] @ x[:-1] / max(float(x @ x), 1e-300))
    r = min(max(r, 0.0), MOST_CORRELATED)
    return max(len(x) * (1.0 - r) / (1.0 + r), 2.0)


def _jump(x: Array) -> tuple[int, float, float]:
    """Where a change of level explains most, how large it is, and what it leaves."""
    n, margin = len(x), max(len(x) // 20, 5)
    k = np.arange(margin, n - margin)
    before = np.cumsum(x)[k - 1]
    gain = before**2 * n / (k * (n - k))
    best = int(k[np.argmax(gain)])
    low, high = float(x[:best].mean()), float(x[best:].mean())
    return best, high - low, float(x @ x - gain.max())


def sums_up(left: Array, inputs: Array, pole: float = 1.0) -> int | None:
    """Which input a drift is the sum of, as the charge of a battery is: then the plant adds up, and nothing drifts.

    A sum moves about its own line in time, and the drift moves with it there; by chance two slow signals may do so,
    too, but not as strongly as the line itself asks for.

    Args:
        left: What a quick response leaves of an output, shape ``(n_samples,)``.
        inputs: At the same samples, in units counted from where nothing is added, shape ``(n_samples, n_inputs)``.
        pole: What a sample leaves of the sum in the next one: less than 1 of a plant that forgets slowly.

    Returns:
        The place of the input; ``None`` where none does it.
    """
    t = np.column_stack([np.ones(len(left)), np.linspace(-0.5, 0.5, len(left))])
    off, slope = _off_line(t, left)
    for j, u in enumerate(inputs.T):
        added = np.cumsum(u) if pole == 1.0 else slowed(u - u.mean(), pole, 0.0)
        moved, drawn = _off_line(t, added)
        size = float(moved @ moved)
        strength = float(off @ moved) / size if size > 1e-24 * float(np.sum(added**2)) else 0.0
        with_sum = strength * float(off @ moved) >= WITH_SUM * float(off @ off) > 0.0
        if with_sum and AS_STEEP * abs(slope) <= strength * drawn * np.sign(slope) <= abs(slope) / AS_STEEP:
            return j
    return None


def _off_line(t: Array, x: Array) -> tuple[Array, float]:
    """What a line in time leaves of a signal, and how far the line goes."""
    line = np.linalg.lstsq(t, x, rcond=None)[0]
    return x - t @ line, float(line[1])


def drifts_told(model: AbstractModel, traces: Sequence[Trace], runs: Sequence[FreeRun]) -> dict[int, str]:
    """Which outputs drift, as the zero of a sensor does.

    The response to the inputs is estimated beside the drift, where the error of the free run has one.

    Args:
        model: The fitted model.
        traces: The records that were fitted.
        runs: Its free runs over them.

    Returns:
        A sentence for each such output, by its place.
    """
    told = dict[int, str]()
    for i, mapping in enumerate(model.mapping.each if model.mapping.inputs else ()):
        outputs = [run.output[run.usable, i] for run in runs if run.usable.any()]
        spread = float(np.concatenate(outputs).std()) if outputs else 0.0
        slow = _slowest(model) > SLOW and not getattr(model.structure, "integrated", False)
        asked = [j for j, run in enumerate(runs) if spread > 0.0 and _may_drift(run, i, spread, slow=slow)]
        found = _drifts([traces[j] for j in asked], mapping, spread, model) if asked else []
        if found:
            most = max(found, key=abs)
            size = in_unit(f"{abs(most):.3g}", model.ends.output_units[i])
            way, share = "rises" if most > 0.0 else "falls", 100 * abs(most) / spread
            told[i] = (
                f"{mapping.output} drifts: it {way} by {size} ({share:.0f} % of its standard deviation) over a record, "
                f"and no input does it{_in(len(found), len(runs))}. The model cannot say that, and bends its dead time "
                "and slow modes to it. Where it is the zero of a sensor, take it off "
                f"(repairs: {{drift: {{{mapping.output}: line}}}}), or give its cause as an input."
            )
    return told


def _slowest(model: AbstractModel) -> float:
    """Magnitude of the slowest pole, of a model of the noise too: a run from a state that the record shows has all."""
    return max(model.pole_radius or 0.0, float(getattr(model.recursion, "radius", 0.0)))


def _in(some: int, every: int) -> str:
    return "" if every == 1 else f" ({some} of {every} records)"


def _may_drift(run: FreeRun, i: int, spread: float, *, slow: bool) -> bool:
    """Whether there is a line in time in the error of a run, or in the output where a slow pole may have made it."""
    error = (run.output if slow else run.output - run.simulated)[run.usable, i]
    if len(error) < FEWEST or not np.isfinite(error).all():
        return len(error) >= FEWEST
    t = np.linspace(-0.5, 0.5, len(error))
    slope = float(t @ (error - error.mean()) / (t @ t))
    return abs(slope) > BY_LINE * SHARE * spread


def _added(model: AbstractModel, trace: Trace, mapping: Mapping) -> Array:
    """What a plant adds up: its inputs; for a model with a pole at 1 from where nothing is added, and as late."""
    inputs = trace.columns(mapping.inputs)
    if not isinstance(model, TransferFunctionModel) or abs(model.pole_radius - 1.0) > INTEGRATES:
        return inputs
    whole = [round(k) for k in model.delays]
    late = [np.concatenate([np.full(k, u[0]), u])[: len(u)] for u, k in zip(inputs.T, whole, strict=True)]
    return np.asarray(np.column_stack(late) - np.asarray(model.scaling.input_offset))


def _drifts(traces: Sequence[Trace], mapping: Mapping, spread: float, model: AbstractModel) -> list[float]:
    """How far each record that drifts does, beside a response to its inputs that has settled."""
    try:
        response = remembered_response(traces, mapping, longest=LAGS)
    except UserError:
        return []
    if not response.settled:
        return []
    sizes = []
    for trace in traces:
        left = trace[mapping.output] - response.simulate(trace.columns(mapping.inputs))
        seen = trace.usable_samples & (np.arange(len(trace)) >= response.lags[-1])
        found = trend_of(left[seen], spread)
        if found is None or found.at is not None:
            continue
        added, slowest = _added(model, trace, mapping)[seen], _slowest(model)
        poles = (1.0, slowest) if SLOW < slowest < 1.0 else (1.0,)
        if all(sums_up(left[seen], added, pole) is None for pole in poles):
            sizes.append(found.size)
    return sizes
