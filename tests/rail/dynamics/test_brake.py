"""The brake as a port: the reference, a record and a surrogate for every car behind one interface."""

import dataclasses

import numpy as np
import pytest

from sysid.airbrake.command import Command
from sysid.airbrake.consist import Consist
from sysid.airbrake.machine import Probe
from sysid.airbrake.simulate import simulate
from sysid.airbrake.variant import USUAL
from sysid.errors import ConfigError
from sysid.models import ARX, NARX, AbstractModel, ARXModel, History, Mapping, NARXModel, Scaling, parameter_count
from sysid.rail.dynamics.brake import AbstractBrake, RecordedBrake, ReferenceBrake, valve_of_vehicle
from sysid.rail.dynamics.surrogate import ModelBank, Stage, SurrogateBrake, ValveSurrogateBrake
from sysid.rail.end_of_train.brake_computer import Order
from sysid.rail.end_of_train.tail_unit import TwoEndedBrake
from sysid.units import PSI_IN_PA

TRAIN = Consist(pairs=3)


def lag(mapping: str, gain: float, offset: float, pole: float, rest: float) -> ARXModel:
    """``y_t = pole y_{t-1} + (1 - pole) (offset + gain u_{t-1})``."""
    return ARXModel(
        orders=ARX(na=1, nb=(1,), nk=(1,)),
        coefficients=np.array([(1.0 - pole) * gain, pole]),
        intercept=(1.0 - pole) * offset,
        mapping=Mapping.parse(mapping),
        sample_time=0.1,
        input_units=("psi",),
        output_unit="psi",
        rest_output=rest,
    )


def pipe_models() -> Stage:
    return Stage(models=tuple(lag("STP -> BP", 1.0, 0.0, pole, 90.0) for pole in (0.9, 0.95, 0.97)))


def cylinder_models() -> Stage:
    return Stage(models=(lag("BP -> BC", -2.5, 225.0, 0.8, 0.0),))


def network(seed: int, inputs: str = "STP+BP") -> NARXModel:
    structure = NARX(input_delays="0:3", output_delays=3, neurons=4)
    mapping = Mapping.parse(f"{inputs} -> BC")
    lags = structure.lags(len(mapping.inputs))
    theta = np.random.default_rng(seed).normal(0.0, 0.2, parameter_count(lags, 4, linear=True))
    n = len(mapping.inputs)
    return NARXModel(
        network=structure,
        theta=theta,
        scaling=Scaling(
            input_offset=(70.0,) * n, input_scale=(15.0 + seed,) * n, output_offset=30.0, output_scale=32.0
        ),
        mapping=mapping,
        sample_time=0.1,
        input_units=("psi",) * n,
        output_unit="psi",
        rest_output=0.0,
    )


BRAKES = {
    "reference": lambda: ReferenceBrake(consist=TRAIN),
    "record": lambda: RecordedBrake(
        pressures=np.linspace(0.0, 4e5, 200)[:, None] * (np.arange(7) > 0), sample_time=0.1
    ),
    "surrogate": lambda: SurrogateBrake(stages=[pipe_models(), cylinder_models()], consist=TRAIN),
    "valves": lambda: ValveSurrogateBrake(stages=[Stage(models=(network(2, "BP+AR"),))], consist=TRAIN),
    "network": lambda: SurrogateBrake(stages=[pipe_models(), Stage(models=(network(1),))], consist=TRAIN),
}


@pytest.fixture(params=BRAKES.values(), ids=BRAKES.keys())
def made(request: pytest.FixtureRequest) -> tuple[AbstractBrake, AbstractBrake]:
    return request.param(), request.param()


# --- what every brake does


def test_every_vehicle_has_a_pressure_and_locomotives_none(made: tuple[AbstractBrake, AbstractBrake]) -> None:
    output = made[0].advance(np.full(50, 64.2))
    assert output.cylinders.shape == (50, 7)
    assert (output.cylinders[:, 0] == 0.0).all()
    assert (output.cylinders >= 0.0).all()
    assert np.isfinite(output.cylinders).all()


