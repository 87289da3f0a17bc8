"""State spaces exported, transfer functions and neural ones: their files compute what the model computes."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.estimation import FitResult, Loop, StabilityOptions, Status
from sysid.export import EXPORTERS, Surrogate, expected_flags, export_bundle, read_bundle
from sysid.export.differences import largest_difference
from sysid.export.expected_runs import RANDOM_SEQUENCES, random_cases
from sysid.export.exporter import Runner
from sysid.export.forms.layout import layout_of
from sysid.kernels.neurons import NEURONS
from sysid.models import (
    BJ,
    NARX,
    OE,
    AbstractModel,
    Cascade,
    Domain,
    History,
    Innovations,
    LinearStateSpace,
    LinearStateSpaceModel,
    Mapping,
    NeuralStateSpace,
    NeuralStateSpaceModel,
    PolynomialModel,
    Scaling,
    Start,
    TransferFunction,
    VectorNeuralStateSpace,
    VectorNeuralStateSpaceModel,
    VectorScaling,
    VectorStateSpace,
    VectorStateSpaceModel,
)
from sysid.models.linear.polynomial_orders import AbstractPolynomial
from sysid.models.linear.transfer_function import TransferFunctionModel
from sysid.traces import Channel, Trace
from sysid.units import Reference
from tests.export.conftest import WRAPPED

FORMATS = ("onnx", "torchscript", "torch-export", "c", "fmi2", "fmi3")
RANGES = {"BP": (0.0, 95.0), "AR": (0.0, 95.0)}


def build(
    domain: Domain = Domain.DISCRETE, *, delays: tuple[int, int] = (1, 3), poles: int = 4
) -> TransferFunctionModel:
    """Slow, well-damped poles for both inputs."""
    rng = np.random.default_rng(0)
    sections = []
    for _ in range(2):
        part = []
        for _ in range(poles // 2):
            r, w = rng.uniform(0.9, 0.99), rng.uniform(0.01, 0.2)
            discrete = np.array([1.0, -2 * r * np.cos(w), r * r])
            part.append(discrete if domain is Domain.DISCRETE else np.array([rng.uniform(0.5, 2.0), 1.0, 1.0]))
        sections.append(tuple(part))
    return TransferFunctionModel(
        orders=TransferFunction(poles=(poles, poles), zeros=(poles - 1, 1), delays=delays, domain=domain),
        sections=tuple(sections),
        taps=(rng.normal(size=poles), rng.normal(size=2)),
        constant=0.2,
        scaling=Scaling(input_offset=(45.0, 70.0), input_scale=(45.0, 20.0), output_offset=38.0, output_scale=40.0),
        mapping=Mapping.parse("BP+AR -> BC"),
        sample_time=0.1,
        input_units=("psi", "psi"),
        output_unit="psi",
        rest_output=0.0,
    )


def build_neural(*, slowest: float = 0.97, **options) -> NeuralStateSpaceModel:
    """Slow states with random neurons; the state at rest depends on inputs and output."""
    network = NeuralStateSpace(states=3, **options)
    sizes = network.sizes(2)
    rng = np.random.default_rng(4)
    theta = 0.1 * rng.normal(size=sizes.count)
    theta[sizes.linear] = np.concatenate([np.diag([slowest, 0.9, 0.8]), 0.05 * rng.normal(size=(3, 3))], axis=1).ravel()
    theta[sizes.output_linear] += [0.6, -0.4, 0.3, 0.0, 0.0, 0.1]
    return NeuralStateSpaceModel(
        network=network,
        theta=theta,
        scaling=Scaling(input_offset=(45.0, 70.0), input_scale=(45.0, 20.0), output_offset=38.0, output_scale=40.0),
        mapping=Mapping.parse("BP+AR -> BC"),
        sample_time=0.1,
        input_units=("psi", "psi"),
        output_unit="psi",
        rest_output=5.0,
        clamp=3.0,
    )


def build_innovations() -> LinearStateSpaceModel:
    """Two slow states and a model of the noise, so that the state at rest depends on the output."""
    rng = np.random.default_rng(7)
    system = Innovations(
        A=np.array([[0.97, 0.1], [-0.1, 0.97]]), B=0.1 * rng.normal(size=(2, 2)), C=rng.normal(size=(1, 2)),
        D=0.1 * rng.normal(size=(1, 2)), K=np.array([[0.3], [0.1]]), constant=np.array([0.2]),
    )  # fmt: skip
    model = build()
    return LinearStateSpaceModel(
        orders=LinearStateSpace(states=2, feedthrough=True),
        system=system,
        **{name: getattr(model, name) for name in TERMS},
    )


def build_vector() -> VectorStateSpaceModel:
    """Two outputs of three states."""
    rng = np.random.default_rng(8)
    model = build()
    system = Innovations(
        A=np.array([[0.97, 0.1, 0.0], [-0.1, 0.97, 0.0], [0.0, 0.1, 0.8]]), B=0.1 * rng.normal(size=(3, 2)),
        C=rng.normal(size=(2, 3)), D=0.1 * rng.normal(size=(2, 2)), K=0.1 * rng.normal(size=(3, 2)),
        constant=np.array([0.2, -0.1]),
    )  # fmt: skip
    scaling = VectorScaling(
        input_offset=(45.0, 70.0), input_scale=(45.0, 20.0), output_offset=(38.0, 1.0), output_scale=(40.0, 0.5)
    )
    return VectorStateSpaceModel(
        orders=VectorStateSpace(states=3, feedthrough=True, nk=(3, 0)), system=system, scaling=scaling,
        mapping=Mapping.parse("BP+AR -> BC+ER"), sample_time=0.1, input_units=model.input_units,
        output_units=("psi", "bar"), rest_outputs=(5.0, 0.9),
    )  # fmt: skip


def build_integrating() -> NeuralStateSpaceModel:
    """A state that adds up, and neurons that see it."""
    model = build_neural(neurons=3, integrators=1, integrators_seen=True)
    return replace(model, theta=model.recursion.sizes.hold(model.theta))


def build_vector_neural(**options) -> VectorNeuralStateSpaceModel:
    """Two outputs that share three states, and the output's neurons."""
    network = VectorNeuralStateSpace(states=3, **options)
    sizes = network.sizes(2, 2)
    rng = np.random.default_rng(9)
    theta = 0.1 * rng.normal(size=sizes.count)
    theta[sizes.linear] = np.concatenate([np.diag([0.97, 0.9, 0.8]), 0.05 * rng.normal(size=(3, 3))], axis=1).ravel()
    theta[sizes.output_linear] += [0.6, -0.4, 0.3, 0.0, 0.0, 0.1, -0.2, 0.5, 0.4, 0.0, 0.0, -0.1]
    vector = build_vector()
    names = ("scaling", "mapping", "sample_time", "input_units", "output_units", "rest_outputs")
    return VectorNeuralStateSpaceModel(
        network=network, theta=theta, clamp=3.0, **{name: getattr(vector, name) for name in names}
    )


