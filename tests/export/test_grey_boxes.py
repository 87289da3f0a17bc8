"""Grey boxes exported: operations on numbers, the same as the model's in every format."""

from __future__ import annotations

import ctypes
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from sysid.equations import ROSENBROCK, RUNGE_KUTTA
from sysid.errors import ConfigError
from sysid.estimation import FitResult, Loop, Status
from sysid.export import EXPORTERS, Surrogate, expected_flags, export_bundle, read_bundle
from sysid.export.c.compiler import build_library
from sysid.export.differences import largest_difference
from sysid.export.forms.layout import layout_of
from sysid.export.forms.operations import OPERATIONS
from sysid.kernels import register_machine as machine
from sysid.models import NARX, Cascade, Limit, Mapping
from sysid.traces import Role
from tests.export.conftest import usable
from tests.export.grey_boxes import EVERYTHING, GREY_BOXES, VALVE, build_grey

RANGES = {"BP": (0.0, 95.0), "AR": (0.0, 95.0)}
PAIRS = [
    (name, kind)
    for name in GREY_BOXES
    for kind in EXPORTERS
    if name in ("everything", "stiff", "moving") or kind in ("onnx", "c")
    if kind != "torch-export"
    or name not in ("everything", "stiff", "moving")  # it writes every step out: the next test has one
]


def check_files(surrogate: Surrogate, kind: str, inputs, folder: Path) -> None:
    """Every file of a format runs as the model, whole and in pieces, and with what is not a number."""
    exporter, model = usable(kind), surrogate.stages[0].model
    cars = [inputs(120, len(surrogate.inputs), seed=seed) for seed in (1, 2)]
    cars[1][60, 0], cars[1][90, -1] = np.inf, np.nan
    states = np.stack([surrogate.at_rest(u[0]) for u in cars])
    expected = [surrogate.simulate(u) for u in cars]
    assert all(np.isfinite(one[:60]).all() for one in expected)
    for file in exporter.write(surrogate, folder):
        run = exporter.load(file, folder)
        whole = run(np.stack(cars, axis=1), states)
        for i, (u, output) in enumerate(zip(cars, expected, strict=True)):
            assert largest_difference(whole.output[:, i], output) <= (1e-9 if file.dtype == "float64" else 1e-3)
            np.testing.assert_array_equal(whole.flags[:, i], expected_flags(surrogate, u, output))
        half = run(np.stack(cars, axis=1)[:70], states)
        rest = run(np.stack(cars, axis=1)[70:], half.state)
        np.testing.assert_array_equal(np.concatenate([half.output, rest.output]), whole.output)
        text = model.structure.equations.strip().splitlines()[0].encode()
        assert text not in (folder / file.name).read_bytes()


@pytest.mark.parametrize(("name", "kind"), PAIRS)
def test_files_compute_what_the_equations_compute(name, kind, inputs, tmp_path) -> None:
    check_files(Surrogate.of(GREY_BOXES[name](), RANGES), kind, inputs, tmp_path)


@pytest.mark.parametrize(
    ("text", "solver", "fields"),
    [
        (EVERYTHING, RUNGE_KUTTA, {"initial": {"z": 3.0}}),
        ("dp/dt = 2e4*(valve(BP) - p)\ndBC/dt = 0.5*(p - BC*abs(AR - BC))", ROSENBROCK, {}),
        ("dBC/dt = 0.5*(valve(BP) - BC) - 0.1*abs(AR - BC)", RUNGE_KUTTA, {"intersample": "foh"}),
    ],
)
def test_torch_export_writes_the_steps_out(text, solver, fields, inputs, tmp_path) -> None:
    model = build_grey(text, tables=VALVE, substeps=1, solver=solver, **fields)
    check_files(Surrogate.of(model, RANGES), "torch-export", inputs, tmp_path)


def test_the_table_has_every_operation_of_the_machine() -> None:
    assert set(OPERATIONS) == {value for name, value in vars(machine).items() if name.isupper()}


