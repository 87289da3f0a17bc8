"""Fitted models plug into a train by the channels that they speak of."""

from dataclasses import replace

import numpy as np
import pytest

from sysid.airbrake.consist import Consist
from sysid.airbrake.variant import VARIANTS
from sysid.errors import ConfigError
from sysid.models import ARX, ARXModel, Cascade, Interpolation, Limit, Mapping
from sysid.rail.dynamics.brake import ReferenceBrake
from sysid.rail.dynamics.cascade_brake import CascadeBrake, LineBrake
from sysid.rail.dynamics.surrogate import SurrogateBrake, ValveSurrogateBrake
from sysid.rail.end_of_train.tail_unit import TwoEndedBrake
from sysid.rail.judging.port import Part, brake_of, ordered, placed
from sysid.units import PSI_IN_PA

TRAIN = Consist(pairs=4)


def model(mapping: str, *, gain: float = 1.0, rest: float = 0.0, pole: float = 0.5) -> ARXModel:
    """Each input in equal parts, one sample of memory."""
    parsed = Mapping.parse(mapping)
    n = len(parsed.inputs)
    return ARXModel(
        orders=ARX(na=1, nb=(1,) * n, nk=(0,) * n),
        coefficients=np.array([*[(1.0 - pole) * gain / n] * n, pole]),
        intercept=(1.0 - pole) * (rest - gain * 90.0),
        mapping=parsed,
        sample_time=0.1,
        input_units=("psi",) * n,
        output_unit="psi",
        rest_output=rest,
    )


PIPE, RESERVOIR, CYLINDER = model("STP -> BP", rest=90.0), model("BP -> AR", rest=90.0), model("BP+AR -> BC", gain=-2.5)


def parts(*models: ARXModel) -> list[Part]:
    return [Part(model=one) for one in models]


@pytest.mark.parametrize(
    ("models", "kind"),
    [
        ((CYLINDER,), ValveSurrogateBrake),
        ((CYLINDER, RESERVOIR), ValveSurrogateBrake),
        ((CYLINDER, RESERVOIR, PIPE), SurrogateBrake),
        ((model("STP -> BC", gain=-2.5),), SurrogateBrake),
    ],
    ids=["a valve", "a valve and its reservoir", "the whole chain", "handle to cylinder"],
)
def test_models_from_the_pipe_on_stand_on_the_reference_s_pipe(models: tuple[ARXModel, ...], kind: type) -> None:
    brake = brake_of(parts(*models), TRAIN)()
    assert isinstance(brake, kind)
    output = brake.advance(np.repeat([90.0, 70.0], [20, 400]))
    assert output.cylinders[19].max() == pytest.approx(0.0, abs=1.0)
    np.testing.assert_allclose(output.cylinders[-1, 1:], 50.0 * PSI_IN_PA, rtol=0.02)


def test_an_order_is_found_whatever_the_order_they_come_in() -> None:
    groups = ordered(parts(CYLINDER, PIPE, RESERVOIR))
    assert [group[0].model.mapping.output for group in groups] == ["BP", "AR", "BC"]


def test_models_that_wait_for_each_other_are_refused() -> None:
    with pytest.raises(ConfigError, match="wait for each other"):
        ordered(parts(model("AR -> BP"), model("BP -> AR")))


def test_two_mappings_of_one_output_are_refused() -> None:
    with pytest.raises(ConfigError, match="two mappings give BC"):
        ordered(parts(CYLINDER, model("BP -> BC")))


def test_each_car_takes_the_model_that_was_fitted_nearest_to_it() -> None:
    front, rear = model("STP -> BP", pole=0.1), model("STP -> BP", pole=0.9)
    stage = placed([Part(model=rear, node=9), Part(model=front, node=3)], TRAIN)
    assert [one is rear for one in stage.models] == [False, False, True, True]


def test_several_models_that_do_not_say_where_they_stand_are_refused() -> None:
    with pytest.raises(ConfigError, match="which car is whose"):
        placed([Part(model=PIPE, node=3), Part(model=PIPE)], TRAIN)


def test_models_that_are_no_brake_are_refused() -> None:
    with pytest.raises(ConfigError, match="does not end in the brake cylinder"):
        brake_of(parts(PIPE), TRAIN)


def test_a_chain_from_the_handle_gives_what_a_two_way_device_reads() -> None:
    """A stage that knows the tail's vent is braked from both ends like the reference."""
    pipe = model("STP+TV -> BP", rest=90.0)
    brake = TwoEndedBrake(brake_of(parts(pipe, model("BP -> BC", gain=-2.5)), TRAIN)())
    brake.advance(np.repeat([90.0, 70.0, 90.0], [50, 200, 100]))
    assert brake.log