def test_chunks_make_the_whole(made: tuple[AbstractBrake, AbstractBrake]) -> None:
    command = np.repeat([90.0, 70.0, 90.0], [5, 60, 55])
    whole = made[0].advance(command).cylinders
    parts = [made[1].advance(part).cylinders for part in np.split(command, [1, 2, 3, 40, 90])]
    np.testing.assert_allclose(np.concatenate(parts), whole, rtol=1e-12, atol=1e-6)


def test_wagons_of_a_pair_share_a_cylinder(made: tuple[AbstractBrake, AbstractBrake]) -> None:
    cylinders = made[0].advance(np.full(50, 64.2)).cylinders
    np.testing.assert_array_equal(cylinders[:, 1::2], cylinders[:, 2::2])


# --- the reference


def test_the_reference_is_the_simulation_of_the_air_brake() -> None:
    command = Command.from_rows([[0, 90], [2, 64.2], [20, 64.2]])
    output = ReferenceBrake(consist=TRAIN).advance(command.sampled(sample_time=0.1))
    probes = [Probe(quantity="cylinder", node=5), Probe(quantity="pipe", node=7), Probe(quantity="pipe", node=1)]
    record = simulate(command, consist=TRAIN, variant=USUAL, probes=tuple(probes))
    np.testing.assert_array_equal(output.cylinders[:, 3], record["cylinder", 5] - 101_325.0)
    assert output.tail_pipe is not None
    assert output.equalising is not None
    np.testing.assert_array_equal(output.tail_pipe, record["pipe", 7] - 101_325.0)
    np.testing.assert_array_equal(output.equalising, record["pipe", 1] - 101_325.0)


def test_an_open_tail_applies_the_last_wagons_first() -> None:
    command = np.repeat([90.0, 0.0], [10, 90])
    consist = Consist(pairs=30)
    ends = ReferenceBrake(consist=consist).advance(command, tail_vent=np.repeat([0.0, 2e-4], [10, 90])).cylinders
    head = ReferenceBrake(consist=consist).advance(command).cylinders
    first = [np.flatnonzero(run[:, -1] > 1e5)[0] for run in (ends, head)]
    assert first[0] < first[1]


def test_valves_belong_to_the_wagons_ahead_of_their_node() -> None:
    assert valve_of_vehicle(Consist(pairs=3)).tolist() == [-1, 0, 0, 1, 1, 2, 2]


# --- the surrogate


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_bank_of_models_is_each_model_s_free_run(seed: int) -> None:
    models = tuple(network(k + 10 * seed) for k in range(3))
    bank = ModelBank(stage=Stage(models=models), cars=3, rest_inputs=(90.0, 90.0))
    inputs = np.random.default_rng(seed).uniform(60.0, 90.0, (40, 3, 2))
    outputs = bank.advance(inputs)
    for car, model in enumerate(models):
        alone = model.simulate(inputs[:, car], History.at_rest(inputs=[90.0, 90.0], output=0.0))
        np.testing.assert_allclose(outputs[:, car], alone, rtol=1e-12)


def test_a_bank_holds_outputs_between_the_limits_of_its_models() -> None:
    low, high = 18.0, 30.0
    model = dataclasses.replace(network(0), between=(low, high))
    inputs = np.random.default_rng(0).uniform(60.0, 90.0, (40, 1, 2))
    bank = ModelBank(stage=Stage(models=(model,)), cars=1, rest_inputs=(90.0, 90.0))
    outputs, alone = (
        bank.advance(inputs)[:, 0],
        model.simulate(inputs[:, 0], History.at_rest(inputs=[90.0, 90.0], output=0.0)),
    )
    assert {low, high} <= set(alone)
    np.testing.assert_allclose(outputs, alone, rtol=1e-12)