def build_ensemble(build: Callable[..., Any], shares: tuple[int, ...], **options) -> Any:
    """Members of one structure that differ a little."""
    one, rng = build(**options), np.random.default_rng(11)
    thetas = [one.theta * (1.0 + 0.1 * rng.normal(size=one.theta.size)) for _ in shares]
    return replace(one, theta=np.concatenate(thetas), shares=shares)


def build_polynomial(orders: AbstractPolynomial, theta: list[float]) -> PolynomialModel:
    model = build()
    return PolynomialModel(orders=orders, theta=np.array(theta), **{name: getattr(model, name) for name in TERMS})


TERMS = ("scaling", "mapping", "sample_time", "input_units", "output_unit", "rest_output")

MODELS = {
    "innovations": build_innovations,
    "innovations, two outputs": build_vector,
    "neural, an integrator": build_integrating,
    "Box-Jenkins": lambda: build_polynomial(
        BJ(nb=(1, 2), nc=1, nd=1, nf=(2, 1), nk=(3, 0)), [0.1, 0.2, -0.1, -1.8, 0.85, -0.9, 0.4, -0.9, 0.1]
    ),
    **{
        f"neural, {kind}": partial(build_neural, neurons=6, output_neurons=3, activation=kind, output=output)
        for kind, output in zip(NEURONS, cycle(["plain", "absolute"]))
    },
    "neural, two outputs": lambda: build_vector_neural(neurons=4),
    "neural, two outputs, output neurons, absolute": lambda: build_vector_neural(
        neurons=3, output_neurons=2, output="absolute"
    ),
    "neural, neurons in the output alone": lambda: build_neural(neurons=0, output_neurons=5),
    "neural, against the bounds of its states": lambda: build_neural(neurons=3, slowest=1.1),
    "neural, an ensemble": lambda: build_ensemble(build_neural, (2, 1, 1), slowest=0.9, neurons=3, output_neurons=2),
    "neural, an ensemble of two outputs, absolute": lambda: build_ensemble(
        build_vector_neural, (1, 1), neurons=3, output="absolute"
    ),
    "discrete": build,
    "continuous": lambda: build(Domain.CONTINUOUS),
    "without dead time": lambda: build(delays=(0, 0)),
    "a sum": lambda: build_polynomial(OE(nb=(1, 2), nf=(2, 1), nk=(3, 0)), [0.1, 0.2, -0.1, -1.5, 0.5, -0.9, 0.1]),
    "20 poles an input": lambda: build(poles=20),
}
FEW = ("innovations, two outputs", "neural, two outputs, output neurons, absolute", "discrete")
"""What the formats around the C source and TorchScript's module meet: a linear state space, a neural one, delays."""
PAIRS = [(model, name) for model in MODELS for name in FORMATS if name not in WRAPPED or model in FEW]


