"""Whether gain and phase go together: units and signs that a file does not say."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from scipy import signal

from sysid.ingest.inspecting.undescribed import GuessedWarning
from sysid.ingest.responses import read_response
from sysid.ingest.tables.gain_and_phase import agreement, phase_of_gain

W = np.geomspace(0.1, 60.0, 50)
PLANTS: dict[str, tuple[list[float], list[float]]] = {
    "a lag": ([3.0], [1.0, 1.0]),
    "a resonance": ([100.0], [1.0, 4.0, 100.0]),
    "an integrator": ([1.0], [1.0, 1.0, 0.0]),
    "a high pass": ([1.0, 0.0], [1.0, 1.0]),
    "a resonance behind its opposite": ([1.0, 0.1, 4.0], [1.0, 0.4, 25.0]),
    "a lag of negative gain": ([-2.0], [1.0, 1.0]),
}
LATE = 0.03


def answer(plant: str, late: float = 0.0) -> Any:
    top, bottom = PLANTS[plant]
    return signal.freqs(top, bottom, W)[1] * np.exp(-1j * late * W)


def read(columns: dict[str, Any], **said: Any) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", GuessedWarning)
        return read_response({"w [rad/s]": W, **columns}, **said)


@pytest.mark.parametrize("plant", PLANTS)
def test_the_phase_of_a_gain_is_that_of_the_plant(plant: str) -> None:
    H = answer(plant)
    off = np.unwrap(np.angle(H)) - phase_of_gain(W, np.log(np.abs(H)))
    off -= np.pi * np.round(np.median(off) / np.pi)
    assert np.sqrt(np.mean(off**2)) < 0.12


@pytest.mark.parametrize("late", [0.0, LATE])
@pytest.mark.parametrize("plant", PLANTS)
def test_no_unit_that_is_wrong_agrees(plant: str, late: float) -> None:
    H = answer(plant, late)
    gain, phase = np.log(np.abs(H)), np.unwrap(np.angle(H))
    right = agreement(W, gain, phase)
    assert right is not None
    assert right.agrees
    turned = agreement(W, gain, -phase)
    assert turned is not None
    assert turned.turned
    for other in (np.degrees(phase), np.radians(phase)):
        wrong = agreement(W, gain, other)
        assert wrong is not None
        assert not wrong.follows


@pytest.mark.parametrize("unit", ["deg", "rad"])
@pytest.mark.parametrize("plant", PLANTS)
def test_the_unit_of_a_phase_is_that_in_which_it_goes_with_the_gain(plant: str, unit: str) -> None:
    """Radians beyond a turn had been read as degrees, and degrees within 6.28 of 0 as radians."""
    H = answer(plant, 0.3 if unit == "rad" else 0.0)
    phase = np.unwrap(np.angle(H))
    found = read({"mag [1]": np.abs(H), "phase": phase if unit == "rad" else np.degrees(phase)})
    np.testing.assert_allclose(found.values, H, atol=1e-9)
    assert f"phase in {unit}, as gain and phase go together so" in found.notes[0]


def test_decibels_that_are_all_above_0_are_no_ratio() -> None:
    H = 1e4 * answer("a lag")
    found = read({"mag": 20.0 * np.log10(np.abs(H)), "phase [deg]": np.degrees(np.angle(H))})
    np.testing.assert_allclose(found.values, H)
    assert "mag in dB, as gain and phase go together so" in found.notes[0]


def test_where_they_do_not_tell_the_numbers_alone_are_asked() -> None:
    found = read({"mag": np.ones(len(W)), "phase": -np.degrees(LATE * W)})  # a dead time and nothing else
    assert "a ratio, as none is below 0" in found.notes[0]
    assert "beyond a turn" in found.notes[1]


def test_a_lag_that_is_written_as_a_positive_number_is_turned_and_told() -> None:
    H = answer("a resonance", LATE)
    lag = {"mag [1]": np.abs(H), "lag phase [deg]": -np.degrees(np.unwrap(np.angle(H)))}
    with pytest.warns(GuessedWarning, match="with its sign turned"):
        found = read_response({"w [rad/s]": W, **lag})
    np.testing.assert_allclose(found.values, H, atol=1e-9)
    kept = read(lag, units={"phase": "deg"})
    np.testing.assert_allclose(kept.values, H.conj(), atol=1e-9)
    said = read(lag, units={"phase": "-deg"})
    np.testing.assert_allclose(said.values, H, atol=1e-9)
    assert said.notes == kept.notes == ()


def test_an_imaginary_part_of_the_other_sign_is_turned_and_told() -> None:
    H = answer("a lag")
    columns = {"re": H.real, "im": -H.imag}
    np.testing.assert_allclose(read(columns).values, H)
    np.testing.assert_allclose(read(columns, units={"imaginary": "1"}).values, H.conj())
    np.testing.assert_allclose(read({"H": H.conj()}).values, H.conj())  # complex numbers say their sign


def test_an_unstable_plant_keeps_its_phase_and_is_told_of() -> None:
    H = 2.0 / (1j * W - 1.0)
    found = read({"mag [1]": np.abs(H), "phase [deg]": np.degrees(np.angle(H))})
    np.testing.assert_allclose(found.values, H)
    assert "unstable plant" in found.notes[0]


def test_a_name_that_says_another_unit_is_told_of_and_believed() -> None:
    H = answer("a resonance")
    found = read({"mag [1]": np.abs(H), "phase [deg]": np.angle(H)})
    assert "says deg, and gain and phase go together in rad" in found.notes[0]
    np.testing.assert_allclose(np.degrees(np.angle(found.values)), np.angle(H), atol=1e-9)
