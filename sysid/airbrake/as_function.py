"""The train's brake as the Python function that a reference of anybody's is: arrays in, arrays out, no data set.

In YAML: ``reference: {python: sysid.airbrake.as_function:service_brake, ...}``, with its ports in the order below.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from sysid.airbrake.command import Command
from sysid.airbrake.consist import Consist
from sysid.airbrake.machine import Probe
from sysid.airbrake.simulate import simulate
from sysid.airbrake.variant import ACOUSTIC, PHYSICAL
from sysid.errors import ConfigError

QUANTITIES = ("pipe", "auxiliary", "emergency", "cylinder")
USUAL = {"pairs": 50.0, "behind": 10.0, "running_pressure": 90.0, "load": 1.0, "momentum": 1.0}
"""What the function's parameters are where they are not given."""


def service_brake(
    time: NDArray[np.float64], inputs: NDArray[np.float64], parameters: Mapping[str, float]
) -> NDArray[np.float64]:
    """The brake of a train from its handle, as it is read and with the repairs of the variant ``acoustic``.

    Args:
        time: Of the samples in s, uniform, shape ``(n,)``.
        inputs: The handle in psi gauge, shape ``(n, 1)``.
        parameters: ``pairs`` of wagons (50), the brake valve ``behind`` the first that is recorded too (10),
            ``running_pressure`` in psi gauge (90), ``load``, the share of its cylinders' pressure that cars ask for
            (1), and ``momentum`` of the air in the pipe (1; 0 is the variant ``physical`` of the published traces).

    Returns:
        Pressures in psi gauge, shape ``(n, 8)``: brake pipe, auxiliary reservoir, emergency reservoir and brake
        cylinder at the first brake valve, then at the one behind; each the mean over its sample.

    Raises:
        ConfigError: If a parameter is none of these, or the train has no such valve.

    Example:
        >>> handle = np.repeat([90.0, 84.0], [10, 90])[:, np.newaxis]
        >>> found = service_brake(np.arange(100) * 0.1, handle, {"pairs": 2, "behind": 2})
        >>> found.shape, bool(found[-1, 0] < 86.0), bool(found[-1, 3] > 3.0)
        ((100, 8), True, True)
    """
    strangers = sorted(set(parameters) - set(USUAL))
    given = {**USUAL, **parameters}
    pairs, behind = int(given["pairs"]), int(given["behind"])
    whole = (pairs, behind) == (given["pairs"], given["behind"]) and given["momentum"] in {0.0, 1.0}
    if strangers or not whole or not 1 <= behind <= pairs:
        raise ConfigError(
            "the brake has no such parameter, or no such valve", where="service_brake",
            expected=f"some of {', '.join(USUAL)}; a valve behind of 1 to pairs, both whole numbers; momentum 0 or 1",
            got=", ".join(f"{name} {value:g}" for name, value in parameters.items()), remedy="correct it",
        )  # fmt: skip
    consist = Consist(pairs=pairs, running_pressure=given["running_pressure"], loads=given["load"])
    probes = [Probe(quantity=one, node=2 * valve + 1) for valve in (1, behind) for one in QUANTITIES]
    sample_time = float(np.round(time[1] - time[0], 9))
    record = simulate(
        Command.from_samples(inputs[:, 0], sample_time=sample_time), consist=consist,
        variant=ACOUSTIC if given["momentum"] else PHYSICAL,
        probes=tuple(dict.fromkeys(probes)), sample_time=sample_time,
    )  # fmt: skip
    return np.column_stack([record.gauge_psi(one.quantity, one.node) for one in probes])
