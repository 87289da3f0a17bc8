"""Models out: bundles of ONNX and TorchScript files, each checked against the model it came from.

torch, onnx and onnxruntime are imported when a file is written or run, not here.
"""

from sysid.export.bundle import Bundle, BundleFile, export_bundle, zip_bundle
from sysid.export.command_table import CommandTable, read_command
from sysid.export.exporter import AbstractExporter, ExportedFile, Kind, Run
from sysid.export.exporters import EXPORTERS, exporter
from sysid.export.flags import Flag, expected_flags
from sysid.export.jax_exporter import jax_run, jax_step
from sysid.export.layout import DelayLine, StateLayout
from sysid.export.parity import Parity, ParityCase, check_parity, parity_cases, random_cases
from sysid.export.reading import read_bundle
from sysid.export.simulation import Simulation, simulate_bundle
from sysid.export.stage import Port, Stage
from sysid.export.surrogate import Surrogate

__all__ = [
    "EXPORTERS",
    "AbstractExporter",
    "Bundle",
    "BundleFile",
    "CommandTable",
    "DelayLine",
    "ExportedFile",
    "Flag",
    "Kind",
    "Parity",
    "ParityCase",
    "Port",
    "Run",
    "Simulation",
    "Stage",
    "StateLayout",
    "Surrogate",
    "check_parity",
    "expected_flags",
    "export_bundle",
    "exporter",
    "jax_run",
    "jax_step",
    "parity_cases",
    "random_cases",
    "read_bundle",
    "read_command",
    "simulate_bundle",
    "zip_bundle",
]
