"""Records without input: a decay, a time series."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import sysid
from sysid.models import History, Mapping, StartKind

N = 60
AFTER_ONE = sysid.Start(kind=StartKind.MEASURED, n_measured=1)


def decay(first: float = 2.0) -> np.ndarray:
    return first * 0.9 ** np.arange(N)


def test_a_mapping_may_have_no_input() -> None:
    assert Mapping.parse("-> y") == Mapping(inputs=(), output="y")
    assert str(Mapping.parse("-> y")) == "-> y"


def test_an_autoregressive_model_has_the_decay_s_pole() -> None:
    traces = sysid.data(decay(), sample_time=0.1)
    fit = sysid.fit(traces, "-> y", sysid.ARX(na=1, nb=(), nk=(), intercept=False), start=AFTER_ONE)
    assert fit.model.structure.label == "AR [1]"
    assert_allclose(fit.model.coefficients, [0.9], atol=1e-12)
    assert_allclose(fit.simulate(N - 1, initial=2.0), decay()[1:], atol=1e-12)


@pytest.mark.parametrize(
    ("structure", "label"),
    [
        (sysid.NARX(input_delays=[], output_delays=1, neurons=2), "NAR 1/2"),
        (sysid.NeuralStateSpace(states=1, neurons=2), "NSS 1/2"),
    ],
)
def test_networks_follow_a_decay(structure: object, label: str) -> None:
    traces = sysid.data([decay(2.0), decay(-1.0)], outputs="y", sample_time=0.1)
    fit = sysid.fit(traces, "-> y", structure, sysid.Training(max_iterations=200, seed=1), start=AFTER_ONE)
    assert fit.model.structure.label == label
    found = sysid.compare(traces, fit, start=AFTER_ONE).to_frame()
    assert found["fit"].min() > 95.0


def test_a_history_is_taken() -> None:
    traces = sysid.data(decay(), sample_time=0.1)
    fit = sysid.fit(traces, "-> y", sysid.ARX(na=1, nb=(), nk=()), start=AFTER_ONE)
    history = History(inputs=np.zeros((1, 0)), output=[1.0])
    assert_allclose(fit.simulate(3, initial=history), [0.9, 0.81, 0.729], atol=1e-9)


MODELS = {
    "AR": ("-> y", sysid.ARX(na=1, nb=(), nk=())),
    "NSS": ("-> y", sysid.NeuralStateSpace(states=1, neurons=1)),
    "one NSS of two outputs": ("-> y+z", sysid.NeuralStateSpace(states=1, neurons=1)),
    "AR of two outputs": ("-> y+z", sysid.ARX(na=1, nb=(), nk=())),
    "a vector autoregression": ("-> y+z", sysid.VectorARX(na=1, nb=[], nk=[])),
    "one network of two outputs": ("-> y+z", sysid.VectorNARX(input_delays=[], output_delays=1, neurons=1)),
}
TRAININGS = {"NSS": sysid.Training(max_iterations=5), "VectorNARX": sysid.Training(max_iterations=2)}


@pytest.mark.parametrize("name", MODELS)
def test_a_model_without_input_is_exported(name: str, tmp_path: Path) -> None:
    mapping, structure = MODELS[name]
    traces = sysid.data({"y": decay(), "z": 2.0 * decay() + 1.0}, inputs=[], outputs=["y", "z"], sample_time=0.1)
    unchecked = sysid.StabilityOptions(count=0)
    fit = sysid.fit(traces, mapping, structure, TRAININGS.get(structure.kind), stability=unchecked)
    bundle = fit.save(tmp_path / "bundle", formats=("onnx", "c") if name == "AR" else ("onnx",))
    assert [one["name"] for one in bundle.inputs] == ["tick"]
    assert max(file.largest_difference for file in bundle.files) < 1e-9
    assert_allclose(bundle.simulate(20), fit.simulate(20), atol=1e-9)
