"""What can happen to files that a run has written, to disks and to processes: named, or made good by the next run."""

# ruff: noqa: E501 - a row a line reads as a table
from __future__ import annotations

import errno
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from sysid.workbench.cli import run_cli
from sysid.workbench.runner.store import RunFolder
from tests.workbench.test_bad_inputs import contents

RUN = Path("runs/first")
BUNDLE = RUN / "bundle"
SIMULATE = ("simulate", str(BUNDLE), "inputs.csv", "--out", "o.csv")
SYSID = [str(Path(sys.executable).with_name("sysid"))]


def cut(name: Path, share: float = 0.5) -> Callable[[], None]:
    """The file ends too early, as after a full disk or a broken copy."""

    def damage() -> None:
        whole = name.read_bytes()
        name.write_bytes(whole[: int(share * len(whole))])

    return damage


def flip(name: Path, *, after: bytes = b"") -> Callable[[], None]:
    """One byte in the middle of the file is another, or the first one after some words.

    In a file of numbers the middle may be the last digit of one, where another is the same number.
    """

    def damage() -> None:
        data = bytearray(name.read_bytes())
        data[data.index(after) + len(after) if after else len(data) // 2] ^= 0x01
        name.write_bytes(bytes(data))

    return damage


def remove(name: Path) -> Callable[[], None]:
    """The file is gone."""
    return name.unlink


def change(name: Path, **fields: Any) -> Callable[[], None]:
    """Fields at the top of a JSON file are others, or gone where ``None``."""

    def damage() -> None:
        document = json.loads(name.read_text(encoding="utf-8")) | fields
        kept = {key: value for key, value in document.items() if value is not None}
        name.write_text(json.dumps(kept), encoding="utf-8")

    return damage


@dataclass(frozen=True, kw_only=True)
class Damage:
    """A damaged store, and the command that meets it.

    Args:
        id: What is damaged.
        damage: Does it.
        command: What is run then.
        says: Fragments of the message.
    """

    id: str
    damage: Callable[[], None]
    command: tuple[str, ...]
    says: tuple[str, ...]


REPORT = ("report", "runs/first")
DAMAGES = [
    Damage(id="results cut short", damage=cut(RUN / "results.json"), command=REPORT, says=("results are damaged", "results.json", "run the pipeline again")),
    Damage(id="results that are gone", damage=remove(RUN / "results.json"), command=REPORT, says=("holds no results", "run the pipeline first")),
    Damage(id="results of a newer release", damage=change(RUN / "results.json", schema_version=99), command=REPORT, says=("newer release", "99", "upgrade")),
    Damage(id="results without a field", damage=change(RUN / "results.json", fits=None), command=REPORT, says=("results are damaged", "fits", "run the pipeline again")),
    Damage(id="results that are a list", damage=lambda: (RUN / "results.json").write_text("[]"), command=REPORT, says=("results are damaged", "list")),
    Damage(id="signals cut short", damage=cut(RUN / "fits/open-loop/signals.npz"), command=REPORT, says=("signals.npz", "open-loop", "run the pipeline again")),
    Damage(id="a bundle's description cut short", damage=cut(BUNDLE / "model.json"), command=SIMULATE, says=("model.json", "remedy")),
    Damage(id="a bundle's description with another byte", damage=flip(BUNDLE / "model.json", after=b'"name": "'), command=SIMULATE, says=("model.json", "remedy")),
    Damage(id="a bundle's file with another byte", damage=flip(BUNDLE / "step.onnx"), command=SIMULATE, says=("step.onnx", "remedy")),
    Damage(id="a bundle's file that is gone", damage=remove(BUNDLE / "step.onnx"), command=SIMULATE, says=("step.onnx", "remedy")),
    Damage(id="a bundle of a newer release", damage=change(BUNDLE / "model.json", schema_version=99), command=SIMULATE, says=("99", "newer", "remedy")),
    Damage(id="a packed bundle cut short", damage=lambda: Path("b.zip").write_bytes(b"PK\x03\x04" + b"x" * 60), command=("simulate", "b.zip", *SIMULATE[2:]), says=("b.zip", "remedy")),
    Damage(id="a tracking store that is none", damage=lambda: Path("mlflow.db").write_text("no database " * 99), command=("promote", "rig"), says=("mlflow.db", "remedy")),
    Damage(id="a fit that is gone, exported", damage=remove(RUN / "fits/arx/fit.json"), command=("export", "first", "--fit", "ARX"), says=("not stored", "sysid run first")),
    Damage(id="a fit cut short, exported", damage=cut(RUN / "fits/arx/fit.json"), command=("export", "first", "--fit", "ARX"), says=("not stored", "sysid run first")),
]  # fmt: skip


@pytest.mark.parametrize("row", DAMAGES, ids=lambda row: row.id)
def test_a_damaged_store_is_named_and_nothing_else_is_touched(
    row: Damage, done: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copyfile("datasets/rig/run-1.csv", "inputs.csv")
    Path("inputs.csv").write_text(Path("inputs.csv").read_text().replace("kPa", "kPa gauge"), encoding="utf-8")
    row.damage()
    before = contents(done)
    assert run_cli(list(row.command)) == 2
    told = capsys.readouterr().err
    assert [words for words in row.says if words not in told] == [], told
    assert "Traceback" not in told
    assert {name: sha for name, sha in contents(done).items() if name in before} == before


EXPORT = "export: {fit: closed loop, formats: [onnx]}"
HEALED = {
    "a fit cut short": cut(RUN / "fits/arx/fit.json"),
    "a fit with another byte": flip(RUN / "fits/open-loop/fit.json", after=b'"status": "'),
    "figures cut short": cut(RUN / "fits/arx/evaluation.json"),
    "signals that are gone": remove(RUN / "fits/closed-loop/signals.npz"),
    "a stamp cut short": cut(RUN / ".steps/fit-arx.json"),
    "a stamp of something else": lambda: (RUN / ".steps/fit-arx.json").write_text("[]"),
    "results cut short": cut(RUN / "results.json"),
    "results of a newer release": change(RUN / "results.json", schema_version=99),
    "a report that is gone": remove(RUN / "report/index.html"),
    "a bundle cut short": cut(BUNDLE / "step.onnx"),
    "a draft that a killed run left": lambda: (RUN / ".results.x1y2z3.json").write_text("{"),
    "a holder's name cut short": cut(RUN / ".steps/holder.json"),
    "a log that is gone": remove(RUN / "log.txt"),
}
"""Damage that the next run makes good without a word, doing again what it has to and nothing more."""


def as_made(folder: Path) -> dict[str, Any]:
    """Figures of a run, without what differs between two runs that do the same: times and dates."""
    document = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    return {
        fit["name"]: {case: figures["free_run"] for case, figures in fit["cases"].items()} for fit in document["fits"]
    }


@pytest.mark.usefixtures("quick_report")
@pytest.mark.parametrize("damage", HEALED.values(), ids=HEALED)
def test_the_next_run_makes_it_good(damage: Callable[[], None], done: Path) -> None:
    made = as_made(RUN)
    (RUN / "log.txt").write_text("")
    damage()
    assert run_cli(["run", "first", "--no-tracking"]) == 0
    assert as_made(RUN) == made
    again = {
        line.split("  ")[1].split(":")[0] for line in (RUN / "log.txt").read_text().splitlines() if ": done" in line
    }
    assert len({step for step in again if step.startswith("Fitting")}) <= 1


@pytest.mark.usefixtures("quick_report")
@pytest.mark.parametrize(
    ("number", "file"),
    [
        (errno.ENOSPC, "fit-open-loop.json"),
        (errno.EDQUOT, "fit.json"),
        (errno.EROFS, "signals.npz"),
        (errno.EACCES, "results.json"),
        (errno.EIO, "evaluation.json"),
    ],
    ids=lambda value: errno.errorcode[value] if isinstance(value, int) else value,
)
def test_a_disk_that_takes_no_more_loses_nothing(
    number: int, file: str, done: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """From the first write of a file on, nothing can be written; the same command then goes on from there."""
    pipeline = Path("pipelines/first.yaml")
    pipeline.write_text(
        pipeline.read_text().replace("seed: 3", "seed: 4").replace(EXPORT, "export: null"), encoding="utf-8"
    )
    mkstemp, full = tempfile.mkstemp, []

    def refuse(*words: Any, prefix: str = "", suffix: str = "", **more: Any) -> tuple[int, str]:
        if full or f"{prefix}{suffix}" == f".{Path(file).stem}.{Path(file).suffix}":
            full.append(prefix)
            raise OSError(number, os.strerror(number), f"{prefix}draft{suffix}")
        return mkstemp(*words, prefix=prefix, suffix=suffix, **more)

    with monkeypatch.context() as patch:
        patch.setattr(tempfile, "mkstemp", refuse)
        assert run_cli(["run", "first", "--no-tracking"]) == 2
    told = capsys.readouterr().err
    assert full
    # The checkpoint of a fit has the name of its step; where it cannot be written, the fit's own file is the next.
    assert {"fit-open-loop.json": "fit.json"}.get(file, file) in told
    assert os.strerror(number) in told
    assert "remedy" in told
    assert "Traceback" not in told
    stored = {stamp.stem for stamp in (RUN / ".steps").glob("fit-*.json")}
    assert {"fit-arx", "fit-open-loop", "fit-closed-loop"} == stored
    assert run_cli(["run", "first", "--no-tracking"]) == 0
    assert json.loads((RUN / "results.json").read_text())["seed"] == 4


@contextmanager
def limited(largest: int) -> Iterator[None]:
    """No file of this process may be larger, in bytes."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (largest, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.usefixtures("quick_report")
def test_a_real_limit_of_the_system_is_named_and_the_next_run_goes_on(
    done: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = as_made(RUN)
    # Signals of the three records take some 60 kB; the fits themselves are smaller. What was compiled is larger, and
    # stored: by the run that is copied here.
    with limited(20_000):
        assert run_cli(["run", "first", "--no-tracking", "--fresh"]) == 2
    told = capsys.readouterr().err
    assert "larger than this process may write" in told
    assert "signals.npz" in told
    assert as_made(RUN) == made
    assert run_cli(["run", "first", "--no-tracking"]) == 0
    assert as_made(RUN) == made


@pytest.mark.skipif(os.geteuid() == 0, reason="the administrator may write everywhere")
def test_a_folder_that_may_not_be_written_to(done: Path, capsys: pytest.CaptureFixture[str]) -> None:
    RUN.joinpath(".steps").chmod(0o500)
    try:
        assert run_cli(["run", "first", "--no-tracking"]) == 2
    finally:
        RUN.joinpath(".steps").chmod(0o700)
    assert "cannot be written to" in capsys.readouterr().err


@pytest.mark.usefixtures("quick_report")
def test_a_second_run_in_the_same_folder_is_refused_and_harms_nothing(
    done: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = contents(done)
    with RunFolder(path=RUN).locked():
        assert run_cli(["run", "first", "--no-tracking"]) == 2
        told = capsys.readouterr().err
    assert f"process {os.getpid()}" in told
    assert "--out" in told
    assert contents(done) == before
    assert run_cli(["run", "first", "--no-tracking"]) == 0


@pytest.mark.usefixtures("quick_report")
def test_a_process_that_is_ended_from_outside_loses_only_the_fit_it_was_at(
    done: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By SIGTERM, as a machine that shuts down does; ``test_pipeline.py`` kills runs while they write."""
    pipeline = Path("pipelines/first.yaml")
    text = pipeline.read_text().replace("{loop: closed, max_iterations: 8}", "{starts: 900, max_iterations: 900}")
    pipeline.write_text(text, encoding="utf-8")
    (RUN / "log.txt").write_text("")
    with subprocess.Popen([*SYSID, "run", "first", "--no-tracking"], stdout=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + 60.0
        while (
            process.poll() is None
            and time.monotonic() < deadline
            and "Fitting closed loop, NARX 1/1/2 ..." not in (RUN / "log.txt").read_text()
        ):
            time.sleep(0.05)
        process.send_signal(signal.SIGTERM)
    assert process.returncode == 128 + signal.SIGTERM
    pipeline.write_text(text.replace("starts: 900, max_iterations: 900", "loop: closed, max_iterations: 9"))
    assert run_cli(["run", "first", "--no-tracking"]) == 0
    told = capsys.readouterr().out
    assert [line.split()[0] for line in told.splitlines() if "Fitting" in line] == ["stored", "stored", "done"]
