"""Runs of a reference: what fails is a case with a reason, and what has been run is not run again."""

from __future__ import annotations

import importlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.references.config import ReferenceConfig
from sysid.references.runs import Case, Outcome, ReferenceRuns
from tests.references import slow_models

HERE = Path(__file__).parent
REASONS = {
    "hangs": "it was not done after 0.5 s, its time limit",
    "crashes": "it ended its process by signal SIGABRT",
    "leaves_numbers": "y is nan at 10 s",
    "rubbish": "it gave no numbers but str",
    "raises": "it raised ValueError: valve jammed",
}
CASES = [Case(name=name, inputs=np.full((30, 1), level)) for name, level in (("a", 0.5), ("bad", 1.5), ("c", 0.7))]


def reference(function: str, **fields: Any) -> ReferenceConfig:
    given = {
        **{"python": f"slow_models:{function}", "sample_time": 0.5, "time_limit": 30.0},
        **{"inputs": {"u": {"unit": "V", "range": [0, 2]}}, "outputs": {"y": {"unit": "mm"}}},
        **fields,
    }
    return ReferenceConfig.model_validate(given).at(HERE)


def run(config: ReferenceConfig, folder: Path, cases: list[Case]) -> list[Outcome]:
    with ReferenceRuns(config=config, folder=folder, workers=1) as runs:
        return runs.run(cases)


@pytest.mark.parametrize("function", REASONS)
def test_a_run_that_fails_is_a_case_with_a_reason_and_the_study_goes_on(function: str, tmp_path: Path) -> None:
    config = reference(function, **({"time_limit": 0.5} if function == "hangs" else {}))
    first, bad, last = run(config, tmp_path, CASES)
    assert bad.reason == REASONS[function]
    assert bad.trace is None
    for one in (first, last):
        assert one.reason is None
        assert one.trace is not None
        np.testing.assert_array_equal(one.trace["y"], one.case.inputs[:, 0])


def test_what_has_been_run_is_found_whether_it_gave_a_record_or_not(tmp_path: Path) -> None:
    config = reference("raises")
    made = run(config, tmp_path, CASES)
    again = run(config, tmp_path, [Case(name=f"again-{one.name}", inputs=one.inputs) for one in CASES])
    assert [one.stored for one in made + again] == [False] * 3 + [True] * 3
    assert [one.reason for one in again] == [one.reason for one in made]
    assert again[0].trace is not None
    assert made[0].trace is not None
    assert again[0].trace.name == "again-a"
    np.testing.assert_array_equal(again[0].trace.values, made[0].trace.values)


def test_other_inputs_parameters_or_code_are_other_runs(tmp_path: Path) -> None:
    config = reference("first_order", parameters={"tau": {"unit": "s", "range": [1, 5]}})
    case = Case(name="a", inputs=np.full((5, 1), 0.5), parameters={"tau": 2.0})
    others = [
        Case(name="a", inputs=np.full((5, 1), 0.6), parameters={"tau": 2.0}),
        Case(name="a", inputs=np.full((5, 1), 0.5), parameters={"tau": 2.1}),
    ]
    with ReferenceRuns(config=config, folder=tmp_path) as runs:
        keys = {runs.key(one) for one in [case, *others]}
    with ReferenceRuns(config=reference("counted", parameters=config.parameters), folder=tmp_path) as runs:
        keys.add(runs.key(case))
    assert len(keys) == 4


def test_settling_comes_before_the_record_and_the_outputs_before_its_first_sample_are_known(tmp_path: Path) -> None:
    case = Case(name="a", inputs=np.r_[np.full(3, 1.0), np.full(5, 2.0)][:, np.newaxis])
    for settling, before in ((0.0, 1.0), (4.0, 1.0)):
        config = reference("first_order", settling=settling, inputs={"u": {"range": [0, 2], "start": 1}})
        (one,) = run(config, tmp_path, [case])
        assert one.trace is not None
        assert len(one.trace) == 8
        assert one.before == {"y": before}


