"""Pipelines whose product is a data set."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel, ConfigDict

from sysid.ingest import load_dataset
from sysid.workbench.kinds import RunRequest
from sysid.workbench.listeners import perform
from sysid.workbench.making import runner

PIPELINE = "kind: ramps\nname: ramp\ndescription: two of them\noptions: {heights: [1, 2]}\n"


class Options(BaseModel):
    """Of the maker of these tests."""

    model_config = ConfigDict(extra="forbid")
    heights: list[float]


@dataclass(frozen=True)
class Step:
    """A file with a ramp."""

    name: str
    terms: Mapping[str, Any]
    run: Callable[[], Any]


class RampMaker:
    """Writes ramps."""

    options, version = Options, "1"

    def __init__(self, folder: Path) -> None:
        self.folder, self.done = folder, 0

    def steps(self, options: Options) -> list[Step]:
        return [Step(f"to {h:g}", {"height": h}, lambda h=h: self._write(h)) for h in options.heights]

    def _write(self, height: float) -> str:
        self.done += 1
        rows = [f"{k / 10},{height * k}" for k in range(20)]
        file = self.folder / f"{height:g}.csv"
        file.write_text("\n".join(["t [s],u [V]", *rows]) + "\n", encoding="utf-8")
        return str(file)

    def dataset(self, options: Options, results: Mapping[str, Any]) -> dict[str, Any]:
        assert len(results) == len(options.heights)
        return {
            "sample_time": 0.1,
            "channels": [{"name": "u", "unit": "V"}],
            "source": {"files": {}},
            "cases": {name: {"role": "estimation", "file": file} for name, file in results.items()},
        }


def test_the_product_is_a_data_set_that_loads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    maker, file = RampMaker(tmp_path), tmp_path / "ramp.yaml"
    file.write_text(PIPELINE, encoding="utf-8")
    monkeypatch.setattr(runner, "find_plugin", lambda *_, **__: maker)
    for _ in range(2):
        request = RunRequest(path=file, typed="ramp.yaml", out=tmp_path / "made")
        assert perform(runner.program(request), request) == 0
    assert maker.done == 2
    made = tmp_path / "made" / "dataset.yaml"
    assert made.read_text(encoding="utf-8").startswith("# Made by: sysid run ramp.yaml")
    traces = load_dataset(made)
    assert traces.names == ("to 1", "to 2")
    assert traces["to 2"]["u"][-1] == 38.0