# --- whole assemblies


def whole(pole: float = 0.5) -> Cascade:
    models = (model("STP -> BP", rest=90.0, pole=pole), model("BP -> AR", rest=90.0), CYLINDER)
    return Cascade(models=models, limits={"BC": Limit(low=0.0, high=40.0)})


@pytest.mark.parametrize("pieces", [1, 7, 50, 400], ids=lambda n: f"in pieces of {n}")
def test_a_cascade_in_pieces_is_its_free_run(pieces: int) -> None:
    """Moves of the handle in and between the pieces: what was run ahead is thrown away where it does not hold."""
    handle = np.repeat([90.0, 80.0, 64.0, 90.0, 70.0], [33, 200, 30, 900, 37])
    brake = brake_of([Part(model=whole(), everywhere=True)], TRAIN)()
    assert isinstance(brake, CascadeBrake)
    parts = [brake.advance(handle[k : k + pieces]).cylinders for k in range(0, len(handle), pieces)]
    free = whole().simulate(handle[:, None])["BC"]
    np.testing.assert_array_equal(np.concatenate(parts)[:, 1:], np.repeat(free[:, None], 8, axis=1) * PSI_IN_PA)
    assert free.max() == 40.0


def test_each_car_takes_the_cascade_nearest_to_it() -> None:
    brake = brake_of([Part(model=whole(0.5), node=3), Part(model=whole(0.99), node=9)], TRAIN)()
    last = brake.advance(np.full(30, 80.0))
    assert last.cylinders[-1, 1] > 2.0 * last.cylinders[-1, -1]
    assert last.head_pipe is not None
    assert last.tail_pipe is not None
    assert last.head_pipe[-1] < last.tail_pipe[-1]


def test_a_cascade_from_the_pipe_on_stands_on_the_reference_s_pipe() -> None:
    valve = Cascade(models=(RESERVOIR, CYLINDER))
    assert isinstance(brake_of([Part(model=valve)], TRAIN)(), ValveSurrogateBrake)
    held = Cascade(models=(RESERVOIR, CYLINDER), limits={"BC": Limit(low=0.0)})
    with pytest.raises(ConfigError, match="limits"):
        brake_of([Part(model=held)], TRAIN)


def test_a_cascade_that_knows_no_open_tail_says_so() -> None:
    with pytest.raises(ConfigError, match="open tail"):
        brake_of([Part(model=whole(), everywhere=True)], TRAIN)().advance(np.full(3, 90.0), tail_vent=1e-4)


def test_a_cascade_beside_a_model_is_refused() -> None:
    with pytest.raises(ConfigError, match="beside single models"):
        brake_of([Part(model=whole(), node=3), Part(model=PIPE, node=9)], TRAIN)


def test_a_cascade_is_charged_whatever_the_handle_does_first() -> None:
    """A level that is the handle's first sample in a free run is the running pressure in a train."""
    charged = Cascade(
        models=(model("STP -> BP", rest=90.0, pole=0.9), model("BP -> BC", gain=-2.5)), rest={"BP": "STP"}
    )
    output = brake_of([Part(model=charged, everywhere=True)], TRAIN)().advance(np.full(3, 64.2))
    assert output.head_pipe is not None
    assert output.head_pipe[0] > 80.0 * PSI_IN_PA


def test_a_whole_that_was_made_for_one_place_is_refused_for_others() -> None:
    with pytest.raises(ConfigError, match="made for one place is asked for every car"):
        brake_of([Part(model=whole())], TRAIN)
    assert isinstance(brake_of([Part(model=whole())], Consist(pairs=1))(), CascadeBrake)


# --- what was fitted


def test_a_brake_stays_where_its_handle_was_fitted_or_is_run_because_it_is_meant() -> None:
    known = {"STP": (64.0, 90.0)}
    part = Part(model=whole(), everywhere=True, ranges=known)
    within, slightly, far = np.full(3, 64.0), np.full(3, 63.0), np.array([90.0, 70.0, 0.0])
    made = brake_of([part], TRAIN)
    plain = brake_of([Part(model=whole(), everywhere=True)], TRAIN)
    for command in (within, slightly):
        np.testing.assert_array_equal(made().advance(command).cylinders, plain().advance(command).cylinders)
    with pytest.raises(ConfigError, match=r"STP goes to 0 psi, and the traces that fitted it have 64 to 90"):
        made().advance(far)
    meant = brake_of([replace(part, beyond=True)], TRAIN)()
    np.testing.assert_array_equal(meant.advance(far).cylinders, plain().advance(far).cylinders)


