"""What a tracking store hears of a fit to a frequency response."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from sysid.reporting.responses.results import ResponseResults
from sysid.workbench.runner.events import ResponseReady, RunStarted
from sysid.workbench.tracking.fit_run import Entities
from sysid.workbench.tracking.response_run import log_files, new_run

CURVE = {
    "frequency": [1.0, 2.0], "measured_real": [1.0, 0.5], "measured_imaginary": [0.0, -0.5], "model_real": [1.0, 0.5],
    "model_imaginary": [0.0, -0.5],
}  # fmt: skip
FIT = {
    "mapping": "u -> y", "slug": "u-y", "label": "continuous TF [1; 0; 0]", "status": "CONVERGED", "units": ("V", "m"),
    "structure": {"kind": "TransferFunction", "poles": [1]}, "sample_time": 0.1, "dead_time": 0.0, "weighting": "none",
    "fit_percent": 98.7654, "furthest_db": 0.1, "furthest_degrees": 1.0, "furthest_at": 2.0, "n_parameters": 2,
    "train_time_s": 0.5, "warnings": ["a warning"], "notes": ["a warning", "a note"], "curve": CURVE,
}  # fmt: skip
RUN = RunStarted(pipeline="arm", folder=Path("runs/arm"), run_id="1", command="sysid run arm")


class Store:
    """A tracking store that keeps what it is told."""

    def __init__(self) -> None:
        self.tags: dict[str, str] = {}
        self.metrics: dict[str, float] = {}
        self.parameters: dict[str, str] = {}
        self.files: list[str] = []
        self.ended = ""

    def create_run(self, _: str, *, run_name: str, tags: dict[str, str]) -> Any:
        self.tags |= {**tags, "name": run_name}
        return SimpleNamespace(info=SimpleNamespace(run_id="r"))

    def log_batch(self, _: str, *, metrics: list[Any], params: list[Any]) -> None:
        self.metrics |= {one[0]: one[1] for one in metrics}
        self.parameters |= dict(params)

    def set_tag(self, _: str, name: str, value: str) -> None:
        self.tags[name] = value

    def set_terminated(self, _: str, *, status: str) -> None:
        self.ended = status

    def get_run(self, _: str) -> Any:
        return SimpleNamespace(data=SimpleNamespace(tags=self.tags))

    def log_artifact(self, _: str, file: str, place: str = "") -> None:
        self.files.append(f"{place}/{Path(file).name}")

    def log_artifacts(self, _: str, folder: str, place: str) -> None:
        self.files.append(f"{place}: {folder}")


@pytest.fixture
def ready(tmp_path: Path) -> ResponseReady:
    results = ResponseResults.model_validate(
        {
            "kind": "response", "pipeline": "arm", "command": "sysid run arm", "created": "", "environment": {},
            "data": {"name": "sweep", "digest": "d", "file": "s.csv", "points": 2, "lowest": 1.0, "highest": 2.0},
            "fits": [FIT],
        }
    )  # fmt: skip
    bundle = tmp_path / "bundle"
    bundle.mkdir()
    (bundle / "model.json").write_text("{}")
    page, document = tmp_path / "index.html", tmp_path / "results.json"
    return ResponseReady(results=results, key="k", stored=False, page=page, document=document, bundle=bundle)


def test_a_fit_is_told_with_its_figures_and_its_files_once(ready: ResponseReady) -> None:
    store, entities = Store(), Entities(metric=lambda *given: given, param=lambda *given: given)
    assert new_run(store, "0", ready, RUN, entities, key_tag="sysid.key") == "r"
    assert store.tags["sysid.key"] == "k"
    assert store.tags["name"] == "continuous TF [1; 0; 0] · frequency response · u -> y"
    assert store.metrics["response_fit"] == 98.77
    assert "response_left_out" not in store.metrics  # too few points have none
    assert store.parameters["chosen_structure"] == "continuous TF [1; 0; 0]"
    assert store.tags["mlflow.note.content"].count("a warning") == 1
    assert store.ended == "FINISHED"
    assert log_files(store, "r", ready)
    assert "report/index.html" in store.files
    assert any(name.startswith("bundle: ") for name in store.files)
    again = ResponseReady(**{**vars(ready), "stored": True})
    assert not log_files(store, "r", again)
