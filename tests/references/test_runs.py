"""Runs of a reference: what fails is a case with a reason, and what has been run is not run again."""

from __future__ import annotations

import importlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
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
    assert str(bad.reason).partition(" (slow_models.py, line ")[0] == REASONS[function]
    assert bad.trace is None
    for one in (first, last):
        assert one.reason is None
        assert one.trace is not None
        np.testing.assert_array_equal(one.trace["y"], one.case.inputs[:, 0])


GIVEN = [None] * 6 + [
    "it gave complex numbers, where real ones were expected",
    "it gave no column z, only a, y",
    "z is nan at 4.5 s",
    "it gave no numbers but list",
    "it gave an array of shape (29, 2), where (30, 2) was expected: a row a sample, a column for each of y, z",
    "it gave columns of shapes (30,), (29,), where a number a sample was expected in each",
    "it gave an array of shape (), where (30, 2) was expected: a row a sample, a column for each of y, z",
]
"""Why what :func:`tests.references.slow_models.gives` gives is no record; the first six are."""


def test_what_a_function_gives_is_taken_by_name_where_it_has_names_and_never_for_other_numbers(tmp_path: Path) -> None:
    ports = {"outputs": {"y": {}, "z": {}}, "parameters": {"how": {"range": [0, 20]}}}
    inputs = np.r_[np.full(9, 0.5), np.full(21, 1.0)][:, np.newaxis]
    cases = [Case(name=f"c{k}", inputs=inputs, parameters={"how": float(k)}) for k in range(len(GIVEN))]
    outcomes = run(reference("gives", **ports), tmp_path, cases)
    assert [one.reason for one in outcomes] == GIVEN
    for one in outcomes[:6]:
        assert one.trace is not None
        np.testing.assert_array_equal(one.trace.columns(["y", "z"]), inputs * [0.5, 100.0])


def test_a_worker_leaves_no_temporary_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is ended by a signal that nothing survives: an unpacked FMU stayed for good, a folder a worker."""
    place = tmp_path / "temporary"
    place.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(place))
    outcomes = run(reference("litters"), tmp_path, CASES)
    assert [one.reason for one in outcomes] == [None] * 3
    assert not list(place.iterdir())


def test_what_is_no_function_is_refused_in_words(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="names is no function"):
        run(reference("NO_FUNCTION"), tmp_path, CASES)


def test_a_function_of_other_arguments_is_refused_with_those_that_are_given(tmp_path: Path) -> None:
    """It failed in every run, with Python's own words and the advice to run it by itself."""
    with pytest.raises(ConfigError, match="takes other arguments") as caught:
        run(reference("two_arguments"), tmp_path, CASES)
    said = str(caught.value)
    assert "two_arguments(time, inputs, parameters), with times (n,) in s, inputs (n, n_inputs)" in said
    assert "two_arguments(inputs, sample_time)" in said


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


def test_what_was_not_done_in_a_time_limit_is_run_again_with_another(tmp_path: Path) -> None:
    """The remedy that is told, a longer limit, found the old reason."""
    config = reference("hangs", time_limit=0.1)
    (one,) = run(config, tmp_path, CASES[1:2])
    assert one.wall_s >= 0.1
    for limit, kept in ((0.1, 1), (0.2, 0)):
        with ReferenceRuns(config=config.model_copy(update={"time_limit": limit}), folder=tmp_path) as runs:
            assert runs.kept(CASES[1:2]) == kept
            assert (runs.run(CASES[1:2])[0].stored, runs.kept(CASES[1:2])) == (bool(kept), 1)


def test_none_is_begun_after_a_time_but_for_the_first(tmp_path: Path) -> None:
    told: list[str] = []
    with ReferenceRuns(config=reference("first_order"), folder=tmp_path, workers=1) as runs:
        cases = [Case(name=name, inputs=np.full((5, 1), 0.5)) for name in "abc"]
        done = runs.run(cases, lambda name, *_: told.append(name), until=time.monotonic(), fewest=2)
    assert [one.case.name for one in done] == told == ["a", "b"]


def test_runs_without_a_record_count_in_what_one_takes(tmp_path: Path) -> None:
    with ReferenceRuns(config=reference("raises"), folder=tmp_path, workers=1) as runs:
        done = runs.run([Case(name=f"{k}", inputs=np.full((30, 1), level)) for k, level in enumerate((0.5, 1.5, 1.9))])
        assert runs.seconds_each()[0] == pytest.approx(np.mean([one.wall_s for one in done[1:]]))


