"""Is it linear in its own past? What curves of past outputs explain of what a linear equation with them leaves.

A spring that hardens, a pendulum, a damping that changes its sign: their curve is in the state, and curves of the
response to the inputs hardly show it, as that response is far off by then. Some steps ahead of what is measured it is
plain. How long the steps must be is not known: within a short one noise is all that is seen, within a long one the
inputs are forgotten. Means of the output over a few lengths are asked, beside the inputs at every sample and the linear
response, so that nothing is left to a curve that a straight line explains.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.nonparametric.evidence import triangle
from sysid.estimation.nonparametric.impulse_response import ImpulseResponse
from sysid.estimation.nonparametric.segments import Segment, columns_of_lags
from sysid.estimation.records.informative import beyond_chance, by_chance

FACTORS = (1, 2, 4, 8, 16, 32)
"""Samples of a step."""
ROUNDING = 1e-12
"""Of the output's variance: what a linear equation leaves below it is no curve."""
SURE, CLEAR, SOME = 1e-4, 0.2, 0.02
"""How improbable by chance, and what part of what a linear equation leaves, curves must be to be told; and what part
without the inputs of the step that is foretold."""
OUTPUTS, MOST_COLUMNS, ROWS = 4, 200, 4
"""Past steps of the output in the linear equation; its columns at most; and rows for each of them, at least."""


@dataclass(frozen=True, kw_only=True)
class StateCurve:
    """What curves of the past explain.

    Args:
        share: Of what a linear equation leaves one step ahead.
        p: The probability that chance explains as much.
        samples: Of a step.
    """

    share: float
    p: float
    samples: int

    @property
    def sure(self) -> bool:
        """Whether there is one."""
        return self.p < SURE and self.share > CLEAR


def curve_of_state(segments: Sequence[Segment], response: ImpulseResponse) -> StateCurve | None:
    """The length of a step at which curves of the past explain most.

    Args:
        segments: Stretches of the record.
        response: Its linear response, to all of their inputs.

    Returns:
        What they explain; ``None`` where the record is too short.
    """
    found = list[StateCurve]()
    signals = np.concatenate([np.column_stack([s.inputs, s.output]) for s in segments])
    mean, size = signals.mean(axis=0), signals.std(axis=0)
    if not (size > 1e-12 * np.abs(mean)).all():
        return None
    scaled = [
        replace(s, inputs=(s.inputs - mean[:-1]) / size[:-1], output=(s.output - mean[-1]) / size[-1]) for s in segments
    ]
    answers = [response.simulate(s.inputs) / size[-1] for s in segments]
    late = [one.best for one in response.dead_times]
    for samples in FACTORS:
        if samples * (OUTPUTS + 1) * len(late) <= MOST_COLUMNS:
            one = _asked(scaled, answers, late, samples)
            found += [one] if one is not None else []
    best = max(found, key=lambda one: one.share, default=None)
    if best is None or not best.sure:
        return best
    # Where the output acts on the inputs, those within the step tell the noise in it, and of a set point with few
    # levels they tell it by curves: there must be some without them, too.
    before = [max(k, best.samples) for k in late]
    alone = _asked(scaled, answers, before, best.samples, within=False)
    told = alone is not None and alone.p < SURE and alone.share > SOME
    return best if told else replace(best, p=1.0)


def _asked(
    segments: Sequence[Segment],
    answers: list[NDArray[np.float64]],
    late: list[int],
    samples: int,
    *,
    within: bool = True,
) -> StateCurve | None:
    blocks, q = list[NDArray[np.float64]](), 0
    window = samples * (OUTPUTS + 1)
    first = OUTPUTS + -(-max(late) // samples)
    for s, answer in zip(segments, answers, strict=True):
        steps = len(s) // samples
        if steps <= first + 1:
            continue
        y, w = (x[: steps * samples].reshape(steps, samples).mean(axis=1) for x in (s.output, answer))
        ends = np.arange(first, steps) * samples + samples - 1
        past = columns_of_lags(y, range(1, OUTPUTS + 1), slice(first, steps))
        # At every sample: means over steps would hide where in a step an input moved, and that would look like a curve.
        acting = [u[ends[:, None] - np.arange(k, k + window)] for u, k in zip(s.inputs.T, late, strict=True)]
        linear = columns_of_lags(w, range(0 if within else 1, OUTPUTS + 1), slice(first, steps))
        curves = _curves(past, [lags[:, : 2 * samples].mean(axis=1) for lags in acting])
        block = np.column_stack([past, *acting, linear, curves, y[first:]])
        blocks.append(block - block.mean(axis=0))
        q = curves.shape[1]
    rows, columns = sum(map(len, blocks)), blocks[0].shape[1] - 1 if blocks else 0
    free = rows - columns - len(blocks)
    if rows < max(ROWS * columns, 1) or free < 1:
        return None
    z = triangle(blocks, free=0).z ** 2
    without, with_them = float(z[columns - q :].sum()), float(z[columns:].sum())
    # What is exact but for rounding has no curve.
    share = 1.0 - with_them / without if without > ROUNDING * rows else 0.0
    found = StateCurve(share=beyond_chance(share, free + q, free), p=by_chance(share, q, free), samples=samples)
    if not found.sure:
        return found
    # What is slow beside the record is explained by any other slow thing: not in its other half.
    return replace(found, share=min(found.share, _in_other_half(np.concatenate(blocks), columns - q)))


def _in_other_half(block: NDArray[np.float64], linear: int) -> float:
    """Share that curves, weighed in one half, explain of what a linear equation leaves in the other; of both halves."""
    half, left = len(block) // 2, np.zeros(2)
    for known, asked in ((block[:half], block[half:]), (block[half:], block[:half])):
        for k, width in enumerate((linear, block.shape[1] - 1)):
            weights = np.linalg.lstsq(known[:, :width], known[:, -1], rcond=None)[0]
            left[k] += float(np.sum((asked[:, -1] - asked[:, :width] @ weights) ** 2))
    return 1.0 - float(left[1] / max(left[0], 1e-300))


def _curves(past: NDArray[np.float64], acting: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Squares and cubes of the last output, of how it moved, and of each input that acts first, and their products."""
    y, moved = past[:, 0], past[:, 0] - past[:, 1]
    moved = moved / (float(np.sqrt(np.mean(moved**2))) or 1.0)
    found = [np.prod(some, axis=0) for d in (2, 3) for some in combinations_with_replacement([y, moved], d)]
    for u in acting:
        found += [u * u, u**3, u * y, u * moved, u * y * y, u * u * y]
    return np.column_stack(found)