@pytest.fixture(params=MODELS)
def model(request: pytest.FixtureRequest) -> AbstractModel:
    return MODELS[request.param]()


def opened(name: str, surrogate: Surrogate, folder: Path) -> Iterator[Runner]:
    """Every file of a format, loaded."""
    exporter = EXPORTERS[name]
    for file in exporter.write(surrogate, folder):
        yield exporter.load(file, folder)


@pytest.mark.parametrize(("model", "name"), PAIRS, ids=[" - ".join(pair) for pair in PAIRS], indirect=["model"])
def test_files_compute_what_the_model_computes(model, name, inputs, tmp_path) -> None:
    surrogate = Surrogate.of(model, RANGES)
    cars = [inputs(200, 2, seed=seed) for seed in (1, 2)]
    past = np.linspace(0.0, 30.0, 30)
    if model.structure.several_outputs:
        past = np.column_stack([past, 1.0 - 0.01 * past])
    histories = [
        History(inputs=inputs(30, 2, seed=9), output=past),
        History.at_rest(inputs=cars[1][0], output=past[0]),
    ]
    states = np.stack([layout_of(model).from_history(history) for history in histories])
    for run in opened(name, surrogate, tmp_path):
        whole = run(np.stack(cars, axis=1), states)
        for i, (u, history) in enumerate(zip(cars, histories, strict=True)):
            expected = model.simulate(u, history).reshape(len(u), -1)
            assert largest_difference(whole.output[:, i], expected) <= 1e-9
            np.testing.assert_array_equal(whole.flags[:, i], expected_flags(surrogate, u, expected))
        half = run(np.stack(cars, axis=1)[:70], states)
        rest = run(np.stack(cars, axis=1)[70:], half.state)
        np.testing.assert_array_equal(np.concatenate([half.output, rest.output]), whole.output)
        np.testing.assert_array_equal(rest.state, whole.state)


