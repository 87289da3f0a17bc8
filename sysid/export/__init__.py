"""Models out: bundles of ONNX and TorchScript files, each checked against the model it came from.

Each name is imported when it is first asked for: who runs a bundle does not load what fits and writes one; torch, onnx
and onnxruntime are imported when a file is written or run.
"""

from typing import TYPE_CHECKING

from sysid.lazy_names import imported_when_asked

if TYPE_CHECKING:
    from sysid.export.bundle import Bundle, BundleFile
    from sysid.export.command_table import CommandTable, read_command
    from sysid.export.exporter import AbstractExporter, ExportedFile, Kind, Run
    from sysid.export.exporters import EXPORTERS
    from sysid.export.flags import Flag, expected_flags
    from sysid.export.jax_exporter import jax_run, jax_step
    from sysid.export.layout import DelayLine, StateLayout
    from sysid.export.parity import Parity, ParityCase, check_parity, parity_cases, random_cases
    from sysid.export.reading import read_bundle
    from sysid.export.renewing import renew_bundle
    from sysid.export.simulation import Simulation, simulate_bundle
    from sysid.export.stage import Port, Stage
    from sysid.export.surrogate import Surrogate
    from sysid.export.writing import export_bundle, zip_bundle

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
    "jax_run",
    "jax_step",
    "parity_cases",
    "random_cases",
    "read_bundle",
    "read_command",
    "renew_bundle",
    "simulate_bundle",
    "zip_bundle",
]

_WHERE = {
    "sysid.export.bundle": ("Bundle", "BundleFile"),
    "sysid.export.command_table": ("CommandTable", "read_command"),
    "sysid.export.exporter": ("AbstractExporter", "ExportedFile", "Kind", "Run"),
    "sysid.export.exporters": ("EXPORTERS",),
    "sysid.export.flags": ("Flag", "expected_flags"),
    "sysid.export.jax_exporter": ("jax_run", "jax_step"),
    "sysid.export.layout": ("DelayLine", "StateLayout"),
    "sysid.export.parity": ("Parity", "ParityCase", "check_parity", "parity_cases", "random_cases"),
    "sysid.export.reading": ("read_bundle",),
    "sysid.export.renewing": ("renew_bundle",),
    "sysid.export.simulation": ("Simulation", "simulate_bundle"),
    "sysid.export.stage": ("Port", "Stage"),
    "sysid.export.surrogate": ("Surrogate",),
    "sysid.export.writing": ("export_bundle", "zip_bundle"),
}

__getattr__ = imported_when_asked(_WHERE)
