"""Units as people write them, in the words that pint knows."""

from __future__ import annotations

import pytest

from sysid.written_units import plain_unit


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        *(("Grad", "deg"), ("Min", "min"), ("C", "degC"), ("cfm", "ft^3/min"), ("kNm", "kN*m"), ("mPas", "mPa*s")),
        *(("Std", "hour"), ("PS", "metric_horsepower"), ("МПа", "MPa"), ("об/мин", "rpm"), ("mPa", "mPa")),
    ],
)
def test_a_unit_is_what_people_mean_by_it(written: str, meant: str) -> None:
    assert plain_unit(written) == meant


@pytest.mark.parametrize("text", ["Mft", "kin", "cfermi", "mday"])
def test_no_prefix_stands_before_what_has_none(text: str) -> None:
    assert plain_unit(text) is None
