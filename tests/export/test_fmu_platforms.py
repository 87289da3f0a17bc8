"""FMUs with binaries for machines that are not this one: what each of them is, as its own headers say."""

from __future__ import annotations

import re
import struct
import zipfile

import pytest

from sysid.export import EXPORTERS
from sysid.export.fmi.platforms import CPU, ONLY_OWN, PLATFORMS, left_out, own_platform, universal, wanted_platforms
from sysid.extras import has

ELF, PE, MACH, FAT = b"\x7fELF", b"MZ", struct.pack("<I", 0xFEEDFACF), struct.pack(">I", 0xCAFEBABE)
ELF_MACHINES, PE_MACHINES = {62: "x86_64", 183: "aarch64"}, {0x8664: "x86_64"}
WINDOWS = rb"KERNEL32\.dll|api-ms-win-crt-[a-z]+-l1-1-0\.dll"
"""What every Windows since 10 has."""


def machines_of(data):
    """System and processors of a shared library."""
    if data.startswith(ELF):
        assert struct.unpack_from("<H", data, 16) == (3,)  # a shared object
        return "linux", {ELF_MACHINES[struct.unpack_from("<H", data, 18)[0]]}
    if data.startswith(PE):
        at = struct.unpack_from("<I", data, 0x3C)[0]
        assert data[at : at + 4] == b"PE\0\0"
        machine, flags = struct.unpack_from("<H", data, at + 4)[0], struct.unpack_from("<H", data, at + 22)[0]
        assert flags & 0x2000  # a library
        return "windows", {PE_MACHINES[machine]}
    if data.startswith(MACH):
        assert struct.unpack_from("<I", data, 12) == (6,)  # a dynamic library
        return "darwin", {name for name, (kind, _) in CPU.items() if struct.unpack_from("<I", data, 4) == (kind,)}
    assert data.startswith(FAT)
    found = set()
    for i in range(struct.unpack_from(">I", data, 4)[0]):
        kind, _, offset, size, page = struct.unpack_from(">IIIII", data, 8 + 20 * i)
        assert offset % (1 << page) == 0
        system, own = machines_of(data[offset : offset + size])
        assert (system, {CPU[machine][0] for machine in own}) == ("darwin", {kind})
        found |= own
    return "darwin", found


@pytest.fixture(params=[2, 3])
def version(request):
    return request.param


def test_without_the_compiler_for_others_there_is_the_own_one_and_the_rest_is_told(monkeypatch, version):
    monkeypatch.setattr("sysid.export.fmi.platforms.has", lambda _: False)
    assert wanted_platforms(version) == (own_platform(version),)
    folders = {one.folder(version) for one in PLATFORMS} - {""}
    assert set(left_out(version)) == folders - {own_platform(version).folder(version)}


def test_with_it_nothing_is_left_out_unless_that_is_asked_for(monkeypatch, version):
    monkeypatch.setattr("sysid.export.fmi.platforms.has", lambda _: True)
    monkeypatch.delenv(ONLY_OWN, raising=False)
    assert left_out(version) == []
    assert len(wanted_platforms(version)) == (5 if version == 3 else 4)
    monkeypatch.setenv(ONLY_OWN, "own")
    assert wanted_platforms(version) == (own_platform(version),)


def test_a_file_for_both_macs_has_both_on_pages_of_their_own():
    parts = {
        machine: struct.pack("<IIII", 0xFEEDFACF, kind, sub, 6) + bytes(20_000) for machine, (kind, sub) in CPU.items()
    }
    assert machines_of(universal(parts)) == ("darwin", {"x86_64", "aarch64"})


@pytest.mark.skipif(not has("ziglang"), reason="the extra fmu-cross is not installed")
def test_every_binary_is_what_its_folder_says(monkeypatch, version, models, declared, tmp_path):
    monkeypatch.delenv(ONLY_OWN, raising=False)
    (file,) = EXPORTERS[f"fmi{version}"].write(declared(models["NARX 4/4/20"]()), tmp_path)
    assert file.details["platforms_left_out"] == []
    expected = {}
    for one in PLATFORMS:
        if one.folder(version):
            expected.setdefault(one.folder(version), (one.system, set()))[1].add(one.machine)
    with zipfile.ZipFile(tmp_path / file.name) as archive:
        binaries = {name.split("/")[1]: archive.read(name) for name in archive.namelist() if name.startswith("bin")}
    assert {folder: machines_of(data) for folder, data in binaries.items()} == expected
    for data in binaries.values():
        assert f"fmi{version}DoStep\0".encode() in data
        assert str(tmp_path).encode() not in data
        for wanted in re.findall(rb"GLIBC_([0-9.]+)", data):
            assert tuple(map(int, wanted.split(b"."))) <= (2, 17)
        for library in re.findall(rb"[A-Za-z0-9_.-]+\.dll\0", data):
            assert re.fullmatch(WINDOWS + rb"|[a-z0-9_]+\.dll", library[:-1])
    run = EXPORTERS[f"fmi{version}"].load(file, tmp_path)  # the one for this machine is run
    assert callable(run)
