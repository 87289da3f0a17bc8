"""A whole assembly as the brake of every car: a cascade from the driver's handle to the cylinder."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.airbrake.consist import Consist
from sysid.errors import ConfigError
from sysid.models import Cascade
from sysid.rail.dynamics.brake import AbstractBrake, BrakeOutput, Signal, valve_of_vehicle
from sysid.rail.dynamics.equalising import equalising_from_handle
from sysid.rail.dynamics.surrogate import COMMAND, CYLINDER, PIPE, TAIL_VENT
from sysid.units import PSI_IN_PA

AHEAD = 600
"""Samples that are run in advance with the inputs held; a handle is moved less often than that."""


class CascadeBrake(AbstractBrake):
    """Cascades from the handle (``STP``), and the tail vent (``TV``) where they know it, to the cylinder (``BC``).

    A cascade runs from rest to its end in one compiled pass. A brake is advanced in pieces, at the pace of a driver: so
    each pass goes on with the inputs held, its outputs are handed out as long as the inputs do stay, and a pass from
    the beginning follows when they have moved. What comes out is the free run, to the digit. Cars with one cascade have
    one run: they differ in nothing that a cascade reads.

    Args:
        cascades: One for all cars, or one per valve, front first.
        consist: The train.

    Raises:
        ConfigError: If a cascade reads or gives other channels, or their number does not fit.
    """

    def __init__(self, *, cascades: Sequence[Cascade], consist: Consist) -> None:
        _check(cascades, consist)
        cars = list(cascades) * consist.pairs if len(cascades) == 1 else list(cascades)
        self._distinct = list({id(one): one for one in cars}.values())
        place = {id(one): k for k, one in enumerate(self._distinct)}
        self._of_car = np.array([place[id(one)] for one in cars])
        self.sample_time, self.vehicles, self.consist = cars[0].sample_time, consist.vehicles, consist
        self._columns = valve_of_vehicle(consist)
        self._inputs = np.empty((0, 2))
        self._assumed = np.empty((0, 2))
        self._runs: list[dict[str, NDArray[np.float64]]] = []
        self._equalising = consist.running_pressure

    def advance(
        self,
        command: NDArray[np.float64],
        *,
        speed: Signal = 1.0,  # noqa: ARG002 - no cascade reads it
        tail_vent: Signal = 0.0,
    ) -> BrakeOutput:
        """Advance; see :meth:`AbstractBrake.advance`."""
        vents = np.broadcast_to(np.asarray(tail_vent, dtype=np.float64), (len(command),))
        if np.any(vents > 0.0) and not all(TAIL_VENT in one.inputs for one in self._distinct):
            raise ConfigError(
                "this surrogate does not know an open tail",
                where="tail_vent",
                expected=f"cascades with the input {TAIL_VENT}, or a closed tail",
                got=float(np.max(vents)),
                remedy="fit on traces with a tail vent, or brake from the head only",
            )
        done = len(self._inputs)
        self._inputs = np.concatenate([self._inputs, np.column_stack([command, vents])])
        now = slice(done, len(self._inputs))
        if not np.array_equal(self._assumed[: len(self._inputs)], self._inputs):
            self._run_ahead()
        cylinders = np.column_stack([self._runs[k][CYLINDER][now] for k in self._of_car])
        spread = np.zeros((len(command), self.vehicles))
        braked = self._columns >= 0
        spread[:, braked] = np.maximum(cylinders, 0.0)[:, self._columns[braked]] * PSI_IN_PA
        if PIPE not in self._runs[0]:
            return BrakeOutput(cylinders=spread)
        levels = equalising_from_handle(np.concatenate([[self._equalising], command]), self.sample_time)[1:]
        self._equalising = float(levels[-1])
        return BrakeOutput(
            cylinders=spread,
            equalising=levels * PSI_IN_PA,
            head_pipe=self._runs[self._of_car[0]][PIPE][now] * PSI_IN_PA,
            tail_pipe=self._runs[self._of_car[-1]][PIPE][now] * PSI_IN_PA,
        )

    def _run_ahead(self) -> None:
        """Run from the beginning, and on with the inputs held."""
        self._assumed = np.concatenate([self._inputs, np.repeat(self._inputs[-1:], AHEAD, axis=0)])
        columns = {COMMAND: self._assumed[:, 0], TAIL_VENT: self._assumed[:, 1]}
        self._runs = []
        for one in self._distinct:
            # At rest the handle is in its running position, whatever its first sample is, and so is what rests with it.
            followers = [name for name, level in one.rest.items() if level == COMMAND]
            rest = dict.fromkeys([COMMAND, *followers], self.consist.running_pressure)
            run = one.simulate(np.column_stack([columns[name] for name in one.inputs]), rest=rest)
            self._runs.append({name: run[name] for name in one.outputs})


def _check(cascades: Sequence[Cascade], consist: Consist) -> None:
    for one in cascades:
        if not set(one.inputs) <= {COMMAND, TAIL_VENT} or COMMAND not in one.inputs or CYLINDER not in one.outputs:
            raise ConfigError(
                "the cascade is no brake of its own",
                where=", ".join(str(model.mapping) for model in one.models),
                expected=f"inputs {COMMAND} and, if it likes, {TAIL_VENT}; {CYLINDER} among the outputs",
                got=f"{', '.join(one.inputs)} -> {', '.join(one.outputs)}",
                remedy="give its models as parts: those that begin at the pipe stand on the reference's",
            )
    if len(cascades) not in {1, consist.pairs} or len({one.sample_time for one in cascades}) > 1:
        raise ConfigError(
            "the cascades do not fit the train",
            where="cascades",
            expected=f"one cascade, or {consist.pairs} with one sample time",
            got=len(cascades),
        )
