"""The command line: exit codes, words, help, and every command on a user's own data."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from sysid.export import read_bundle
from sysid.ingest import read_trace
from sysid.workbench import cli
from sysid.workbench.cli import run_cli
from sysid.workbench.runner.events import Event, StepProgress
from sysid.workbench.runner.run import Run

SYSID = [str(Path(sys.executable).with_name("sysid"))]
COMMANDS = ("run", "ingest", "simulate", "export", "promote", "report", "ui", "init", "schema")


def test_help_is_quick() -> None:
    """In seconds of processor time: help waits for nothing, so that this is its wall time on a machine at rest."""
    seconds = []
    for _ in range(9):
        before = os.times()
        subprocess.run([*SYSID, "--help"], check=True, stdout=subprocess.DEVNULL)
        after = os.times()
        seconds.append(after.children_user + after.children_system - before.children_user - before.children_system)
    assert min(seconds) < 0.5  # what else runs on the machine only adds


def test_help_imports_nothing_heavy() -> None:
    script = (
        "import sys; from sysid.workbench.cli import run_cli; code = run_cli(['--help']); "
        "print(sorted({'numpy', 'torch', 'mlflow', 'numba', 'pandas', 'pydantic'} & set(sys.modules)), code)"
    )
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert done.stdout.splitlines()[-1] == "[] 0"


SLOW = {
    *("scipy.stats", "scipy.signal", "scipy.interpolate", "scipy.optimize", "scipy.fft", "matplotlib", "pandas"),
    *("pyarrow", "h5py", "control", "onnx", "onnxruntime", "mlflow", "optuna", "torch", "pint", "dask"),
    *("sysid.estimation.estimators", "sysid.estimation.linear.state_space", "sysid.estimation.grey_box"),
}
"""Each takes a fifth of a second or more, and no command that is over in a moment needs one."""


def imported(script: str, *words: str) -> set[str]:
    """What a process of its own has imported after a few lines."""
    script += "; import sys; print(' '.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", script, *words], check=True, capture_output=True, text=True)
    return set(done.stdout.splitlines()[-1].split(" "))


def our_lines(found: set[str]) -> int:
    """Lines of ours among what was imported: a file that is divided into rooms takes no longer to import."""
    ours = [Path(str(find_spec(name).origin)) for name in found if name.startswith("sysid.")]
    return sum(len(file.read_text(encoding="utf-8").splitlines()) for file in ours)


def test_a_frozen_model_is_run_without_what_fits_one() -> None:
    """In 1.5 s of processor time: 540 modules of others, and 43,000 lines of ours, a third of which are of models."""
    found = imported("import sysid.workbench.commands.simulate")
    assert found & SLOW == set()
    assert our_lines(found) < 43_300


def test_a_file_is_looked_into_without_what_draws_and_what_computes(workspace: Path) -> None:
    """The whole command, its picture too, in 1 s of processor time."""
    script = "import sys; from sysid.workbench.cli import run_cli; assert run_cli(sys.argv[1:]) == 0"
    found = imported(script, "ingest", "datasets/rig/run-1.csv")
    assert found & (SLOW | {"scipy", "numba"}) == set()
    assert (workspace / "run-1.ingest.svg").is_file()
    assert our_lines(found) < 17_800


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_a_line_of_help_and_an_example(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli([command, "--help"]) == 0
    text = capsys.readouterr().out
    assert f"Example: sysid {command}" in text
    assert run_cli(["--help"]) == 0
    assert command in capsys.readouterr().out


def test_it_runs_as_a_module_where_the_script_is_not_on_the_path() -> None:
    told = subprocess.run([sys.executable, "-m", "sysid", "--version"], check=True, capture_output=True, text=True)
    assert told.stdout.startswith("sysid ")


def test_no_tracking_command_names_itself(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["--version"]) == 0
    assert capsys.readouterr().out.startswith("sysid ")


USER_ERRORS = [
    pytest.param(["run", "frist"], "did you mean first?", id="unknown pipeline"),
    pytest.param(["run", "no.yaml"], "there is no such pipeline file", id="no such file"),
    pytest.param(["run", "bad.yaml"], "did you mean mapping?", id="misspelt field"),
    pytest.param(["run", "broken.yaml"], "not valid YAML", id="no YAML"),
    pytest.param(["ingest", "no.csv"], "there is no such file", id="no file to ingest"),
    pytest.param(["ingest", "empty.csv"], "empty.csv", id="empty file"),
    pytest.param(["simulate", "nowhere", "run-1.csv", "--out", "out.csv"], "no model.json", id="no bundle"),
    pytest.param(["export", "first", "--fit", "none"], "one of ARX; open loop; closed loop", id="unknown fit"),
    pytest.param(["export", "first", "--fit", "ARX"], "run it first: sysid run first", id="fit that was not run"),
    pytest.param(["report", "nowhere"], "holds no results", id="no run"),
    pytest.param(["init", "."], "files of a workspace already", id="workspace that is there"),
]


@pytest.mark.parametrize(("arguments", "words"), USER_ERRORS)
def test_a_users_mistake_has_code_2_and_no_trace(
    workspace: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], words: str
) -> None:
    (workspace / "bad.yaml").write_text("name: a\ndata: rig\nmaping: a -> b\n", encoding="utf-8")
    (workspace / "broken.yaml").write_text("name: [", encoding="utf-8")
    (workspace / "empty.csv").write_text("", encoding="utf-8")
    (workspace / "README.md").write_text("mine", encoding="utf-8")
    assert run_cli(arguments) == 2
    told = capsys.readouterr().err
    assert words in told
    assert "Traceback" not in told
    assert run_cli([*arguments, "--debug"]) == 2
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments",
    [["bogus"], ["run"], ["run", "first", "--bogus"], ["ui", "--port", "many"]],
    ids=["unknown command", "missing argument", "unknown option", "text for a number"],
)
def test_a_wrong_command_line_has_code_2(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(arguments) == 2
    told = capsys.readouterr().err
    assert "Traceback" not in told
    assert told.startswith("error: ")
    assert "--help" in told


def test_a_fault_of_ours_has_code_1_and_its_trace(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fault(*_: object, **__: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(cli, "_with_commands_of_fields", fault)
    assert run_cli(["run", "first"]) == 1
    told = capsys.readouterr().err
    assert "ZeroDivisionError" in told
    assert "please report it" in told


def test_stopping_has_the_code_of_the_signal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "_with_commands_of_fields", stop)
    assert run_cli(["run", "first"]) == 130
    assert "goes on where this one was" in capsys.readouterr().err


def test_a_command_that_is_stopped_says_so_whatever_typer_makes_of_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Some of its versions raise the interruption, others leave with its code."""
    from sysid.workbench.commands import schema

    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(schema, "schema_command", stop)
    assert run_cli(["schema"]) == 130
    assert capsys.readouterr().err == "stopped; the same command begins anew\n"


