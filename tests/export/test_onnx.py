"""What the ONNX files contain, beside computing the right numbers."""

from __future__ import annotations

import collections

import numpy as np
import onnx
import pytest

from sysid.export import Kind, run_sequence
from sysid.export.layout import StateLayout
from sysid.export.onnx_exporter import OnnxExporter
from sysid.models import NARX


def written(exporter, model, folder):
    return {file.kind: (file, onnx.load(folder / file.name)) for file in exporter.write(model, folder)}


def operators(graph):
    """How often each operator occurs, loop bodies included."""
    count = collections.Counter(node.op_type for node in graph.node)
    for node in graph.node:
        for attribute in node.attribute:
            count += operators(attribute.g) if attribute.type == onnx.AttributeProto.GRAPH else collections.Counter()
    return count


def test_full_checker_passes_and_only_standard_operators_are_used(model, tmp_path):
    for file, proto in written(OnnxExporter(), model, tmp_path).values():
        onnx.checker.check_model(proto, full_check=True)
        assert [(entry.domain, entry.version) for entry in proto.opset_import] == [("", file.details["opset"])]
        assert proto.ir_version == file.details["ir_version"]


def test_sequence_is_one_scan(model, tmp_path):
    _, proto = written(OnnxExporter(), model, tmp_path)[Kind.SEQUENCE]
    assert operators(proto.graph)["Scan"] == 1


def test_bounds_are_in_the_file_exactly_where_the_model_has_them(model, tmp_path):
    for _, proto in written(OnnxExporter(), model, tmp_path).values():
        assert operators(proto.graph)["Clip"] == np.isfinite(model.recursion.high)


def test_file_alone_says_what_goes_in_and_out(narx, tmp_path):
    model = narx(NARX(input_delays=1, output_delays=1, neurons=1))
    for _, proto in written(OnnxExporter(), model, tmp_path).values():
        facts = {entry.key: entry.value for entry in proto.metadata_props}
        assert (facts["mapping"], facts["sample_time_s"], facts["output_unit"]) == ("BP+AR -> BC", "0.1", "psi")
        assert proto.graph.input[0].doc_string == "BP [psi], AR [psi]"
        assert proto.graph.output[0].doc_string == "BC [psi]"


@pytest.mark.parametrize("kind", list(Kind), ids=lambda kind: kind.value)
def test_float32_is_near_and_stays_float32(narx, inputs, past, tmp_path, kind):
    model, exporter = narx(NARX(input_delays=4, output_delays=4, neurons=20)), OnnxExporter(dtype="float32")
    (file,) = [file for file in exporter.write(model, tmp_path) if file.kind is kind]
    assert (file.name, file.dtype) == (f"{kind.value}.float32.onnx", "float32")
    u, history = inputs(2000, 2), past(model)
    state = StateLayout.of(model).from_history(history)[np.newaxis]
    run = run_sequence(exporter.load(tmp_path / file.name), kind, u[:, np.newaxis], state)
    assert (run.output.dtype, run.state.dtype) == (np.float32, np.float32)
    assert np.abs(run.output[:, 0, 0] - model.simulate(u, history)).max() < 1e-3
