"""A linear system closed by one element that is not linear (Lur'e form): its states over records, by numbers alone."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

DEAD_ZONE, SATURATION, WAITS, RELAY = 0, 1, 2, 3
"""The element: what goes beyond two limits passes; what lies between them; the same, and the last state, a controller's
integral, waits while it would go further beyond; on below the lower limit until above the upper one."""
MOST, TINY = 1e6, 1e-12
"""Where a state stops that runs away; the least by which the element's input moves that is said to meet a limit."""


@njit(cache=True, nogil=True, error_model="numpy")
def loop_states(
    kind: int, steps: int, n: int, sizes: NDArray[np.float64], theta: NDArray[np.float64],
    inputs: NDArray[np.float64], begins: NDArray[np.bool_], out: NDArray[np.float64],
) -> None:  # fmt: skip
    """Run records one after the other; each state is one mode, fed by the inputs and by the element.

    Args:
        kind: The element.
        steps: From sample to sample.
        n: States.
        sizes: What each state is fed with in a sample, shape ``(n,)``.
        theta: Rates a sample, ``n``; factors of the inputs for each state, ``n*m``; of states, ``n``, and inputs,
            ``m``, in what the element sees; states before the first sample, ``n``; two limits; then of a dead zone how
            much of what it passes acts as its rate, in samples; of an integral that waits factors of states, ``n``, and
            inputs, ``m``, and a constant; of a relay whether it is on before the first sample.
        inputs: Shape ``(n_samples, m)``.
        begins: Where a record begins, shape ``(n_samples,)``.
        out: States at the end of each sample, shape ``(n_samples, n)``; written. Of a relay one column more: whether it
            is on there.
    """
    m = inputs.shape[1]
    at_b, at_c = n, n + n * m
    at_d, at_x = at_c + n, at_c + n + m
    at_l, at_w = at_x + n, at_x + n + 2
    low, high = theta[at_l], theta[at_l + 1]
    keeps, fed, x, drive = np.empty(n), np.empty(n), np.zeros(n), np.empty(n)
    for i in range(n):
        a = theta[i] / steps
        keeps[i] = math.exp(-a)
        fed[i] = sizes[i] / steps * ((1.0 - keeps[i]) / a if abs(a) > 1e-9 else 1.0)
    on = 0.0
    for t in range(len(inputs)):
        if begins[t]:
            for i in range(n):
                x[i] = theta[at_x + i]
        wound, seen = 0.0, 0.0
        for j in range(m):
            seen += theta[at_d + j] * inputs[t, j]
        for i in range(n):
            drive[i] = 0.0
            for j in range(m):
                drive[i] += theta[at_b + i * m + j] * inputs[t, j]
        if kind == WAITS:
            wound = theta[at_w + n + m]
            for j in range(m):
                wound += theta[at_w + n + j] * inputs[t, j]
        z = seen
        for i in range(n):
            z += theta[at_c + i] * x[i]
        if kind == RELAY:
            if begins[t]:
                on = 1.0 if theta[at_w] > 0.5 else 0.0
            on = 1.0 if z < low else (0.0 if z > high else on)
        for _ in range(steps):
            if kind == RELAY:
                before, z = z, seen
                for i in range(n):
                    x[i] = keeps[i] * x[i] + fed[i] * (drive[i] + on)
                    z += theta[at_c + i] * x[i]
                # It has switched on the way: for what is left of the step it was the other.
                late = 0.0
                if on > 0.5 and z > high:
                    late, on = -min((z - high) / max(z - before, TINY), 1.0), 0.0
                elif on < 0.5 and z < low:
                    late, on = min((low - z) / max(before - z, TINY), 1.0), 1.0
                if late != 0.0:
                    for i in range(n):
                        x[i] += fed[i] * late
                        z += theta[at_c + i] * fed[i] * late
                continue
            between = min(max(z, low), high)
            element = z - between if kind == DEAD_ZONE else between
            moving = n
            if kind == WAITS:
                moving, gain = n - 1, wound
                for i in range(n):
                    gain += theta[at_w + i] * x[i]
                if (z > high and gain > 0.0) or (z < low and gain < 0.0):
                    gain = 0.0
                x[n - 1] += gain / steps
            # What it sees half a step on: at the beginning of a step it would drive what swings.
            ahead = seen + (theta[at_c + n - 1] * x[n - 1] if kind == WAITS else 0.0)
            for i in range(moving):
                ahead += theta[at_c + i] * (keeps[i] * x[i] + fed[i] * (drive[i] + element))
            middle = 0.5 * (z + ahead)
            between = min(max(middle, low), high)
            if kind == DEAD_ZONE:  # what dampens it acts where it passes something
                rises = ahead - min(max(ahead, low), high) - element
                element = middle - between + theta[at_w] * steps * rises
            else:
                element = between
            for i in range(moving):
                x[i] = keeps[i] * x[i] + fed[i] * (drive[i] + element)
            z = seen
            for i in range(n):
                z += theta[at_c + i] * x[i]
        for i in range(n):
            x[i] = min(max(x[i], -MOST), MOST) if x[i] == x[i] else MOST
            out[t, i] = x[i]
        if kind == RELAY:
            out[t, n] = on