def test_valves_on_the_reference_s_pipe_are_refused_where_it_leaves_what_fitted_them() -> None:
    made = brake_of([Part(model=CYLINDER, ranges={"BP": (64.0, 90.0)})], TRAIN)
    made().advance(np.full(100, 70.0))
    with pytest.raises(ConfigError, match="BP goes to"):
        made().advance(np.full(100, 0.0))


def test_all_parts_have_to_have_been_fitted_there() -> None:
    ranges = ({"BP": (64.0, 90.0)}, {"BP": (80.0, 95.0)})
    two = [Part(model=one, ranges=known) for one, known in zip((RESERVOIR, CYLINDER), ranges, strict=True)]
    with pytest.raises(ConfigError, match="80 to 90"):
        brake_of(two, TRAIN)().advance(np.full(300, 70.0))


def test_models_stand_on_the_pipe_of_the_physics_that_is_asked_for() -> None:
    command = np.full(60, 70.0)
    found = [brake_of(parts(CYLINDER), TRAIN, one)().advance(command).head_pipe for one in VARIANTS.values()]
    expected = [ReferenceBrake(consist=TRAIN, variant=one).advance(command).head_pipe for one in VARIANTS.values()]
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(
        found[list(VARIANTS).index("acoustic")], brake_of(parts(CYLINDER), TRAIN)().advance(command).head_pipe
    )


# --- lines


def line(last: float = 4.0) -> Interpolation:
    """A pipe that is quick at the first valve and slow at the last, and the same cylinder at each."""
    front = model("STP -> BP", rest=90.0, pole=0.5)
    rear = replace(model("STP -> BP", rest=90.0, pole=0.95), mapping=Mapping.parse("STP -> BP4"))
    return Interpolation(
        along=Cascade(models=(front, rear), rest={"BP": "STP", "BP4": "STP"}),
        knots={"BP": 1.0, "BP4": last},
        at_place=Cascade(
            models=(model("BP -> BC", gain=-2.5),),
        ),
        channel="BP",
    )


@pytest.mark.parametrize("pieces", [1, 50, 300], ids=lambda n: f"in pieces of {n}")
def test_a_line_gives_every_car_its_own_pressure(pieces: int) -> None:
    handle = np.repeat([90.0, 80.0, 64.0, 90.0], [20, 150, 30, 100])
    brake = brake_of([Part(model=line())], TRAIN)()
    assert isinstance(brake, LineBrake)
    outputs = [brake.advance(handle[k : k + pieces]) for k in range(0, len(handle), pieces)]
    cylinders = np.concatenate([one.cylinders for one in outputs]) / PSI_IN_PA
    run = line().simulate(handle[:, None], [1.0, 2.0, 3.0, 4.0])
    np.testing.assert_allclose(cylinders[:, 2::2], np.maximum(run["BC"], 0.0).T, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(cylinders[:, 1::2], cylinders[:, 2::2])
    assert cylinders[22, 2] > 2.0 * cylinders[22, 8] > 0.0
    tail = np.concatenate([one.tail_pipe for one in outputs if one.tail_pipe is not None]) / PSI_IN_PA
    np.testing.assert_allclose(tail, run["BP"][3], rtol=0.0, atol=1e-9)


def test_the_mean_of_lines_gives_every_car_the_mean_of_its_pressures() -> None:
    other = replace(line(), at_place=Cascade(models=(model("BP -> BC", gain=-1.0),)))
    handle = np.repeat([90.0, 80.0, 64.0, 90.0], [20, 150, 30, 100])
    runs = [
        brake_of([Part(model=one)], TRAIN)().advance(handle)
        for one in (line(), other, replace(line(), beside=(other,)))
    ]
    cylinders = [one.cylinders for one in runs]
    assert np.abs(cylinders[0] - cylinders[1]).max() > 1.0
    np.testing.assert_allclose(cylinders[2], (cylinders[0] + cylinders[1]) / 2.0, rtol=0.0, atol=1e-6)
    assert runs[2].tail_pipe is not None


def test_a_line_of_another_train_or_beside_other_models_is_refused() -> None:
    with pytest.raises(ConfigError, match="not one of this train's brakes"):
        brake_of([Part(model=line(9.0))], TRAIN)
    with pytest.raises(ConfigError, match="beside other models"):
        brake_of([Part(model=line()), Part(model=PIPE)], TRAIN)
