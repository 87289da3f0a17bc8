"""What the ONNX files contain, beside computing the right numbers."""

from __future__ import annotations

import collections
from dataclasses import replace
from itertools import pairwise

import numpy as np
import onnx
import pytest

from sysid.export import Kind, Surrogate, expected_flags
from sysid.export.onnx.core import PRODUCT
from sysid.export.onnx.exporter import OnnxExporter
from sysid.models import ARX, NARX, ARXModel, Cascade, Limit, Mapping, VectorNARX
from tests.export.cascades import wired_narx, wired_vector


def written(exporter, surrogate, folder):
    return {file.kind: (file, onnx.load(folder / file.name)) for file in exporter.write(surrogate, folder)}


def operators(graph):
    """How often each operator occurs, loop bodies included."""
    count = collections.Counter(node.op_type for node in graph.node)
    for node in graph.node:
        for attribute in node.attribute:
            count += operators(attribute.g) if attribute.type == onnx.AttributeProto.GRAPH else collections.Counter()
    return count


def test_full_checker_passes_and_only_standard_operators_are_used(model, declared, tmp_path):
    for file, proto in written(OnnxExporter(), declared(model), tmp_path).values():
        onnx.checker.check_model(proto, full_check=True)
        assert [(entry.domain, entry.version) for entry in proto.opset_import] == [("", file.details["opset"])]
        assert proto.ir_version == file.details["ir_version"]


def test_sequence_is_one_scan(model, declared, tmp_path):
    _, proto = written(OnnxExporter(), declared(model), tmp_path)[Kind.SEQUENCE]
    assert operators(proto.graph)["Scan"] == 1


def test_bounds_are_in_the_file_exactly_where_the_model_has_them(model, declared, tmp_path):
    for _, proto in written(OnnxExporter(), declared(model), tmp_path).values():
        assert (operators(proto.graph)["Clip"] > 0) == np.isfinite(model.recursion.high)


def test_file_alone_says_what_goes_in_and_out(narx, declared, tmp_path):
    surrogate = declared(narx(NARX(input_delays=1, output_delays=1, neurons=1)))
    for _, proto in written(OnnxExporter(), surrogate, tmp_path).values():
        facts = {entry.key: entry.value for entry in proto.metadata_props}
        assert (facts["mapping"], facts["sample_time_s"], facts["output_unit"]) == ("BP+AR -> BC", "0.1", "psi")
        assert facts["input_ranges"] == "0.0 to 95.0, 0.0 to 95.0"
        assert proto.graph.input[0].doc_string == "BP [psi], AR [psi]"
        assert proto.graph.output[0].doc_string == "BC [psi]"
        assert proto.graph.output[2].doc_string.startswith("the sum of: 1: an input is outside its declared range")


def test_a_cascade_is_one_loop_and_one_that_keeps_numbers_that_are_none_apart(cascade, circle, tmp_path):
    for surrogate in (cascade, circle):
        _, proto = written(OnnxExporter(), surrogate, tmp_path)[Kind.SEQUENCE]
        onnx.checker.check_model(proto, full_check=True)
        assert operators(proto.graph)["Scan"] == 2


