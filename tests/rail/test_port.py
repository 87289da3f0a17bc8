"""Fitted models plug into a train by the channels that they speak of."""

import numpy as np
import pytest

from sysid.airbrake.consist import Consist
from sysid.errors import ConfigError
from sysid.models import ARX, ARXModel, Mapping
from sysid.rail.port import Part, brake_of, ordered, placed
from sysid.rail.surrogate import SurrogateBrake, ValveSurrogateBrake
from sysid.rail.tail_unit import TwoEndedBrake
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
