"""Run times of exported files, measured in turn with the model's own."""

from __future__ import annotations

from sysid.export import export_bundle
from sysid.export.run_times import OWN, bundle_run_times


def test_every_file_is_timed_beside_the_models_own_run(fit, traces, start, tmp_path, monkeypatch):
    monkeypatch.setattr("sysid.export.run_times.SAMPLES", 400)
    monkeypatch.setattr("sysid.export.run_times.SHORT", 100)
    bundle = export_bundle(fit, traces, tmp_path / "b", start=start, formats=["onnx", "c"])
    found = bundle_run_times(bundle, repeats=2)
    rows = [(one.name, one.format, one.cars) for one in found]
    assert rows == [
        (OWN, "", 1),
        ("step.onnx", "onnx", 1),
        ("sequence.onnx", "onnx", 1),
        ("sequence.onnx", "onnx", 100),
        ("bp_ar_to_bc.c", "c", 1),
    ]
    assert found[0].ratio == 1.0
    assert all(one.seconds > 0.0 and one.ratio > 0.0 for one in found)
