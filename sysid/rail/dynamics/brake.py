"""The brake as a port: what turns the driver's handle into a cylinder pressure at every vehicle.

The reference physics, recorded traces and a surrogate for every car plug in alike.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.airbrake.consist import Consist
from sysid.airbrake.machine import BrakedTrain, Probe
from sysid.airbrake.variant import USUAL, Variant
from sysid.errors import ConfigError
from sysid.units import STANDARD_ATMOSPHERE_PA

Signal = NDArray[np.float64] | float


@dataclass(frozen=True, kw_only=True, eq=False)
class BrakeOutput:
    """What a brake did, one row per sample.

    Args:
        cylinders: Pa gauge, shape ``(n_samples, n_vehicles)``, 0 where a vehicle has no brake.
        equalising: Equalising reservoir at the head in Pa gauge, shape ``(n_samples,)``; ``None`` if not modelled.
        head_pipe: Brake pipe behind the locomotive in Pa gauge, likewise.
        tail_pipe: Brake pipe at the last vehicle in Pa gauge, likewise.
    """

    cylinders: NDArray[np.float64]
    equalising: NDArray[np.float64] | None = None
    head_pipe: NDArray[np.float64] | None = None
    tail_pipe: NDArray[np.float64] | None = None


class AbstractBrake(ABC):
    """A brake under way. It starts charged and released, and is advanced in chunks of any length."""

    sample_time: float
    """Seconds between samples."""
    vehicles: int
    """Vehicles that it has a pressure for, front first."""

    @abstractmethod
    def advance(self, command: NDArray[np.float64], *, speed: Signal = 1.0, tail_vent: Signal = 0.0) -> BrakeOutput:
        """Advance by as many samples as there are commands.

        Args:
            command: Handle in psi gauge, 0 for the emergency, shape ``(n_samples,)``.
            speed: Of the train in m/s, one number or one per sample.
            tail_vent: Area in m2 open behind the last vehicle, one number or one per sample.

        Returns:
            Pressures, held within each sample.

        Raises:
            ConfigError: If the brake cannot do what it is asked for.
        """


class ReferenceBrake(AbstractBrake):
    """The compiled reference physics.

    Args:
        consist: Its train; both wagons of a pair have the pressure of the pair's valve, locomotives none.
        variant: The reading of the model.
        sample_time: In s.
        time_step: Of the pneumatics in s.

    Example:
        >>> brake = ReferenceBrake(consist=Consist(pairs=2))
        >>> output = brake.advance(np.full(300, 64.2))
        >>> output.cylinders.shape, bool(output.cylinders[-1, 0] == 0.0), bool(output.cylinders[-1, 1] > 4e5)
        ((300, 5), True, True)
    """

    def __init__(
        self,
        *,
        consist: Consist,
        variant: Variant = USUAL,
        sample_time: float = 0.1,
        time_step: float = 1e-3,
    ) -> None:
        self.sample_time, self.vehicles, self.consist = sample_time, consist.vehicles, consist
        cylinders = [Probe(quantity="cylinder", node=node) for node in consist.valve_nodes]
        pipes = [Probe(quantity="pipe", node=node) for node in (1, 2, consist.vehicles)]
        self._train = BrakedTrain(
            consist=consist,
            variant=variant,
            probes=(*cylinders, *pipes),
            time_step=time_step,
            sample_time=sample_time,
        )
        self._columns = valve_of_vehicle(consist)

    def advance(self, command: NDArray[np.float64], *, speed: Signal = 1.0, tail_vent: Signal = 0.0) -> BrakeOutput:
        """Advance; see :meth:`AbstractBrake.advance`."""
        pressures = self._train.advance(command, speed=speed, tail_vent=tail_vent) - STANDARD_ATMOSPHERE_PA
        valves = self.consist.pairs
        spread = np.zeros((len(pressures), self.vehicles))
        braked = self._columns >= 0
        spread[:, braked] = pressures[:, self._columns[braked]]
        return BrakeOutput(
            cylinders=spread,
            equalising=pressures[:, valves],
            head_pipe=pressures[:, valves + 1],
            tail_pipe=pressures[:, valves + 2],
        )


def valve_of_vehicle(consist: Consist) -> NDArray[np.int64]:
    """Which valve each vehicle's cylinder hangs on.

    Args:
        consist: The train.

    Returns:
        Index of the valve from 0, -1 for a locomotive, shape ``(n_vehicles,)``.

    Example:
        >>> valve_of_vehicle(Consist(pairs=2, locomotives=(1,))).tolist()
        [-1, 0, 0, -1, 1, 1]
    """
    columns = np.full(consist.vehicles, -1, dtype=np.int64)
    for valve, node in enumerate(consist.valve_nodes):
        columns[[node - 2, node - 1]] = valve
    return columns


class RecordedBrake(AbstractBrake):
    """Cylinder pressures that were recorded; the command is not looked at.

    Args:
        pressures: Pa gauge, shape ``(n_samples, n_vehicles)``; the last row is held when they end.
        sample_time: In s.

    Raises:
        ConfigError: If they are not such pressures.

    Example:
        >>> brake = RecordedBrake(pressures=np.array([[0.0, 1e5], [0.0, 2e5]]), sample_time=0.1)
        >>> brake.advance(np.full(3, 90.0)).cylinders[:, 1].tolist()
        [100000.0, 200000.0, 200000.0]
    """

    def __init__(self, *, pressures: NDArray[np.float64], sample_time: float) -> None:
        values = np.array(pressures, dtype=np.float64)
        if values.ndim != 2 or len(values) == 0 or not np.isfinite(values).all():
            raise ConfigError(
                "the recorded pressures cannot be used",
                where="pressures",
                expected="finite Pa gauge, shape (n_samples, n_vehicles)",
                got=f"shape {values.shape}",
            )
        self.sample_time, self.vehicles = sample_time, values.shape[1]
        self._pressures, self._next = values, 0

    def advance(
        self,
        command: NDArray[np.float64],
        *,
        speed: Signal = 1.0,  # noqa: ARG002 - the record knows its own
        tail_vent: Signal = 0.0,  # noqa: ARG002 - the record knows its own
    ) -> BrakeOutput:
        """The next rows; see :meth:`AbstractBrake.advance`."""
        rows = np.minimum(np.arange(self._next, self._next + len(command)), len(self._pressures) - 1)
        self._next += len(command)
        return BrakeOutput(cylinders=self._pressures[rows])


def no_brake(vehicles: int, sample_time: float = 0.1) -> RecordedBrake:
    """An air brake that never applies: for a train that brakes by its notches.

    Args:
        vehicles: Their number.
        sample_time: In s.

    Returns:
        A record of empty cylinders.
    """
    return RecordedBrake(pressures=np.zeros((1, vehicles)), sample_time=sample_time)
