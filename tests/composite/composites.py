"""Composites that tests are about: a pipe with valves in two instances, and two tanks that feed each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sysid.composite import Composite, FixedMember, Member
from sysid.estimation import Training
from sysid.models import NARX, Limit, Mapping, NARXModel
from sysid.traces import Channel, Trace
from tests.models.cascades.cascades import network
from tests.traces.made import trace_of

THREE = NARX(input_delays=[0, 1, 3], output_delays=2, neurons=3)


def member(mapping: str, rest: float = 90.0, **fields) -> Member:
    """A member of three neurons."""
    return Member(**{"mapping": Mapping.parse(mapping), "structure": THREE, "rest": rest, **fields})


def fixed(mapping: str, **fields) -> FixedMember:
    """A fixed submodel between 0 and 1."""
    return FixedMember(**{"mapping": Mapping.parse(mapping), "low": 0.0, "high": 1.0, "rest": 0.0, **fields})


def pipe(**changes) -> Composite:
    """A pipe's two ends, and a valve with the same weights at both."""
    declared = {
        "members": (
            member("STP -> BP"),
            member("STP -> BP9"),
            member("BP+STP -> AR", instances=("", "9"), shared=("STP",)),
        ),
        "rest": {"BP": "STP", "AR": "STP"},
        "limits": {"AR": Limit(high="BP")},
    }
    return Composite(**{**declared, **changes})


def models() -> dict[str, NARXModel]:
    """Networks for :func:`pipe`."""
    return {
        "BP": network("STP -> BP", seed=1),
        "BP9": replace(network("STP -> BP", seed=2), mapping=Mapping.parse("STP -> BP9")),
        "AR": network("BP+STP -> AR", seed=3),
    }


def trace(n: int = 120, seed: int = 0) -> Trace:
    """Random values in every channel of :func:`pipe`, with a handle that stands still for a while."""
    rng = np.random.default_rng(seed)
    names = ("STP", "BP", "AR", "BP9", "AR9")
    values = rng.uniform(60.0, 90.0, (n, len(names)))
    values[:, 0] = np.repeat(rng.uniform(64.0, 90.0, n // 20), 20)
    return Trace(
        name="T", sample_time=0.1, channels=tuple(Channel(name=one, unit="psi") for one in names), values=values
    )


SHORT = Training(pretraining=400, pretraining_iterations=30, max_iterations=10, workers=1, seed=3)


def tanks(**changes) -> Composite:
    """The upper tank drains into the lower one, and the less the fuller that is."""
    upper = NARX(input_delays=[[0, 1], [1]], output_delays=1, neurons=3)
    lower = NARX(input_delays=[0], output_delays=1, neurons=3)
    declared = {
        "members": (
            member("pump+lower -> upper", 0.0, structure=upper, training=SHORT, candidates=2),
            member("upper -> lower", 0.0, structure=lower, training=SHORT),
        ),
        "limits": {"lower": Limit(low=0.0)},
    }
    return Composite(**{**declared, **changes})


def tank_trace(seed: int, n: int = 300) -> Trace:
    """A run of the tanks at random pump settings."""
    pump = np.repeat(np.random.default_rng(seed).uniform(0.0, 2.0, n // 20), 20)
    pump[:5] = 0.0
    upper, lower = np.zeros(n), np.zeros(n)
    for t in range(1, n):
        down = 0.15 * np.sqrt(max(upper[t - 1] - 0.3 * lower[t - 1], 0.0))
        upper[t] = upper[t - 1] + 0.1 * pump[t] - down
        lower[t] = lower[t - 1] + down - 0.08 * lower[t - 1]
    return trace_of({"pump": pump, "upper": upper, "lower": lower}, name=f"tank {seed}", units="cm")
