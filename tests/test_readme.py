"""The first hour, followed to the letter: its files are written, its commands run, their output compared.

With ``SYSID_DATA`` (a folder that holds ``hair_dryer/dryer.dat``) the numbers count; without it a linear record of the
same shape stands in, and the words do.
"""

from __future__ import annotations

import math
import os
import re
import runpy
import shlex
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from sysid.workbench.cli import run_cli

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "first-hour.md"
BLOCK = re.compile(r"^```(\w+) ?([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
TIME = re.compile(r"under 1 s|\b\d+ h \d+ min|\b\d+ min \d+ s|\b[\d.]+ m?s\b")
HASH = re.compile(r"\b[0-9a-f]{16,}\b")
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w])")
DATA = os.environ.get("SYSID_DATA")
ROUNDING = 1e-9
"""Below this, a difference between two implementations is rounding, and its digits are the machine's."""


@dataclass(frozen=True, kw_only=True)
class Command:
    """A line after ``$`` and what stands below it."""

    words: str
    printed: str


def blocks() -> list[tuple[str, str, str]]:
    """Language, file and text of each block of the tutorial."""
    return BLOCK.findall(PAGE.read_text(encoding="utf-8"))


def commands(text: str) -> list[Command]:
    parts = re.split(r"^\$ (.*)\n", text, flags=re.MULTILINE)[1:]
    return [Command(words=words, printed=printed) for words, printed in zip(parts[::2], parts[1::2], strict=True)]


def stand_in() -> str:
    """A linear system of second order with dead time and a little noise, as the record has, row by row.

    Of 300 samples to choose by, chance may take either fit: this draw leaves them tied, as the record does.
    """
    rng = np.random.default_rng(2)
    u = np.where(np.repeat(rng.random(250), 4) < 0.5, 3.41, 6.41)
    y = np.full(1000, 4.9)
    for n in range(4, 1000):
        y[n] = 1.27 * y[n - 1] - 0.39 * y[n - 2] + 0.066 * u[n - 3] + 0.045 * u[n - 4] + 0.043
        y[n] += 0.03 * rng.standard_normal()
    return "".join(f"   {a:.7e}\t   {b:.7e}\t\n" for a, b in zip(u, y, strict=True))


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A person's home, with the record downloaded, and an empty folder to work in."""
    downloads = tmp_path / "Downloads"
    downloads.mkdir()
    if DATA:
        shutil.copyfile(Path(DATA) / "hair_dryer" / "dryer.dat", downloads / "dryer.dat")
    else:
        (downloads / "dryer.dat").write_text(stand_in(), encoding="utf-8")
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    return tmp_path


def execute(words: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> str:
    """Run one line; the few commands of the shell that the tutorial needs are done here."""
    program, *rest = [str(Path(word).expanduser()) if word.startswith("~") else word for word in shlex.split(words)]
    capsys.readouterr()
    if program == "cd":
        monkeypatch.chdir(rest[0])
    elif program == "mkdir":
        Path(rest[0]).mkdir()
    elif program == "cp":
        shutil.copy(*rest)
    elif program == "python":
        runpy.run_path(rest[0], run_name="__main__")
    else:
        assert program == "sysid"
        code = run_cli(rest)
        told = capsys.readouterr()
        assert code == (2 if told.err else 0), told.err
        return told.err or told.out
    return capsys.readouterr().out


def skeleton(line: str) -> str:
    """A line without what may differ: times, hashes, the folder that it was run in, the widths of columns."""
    line = line.replace(f"{Path.cwd().resolve()}/", "")
    line = re.sub(r", and [^,│]* for its check(?= *│)", "", line)  # told where it takes a second, as beside other work
    line = HASH.sub("<hash>", TIME.sub("<time>", line))
    return re.sub(r"[━─]+", "━", re.sub(r"[ \xa0]+", " ", line)).strip()


def masked(text: str) -> str:
    """A text without what hangs on the data: numbers, which case is the worst, and whether what was chosen is ahead."""
    text = re.sub(r"(?<=on the selection traces: ).*", "<ahead>", text)
    return re.sub(r"\((EST|SEL|VAL)\)", "(case)", NUMBER.sub("<number>", text))


def same(expected: str, got: str) -> bool:
    """Whether two lines agree: in their words, and in their numbers to a part in a hundred."""
    one, other = skeleton(expected), skeleton(got)
    if "..." in one:
        return other.startswith(one.split("...")[0].strip())
    if not DATA:
        return masked(one) == masked(other)
    if NUMBER.sub("<number>", one) != NUMBER.sub("<number>", other):
        return False
    pairs = zip(NUMBER.findall(one), NUMBER.findall(other), strict=True)
    return all(math.isclose(float(a), float(b), rel_tol=0.01, abs_tol=ROUNDING) for a, b in pairs)


def check(command: Command, got: str) -> None:
    expected = [line for line in command.printed.splitlines() if line.strip()]
    lines = [line for line in got.splitlines() if line.strip()]
    if expected and expected[-1] == "...":
        expected = expected[:-1]
        lines = lines[: len(expected)]
    for number, line in enumerate(lines):
        assert number < len(expected), f"{command.words}: the page lacks the line\n{line}"
        assert same(expected[number], line), f"{command.words}:\n{line}\nwhere the page has\n{expected[number]}"
    assert len(lines) == len(expected), f"{command.words}: it no longer prints\n{expected[len(lines) :]}"


@pytest.mark.usefixtures("undrawn")  # the words are compared
def test_the_first_hour_is_as_the_page_tells_it(
    home: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    done = 0
    for language, name, text in blocks():
        if name:
            Path(name).write_text(text, encoding="utf-8")
            continue
        assert language == "console", f"a block that is neither a file nor commands: {text}"
        for command in commands(text):
            check(command, execute(command.words, capsys, monkeypatch))
            done += 1
    assert done > 10
    assert Path("runs/dryer/report/index.html").is_file()
    assert Path("dryer.ingest.svg").is_file()
    assert len(Path("answer.csv").read_text(encoding="utf-8").splitlines()) >= 12


def test_the_comparison_tells_a_changed_number_and_a_changed_word() -> None:
    assert same("done  Fitting ARX  0.0 s", "done  Fitting  ARX 17.3 s")
    assert not same("done  Fitting ARX  0.0 s", "stored  Fitting ARX  0.0 s")
    assert same("at most 8.0e-15 V", "at most 3.1e-14 V")
    if DATA:
        assert not same("│ 8.480e-03 │", "│ 8.680e-03 │")


def test_the_readme_is_one_screen_after_another_and_no_book() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 150


def test_the_example_of_the_readme_prints_what_stands_below_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "README.md").read_text(encoding="utf-8")
    (block,) = [text for language, name, text in BLOCK.findall(page) if name]
    exec(compile(block, "README.md", "exec"), {})  # noqa: S102 - our own page
    told, shown = capsys.readouterr().out, page.partition("    free run, fit")[2].partition("\n\n")[0]
    cells = [[line.rsplit(maxsplit=3) for line in text.splitlines()[1:]] for text in (told, shown)]
    assert len(cells[0]) == 2
    for (name, *fits), (name_shown, *fits_shown) in zip(*cells, strict=True):
        assert name == name_shown.strip()
        np.testing.assert_allclose([float(fit) for fit in fits], [float(fit) for fit in fits_shown], atol=0.5)
    assert (tmp_path / "compare.png").is_file()
    assert (tmp_path / "frame" / "model.json").is_file()
