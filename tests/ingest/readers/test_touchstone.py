"""Touchstone files: units of frequency, forms of numbers, ports, and what follows the responses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sysid
from sysid.errors import ReaderError
from sysid.ingest import read_table

FREQUENCIES = np.geomspace(1e3, 1e7, 40)
LAG = 1.0 / (1.0 + 1j * FREQUENCIES / 1e5)
FORMS = {
    "RI": lambda h: (h.real, h.imag),
    "MA": lambda h: (np.abs(h), np.degrees(np.angle(h))),
    "DB": lambda h: (20.0 * np.log10(np.abs(h)), np.degrees(np.angle(h))),
}


def written(said: str, form: str, *responses: np.ndarray, scale: float = 1.0) -> str:
    cells = np.column_stack([FREQUENCIES / scale, *(part for one in responses for part in FORMS[form](one))])
    return "\n".join(["! of a rig", said, *(" ".join(f"{x:.15g}" for x in row) for row in cells)])


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("unit", "scale"), [("Hz", 1.0), ("kHz", 1e3), ("MHz", 1e6), ("GHZ", 1e9)])
def test_one_port_in_any_form_is_the_same_response(tmp_path: Path, form: str, unit: str, scale: float) -> None:
    (tmp_path / "rig.s1p").write_text(written(f"# {unit} S {form} R 50", form, LAG, scale=scale))
    response = sysid.response_data(tmp_path / "rig.s1p")
    np.testing.assert_allclose(response.frequency, 2.0 * np.pi * FREQUENCIES, rtol=1e-12)
    np.testing.assert_allclose(response.values, LAG, rtol=1e-12)


def test_what_the_line_leaves_out_is_gigahertz_magnitude_and_angle(tmp_path: Path) -> None:
    (tmp_path / "rig.s1p").write_text(written("#", "MA", LAG, scale=1e9))
    np.testing.assert_allclose(sysid.response_data(tmp_path / "rig.s1p").values, LAG, rtol=1e-12)


def test_of_two_ports_what_goes_through_stands_second(tmp_path: Path) -> None:
    others = [np.full(len(LAG), 0.1 + 0.2j), LAG, np.full(len(LAG), 0.01j), np.full(len(LAG), 0.3 - 0.1j)]
    noise = "\n1000 2.1 0.5 30 0.2\n2000 2.2 0.5 30 0.2\n"
    (tmp_path / "rig.S2P").write_text(written("# Hz S RI R 50", "RI", *others) + noise)
    assert read_table(tmp_path / "rig.S2P").names == ("frequency", "S11", "S21", "S12", "S22")
    response = sysid.response_data(tmp_path / "rig.S2P", columns={"complex": "S21"})
    np.testing.assert_allclose(response.values, LAG, rtol=1e-12)
    assert len(response) == len(LAG), "figures of noise are no responses"


def test_rows_of_three_ports_go_on_in_the_next_lines(tmp_path: Path) -> None:
    rows = []
    for f, h in zip(FREQUENCIES, LAG, strict=True):
        pairs = [f"{(k + 1) * h.real:.15g} {(k + 1) * h.imag:.15g}" for k in range(9)]
        rows += [f"{f:.15g} " + " ".join(pairs[:3]), " ".join(pairs[3:6]), " ".join(pairs[6:])]
    (tmp_path / "rig.s3p").write_text("\n".join(["# Hz S RI R 50", *rows]))
    assert read_table(tmp_path / "rig.s3p").names[1:5] == ("S11", "S12", "S13", "S21")
    response = sysid.response_data(tmp_path / "rig.s3p", columns={"complex": "S23"})
    np.testing.assert_allclose(response.values, 6.0 * LAG, rtol=1e-12)


def test_it_is_no_record_over_time(tmp_path: Path) -> None:
    (tmp_path / "rig.s1p").write_text(written("# Hz S RI R 50", "RI", LAG))
    with pytest.raises(ReaderError, match="sysid fit-response"):
        sysid.load(tmp_path / "rig.s1p")


@pytest.mark.parametrize(
    "text",
    ["", "1 2 3\n4 5 6\n", "[Version] 2.0\n# Hz S RI R 50\n1 2 3\n", "# Hz S RI R 50\n", "# Hz S RI R 50\n1 two 3\n"],
    ids=["empty", "no line of options", "version 2", "no rows", "words"],
)
def test_what_is_none_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "rig.s1p").write_text(text)
    with pytest.raises(ReaderError, match=r"Touchstone|samples"):
        read_table(tmp_path / "rig.s1p")
