"""``make bench``: which benchmarks there are; ``python -m tests.benchmarks training rail`` runs the named ones.

``--publish=NAME`` writes what they print to ``reports/NAME`` too, with the commit, the machine and the date.
"""

from __future__ import annotations

import ast
import runpy
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).parent


def main(names: list[str]) -> int:
    """Run the named benchmarks, or list all."""
    known = {file.stem: file for file in sorted(HERE.glob("[a-z]*.py"))}
    strangers = sorted(set(names) - set(known))
    if strangers:
        print(f"no benchmark named {', '.join(strangers)}; there are {', '.join(known)}")
        return 2
    if not names:
        for name, file in known.items():
            print(
                f"{name:<20} {(ast.get_docstring(ast.parse(file.read_text(encoding='utf-8'))) or '').splitlines()[0]}"
            )
        print("\nrun one with: python -m tests.benchmarks NAME")
        return 0
    for name in names:
        sys.argv = [str(known[name]), *sys.argv[2:]] if len(names) == 1 else [str(known[name])]
        runpy.run_path(str(known[name]), run_name="__main__")
    return 0


def publish(report: str, names: list[str]) -> int:
    """Run the named benchmarks one after the other, each in a process of its own, and publish what they print."""
    from sysid.reporting import publish_text
    from sysid.workbench.environment import environment

    printed, commands = {}, []
    for name in names:
        words = [sys.executable, "-m", "tests.benchmarks", name]
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            lines = []
            for line in process.stdout:
                print(line, end="", flush=True)
                lines.append(line)
        if process.returncode != 0:
            print(f"{name} ended with code {process.returncode}; nothing is published")
            return 1
        printed[name] = "".join(lines)
        commands.append(f"python -m tests.benchmarks {name}")
    created = time.strftime("%Y-%m-%dT%H:%M:%S%z")
    into = HERE.parent.parent / "reports"
    page = publish_text(report, into, parts=printed, commands=commands, created=created, environment=environment())
    print(f"Published: {page}")
    return 0


if __name__ == "__main__":
    chosen = [argument for argument in sys.argv[1:] if not argument.startswith("-")]
    into = [argument.removeprefix("--publish=") for argument in sys.argv[1:] if argument.startswith("--publish=")]
    sys.exit(publish(into[0], chosen) if into and chosen else main(chosen))
