"""Simulated linear systems with known parameters, for tests."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from sysid.traces import Channel, Trace

CHANNELS = tuple(Channel(name=name, unit=unit) for name, unit in (("u1", "V"), ("u2", "A"), ("y", "bar")))


def trace_of(inputs: np.ndarray, output: np.ndarray, *, name: str = "t", sample_time: float = 1.0) -> Trace:
    columns = np.column_stack([inputs, output])
    channels = (*CHANNELS[: columns.shape[1] - 1], CHANNELS[2])
    return Trace(name=name, sample_time=sample_time, channels=channels, values=columns)


def steps(n: int, n_inputs: int, rng: np.random.Generator, *, held: int = 7) -> np.ndarray:
    """Random levels, each held for some samples, at rest (zero) for the first."""
    levels = np.repeat(rng.normal(size=(n // held + 1, n_inputs)), held, axis=0)[:n]
    levels[:held] = 0.0
    return levels


def noise_for(signal: np.ndarray, decibel: float, rng: np.random.Generator) -> np.ndarray:
    """White noise that many decibels below a signal."""
    return rng.normal(size=len(signal)) * np.std(signal) * 10.0 ** (-decibel / 20.0)


def arx_response(a: list[float], b: list[list[float]], inputs: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """``A y = sum B u + e`` with ``a`` of the recursion ``y = a1 y(t-1) + ...`` and ``b`` from lag 0 on."""
    driven = sum(lfilter(taps, [1.0], u) for taps, u in zip(b, inputs.T, strict=True)) + noise
    return np.asarray(lfilter([1.0], np.concatenate([[1.0], -np.array(a)]), driven))
