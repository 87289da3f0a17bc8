"""Models out: bundles of ONNX and TorchScript files, each checked against the model it came from.

Each name is imported when it is first asked for: who runs a bundle does not load what fits and writes one; torch, onnx
and onnxruntime are imported when a file is written or run.
"""

from typing import TYPE_CHECKING

from sysid.lazy_names import imported_when_asked

if TYPE_CHECKING:
    from sysid.export.bundle import Bundle as Bundle
    from sysid.export.bundle import BundleFile as BundleFile
    from sysid.export.command_table import CommandTable as CommandTable
    from sysid.export.command_table import read_command as read_command
    from sysid.export.expected_runs import ParityCase as ParityCase
    from sysid.export.expected_runs import parity_cases as parity_cases
    from sysid.export.expected_runs import random_cases as random_cases
    from sysid.export.exporter import AbstractExporter as AbstractExporter
    from sysid.export.exporter import ExportedFile as ExportedFile
    from sysid.export.exporter import Kind as Kind
    from sysid.export.exporter import Run as Run
    from sysid.export.exporters import EXPORTERS as EXPORTERS
    from sysid.export.flags import Flag as Flag
    from sysid.export.flags import expected_flags as expected_flags
    from sysid.export.forms.layout import DelayLine as DelayLine
    from sysid.export.forms.layout import StateLayout as StateLayout
    from sysid.export.forms.stage import Port as Port
    from sysid.export.forms.stage import Stage as Stage
    from sysid.export.languages.jax import jax_run as jax_run
    from sysid.export.languages.jax import jax_step as jax_step
    from sysid.export.parity import Parity as Parity
    from sysid.export.parity import check_parity as check_parity
    from sysid.export.reading import read_bundle as read_bundle
    from sysid.export.renewing import renew_bundle as renew_bundle
    from sysid.export.simulation import Simulation as Simulation
    from sysid.export.simulation import simulate_bundle as simulate_bundle
    from sysid.export.surrogate import Surrogate as Surrogate
    from sysid.export.writing import export_bundle as export_bundle
    from sysid.export.writing import zip_bundle as zip_bundle

__getattr__, __all__ = imported_when_asked(__file__)