def test_a_chain_is_its_models_one_after_the_other() -> None:
    command = np.repeat([90.0, 74.0, 90.0], [5, 100, 95])
    brake = SurrogateBrake(stages=[pipe_models(), cylinder_models()], consist=TRAIN)
    output = brake.advance(command).cylinders
    for car, pole in enumerate((0.9, 0.95, 0.97)):
        pipe = lag("STP -> BP", 1.0, 0.0, pole, 90.0).simulate(
            command[:, None], History.at_rest(inputs=[90.0], output=90.0)
        )
        cylinder = lag("BP -> BC", -2.5, 225.0, 0.8, 0.0).simulate(
            pipe[:, None], History.at_rest(inputs=[90.0], output=0.0)
        )
        np.testing.assert_allclose(output[:, 1 + 2 * car], np.maximum(cylinder, 0.0) * PSI_IN_PA, atol=1e-6)


def test_surrogate_valves_are_their_model_on_the_reference_s_pressures() -> None:
    command = Command.from_rows([[0, 90], [2, 70], [20, 70]])
    model = network(3, "BP+AR")
    output = ValveSurrogateBrake(stages=[Stage(models=(model,))], consist=TRAIN).advance(
        command.sampled(sample_time=0.1)
    )
    probes = tuple(Probe(quantity=quantity, node=5) for quantity in ("pipe", "auxiliary"))
    inputs = (simulate(command, consist=TRAIN, variant=USUAL, probes=probes).pressures - 101_325.0) / PSI_IN_PA
    alone = model.simulate(inputs, History.at_rest(inputs=[90.0, 90.0], output=0.0))
    np.testing.assert_allclose(output.cylinders[:, 3], np.maximum(alone, 0.0) * PSI_IN_PA, rtol=1e-9, atol=1e-3)


def test_surrogate_valves_are_braked_from_both_ends_too() -> None:
    brake = TwoEndedBrake(ValveSurrogateBrake(stages=[Stage(models=(network(2, "BP+AR"),))], consist=TRAIN))
    brake.advance(np.repeat([90.0, 0.0], [5, 40]))
    assert brake.log[0][0].order is Order.EMERGENCY


@pytest.mark.parametrize("mapping", ["STP", "BP+AR+PS"])
def test_a_model_that_is_none_of_a_valve_is_refused(mapping: str) -> None:
    with pytest.raises(ConfigError, match="model of a valve"):
        ValveSurrogateBrake(stages=[Stage(models=(network(1, mapping),))], consist=TRAIN)


def test_a_surrogate_that_knows_no_open_tail_says_so() -> None:
    brake = SurrogateBrake(stages=[pipe_models(), cylinder_models()], consist=TRAIN)
    with pytest.raises(ConfigError, match="open tail"):
        brake.advance(np.full(3, 0.0), tail_vent=1e-4)


def test_a_surrogate_with_a_tail_input_is_given_it() -> None:
    model: AbstractModel = lag("TV -> BC", 1e5, 0.0, 0.5, 0.0)
    brake = SurrogateBrake(stages=[Stage(models=(model,))], consist=TRAIN)
    assert brake.advance(np.full(30, 90.0), tail_vent=2e-4).cylinders[-1, 1] == pytest.approx(20.0 * PSI_IN_PA)


@pytest.mark.parametrize(
    ("stages", "message"),
    [
        (lambda: [cylinder_models()], "nothing provides BP"),
        (lambda: [pipe_models()], "does not end in the brake cylinder"),
        (list, "does not end in the brake cylinder"),
        (lambda: [Stage(models=pipe_models().models[:2]), cylinder_models()], "does not fit the train"),
    ],
    ids=["missing input", "no cylinder", "nothing", "too few cars"],
)
def test_chains_that_cannot_work_are_refused(stages: object, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        SurrogateBrake(stages=stages(), consist=TRAIN)


def test_a_stage_of_unlike_models_is_refused() -> None:
    first = lag("STP -> BP", 1.0, 0.0, 0.9, 90.0)
    with pytest.raises(ConfigError, match="differ in more than their parameters"):
        Stage(models=(first, dataclasses.replace(first, sample_time=0.2)))


def test_a_record_of_nothing_is_refused() -> None:
    with pytest.raises(ConfigError, match="recorded pressures"):
        RecordedBrake(pressures=np.zeros((0, 3)), sample_time=0.1)
