"""The oscillator of Bouc and Wen: a public benchmark of hysteresis, whose estimation record everybody makes.

    m y'' + c y' + k y + z = u,    z' = alpha y' - beta (gamma |y'| |z|^(nu - 1) z + delta y' |z|^nu)

Equations, numbers and integration: Noel and Schoukens, "Hysteretic benchmark with a dynamic nonlinearity", 4TU
10.4121/12967592; Newmark's method of average acceleration at twenty times the sample rate, z by the trapezoidal rule,
the step solved by Newton's method.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.interpolate import CubicSpline

from sysid.excitation import Multisine, excite
from sysid.field_checks import check
from sysid.own_folders import keep_kernels_where_it_is_allowed
from sysid.traces import Channel, Trace

keep_kernels_where_it_is_allowed()
Array = NDArray[np.float64]

BENCHMARK: Mapping[str, float] = {
    **{"mass": 2.0, "damping": 10.0, "stiffness": 5e4},  # kg, N s/m, N/m
    **{"alpha": 5e4, "beta": 1e3, "gamma": 0.8, "delta": -1.1, "nu": 1.0},
}
"""The benchmark's numbers."""

FINER = 20
"""Steps of integration from sample to sample."""


def _newmark(u: Array, h: float, p: Array) -> Array:
    """The displacement under a force of every step ``h``, from rest; ``p`` are the numbers of ``BENCHMARK``."""
    m, c, k, alpha, beta, gamma, delta, nu = p
    y, v, z, slope, a = 0.0, 0.0, 0.0, 0.0, u[0] / m
    out = np.zeros(len(u))
    for i in range(1, len(u)):
        y0, v0, z0 = y + h * v + 0.25 * h * h * a, v + 0.5 * h * a, z + 0.5 * h * slope
        for _ in range(50):
            y, v, z = y0 + 0.25 * h * h * a, v0 + 0.5 * h * a, z0 + 0.5 * h * slope
            size = abs(z) ** nu
            # |z|^(nu - 1) z, and what follows from its slope and that of |z|^nu, which have none at 0 where nu < 1
            power = np.sign(z) * size
            bent = nu * abs(z) ** (nu - 1.0) if z != 0.0 else 0.0
            r1 = m * a + c * v + k * y + z - u[i]
            r2 = slope - alpha * v + beta * (gamma * abs(v) * power + delta * v * size)
            j11, j12 = m + 0.5 * h * c + 0.25 * h * h * k, 0.5 * h
            j21 = 0.5 * h * (beta * (gamma * np.sign(v) * power + delta * size) - alpha)
            j22 = 1.0 + 0.5 * h * beta * bent * (gamma * abs(v) + delta * v * np.sign(z))
            det = j11 * j22 - j12 * j21
            da, dz = (r1 * j22 - j12 * r2) / det, (j11 * r2 - j21 * r1) / det
            a, slope = a - da, slope - dz
            if abs(da) <= 1e-10 * (1.0 + abs(a)) and abs(dz) <= 1e-10 * (1.0 + abs(slope)):
                break
        y, v, z = y0 + 0.25 * h * h * a, v0 + 0.5 * h * a, z0 + 0.5 * h * slope
        out[i] = y
    return out


_compiled = numba.njit(_newmark, cache=True)


def displacement(force: Array, step: float, **numbers: float) -> Array:
    """What the oscillator does under a force, from rest.

    Args:
        force: In N, at every step of integration.
        step: Seconds.
        numbers: Those that differ from the benchmark's.

    Returns:
        The displacement in m, at every step.
    """
    values = {**BENCHMARK, **numbers}
    return np.asarray(_compiled(np.asarray(force, dtype=np.float64), step, np.array([values[n] for n in BENCHMARK])))


def bouc_wen(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """The oscillator as a reference: ``python: sysid.references.hysteresis:bouc_wen``.

    Args:
        time: Seconds, shape ``(n,)``.
        inputs: The force in N, shape ``(n, 1)``; a cubic spline leads through it.
        parameters: Those of ``BENCHMARK`` that differ.

    Returns:
        The displacement in m, from rest.
    """
    step = (time[1] - time[0]) / FINER
    fine = CubicSpline(time, inputs[:, 0])(time[0] + step * np.arange(FINER * (len(time) - 1) + 1))
    return displacement(fine, step, **parameters)[::FINER]


def settled(force: Array, sample_time: float, **numbers: float) -> Array:
    """What the oscillator does under a periodic force, once it has settled.

    Args:
        force: A period in N, which has nothing above half the sample rate.
        sample_time: Seconds.
        numbers: Those that differ from the benchmark's.

    Returns:
        A period of the displacement in m.
    """
    n = len(force)
    fine = np.fft.irfft(np.fft.rfft(force), FINER * n) * FINER
    return displacement(np.tile(fine, 2), sample_time / FINER, **numbers)[n * FINER :: FINER]


class _Options(BaseModel):
    model_config = ConfigDict(extra="forbid")
    band: tuple[float, float] = (5.0, 150.0)
    rms: float = Field(default=50.0, gt=0)
    noise: float = Field(default=8e-6, ge=0)


class _Recipe(BaseModel):
    model_config = ConfigDict(extra="forbid")
    seed: int = Field(ge=0)
    samples: int = Field(default=8192, ge=16)


def generate(
    *,
    case: str,
    recipe: Mapping[str, Any],
    options: Mapping[str, Any],
    channels: tuple[Channel, ...],
    sample_time: float,
) -> Trace:
    """The generator ``bouc-wen``: a period of a multisine of random phases and the settled displacement, with noise.

    Args:
        case: Name of the trace.
        recipe: ``seed`` of phases and noise, ``samples`` of the period.
        options: ``band`` in Hz, ``rms`` of the force in N, ``noise`` in m rms, white up to half the sample rate.
        channels: Force and displacement, in this order.
        sample_time: Seconds.

    Returns:
        The trace.
    """
    asked, wish = check(_Recipe, dict(recipe), where=case), check(_Options, dict(options), where="source.options")
    sines = Multisine(band=wish.band, iterations=0)
    shape = excite(sines, sample_time=sample_time, samples=asked.samples, low=-1.0, high=1.0, seed=asked.seed)
    force = wish.rms / np.std(shape.values[:, 0]) * shape.values[:, 0]
    rng = np.random.default_rng([asked.seed, 1])
    seen = settled(force, sample_time) + wish.noise * rng.standard_normal(asked.samples)
    return Trace(name=case, sample_time=sample_time, channels=channels, values=np.column_stack([force, seen]))
