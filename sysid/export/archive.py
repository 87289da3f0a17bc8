"""Zip files whose bytes depend on nothing but their content."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping as Dict
from pathlib import Path


def write_archive(path: Path, content: Dict[str, bytes], *, compress: bool = True) -> None:
    """Write files into a zip, without date, user or machine.

    Args:
        path: The zip.
        content: Bytes by path in the zip, in the order in which they are written.
        compress: Whether to; formats that are mapped into memory are not.
    """
    method = zipfile.ZIP_DEFLATED if compress else zipfile.ZIP_STORED
    with zipfile.ZipFile(path, "w", method) as archive:
        for name, data in content.items():
            entry = zipfile.ZipInfo(name)
            entry.create_system = 3  # Unix, wherever it is written
            entry.external_attr = 0o644 << 16
            entry.compress_type = method
            archive.writestr(entry, data)
