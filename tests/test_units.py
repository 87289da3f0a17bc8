"""What is known of usual units without looking it up is what pint says."""

from __future__ import annotations

import numpy as np
import pint
import pytest

from sysid import units, written_units
from sysid.ingest.tables.time_columns import is_time_unit
from sysid.units import STANDARD_ATMOSPHERE_PA, Reference, atmosphere_in, convert, is_pressure
from sysid.written_units import USUAL_UNITS

REGISTRY = pint.UnitRegistry(cache_folder=None)


def without_pint(patch: pytest.MonkeyPatch) -> None:
    """Nothing is looked up there, neither to convert nor to read how a unit is written."""
    for room in (units, written_units):
        patch.setattr(room, "registry", lambda: pytest.fail("asked pint"))


def of(unit: str) -> pint.Unit:
    return REGISTRY.parse_units("dimensionless" if unit == "1" else unit)


@pytest.mark.parametrize("unit", sorted(USUAL_UNITS))
def test_a_usual_unit_is_what_it_is_to_pint(unit: str) -> None:
    assert is_time_unit(unit) == of(unit).is_compatible_with("s")
    assert is_pressure(unit) == of(unit).is_compatible_with("Pa")
    if is_pressure(unit):
        exact = REGISTRY.Quantity(STANDARD_ATMOSPHERE_PA, "Pa").to(of(unit)).magnitude
        assert atmosphere_in(unit) == float(exact)  # to the last bit, as traces are found again by their bits


@pytest.mark.parametrize("unit", ["kPa", "degC", "1"])
def test_what_has_its_unit_stays_as_it_is(unit: str, monkeypatch: pytest.MonkeyPatch) -> None:
    without_pint(monkeypatch)
    values = np.array([0.1, np.nan, -3e7])
    converted = convert(values, unit, unit)
    np.testing.assert_array_equal(converted, values)
    assert not np.shares_memory(converted, values)


def test_a_reference_is_another_by_the_atmosphere(monkeypatch: pytest.MonkeyPatch) -> None:
    without_pint(monkeypatch)
    values = np.array([0.0, 250.5])
    absolute = convert(values, "kPa", "kPa", reference=Reference.GAUGE, to_reference=Reference.ABSOLUTE)
    np.testing.assert_array_equal(absolute, values + 101.325)


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns", "min", "h"])
def test_stamps_become_seconds_without_pint_and_to_its_last_digit(unit: str, monkeypatch: pytest.MonkeyPatch) -> None:
    stamps = np.random.default_rng(0).normal(scale=1e5, size=1_000)
    without_pint(monkeypatch)
    expected = REGISTRY.Quantity(stamps, REGISTRY.parse_units(unit)).to("s").magnitude
    assert np.array_equal(convert(stamps, unit, "s"), expected)
