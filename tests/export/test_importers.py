"""Other people's FMI importers: the examples of the documentation, run over the records of a bundle."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

RECEIVERS = Path(__file__).resolve().parents[2] / "docs" / "receivers"
EXAMPLES = {"ecos_fmus.py": 6, "libcosim_fmu.py": 3}
"""Each with the records that it compares: three for each version of FMI that it imports."""


def run(example, bundle):
    command = [sys.executable, RECEIVERS / example, bundle]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("example", EXAMPLES)
def test_records_of_a_cascade_are_found_as_recorded(example, cascade_bundle):
    done = run(example, cascade_bundle.folder)
    assert (done.returncode, done.stdout.count(": as recorded")) == (0, EXAMPLES[example]), done.stdout + done.stderr


@pytest.mark.parametrize("example", EXAMPLES)
def test_a_record_that_was_changed_is_found_out(example, cascade_bundle, tmp_path):
    folder = shutil.copytree(cascade_bundle.folder, tmp_path / "b")
    record = folder / "verify" / "record2.csv"
    record.write_text(record.read_text().replace("\n1.0,", "\n1.0,9", 1))
    done = run(example, folder)
    assert done.returncode == 1
    assert done.stdout.count(": NOT as recorded") == EXAMPLES[example] // 3