@pytest.mark.parametrize(
    "compiler",
    [["gcc", "-std=c99", "-O2"], ["g++", "-x", "c++", "-std=c++17", "-fsyntax-only"]],  # what -O2 finds is in both
    ids=["C99", "C++17"],
)
def test_no_compiler_has_a_word_to_say(model, compiler, tmp_path) -> None:
    if shutil.which(compiler[0]) is None:
        pytest.skip(f"no {compiler[0]} here")
    (file,) = EXPORTERS["c"].write(Surrogate.of(model, RANGES), tmp_path)
    strict = ["-Wall", "-Wextra", "-Wconversion", "-pedantic"]
    for real in ([], [f"-D{file.details['float32_macro']}"]):
        command = [*compiler, *strict, *real, "-c", file.name, "-o", "out.o"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("name", FORMATS)
def test_a_cascade_may_hold_some(narx, name, inputs, tmp_path) -> None:
    first = narx(NARX(input_delays=2, output_delays=2, neurons=3))
    second = replace(build(), mapping=Mapping.parse("BC+AR -> X"))
    third = replace(build_neural(neurons=4, output_neurons=2), mapping=Mapping.parse("BC+AR -> Y"))
    surrogate = Surrogate.of(Cascade(models=(first, second, third)), RANGES)
    u = inputs(100, 2)
    for run in opened(name, surrogate, tmp_path):
        result = run(u[:, np.newaxis], surrogate.at_rest(u[0])[np.newaxis])
        assert largest_difference(result.output[:, 0], surrogate.simulate(u)) <= 1e-9


def test_at_rest_can_be_computed_from_what_the_manifest_says(model) -> None:
    surrogate = Surrogate.of(model, RANGES)
    (space,) = surrogate.state_text()["state_spaces"]
    channels = (*model.mapping.inputs, *model.mapping.outputs)
    levels = dict(zip(channels, surrogate.levels(np.array([88.0, 70.0])), strict=True))
    scaled = (np.array([levels[name] for name in space["channels"]]) - space["offset"]) / space["scale"]
    state = np.clip(space["constant"] + np.array(space["at_rest"]) @ scaled, -space.get("bound", 1e9), 1e9)
    np.testing.assert_allclose(state, surrogate.at_rest(np.array([88.0, 70.0])), atol=1e-9)
    assert space["size"] == surrogate.state_size


def with_another(trace: Trace) -> Trace:
    """The record with a second output."""
    channels = (*trace.channels, Channel(name="ER", unit="bar", reference=Reference.GAUGE))
    return replace(trace, channels=channels, values=np.column_stack([trace.values, 0.1 * trace["BC"]]))


def test_a_bundle_carries_one(model, traces, tmp_path, monkeypatch) -> None:
    """Checked over few sequences: what many tell of a model is looked at with the checks."""
    monkeypatch.setattr("sysid.export.stability.StabilityOptions", partial(StabilityOptions, count=15))
    monkeypatch.setattr("sysid.export.writing.random_cases", partial(random_cases, sequences=RANDOM_SEQUENCES // 10))
    fit = FitResult(
        model=model, status=Status.CONVERGED, loop=Loop.CLOSED, train_time_s=1.0,
        history={"iteration": np.arange(2.0), "mse": np.array([2.0, 1.0])},
    )  # fmt: skip
    traces = replace(traces, traces=tuple(with_another(trace) for trace in traces))
    export_bundle(fit, traces, tmp_path / "bundle", start=Start(), formats=("onnx",))
    again = read_bundle(tmp_path / "bundle").model
    u = traces["EST01"].columns(["BP", "AR"])
    np.testing.assert_array_equal(again.simulate(u), model.simulate(u))
    verify = [sys.executable, "-I", tmp_path / "bundle" / "verify" / "verify.py"]
    done = subprocess.run(verify, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count(": as recorded") == 3


@pytest.mark.parametrize("name", ["onnx-float32", "c-float32"])
@pytest.mark.parametrize("model", ["discrete", "neural, tanh"], indirect=True)
def test_float32_stays_near_over_a_long_run(model, name, inputs, tmp_path) -> None:
    surrogate = Surrogate.of(model, RANGES)
    u = inputs(3000, 2).astype(np.float32).astype(np.float64)
    expected = surrogate.simulate(u)
    exporter = EXPORTERS[name]
    for file in exporter.write(surrogate, tmp_path):
        run = exporter.load(file, tmp_path)(u[:, np.newaxis], surrogate.at_rest(u[0])[np.newaxis])
        # As a thousandth of a psi in ninety; this model's output moves over thousands.
        assert largest_difference(run.output[:, 0], expected) <= 1e-3 / 90.0 * np.ptp(expected)
