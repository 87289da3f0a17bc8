"""The log of a run: a line for each step, and how a long one goes."""

from pathlib import Path

import pytest
from rich.progress import Progress

from sysid.workbench.runner.console import console
from sysid.workbench.runner.events import Event, RunStarted, StepDone, StepProgress, StepStarted
from sysid.workbench.runner.screen import SILENCE_S, Left, LogFile, Screen

STEP = "Training end to end"


class Clock:
    """A clock that is set by hand."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def log(clock: Clock, tmp_path: Path) -> LogFile:
    log = LogFile(clock)
    log(RunStarted(pipeline="first", folder=tmp_path, run_id="1", command="sysid run first"))
    return log


def told(folder: Path) -> list[str]:
    """Its lines without the time of day, nor the one that begins the run."""
    return [line.split("  ", 1)[1] for line in (folder / "log.txt").read_text(encoding="utf-8").splitlines()][1:]


def progress(fraction: float | None) -> Event:
    return StepProgress(step=STEP, fraction=fraction, detail="iteration 3")


def test_a_short_step_is_two_lines(log: LogFile, clock: Clock, tmp_path: Path) -> None:
    log(StepStarted(step=STEP))
    for _ in range(10):
        clock.now += SILENCE_S / 11.0
        log(progress(0.5))
    log(StepDone(step=STEP, stored=False, detail="55 s"))
    assert told(tmp_path) == [f"{STEP} ...", f"{STEP}: done. 55 s"]


def test_a_long_one_says_once_a_minute_how_far_it_is_and_how_long_it_has_to_go(
    log: LogFile, clock: Clock, tmp_path: Path
) -> None:
    log(StepStarted(step=STEP))
    for number in range(1, 241):
        clock.now += 1.0
        log(progress(number / 480.0))
    assert told(tmp_path)[1:] == [
        f"{STEP}: {share} %, {left} left; iteration 3"
        for share, left in ((12, "7 min 00 s"), (25, "6 min 00 s"), (38, "5 min 00 s"), (50, "4 min 00 s"))
    ]


@pytest.mark.parametrize("fraction", [None, 0.0])
def test_nothing_is_guessed_from_a_share_that_is_not_known(
    log: LogFile, clock: Clock, tmp_path: Path, fraction: float | None
) -> None:
    log(StepStarted(step=STEP))
    clock.now += SILENCE_S
    log(progress(fraction))
    assert told(tmp_path)[1:] == [f"{STEP}: iteration 3"]


def test_every_step_has_a_minute_of_its_own(log: LogFile, clock: Clock, tmp_path: Path) -> None:
    log(StepStarted(step=STEP))
    clock.now += SILENCE_S - 1.0
    log(StepStarted(step=STEP))
    clock.now += SILENCE_S - 1.0
    log(progress(0.5))
    assert told(tmp_path) == [f"{STEP} ...", f"{STEP} ..."]


def test_of_a_step_of_unknown_length_no_time_is_said_to_be_left(clock: Clock) -> None:
    left = Left()
    left.max_refresh = None
    bar = Progress(left, get_time=clock)
    bar.add_task(STEP, total=None)
    (task,) = bar.tasks
    assert left(task).plain == ""
    bar.update(task.id, total=100.0)
    for _ in range(3):
        clock.now += 10.0
        bar.advance(task.id, 10.0)
    assert left(task).plain == "0:01:10 left"


def test_who_asks_for_colours_in_a_pipe_gets_no_bar_that_moves(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # as notebooks do, and services that build software
    screen = Screen(console())
    screen(StepStarted(step=STEP))
    screen(progress(0.5))
    screen(StepDone(step=STEP, stored=False, detail="55 s"))
    shown = capsys.readouterr().out
    assert shown.count(STEP) == 1
    assert "\x1b[32mdone" in shown
