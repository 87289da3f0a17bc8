"""A bundle is complete, reproducible, readable by a person, and there whole or not at all."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ChannelError, ConfigError, ParityError
from sysid.export import EXPORTERS, export_bundle, read_bundle
from sysid.export.bundle import OutsideRangeWarning
from sysid.models import NARX, History
from sysid.traces import TraceSet
from sysid.validation import evaluate
from tests.export.conftest import FEW_MODELS

FILES = ["sequence.onnx", "sequence.torchscript.pt", "step.onnx", "step.torchscript.pt"]


ALWAYS = ["MODEL_CARD.md", "model.json", "model.schema.json"]
RECORDS = ["verify/record1.csv", "verify/record2.csv", "verify/record3.csv", "verify/worst.csv"]


def content(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def metrics(fit, traces, start):
    return evaluate(fit.model, traces, start, repeats=1)


@pytest.fixture(scope="module")
def bundle(fit, traces, start, metrics, tmp_path_factory):
    folder = tmp_path_factory.mktemp("workspace") / "bundle"
    return export_bundle(
        fit,
        traces,
        folder,
        start=start,
        metrics=metrics,
        formats=["onnx", "torchscript"],
        provenance={"pipeline": "synthetic", "command": "sysid run"},
    )


@pytest.fixture(scope="module")
def manifest(bundle):
    return json.loads((bundle.folder / "model.json").read_text(encoding="utf-8"))


def test_folder_holds_the_files_and_nothing_else(bundle):
    assert sorted(content(bundle.folder)) == sorted([*ALWAYS, *FILES, *RECORDS, "verify/verify.py"])
    assert [path.name for path in bundle.folder.parent.iterdir()] == ["bundle"]


def test_each_file_is_recorded_with_its_difference(bundle, traces):
    assert sorted(file.name for file in bundle.files) == FILES
    for file in bundle.files:
        assert 0.0 <= file.largest_difference <= file.tolerance
        assert file.case in traces.names


def test_manifest_declares_channels_ranges_and_units(manifest, traces):
    bp, ar = manifest["inputs"]
    assert (bp["name"], bp["unit"], bp["reference"], bp["description"]) == ("BP", "psi", "gauge", "brake pipe")
    assert bp["range"] == [traces["EST01"]["BP"].min(), traces["EST01"]["BP"].max()]
    assert ar["range"] == [traces["EST01"]["AR"].min(), traces["EST01"]["AR"].max()]
    (bc,) = manifest["outputs"]
    assert (bc["name"], bc["limits"], manifest["sample_time_s"]) == ("BC", {"low": None, "high": None}, 0.1)


def test_manifest_keeps_provenance_with_digests(manifest, traces):
    provenance = manifest["provenance"]
    assert (provenance["pipeline"], provenance["command"]) == ("synthetic", "sysid run")
    assert provenance["data"]["sha256"] == traces.digest
    assert {t["name"]: (t["role"], t["sha256"]) for t in provenance["data"]["traces"]} == {
        t.name: (traces.roles[t.name].value, t.digest) for t in traces
    }
    assert {"sysid-workbench", "onnx", "torch"} <= set(provenance["software"])


def test_manifest_keeps_the_figures_of_every_case(manifest, metrics):
    assert manifest["metrics"] == {name: case.to_dict() for name, case in metrics.cases.items()}


def test_the_models_parameters_survive_to_the_last_bit(bundle, fit, traces):
    again = read_bundle(bundle.folder).model
    assert again.to_dict() == fit.model.to_dict()
    u = traces["VAL01"].columns(("BP", "AR"))
    np.testing.assert_array_equal(again.simulate(u), fit.model.simulate(u))


def test_reading_gives_what_writing_gave(bundle):
    again = read_bundle(bundle.folder)
    assert again.metadata == bundle.metadata
    assert again.files == bundle.files


@pytest.mark.filterwarnings("ignore:.*torch.jit.*:DeprecationWarning")
def test_the_examples_on_the_card_run_and_give_the_models_free_run(bundle, fit, traces, monkeypatch):
    card = (bundle.folder / "MODEL_CARD.md").read_text(encoding="utf-8")
    examples = re.findall(r"```python\n(.*?)```", card, flags=re.DOTALL)
    assert ["onnxruntime" in one for one in examples] == [True, False]
    u = traces["EST01"].columns(("BP", "AR"))
    expected = fit.model.simulate(u, History.at_rest(inputs=u[0], output=fit.model.rest_output))
    monkeypatch.chdir(bundle.folder)
    for example in examples:
        assert len(example.splitlines()) <= 5
        names = {"u": u}
        exec(example, names)  # noqa: S102 - the example that we print is what is tested
        np.testing.assert_allclose(np.asarray(names["y"])[:, 0, 0], expected, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    "text",
    [
        "## Intended use",
        "## Validity range",
        "## Training",
        "## Accuracy",
        "## Run time",
        "## Limits",
        "## How to use it",
        "Started from the open-loop fit.",
        "BP [psi gauge], AR [psi gauge]",
    ],
)
def test_card_has(bundle, text):
    assert text in (bundle.folder / "MODEL_CARD.md").read_text(encoding="utf-8")


def test_card_names_every_trace_with_its_hash_and_every_figure(bundle, traces, metrics):
    card = (bundle.folder / "MODEL_CARD.md").read_text(encoding="utf-8")
    for trace in traces:
        assert f"`{trace.digest}`" in card
        assert f"{metrics.cases[trace.name].free_run.mse:.4g}" in card
    assert "## Scored on" not in card, "a fit's cases are those that it was trained and scored on"


def test_same_fit_gives_the_same_bytes(*, bundle, fit, traces, start, metrics, tmp_path):
    provenance = {"pipeline": "synthetic", "command": "sysid run"}
    again = export_bundle(
        fit,
        traces,
        tmp_path / "again",
        start=start,
        metrics=metrics,
        formats=["onnx", "torchscript"],
        provenance=provenance,
    )
    assert content(again.folder) == content(bundle.folder)


def test_a_process_of_its_own_gives_the_same_bytes(bundle, tmp_path):
    script = (
        "import sys, pathlib; from sysid.export import EXPORTERS, Surrogate, read_bundle\n"
        "bundle = read_bundle(pathlib.Path(sys.argv[1]))\n"
        "ranges = {channel['name']: tuple(channel['range']) for channel in bundle.metadata['inputs']}\n"
        "surrogate = Surrogate.of(bundle.model, ranges)\n"
        "for name in ('onnx', 'torchscript'): EXPORTERS[name].write(surrogate, pathlib.Path(sys.argv[2]))"
    )
    subprocess.run([sys.executable, "-c", script, bundle.folder, tmp_path], check=True, env={"PYTHONHASHSEED": "1"})
    assert content(tmp_path) == {name: (bundle.folder / name).read_bytes() for name in FILES}


def test_only_the_formats_asked_for_are_written(fit, traces, start, tmp_path):
    bundle = export_bundle(fit, traces, tmp_path / "b", start=start, formats=["onnx"])
    assert sorted(content(bundle.folder)) == sorted([*ALWAYS, *FILES[::2], *RECORDS, "verify/verify.py"])


def test_figures_that_are_not_finite_are_null_and_said_so(fit, traces, start, tmp_path, metrics):
    case = metrics.cases["VAL01"]
    lost = replace(case, free_run=replace(case.free_run, mse=np.inf, nrmse_fit=-np.inf))
    lost_metrics = replace(metrics, cases={"VAL01": lost})
    bundle = export_bundle(fit, traces, tmp_path / "b", start=start, formats=["onnx"], metrics=lost_metrics)
    assert read_bundle(bundle.folder).metadata["metrics"]["VAL01"]["free_run"]["mse"] is None
    assert "| VAL01 | validation | BC | not finite psi² | not finite |" in (bundle.folder / "MODEL_CARD.md").read_text(
        "utf-8"
    )


def test_without_estimation_traces_no_range_is_declared(fit, traces, start, tmp_path):
    others = TraceSet(name="others", traces=traces.traces[1:])
    bundle = export_bundle(fit, others, tmp_path / "b", start=start, formats=["onnx"])
    assert [channel["range"] for channel in bundle.metadata["inputs"]] == [None, None]
    assert "not declared" in (bundle.folder / "MODEL_CARD.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("model", [*FEW_MODELS, "ARX, finite impulse response"], indirect=True)
def test_every_kind_of_model_makes_a_bundle(model, fit, traces, start, tmp_path):
    bundle = export_bundle(replace(fit, model=model), traces, tmp_path / "b", start=start, formats=["onnx"])
    assert read_bundle(bundle.folder).model.to_dict() == model.to_dict()


def test_parameters_that_are_not_finite_are_refused(fit, traces, start, tmp_path):
    theta = fit.model.theta.copy()
    theta[3] = np.nan
    lost = replace(fit, model=replace(fit.model, theta=theta))
    with pytest.raises(ConfigError, match=r"(?s)parameters.*not finite.*1 of 293"):
        export_bundle(lost, traces, tmp_path / "b", start=start)
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_published_over_the_tolerance(fit, traces, start, tmp_path):
    with pytest.raises(ParityError, match="expected: a largest difference of at most 1e-30 psi"):
        export_bundle(fit, traces, tmp_path / "b", start=start, formats=["onnx"], tolerance=1e-30)
    assert list(tmp_path.iterdir()) == []


def test_an_earlier_bundle_survives_an_export_that_fails(fit, traces, start, tmp_path):
    earlier = content(export_bundle(fit, traces, tmp_path / "b", start=start, formats=["onnx"]).folder)
    with pytest.raises(ParityError):
        export_bundle(fit, traces, tmp_path / "b", start=start, formats=["onnx"], tolerance=1e-30)
    assert content(tmp_path / "b") == earlier
    assert [path.name for path in tmp_path.iterdir()] == ["b"]


def test_an_earlier_bundle_is_put_back_if_the_new_one_cannot_take_its_place(
    *, fit, traces, start, tmp_path, monkeypatch
):
    earlier = content(export_bundle(fit, traces, tmp_path / "b", start=start, formats=["onnx"]).folder)
    rename = Path.rename

    def full_disk(self, target):
        if self.name == "new":
            raise OSError(28, "No space left on device", str(self))
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", full_disk)
    with pytest.raises(OSError, match=r"No space left.*b'$"):
        export_bundle(fit, traces, tmp_path / "b", start=start, formats=["onnx"])
    assert content(tmp_path / "b") == earlier
    assert [path.name for path in tmp_path.iterdir()] == ["b"]


def test_an_earlier_bundle_is_replaced_whole(fit, traces, start, narx, tmp_path):
    export_bundle(fit, traces, tmp_path / "b", start=start)
    other = replace(fit, model=narx(NARX(input_delays=1, output_delays=1, neurons=2)))
    export_bundle(other, traces, tmp_path / "b", start=start, formats=["onnx"])
    assert read_bundle(tmp_path / "b").model.to_dict() == other.model.to_dict()
    assert sorted(content(tmp_path / "b")) == sorted([*ALWAYS, *FILES[::2], *RECORDS, "verify/verify.py"])
    assert [path.name for path in tmp_path.iterdir()] == ["b"]


@pytest.mark.parametrize("kind_of_thing", ["folder", "file"])
def test_what_is_not_a_bundle_is_never_replaced(fit, traces, start, tmp_path, kind_of_thing):
    target = tmp_path / "precious"
    precious = target / "thesis.tex" if kind_of_thing == "folder" else target
    precious.parent.mkdir(exist_ok=True)
    precious.write_text("years of work")
    with pytest.raises(ConfigError, match="already used for something else"):
        export_bundle(fit, traces, target, start=start, formats=["onnx"])
    assert precious.read_text() == "years of work"


def test_unknown_format_is_refused_with_those_there_are(fit, traces, start, tmp_path):
    formats = ", ".join(EXPORTERS)
    with pytest.raises(ConfigError, match=rf"(?s)unknown export format.*one of {formats}\n.*onyx"):
        export_bundle(fit, traces, tmp_path / "b", start=start, formats=["onyx"])


def test_traces_without_an_input_are_refused(fit, traces, start, tmp_path):
    channels = [0, 2]
    short = [replace(t, channels=tuple(t.channels[i] for i in channels), values=t.values[:, channels]) for t in traces]
    with pytest.raises(ChannelError, match="missing channel AR"):
        export_bundle(fit, TraceSet(name="short", traces=tuple(short)), tmp_path / "b", start=start)


def test_importing_the_package_imports_no_heavy_library():
    script = (
        "import sys, sysid.export; print([m for m in ('torch', 'onnx', 'onnxruntime', 'jinja2') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "[]"


def test_a_model_too_fine_for_float_is_still_exported_in_double(fit, traces, start, tmp_path, models):
    fine = replace(fit, model=models["ARX, two inputs, dead times"]())
    kept = export_bundle(
        fine, traces, tmp_path / "b", start=start, formats=["c"], tolerance=1e-9, tolerance_float32=1e-9
    )
    assert [(file.name, file.dtype) for file in kept.files] == [("bp_ar_to_bc.c", "float64")]
    assert "float, which was not compared with the model" in (tmp_path / "b" / "MODEL_CARD.md").read_text("utf-8")
    with pytest.raises(ParityError, match=r"bp_ar_to_bc\.c does not reproduce"):
        export_bundle(
            fine,
            traces,
            tmp_path / "b",
            start=start,
            formats=["c", "c-float32"],
            tolerance=1e-9,
            tolerance_float32=1e-9,
        )


def test_a_trace_runs_in_the_units_of_the_bundle_alone(bundle, traces):
    trace = traces.traces[0]
    names = [entry["name"] for entry in bundle.inputs]
    assert np.array_equal(bundle.simulate(trace, start="rest"), bundle.simulate(trace.columns(names)))
    other = tuple(replace(one, unit="kA") if one.name == names[0] else one for one in trace.channels)
    with pytest.raises(ConfigError, match="in another unit than the model"):
        bundle.simulate(replace(trace, channels=other), start="rest")


def test_inputs_beyond_what_was_fitted_are_told(bundle, traces):
    names = [entry["name"] for entry in bundle.inputs]
    u = traces.traces[0].columns(names)
    far = u.copy()
    far[:5, 0] = 1000.0 * np.abs(u).max()
    with pytest.warns(OutsideRangeWarning, match=f"{names[0]} is beyond .* in {100 * 5 / len(u):.3g} % of the samples"):
        told = bundle.simulate(far)
    assert np.array_equal(told, bundle.simulate(far, warn=False))


@pytest.mark.parametrize("initial", [float("nan"), float("inf"), "5"])
def test_a_level_that_is_no_number_is_refused(bundle, traces, initial):
    with pytest.raises(ConfigError, match="one finite number"):
        bundle.simulate(traces.traces[0], initial=initial)
