"""FMUs as references: both versions, and what is refused."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import sysid
from sysid.errors import ChannelError, ConfigError
from sysid.references.config import ReferenceConfig
from sysid.references.described import Wish
from sysid.references.fmu import FmuReference, read_fmu
from sysid.references.fmu_variables import check_variables
from sysid.references.proposal import proposed
from sysid.references.runs import Case, ReferenceRuns
from sysid.references.sources import source_of

pytest.importorskip("fmpy")


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model that we export ourselves: y[k] = 0.8 y[k-1] + 0.4 u[k] from a record without noise."""
    u = np.random.default_rng(0).standard_normal(200)
    y = np.zeros(200)
    for k in range(200):
        y[k] = 0.8 * y[k - 1] + 0.4 * u[k] if k else 0.4 * u[0]
    traces = sysid.data({"u": u, "y": y}, inputs="u", outputs="y", sample_time=0.1)
    fit = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=0))
    folder = tmp_path_factory.mktemp("fmu") / "bundle"
    fit.save(folder, formats=("fmi2", "fmi3"))
    return folder


def reference(file: Path, **fields: object) -> ReferenceConfig:
    given = {
        **{"fmu": str(file), "sample_time": 0.1, "inputs": {"u": {"range": [-5, 5]}}, "outputs": {"y": {}}},
        "constants": {"y_at_rest": 0.0},
        **fields,
    }
    return ReferenceConfig.model_validate(given).at(file.parent)


@pytest.mark.parametrize("version", [2, 3])
def test_an_fmu_gives_the_outputs_at_the_end_of_each_sample(bundle: Path, version: int, tmp_path: Path) -> None:
    (file,) = [one for one in bundle.rglob("*.fmu") if f"fmi{version}" in str(one) or f"fmu{version}" in str(one)]
    u = np.r_[0.0, 0.0, np.random.default_rng(1).standard_normal(40)]
    with ReferenceRuns(config=reference(file), folder=tmp_path, workers=1) as runs:
        (one,) = runs.run([Case(name="a", inputs=u[:, np.newaxis])])
    y = np.zeros(len(u))
    for k in range(1, len(u)):
        y[k] = 0.8 * y[k - 1] + 0.4 * u[k]
    assert one.reason is None
    assert one.trace is not None
    np.testing.assert_allclose(one.trace["y"], y, atol=1e-9)
    assert one.before["y"] == pytest.approx(0.0, abs=1e-9)
    assert one.cpu_s > 0.0


def test_a_parameter_may_set_a_variable_of_another_name(bundle: Path, tmp_path: Path) -> None:
    file, still = next(bundle.rglob("*.fmu")), np.zeros((3, 1))
    given = {"constants": {}, "parameters": {"from": {"range": [1, 2], "variable": "y_at_rest"}}}
    config = reference(file, **given)
    with ReferenceRuns(config=config, folder=tmp_path, workers=1) as runs:
        (one,) = runs.run([Case(name="a", inputs=still, parameters={"from": 2.0})])
    assert one.trace is not None
    np.testing.assert_allclose(one.trace["y"], 2.0 * 0.8 ** np.arange(1, 4), rtol=1e-9)
    np.testing.assert_array_equal(one.trace["from"], 2.0)
    wish = Wish(ranges={"u": (0, 1)}, parameters={"y": (1, 2)}, outputs=("y",), sample_time=0.1, duration=1.0)
    fields = proposed(source_of(str(file)), wish).content["reference"]
    assert fields["parameters"] == {"y_start": {"unit": "1", "range": [1, 2], "variable": "y"}}
    with pytest.raises(ValueError, match="names a variable"):
        reference(file, fmu=None, python="a:b", **given)


def test_ports_and_interfaces_that_are_not_there_are_named(bundle: Path) -> None:
    file = next(bundle.rglob("*.fmu"))
    with pytest.raises(ChannelError, match="missing channel z"):
        FmuReference(reference(file, outputs={"z": {}}))
    with pytest.raises(ConfigError, match="no interface for model-exchange"):
        FmuReference(reference(file, interface="model-exchange"))


