"""The files of public benchmarks: none is part of this project, and each is checked before it is read."""

from __future__ import annotations

import hashlib
import os
import sys
from pathlib import Path

from sysid.ingest.datasets.description import read_description
from tests.benchmarks._findings import read

DATASETS = Path(__file__).resolve().parents[2] / "datasets"
FILES = {
    name: digest
    for file in sorted(DATASETS.glob("*/dataset.yaml"))
    for name, digest in read_description(file).source.sha256.items()
}
"""SHA-256 by name, as the data sets of this project have them."""


def checked(name: str) -> Path:
    """A file of the data folder, if its content is the published one."""
    path = Path(os.environ["SYSID_DATA"]) / name
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    if digest != FILES[name]:
        sys.exit(f"{path} is not the published file: its SHA-256 is {digest}, expected {FILES[name]}")
    read(name, digest)
    return path
