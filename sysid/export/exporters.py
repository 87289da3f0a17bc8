"""The table of formats. A new one is a file of its own and a line here."""

from __future__ import annotations

from sysid.errors import ConfigError
from sysid.export.c_exporter import CExporter
from sysid.export.exporter import AbstractExporter
from sysid.export.fmu_exporter import FmuExporter
from sysid.export.onnx_exporter import OnnxExporter
from sysid.export.torch_export import TorchExportExporter
from sysid.export.torchscript import TorchScriptExporter

EXPORTERS: dict[str, AbstractExporter] = {
    exporter.name: exporter
    for exporter in (
        OnnxExporter(),
        OnnxExporter(name="onnx-float32", dtype="float32"),
        TorchScriptExporter(),
        TorchExportExporter(),
        CExporter(),
        CExporter(name="c-float32", dtype="float32"),
        FmuExporter(name="fmi2", version=2),
        FmuExporter(name="fmi3", version=3),
    )
}
"""Every format by name."""


def exporter(name: str) -> AbstractExporter:
    """The exporter of a format.

    Args:
        name: Its name in the table.

    Returns:
        The exporter.

    Raises:
        ConfigError: If there is no such format.

    Example:
        >>> exporter("onnx").name
        'onnx'
    """
    try:
        return EXPORTERS[name]
    except KeyError:
        raise ConfigError(
            "unknown export format",
            expected=f"one of {', '.join(EXPORTERS)}",
            got=name,
            remedy="correct the name in formats",
        ) from None
