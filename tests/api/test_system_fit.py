"""Fits of several outputs: a model for each, or one of all; and what they are run on, by name."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import sysid
from sysid.api.system_fit import TRUSTED_LEAST
from sysid.errors import ChannelError, ConfigError, TraceError, UserError
from sysid.estimation import Status
from tests.api.first_order import ORDERS, U, Y


@pytest.fixture(scope="module")
def system() -> sysid.SystemFit:
    frame = pd.DataFrame({"u": U, "y": Y, "z": 2.0 * Y + 1.0})
    found = sysid.fit(sysid.data(frame, inputs="u", outputs=["y", "z"], sample_time=0.1), "u -> y+z", ORDERS)
    assert isinstance(found, sysid.SystemFit)
    return found


OUTPUTS: dict[str, Any] = {
    "columns in another order": pd.DataFrame({"z": 2.0 * Y + 1.0, "u": U, "y": Y}),
    "dict": {"z": 2.0 * Y + 1.0, "y": Y},
    "trace": sysid.data({"z": 2.0 * Y + 1.0, "y": Y}, sample_time=0.1)["record"],
}


@pytest.mark.parametrize("kind", OUTPUTS)
def test_measured_outputs_are_taken_by_their_names(system: sysid.SystemFit, kind: str) -> None:
    expected = system.predict(np.column_stack([Y, 2.0 * Y + 1.0]), U)
    assert_array_equal(system.predict(OUTPUTS[kind], U), expected)


STAMPS = pd.date_range("2024-01-01", periods=100, freq="100ms")
REFUSED: dict[str, Any] = {
    "channels in rows": np.vstack([Y, Y]),
    "a third column": np.column_stack([Y, Y, Y]),
    "a missing value": np.column_stack([Y, np.where(Y > 0.5, np.nan, Y)]),
    "an infinite one": np.column_stack([Y, np.where(Y > 0.5, np.inf, Y)]),
    "rows of other stamps": pd.DataFrame({"y": Y, "z": Y}, index=STAMPS + pd.Timedelta("100ms")),
    "another rate": pd.DataFrame({"y": Y, "z": Y}, index=pd.date_range("2024-01-01", periods=100, freq="50ms")),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_measured_outputs_that_do_not_go_with_the_inputs_are_refused(system: sysid.SystemFit, kind: str) -> None:
    u = pd.DataFrame({"u": U}, index=STAMPS)
    with pytest.raises(UserError):
        system.predict(REFUSED[kind], u)
    y = REFUSED[kind]["y"] if kind.startswith("rows") else y_of(REFUSED[kind])
    with pytest.raises(UserError):
        system["y"].predict(y, u)
    with pytest.raises(UserError):
        system.simulate(u, initial=(u, REFUSED[kind]))


def y_of(y: Any) -> Any:
    """What a fit of one output refuses for the same reason."""
    return y[:, 1:] if getattr(y, "shape", ())[1:] == (2,) and not hasattr(y, "columns") else y


def test_a_prediction_of_all_outputs_begins_where_it_is_told(system: sysid.SystemFit) -> None:
    y = np.column_stack([Y, 2.0 * Y + 1.0])
    found = system.predict(y[5:], U[5:], initial=(U[:5], y[:5]))
    assert_allclose(found, y[5:], atol=1e-12)
    assert_allclose(system.predict(y, U, initial={"y": 3.0})[0], [2.4, 1.0], atol=1e-12)


@pytest.mark.parametrize("initial", [[1.0, 2.0], "a", float("nan")])
def test_levels_of_several_outputs_are_by_name(system: sysid.SystemFit, initial: Any) -> None:
    with pytest.raises(ConfigError, match="one finite number") as refused:
        system.simulate(U, initial=initial)
    assert "several outputs are a dict by name" in str(refused.value.remedy)
    with pytest.raises(TraceError, match="no samples before a run") as refused_pair:
        system.simulate(U, initial=(1.0, 2.0))
    assert 'initial={"y": ..., "z": ...}' in str(refused_pair.value.remedy)
    assert_allclose(system.simulate(U, initial=2.0), system.simulate(U, initial={"y": 2.0, "z": 2.0}))


@pytest.mark.parametrize("whole", [True, False], ids=["one model", "a model an output"])
def test_residuals_of_several_outputs_are_asked_for_by_name(system: sysid.SystemFit, whole: bool) -> None:
    data = system.traces
    found = sysid.fit(data, "u -> y+z", sysid.LinearStateSpace(states=1)) if whole else system
    assert found.residuals(output="z").n_samples > 50
    with pytest.raises(ConfigError, match="one output at a time") as refused:
        found.residuals()
    assert 'residuals(output="y")' in str(refused.value.remedy)
    with pytest.raises(ChannelError, match="missing channel w"):
        found.residuals(output="w")


def test_several_outputs_are_one_system(system: sysid.SystemFit) -> None:
    assert system.outputs == ("y", "z")
    assert_allclose(system.simulate(U, initial={"y": 0.0, "z": 1.0}), np.column_stack([Y, 2.0 * Y + 1.0]), atol=1e-10)
    assert repr(system) == "<SystemFit of y, z: EXACT, EXACT>"
    assert system["z"].model.mapping.output == "z"
    assert len(system.plot().axes) == 2
    assert system.summary().count("ARX [1; 1; 1], u") == 2
    with pytest.raises(ChannelError):
        system["x"]
    with pytest.raises(ChannelError):
        system.simulate(U, initial={"x": 0.0})


def test_several_outputs_are_saved_as_one_file(system: sysid.SystemFit, tmp_path: Path) -> None:
    bundle = system.save(tmp_path / "bundle", formats=("onnx",))
    assert [output["name"] for output in bundle.outputs] == ["y", "z"]
    assert {file.name for file in bundle.files} == {"step.onnx", "sequence.onnx"}
    assert_allclose(bundle.simulate(U, initial={"y": 0.0, "z": 1.0}), np.column_stack([Y, 2.0 * Y + 1.0]), atol=1e-10)
    with pytest.raises(ChannelError):
        bundle.simulate(U, initial={"x": 0.0})


@pytest.fixture(scope="module")
def whole() -> sysid.Fit:
    """One network of both outputs."""
    frame = pd.DataFrame({"u": U, "y": Y, "z": 2.0 * Y + 1.0})
    traces = sysid.data(frame, inputs="u", outputs=["y", "z"], sample_time=0.1)
    network = sysid.VectorNARX(input_delays=1, output_delays=1, neurons=1)
    training = sysid.Training(max_iterations=15)
    found = sysid.fit(traces, "u -> y+z", network, training, stability=sysid.StabilityOptions(count=5))
    assert isinstance(found, sysid.Fit)
    return found


def test_a_structure_with_several_outputs_is_one_fit(whole: sysid.Fit) -> None:
    both = np.column_stack([Y, 2.0 * Y + 1.0])
    assert_allclose(whole.simulate(U, initial={"y": 0.0, "z": 1.0}), both, atol=0.3)
    assert_allclose(whole.predict(both, U, steps=2), both, atol=0.3)
    assert whole.residuals(output="z").n_samples > 50
    figures = sysid.compare(whole.traces, whole).to_frame()
    assert figures["output"].tolist() == ["y", "z"]
    assert figures["fit"].min() > 80.0
    assert len(whole.plot().axes) == 2
    with pytest.raises(ChannelError, match="initial"):
        whole.simulate(U, initial={"x": 0.0})


def test_a_structure_with_several_outputs_is_saved_as_one_model(whole: sysid.Fit, tmp_path: Path) -> None:
    bundle = whole.save(tmp_path / "bundle", formats=("onnx", "c"))
    assert [one["name"] for one in bundle.outputs] == ["y", "z"]
    assert_allclose(bundle.simulate(U), whole.simulate(U), atol=1e-9)
    again = sysid.read_bundle(tmp_path / "bundle")
    assert_array_equal(again.simulate(U, initial={"y": 0.3}), bundle.simulate(U, initial={"y": 0.3}))


def test_a_fit_of_several_outputs_says_how_it_ended_as_any_other() -> None:
    """A loop over structures asked each fit for its status, and that of several models had none."""
    assert set(TRUSTED_LEAST) == set(Status)
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1.0, 1.0, 30), 10)
    y = np.convolve(u, 0.1 * 0.9 ** np.arange(300))[:300] + 0.01 * rng.standard_normal(300)
    traces = sysid.data((u, np.column_stack([y, np.full(300, 2.0)])), sample_time=1.0)
    fit = sysid.fit(traces, "u -> y1+y2", sysid.ARX(na=1, nb=1, nk=1))
    assert isinstance(fit, sysid.SystemFit)
    assert fit.status is Status.EXACT
    assert any(note.startswith("y2: y2 never changes") for note in fit.warnings)
    worse = replace(fit["y1"], status=Status.UNSTABLE)
    assert sysid.SystemFit.of({"y1": worse, "y2": fit["y2"]}).status is Status.UNSTABLE
