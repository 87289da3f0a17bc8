"""Designed experiments: within ranges, rates and levels, from the start, each on its own, and spread evenly."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from sysid.errors import ConfigError
from sysid.excitation import KINDS
from sysid.references.config import ReferenceConfig
from sysid.references.design import OWN, Counts, Design, designed, drawn

INPUTS = {
    "valve": {"unit": "1", "range": [0, 10], "rate": 4.0, "start": 2.0},
    "gear": {"range": [1, 4], "levels": [1, 2, 4]},
}
CONFIG = ReferenceConfig.model_validate(
    {
        **{"python": "a:b", "sample_time": 0.1, "inputs": INPUTS, "outputs": {"y": {}}},
        "parameters": {"mass": {"unit": "kg", "range": [1, 3]}, "gain": {"range": [-1, 1]}},
    }
)


@pytest.mark.parametrize("kind", [*KINDS, *OWN])
def test_every_signal_stays_within_range_rate_and_levels_and_begins_at_the_start(kind: str) -> None:
    design = Design.model_validate({"duration": 60.0, "excitations": [kind], "lead": 1.0})
    for case in designed(CONFIG, design)["estimation"]:
        valve, gear = case.inputs.T
        assert case.inputs.shape == (600, 2)
        assert (case.inputs[:10] == [2.0, 2.0]).all()
        assert valve.min() >= 0.0
        assert valve.max() <= 10.0
        assert np.abs(np.diff(valve)).max() <= 0.4 + 1e-12
        assert set(gear) <= {1.0, 2.0, 4.0}
        assert np.ptp(valve) > 0.0


@pytest.mark.parametrize(
    ("inputs", "experiment", "words"),
    [
        ({"levels": [2.0]}, {}, "u does not move"),
        ({"rate": 1e-9}, {}, "u does not move"),
        ({}, {"excitations": [{"kind": "events", "options": {"rest": [1e3, 2e3]}}]}, "u does not move"),
        ({}, {"duration": 0.1}, "too few samples"),
        ({}, {"duration": 1e9}, "too many samples"),
        ({}, {"hold": [100, 200]}, "nothing would move"),
        ({}, {"lead": 60}, "nothing would move"),
    ],
)
def test_experiments_in_which_nothing_happens_are_refused(
    inputs: dict[str, Any], experiment: dict[str, Any], words: str
) -> None:
    ports = {"inputs": {"u": {"range": [-10, 10], **inputs}}, "parameters": {}}
    config = ReferenceConfig.model_validate({**CONFIG.model_dump(exclude={"inputs", "parameters"}), **ports})
    with pytest.raises(ConfigError, match=words) as caught:
        designed(config, Design.model_validate({"duration": 60.0, **experiment}))
    assert caught.value.remedy


@pytest.mark.parametrize("kind", [*KINDS, *OWN])
def test_the_shortest_experiment_that_is_not_refused_can_be_drawn(kind: str) -> None:
    for case in designed(CONFIG, Design.model_validate({"duration": 2.0, "excitations": [kind]}))["test"]:
        assert case.inputs.shape == (20, 2)


def test_a_parameter_may_have_levels() -> None:
    port = {"teeth": {"range": [10, 20], "levels": [10, 14, 20]}}
    config = ReferenceConfig.model_validate({**CONFIG.model_dump(exclude={"parameters"}), "parameters": port})
    cases = drawn(config, Design(duration=5.0), 16, seed=(0, 0), prefix="N")
    assert {case.parameters["teeth"] for case in cases} == {10.0, 14.0, 20.0}
    with pytest.raises(ValidationError, match="outside the range"):
        ReferenceConfig.model_validate({**CONFIG.model_dump(), "parameters": {"n": {"range": [0, 1], "levels": [2]}}})


@pytest.mark.parametrize("sampling", ["sobol", "latin-hypercube"])
def test_parameters_fill_their_ranges_evenly(sampling: str) -> None:
    design = Design.model_validate({"duration": 5.0, "sampling": sampling})
    cases = drawn(CONFIG, design, 16, seed=(0, 0), prefix="N")
    for name, (low, high) in {"mass": (1.0, 3.0), "gain": (-1.0, 1.0)}.items():
        strips = np.floor(16 * (np.array([case.parameters[name] for case in cases]) - low) / (high - low))
        assert sorted(strips) == list(range(16))


def test_what_is_fitted_has_both_ends_of_each_parameter_and_what_judges_is_random() -> None:
    design = Design(duration=5.0, runs=Counts(estimation=8, selection=8, test=8))
    for role, cases in designed(CONFIG, design).items():
        for name, port in CONFIG.parameters.items():
            values = [case.parameters[name] for case in cases]
            assert ((min(values), max(values)) == pytest.approx(port.range)) is (role == "estimation")


def test_no_two_roles_share_an_experiment_and_a_seed_repeats_them_all() -> None:
    design = Design(duration=20.0, runs=Counts(estimation=6, selection=6, test=6))
    first, again = designed(CONFIG, design), designed(CONFIG, design)
    other = designed(CONFIG, design.model_copy(update={"seed": 1}))
    alike = [one.inputs.tobytes() for cases in first.values() for one in cases]
    assert alike == [one.inputs.tobytes() for cases in again.values() for one in cases]
    assert len({*alike, *(one.inputs.tobytes() for cases in other.values() for one in cases)}) == 36


@pytest.mark.parametrize(
    ("fields", "words"), [({"excitations": ["wobble"]}, "no such excitation"), ({"hold": [2, 1]}, "hold")]
)
def test_a_design_that_cannot_be_drawn_is_refused(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Design.model_validate({"duration": 5.0, **fields})


def test_whole_paths_are_those_of_the_yaml(tmp_path: Path) -> None:
    config = ReferenceConfig.model_validate({**CONFIG.model_dump(), "python": None, "fmu": "a.fmu", "folder": "models"})
    assert config.at(tmp_path).fmu == str(tmp_path / "models" / "a.fmu")
