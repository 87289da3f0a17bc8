"""Neural state spaces in a pipeline: written in YAML, fitted by their estimator, checked like other networks."""

from __future__ import annotations

from pathlib import Path

import pytest

from sysid.errors import UserError
from sysid.models import NeuralStateSpace
from sysid.workbench.fits import steps
from sysid.workbench.fits.data import load_data
from tests.workbench.pipelines import parse_pipeline

ARX = "structure: {kind: ARX, na: 1, nb: [1, 1], nk: [1, 1]}"
NSS = "structure: {kind: NSS, states: 1, neurons: 3}, training: {max_iterations: 30}"


def text(workspace: Path, new: str) -> str:
    return (workspace / "pipelines" / "first.yaml").read_text(encoding="utf-8").replace(ARX, new)


def test_a_neural_state_space_is_fitted_by_its_estimator(workspace: Path) -> None:
    config = parse_pipeline(text(workspace, NSS))
    data = load_data(config, beside=workspace / "pipelines", progress=lambda _: None)
    fit = config.fits[0]
    result = steps.fit_traces(fit, config, data, None, lambda _: None)
    assert result.model.structure == NeuralStateSpace(states=1, neurons=3)
    assert result.attempts[0].seed == config.seed
    evaluation = steps.score(result, data, config).evaluation
    assert min(case.free_run.nrmse_fit for case in evaluation.cases.values()) > 25.0


@pytest.mark.parametrize(
    ("new", "said"),
    [
        (NSS.replace("states: 1", "states: 0"), "number of states"),
        (NSS.replace("neurons", "nuerons"), "neurons"),
        (NSS + ", initial: closed loop", "initial fit"),
    ],
    ids=["no state", "misspelt", "initial fit"],
)
def test_a_mistake_is_named(workspace: Path, new: str, said: str) -> None:
    with pytest.raises(UserError, match=said):
        parse_pipeline(text(workspace, new))
