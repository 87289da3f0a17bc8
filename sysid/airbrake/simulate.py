"""One way in: a command, a consist and a variant make a record of pressures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.airbrake.command import Command
from sysid.airbrake.consist import Consist
from sysid.airbrake.flow import FlowTable
from sysid.airbrake.machine import BrakedTrain, Probe, all_probes
from sysid.airbrake.radio import Radio
from sysid.airbrake.variant import USUAL_VARIANT, VARIANTS, Variant
from sysid.errors import ConfigError
from sysid.units import PSI_IN_PA, STANDARD_ATMOSPHERE_PA


@dataclass(frozen=True, kw_only=True, eq=False)
class AirBrakeRecord:
    """Pressures over time, averaged over each sample.

    Args:
        sample_time: Seconds between samples.
        probes: What the columns are.
        pressures: Pa absolute, shape ``(n_samples, n_probes)``.
        command: Psi gauge at the handle, shape ``(n_samples,)``.
        gained: Air that entered the train, as P V in J.
        stored: Air in the train, as P V in J, before and after.
    """

    sample_time: float
    probes: tuple[Probe, ...]
    pressures: NDArray[np.float64]
    command: NDArray[np.float64]
    gained: float
    stored: tuple[float, float]

    def __getitem__(self, probe: tuple[str, int]) -> NDArray[np.float64]:
        wanted = Probe(quantity=probe[0], node=probe[1])
        if wanted not in self.probes:
            raise ConfigError(
                f"{wanted.quantity} at node {wanted.node} was not recorded",
                expected=", ".join(f"{p.quantity} {p.node}" for p in self.probes),
                got=probe,
            )
        return self.pressures[:, self.probes.index(wanted)]

    def gauge_psi(self, quantity: str, node: int) -> NDArray[np.float64]:
        """One column in psi gauge, shape ``(n_samples,)``.

        Args:
            quantity: One of :data:`QUANTITIES`.
            node: Node number from 1.

        Returns:
            The pressure.

        Raises:
            ConfigError: If it was not recorded.
        """
        return (self[quantity, node] - STANDARD_ATMOSPHERE_PA) / PSI_IN_PA


def simulate(
    command: Command,
    *,
    consist: Consist | None = None,
    variant: Variant = VARIANTS[USUAL_VARIANT],
    probes: tuple[Probe, ...] | None = None,
    time_step: float = 1e-3,
    sample_time: float = 0.1,
    speed: NDArray[np.float64] | float = 1.0,
    tail_vent: NDArray[np.float64] | float = 0.0,
    table: FlowTable | None = None,
    radio: Radio | None = None,
) -> AirBrakeRecord:
    """Simulate the air brake of a train that starts charged, with empty cylinders.

    Args:
        command: The driver's handle.
        consist: The train; 50 wagon pairs if not given.
        variant: The reading of the model; that with momentum of the air if not given.
        probes: Pressures to record; all of them if not given.
        time_step: Step of the explicit scheme in s.
        sample_time: Output step in s; each sample is the mean over its steps.
        speed: Speed of the train in m/s, one number or one per sample; matters to ``speed_gates`` only.
        tail_vent: Area in m2 open to the atmosphere behind the last vehicle (an end-of-train valve), one number
            or one per sample.
        table: Flow table in place of the formula's.
        radio: How the further locomotives hear of the handle; at once by default.

    Returns:
        The record.

    Raises:
        ConfigError: If the command exceeds the running pressure or a probe is not there.
        StabilityError: If the time step is too large, with the largest one that is not.

    Example:
        >>> minimum = Command.from_rows([[0, 90], [1, 84.2], [20, 84.2]])
        >>> record = simulate(minimum, consist=Consist(pairs=1), probes=(Probe(quantity="cylinder", node=3),))
        >>> bool(record.gauge_psi("cylinder", 3)[-1] > 8.0)
        True
    """
    consist = Consist() if consist is None else consist
    probes = all_probes(consist) if probes is None else tuple(probes)
    train = BrakedTrain(
        consist=consist, variant=variant, probes=probes, time_step=time_step, sample_time=sample_time, table=table
    )
    handle = command.sampled(sample_time=sample_time)
    before = train.stored
    remote = None if radio is None else radio.heard(handle, sample_time)
    pressures = train.advance(handle, speed=speed, tail_vent=tail_vent, remote=remote)
    return AirBrakeRecord(
        sample_time=sample_time,
        probes=probes,
        pressures=pressures,
        command=handle,
        gained=train.gained,
        stored=(before, train.stored),
    )
