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


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        *(("pH", "1"), ("p.u.", "1"), ("mol%", "percent"), ("%O2", "percent"), ("Rad/s", "rad/s"), ("lbm/s", "lb/s")),
        *(("м3/ч", "m^3/hour"), ("кДж/кг", "kJ/kg"), ("W/m2K", "W/(m^2*K)"), ("kJ/kg.K", "kJ/(kg*K)")),
        *(("J/kg K", "J/(kg*K)"), ("Nm/A", "(N*m)/A"), ("A/Nm", "A/(N*m)"), ("Amps/s", "A/s"), ("km/Std", "km/hour")),
    ],
)
def test_a_unit_of_several_is_what_people_mean_by_it(written: str, meant: str) -> None:
    """To pint, pH are picohenries, Nm/A a length of yarn, and the K of W/m2 K stands above the stroke."""
    assert plain_unit(written) == meant


def test_a_standard_volume_is_no_unit_of_volume() -> None:
    assert plain_unit("Std. m3/h") is plain_unit("norm m3/h") is None


@pytest.mark.parametrize("text", ["Mft", "kin", "cfermi", "mday"])
def test_no_prefix_stands_before_what_has_none(text: str) -> None:
    assert plain_unit(text) is None