def test_what_a_process_loads_for_its_first_run_is_not_counted_in_what_one_takes(tmp_path: Path) -> None:
    """A proof had 20 experiments in place of 1,000 where a second was compiled for the first of them."""
    with ReferenceRuns(config=reference("loads"), folder=tmp_path, workers=1) as runs:
        (first,) = runs.run(CASES[:1])
        assert runs.seconds_each()[0] == pytest.approx(first.wall_s)  # nobody knows better yet
        for most in (10.0, 0.1):  # the whole once more, or its beginning
            seconds = runs.seconds_warm(first, most=most)
            assert seconds < 0.2 <= first.wall_s
        assert runs.seconds_each()[0] < 0.2
        assert [one.cold for one in (first, runs.again(CASES[2]))] == [True, False]
        assert runs.seconds_warm(replace(first, wall_s=1e-9), most=1.0) == 1e-9


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
    kills = 5
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
import csv, os, random, signal, subprocess, sys
rows = list(csv.reader(open(sys.argv[1])))
how = sys.argv[3].split(",")[int(float(rows[1][rows[0].index("u [V]")]))]
sys.stderr.write("warning\\n" * 20_000)
sys.stdin.read()
subprocess.Popen(["sleep", "60"])
if how == "fails":
    sys.exit("no licence")
if how == "killed":
    os.kill(os.getpid(), signal.SIGSEGV)
if how == "elsewhere":
    sys.exit(0)
os.chdir("/")
step = {"steps": 2.0, "minutes": 1 / 60}.get(how, 1.0)
body = [(f"{float(row[1]) * 1e-3}", "7", f"{float(row[0]) * step}") for row in rows[1:]]
if how == "mixed":
    random.Random(0).shuffle(body)
with open(sys.argv[2], "w") as file:
    time = "time [min]" if how == "minutes" else "time [s]"
    print("y [kg]" if how == "units" else "y [m]", "other", time, sep=",", file=file)
    for row in body:
        print(*row, sep=",", file=file)
sys.exit(3 if how == "three" else 0)
"""
"""Says much, reads what nobody gives, leaves something running, goes elsewhere, has columns of its own; its input says
what it does beside that."""


def test_who_stops_a_study_does_not_wait_for_the_run_that_is_made_and_nothing_of_it_is_kept(tmp_path: Path) -> None:
    config = reference("hangs", time_limit=600.0)

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    began = time.monotonic()
    with ReferenceRuns(config=config, folder=tmp_path, workers=2) as runs:
        _ = runs.digest
        with pytest.raises(KeyboardInterrupt):
            runs.run(CASES[:2], stop)  # the second hangs for ten minutes
        assert time.monotonic() - began < 300.0
        assert runs.kept(CASES[:2]) == 1


@pytest.mark.parametrize(("name", "kept"), [("SIGTERM", 0), ("SIGABRT", 1)])
def test_a_run_that_is_ended_from_outside_says_nothing_of_its_experiment(name: str, kept: int, tmp_path: Path) -> None:
    """As by a container that stops, which tells every process of it."""
    config = reference("ends_itself", parameters={"signal": {"range": [1, 20]}})
    case = Case(name="a", inputs=np.ones((5, 1)), parameters={"signal": float(getattr(signal, name))})
    with ReferenceRuns(config=config, folder=tmp_path, workers=1) as runs:
        (one,) = runs.run([case])
        assert f"it ended its process by signal {name}" in str(one.reason)
        assert runs.kept([case]) == kept


ENDS = {
    "well": None,
    "minutes": None,
    "fails": "the program ended with exit code 1: no licence",
    "killed": "the program was ended by signal SIGSEGV: warning",
    "elsewhere": "the program wrote no file of outputs",
    "units": "the program wrote y in kg, where mm was expected",
    "steps": "the program wrote rows 1 s apart",
    "mixed": "the program wrote rows ",
    "three": "the program ended with exit code 3: warning (if that is how it ends well, name it under exit_codes)",
}
"""By what a program does, why that is no record."""


def test_a_program_is_run_on_files_and_its_units_are_heeded(tmp_path: Path) -> None:
    (tmp_path / "solver.py").write_text(PROGRAM, encoding="utf-8")
    command = [sys.executable, "solver.py", "{inputs}", "{outputs}", ",".join(ENDS)]
    config = reference("raises", python=None, program=command, folder=str(tmp_path))
    cases = [Case(name=how, inputs=np.full((30, 1), float(k))) for k, how in enumerate(ENDS)]
    outcomes = run(config, tmp_path, cases)
    for one, (how, reason) in zip(outcomes, ENDS.items(), strict=True):
        assert (one.reason is None) is (reason is None), how
        assert str(one.reason).startswith(str(reason))
    # What a run ended with before other codes were said to be good is another run.
    outcomes += run(config.model_copy(update={"exit_codes": (0, 3)}), tmp_path, cases[-1:])
    for one in (*outcomes[:2], outcomes[-1]):
        assert one.trace is not None
        np.testing.assert_allclose(one.trace["y"], one.case.inputs[:, 0], rtol=1e-12)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"program": ["a"]}, "run by one thing"),
        ({"python": None, "program": ["a", "{inputs}"]}, "cannot be filled in"),
        ({"python": None, "program": ["a", "{inputs}", "{outputs}", "{mass}"]}, "cannot be filled in"),
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
