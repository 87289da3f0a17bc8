"""The content of an FMU: the C source of the surrogate, the functions of FMI around it, and its description."""

from __future__ import annotations

import hashlib
import tempfile
import zipfile
from collections.abc import Mapping as Dict
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

import sysid
from sysid.export.archive import write_archive
from sysid.export.c.compiler import WARNINGS
from sysid.export.c.source import c_files
from sysid.export.flags import MEANING
from sysid.export.fmi.platforms import build_binaries, left_out, own_platform
from sysid.export.fmi.units import unit_definitions
from sysid.export.heeded import heeded
from sysid.export.surrogate import Surrogate
from sysid.export.templating import c_real, render
from sysid.names import distinct, xml_name

HEADERS = {
    2: ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h"),
    3: ("fmi3FunctionTypes.h", "fmi3Functions.h", "fmi3PlatformTypes.h"),
}
"""The standard's own headers (2-clause BSD licence, which stands in them)."""


def write_fmu(surrogate: Surrogate, version: int, path: Path) -> dict[str, Any]:
    """Write an FMU for co-simulation, with its sources and with binaries for the machines that can be built for here.

    Args:
        surrogate: What to write.
        version: 2 or 3.
        path: The file.

    Returns:
        What a receiver must know.

    Raises:
        ConfigError: If there is no compiler, or no name for this machine.
    """
    prefix = surrogate.identifier
    variables = fmu_variables(surrogate)
    texts, guid = _texts(surrogate, version, variables)
    content = {name: text.encode() for name, text in texts.items()}
    binaries = _binaries(content, prefix, version)
    content |= {f"binaries/{place}": data for place, data in binaries.items()}
    write_archive(path, content)
    return {
        "fmi": f"{version}.0",
        "model_identifier": prefix,
        "platforms": sorted({place.partition("/")[0] for place in binaries}),
        "platforms_left_out": left_out(version),
        "sources": True,
        "guid": guid,
        "output_offset": "after doStep(t, h) the outputs are those of the sample whose inputs were set at t",
    }


def fmu_variables(surrogate: Surrogate) -> list[dict[str, Any]]:
    """The variables in the order of the model description, as it writes them.

    Args:
        surrogate: What is written.

    Returns:
        Inputs, outputs, outputs at rest, flags.
    """
    names = distinct((port.name for port in (*surrogate.inputs, *surrogate.outputs)), xml_name)
    taken = set(names.values())
    rows: list[dict[str, Any]] = []
    for port in surrogate.inputs:
        told = "no range declared" if port.range is None else f"declared from {port.low!r} to {port.high!r}"
        kind = {"causality": "input", "variability": "continuous", "initial": ""}
        rows.append(
            {"name": names[port.name], **kind, "unit": port.unit, "start": c_real(port.start), "description": told}
        )
    for port in surrogate.outputs:
        kind = {"causality": "output", "variability": "continuous", "initial": "calculated"}
        text = "of the sample before" + (f"; begins at {port.level}" if isinstance(port.level, str) else "")
        rows.append({"name": names[port.name], **kind, "unit": port.unit, "start": None, "description": text})
    for port, says in zip(surrogate.outputs, heeded(surrogate), strict=True):
        name, kind = _free(f"{names[port.name]}_at_rest", taken), {"causality": "parameter", "variability": "fixed"}
        text = f"{port.name} before the first sample: the system has stood at it and at the inputs for ever"
        start = None if isinstance(port.level, str) or not says else c_real(port.level)
        rows.append({"name": name, **kind, "initial": "exact", "unit": port.unit, "start": start, "description": text})
    kind = {"causality": "output", "variability": "discrete", "initial": "exact"}
    text = "0, or the sum of: " + "; ".join(f"{int(flag)}: {words}" for flag, words in MEANING.items())
    rows.append({"name": _free("flags", taken), **kind, "unit": "1", "start": "0", "description": text})
    numbered = [
        row | {"reference": i, "integer": i == len(rows), "unit": "" if row["unit"] == "1" else row["unit"]}
        for i, row in enumerate(rows, start=1)
    ]
    # An output that begins at an input has no parameter of its own, nor one whose states rest where inputs alone say.
    shown = [row for row in numbered if row["causality"] != "parameter" or row["start"] is not None]
    return [row | {"index": i} for i, row in enumerate(shown, start=1)]


