"""The brake as a function of arrays: what the generator of data sets gives, sample for sample."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.airbrake.as_function import service_brake
from sysid.airbrake.generate import generate
from sysid.errors import ConfigError
from sysid.traces import Channel
from sysid.units import Reference

COMMAND = [[0, 90], [2, 80], [6, 90], [12, 90]]
NODES = {"BP": {"pipe": 3}, "ER": {"emergency": 3}, "BC2": {"cylinder": 5}}


@pytest.mark.parametrize(("variant", "momentum"), [({}, {}), ({"variant": "physical"}, {"momentum": 0.0})])
def test_it_gives_what_the_generator_gives(variant: dict[str, str], momentum: dict[str, float]) -> None:
    trace = generate(
        case="one", recipe={"command": COMMAND},
        options={**variant, "pairs": 2, "quantities": {"STP": "command", **NODES}},
        channels=tuple(Channel(name=name, unit="psi", reference=Reference.GAUGE) for name in ("STP", *NODES)),
        sample_time=0.1,
    )  # fmt: skip
    found = service_brake(trace.time, trace.columns(["STP"]), {"pairs": 2.0, "behind": 2.0, **momentum})
    np.testing.assert_array_equal(found[:, [0, 2, 7]], trace.columns(list(NODES)))


@pytest.mark.parametrize(
    "parameters", [{"pears": 2.0}, {"pairs": 2.0}, {"pairs": 2.5, "behind": 1.0}, {"momentum": 0.5}]
)
def test_a_valve_that_is_not_there_or_a_parameter_that_is_none_is_refused(parameters: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match="no such parameter, or no such valve"):
        service_brake(np.arange(9) * 0.1, np.full((9, 1), 90.0), parameters)
