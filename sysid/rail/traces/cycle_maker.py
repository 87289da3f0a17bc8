"""The maker of pipelines of kind ``drive-cycles``: drivers drive, and what they did with the handle is a data set."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from sysid.airbrake.consist import Consist
from sysid.airbrake.variant import USUAL_VARIANT
from sysid.code_digest import code_digest
from sysid.rail.dynamics.train import heavy_haul
from sysid.rail.traces.cycles import HabitSettings, command_of, drive_cycle, line_cycle
from sysid.rail.traces.stop_cycles import SAMPLE_TIME, stop_cycle

DRIVERS: Mapping[str, str] = {
    "habits": "a driver who holds a speed on a falling line by cycles of the air brake",
    "notches": "the same with the track card and the dynamic brake: notches first, air where they are not enough",
    "controller": "a deceleration controller that follows random speed commands",
}
"""Who may drive, and what they do."""


class CycleCase(BaseModel):
    """One trace to make.

    Args:
        name: Of the trace.
        role: What it is for.
        driver: One of :data:`DRIVERS`.
        seed: Of line, hand or commands.
        duration: In s.
        friction: Of the shoes of the controller's vehicle, 1 being nominal; other drivers have the train's own.
        grade: That it runs on, rise over run; other drivers have a line of their own.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    name: str = Field(min_length=1)
    role: Literal["estimation", "selection", "validation", "test"]
    driver: Literal["habits", "notches", "controller"]
    seed: int = Field(ge=0)
    duration: float = Field(default=900.0, ge=10.0, le=7200.0)
    friction: float = Field(default=1.0, ge=0.2, le=3.0)
    grade: float = Field(default=0.0, ge=-0.06, le=0.06)

    @model_validator(mode="after")
    def _of_the_controller(self) -> CycleCase:
        if self.driver != "controller" and (self.friction, self.grade) != (1.0, 0.0):
            raise ValueError(
                f"friction and grade are the controller's: {self.driver} has a line and a train of its own"
            )
        return self


class CycleOptions(BaseModel):
    """The train, what is recorded, and the traces.

    Args:
        pairs: Wagon pairs behind the locomotive.
        speed: That a driver holds on the falling line, in km/h.
        channels: Channels of the data set, as in a ``dataset.yaml``.
        quantities: What each channel is, as the generator ``abdx`` takes it.
        cases: Traces to make.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    pairs: int = Field(default=50, ge=1, le=200)
    speed: float = Field(default=50.0, gt=10.0, le=120.0)
    channels: tuple[dict[str, Any], ...] = Field(min_length=1)
    quantities: dict[str, Any]
    cases: tuple[CycleCase, ...] = Field(min_length=1)

    @field_validator("cases")
    @classmethod
    def _named(cls, cases: tuple[CycleCase, ...]) -> tuple[CycleCase, ...]:
        names = [case.name for case in cases]
        if len(set(names)) < len(names):
            raise ValueError(f"every case needs a name of its own: {', '.join(names)}")
        return cases


@dataclass(frozen=True, kw_only=True, eq=False)
class Step:
    """One trace.

    Args:
        name: Of the case.
        terms: JSON values that the command depends on.
        run: Drives; gives the command.
    """

    name: str
    terms: Mapping[str, Any]
    run: Callable[[], Any]


class CycleMaker:
    """Makes command vectors by letting somebody drive; the generator ``abdx`` makes pressures of them."""

    options: type[CycleOptions] = CycleOptions

    @property
    def version(self) -> str:
        """Digest of the code that a command depends on."""
        return code_digest(_Drive)

    def steps(self, options: CycleOptions) -> list[Step]:
        """One step for each trace.

        Args:
            options: Of the pipeline.

        Returns:
            The steps.
        """
        return [
            Step(
                name=case.name,
                terms={"pairs": options.pairs, "speed": options.speed, **case.model_dump(exclude={"name", "role"})},
                run=_Drive(options, case),
            )
            for case in options.cases
        ]

    def dataset(self, options: CycleOptions, results: Mapping[str, Any]) -> dict[str, Any]:
        """The data set: command vectors, and what makes pressures of them.

        Args:
            options: Of the pipeline.
            results: Commands by case.

        Returns:
            Fields of a ``dataset.yaml``.
        """
        who = dict.fromkeys(case.driver for case in options.cases)
        return {
            "sample_time": SAMPLE_TIME,
            "channels": [dict(channel) for channel in options.channels],
            "source": {
                "generator": "abdx",
                "options": {"variant": USUAL_VARIANT, "pairs": options.pairs, "quantities": dict(options.quantities)},
            },
            "cases": {case.name: {"role": case.role, "recipe": results[case.name]} for case in options.cases},
            "provenance": "The command vectors are what simulated drivers did with the handle: "
            + "; ".join(f"{name}, {DRIVERS[name]}" for name in who)
            + ". Drivers, train and lines are this project's own; the pressures are simulated from the commands by the "
            "reference physics.",
            "licence": "MIT; simulated by this project",
        }


MAKER = CycleMaker()
"""What the entry point ``drive-cycles`` names."""


@dataclass(frozen=True)
class _Drive:
    options: CycleOptions
    case: CycleCase

    def __call__(self) -> dict[str, Any]:
        command = command_of(self.handle(), SAMPLE_TIME)
        rows = [[time, pressure] for time, pressure in zip(command.times, command.pressures, strict=True)]
        return {"duration": self.case.duration, "command": rows}

    def handle(self) -> NDArray[np.float64]:
        """Psi gauge at each sample."""
        case = self.case
        if case.driver == "controller":
            return stop_cycle(case.seed, case.duration, friction=case.friction, grade=case.grade)
        train, consist = heavy_haul(pairs=self.options.pairs), Consist(pairs=self.options.pairs)
        habits = HabitSettings(target=self.options.speed / 3.6, running=consist.running_pressure)
        drive = drive_cycle if case.driver == "habits" else line_cycle
        return drive(train, consist, seed=case.seed, duration=case.duration, settings=habits).handle
