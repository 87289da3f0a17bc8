"""The judge of pipelines of kind ``consequence``: what models' errors do to a train, step by step.

A judge is found by its name among the installed packages (entry-point group ``sysid.judges``). It says what is to be
done as steps, each with the terms that its result depends on, and makes one document of their results: figures under
named keys, so that whoever runs the steps can keep them, and whoever shows them need not know what a train is.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, field_validator

from sysid.airbrake.consist import Consist
from sysid.airbrake.variant import USUAL_VARIANT, VARIANTS
from sysid.code_digest import code_digest
from sysid.content import content_folders
from sysid.errors import ConfigError, SysidError
from sysid.models import AbstractModel, Cascade, Interpolation
from sysid.rail.constants import KMH
from sysid.rail.dynamics.brake import ReferenceBrake
from sysid.rail.dynamics.drive import Run
from sysid.rail.dynamics.train import Train, read_train
from sysid.rail.judging.consequence_figures import consequence_document
from sysid.rail.judging.judge import MakeBrake, difference, error_sensitivity
from sysid.rail.judging.port import Part, brake_of
from sysid.rail.judging.scenario_catalogue import all_scenarios
from sysid.rail.judging.scenarios import Consequence, Scenario

POINTS = 240
"""Of a speed trace in a document."""


class ConsequenceOptions(BaseModel):
    """What is judged on which train.

    Args:
        train: A train of the data set ``rail-example`` by name, or a YAML file: one locomotive, then wagon pairs.
        speed: At the beginning of a stop in km/h.
        scenarios: Names; all of them if none is given.
        variant: Reading of the reference physics.
        limit: Relative consequence in percent that is asked for.
        errors: Sizes in psi of the artificial errors that show how large an error may be, rising.
        errors_in: Scenarios that these are tried in.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    train: str = "heavy-haul-101"
    speed: float = Field(default=80.0, gt=0.0, le=200.0)
    scenarios: tuple[str, ...] = ()
    variant: str = USUAL_VARIANT
    limit: float = Field(default=1.0, gt=0.0)
    errors: tuple[float, ...] = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
    errors_in: tuple[str, ...] = ("full service", "emergency")

    @field_validator("errors")
    @classmethod
    def _rising(cls, errors: tuple[float, ...]) -> tuple[float, ...]:
        if any(size <= 0.0 for size in errors) or list(errors) != sorted(set(errors)):
            raise ValueError("the errors have to be above 0 and rise")
        return errors

    @field_validator("variant")
    @classmethod
    def _known(cls, variant: str) -> str:
        if variant not in VARIANTS:
            raise ValueError(f"a variant is one of {', '.join(VARIANTS)}")
        return variant


class PartOptions(BaseModel):
    """What is said of one model of a brake.

    Args:
        node: Of the valve that it was fitted at; left out for a model that stands at every car.
        everywhere: Whether a whole from the handle on, which was made for one place, stands at every car all the same.
        beyond: Whether it is judged all the same where the handle or the pipe goes beyond the traces that fitted it.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    node: int | None = Field(default=None, ge=3)
    everywhere: bool = False
    beyond: bool = False


Given = tuple[AbstractModel | Cascade | Interpolation, Mapping[str, Any], Mapping[str, tuple[float, float]]]
"""A model, what was said of it, and the range of each of its inputs in the traces that it was fitted on."""

Subjects = Mapping[str, Sequence[Given]]
"""Models to judge, by the name of what they are together."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Step:
    """One thing to do.

    Args:
        name: For people; different for each step.
        terms: JSON values that the result depends on, beside the judge's version.
        run: Does it; gives JSON values.
    """

    name: str
    terms: Mapping[str, Any]
    run: Callable[[], Any]


class TrainJudge:
    """Runs the same scenarios with the reference brake and with each surrogate."""

    options: type[ConsequenceOptions] = ConsequenceOptions
    part_options: type[PartOptions] = PartOptions

    @property
    def version(self) -> str:
        """Digest of the code that a result depends on; the models are of any class."""
        return code_digest(_Judged, _Erring, brake_of, "sysid.models:model_from_dict", "sysid.models:cascade_from_dict")

    def steps(self, options: ConsequenceOptions, subjects: Subjects) -> list[Step]:
        """What is to be done.

        Args:
            options: Of the pipeline.
            subjects: Models to judge.

        Returns:
            Steps that do not depend on each other.

        Raises:
            ConfigError: If there is no such train or scenario, or the models of a subject add up to no brake.
        """
        scene = _Scene.of(options)
        steps = []
        for subject, models in subjects.items():
            parts = [Part(model=one, ranges=known, **PartOptions(**said).model_dump()) for one, said, known in models]
            make = brake_of(parts, scene.consist, scene.variant)
            what = [
                {"model": one.model.to_dict(), "node": one.node, "ranges": {} if one.beyond else dict(one.ranges)}
                for one in parts
            ]
            for name in scene.chosen:
                terms = {"scenario": name, "subject": what, **scene.terms}
                steps.append(Step(name=f"{subject}: {name}", terms=terms, run=_Judged(scene, name, make)))
        for biased in (True, False):
            for size in options.errors:
                name = f"{'bias' if biased else 'noise'} of {size:g} psi"
                terms = {"size": size, "biased": biased, "scenarios": list(options.errors_in), **scene.terms}
                steps.append(Step(name=name, terms=terms, run=_Erring(scene, options.errors_in, size, biased)))
        return steps

    def document(self, options: ConsequenceOptions, subjects: Subjects, results: Mapping[str, Any]) -> dict[str, Any]:
        """One document of all results.

        Args:
            options: Of the pipeline.
            subjects: Models that were judged.
            results: Of each step, by its name.

        Returns:
            JSON values: figures under named keys, as ``consequence_figures`` says.
        """
        scene = _Scene.of(options)
        judged = {subject: {name: results[f"{subject}: {name}"] for name in scene.chosen} for subject in subjects}
        sensitivities = {
            kind: [results[f"{kind} of {size:g} psi"] for size in options.errors] for kind in ("bias", "noise")
        }
        return consequence_document(
            train=scene.train.name, speed=options.speed, limit=options.limit, judged=judged, sensitivities=sensitivities
        )