def _free(name: str, taken: set[str]) -> str:
    while name in taken:
        name += "_"
    taken.add(name)
    return name


def _texts(surrogate: Surrogate, version: int, variables: list[dict[str, Any]]) -> tuple[dict[str, str], str]:
    """The text files of the FMU by their paths, and the token that its binary asks for."""
    prefix = surrogate.identifier
    code = c_files(surrogate)
    starts = np.array([port.start for port in surrogate.inputs])
    names = [port.name for port in surrogate.inputs]
    values = {
        "p": prefix,
        "P": prefix.upper(),
        "version": sysid.__version__,
        "tool": f"sysid-workbench {sysid.__version__}",
        "name": prefix,
        "description": f"{surrogate.mapping}: {surrogate.label}, one sample every {surrogate.sample_time!r} s",
        "sample_time": surrogate.sample_time,
        "sources": [f"{prefix}.c", f"fmi{version}.c"],
        "variables": variables,
        "time_name": _free("time", {row["name"] for row in variables}),
        "units": unit_definitions(row["unit"] for row in variables if row["unit"]),
        "starts": [c_real(port.start) for port in surrogate.inputs],
        "rests": [c_real(value) for value in surrogate.levels(starts)[list(surrogate.columns)]],
        "followed": [
            (k, names.index(port.level)) for k, port in enumerate(surrogate.outputs) if isinstance(port.level, str)
        ],
        "stands": [k for k, says in enumerate(heeded(surrogate)) if not says],
    }
    whole = "".join(code.values()) + repr(sorted(values.items()))
    token = hashlib.sha256(whole.encode()).hexdigest()
    guid = f"{{{token[:8]}-{token[8:12]}-{token[12:16]}-{token[16:20]}-{token[20:32]}}}"
    values |= {"token": token, "guid": guid}
    texts = {"modelDescription.xml": render(f"fmi{version}.xml.j2", **values)}
    for name, text in code.items():
        texts[f"sources/{name}"] = text
    texts["sources/fmu_instance.h"] = render("fmu_instance.h.j2", **values)
    texts[f"sources/fmi{version}.c"] = render(f"fmi{version}.c.j2", **values)
    if version == 3:
        texts["sources/buildDescription.xml"] = render("fmi3_build.xml.j2", **values)
    headers = resources.files("sysid.export") / "fmi_headers"
    for name in HEADERS[version]:
        texts[f"sources/{name}"] = (headers / name).read_text(encoding="utf-8")
    return texts, guid


def _binaries(content: Dict[str, bytes], prefix: str, version: int) -> dict[str, bytes]:
    with tempfile.TemporaryDirectory() as workplace:
        folder = Path(workplace)
        for path, data in content.items():
            if path.startswith("sources/"):
                (folder / Path(path).name).write_bytes(data)
        # Two FMUs in one process must not see each other's functions: only those of FMI are visible.
        flags = ("-fvisibility=hidden", *WARNINGS)
        return build_binaries(version, prefix, [f"{prefix}.c", f"fmi{version}.c"], folder, flags)


def unpack_binary(path: Path, version: int, target: Path) -> Path:
    """Take the binary for this machine out of an FMU.

    Args:
        path: The FMU.
        version: 2 or 3.
        target: The folder to put it in.

    Returns:
        The file.
    """
    own = own_platform(version)
    with zipfile.ZipFile(path) as archive:
        (member,) = [name for name in archive.namelist() if name.startswith(f"binaries/{own.folder(version)}/")]
        library = target / f"model.{own.ending}"
        library.write_bytes(archive.read(member))
    return library
