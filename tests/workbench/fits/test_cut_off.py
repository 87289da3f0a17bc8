"""A run that is cut off in the middle of a fit goes on with that fit, and ends as if nothing had happened."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from sysid.reporting.results import Results
from sysid.workbench.fits.config import Pipeline, PipelineConfig
from sysid.workbench.fits.record import read_fit
from sysid.workbench.fits.run import program_of
from sysid.workbench.runner.events import Event, StepProgress
from sysid.workbench.runner.program import carry_out
from sysid.workbench.runner.store import RunFolder

pytestmark = pytest.mark.usefixtures("quick_report")


class CutOffError(Exception):
    """Stands for whatever ends a run."""


class Watcher:
    """Notes every iteration of one fit, and ends the run at one of them."""

    def __init__(self, fit: str, until: int | None = None) -> None:
        self.fit, self.until, self.told = fit, until, list[str]()

    def __call__(self, event: Event) -> None:
        if isinstance(event, StepProgress) and event.step.startswith(f"Fitting {self.fit}"):
            self.told.append(event.detail)
            if len(self.told) == self.until:
                raise CutOffError


def run(workspace: Path, name: str, watcher: Watcher, **options: Any) -> Results:
    read = Pipeline.read(PipelineConfig, workspace / "pipelines" / "first.yaml")
    return carry_out(program_of(read), workspace / name, command="sysid run first", watchers=[watcher], **options)


def parameters(workspace: Path, name: str) -> dict[str, Any]:
    return read_fit(RunFolder(path=workspace / name).fit("closed-loop")).model.to_dict()


def test_a_fit_goes_on_where_it_was_cut_off(workspace: Path) -> None:
    whole, first, second = Watcher("closed loop"), Watcher("closed loop", until=4), Watcher("closed loop")
    run(workspace, "whole", whole)
    with pytest.raises(CutOffError):
        run(workspace, "parts", first)
    kept = workspace / "parts" / ".steps" / "checkpoints" / "fit-closed-loop.json"
    assert kept.is_file()
    run(workspace, "parts", second)
    assert parameters(workspace, "parts") == parameters(workspace, "whole")
    # No iteration twice, and none left out.
    assert [*first.told, *second.told] == whole.told
    assert not kept.exists()


def test_what_is_asked_otherwise_does_not_go_on_from_it(workspace: Path) -> None:
    with pytest.raises(CutOffError):
        run(workspace, "run", Watcher("closed loop", until=4))
    file = workspace / "pipelines" / "first.yaml"
    file.write_text(file.read_text(encoding="utf-8").replace("seed: 3", "seed: 4"), encoding="utf-8")
    again = Watcher("closed loop")
    run(workspace, "run", again)
    assert "iteration 0" in again.told[0]


def test_fresh_does_not_go_on_from_it(workspace: Path) -> None:
    with pytest.raises(CutOffError):
        run(workspace, "run", Watcher("closed loop", until=4))
    again = Watcher("closed loop")
    run(workspace, "run", again, fresh=True)
    assert "iteration 0" in again.told[0]
