"""Reading a bundle: every byte is checked before anything is believed, and nothing in it is executed."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from sysid.errors import BundleError, SysidError
from sysid.export.bundle import Bundle, bundle_files
from sysid.export.manifest import MANIFEST, SCHEMA_VERSION, manifest_digest, sha256
from sysid.models import AbstractModel, model_from_dict


def read_bundle(folder: Path) -> Bundle:
    """Read a bundle and check that it is whole.

    The exported files are hashed, not loaded.

    Args:
        folder: The bundle's folder.

    Returns:
        The model and what ``model.json`` says.

    Raises:
        BundleError: If a file is missing, changed or newer than this version can read.
    """
    folder = Path(folder)
    manifest = _read_manifest(folder / MANIFEST)
    try:
        files = bundle_files(manifest)
        hashes = {entry["name"]: entry["sha256"] for entry in [*manifest["files"], manifest["card"]]}
        model = _model(manifest, folder)
    except (KeyError, TypeError, AttributeError) as error:
        raise BundleError(
            f"{MANIFEST} lacks something that every bundle has",
            where=str(folder / MANIFEST),
            got=f"{type(error).__name__}: {error}",
            remedy="ask for the bundle again; this one was not written by the workbench",
        ) from error
    for name, expected in hashes.items():
        _check_file(folder, name, expected, hashes)
    return Bundle(folder=folder, model=model, metadata=manifest, files=files)


def _read_manifest(path: Path) -> dict[str, Any]:
    try:
        manifest: Any = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise BundleError(
            f"there is no {MANIFEST}", where=str(path.parent), remedy="give the folder that holds the bundle"
        ) from None
    except (OSError, ValueError, RecursionError) as error:
        raise BundleError(
            f"{MANIFEST} cannot be read", where=str(path), expected="JSON in UTF-8", got=str(error), remedy=_AGAIN
        ) from error
    fields: dict[str, Any] = manifest if isinstance(manifest, dict) else {}
    version = fields.get("schema_version")
    if type(version) is not int or version < 1:
        raise BundleError(
            f"{MANIFEST} does not describe a bundle",
            where=str(path),
            expected="a JSON object with schema_version",
            got=f"schema_version {version!r}",
            remedy="give the folder that holds the bundle",
        )
    if version > SCHEMA_VERSION:
        raise BundleError(
            "the bundle was written by a newer version of the workbench",
            where=str(path),
            expected=f"schema_version up to {SCHEMA_VERSION}",
            got=version,
            remedy="update the workbench: pip install --upgrade sysid-workbench",
        )
    if fields.get("digest") != manifest_digest(fields):
        raise BundleError(
            f"{MANIFEST} was changed after it was written",
            where=str(path),
            expected=f"SHA-256 {manifest_digest(fields)}",
            got=fields.get("digest"),
            remedy=_AGAIN,
        )
    return fields


_AGAIN = "export or copy the bundle again"


def _model(manifest: dict[str, Any], folder: Path) -> AbstractModel:
    try:
        model = model_from_dict(manifest["model"])
        model.recursion  # noqa: B018 - it checks that parameters and structure belong together
    except (SysidError, KeyError, TypeError, ValueError, AttributeError) as error:
        raise BundleError(
            f"the model in {MANIFEST} cannot be built",
            where=str(folder / MANIFEST),
            got=error.what if isinstance(error, SysidError) else f"{type(error).__name__}: {error}",
            remedy=_AGAIN,
        ) from error
    return model


def _check_file(folder: Path, name: str, expected: str, listed: Iterable[str]) -> None:
    path = folder / name
    if Path(name).name != name:
        raise BundleError(
            f"{MANIFEST} points outside the bundle",
            where=str(folder / MANIFEST),
            expected="plain file names",
            got=name,
            remedy="do not use this bundle",
        )
    if not path.is_file():
        raise BundleError(
            f"the file {name} is missing",
            where=str(folder),
            expected=", ".join(listed),
            got=", ".join(sorted(entry.name for entry in folder.iterdir())),
            remedy=_AGAIN,
        )
    found = sha256(path)
    if found != expected:
        raise BundleError(
            f"the file {name} was changed after it was written",
            where=str(path),
            expected=f"SHA-256 {expected}",
            got=f"SHA-256 {found}",
            remedy=_AGAIN,
        )
