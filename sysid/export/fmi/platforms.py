"""The machines that an FMU can have a binary for, and how it is built here for machines that are not this one."""

from __future__ import annotations

import os
import platform
import struct
import sys
from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sysid.errors import ConfigError
from sysid.export.c.compiler import build_library
from sysid.extras import has

ONLY_OWN = "SYSID_FMU_PLATFORMS"
"""Environment variable: ``own`` builds for this machine alone, which is quicker."""
MACHINES = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}
SYSTEMS = {"linux": "linux", "darwin": "darwin", "win32": "windows"}


@dataclass(frozen=True, kw_only=True)
class Platform:
    """A kind of machine.

    Args:
        system: As FMI 3.0 writes it.
        machine: The same.
        ending: Of shared libraries there.
        target: As the compiler names it: with the oldest C library, or system, that it is to run on.
        former: The folder of FMI 2.0; ``""`` where it has no name for it.
    """

    system: str
    machine: str
    ending: str
    target: str
    former: str

    def folder(self, version: int) -> str:
        """Its folder under ``binaries``; ``""`` where the standard has no name for it."""
        return f"{self.machine}-{self.system}" if version == 3 else self.former


PLATFORMS = (
    Platform(system="windows", machine="x86_64", ending="dll", target="x86_64-windows-gnu", former="win64"),
    Platform(system="linux", machine="x86_64", ending="so", target="x86_64-linux-gnu.2.17", former="linux64"),
    Platform(system="linux", machine="aarch64", ending="so", target="aarch64-linux-gnu.2.17", former=""),
    Platform(system="darwin", machine="x86_64", ending="dylib", target="x86_64-macos.11.0", former="darwin64"),
    Platform(system="darwin", machine="aarch64", ending="dylib", target="aarch64-macos.11.0", former="darwin64"),
)
"""All of them. FMI 2.0 has one folder for both kinds of Macs: the file in it holds both binaries."""
CPU = {"x86_64": (0x01000007, 3), "aarch64": (0x0100000C, 0)}
"""Type and subtype of a processor in files of macOS."""


def own_platform(version: int) -> Platform:
    """This machine.

    Args:
        version: Of FMI, 2 or 3.

    Returns:
        Its kind.

    Raises:
        ConfigError: If the standard has no name for it.
    """
    system, machine = SYSTEMS.get(sys.platform, ""), MACHINES.get(platform.machine().lower(), "")
    for one in PLATFORMS:
        if (one.system, one.machine) == (system, machine) and one.folder(version):
            return one
    raise ConfigError(
        f"FMI {version}.0 has no name for this kind of machine",
        expected="Linux, macOS or Windows on x86_64; macOS on aarch64; FMI 3.0 on Linux on aarch64 too",
        got=f"{sys.platform} on {platform.machine()}",
        remedy=f"leave the format fmi{version} out",
    )


def wanted_platforms(version: int) -> tuple[Platform, ...]:
    """The machines that binaries are built for: all that the standard names, if the compiler for them is installed."""
    if has("ziglang") and os.environ.get(ONLY_OWN) != "own":
        return tuple(one for one in PLATFORMS if one.folder(version))
    return (own_platform(version),)


def left_out(version: int) -> list[str]:
    """Folders of machines that no binary is built for."""
    built = {one.folder(version) for one in wanted_platforms(version)}
    return sorted({one.folder(version) for one in PLATFORMS if one.folder(version)} - built)


def build_binaries(
    version: int, name: str, sources: Sequence[str], folder: Path, flags: Sequence[str]
) -> dict[str, bytes]:
    """Build for every machine that is wanted.

    Args:
        version: Of FMI, 2 or 3.
        name: Of the file, without its ending.
        sources: File names in the folder.
        folder: Where they lie.
        flags: Of the compiler.

    Returns:
        The binaries by folder and file name.
    """
    wanted = wanted_platforms(version)
    cross = has("ziglang") and os.environ.get(ONLY_OWN) != "own"
    built: dict[str, dict[str, bytes]] = {}
    for one in wanted:
        output = f"{one.machine}-{one.system}/{name}.{one.ending}"  # a library knows its own name
        (folder / output).parent.mkdir()
        build_library(sources, folder, output, flags, target=one.target if cross else None)
        place = f"{one.folder(version)}/{name}.{one.ending}"
        built.setdefault(place, {})[one.machine] = (folder / output).read_bytes()
    return {place: next(iter(own.values())) if len(own) == 1 else universal(own) for place, own in built.items()}


def universal(binaries: Dict[str, bytes]) -> bytes:
    """Several binaries of macOS as one file that runs on each of their processors.

    Args:
        binaries: By processor.

    Returns:
        The file: a table of what lies where, then the binaries, each on a page of its own.
    """
    page = 14  # as a power of two: 16 KiB
    table = [struct.pack(">II", 0xCAFEBABE, len(binaries))]
    body, at = [], 1 << page
    for machine, data in sorted(binaries.items()):
        table.append(struct.pack(">IIIII", *CPU[machine], at, len(data), page))
        padded = data + bytes(-len(data) % (1 << page))
        body.append(padded)
        at += len(padded)
    head = b"".join(table)
    return head + bytes((1 << page) - len(head)) + b"".join(body)
