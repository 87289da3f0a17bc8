"""Run times of exported files in the report."""

from __future__ import annotations

from sysid.reporting.fit_records import ExportRecord, FitRecord, RunTimeRecord
from sysid.reporting.results import Results
from sysid.reporting.sections.runtime_table import exported_run_times


def results(run_times):
    export = ExportRecord(
        format="onnx", file="bundle/sequence.onnx", largest_difference=0.0, tolerance=1e-9, run_times=run_times
    )
    fit = FitRecord.model_construct(name="network", exports=[export])
    return Results.model_construct(fits=[fit])


def test_a_row_for_each_file_and_number_of_cars():
    table = exported_run_times(
        results([RunTimeRecord(cars=1, seconds=0.0612, ratio=12.5), RunTimeRecord(cars=100, seconds=0.18, ratio=0.37)])
    )
    assert [[cell.text for cell in row] for row in table.rows] == [
        ["onnx", "network", "bundle/sequence.onnx", "1", "61.2", "4.90", "12.5"],
        ["onnx", "network", "bundle/sequence.onnx", "100", "180", "4.86", "0.370"],
    ]


def test_nothing_where_nothing_was_measured():
    assert exported_run_times(results([])) is None
