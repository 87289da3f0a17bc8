"""The judge of trains: steps that do not depend on each other, and one document of their results."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from sysid.errors import ConfigError
from sysid.models import ARX, ARXModel, Mapping
from sysid.rail.dynamics.train import heavy_haul
from sysid.rail.judging.consequence import JUDGE, ConsequenceOptions
from sysid.rail.judging.consequence_figures import consequence_document
from sysid.rail.judging.scenario_catalogue import all_scenarios

TRAIN = """\
name: three pairs
vehicles:
  - {name: locomotive, mass: 180000, length: 9.83, axles: 6, brake: none, power: {}}
  - {count: 6, mass: 120000, length: 9.83}
"""


@pytest.fixture
def train(tmp_path: Path) -> str:
    file = tmp_path / "train.yaml"
    file.write_text(TRAIN, encoding="utf-8")
    return str(file)


def handle_to_cylinder() -> ARXModel:
    """A brake of its own that follows the handle in some ten seconds and knows no open tail."""
    return ARXModel(
        orders=ARX(na=1, nb=(1,), nk=(1,)),
        coefficients=np.array([-2.5 * 0.01, 0.99]),
        intercept=225.0 * 0.01,
        mapping=Mapping.parse("STP -> BC"),
        sample_time=0.1,
        input_units=("psi",),
        output_unit="psi",
        rest_output=0.0,
    )


def options(train: str, **changes: object) -> ConsequenceOptions:
    given = {"train": train, "scenarios": ("full service", "emergency, both ends"), "errors": (0.1, 3.0)}
    return ConsequenceOptions(**{**given, "errors_in": ("full service",), **changes})


SUBJECTS = {"simple": [(handle_to_cylinder(), {}, {})]}


def test_a_judgement_of_a_simple_brake(train: str) -> None:
    chosen = options(train)
    results = {step.name: json.loads(json.dumps(step.run())) for step in JUDGE.steps(chosen, SUBJECTS)}
    stop, ends = results["simple: full service"], results["simple: emergency, both ends"]
    assert abs(stop["distance_percent"]) < 10.0
    assert stop["mse_psi2"] > 0.0
    assert stop["reference"]["stopped"]
    assert stop["other"]["stopped"]
    # What it cannot do is told, with the reason, and stands in no figure.
    assert "pipe pressures" in ends["refused"]
    assert results["bias of 0.1 psi"]["distance"] < results["bias of 3 psi"]["distance"]
    document = JUDGE.document(chosen, SUBJECTS, results)
    assert document["headline_scenes"] == ["full service"]
    assert document["scenes"] == ["full service", "emergency, both ends"]
    found = document["subjects"]["simple"]
    assert found["full service"]["differences"]["distance_percent"] == stop["distance_percent"]
    assert found["full service"]["differences"]["cylinder_mse"] == stop["mse_psi2"]
    assert found["full service"]["differences"]["speed_kmh"] == pytest.approx(3.6 * stop["speed_m_s"])
    assert found["full service"]["measures"]["distance_m"] == stop["other"]["distance_m"]
    assert document["reference"]["full service"]["measures"]["distance_m"] == stop["reference"]["distance_m"]
    assert found["emergency, both ends"] == {"refused": ends["refused"]}
    assert list(document["reference"]) == ["full service"]
    (bias, noise) = document["sensitivity"]
    assert [step["size"] for step in bias["steps"]] == [0.1, 3.0]
    assert bias["steps"][0]["differences"]["distance_percent"] == 100.0 * results["bias of 0.1 psi"]["distance"]
    assert [one["quantity"] for one in noise["tolerances"]] == document["limited"]
    # Every key says what it is, with its unit.
    told = {*found["full service"]["differences"], *found["full service"]["measures"], "speed"}
    assert told == set(document["quantities"])
    assert all(one["name"] and one["meaning"] for one in document["quantities"].values())


@pytest.mark.parametrize(("said", "answers"), [({}, False), ({"beyond": True}, True)])
def test_a_handle_beyond_what_was_fitted_is_told_of_and_run_only_if_that_is_meant(
    train: str, said: dict[str, bool], answers: bool
) -> None:
    subjects = {"service": [(handle_to_cylinder(), said, {"STP": (64.2, 90.0)})]}
    steps = JUDGE.steps(options(train, scenarios=("full service", "emergency")), subjects)
    found = {step.name: step.run() for step in steps[:2]}
    assert "refused" not in found["service: full service"]
    assert ("refused" not in found["service: emergency"]) is answers
    if not answers:
        assert "STP goes to 0 psi" in found["service: emergency"]["refused"]
        assert "64.2 to 90" in found["service: emergency"]["refused"]
    terms = [steps[0].terms, JUDGE.steps(options(train, scenarios=("full service", "emergency")), SUBJECTS)[0].terms]
    assert (terms[0] == terms[1]) is answers


@pytest.mark.parametrize(
    ("consequences", "reached", "error"),
    [((2.0, 3.0), "passed", None), ((0.1, 0.2), "within", None), ((0.1, 10.0), "crossed", 10.0)],
)
def test_how_large_an_error_may_be_is_told_apart(consequences: tuple[float, ...], reached: str, error: float) -> None:
    rows = [
        {"size_psi": size, "mse_psi2": size**2, "distance": percent / 100.0, "time": 0.0, "force": 0.0}
        for size, percent in zip((1.0, 10.0), consequences, strict=True)
    ]
    document = consequence_document(train="t", speed=80.0, limit=1.0, judged={}, sensitivities={"bias": rows})
    found = {one["quantity"]: one for one in document["sensitivity"][0]["tolerances"]}
    assert found["distance_percent"]["reached"] == reached
    assert found["time_percent"]["reached"] == "within"
    if error is None:
        assert math.isnan(found["distance_percent"]["error"])
    else:
        assert found["distance_percent"]["error"] == pytest.approx(error)


def test_the_reference_against_itself_would_be_nothing(train: str) -> None:
    """Terms tell subjects, scenes and errors apart, and nothing else."""
    steps = JUDGE.steps(options(train), SUBJECTS)
    terms = [json.dumps(step.terms, sort_keys=True) for step in steps]
    assert len(set(terms)) == len(steps)
    again = [
        json.dumps(s.terms, sort_keys=True) for s in JUDGE.steps(options(train), {"other name": SUBJECTS["simple"]})
    ]
    assert again == terms
    faster = [json.dumps(s.terms, sort_keys=True) for s in JUDGE.steps(options(train, speed=90.0), SUBJECTS)]
    assert not set(faster) & set(terms)


def test_all_that_the_report_asks_for_is_in_the_catalogue() -> None:
    names = set(all_scenarios(heavy_haul(pairs=1)))
    wanted = {"full service", "emergency", "release and reapply", "crest, full service", "sag, full service"}
    wanted |= {"curve, full service", "full service, both ends", "emergency, both ends", "driver on a falling line"}
    assert wanted <= names


def test_a_scenario_that_is_not_there_is_named(train: str) -> None:
    with pytest.raises(ConfigError, match="no scenario 'full stop'"):
        JUDGE.steps(options(train, scenarios=("full stop",)), SUBJECTS)


def test_a_train_that_is_not_there_is_named() -> None:
    with pytest.raises(ConfigError, match="no train express"):
        JUDGE.steps(ConsequenceOptions(train="express"), SUBJECTS)


def test_a_train_with_another_brake_than_the_reference_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "train.yaml"
    file.write_text(TRAIN.replace("count: 6", "count: 5"), encoding="utf-8")
    with pytest.raises(ConfigError, match="another brake"):
        JUDGE.steps(options(str(file)), SUBJECTS)


@pytest.mark.parametrize("wrong", [{"errors": (1.0, 0.5)}, {"variant": "guess"}, {"speed": 0.0}, {"trian": "x"}])
def test_impossible_options_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        ConsequenceOptions(**wrong)