@pytest.mark.skipif(sys.platform == "win32", reason="no signals there")
@pytest.mark.parametrize(("name", "code"), [("SIGTERM", 143), ("SIGHUP", 129)])
def test_what_the_system_ends_clears_up_behind_itself(name: str, code: int, tmp_path: Path) -> None:
    script = (
        "import os, pathlib, signal, sys\nfrom sysid.atomic import replacing\nfrom sysid.workbench import cli\n"
        f"def work(*_, **__):\n  with replacing(pathlib.Path({str(tmp_path)!r}) / 'a.txt') as draft:\n"
        f"    draft.write_text('half')\n    try: os.kill(os.getpid(), signal.{name})\n"
        "    except KeyboardInterrupt: pass  # as a fit does, which would go on\n"
        "cli._with_commands_of_fields = work\nsys.argv = ['sysid', 'run', 'first', '--fresh']\ncli.main()\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == code
    assert done.stderr == f"ended by {name}; the same command without --fresh goes on where this one was\n"
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="no signals there")
def test_a_signal_that_comes_while_python_cleans_up_is_not_lost() -> None:
    """What the callback of a weak reference raises is dropped."""
    script = (
        "import os, signal, sys, time, weakref\nfrom sysid.workbench import cli\n"
        "class Thing: pass\n"
        "def work(*_, **__):\n"
        "    thing = Thing(); seen = weakref.ref(thing, lambda _: os.kill(os.getpid(), signal.SIGTERM)); del thing\n"
        "    time.sleep(20)\n"
        "cli._with_commands_of_fields = work\nsys.argv = ['sysid', 'run', 'first']\ncli.main()\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 143
    assert done.stderr == "ended by SIGTERM; the same command goes on where this one was\n"


def sysid(workspace: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*SYSID, *arguments], cwd=workspace, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_a_workspace_of_ones_own_from_first_to_last(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What the workspace's README tells: init and run as programs, the rest in this process, which has all imported."""
    made = sysid(tmp_path, "init", "mine")
    assert (made.returncode, made.stderr) == (0, "")
    mine = tmp_path / "mine"
    run = sysid(mine, "run", "tank", "--no-tracking")
    assert (run.returncode, run.stderr) == (0, "")
    lines = run.stdout.splitlines()
    assert [line.split("│")[1].strip() for line in lines if line.startswith("│") and "closed" in line] == [
        "network, closed loop"
    ]
    assert "Report:  runs/tank/report/index.html" in lines
    assert (mine / "runs/tank/report/index.html").is_file()
    assert not (mine / "mlflow.db").exists()

    monkeypatch.chdir(mine)

    def here(*arguments: str) -> None:
        assert run_cli(arguments) == 0
        assert capsys.readouterr().err == ""

    here("simulate", "runs/tank/bundle", "datasets/tank/val.csv", "--out", "out.csv", "--start", "rest")
    output, bundle = read_trace(mine / "out.csv"), read_bundle(mine / "runs/tank/bundle")
    inputs = read_trace(mine / "datasets/tank/val.csv")
    assert output.channel_names == ("pump", "level")
    np.testing.assert_array_equal(output["level"], bundle.model.simulate(inputs.columns(["pump"])))

    here("export", "tank", "--fit", "ARX", "--out", "linear", "--zip")
    for bundle_path in (mine / "linear", mine / "linear.zip"):
        assert read_bundle(bundle_path).model.structure.label == "ARX [2; 2; 1]"
    assert read_bundle(mine / "runs/tank/bundle").model.structure.label == "NARX 2/2/5"

    (mine / "runs/tank/report/index.html").unlink()
    here("report", "runs/tank")
    assert (mine / "runs/tank/report/index.html").is_file()


def test_a_file_is_shown_and_a_data_set_proposed(workspace: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["ingest", "datasets/rig/run-1.csv"]) == 0
    told = capsys.readouterr().out
    assert "one every 0.05 s" in told
    assert "outlet" in told
    assert "sample_time: 0.05" in told
    assert "400 samples, one every 0.05 s, 19.95 s in all" in told
    assert "picture: run-1.ingest.svg" in told
    picture = (workspace / "run-1.ingest.svg").read_text(encoding="utf-8")
    for label in ("inlet [kPa]", "valve [V]", "outlet [kPa]", "time in s"):
        assert label in picture
    proposal = workspace / "datasets" / "rig" / "proposed.yaml"
    assert run_cli(["ingest", "datasets/rig/run-1.csv", "--propose", str(proposal)]) == 0
    assert proposal.with_name("run-1.ingest.svg").is_file(), "beside what was proposed"
    assert run_cli(["ingest", str(proposal)]) == 0
    told = capsys.readouterr().out
    assert "400" in told
    assert "--mapping 'inlet+valve -> outlet'  (inputs -> outputs: yours may be others)" in told
    assert run_cli(["ingest", "datasets/rig/run-1.csv", "--propose", str(proposal)]) == 2
    assert "is there already" in capsys.readouterr().err


def test_a_data_set_is_summed_up(workspace: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["ingest", "rig"]) == 0
    told = capsys.readouterr().out
    for word in ("run-2", "selection", "outlet [kPa gauge]", "400", "digest"):
        assert word in told


def test_many_channels_are_summed_up_a_line_each(
    workspace: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sysid.workbench.commands.ingest._SIDE_BY_SIDE", 2)
    assert run_cli(["ingest", "rig"]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert any(line[1:5] == ["outlet", "│", "kPa", "gauge"] for line in lines)


def test_untracked_results_are_done_but_not_code_0(
    workspace: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (workspace / "file").write_text("no folder", encoding="utf-8")
    monkeypatch.setenv("MLFLOW_TRACKING_URI", f"sqlite:///{workspace}/file/mlflow.db")
    assert run_cli(["run", "first"]) == 1
    told = capsys.readouterr().out
    assert "not all of it is tracked" in told
    assert (workspace / "runs" / "first" / "report" / "index.html").is_file()


def test_ctrl_c_ends_a_fit_and_keeps_its_model(
    workspace: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    told_before, iterations = Run.tell, list[str]()

    def pressed_at_the_third_iteration(run: Run, event: Event) -> None:
        told_before(run, event)
        if isinstance(event, StepProgress) and event.step.startswith("Fitting open loop"):
            iterations.append(event.detail)
            if len(iterations) == 3:
                signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(Run, "tell", pressed_at_the_third_iteration)
    assert run_cli(["run", "first", "--no-tracking"]) == 0
    told = capsys.readouterr().out
    assert "Interrupted; this is the best model up to then" in told
    assert "Fitting closed loop" in told
    assert '"status": "INTERRUPTED"' in (workspace / "runs" / "first" / "results.json").read_text()


@pytest.mark.parametrize("terminal", [True, False])
def test_at_a_terminal_alone_it_is_told_that_kernels_are_compiled(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *, terminal: bool
) -> None:
    asked: list[Callable[[], None]] = []
    monkeypatch.setattr("sysid.workbench.cli.tell_of_compiling", asked.append)
    monkeypatch.setattr("sys.stderr.isatty", lambda: terminal, raising=False)
    run_cli(["--version"])
    for one in asked:
        one()
    assert ("compiling what computes" in capsys.readouterr().err) == terminal
