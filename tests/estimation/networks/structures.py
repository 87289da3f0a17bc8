"""A shaken structure: two modes that swing, and a spring between them that stiffens."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid.models import Mapping
from sysid.traces import Trace
from tests.traces.made import trace_of

MAPPING = Mapping.parse("u -> y")

SAMPLE_TIME, SUBSTEPS = 0.0025, 4
"""Seconds, and steps of the integration in one."""


def shaken(seed: int, force: float, *, n: int = 6000, modes: int = 2, stiffening: float = 2e-4) -> Trace:
    """The acceleration of the first of some masses in a row, the last two joined by a spring that stiffens.

    Args:
        seed: Of the random phases of the force, whose lines lie from 2 to 15 Hz.
        force: Its root mean square in N.
        n: Samples.
        modes: Masses.
        stiffening: Share by which that spring is stiffer at a stretch of 1 mm.

    Returns:
        The record.
    """
    rng, t = np.random.default_rng(seed), np.arange(n * SUBSTEPS + 1) * SAMPLE_TIME / SUBSTEPS
    lines = np.arange(2.0, 15.0, 1.0 / (n * SAMPLE_TIME))
    phases = rng.uniform(0, 2 * np.pi, len(lines))
    u = np.sum([np.cos(2 * np.pi * f * t + p) for f, p in zip(lines, phases, strict=True)], axis=0)
    u *= force / np.std(u)
    K = 2.0 * np.eye(modes) - np.eye(modes, k=1) - np.eye(modes, k=-1)
    K *= (2 * np.pi * 12.0) ** 2 / np.linalg.eigvalsh(K)[-1]
    along = np.zeros(modes)
    along[-2:] = 1.0, -1.0
    x, v, h, y = np.zeros(modes), np.zeros(modes), SAMPLE_TIME / SUBSTEPS, np.empty(n)

    def accelerated(x: NDArray[np.float64], v: NDArray[np.float64], f: float) -> NDArray[np.float64]:
        stretch = along @ x
        a = -K @ x - 0.02 * 2 * np.pi * 8.0 * 2.0 * v - along * stiffening * 1e6 * 0.5 * K[-1, -1] * stretch**3
        a[0] += f
        return np.asarray(a)

    for k in range(n * SUBSTEPS):
        if k % SUBSTEPS == 0:
            y[k // SUBSTEPS] = accelerated(x, v, u[k])[0]
        half = v + 0.5 * h * accelerated(x, v, u[k])
        x = x + h * half
        v = half + 0.5 * h * accelerated(x, half, u[k + 1])
    y += 1e-3 * np.std(y) * rng.standard_normal(n)
    return trace_of(
        {"u": u[::SUBSTEPS][:n], "y": y}, name=f"shaken {seed}", sample_time=SAMPLE_TIME, units={"u": "N", "y": "m/s^2"}
    )
