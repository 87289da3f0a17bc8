"""Other people's FMI importers: the examples of the documentation, run over the records of a bundle."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from sysid.export import export_bundle

RECEIVERS = Path(__file__).resolve().parents[2] / "docs" / "receivers"
EXAMPLES = {"ecos_fmus.py": 6, "libcosim_fmu.py": 3}
"""Each with the records that it compares: three for each version of FMI that it imports."""


@pytest.fixture(scope="module")
def bundle(limited, command, tmp_path_factory):
    folder = tmp_path_factory.mktemp("importers") / "bundle"
    return export_bundle(limited, command, folder, formats=["fmi2", "fmi3"]).folder


def run(example, bundle):
    command = [sys.executable, RECEIVERS / example, bundle]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("example", EXAMPLES)
def test_records_of_a_cascade_are_found_as_recorded(example, bundle):
    done = run(example, bundle)
    assert (done.returncode, done.stdout.count(": as recorded")) == (0, EXAMPLES[example]), done.stdout + done.stderr


@pytest.mark.parametrize("example", EXAMPLES)
def test_a_record_that_was_changed_is_found_out(example, bundle):
    record = bundle / "verify" / "record2.csv"
    before = record.read_text()
    record.write_text(before.replace("\n1.0,", "\n1.0,9", 1))
    try:
        done = run(example, bundle)
    finally:
        record.write_text(before)
    assert done.returncode == 1
    assert done.stdout.count(": NOT as recorded") == EXAMPLES[example] // 3
