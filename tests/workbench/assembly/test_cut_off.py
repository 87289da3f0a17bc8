"""An assembly that is cut off goes on with the fit or the round that it was at; its results are exported by name."""

from __future__ import annotations

from pathlib import Path

import pytest

from sysid.export import read_bundle
from sysid.models import Cascade
from sysid.workbench.assembly.runner import program, read_assembly
from sysid.workbench.cli import run_cli
from sysid.workbench.kinds import RunRequest
from sysid.workbench.listeners import foresee
from sysid.workbench.runner.events import Event, StepProgress
from sysid.workbench.runner.program import carry_out


class CutOffError(Exception):
    """Stands for whatever ends a run."""


def run(workspace: Path, name: str, *, told: list[str], until: tuple[str, int] | None = None) -> None:
    """Run the assembly; until a step whose title begins so has told so often."""

    def watch(event: Event) -> None:
        if isinstance(event, StepProgress) and "iteration" in event.detail:
            told.append(f"{event.step}: {event.detail}")
            if until and sum(one.startswith(until[0]) for one in told) == until[1]:
                raise CutOffError

    request = RunRequest(path=workspace / "pipelines" / "tanks.yaml", typed="tanks")
    carry_out(program(request), workspace / "runs" / name, command="sysid run tanks", watchers=[watch])


def test_members_and_rounds_go_on_where_they_were_cut_off(workspace: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole, parts = list[str](), list[str]()
    run(workspace, "whole", told=whole)
    for until in [("Fitting upper -> lower", 12), ("Training end to end", 3)]:
        with pytest.raises(CutOffError):
            run(workspace, "tanks", told=parts, until=until)
    run(workspace, "tanks", told=parts)
    assert parts == whole
    expected = read_assembly(workspace / "runs" / "whole")
    assert read_assembly(workspace / "runs" / "tanks").to_dict() == expected.to_dict()

    planned = foresee(program(request := RunRequest(path=Path("pipelines/tanks.yaml"), typed="tanks")), request)
    stored = {step.name for step in planned if step.stored}
    assert {"together", "choosing", "scoring", "assembly"} < stored
    assert sum(name.startswith("fit-") for name in stored) == 4
    assert {step.basis for step in planned if step.name == "monte_carlo"} == {"as last time"}

    # Whatever came of a step can be had by its name.
    assert run_cli(["export", "tanks", "--fit", "upper -> lower 0", "--out", "lower"]) == 0
    assert str(read_bundle(Path("lower")).model.mapping) == "upper -> lower"
    assert run_cli(["export", "tanks", "--fit", "assembly", "--out", "all"]) == 0
    exported = read_bundle(Path("all")).model
    assert isinstance(exported, Cascade)
    assert exported.outputs == expected.outputs
    assert run_cli(["export", "tanks", "--fit", "togethr"]) == 2
    assert "did you mean together?" in capsys.readouterr().err


def test_members_that_were_never_fitted_are_timed(workspace: Path) -> None:
    request = RunRequest(path=Path("pipelines/tanks.yaml"), typed="tanks")
    planned = {step.name: step for step in foresee(program(request), request)}
    fits = [step for name, step in planned.items() if name.startswith("fit-") and "retrained" not in name]
    assert len(fits) == 3
    assert all(step.seconds and "one step ahead, then 10 iterations of" in step.basis for step in fits)
    assert all(step.seconds for name, step in planned.items() if "retrained" in name)
    together = planned["together"]
    assert together.seconds
    assert together.basis.startswith("at most: ")
    assert together.basis.endswith("timed with untrained members")
    assert not (workspace / "runs").exists()
