"""The FMUs in an importer that is not ours: valid, equal to the model, with a state that can be stored."""

from __future__ import annotations

import re
import subprocess
import zipfile

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

from sysid.errors import ConfigError
from sysid.export import EXPORTERS, Flag, Surrogate, expected_flags
from sysid.export.fmi.fmu import HEADERS, fmu_variables
from sysid.export.fmi.platforms import own_platform
from sysid.export.fmi.units import unit_definitions
from sysid.export.heeded import heeded
from tests.export.grey_boxes import build_grey
from tests.export.test_state_space import MODELS

VERSIONS = {"fmi2": FMU2Slave, "fmi3": FMU3Slave}


@pytest.fixture(
    scope="module", params=["a model", "a cascade", "a cascade with limits and levels", "some outputs of it"]
)
def surrogate(request, models, declared, cascade, limited):
    if request.param in ("a cascade with limits and levels", "some outputs of it"):
        return Surrogate.of(limited, {"STP": (0.0, 80.0)}, outputs=["ER", "BC"] if "some" in request.param else None)
    return declared(models["NARX 4/4/20"]()) if request.param == "a model" else cascade


def at_rest(surrogate, first):
    """Every output before the first sample."""
    return surrogate.levels(np.asarray(first, dtype=float))[list(surrogate.columns)]


@pytest.fixture(scope="module", params=VERSIONS)
def fmu(request, surrogate, tmp_path_factory):
    folder = tmp_path_factory.mktemp("fmu")
    (file,) = EXPORTERS[request.param].write(surrogate, folder)
    return folder / file.name


@pytest.fixture
def slave(fmu, tmp_path):
    """An instance after its initialisation, with its inputs at 50."""
    description = fmpy.read_model_description(fmu)
    (kind,) = [kind for name, kind in VERSIONS.items() if name in fmu.name]
    one = kind(
        guid=description.guid,
        unzipDirectory=fmpy.extract(fmu, tmp_path / "x"),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="one",
    )
    one.instantiate()
    variables = {variable.name: variable.valueReference for variable in description.modelVariables}
    one.references = variables
    one.inputs = [v.valueReference for v in description.modelVariables if v.causality == "input"]
    one.outputs = [
        v.valueReference for v in description.modelVariables if v.causality == "output" and v.name != "flags"
    ]
    one.set = one.setReal if "fmi2" in fmu.name else one.setFloat64
    one.get = one.getReal if "fmi2" in fmu.name else one.getFloat64
    one.flags = lambda: (one.getInteger if "fmi2" in fmu.name else one.getInt32)([variables["flags"]])[0]
    initialise(one)
    yield one
    one.terminate()
    one.freeInstance()


def initialise(one):
    if isinstance(one, FMU2Slave):
        one.setupExperiment(startTime=0.0)
    one.enterInitializationMode()
    one.set(one.inputs, [50.0] * len(one.inputs))
    one.exitInitializationMode()


def walk(one, u, first=0):
    """Steps of 0.1 s, one a row."""
    rows, flags = [], []
    for i, row in enumerate(u):
        one.set(one.inputs, row.tolist())
        one.doStep(currentCommunicationPoint=0.1 * (first + i), communicationStepSize=0.1)
        rows.append(one.get(one.outputs))
        flags.append(one.flags())
    return np.array(rows), np.array(flags)


def test_validation_finds_nothing(fmu):
    assert validate_fmu(str(fmu)) == []


