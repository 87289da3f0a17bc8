"""What a run stores of its fits beyond their figures."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from sysid.estimation import FitResult, Status
from sysid.models import StartKind
from sysid.reporting.residuals import read_residuals
from sysid.traces import Role
from sysid.validation import analyse_residuals
from sysid.workbench.fits import steps
from sysid.workbench.fits.config import PipelineConfig
from sysid.workbench.fits.data import Data, load_data
from sysid.workbench.fits.evidence import linearity, residuals
from sysid.workbench.fits.record import write_residuals
from sysid.workbench.runner.events import FitReady
from tests.workbench.pipelines import parse_pipeline

Fitted = tuple[PipelineConfig, Data, dict[str, FitResult]]


@pytest.fixture
def fitted(workspace: Path) -> Fitted:
    config = parse_pipeline((workspace / "pipelines" / "first.yaml").read_text(encoding="utf-8"))
    data = load_data(config, beside=workspace / "pipelines", progress=lambda _: None)
    fits = {fit.name: steps.fit_traces(fit, config, data, None, lambda _: None) for fit in config.fits[:2]}
    return config, data, fits


def ready(fitted: Fitted, name: str, status: Status | None = None) -> FitReady:
    config, data, fits = fitted
    fit = fits[name] if status is None else dataclasses.replace(fits[name], status=status)
    (asked,) = [one for one in config.fits if one.name == name]
    scores = steps.score(fit, data, config)
    return FitReady(
        config=asked,
        pipeline=config,
        key="",
        fit=fit,
        evaluation=scores.evaluation,
        selection_mse=1.0,
        stored=False,
        folder=Path(),
    )


@pytest.mark.parametrize("name", ["ARX", "open loop"])
def test_residuals_are_stored_of_fitted_and_unseen_cases(fitted: Fitted, tmp_path: Path, name: str) -> None:
    config, data, fits = fitted
    write_residuals(tmp_path, residuals(fits[name], data, config))
    stored = read_residuals(tmp_path)
    assert {group: found.cases for group, found in stored.items()} == {"estimation": ["run-1"], "unseen": ["run-3"]}
    again = analyse_residuals(fits[name].model, data.traces.with_role(Role.VALIDATION), config.start)
    found = stored["unseen"].analysis
    assert found is not None
    np.testing.assert_array_equal(found.whiteness.values, again.whiteness.values)
    assert [entry.name for entry in found.inputs] == ["inlet", "valve"]
    assert (found.white, found.independent) == (again.white, again.independent)
    assert tuple(found.sentences) == again.sentences


def test_a_case_too_short_to_analyse_is_recorded_with_its_reason(fitted: Fitted) -> None:
    config, data, fits = fitted
    late = dataclasses.replace(config.start, kind=StartKind.MEASURED, n_measured=390)
    found = residuals(fits["ARX"], data, _with_start(config, late))["groups"]["unseen"]
    assert found["analysis"] is None
    assert "10 residuals" in found["reason"]


def _with_start(config: PipelineConfig, start: object) -> PipelineConfig:
    return config.model_copy(update={"start": start})


def test_the_linearity_verdict_compares_the_kinds_by_amplitude(fitted: Fitted) -> None:
    found = linearity([ready(fitted, "ARX"), ready(fitted, "open loop")], "ARX")
    assert found is not None
    (row,) = found["rows"]
    assert (row["amplitude"], row["cases"], row["linear"], row["network"]) == ("full", ["run-3"], "ARX", "open loop")
    assert row["linear_fit"] == ready(fitted, "ARX").evaluation.cases["run-3"].free_run.nrmse_fit


def test_there_is_no_verdict_without_a_usable_fit_of_each_kind(fitted: Fitted) -> None:
    assert linearity([ready(fitted, "ARX")], "ARX") is None
    assert linearity([ready(fitted, "ARX"), ready(fitted, "open loop", Status.NOT_IMPROVED)], None) is None
