"""The table of formats. A new one is a file of its own and a line here."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

from sysid.errors import ConfigError
from sysid.export.c.arduino_exporter import ArduinoExporter
from sysid.export.c.cpp_exporter import CppExporter
from sysid.export.c.exporter import CExporter
from sysid.export.c.wasm_exporter import WasmExporter
from sysid.export.exporter import AbstractExporter
from sysid.export.fmi.exporter import FmuExporter
from sysid.export.languages.casadi import CasadiExporter
from sysid.export.languages.jax import JaxExporter
from sysid.export.languages.matlab import MatlabExporter
from sysid.export.languages.structured_text import StructuredTextExporter
from sysid.export.onnx.exporter import OnnxExporter
from sysid.export.torch.torch_export import TorchExportExporter
from sysid.export.torch.torchscript import TorchScriptExporter

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
        CasadiExporter(),
        JaxExporter(),
        CppExporter(),
        ArduinoExporter(),
        WasmExporter(),
        MatlabExporter(),
        StructuredTextExporter(),
    )
}
"""Every format by name."""

ELSEWHERE = {
    **dict.fromkeys(("fmu", "fmi", "modelica", "simulink"), ("fmi3", "fmi2")),
    **dict.fromkeys(("pytorch", "torch", "pt"), ("torchscript", "torch-export")),
    **dict.fromkeys(("onnxruntime", "tensorrt", "tflite", "tensorflow"), ("onnx",)),
    **dict.fromkeys(("plc", "scl", "structuredtext", "iec61131"), ("st",)),
    **dict.fromkeys(("js", "javascript", "webassembly"), ("wasm",)),
    **dict.fromkeys(("octave", "m"), ("matlab",)),
    **dict.fromkeys(("c++", "h"), ("cpp",)),
}
"""What formats are called elsewhere."""

USUAL = ("onnx", "c")
"""What is written where nobody names a format, as far as it can be written here."""


class FormatLeftOutWarning(UserWarning):
    """A format that is usually written, and for which something is missing here."""


@dataclass(frozen=True, kw_only=True)
class Formats:
    """What is written.

    Args:
        names: The formats, in order.
        left_out: What is usually written too and cannot be here, each with the command that changes it.
    """

    names: tuple[str, ...]
    left_out: tuple[str, ...] = ()

    def __str__(self) -> str:
        return "; ".join([", ".join(self.names), *self.left_out])


def wanted_formats(asked: Sequence[str] | None) -> Formats:
    """The formats that are written, known before anything is computed.

    Args:
        asked: Their names; ``None`` for the usual ones that can be written here.

    Returns:
        The formats, and what was left out of the usual ones.

    Raises:
        UserError: If a format that was asked for cannot be written here, or none of the usual ones can.

    Example:
        >>> wanted_formats(["c", "onnx"]).names
        ('c', 'onnx')
    """
    if asked is not None:
        for name in asked:
            exporter(name).check()
        return Formats(names=tuple(dict.fromkeys(asked)))
    missing = {name: problem for name in USUAL if (problem := EXPORTERS[name].lacks())}
    if len(missing) == len(USUAL):
        raise missing[USUAL[0]]
    return Formats(
        names=tuple(name for name in USUAL if name not in missing),
        left_out=tuple(f"{name} left out: {problem.remedy}" for name, problem in missing.items()),
    )


def usual_formats(asked: Sequence[str] | None) -> tuple[str, ...]:
    """As :func:`wanted_formats`, with a warning of what is left out.

    Args:
        asked: Names of formats; ``None`` for the usual ones.

    Returns:
        What is written.

    Raises:
        UserError: If a format that was asked for cannot be written here, or none of the usual ones can.
    """
    found = wanted_formats(asked)
    for text in found.left_out:
        warnings.warn(text, FormatLeftOutWarning, stacklevel=4)
    return found.names


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
        raise ConfigError.unknown(
            "unknown export format", name, EXPORTERS, "correct the name in formats", also=ELSEWHERE
        ) from None
