"""A record that no linear model fits, for the tests of networks."""

import numpy as np

from sysid.models import Mapping
from sysid.traces import Trace
from tests.traces.made import trace_of

TANK = Mapping(inputs=("pump",), output="level")


def tank(seed: int, n: int = 600) -> Trace:
    """A tank whose outflow follows the square root of its level: no linear model fits it."""
    rng = np.random.default_rng(seed)
    pump = np.repeat(rng.uniform(0.2, 2.0, n // 30 + 1), 30)[:n]
    level = np.zeros(n)
    for t in range(1, n):
        level[t] = level[t - 1] + 0.05 * (pump[t - 1] - 1.2 * np.sqrt(max(level[t - 1], 0.0)))
    return trace_of(
        {"pump": pump, "level": level}, name=f"tank {seed}", sample_time=0.5, units={"pump": "V", "level": "m"}
    )