def test_a_simulation_by_fmpy_equals_the_model_with_the_offset_of_one_step(fmu, surrogate, inputs):
    u, names = inputs(500, len(surrogate.inputs)), [port.name for port in surrogate.inputs]
    table = np.zeros(len(u), dtype=[("time", float), *((name, float) for name in names)])
    table["time"] = 0.1 * np.arange(len(u))
    for column, name in zip(u.T, names, strict=True):
        table[name] = column
    start = dict(zip(names, u[0].tolist(), strict=True))
    result = fmpy.simulate_fmu(
        str(fmu),
        stop_time=0.1 * len(u),
        output_interval=0.1,
        input=table,
        start_values=start,
        set_input_derivatives=False,
    )
    found = np.column_stack([result[port.name] for port in surrogate.outputs])
    expected = surrogate.simulate(u)
    stands = np.where(heeded(surrogate), at_rest(surrogate, u[0]), expected[0])
    np.testing.assert_allclose(found[0], stands, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(found[1:], expected, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(result["flags"][1:], expected_flags(surrogate, u, surrogate.compute(u)))


@pytest.mark.parametrize("format_name", VERSIONS)
def test_what_stands_where_the_inputs_say_is_shown_there_from_the_beginning(format_name, tmp_path):
    """Its declared level is passed over by the states: it would be left with a jump at the first step."""
    surrogate = Surrogate.of(build_grey("dx/dt = (BP - x)/2\nBC = x + 0.1*AR"), {"BP": (0.0, 80.0), "AR": (0.0, 80.0)})
    (file,) = EXPORTERS[format_name].write(surrogate, tmp_path)
    names, u = [port.name for port in surrogate.inputs], np.array([45.0, 30.0])
    found = fmpy.simulate_fmu(
        str(tmp_path / file.name), stop_time=0.5, output_interval=0.1, start_values=dict(zip(names, u, strict=True))
    )
    assert heeded(surrogate) == (False,)
    np.testing.assert_allclose(found["BC"], np.full(6, 48.0), rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("format_name", VERSIONS)
def test_what_integrates_begins_at_its_output_at_rest(format_name, tmp_path):
    """It had begun at 0, whatever the model's level was."""
    surrogate = Surrogate.of(MODELS["a sum"](), {"BP": (0.0, 100.0), "AR": (0.0, 100.0)})
    (file,) = EXPORTERS[format_name].write(surrogate, tmp_path)
    names, u = [port.name for port in surrogate.inputs], np.array([80.0, 70.0])
    found = fmpy.simulate_fmu(
        str(tmp_path / file.name), stop_time=2.0, output_interval=0.1, start_values=dict(zip(names, u, strict=True))
    )
    expected = surrogate.simulate(np.tile(u, (20, 1)))
    np.testing.assert_allclose(found["BC"][1:], expected[:, 0], rtol=0.0, atol=1e-9)


def test_description_has_units_start_values_and_meaning(fmu, surrogate):
    description = fmpy.read_model_description(fmu)
    variables = {variable.name: variable for variable in description.modelVariables}
    for port in surrogate.inputs:
        assert (variables[port.name].unit, float(variables[port.name].start)) == ("psi", port.start)
    for port, says in zip(surrogate.outputs, heeded(surrogate), strict=True):
        assert variables[port.name].unit == "psi"
        if isinstance(port.level, str):  # it begins where an input does
            assert f"{port.name}_at_rest" not in variables
            assert f"begins at {port.level}" in variables[port.name].description
        elif not says:  # the run would be the same
            assert f"{port.name}_at_rest" not in variables
        else:
            assert float(variables[f"{port.name}_at_rest"].start) == port.level
    (unit,) = description.unitDefinitions
    base = unit.baseUnit
    assert (unit.name, base.kg, base.m, base.s) == ("psi", 1, -1, -2)
    assert base.factor == pytest.approx(6894.757, rel=1e-6)
    assert float(description.defaultExperiment.stepSize) == 0.1
    assert "1: an input is outside its declared range" in variables["flags"].description


def test_what_it_cannot_is_said_and_refused(fmu, slave):
    """An output hangs on no input of the same moment: what a step gave stays until the next one."""
    description = fmpy.read_model_description(fmu)
    assert {one.dependencies is not None and len(one.dependencies) for one in description.outputs} == {0}
    fmi2 = isinstance(slave, FMU2Slave)
    with zipfile.ZipFile(fmu) as archive:
        text = archive.read("modelDescription.xml").decode()
    claims = re.findall(r'(provides\w+)="(\w+)"', text)
    names = (
        ["providesDirectionalDerivative"] if fmi2 else ["providesDirectionalDerivatives", "providesAdjointDerivatives"]
    )
    assert claims == [(name, "false") for name in names]
    with pytest.raises(FMICallException):
        slave.getDirectionalDerivative(slave.outputs[:1], slave.inputs[:1], [1.0])
    before = slave.get(slave.outputs)
    slave.set(slave.inputs, [1.0] * len(slave.inputs))
    assert list(slave.get(slave.outputs)) == list(before)


def test_state_can_be_kept_set_stored_and_read(slave, surrogate, inputs):
    u = inputs(60, len(surrogate.inputs))
    fmi2 = isinstance(slave, FMU2Slave)
    walk(slave, u[:20])
    kept = slave.getFMUstate() if fmi2 else slave.getFMUState()
    stored = slave.serializeFMUstate(kept) if fmi2 else slave.serializeFMUState(kept)
    (slave.freeFMUstate if fmi2 else slave.freeFMUState)(kept)
    once, _ = walk(slave, u[20:], first=20)
    again = slave.deSerializeFMUstate(stored) if fmi2 else slave.deserializeFMUState(stored)
    (slave.setFMUstate if fmi2 else slave.setFMUState)(again)
    (slave.freeFMUstate if fmi2 else slave.freeFMUState)(again)
    np.testing.assert_array_equal(walk(slave, u[20:], first=20)[0], once)


@pytest.mark.parametrize("damage", ["cut", "of another model", "empty"])
def test_bytes_that_are_no_state_are_refused(slave, damage):
    fmi2 = isinstance(slave, FMU2Slave)
    kept = slave.getFMUstate() if fmi2 else slave.getFMUState()
    stored = slave.serializeFMUstate(kept) if fmi2 else slave.serializeFMUState(kept)
    (slave.freeFMUstate if fmi2 else slave.freeFMUState)(kept)
    bad = {"cut": stored[:-8], "of another model": b"\x00" * 8 + stored[8:], "empty": b"\x00"}[damage]
    with pytest.raises(fmpy.fmi1.FMICallException):
        (slave.deSerializeFMUstate if fmi2 else slave.deserializeFMUState)(bad)


def test_not_a_number_is_flagged_and_forgotten_on_reset(slave, surrogate, inputs):
    u = inputs(30, len(surrogate.inputs))
    clean, flags = walk(slave, u)
    lost = u.copy()
    lost[3, 0] = np.nan
    slave.reset()
    initialise(slave)
    found, raised = walk(slave, lost)
    assert raised[3] & Flag.NOT_A_NUMBER
    assert np.isnan(found[-1]).any()
    slave.reset()
    initialise(slave)
    again, same = walk(slave, u)
    np.testing.assert_array_equal(again, clean)
    np.testing.assert_array_equal(same, flags)


def test_outside_the_declared_range_it_answers_and_says_so(slave, surrogate):
    high = surrogate.inputs[0].high
    values = np.full((2, len(surrogate.inputs)), 50.0)
    values[1, 0] = np.nextafter(high, np.inf)
    found, raised = walk(slave, values)
    assert np.isfinite(found).all()
    assert [bool(flag & Flag.OUTSIDE_RANGE) for flag in raised] == [False, True]


def test_a_step_of_several_samples_holds_the_inputs(slave, surrogate):
    slave.set(slave.inputs, [60.0] * len(surrogate.inputs))
    slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=0.5)
    long = slave.get(slave.outputs)
    slave.reset()
    initialise(slave)
    short, _ = walk(slave, np.full((5, len(surrogate.inputs)), 60.0))
    np.testing.assert_array_equal(long, short[-1])


@pytest.mark.parametrize("step", [0.05, 0.15, 0.0, -0.1, float("nan")])
def test_a_step_that_is_not_whole_samples_is_refused(slave, step):
    with pytest.raises(fmpy.fmi1.FMICallException):
        slave.doStep(currentCommunicationPoint=0.0, communicationStepSize=step)


@pytest.mark.parametrize("at", [0.2, 0.0, -0.1, 0.15, 1e6, float("nan")])
def test_a_step_from_where_the_last_one_did_not_end_is_refused_with_a_word_and_changes_nothing(slave, at, capfd):
    """It had gone on from the state of another time, and said that it was there."""
    walk(slave, np.full((1, len(slave.inputs)), 60.0))
    before = slave.get(slave.outputs)
    with pytest.raises(FMICallException):
        slave.doStep(currentCommunicationPoint=at, communicationStepSize=0.1)
    assert f"a step from {at:.9g} s, though the last one ended at 0.1 s" in capfd.readouterr().out.replace(
        "-nan", "nan"
    )
    assert slave.get(slave.outputs) == before
    walk(slave, np.full((1, len(slave.inputs)), 60.0), first=1)  # it goes on from there


def test_one_may_go_back_to_where_a_state_was_kept_and_add_up_time_with_rounding(slave):
    fmi2 = isinstance(slave, FMU2Slave)
    kept = slave.getFMUstate() if fmi2 else slave.getFMUState()
    once, time = [], 0.0
    for _ in range(50):
        slave.doStep(currentCommunicationPoint=time, communicationStepSize=0.1)
        once.append(slave.get(slave.outputs))
        time += 0.1 + 1e-7  # of a master whose clock is not exact
    (slave.setFMUstate if fmi2 else slave.setFMUState)(kept)
    (slave.freeFMUstate if fmi2 else slave.freeFMUState)(kept)
    again, _ = walk(slave, np.full((50, len(slave.inputs)), 50.0))
    np.testing.assert_array_equal(again, once)


def resting(slave, surrogate):
    """The last output whose level at rest can be set, and the parameter that does."""
    there = [k for k, port in enumerate(surrogate.outputs) if f"{port.name}_at_rest" in slave.references]
    return there[-1], slave.references[f"{surrogate.outputs[there[-1]].name}_at_rest"]


def test_outputs_cannot_be_set_nor_rest_values_after_the_start(slave, surrogate):
    _, rest = resting(slave, surrogate)
    for reference in (slave.outputs[0], rest, 999):
        with pytest.raises(fmpy.fmi1.FMICallException):
            slave.set([reference], [1.0])


def test_a_value_at_rest_set_before_the_start_is_where_the_run_begins(slave, surrogate):
    at, rest = resting(slave, surrogate)
    slave.reset()
    slave.set([rest], [12.5])
    initialise(slave)
    assert slave.get([slave.outputs[at]]) == [12.5]
    u = np.full((3, len(surrogate.inputs)), 50.0)
    changed = at_rest(surrogate, u[0])
    changed[at] = 12.5
    np.testing.assert_allclose(walk(slave, u)[0], surrogate.simulate(u, rest_outputs=changed), rtol=0.0, atol=1e-9)
    assert not np.array_equal(surrogate.simulate(u, rest_outputs=changed), surrogate.simulate(u)), "it says something"


def test_its_sources_compile_on_their_own_without_a_warning(fmu, tmp_path):
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(tmp_path, [name for name in archive.namelist() if name.startswith("sources/")])
    sources = sorted(path.name for path in (tmp_path / "sources").glob("*.c"))
    command = ["gcc", "-std=c99", "-O2", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror", "-c", *sources]
    subprocess.run(command, cwd=tmp_path / "sources", check=True)


def test_headers_are_the_standards_own():
    from pathlib import Path

    import sysid.export

    ours, theirs = Path(sysid.export.__file__).parent / "fmi_headers", Path(fmpy.__file__).parent / "c-code"
    for names in HEADERS.values():
        for name in names:
            assert (ours / name).read_bytes() == (theirs / name).read_bytes()


def test_names_that_would_meet_are_kept_apart(models, declared):
    from dataclasses import replace

    from sysid.export import Surrogate
    from sysid.models import Mapping

    model = replace(models["NARX 4/4/20"](), mapping=Mapping(inputs=("flags", "time"), output="flags_"))
    names = [row["name"] for row in fmu_variables(Surrogate.of(model))]
    assert names == ["flags", "time", "flags_", "flags__at_rest", "flags__"]


@pytest.mark.parametrize("format_name", VERSIONS)
def test_names_and_units_of_any_kind_validate(format_name, models, tmp_path):
    from dataclasses import replace

    from sysid.export import Surrogate
    from sysid.models import Mapping

    model = replace(
        models["NARX 4/4/20"](),
        mapping=Mapping(inputs=('a<b & "c"', "time"), output="Δp"),
        input_units=("degC", "1"),
        output_unit="kPa",
    )
    (file,) = EXPORTERS[format_name].write(Surrogate.of(model), tmp_path)
    assert validate_fmu(str(tmp_path / file.name)) == []


@pytest.mark.parametrize(
    ("unit", "base"),
    [
        ("psi", {"kg": "1", "m": "-1", "s": "-2", "factor": "6894.75729316836"}),
        ("bar", {"kg": "1", "m": "-1", "s": "-2", "factor": "100000.0"}),
        ("V", {"kg": "1", "m": "2", "s": "-3", "A": "-1", "factor": "1.0"}),
        ("degC", {"K": "1", "factor": "1.0", "offset": "273.15"}),
        ("m/s", {"m": "1", "s": "-1", "factor": "1.0"}),
        ("bit", None),
    ],
)
def test_units_in_the_words_of_fmi(unit, base):
    assert unit_definitions([unit, unit]) == [{"name": unit, "base": base}]


def test_a_machine_without_a_name_in_the_standard_is_told(monkeypatch):
    monkeypatch.setattr("platform.machine", lambda: "sparc")
    with pytest.raises(ConfigError, match=r"(?s)no name for this kind of machine.*sparc"):
        own_platform(2)
