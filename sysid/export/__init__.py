"""Models out: bundles of ONNX and TorchScript files, each checked against the model it came from.

torch, onnx and onnxruntime are imported when a file is written or run, not here.
"""

from sysid.export.bundle import Bundle, BundleFile, export_bundle
from sysid.export.exporter import AbstractExporter, ExportedFile, Kind, Run, run_sequence
from sysid.export.exporters import EXPORTERS, exporter
from sysid.export.layout import DelayLine, StateLayout
from sysid.export.parity import Parity, ParityCase, check_parity, parity_cases
from sysid.export.reading import read_bundle

__all__ = [
    "EXPORTERS",
    "AbstractExporter",
    "Bundle",
    "BundleFile",
    "DelayLine",
    "ExportedFile",
    "Kind",
    "Parity",
    "ParityCase",
    "Run",
    "StateLayout",
    "check_parity",
    "export_bundle",
    "exporter",
    "parity_cases",
    "read_bundle",
    "run_sequence",
]
