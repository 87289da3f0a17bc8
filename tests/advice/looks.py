"""Records that are looked at, and what was found."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from sysid.advice import Advice, Finding, Verdict, advise
from sysid.models import Mapping
from sysid.traces import Channel, Role, Trace, TraceSet

Array = NDArray[np.float64]


def trace(u: Array, y: Array, *, name: str = "a", sample_time: float = 0.5, usable: Any = None) -> Trace:
    u = np.asarray(u, dtype=np.float64).reshape(len(y), -1)
    channels = [Channel(name=f"u{j + 1}", unit="V") for j in range(u.shape[1])] + [Channel(name="y", unit="m")]
    values = np.column_stack([u, y])
    return Trace(name=name, sample_time=sample_time, channels=tuple(channels), values=values, usable=usable)


def look(*traces: Trace, mapping: str = "u1 -> y") -> Advice:
    roles = {one.name: Role.ESTIMATION for one in traces}
    return advise(TraceSet(name="x", traces=traces, roles=roles), Mapping.parse(mapping))


def plant(u: Array, dead: int = 2) -> Array:
    return np.asarray(lfilter([*np.zeros(dead), 0.3], [1.0, -0.8], u))


def noise(n: int, seed: int, size: float) -> Array:
    return size * np.random.default_rng([7, seed]).standard_normal(n)


def steps(n: int, seed: int, hold: int = 6) -> Array:
    return np.repeat(np.random.default_rng(seed).uniform(-1.0, 1.0, n // hold + 1), hold)[:n]


def codes(found: Advice) -> set[str]:
    return {one.code for one in found.findings}


def looks(found: Advice) -> set[str]:
    return {one.code for one in found.findings if one.verdict is Verdict.LOOK}


def finding(found: Advice, code: str, *subject: str) -> Finding:
    one = found.find(code, *subject)
    assert one is not None, sorted(codes(found))
    return one
