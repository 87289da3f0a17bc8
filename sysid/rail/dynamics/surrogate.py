"""A surrogate for every car: fitted models, chained output to input, advanced together with their states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.airbrake.consist import Consist
from sysid.airbrake.machine import BrakedTrain, Probe
from sysid.airbrake.variant import USUAL, Variant
from sysid.errors import ConfigError
from sysid.kernels.cascade_plan import planned
from sysid.models import AbstractModel, Ends, Recursion, Wiring
from sysid.models.lagged.lagged_form import side_by_side, walk
from sysid.rail.dynamics.brake import AbstractBrake, BrakeOutput, Signal, valve_of_vehicle
from sysid.rail.dynamics.equalising import equalising_from_handle
from sysid.units import PSI_IN_PA, STANDARD_ATMOSPHERE_PA

COMMAND, TAIL_VENT, SPEED, PIPE, CYLINDER = "STP", "TV", "V", "BP", "BC"
"""Channels that the train provides (psi gauge, m2, m/s), the pipe, and the one that the train wants (psi gauge)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Stage:
    """Models of one mapping, one per car, or one for all.

    Args:
        models: All with the same mapping, lags and neurons; parameters and scaling may differ.

    Raises:
        ConfigError: If they do not go together.
    """

    models: tuple[AbstractModel, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "models", tuple(self.models))
        kinds = set()
        for model, form in zip(self.models, self.forms, strict=True):
            kinds.add((model.mapping, model.sample_time, form.lags, form.neurons, len(form.theta)))
        if len(kinds) != 1:
            raise ConfigError(
                "the models of a stage differ in more than their parameters",
                where="stage",
                expected="one mapping, one sample time, the same lags and neurons for every car",
                got=f"{len(kinds)} kinds of model among {len(self.models)}",
                remedy="fit the cars with one structure",
            )

    @property
    def forms(self) -> tuple[Recursion, ...]:
        """What the models lower to: recursions over lagged regressors (:class:`ConfigError` for any other form)."""
        forms = tuple(model.recursion for model in self.models)
        found = tuple(form for form in forms if isinstance(form, Recursion))
        if len(found) < len(forms):
            raise ConfigError(
                "a model of the stage is no recursion over lagged regressors",
                where=f"stage {self.models[0].mapping}",
                expected="ARX or NARX models",
                got=", ".join(sorted({type(form).__name__ for form in forms})),
                remedy="fit the cars with ARX or NARX structures",
            )
        return found


