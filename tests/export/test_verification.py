"""The programs in a bundle's verify folder, run as a receiver runs them."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from sysid.export import Flag, export_bundle


@pytest.fixture(scope="module")
def bundle(fit, traces, start, tmp_path_factory):
    folder = tmp_path_factory.mktemp("verify") / "b"
    return export_bundle(fit, traces, folder, start=start, formats=["onnx", "c"]).folder


def run_python(bundle):
    script = bundle / "verify" / "verify.py"
    return subprocess.run([sys.executable, "-I", script], capture_output=True, text=True, check=False)


def run_c(bundle, folder, *flags):
    command = ["gcc", "-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", *flags, "-I.", "verify/verify.c"]
    subprocess.run([*command, "bp_ar_to_bc.c", "-lm", "-o", folder / "verify_c"], cwd=bundle, check=True)
    records = sorted((bundle / "verify").glob("record*.csv"))
    return subprocess.run([folder / "verify_c", *records], capture_output=True, text=True, check=False)


def test_python_finds_every_record_as_recorded(bundle):
    done = run_python(bundle)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count(": as recorded") == 3


@pytest.mark.parametrize("flags", [[], ["-O2"]], ids=["not optimised", "optimised"])
def test_c_finds_every_record_as_recorded(bundle, tmp_path, flags):
    done = run_c(bundle, tmp_path, *flags)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count(": as recorded") == 3


def test_c_in_float_is_near(bundle, tmp_path):
    done = run_c(bundle, tmp_path, "-DBP_AR_TO_BC_FLOAT")
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("number", [1, 2, 3])
@pytest.mark.parametrize("language", ["python", "c"])
def test_a_record_that_differs_is_found(bundle, tmp_path, number, language):
    path = bundle / "verify" / f"record{number}.csv"
    before = path.read_text()
    rows = before.splitlines()
    fields = rows[100].split(",")
    fields[3] = repr(float(fields[3]) + 1e-6)
    rows[100] = ",".join(fields)
    path.write_text("\n".join(rows) + "\n")
    try:
        done = run_python(bundle) if language == "python" else run_c(bundle, tmp_path)
    finally:
        path.write_text(before)
    assert done.returncode == 1
    assert done.stdout.count(": as recorded") == 2
    assert "NOT as recorded, largest difference 1.0e-06" in done.stdout


def test_records_are_within_the_range_and_out_of_it(bundle):
    flags = [np.loadtxt(bundle / "verify" / f"record{i}.csv", delimiter=",", skiprows=1)[:, -1] for i in (1, 2, 3)]
    assert (flags[0] == 0).all()
    assert (flags[1] == 0).all()
    assert {int(flag) & Flag.OUTSIDE_RANGE for flag in flags[2]} == {0, Flag.OUTSIDE_RANGE}
    assert (flags[2][-19:].astype(int) & Flag.NOT_A_NUMBER).all()


def test_records_tell_channels_and_units(bundle):
    assert (bundle / "verify" / "record1.csv").read_text().startswith("time [s],BP [psi],AR [psi],BC [psi],flags\n0.0,")
