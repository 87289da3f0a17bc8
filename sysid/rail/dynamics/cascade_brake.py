"""Whole assemblies as a train's brake, from the driver's handle to the cylinders: cascades for places, or a line."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.airbrake.consist import Consist
from sysid.errors import ConfigError
from sysid.models import Cascade, Interpolation
from sysid.rail.dynamics.brake import AbstractBrake, BrakeOutput, Signal, valve_of_vehicle
from sysid.rail.dynamics.equalising import equalising_from_handle
from sysid.rail.dynamics.surrogate import COMMAND, CYLINDER, PIPE, TAIL_VENT
from sysid.units import PSI_IN_PA

AHEAD = 600
"""Samples that are run in advance with the inputs held; a handle is moved less often than that."""


class _FreeRunBrake(AbstractBrake):
    """A brake that is the free run of models from the handle on.

    A free run goes from rest to its end in one compiled pass. A brake is advanced in pieces, at the pace of a driver:
    so each pass goes on with the inputs held, its outputs are handed out as long as the inputs do stay, and a pass from
    the beginning follows when they have moved. What comes out is the free run, to the digit.
    """

    def __init__(self, *, sample_time: float, consist: Consist, vented: bool) -> None:
        self.sample_time, self.vehicles, self.consist = sample_time, consist.vehicles, consist
        self._vented = vented
        self._columns = valve_of_vehicle(consist)
        self._inputs = np.empty((0, 2))
        self._assumed = np.empty((0, 2))
        self._cylinders = np.empty((0, consist.pairs))
        self._ends: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
        self._equalising = consist.running_pressure

    @abstractmethod
    def _run(self, columns: Mapping[str, NDArray[np.float64]]) -> None:
        """Run from rest over inputs by name: cylinders of the valves, and where it is known the pipe's ends, in psi."""

    def advance(
        self,
        command: NDArray[np.float64],
        *,
        speed: Signal = 1.0,  # noqa: ARG002 - no surrogate reads it
        tail_vent: Signal = 0.0,
    ) -> BrakeOutput:
        """Advance; see :meth:`AbstractBrake.advance`."""
        vents = np.broadcast_to(np.asarray(tail_vent, dtype=np.float64), (len(command),))
        if np.any(vents > 0.0) and not self._vented:
            raise ConfigError(
                "this surrogate does not know an open tail",
                where="tail_vent",
                expected=f"models with the input {TAIL_VENT}, or a closed tail",
                got=float(np.max(vents)),
                remedy="fit on traces with a tail vent, or brake from the head only",
            )
        done = len(self._inputs)
        self._inputs = np.concatenate([self._inputs, np.column_stack([command, vents])])
        now = slice(done, len(self._inputs))
        if not np.array_equal(self._assumed[: len(self._inputs)], self._inputs):
            self._assumed = np.concatenate([self._inputs, np.repeat(self._inputs[-1:], AHEAD, axis=0)])
            self._run({COMMAND: self._assumed[:, 0], TAIL_VENT: self._assumed[:, 1]})
        spread = np.zeros((len(command), self.vehicles))
        braked = self._columns >= 0
        spread[:, braked] = np.maximum(self._cylinders[now], 0.0)[:, self._columns[braked]] * PSI_IN_PA
        if self._ends is None:
            return BrakeOutput(cylinders=spread)
        levels = equalising_from_handle(np.concatenate([[self._equalising], command]), self.sample_time)[1:]
        self._equalising = float(levels[-1])
        head, tail = self._ends
        return BrakeOutput(
            cylinders=spread,
            equalising=levels * PSI_IN_PA,
            head_pipe=head[now] * PSI_IN_PA,
            tail_pipe=tail[now] * PSI_IN_PA,
        )


class CascadeBrake(_FreeRunBrake):
    """Cascades from the handle (``STP``), and the tail vent (``TV``) where they know it, to the cylinder (``BC``).

    Cars with one cascade have one run: they differ in nothing that a cascade reads.

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
        vented = all(TAIL_VENT in one.inputs for one in self._distinct)
        super().__init__(sample_time=cars[0].sample_time, consist=consist, vented=vented)

    def _run(self, columns: Mapping[str, NDArray[np.float64]]) -> None:
        runs = []
        for one in self._distinct:
            # At rest the handle is in its running position, whatever its first sample is, and so is what rests with it.
            followers = [name for name, level in one.rest.items() if level == COMMAND]
            rest = dict.fromkeys([COMMAND, *followers], self.consist.running_pressure)
            runs.append(one.simulate(np.column_stack([columns[name] for name in one.inputs]), rest=rest))
        self._cylinders = np.column_stack([runs[k][CYLINDER] for k in self._of_car])
        if PIPE in self._distinct[0].outputs:
            self._ends = (runs[self._of_car[0]][PIPE], runs[self._of_car[-1]][PIPE])


class LineBrake(_FreeRunBrake):
    """A line from the handle (``STP``) to the cylinder (``BC``): every valve at its own position, numbered from 1.

    Args:
        line: What an assembly with ``interpolation`` leaves.
        consist: The train.

    Raises:
        ConfigError: If the line reads or gives other channels, or its knots are not the ends of this train.
    """

    def __init__(self, *, line: Interpolation, consist: Consist) -> None:
        first, *_, last = line.knots.values()
        fits = set(line.inputs) == {COMMAND} and CYLINDER in line.outputs
        if not fits or (first, last) != (1.0, float(consist.pairs)):
            raise ConfigError(
                "the line is not one of this train's brakes",
                where="line",
                expected=f"{COMMAND} in, {CYLINDER} among what is had at valves 1 to {consist.pairs}",
                got=f"{', '.join(line.inputs)} -> {', '.join(line.outputs)} at positions {first:g} to {last:g}",
                remedy="judge it on a train of the length that it was made for",
            )
        self._line = line
        super().__init__(sample_time=line.sample_time, consist=consist, vented=False)

    def _run(self, columns: Mapping[str, NDArray[np.float64]]) -> None:
        # One sample at the running pressure comes before the first: a line rests at its first sample.
        handle = np.concatenate([[self.consist.running_pressure], columns[COMMAND]])
        run = self._line.simulate(handle[:, None], np.arange(1.0, self.consist.pairs + 1.0))
        self._cylinders = run[CYLINDER][:, 1:].T
        if self._line.channel in run.inputs:
            field = run[self._line.channel][:, 1:]
            self._ends = (field[0], field[-1])


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