def test_version_1_is_refused_in_words(tmp_path: Path) -> None:
    text = (
        '<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="1.0" modelName="a" modelIdentifier="a" '
        'guid="{0}" numberOfContinuousStates="0" numberOfEventIndicators="0"></fmiModelDescription>'
    )
    with zipfile.ZipFile(tmp_path / "old.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", text)
    with pytest.raises(ConfigError, match=r"of version 1\.0") as caught:
        read_fmu(tmp_path / "old.fmu")
    assert "FMI 2.0 or 3.0" in str(caught.value.remedy)


def test_a_file_that_is_no_fmu_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.fmu").write_bytes(b"not a zip")
    with pytest.raises(ConfigError, match="no FMU that can be read"):
        read_fmu(tmp_path / "a.fmu")


def rewritten(file: Path, place: Path, *changes: tuple[str, str]) -> Path:
    """An FMU whose model description is another one: patterns, and what stands in their place."""
    made = place / "other.fmu"
    with zipfile.ZipFile(file) as old, zipfile.ZipFile(made, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "modelDescription.xml":
                text = content.decode()
                for before, after in changes:
                    text, count = re.subn(before, after, text, flags=re.DOTALL)
                    assert count == 1
                content = text.encode()
            new.writestr(name, content)
    return made


@pytest.fixture(scope="module")
def second(bundle: Path) -> Path:
    """The file of version 2.0."""
    (file,) = [one for one in bundle.rglob("*.fmu") if "fmi2" in str(one) or "fmu2" in str(one)]
    return file


def last(config: ReferenceConfig, folder: Path, u: float, **parameters: float) -> float:
    """The output at the end of ten samples."""
    with ReferenceRuns(config=config, folder=folder, workers=1) as runs:
        (one,) = runs.run([Case(name="a", inputs=np.full((10, 1), u), parameters=parameters)])
    assert one.trace is not None, one.reason
    return float(one.trace[next(iter(config.outputs))][-1])


NAMED = ('name="u"', 'name="tank.u[1,2]"')
UNITS = (
    ("</CoSimulation>", '</CoSimulation><UnitDefinitions><Unit name="V"/><Unit name="m"/></UnitDefinitions>'),
    (r'(name="tank.*?<Real )', r'\1unit="V" '),
    (r'(name="y".*?<Real)/>', r'\1 unit="m"/>'),
)


@pytest.mark.parametrize(
    ("given", "taken", "scale"),
    [({}, {}, 1.0), ({"unit": "V"}, {"unit": "m"}, 1.0), ({"unit": "mV"}, {"unit": "cm"}, 0.1)],
)
def test_numbers_go_in_and_come_out_in_the_units_that_are_asked_for(
    second: Path, tmp_path: Path, given: dict[str, str], taken: dict[str, str], scale: float
) -> None:
    """The FMU says which units its own are: volts and metres; where nobody asks for others, these are taken."""
    expected = scale * last(reference(second), tmp_path, 2.0)
    file = rewritten(second, tmp_path, NAMED, *UNITS)
    config = reference(file, inputs={"tank.u[1,2]": {"range": [-5, 5], **given}}, outputs={"y": taken})
    assert last(config, tmp_path, 2.0) == pytest.approx(expected, rel=1e-12)


def test_a_unit_of_something_else_is_refused(second: Path, tmp_path: Path) -> None:
    file = rewritten(second, tmp_path, NAMED, *UNITS)
    with pytest.raises(ConfigError, match="y has another unit in the FMU") as caught:
        FmuReference(reference(file, inputs={"tank.u[1,2]": {"range": [-5, 5]}}, outputs={"y": {"unit": "kg"}}))
    assert "give it in m" in str(caught.value)


@pytest.mark.parametrize(
    ("port", "words"),
    [
        ({}, "no levels"),
        ({"levels": [0, 1.5]}, "levels \\[0.0, 1.5\\]"),
        ({"levels": [0, 2], "rate": 1.0}, "leave rate out"),
        ({"levels": [0, 2]}, None),
    ],
)
def test_a_whole_number_is_not_set_to_another_than_the_record_says(port: dict[str, object], words: str | None) -> None:
    variable = SimpleNamespace(type="Integer", causality="input", variability="discrete", unit=None)
    output = SimpleNamespace(type="Boolean", causality="output", variability="discrete", unit=None)
    config = reference(Path("a.fmu"), inputs={"u": {"range": [0, 3], **port}}, constants={})
    known = {"u": variable, "y": output}
    if words is None:
        check_variables(config, known, Path("a.fmu"))
        return
    with pytest.raises(ConfigError, match=words) as caught:
        check_variables(config, known, Path("a.fmu"))
    assert "levels: [0, 1, 2, 3]" in str(caught.value)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"inputs": {"y": {"range": [0, 1]}}, "outputs": {"u": {}}}, "y cannot be moved in a run"),
        ({"parameters": {"y": {"range": [0, 1]}}, "outputs": {"u": {}}, "inputs": {}}, "y cannot be set before a run"),
    ],
)
def test_what_an_importer_would_pass_over_is_refused(second: Path, fields: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        FmuReference(reference(second, **fields))


@pytest.mark.parametrize("version", [2, 3])
def test_a_surrogate_of_ours_proposes_what_it_is_declared_for_and_no_flags(bundle: Path, version: int) -> None:
    (file,) = [one for one in bundle.rglob("*.fmu") if f"fmi{version}" in str(one)]
    found = proposed(source_of(str(file)), Wish(ranges={}, parameters={}, duration=20.0))
    low, high = sysid.read_bundle(bundle).inputs[0]["range"]
    assert found.content["reference"]["inputs"]["u"]["range"] == [low, high]
    assert list(found.content["reference"]["outputs"]) == ["y"]
    assert "for which this surrogate is declared" in "; ".join(found.notes)
    assert "flags: left out" in "; ".join(found.notes)
    asked = proposed(source_of(str(file)), Wish(ranges={}, parameters={}, outputs=["flags"], duration=20.0))
    assert list(asked.content["reference"]["outputs"]) == ["flags"]


def variable(name: str, kind: str = "Real", **fields: object) -> SimpleNamespace:
    """As fmpy has it."""
    usual = {"causality": "input", "variability": "continuous", "min": None, "max": None, "start": None, "unit": None}
    return SimpleNamespace(name=name, type=kind, **{**usual, "declaredType": None, "initial": None, **fields})


OUTPUT = variable("y", causality="output")


def asked(
    monkeypatch: pytest.MonkeyPatch, *variables: SimpleNamespace, **wish: dict[str, tuple[float, float]]
) -> tuple:
    """What is proposed for an FMU of some variables, and what is told of it."""
    default = SimpleNamespace(startTime=None, stopTime="10", stepSize="0.1")
    described = SimpleNamespace(modelVariables=[*variables, OUTPUT], defaultExperiment=default)
    monkeypatch.setattr("sysid.references.described.read_fmu", lambda _: described)
    found = proposed(source_of("a.fmu"), Wish(**{"ranges": {}, "parameters": {}, **wish}))
    return found.content["reference"], "; ".join(found.notes)


def test_text_is_left_out_of_a_proposal_and_that_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    u, said = variable("u", min="0", max="2", start="1"), variable("label", "String", start="a")
    fields, told = asked(monkeypatch, u, said, variable("state", "String", causality="output"))
    assert (list(fields["inputs"]), list(fields["outputs"])) == (["u"], ["y"])
    assert "label: left out, as it is no number but String" in told
    assert "state: left out" in told


def test_limits_are_those_of_the_type_where_a_variable_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    kind = SimpleNamespace(min="-1", max="5", unit=None)
    fields, _ = asked(monkeypatch, variable("u", declaredType=kind), variable("v", declaredType=kind, max="3"))
    assert [fields["inputs"][name]["range"] for name in "uv"] == [[-1.0, 5.0], [-1.0, 3.0]]
    no_limit = SimpleNamespace(min="-1.8e308", max="1e60", unit=None)
    fields, told = asked(monkeypatch, variable("u", declaredType=no_limit))
    assert fields["inputs"]["u"]["range"] == [-1.0, 1.0]
    assert "u: -1 to 1 is a guess, as the model description says nothing of how far it goes; --range u=LOW:HIGH" in told


OPTION = SimpleNamespace(items=[SimpleNamespace(value=str(k)) for k in (1, 2, 4)], min=None, max=None, unit=None)


@pytest.mark.parametrize(
    ("kind", "said", "span", "why"),
    [
        ("Real", {"nominal": "50", "start": "20", "min": "0"}, [0, 70], "by its nominal value of 50 about its start"),
        ("Real", {"start": "293.15", "unit": "K"}, [283.15, 303.15], "10 K about its start"),
        ("Float64", {"start": "-4"}, [-8, 0], "by its start of -4"),
        ("Float64", {"start": "0", "max": "0.5"}, [-1, 0.5], "says nothing of how far it goes"),
        ("Int32", {"start": "0"}, [0, 1], "says nothing of how far it goes"),
        ("UInt8", {"start": "3"}, [0, 6], "by its start of 3"),
    ],
)
def test_a_range_that_nobody_says_is_guessed_and_told_to_be_a_guess(
    kind: str, said: dict[str, str], span: list[float], why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    fields, told = asked(monkeypatch, variable("u", kind, **said))
    assert fields["inputs"]["u"]["range"] == pytest.approx(span)
    assert "u: " in told
    assert " is a guess, " in told
    assert why in told
    assert "is a guess" not in asked(monkeypatch, variable("u", kind, **said), ranges={"u": (0.0, 1.0)})[1]


def test_named_values_are_no_guess_and_a_limit_at_the_start_leaves_none(monkeypatch: pytest.MonkeyPatch) -> None:
    fields, told = asked(monkeypatch, variable("u", "Enumeration", start="1", declaredType=OPTION))
    assert (fields["inputs"]["u"]["range"], fields["inputs"]["u"]["levels"]) == ([1, 4], [1, 2, 4])
    assert "guess" not in told
    with pytest.raises(ConfigError, match="does not say all"):
        asked(monkeypatch, variable("u", min="1", max="1", start="1"))


def test_a_start_that_cannot_be_is_told_and_that_of_a_truth_value_is_heeded(monkeypatch: pytest.MonkeyPatch) -> None:
    u, v = variable("u", start="7"), variable("open", "Boolean", start="true")
    fields, told = asked(monkeypatch, u, v, ranges={"u": (0.0, 2.0)})
    assert "start" not in fields["inputs"]["u"]
    assert "u: its start of 7 is not within 0 to 2" in told
    assert fields["inputs"]["open"]["start"] == 1.0


def test_values_beyond_what_the_description_allows_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    u = variable("u", min="0", max="5", start="0")
    mass = variable("mass", causality="parameter", variability="fixed", min="1")
    _, told = asked(monkeypatch, u, mass, ranges={"u": (-1.0, 2.0)}, parameters={"mass": (0.5, 2.0)})
    assert "u: -1 to 2 was asked for; the model description allows 0 to 5" in told
    assert "mass: 0.5 to 2 was asked for; the model description allows 1 to anything" in told
    assert "asked for" not in asked(monkeypatch, u, mass, parameters={"mass": (1.0, 2.0)})[1]


def test_what_is_tunable_may_move_and_a_range_of_another_thing_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    u = variable("u", min="0", max="5")
    gain = variable("gain", causality="parameter", variability="tunable", start="1")
    mass = variable("mass", causality="parameter", variability="fixed", start="1")
    fields, _ = asked(monkeypatch, u, gain, mass, ranges={"gain": (0.0, 2.0)}, parameters={"mass": (1.0, 2.0)})
    assert (list(fields["inputs"]), list(fields["parameters"])) == (["u", "gain"], ["mass"])
    for ranges, parameters, remedy in (
        ({"mass": (0.0, 1.0)}, {}, "say --parameter mass=LOW:HIGH"),
        ({"y": (0.0, 1.0)}, {}, "leave its --range out"),
        ({}, {"u": (0.0, 1.0)}, "say --range u=LOW:HIGH"),
    ):
        with pytest.raises(ConfigError, match="in a run") as caught:
            asked(monkeypatch, u, gain, mass, ranges=ranges, parameters=parameters)
        assert remedy in str(caught.value.remedy)