@pytest.mark.parametrize("name", GREY_BOXES)
def test_the_source_finds_the_state_at_rest_that_the_model_finds(name, tmp_path) -> None:
    surrogate = Surrogate.of(GREY_BOXES[name](), RANGES)
    (file,) = EXPORTERS["c"].write(surrogate, tmp_path)
    build_library([file.name], tmp_path, "own.so", ["-Wshadow", "-Werror"])
    library, prefix = ctypes.CDLL(str(tmp_path / "own.so")), file.details["prefix"]
    for first, outputs in (([40.0, 20.0], None), ([75.0, 75.0], [12.0] * len(surrogate.outputs))):
        u, state = np.array(first), np.zeros(surrogate.state_size)
        told = None if outputs is None else np.array(outputs)
        init = library[f"{prefix}_init"]
        init(*(None if one is None else ctypes.c_void_p(one.ctypes.data) for one in (state, u, told)))
        np.testing.assert_allclose(state, surrogate.at_rest(u, told), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("compiler", [["gcc", "-std=c99"], ["g++", "-x", "c++", "-std=c++98"]])
def test_the_source_compiles_without_a_warning(compiler, tmp_path) -> None:
    (file,) = EXPORTERS["c"].write(Surrogate.of(GREY_BOXES["everything"](), RANGES), tmp_path)
    strict = ["-O1", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-pedantic", "-Werror"]
    for real in ([], [f"-D{file.details['float32_macro']}"]):
        command = [*compiler, *strict, *real, "-c", file.name, "-o", "out.o"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")


def test_a_bundle_carries_one_and_says_so(traces, tmp_path) -> None:
    model = GREY_BOXES["declared states"]()  # of which no search begins, for the 1,000 runs of the check of stability
    fit = FitResult(
        model=model, status=Status.CONVERGED, loop=Loop.CLOSED, train_time_s=1.0,
        history={"iteration": np.arange(2.0), "mse": np.array([2.0, 1.0])},
    )  # fmt: skip
    export_bundle(fit, traces, tmp_path / "bundle", formats=("onnx",))
    bundle = read_bundle(tmp_path / "bundle")
    u = traces["EST01"].columns(["BP", "AR"])
    np.testing.assert_array_equal(bundle.simulate(u), model.simulate(u))
    manifest = json.loads((tmp_path / "bundle" / "model.json").read_text(encoding="utf-8"))
    jsonschema.validate(manifest, json.loads((tmp_path / "bundle" / "model.schema.json").read_text(encoding="utf-8")))
    (states,) = manifest["state"]["equations"]
    assert (states["names"], states["declared"]) == (["BC"], [12.0])
    card = (tmp_path / "bundle" / "MODEL_CARD.md").read_text(encoding="utf-8")
    assert "States of its equations: BC. At rest BC is 12." in card
    verify = [sys.executable, "-I", tmp_path / "bundle" / "verify" / "verify.py"]
    done = subprocess.run(verify, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count(": as recorded") == 3


def test_the_state_after_a_run_goes_on_as_the_model_does(inputs, past, tmp_path) -> None:
    model = GREY_BOXES["two outputs"]()
    surrogate, exporter = Surrogate.of(model, RANGES), EXPORTERS["c"]
    (file,) = exporter.write(surrogate, tmp_path)
    u = inputs(30, 2)
    state = layout_of(model).at_rest(np.array([*u[0], 5.0, 5.0]))
    run = exporter.load(file, tmp_path)(u[:, np.newaxis], state[np.newaxis])
    later = inputs(20, 2, seed=8)
    x = run.state[0, : len(model.lowered.states)].copy()
    expected = model.recursion.run(model.recursion.given(later, u), x)
    again = exporter.load(file, tmp_path)(later[:, np.newaxis], run.state)
    assert largest_difference(again.output[:, 0], expected) <= 1e-9


@pytest.mark.parametrize("kind", ["onnx", "onnx-float32", "torchscript", "c", "casadi"])
def test_a_cascade_may_hold_one(narx, kind, inputs, tmp_path) -> None:
    first = narx(NARX(input_delays=2, output_delays=2, neurons=3))
    second = build_grey(
        "dX/dt = 0.2*(BC - X) + 0.01*AR(t - 0.25) - 0.02*BC[k-1]", mapping="BC+AR -> X", initial={"X": 3.0}
    )
    third = narx(NARX(input_delays="0:1", output_delays=1, neurons=2))
    third = type(third)(**{**vars(third), "mapping": Mapping.parse("X+AR -> Y")})
    cascade = Cascade(models=(first, second, third), limits={"X": Limit(low=0.0, high=30.0)})
    surrogate, exporter = Surrogate.of(cascade, RANGES), EXPORTERS[kind]
    u = inputs(100, 2)
    for file in exporter.write(surrogate, tmp_path):
        result = exporter.load(file, tmp_path)(u[:, np.newaxis], surrogate.at_rest(u[0])[np.newaxis])
        tolerance = 1e-9 if file.dtype == "float64" else 1e-3
        assert largest_difference(result.output[:, 0], surrogate.simulate(u)) <= tolerance


def by_case_fit() -> FitResult:
    model = build_grey(
        "dBC/dt = 0.3*(BP - BC) + 0.01*gain*AR",
        parameters={"gain": {"start": 0.3, "per": "case", "unit": "1/s"}},
        initial={"BC": {"start": 12, "fixed": True}},
    )
    return FitResult(
        model=replace(model, cases=("EST01", "EST02"), theta=np.array([0.3, 0.5])),
        status=Status.CONVERGED, loop=Loop.CLOSED, train_time_s=1.0,
        history={"iteration": np.arange(2.0), "mse": np.array([2.0, 1.0])},
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["onnx", "c"])
def test_a_parameter_by_case_is_an_input_of_every_file_or_inside_that_of_a_case(kind, inputs, tmp_path) -> None:
    model = by_case_fit().model
    for one, ranges in (
        (model.with_case_inputs(), RANGES | {"gain": (0.3, 0.5)}),
        (model.for_case("EST02"), RANGES),
    ):
        check_files(Surrogate.of(one, ranges), kind, inputs, tmp_path)


def test_a_model_of_several_cases_is_no_stage_of_a_file() -> None:
    with pytest.raises(ConfigError, match="gain differ by case, and a file runs one"):
        Surrogate.of(Cascade(models=(by_case_fit().model,)), RANGES)


def test_a_bundle_of_cases_says_what_goes_in_and_keeps_the_records_as_they_were(traces, tmp_path) -> None:
    fit = by_case_fit()
    named = [trace.name for trace in traces]
    fit = replace(fit, model=replace(fit.model, cases=tuple(named), theta=np.linspace(0.3, 0.5, len(named))))
    bundle = export_bundle(fit, traces, tmp_path / "bundle", formats=("c",))
    gain = bundle.inputs[-1]
    fitted = [fit.model.by_case["gain"][trace.name] for trace in traces.with_role(Role.ESTIMATION)]
    assert (gain["name"], gain["unit"], gain["range"]) == ("gain", "1/s", [min(fitted), max(fitted)])
    assert "constant over a record" in gain["description"]
    assert bundle.metadata["provenance"]["data"]["sha256"] == traces.digest
    u = traces[named[1]].columns(["BP", "AR"])
    own = np.column_stack([u, np.full(len(u), fit.model.by_case["gain"][named[1]])])
    np.testing.assert_array_equal(bundle.simulate(own, warn=False), fit.model.for_case(named[1]).simulate(u))
    with pytest.raises(ConfigError, match="is none of those that are fitted"):
        export_bundle(by_case_fit(), traces, tmp_path / "other", formats=("c",))