class ModelBank:
    """One stage for all cars: a whole of models that do not read each other, run in one pass.

    Args:
        stage: The models.
        cars: Number of cars; a single model is used for each.
        rest_inputs: Value of each input at rest, in its unit.

    Raises:
        ConfigError: If the number of models does not fit.
    """

    def __init__(self, *, stage: Stage, cars: int, rest_inputs: Sequence[float]) -> None:
        models = stage.models * cars if len(stage.models) == 1 else stage.models
        if len(models) != cars:
            raise ConfigError(
                "the stage does not fit the train",
                where=str(models[0].mapping),
                expected=f"one model, or {cars}: one per car",
                got=len(models),
            )
        self.mapping = models[0].mapping
        recursions = stage.forms * cars if len(stage.forms) == 1 else stage.forms
        self._n_inputs, depth = recursions[0].n_inputs, recursions[0].lags.depth
        limits = [recursion.between for recursion in recursions]
        self._planned = planned(side_by_side([recursion.columns for recursion in recursions], self._n_inputs, limits))
        rest = [*np.tile(np.asarray(rest_inputs, dtype=np.float64), cars), *(model.rest_output for model in models)]
        self._past = np.tile(np.array(rest), (depth, 1))

    def advance(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Advance every car.

        Args:
            inputs: In their units, shape ``(n_samples, n_cars, n_inputs)``.

        Returns:
            Outputs in their unit, shape ``(n_samples, n_cars)``.
        """
        samples, depth, cars = len(inputs), len(self._past), inputs.shape[1]
        room = np.concatenate([self._past, np.zeros((samples, self._past.shape[1]))])
        room[depth:, :-cars] = inputs.reshape(samples, -1)
        walk(self._planned, room, depth)
        self._past = room[samples:].copy()
        return np.ascontiguousarray(room[depth:, -cars:])


class SurrogateBrake(AbstractBrake):
    """A chain of fitted stages for every valve of a train: ``STP -> BP``, ``BP -> AR``, ``BP+AR -> BC`` or shorter.

    An input is the command (``STP``), the tail vent (``TV``), the speed (``V``) or the output of another stage. One
    stage gives ``BC``, in psi gauge, as the data sets have it. Where a stage gives ``BP``, the first and the last
    valve's are the pipe at the head and at the tail, and the equalising reservoir follows the handle as in the
    reference, so that a two-way end-of-train device can read them.

    Args:
        stages: In any order; their wiring finds the one in which they run.
        consist: The train: which vehicles hang on which valve.
        rest: Value of every channel at rest, in its unit; those of stages are the rest values of their models.

    Raises:
        ConfigError: If the stages cannot be wired, a channel comes from nowhere or none gives ``BC``.
    """

    def __init__(self, *, stages: Sequence[Stage], consist: Consist, rest: Mapping[str, float] | None = None) -> None:
        known: dict[str, float] = {COMMAND: consist.running_pressure, TAIL_VENT: 0.0, SPEED: 1.0, **(rest or {})}
        models = [stage.models[0] for stage in stages]
        if CYLINDER not in [model.mapping.output for model in models]:
            raise ConfigError(
                "the chain does not end in the brake cylinder",
                where="stages",
                expected=f"a stage with the output {CYLINDER}",
                got=[str(model.mapping) for model in models],
            )
        wiring = Wiring.of(models)
        if any(wiring.feeds_back(Ends.of(model)) for model in models):
            raise ConfigError(
                "the stages read each other in a circle",
                where="stages",
                expected="stages of which each reads the train's channels and outputs of other stages before it",
                got=[str(model.mapping) for model in models],
            )
        missing = [name for name in wiring.inputs if name not in known]
        if missing:
            raise ConfigError(
                f"nothing provides {', '.join(missing)}",
                where=f"stages {', '.join(str(model.mapping) for model in models)}",
                expected=f"inputs among {', '.join(known)}, or outputs of other stages",
                got=", ".join(wiring.inputs),
                remedy="add the stage that provides it",
            )
        self._banks: list[ModelBank] = []
        for i in wiring.order:
            rest_inputs = [known[name] for name in models[i].mapping.inputs]
            self._banks.append(ModelBank(stage=stages[i], cars=consist.pairs, rest_inputs=rest_inputs))
            known[models[i].mapping.output] = models[i].rest_output
        self.sample_time, self.vehicles, self.consist = stages[0].models[0].sample_time, consist.vehicles, consist
        self._columns = valve_of_vehicle(consist)
        self._equalising = consist.running_pressure
        self._knows_tail = any(TAIL_VENT in stage.models[0].mapping.inputs for stage in stages)

    def advance(self, command: NDArray[np.float64], *, speed: Signal = 1.0, tail_vent: Signal = 0.0) -> BrakeOutput:
        """Advance; see :meth:`AbstractBrake.advance`."""
        if not self._knows_tail and np.any(np.asarray(tail_vent) > 0.0):
            raise ConfigError(
                "this surrogate does not know an open tail",
                where="tail_vent",
                expected=f"a stage with the input {TAIL_VENT}, or a closed tail",
                got=float(np.max(tail_vent)),
                remedy="fit on traces with a tail vent, or brake from the head only",
            )
        samples, cars = len(command), self.consist.pairs
        given = {COMMAND: command, TAIL_VENT: tail_vent, SPEED: speed}
        signals: dict[str, NDArray[np.float64]] = {
            name: np.broadcast_to(
                np.broadcast_to(np.asarray(value, dtype=np.float64), (samples,))[:, None], (samples, cars)
            )
            for name, value in given.items()
        }
        cylinders = _cylinders(self._banks, signals, self._columns)
        if PIPE not in signals:
            return BrakeOutput(cylinders=cylinders)
        pipe = signals[PIPE] * PSI_IN_PA
        return BrakeOutput(
            cylinders=cylinders, equalising=self._equalise(command), head_pipe=pipe[:, 0], tail_pipe=pipe[:, -1]
        )

    def _equalise(self, command: NDArray[np.float64]) -> NDArray[np.float64]:
        """The equalising reservoir, which the next chunk goes on from."""
        levels = equalising_from_handle(
            np.concatenate([[self._equalising], np.asarray(command, dtype=np.float64)]), self.sample_time
        )
        self._equalising = float(levels[-1])
        return levels[1:] * PSI_IN_PA


def _cylinders(
    banks: Sequence[ModelBank], signals: dict[str, NDArray[np.float64]], columns: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Run a chain over its signals; pressures of the cylinders in Pa gauge, one column per vehicle."""
    for bank in banks:
        inputs = np.stack([signals[name] for name in bank.mapping.inputs], axis=-1)
        signals[bank.mapping.output] = bank.advance(inputs)
    last = signals[CYLINDER]
    cylinders = np.zeros((len(last), len(columns)))
    # A model may swing a little below the atmosphere, a cylinder cannot.
    cylinders[:, columns >= 0] = np.maximum(last, 0.0)[:, columns[columns >= 0]] * PSI_IN_PA
    return cylinders


VALVE_CHANNELS = {"BP": "pipe", "AR": "auxiliary", "ER": "emergency"}
"""Channels that the reference pipe gives at every valve, in psi gauge."""


class ValveSurrogateBrake(AbstractBrake):
    """Surrogate valves on the reference pipe: each car's own pressures go into models that give its cylinder.

    The way is one: the pipe, and a reservoir that no stage gives, are the reference's, emptied by its valves. So the
    error of the valve's models is seen alone, at every car.

    Args:
        stages: In order; the last gives ``BC``, the others a reservoir. Inputs are ``BP``, ``AR`` and ``ER``, the
            reference's or an earlier stage's. One model for all cars or one per car in each.
        consist: The train.
        variant: The reading of the reference.
        time_step: Of the reference in s.

    Raises:
        ConfigError: If a stage takes or gives another channel.
    """

    def __init__(
        self, *, stages: Sequence[Stage], consist: Consist, variant: Variant = USUAL, time_step: float = 1e-3
    ) -> None:
        _check_valve(stages)
        sample_time = stages[0].models[0].sample_time
        self.sample_time, self.vehicles, self.consist = sample_time, consist.vehicles, consist
        known: dict[str, float] = {}
        self._banks, self._measured = [], []
        for stage in stages:
            mapping = stage.models[0].mapping
            for name in mapping.inputs:
                if name not in known:
                    known[name] = consist.running_pressure
                    self._measured.append(name)
            rest = [known[name] for name in mapping.inputs]
            self._banks.append(ModelBank(stage=stage, cars=consist.pairs, rest_inputs=rest))
            known[mapping.output] = stage.models[0].rest_output
        nodes = [
            Probe(quantity=VALVE_CHANNELS[name], node=node) for name in self._measured for node in consist.valve_nodes
        ]
        ends = [Probe(quantity="pipe", node=node) for node in (1, 2, consist.vehicles)]
        self._train = BrakedTrain(
            consist=consist,
            variant=variant,
            probes=(*nodes, *ends),
            time_step=time_step,
            sample_time=sample_time,
        )
        self._columns = valve_of_vehicle(consist)

    def advance(self, command: NDArray[np.float64], *, speed: Signal = 1.0, tail_vent: Signal = 0.0) -> BrakeOutput:
        """Advance; see :meth:`AbstractBrake.advance`."""
        pressures = self._train.advance(command, speed=speed, tail_vent=tail_vent) - STANDARD_ATMOSPHERE_PA
        pairs, names = self.consist.pairs, self._measured
        signals = {name: pressures[:, k * pairs : (k + 1) * pairs] / PSI_IN_PA for k, name in enumerate(names)}
        equalising, head, tail = pressures[:, len(names) * pairs :].T
        return BrakeOutput(
            cylinders=_cylinders(self._banks, signals, self._columns),
            equalising=equalising,
            head_pipe=head,
            tail_pipe=tail,
        )


def _check_valve(stages: Sequence[Stage]) -> None:
    mappings = [stage.models[0].mapping for stage in stages]
    reservoirs = set(VALVE_CHANNELS) - {PIPE}
    good = bool(mappings) and mappings[-1].output == CYLINDER
    good = good and all(set(mapping.inputs) <= set(VALVE_CHANNELS) for mapping in mappings)
    if not good or not all(mapping.output in reservoirs for mapping in mappings[:-1]):
        raise ConfigError(
            "not a model of a valve",
            where=", ".join(str(mapping) for mapping in mappings) or "no stage",
            expected=f"inputs among {', '.join(VALVE_CHANNELS)}, reservoirs and in the end {CYLINDER} as outputs",
            got=[str(mapping) for mapping in mappings],
        )