def test_a_function_that_is_not_there_is_said_before_anything_runs(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot be imported") as caught:
        run(reference("no_such"), tmp_path, CASES)
    assert "no_such" in str(caught.value)


KILLED = """
import json, sys
from pathlib import Path
import numpy as np
from sysid.references.config import ReferenceConfig
from sysid.references.runs import Case, ReferenceRuns
config = ReferenceConfig.model_validate_json(sys.argv[1])
cases = [Case(name=f"c{k}", inputs=np.full((4, 1), 0.01 * k)) for k in range(30)]
with ReferenceRuns(config=config, folder=Path(sys.argv[2]), workers=1) as runs:
    print(sum(one.reason is None for one in runs.run(cases)))
"""


def test_a_study_that_was_killed_goes_on_and_runs_nothing_twice(tmp_path: Path) -> None:
    """But the one run that was under way when it was killed, which nobody has finished."""
    log = tmp_path / "count"
    log.touch()
    environment = {**os.environ, "SYSID_TEST_COUNT": str(log)}
    command = [sys.executable, "-c", KILLED, reference("counted").model_dump_json(), str(tmp_path / "kept")]
    kills = 10
    for _ in range(kills):
        begun = len(log.read_text().splitlines())
        study = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE)
        while len(log.read_text().splitlines()) < begun + 2:
            time.sleep(0.01)
        study.send_signal(signal.SIGKILL)
        study.communicate()
        time.sleep(0.2)  # the run that was under way has gone with it
    assert subprocess.run(command, env=environment, capture_output=True, check=True).stdout.split() == [b"30"]
    ran = log.read_text().splitlines()
    assert len(set(ran)) == 30
    assert len(ran) <= 30 + kills


PROGRAM = """
import csv, sys
rows = list(csv.reader(line for line in open(sys.argv[1]) if not line.startswith("#")))
level = float(rows[1][1])
if sys.argv[3] == "fails" and level > 1:
    sys.exit("no licence")
with open(sys.argv[2], "w") as file:
    file.write("time [s],y [" + ("kg" if sys.argv[3] == "units" and level > 1 else "m") + "]\\n")
    for row in rows[1:]:
        file.write(f"{row[0]},{float(row[1]) * 1e-3}\\n")
"""


@pytest.mark.parametrize(
    ("how", "reason"),
    [
        ("fails", "the program ended with exit code 1: no licence"),
        ("units", "the program wrote y in kg, where mm was expected"),
    ],
)
def test_a_program_is_run_on_files_and_its_units_are_heeded(how: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "solver.py").write_text(PROGRAM, encoding="utf-8")
    command = [sys.executable, "solver.py", "{inputs}", "{outputs}", how]
    config = reference("raises", python=None, program=command, folder=str(tmp_path))
    first, bad, _ = run(config, tmp_path, CASES)
    assert bad.reason == reason
    assert first.trace is not None
    np.testing.assert_allclose(first.trace["y"], 0.5, rtol=1e-12)


def test_a_command_that_passes_no_file_is_refused(tmp_path: Path) -> None:
    config = reference("raises", python=None, program=["solver", "{inputs}", "{mass}"], folder=str(tmp_path))
    with pytest.raises(ConfigError, match="cannot be filled in"):
        run(config, tmp_path, CASES)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"program": ["a"]}, "run by one thing"),
        ({"inputs": {}}, "nothing of the reference can be varied"),
        ({"outputs": {"u": {}}}, "u is named twice"),
        ({"inputs": {"u": {"range": [0, 2], "start": 3}}}, "outside the range"),
    ],
)
def test_what_makes_no_reference_is_said_in_words(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        reference("raises", **fields)


def test_the_slow_models_rest_where_nothing_moves() -> None:
    """What the benchmark is run on has an equilibrium at its start."""
    time_s = 5.0 * np.arange(3)
    wall = slow_models.thermal(time_s, np.tile([0.0, 293.15], (3, 1)), {})
    np.testing.assert_allclose(wall, 293.15, atol=1e-6)
    rod = slow_models.cylinder(0.02 * np.arange(5), np.zeros((5, 1)), {})
    np.testing.assert_allclose(rod, 150.0, atol=1e-9)


def test_the_compiled_thermal_network_is_the_slow_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """To a ten-millionth of a kelvin where that is integrated tightly; as users write it, within its own tolerance."""
    monkeypatch.syspath_prepend(HERE)
    compiled = importlib.import_module("compiled_models")
    rng = np.random.default_rng(3)
    inputs = np.column_stack([rng.uniform(0.0, 100.0, 8), 293.15 + 0.4 * np.cumsum(rng.uniform(-1.0, 1.0, 8))])
    wall = compiled.thermal(20.0 * np.arange(8), inputs, {"conductivity": 0.7})
    np.testing.assert_allclose(wall, slow_models.thermal_run(20.0, inputs, 0.7, 1e-10), rtol=0.0, atol=2e-7)
    slow = slow_models.thermal(20.0 * np.arange(8), inputs, {"conductivity": 0.7})
    np.testing.assert_allclose(wall, slow, rtol=0.0, atol=5e-4)
