"""``make bench``: which benchmarks there are; ``python -m tests.benchmarks training rail`` runs the named ones, and
``--help`` beside a name says what it measures and with which options, in place of hours of it.

``--publish=REPORT`` writes what they find into ``reports/REPORT`` too, with the data, the commit, the machine and the
date; what that report holds of other benchmarks stays.
"""

from __future__ import annotations

import ast
import json
import os
import re
import runpy
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from sysid.reporting.benchmarks.findings import Benchmark, Finding
from sysid.reporting.scores import Score
from tests.benchmarks._findings import FILE_VARIABLE

HERE = Path(__file__).parent


def main(names: list[str]) -> int:
    """Run the named benchmarks, or list all."""
    known = {file.stem: file for file in sorted(HERE.glob("[a-z]*.py"))}
    strangers = sorted(set(names) - set(known))
    if strangers:
        print(f"no benchmark named {', '.join(strangers)}; there are {', '.join(known)}")
        return 2
    if not names:
        for name in known:
            print(f"{name:<20} {_docstring(name).splitlines()[0]}")
        print("\nrun one with: python -m tests.benchmarks NAME")
        return 0
    if {"-h", "--help"} & set(sys.argv):
        print("\n\n".join(_docstring(name) for name in names))
        return 0
    for name in names:
        sys.argv = [str(known[name]), *sys.argv[2:]] if len(names) == 1 else [str(known[name])]
        runpy.run_path(str(known[name]), run_name="__main__")
    return 0


def publish(report: str, names: list[str], options: list[str]) -> int:
    """Run the named benchmarks one after the other, each in a process of its own, and publish what they find."""
    from sysid.reporting import publish_benchmarks

    into = HERE.parent.parent / "reports"
    for name in names:
        # One after the other into the page, so that a later one that fails takes nothing of the earlier ones.
        ran = record(name, options)
        if ran is None:
            print(f"{name} failed and is not published")
            return 1
        print(f"Published: {publish_benchmarks(report, into, [ran])}")
    return 0


def record(name: str, options: list[str]) -> Benchmark | None:
    """Run a benchmark and keep what it says; ``None`` if it fails."""
    from sysid.workbench.runner.environment import environment

    words = ["-m", "tests.benchmarks", name, *options]
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch) / "findings.jsonl"
        variables = {**os.environ, FILE_VARIABLE: str(file)}
        with subprocess.Popen([sys.executable, *words], stdout=subprocess.PIPE, text=True, env=variables) as process:
            assert process.stdout is not None
            lines = []
            for line in process.stdout:
                print(line, end="", flush=True)
                lines.append(line)
        if process.returncode != 0:
            return None
        said = [json.loads(line) for line in file.read_text("utf-8").splitlines()] if file.exists() else []
    title, _, protocol = _docstring(name).partition("\n")
    return Benchmark(
        title=title.rstrip("."),
        protocol=prose(protocol),
        command=shlex.join(["python", *words]),
        created=time.strftime("%Y-%m-%dT%H:%M:%S%z"),
        environment=environment(),
        load=load,
        data={key: digest for entry in said for key, digest in entry.get("data", {}).items()},
        findings=[Finding.model_validate(entry["finding"]) for entry in said if "finding" in entry],
        scores=[Score.model_validate(entry["score"]) for entry in said if "score" in entry],
        printed="".join(lines),
    )


def _docstring(name: str) -> str:
    return ast.get_docstring(ast.parse((HERE / f"{name}.py").read_text("utf-8"))) or name


def prose(docstring: str) -> str:
    """A docstring as Markdown: without its literal blocks, which hold commands."""
    kept = [line for line in docstring.replace("``", "`").splitlines() if not line.startswith("    ")]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(kept)).strip()


if __name__ == "__main__":
    chosen = [argument for argument in sys.argv[1:] if not argument.startswith("-")]
    options = [argument for argument in sys.argv[1:] if argument.startswith("-")]
    into = [option.removeprefix("--publish=") for option in options if option.startswith("--publish=")]
    rest = [option for option in options if not option.startswith("--publish=")]
    if into and rest and len(chosen) > 1:
        sys.exit("options go to one benchmark: name one")
    asked = bool({"-h", "--help"} & set(rest))
    sys.exit(publish(into[0], chosen, rest) if into and chosen and not asked else main(chosen))
