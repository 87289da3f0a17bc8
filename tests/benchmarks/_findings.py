"""How a benchmark says what it found: a printed line, and an entry for the published page where one is made."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from sysid.reporting.benchmarks.findings import Finding
from sysid.reporting.scores import Score

FILE_VARIABLE = "SYSID_FINDINGS"
"""Environment variable with the file that entries are added to; without it they are only printed."""


def found(what: str, ours: float, unit: str = "", **more: Any) -> Finding:
    """Print a figure beside its target, and keep it.

    Args:
        what: What was measured.
        ours: The figure.
        unit: Its unit.
        **more: Other fields of :class:`sysid.reporting.benchmarks.findings.Finding`.
    """
    finding = Finding(what=what, ours=ours, unit=unit, **more)
    verdict = {True: ", reached", False: ", missed", None: ""}[finding.met]
    target = f"target {finding.target_text}{verdict}" if finding.target_text else ""
    published = f"published {finding.published}" if finding.published else ""
    peer = f"peer {finding.peer}" if finding.peer else ""
    beside = "; ".join(filter(None, (target, published, peer, finding.note)))
    print(f"  {what}: {finding.ours_text}{f' ({beside})' if beside else ''}", flush=True)
    _keep({"finding": finding.model_dump(mode="json")})
    return finding


def read(name: str, digest: str) -> None:
    """Say which data were read.

    Args:
        name: Of the file or the data set.
        digest: Its SHA-256.
    """
    _keep({"data": {name: digest}})


def scored(score: Score) -> None:
    """Keep the errors of a peer's model by case.

    Args:
        score: The errors.
    """
    _keep({"score": score.model_dump(mode="json")})


def _keep(entry: dict[str, Any]) -> None:
    file = os.environ.get(FILE_VARIABLE)
    if file:
        with Path(file).open("a", encoding="utf-8") as lines:
            lines.write(json.dumps(entry) + "\n")