JUDGE = TrainJudge()
"""What the entry point ``consequence`` names."""


class _Scene:
    """Train, brake and scenarios that all steps share; a reference run is made once."""

    def __init__(self, options: ConsequenceOptions, path: Path) -> None:
        self.train = read_train(path)
        self.consist = _consist(self.train, path)
        self.variant = VARIANTS[options.variant]
        self._scenarios = all_scenarios(self.train, speed=options.speed * KMH)
        self.chosen = options.scenarios or tuple(self._scenarios)
        self.terms = {
            "train": hashlib.sha256(path.read_bytes()).hexdigest(),
            "speed": options.speed,
            "variant": options.variant,
        }
        self._references: dict[str, Run] = {}
        for name in (*self.chosen, *options.errors_in):
            self.scenario(name)

    @classmethod
    def of(cls, options: ConsequenceOptions) -> _Scene:
        return cls(options, _train_file(options.train))

    def scenario(self, name: str) -> Scenario:
        if name not in self._scenarios:
            raise ConfigError.unknown(
                f"there is no scenario {name!r}",
                name,
                self._scenarios,
                "correct the name, or leave scenarios out for all of them",
                where="options, scenarios",
            )
        return self._scenarios[name]

    def brake(self) -> ReferenceBrake:
        return ReferenceBrake(consist=self.consist, variant=self.variant)

    def reference(self, name: str) -> Run:
        if name not in self._references:
            self._references[name] = self.scenario(name).run(self.brake())
        return self._references[name]


def _train_file(name: str) -> Path:
    if Path(name).is_file():
        return Path(name)
    known = {
        file.stem: file
        for folder in reversed(content_folders("datasets"))
        for file in sorted((folder / "rail-example").glob("heavy-haul*.yaml"))
    }
    if name not in known:
        raise ConfigError(
            f"there is no train {name}",
            where="options, train",
            expected=f"one of {', '.join(sorted(known))}, or a YAML file",
            got=name,
        )
    return known[name]


def _consist(train: Train, path: Path) -> Consist:
    braked = [vehicle.rigging is not None for vehicle in train.vehicles]
    pairs = (len(braked) - 1) // 2
    if braked != [False, *[True] * (2 * pairs)] or pairs == 0:
        raise ConfigError(
            "the train has another brake than the reference",
            where=path,
            expected="one vehicle without a brake, then pairs of vehicles with one",
            got=f"{len(braked)} vehicles, {sum(braked)} with a brake",
        )
    return Consist(pairs=pairs)


@dataclass(frozen=True)
class _Judged:
    scene: _Scene
    name: str
    make: MakeBrake

    def __call__(self) -> dict[str, Any]:
        scenario = self.scene.scenario(self.name)
        try:
            run = scenario.run(self.make())
        except SysidError as error:
            # A surrogate that cannot do what the scenario asks for is told of, and the others go on.
            return {"refused": str(error.what) + (f" ({error.remedy})" if error.remedy else "")}
        found = difference(scenario, self.scene.reference(self.name), run)
        return {
            **found.to_dict(),
            "speed_traces": {"reference": _speed(found.reference), "other": _speed(found.other)},
        }


def _speed(found: Consequence) -> dict[str, list[float]]:
    """The speed in km/h at a few hundred times."""
    rows = np.unique(np.linspace(0, len(found.clock) - 1, POINTS).round().astype(int))
    return {
        "time": np.round(found.clock[rows], 3).tolist(),
        "speed": np.round(found.speed[rows] / KMH, 4).tolist(),
    }


@dataclass(frozen=True)
class _Erring:
    scene: _Scene
    names: tuple[str, ...]
    size: float
    biased: bool

    def __call__(self) -> dict[str, Any]:
        chosen = {name: self.scene.scenario(name) for name in self.names}
        one = error_sensitivity(chosen, reference=self.scene.brake, size=self.size, biased=self.biased)
        return {
            "size_psi": one.size,
            "mse_psi2": one.mse,
            "distance": one.distance,
            "time": one.time,
            "force": one.force,
        }
