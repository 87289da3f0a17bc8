"""Reading a bundle: every byte is checked before anything is believed, and nothing in it is executed."""

from __future__ import annotations

import hashlib
import zipfile
import zlib
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from sysid.bounded_text import parse_json, read_bounded
from sysid.errors import BundleError, SysidError, shortened
from sysid.export.bundle import Bundle, bundle_files
from sysid.export.finding import find_bundle
from sysid.export.manifest import MANIFEST, SCHEMA_VERSION, manifest_digest
from sysid.models import AbstractModel, Cascade, cascade_from_dict, model_from_dict

LARGEST = 1 << 30
"""Bytes; a file that says it unpacks to more is not a bundle's."""
_AGAIN = "export or copy the bundle again"


def read_bundle(folder: Path) -> Bundle:
    """Read a bundle and check that it is whole.

    The exported files are hashed, not loaded.

    Args:
        folder: The bundle's folder, its zip, or the folder of the run that exported it.

    Returns:
        The model or cascade, and what ``model.json`` says.

    Raises:
        BundleError: If a file is missing, changed or newer than this version can read.
    """
    folder = find_bundle(Path(folder))
    content = _content(folder)
    manifest = _read_manifest(content)
    try:
        files = bundle_files(manifest)
        entries = [*manifest["files"], manifest["card"]]
        entries += manifest["attachments"] if manifest["schema_version"] > 1 else []
        hashes = {entry["name"]: entry["sha256"] for entry in entries}
        model = _model(manifest, content)
    except (KeyError, TypeError, AttributeError) as error:
        raise BundleError(
            f"{MANIFEST} lacks something that every bundle has",
            where=content.place(MANIFEST),
            got=f"{type(error).__name__}: {error}",
            remedy="ask for the bundle again; this one was not written by the workbench",
        ) from error
    for name, expected in hashes.items():
        _check_file(content, name, expected, hashes)
    return Bundle(folder=folder, model=model, metadata=manifest, files=files)


def read_attachment(bundle: Bundle, name: str) -> bytes | None:
    """A file of a bundle that was read.

    Args:
        bundle: The bundle.
        name: Of a file within it.

    Returns:
        Its bytes; ``None`` if ``model.json`` lists no such file.

    Raises:
        BundleError: If it is missing, or was changed.
    """
    listed = {entry["name"]: entry["sha256"] for entry in bundle.metadata["attachments"]}
    if name not in listed:
        return None
    content = _content(bundle.folder)
    _check_file(content, name, listed[name], listed)
    return content.read(name)


def _content(folder: Path) -> _AbstractContent:
    return _Zipped(path=folder) if folder.is_file() else _Folder(path=folder)


@dataclass(frozen=True, kw_only=True)
class _AbstractContent(ABC):
    """The files of a bundle, wherever they lie."""

    path: Path

    @abstractmethod
    def read(self, name: str) -> bytes | None:
        """The bytes of a file; ``None`` if there is none. ``OSError`` or ``ValueError`` if it cannot be read."""

    @abstractmethod
    def names(self) -> list[str]:
        """What there is, sorted."""

    def place(self, name: str) -> str:
        """Where a file lies, in words."""
        return str(self.path / name)


@dataclass(frozen=True, kw_only=True)
class _Folder(_AbstractContent):
    def read(self, name: str) -> bytes | None:
        path = self.path / name
        return read_bounded(path, most=LARGEST) if path.is_file() else None

    def names(self) -> list[str]:
        return sorted(path.relative_to(self.path).as_posix() for path in self.path.rglob("*") if path.is_file())


@dataclass(frozen=True, kw_only=True)
class _Zipped(_AbstractContent):
    """Read in place: nothing is unpacked onto the disk."""

    def read(self, name: str) -> bytes | None:
        try:
            with zipfile.ZipFile(self.path) as archive:
                if name not in archive.namelist():
                    return None
                if archive.getinfo(name).file_size > LARGEST:
                    raise ValueError(f"{name} unpacks to more than {LARGEST} bytes")
                return archive.read(name)
        except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError) as error:
            raise ValueError(f"not a readable zip: {error}") from error

    def names(self) -> list[str]:
        with zipfile.ZipFile(self.path) as archive:
            return sorted(archive.namelist())


def _read_manifest(content: _AbstractContent) -> dict[str, Any]:
    where = content.place(MANIFEST)
    try:
        data = content.read(MANIFEST)
        manifest: Any = None if data is None else parse_json(data)
    except (OSError, ValueError, RecursionError) as error:
        raise BundleError(
            f"{MANIFEST} cannot be read", where=where, expected="JSON in UTF-8", got=str(error), remedy=_AGAIN
        ) from error
    if data is None:
        raise BundleError(
            f"there is no {MANIFEST}",
            where=str(content.path),
            remedy="give the folder that holds the bundle, or its zip",
        )
    fields: dict[str, Any] = manifest if isinstance(manifest, dict) else {}
    version = fields.get("schema_version")
    if type(version) is not int or version < 1:
        raise BundleError(
            f"{MANIFEST} does not describe a bundle",
            where=where,
            expected="a JSON object with schema_version",
            got=f"schema_version {shortened(version)}",
            remedy="give the folder that holds the bundle",
        )
    if version > SCHEMA_VERSION:
        raise BundleError(
            "the bundle was written by a newer version of the workbench",
            where=where,
            expected=f"schema_version up to {SCHEMA_VERSION}",
            got=version,
            remedy="update the workbench: pip install --upgrade sysid-workbench",
        )
    if fields.get("digest") != manifest_digest(fields):
        raise BundleError(
            f"{MANIFEST} was changed after it was written",
            where=where,
            expected=f"SHA-256 {manifest_digest(fields)}",
            got=fields.get("digest"),
            remedy=_AGAIN,
        )
    return fields


def _model(manifest: dict[str, Any], content: _AbstractContent) -> AbstractModel | Cascade:
    try:
        stored = manifest["model"]
        if stored["structure"].get("kind") == Cascade.kind:
            return cascade_from_dict(stored)
        model = model_from_dict(stored)
        model.recursion  # noqa: B018 - it checks that parameters and structure belong together
    except (SysidError, KeyError, TypeError, ValueError, AttributeError, ArithmeticError, IndexError) as error:
        raise BundleError(
            f"the model in {MANIFEST} cannot be built",
            where=content.place(MANIFEST),
            got=error.what if isinstance(error, SysidError) else f"{type(error).__name__}: {error}",
            remedy=_AGAIN,
        ) from error
    return model


def _check_file(content: _AbstractContent, name: str, expected: str, listed: Iterable[str]) -> None:
    path = PurePosixPath(name)
    if path.is_absolute() or str(path) != name or ".." in path.parts or "\\" in name or ":" in name:
        raise BundleError(
            f"{MANIFEST} points outside the bundle",
            where=content.place(MANIFEST),
            expected="names of files within it",
            got=name,
            remedy="do not use this bundle",
        )
    try:
        data = content.read(name)
    except (OSError, ValueError) as error:
        raise BundleError(
            f"the file {name} cannot be read", where=content.place(name), got=str(error), remedy=_AGAIN
        ) from error
    if data is None:
        raise BundleError(
            f"the file {name} is missing",
            where=str(content.path),
            expected=", ".join(listed),
            got=", ".join(content.names()),
            remedy=_AGAIN,
        )
    found = hashlib.sha256(data).hexdigest()
    if found != expected:
        raise BundleError(
            f"the file {name} was changed after it was written",
            where=content.place(name),
            expected=f"SHA-256 {expected}",
            got=f"SHA-256 {found}",
            remedy=_AGAIN,
        )
