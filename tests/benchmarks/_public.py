"""The files of public benchmarks: none is part of this project, and each is checked before it is read."""

from __future__ import annotations

import hashlib
import os
import sys
from pathlib import Path

from tests.benchmarks._findings import read

FILES = {
    "cascaded_tanks/dataBenchmark.csv": "ef2388ed822f3aef4aa80d6b0f2b466dd80b361786b3eafc7a2957c31ea323a7",
    "ced/DATAUNIF.csv": "9114f637f22ca826f03f066270cf68bd8cad686739a7fa4b471c14ccdbf66889",
    "silverbox/SNLS80mV.csv": "ae62d5a91230c10f76e6dd02c8a4fac3c9d4d8a95fbf50e87cb0c4885003e0f1",
}
"""SHA-256 by name."""


def checked(name: str) -> Path:
    """A file of the data folder, if its content is the published one."""
    path = Path(os.environ["SYSID_DATA"]) / name
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    if digest != FILES[name]:
        sys.exit(f"{path} is not the published file: its SHA-256 is {digest}, expected {FILES[name]}")
    read(name, digest)
    return path
