"""The contract of every kind of neuron: compiled, in numpy, torch, ONNX and C it is one function, and its slope is its.

A new row of the table enters here, and where networks run, are trained and are exported, by itself.
"""

from __future__ import annotations

import warnings

import numpy as np
import onnx
import onnxruntime
import pytest
import torch
from numpy.testing import assert_allclose, assert_array_equal

from sysid.errors import ConfigError
from sysid.export.onnx.nodes import IR_VERSION, OPSET, Nodes
from sysid.kernels.neurons import NEURONS, code_of
from sysid.kernels.neurons.table import activate, activate_with_slopes, slopes_of_sums, slopes_of_values
from sysid.models import NARX, NeuralStateSpace, VectorNARX

SUMS = np.concatenate([[0.0, -0.0], np.linspace(-4.0, 4.0, 37), [1e-9, -25.0, 25.0]])

kinds = pytest.mark.parametrize("kind", NEURONS)


@kinds
def test_the_compiled_function_is_the_one_of_numpy(kind):
    a = np.full(len(SUMS) + 5, 0.5)
    a[3:-2] = SUMS
    activate(code_of(kind), a, 3, len(SUMS))
    assert_allclose(a[3:-2], NEURONS[kind].value(SUMS), rtol=1e-14, atol=1e-15)
    assert_array_equal(a[[0, 1, 2, -2, -1]], 0.5)


@kinds
def test_a_padded_block_may_be_run_through_it(kind):
    """What stands in a block without a neuron is zero, and is weighted with zero."""
    assert np.isfinite(NEURONS[kind].value(np.zeros(1))).all()


@kinds
def test_the_slope_is_the_derivative(kind):
    neuron, step = NEURONS[kind], 1e-6
    expected = (neuron.value(SUMS + step) - neuron.value(SUMS - step)) / (2.0 * step)
    assert_allclose(neuron.slope(SUMS), expected, rtol=1e-6, atol=1e-8)


def test_a_kind_says_whether_it_stays_below_some_number():
    assert {name: neuron.bounded for name, neuron in NEURONS.items()} == {"tanh": True, "cubic": False}


@kinds
def test_the_compiled_slope_is_the_one_of_numpy(kind):
    a, slope = SUMS.copy(), np.empty(len(SUMS))
    activate_with_slopes(code_of(kind), a, slope)
    assert_allclose(a, NEURONS[kind].value(SUMS), rtol=1e-14, atol=1e-15)
    assert_allclose(slope, NEURONS[kind].slope(SUMS), rtol=1e-13, atol=1e-15)


@kinds
def test_slopes_are_found_again_from_what_was_kept(kind):
    rng = np.random.default_rng(1)
    W, b, x = rng.normal(size=(5, 3)), rng.normal(size=5), rng.normal(size=3)
    theta = np.concatenate([[9.0, 9.0], W.ravel(), b])
    a, slope = np.empty(7), np.empty(7)
    slopes_of_sums(code_of(kind), theta, 2, 5, x, 3, a, slope)
    assert_allclose(slope[:5], NEURONS[kind].slope(W @ x + b), rtol=1e-13)
    slope[:] = np.nan
    found = slopes_of_values(code_of(kind), NEURONS[kind].value(W @ x + b), 5, slope)
    assert_allclose(slope[:5], NEURONS[kind].slope(W @ x + b) if found else np.nan, rtol=1e-13)
    assert found == (kind == "tanh")


@kinds
def test_what_is_not_a_number_stays_so(kind):
    a, slope = np.array([np.nan, 0.5, np.nan]), np.empty(3)
    activate(code_of(kind), a, 0, 2)
    assert_array_equal(np.isnan(a), [True, False, True])
    activate_with_slopes(code_of(kind), a, slope)
    assert_array_equal(np.isnan(a), [True, False, True])
    assert_array_equal(np.isnan(slope), [True, False, True])


def test_of_a_kind_that_is_not_compiled_nothing_is_a_number():
    """As where a kernel is older than the table."""
    a, slope = np.zeros(4), np.zeros(4)
    activate(len(NEURONS), a, 1, 2)
    assert_array_equal(np.isnan(a), [False, True, True, False])
    activate_with_slopes(len(NEURONS), a, slope)
    assert np.isnan([a, slope]).all()


@kinds
def test_the_torch_module_can_be_scripted_and_derived(kind):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # torch would rather have torch.export
        module = torch.jit.script(NEURONS[kind].torch())
    x = torch.tensor(SUMS, requires_grad=True)
    y = module(x)
    assert_allclose(y.detach().numpy(), NEURONS[kind].value(SUMS), rtol=1e-14, atol=1e-15)
    y.sum().backward()
    assert_allclose(x.grad.numpy(), NEURONS[kind].slope(SUMS), rtol=1e-12, atol=1e-15)
    assert module(x.float()).dtype == torch.float32


@kinds
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_the_onnx_nodes_compute_it(kind, dtype):
    nodes = Nodes(dtype)
    output = NEURONS[kind].onnx(nodes, "x", "y")
    graph = nodes.graph("one", [nodes.value("x", ["n"])], [nodes.value(output, ["n"])])
    proto = onnx.helper.make_model(graph, opset_imports=[onnx.helper.make_opsetid("", OPSET)], ir_version=IR_VERSION)
    onnx.checker.check_model(proto, full_check=True)
    session = onnxruntime.InferenceSession(proto.SerializeToString(), providers=["CPUExecutionProvider"])
    (y,) = session.run(None, {"x": SUMS.astype(dtype)})
    assert y.dtype == dtype
    assert_allclose(y, NEURONS[kind].value(SUMS), rtol=1e-13 if dtype is np.float64 else 1e-5, atol=1e-7)


@kinds
@pytest.mark.parametrize(
    "build",
    [
        lambda kind: NARX(input_delays=2, output_delays=2, neurons=3, activation=kind),
        lambda kind: VectorNARX(input_delays=2, output_delays=2, neurons=3, activation=kind),
        lambda kind: NeuralStateSpace(states=2, neurons=3, activation=kind),
    ],
    ids=["NARX", "VectorNARX", "NSS"],
)
def test_every_network_takes_it_and_says_so(kind, build):
    structure = build(kind)
    written = structure.to_dict()
    del written["kind"]
    assert type(structure)(**written) == structure
    assert structure.label.endswith(f" {kind}") == (kind != "tanh")
    with pytest.raises(ConfigError, match="unknown activation") as refused:
        build("step")
    assert refused.value.expected == " or ".join(NEURONS)