@pytest.mark.parametrize("samples", [1, 2, 7, 8, 50])
def test_a_run_goes_around_its_memory_and_ends_in_the_state_of_as_many_steps(samples, tmp_path):
    lags = {"input_delays": [[1, 5]], "output_delays": [1, 3], "neurons": 3}
    names = ["STP", "Y0", "Y1", "Y2"]
    models = tuple(wired_narx(f"{a} -> {b}", NARX(**lags), i) for i, (a, b) in enumerate(pairwise(names)))
    surrogate, exporter = Surrogate.of(Cascade(models=models)), OnnxExporter()
    files = written(exporter, surrogate, tmp_path)
    step, sequence = (exporter.load(files[kind][0], tmp_path) for kind in (Kind.STEP, Kind.SEQUENCE))
    loops = [node for node in nodes_of(files[Kind.SEQUENCE][1].graph) if node.op_type == "Scan"]
    # Memory, terms of inputs, and where to read and to write; the exact form, for numbers that are none, moves its own.
    assert sorted(len(loop.input) for loop in loops) == [2, 4]
    u = np.random.default_rng(0).uniform(0.0, 90.0, (samples, 2, 1))
    state = np.random.default_rng(1).normal(size=(2, surrogate.state_size))
    whole = sequence(u, state)
    one_by_one = step(u, state)
    np.testing.assert_allclose(whole.output, one_by_one.output, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(whole.state, one_by_one.state, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(whole.flags, one_by_one.flags)


def nodes_of(graph):
    """Nodes of a graph, those of bodies after each."""
    for node in graph.node:
        yield node
        for attribute in node.attribute:
            if attribute.type == onnx.AttributeProto.GRAPH:
                yield from nodes_of(attribute.g)


def side_by_side(count):
    """Networks that do not read each other, each with an input of its own, of one output or two by turns."""
    return Cascade(
        models=tuple(
            wired_narx(f"U{i} -> Y{i}", NARX(input_delays="0:1", output_delays=[1, 2], neurons=3, gated=i % 3 == 0), i)
            if i % 2
            else wired_vector(f"U{i} -> Y{i}+Z{i}", VectorNARX(input_delays=1, output_delays=[[1], [2]], neurons=2), i)
            for i in range(count)
        )
    )


def test_models_that_do_not_wait_for_each_other_share_their_nodes(tmp_path):
    def executed(count):
        _, proto = written(OnnxExporter(), Surrogate.of(side_by_side(count)), tmp_path)[Kind.STEP]
        return len(proto.graph.node)

    assert executed(12) <= executed(4) + 2


def test_a_step_moves_its_lines_by_one_slice_and_lays_its_first_readings_by_one_gather(tmp_path):
    """Every node counts: each takes as long as thirty rows."""
    lags = {"input_delays": [[1, 5]], "output_delays": [1, 60], "neurons": 3}
    models = tuple(wired_narx(f"{a} -> {b}", NARX(**lags), i) for i, (a, b) in enumerate(pairwise(("U", "Y0", "Y1"))))
    held = {name: Limit(low=0.0, high=80.0) for name in ("Y0", "Y1")}
    surrogate, exporter = Surrogate.of(Cascade(models=models, limits=held)), OnnxExporter()
    file, proto = written(exporter, surrogate, tmp_path)[Kind.STEP]
    made = {node.output[0]: node for node in proto.graph.node}
    assert (made["state_moved"].op_type, list(made["state_out"].input)) == ("Slice", ["memory_made"])
    assert made["laid"].op_type == "Gather"
    assert not {"older", "newest_first", "group0_readings", "told_at_limit"} & made.keys()
    u = np.random.default_rng(0).uniform(0.0, 90.0, (100, 1))
    state = surrogate.at_rest(u[0])[np.newaxis]
    run = exporter.load(file, tmp_path)(u[:, np.newaxis], state)
    np.testing.assert_allclose(run.output[:, 0], surrogate.simulate(u), rtol=0.0, atol=1e-11)


def test_lines_of_one_sample_leave_that_of_the_input_in_its_place(tmp_path):
    """Nothing of them is moved, so that the state cannot be moved whole."""
    filled = wired_narx("STP+AR -> BP", NARX(input_delays=[[0, 1], [1]], output_delays=1, neurons=3), 1)
    whole = Cascade(models=(filled, wired_narx("BP -> AR", NARX(input_delays=[[0]], output_delays=1, neurons=3), 2)))
    surrogate, u = Surrogate.of(whole), np.linspace(0.0, 80.0, 30)[:, np.newaxis]
    for file in OnnxExporter().write(surrogate, tmp_path):
        run = OnnxExporter().load(file, tmp_path)(u[:, np.newaxis], surrogate.at_rest(u[0])[np.newaxis])
        slack = 1e-10 if file.dtype == "float64" else 1e-3
        np.testing.assert_allclose(run.output[:, 0], surrogate.simulate(u), rtol=0.0, atol=slack)


def test_many_lines_take_their_newest_numbers_row_by_row(tmp_path):
    """A table with one number in each of many rows takes longer than to take, to scale and to shift them."""
    lags = {"output_delays": [1, 2], "neurons": 1}
    read = [wired_narx(f"U{i} -> Y{i}", NARX(input_delays="0:1", **lags), i) for i in range(24)]
    reading = [wired_narx(f"Y{i} -> Z{i}", NARX(input_delays="1:3", **lags), i) for i in range(24)]
    _, proto = written(OnnxExporter(), Surrogate.of(Cascade(models=(*read, *reading))), tmp_path)[Kind.STEP]
    tables = {one.name: np.prod(one.dims) for one in proto.graph.initializer}
    assert "line_slope" in tables
    assert tables.get("newest_weights", 0) <= PRODUCT


@pytest.mark.parametrize("name", ["ONNX, step", "ONNX, sequence", "ONNX float32, step", "ONNX float32, sequence"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_number_that_is_none_reaches_nobody_who_does_not_read_it(*, name, value, rows, opened, inputs, tmp_path):
    surrogate = Surrogate.of(side_by_side(3))
    u = inputs(30, 3).astype(np.float32).astype(np.float64)
    expected = surrogate.simulate(u)
    u[10, 1] = value
    exported = opened(rows[name], surrogate, tmp_path)
    run = exported.run(u[:, np.newaxis], surrogate.at_rest(u[0])[np.newaxis])
    assert [port.name for port in surrogate.outputs] == ["Y0", "Z0", "Y1", "Y2", "Z2"]
    np.testing.assert_allclose(
        run.output[:, 0, [0, 1, 3, 4]], expected[:, [0, 1, 3, 4]], rtol=0, atol=rows[name].tolerance
    )
    assert (run.flags[10:, 0] != 0).all() or np.isfinite(run.output[:, 0, 2]).all()
    if np.isnan(value):
        np.testing.assert_array_equal(np.isnan(run.output[:, 0, 2]), np.isnan(surrogate.simulate(u)[:, 2]))


def test_float32_stays_near_over_a_long_run(*, narx, declared, opened, rows, inputs, tmp_path):
    surrogate = declared(narx(NARX(input_delays=4, output_delays=4, neurons=20)))
    u = inputs(2000, 2)
    for name in ("ONNX float32, step", "ONNX float32, sequence"):
        run = opened(rows[name], surrogate, tmp_path).run(u[:, np.newaxis], surrogate.at_rest(u[0])[np.newaxis])
        assert np.abs(run.output[:, 0] - surrogate.simulate(u)).max() < 1e-3


def slow():
    """A model that is nearly an integrator, with weights that nearly cancel: what float32 cannot hold as it stands."""
    return ARXModel(
        orders=ARX(na=2, nb=(3, 3), nk=(0, 0)),
        # y(t) = 1.6998 y(t-1) - 0.69988 y(t-2) + ...: one pole at 0.9997, one at 0.7
        coefficients=np.array([0.4, -0.799, 0.399003, -0.3, 0.599, -0.298999, 1.6998, -0.69988]),
        intercept=0.0,
        mapping=Mapping.parse("BP+AR -> BC"),
        sample_time=0.1,
        input_units=("psi", "psi"),
        output_unit="psi",
        rest_output=0.0,
    )


@pytest.mark.parametrize("name", ["ONNX float32, step", "ONNX float32, sequence", "C, float"])
def test_float32_holds_a_slow_model(*, name, rows, opened, inputs, tmp_path):
    surrogate = Surrogate.of(slow(), {"BP": (0.0, 95.0), "AR": (0.0, 95.0)})
    u = inputs(8000, 2).astype(np.float32).astype(np.float64)
    expected = surrogate.simulate(u)
    run = opened(rows[name], surrogate, tmp_path).run(u[:, np.newaxis], surrogate.at_rest(u[0])[np.newaxis])
    assert np.abs(run.output[:, 0] - expected).max() < 1e-3


def test_float32_as_the_model_stands_would_not(inputs):
    """Why files are written in incremental (delta) form: the same recursion with its weights rounded."""
    model = slow()
    u = inputs(8000, 2).astype(np.float32).astype(np.float64)
    rounded = replace(model, coefficients=model.coefficients.astype(np.float32).astype(np.float64))
    assert np.abs(rounded.simulate(u) - model.simulate(u)).max() > 1e-3


@pytest.mark.parametrize("name", ["ONNX, step", "ONNX, sequence"])
def test_a_channel_that_comes_below_the_models_own_bound_wins(name, rows, opened, tmp_path):
    models = (wired_narx("STP -> BP", NARX(input_delays=[[0]], output_delays=1, neurons=3), 1),)
    models += (wired_narx("BP -> BC", NARX(input_delays=[[0]], output_delays=1, neurons=3), 3, clamp=0.05),)
    surrogate = Surrogate.of(Cascade(models=models, limits={"BC": Limit(high="STP")}))
    u = np.repeat(np.random.default_rng(0).uniform(20.0, 60.0, 20), 10)[:, np.newaxis]
    expected, bound = surrogate.simulate(u), models[1].recursion.low * 38.0 + 40.0
    assert (expected[:, 1] < bound).any()
    assert (expected[:, 1] >= bound).any()
    run = opened(rows[name], surrogate, tmp_path).run(u[:, np.newaxis], surrogate.at_rest(u[0])[np.newaxis])
    np.testing.assert_allclose(run.output[:, 0], expected, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(run.flags[:, 0], expected_flags(surrogate, u, surrogate.compute(u)))
