"""Linear fits in a pipeline: written in YAML, fitted by their estimator, stored under their own key."""

from __future__ import annotations

from pathlib import Path

import pytest

from sysid.errors import UserError
from sysid.estimation import Loop
from sysid.models import Domain, TransferFunction
from sysid.workbench.fits import steps
from sysid.workbench.fits.config import Pipeline, PipelineConfig, find_pipeline
from sysid.workbench.fits.data import load_data
from tests.workbench.pipelines import parse_pipeline

ARX = "structure: {kind: ARX, na: 1, nb: [1, 1], nk: [1, 1]}"
TF = "structure: {kind: TransferFunction, poles: [1, 1], zeros: [0, 0], delays: [1, 1]}"


def text(workspace: Path) -> str:
    found = (workspace / "pipelines" / "first.yaml").read_text(encoding="utf-8")
    assert ARX in found
    return found


def test_a_transfer_function_is_fitted_by_its_estimator(workspace: Path) -> None:
    config = parse_pipeline(text(workspace).replace(ARX, TF))
    data = load_data(config, beside=workspace / "pipelines", progress=lambda _: None)
    (fit,) = [fit for fit in config.fits if isinstance(fit.structure, TransferFunction)]
    result = steps.fit_traces(fit, config, data, None, lambda _: None)
    assert result.model.structure == fit.structure
    assert result.loop is Loop.CLOSED
    assert result.seed == config.seed
    assert steps.score(result, data, config).evaluation.cases


def test_its_key_knows_orders_seed_and_selection(workspace: Path) -> None:
    def key(source: str) -> str:
        config = parse_pipeline(source)
        data = load_data(config, beside=workspace / "pipelines", progress=lambda _: None)
        (fit,) = [fit for fit in config.fits if isinstance(fit.structure, TransferFunction)]
        return steps.fit_key(fit, config, data, None)

    plain = text(workspace).replace(ARX, TF)
    changed = [plain.replace("poles: [1, 1]", "poles: [2, 1]"), plain.replace("seed: 3", "seed: 4")]
    assert len({key(plain), *map(key, changed)}) == 3
    assert key(plain) == key(plain.replace("name: first", "name: second"))


@pytest.mark.parametrize(
    ("new", "said"),
    [
        (TF.replace("poles: [1, 1]", "poles: [1]"), "no more zeros than poles"),
        (TF.replace("[1, 1], zeros: [0, 0], delays: [1, 1]", "[2, 2, 2], zeros: 1"), "do not match the inputs"),
        (TF.replace("structure", "training: {loop: open}, structure"), "unknown field 'loop'"),
        (TF.replace("delays", "domain: laplace, delays"), "unknown domain"),
    ],
    ids=["lengths differ", "three numbers for two inputs", "training", "domain"],
)
def test_a_mistake_is_named(workspace: Path, new: str, said: str) -> None:
    with pytest.raises(UserError, match=said):
        parse_pipeline(text(workspace).replace(ARX, new))


def test_continuous_transfer_functions_are_written_by_their_domain(workspace: Path) -> None:
    config = parse_pipeline(text(workspace).replace(ARX, TF.replace("delays", "domain: continuous, delays")))
    assert config.fits[0].structure.domain is Domain.CONTINUOUS


def test_the_linearity_pipeline_is_readable() -> None:
    config = Pipeline.read(PipelineConfig, find_pipeline("linearity")).config
    kinds = [fit.structure.kind for fit in config.fits]
    assert kinds.count("TransferFunction") == 3
    assert {"ARX", "NARX"} <= set(kinds)
