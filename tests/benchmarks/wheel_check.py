"""A wheel in a clean environment: how long it takes to install, how large it is, and whether it passes the first hour.

    make wheel-check                       # with this Python, nothing optional
    python -m tests.benchmarks.wheel_check --python /usr/bin/python3.13 --extras all

Needs the package index. Not part of the tests: it takes some minutes and downloads 150 MB.
"""

from __future__ import annotations

import argparse
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from sysid.workbench.trackers import UNTRACKED
from tests.test_readme import ROOT, Command, blocks, check, commands, stand_in

LARGEST_MB = 600.0
"""What the wheel and all that it needs may take; what an environment has before, as pip, is told beside it."""


def build(folder: Path) -> Path:
    """The wheel of this checkout."""
    words = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    subprocess.run(words, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    return wheel


def megabytes(folder: Path) -> float:
    """What the packages of an environment take on the disk."""
    (packages,) = folder.glob("**/site-packages")
    return sum(file.stat().st_blocks * 512 for file in packages.rglob("*") if not file.is_symlink()) / 2**20


def install(wheel: Path, python: str, extras: str, folder: Path) -> tuple[Path, float, float, float]:
    """An environment with the wheel in it: its programs, seconds, MB that it added, and MB that were there before."""
    subprocess.run([python, "-m", "venv", str(folder)], check=True)
    programs = folder / ("Scripts" if os.name == "nt" else "bin")
    before, began = megabytes(folder), time.monotonic()
    asked = f"{wheel}[{extras}]" if extras else str(wheel)
    subprocess.run([programs / "python", "-m", "pip", "install", "--quiet", asked], check=True)
    seconds = time.monotonic() - began
    return programs, seconds, megabytes(folder) - before, before


class Person:
    """Somebody who types what the page says, with the programs of that environment."""

    def __init__(self, programs: Path, home: Path) -> None:
        self.home, self.folder = home, home / "work"
        self.folder.mkdir()
        (home / "Downloads").mkdir()
        (home / "Downloads" / "dryer.dat").write_text(stand_in(), encoding="utf-8")
        kept = {
            name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "MLFLOW", "VIRTUAL"))
        }
        self.environment = {**kept, "HOME": str(home), "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}

    def write(self, name: str, text: str) -> None:
        """A file of the page."""
        (self.folder / name).write_text(text, encoding="utf-8")

    def run(self, words: str) -> str:
        """A line of the page."""
        program, *rest = shlex.split(words.replace("~", str(self.home)))
        if program == "cd":
            self.folder = self.folder / rest[0]
            os.chdir(self.folder)  # what is printed is compared without the folder that it was printed in
            return ""
        done = subprocess.run(
            [shutil.which(program, path=self.environment["PATH"]) or program, *rest],
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            check=False,
        )
        return done.stderr if done.returncode else done.stdout


def first_hour(person: Person, *, tracked: bool) -> int:
    """Everything that the page says, compared with what it says is printed; the number of commands."""
    count = 0
    for _, name, text in blocks():
        if name:
            person.write(name, text)
            continue
        for command in commands(text):
            said = command.printed
            if not tracked:
                said = said.replace("Compare: sysid ui", UNTRACKED)
            check(Command(words=command.words, printed=said), person.run(command.words))
            count += 1
    return count


def main() -> int:
    """Build, install, measure, and go through the first hour."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--python", default=sys.executable, help="the interpreter")
    options.add_argument("--extras", default="", help="such as all, or onnx,mlflow")
    asked = options.parse_args()
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        wheel, environment = build(place / "dist"), place / "environment"
        programs, seconds, size, before = install(wheel, asked.python, asked.extras, environment)
        print(f"installed in {seconds:.0f} s: {size:.0f} MB, beside {before:.0f} MB that were there")
        (place / "home").mkdir()
        began, before = time.monotonic(), Path.cwd()
        tracked = asked.extras == "all" or "mlflow" in asked.extras
        try:
            count = first_hour(Person(programs, place / "home"), tracked=tracked)
        finally:
            os.chdir(before)
        print(f"the first hour: {count} commands as the page says, in {time.monotonic() - began:.0f} s")
    return 0 if asked.extras or size <= LARGEST_MB else 1


if __name__ == "__main__":
    sys.exit(main())
