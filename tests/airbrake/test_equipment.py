"""Rows of brake equipment: times of UIC 540, what the AB family's valves add to each other, empty/load, retainers."""

from functools import cache

import numpy as np
import pytest

from sysid.airbrake.command import Command
from sysid.airbrake.consist import Consist
from sysid.airbrake.equipment import BAR, EQUIPMENT
from sysid.airbrake.radio import Radio
from sysid.airbrake.simulate import AirBrakeRecord, simulate
from sysid.errors import ConfigError
from sysid.units import PSI_IN_PA, STANDARD_ATMOSPHERE_PA

FIVE_BAR = 5.0 * BAR / PSI_IN_PA
BEGAN = 5.0  # s: when every command below moves
UIC = pytest.mark.parametrize(
    ("name", "filled", "emptied"),
    [("uic-p", (3.0, 5.0), (15.0, 20.0)), ("uic-g", (18.0, 30.0), (45.0, 60.0))],
    ids=["P", "G"],
)


@cache
def run(name: str, rows: tuple[tuple[float, float], ...], pairs: int = 1, **consist: float) -> AirBrakeRecord:
    row = EQUIPMENT[name]
    train = Consist(pairs=pairs, valve=row.valve, running_pressure=row.running_pressure, **consist)
    return simulate(Command.from_rows(rows), consist=train, variant=row.variant)


def bar(record: AirBrakeRecord, quantity: str = "cylinder", node: int = 3) -> np.ndarray:
    return (record[quantity, node] - STANDARD_ATMOSPHERE_PA) / BAR


def stopped_and_released(name: str) -> np.ndarray:
    return bar(run(name, ((0.0, FIVE_BAR), (BEGAN, 0.0), (60.0, FIVE_BAR), (130.0, FIVE_BAR))))


@UIC
def test_a_cylinder_fills_and_empties_in_the_times_of_uic_540(
    name: str, filled: tuple[float, float], emptied: tuple[float, float]
) -> None:
    pressure = stopped_and_released(name)
    assert pressure.max() == pytest.approx(3.8, abs=0.05)
    begins = np.argmax(pressure > 0.02)
    assert filled[0] <= 0.1 * (np.argmax(pressure >= 0.95 * 3.8) - begins) <= filled[1]
    falls = 600 + np.argmax(np.diff(pressure[600:]) < 0.0)
    assert emptied[0] <= 0.1 * np.argmax(pressure[falls:] < 0.4) <= emptied[1]


def falling(name: str, by: float, seconds: float) -> np.ndarray:
    """The cylinder while the handle lets the pipe fall evenly, in bar."""
    share = np.arange(0.0, 1.0, 0.1 / seconds)
    rows = [(0.0, FIVE_BAR), *((BEGAN + seconds * s, FIVE_BAR - s * by * BAR / PSI_IN_PA) for s in share)]
    return bar(run(name, (*rows, (BEGAN + seconds, FIVE_BAR - by * BAR / PSI_IN_PA), (BEGAN + seconds + 5.0, 0.0))))


@UIC
def test_a_distributor_is_sensitive_and_insensitive_as_uic_540_says(
    name: str, filled: tuple[float, float], emptied: tuple[float, float]
) -> None:
    applied = falling(name, 0.6, 6.0)
    assert 0.0 < 0.1 * np.argmax(applied > 0.02) - BEGAN <= 1.2
    assert falling(name, 0.3, 60.0).max() < 0.001


def test_a_distributor_releases_in_steps() -> None:
    steps = ((0.0, 5.0), (BEGAN, 3.5), (40.0, 4.2), (90.0, 4.6), (140.0, 5.0), (200.0, 5.0))
    pressure = bar(run("uic-p", tuple((at, value * BAR / PSI_IN_PA) for at, value in steps)))
    assert pressure[[395, 895, 1395, 1995]] == pytest.approx([3.8, 2.03, 1.01, 0.0], abs=0.05)


def applied(name: str, pairs: int = 50) -> AirBrakeRecord:
    return run(name, ((0.0, 90.0), (BEGAN, 64.2), (150.0, 90.0), (210.0, 90.0)), pairs)


def braked_after(name: str) -> float:
    """Seconds until the last cylinder has nine tenths of its pressure."""
    last = applied(name).gauge_psi("cylinder", 101)[:1500]
    return 0.1 * float(np.argmax(last >= 0.9 * last[-1])) - BEGAN


def test_an_accelerated_application_reaches_the_last_car_sooner_and_goes_no_deeper() -> None:
    assert braked_after("abdw") < 0.8 * braked_after("abd")
    assert applied("abdw").gauge_psi("pipe", 101)[1499] == pytest.approx(64.2, abs=1.5)


def test_an_accelerated_release_lets_the_last_car_go_sooner() -> None:
    half = [np.argmax(applied(name).gauge_psi("cylinder", 101)[1500:] < 30.0) for name in ("abd", "ab")]
    assert 0 < half[0] < 0.9 * half[1]


def test_an_empty_car_gets_its_share() -> None:
    rows = ((0.0, 90.0), (BEGAN, 74.0), (40.0, 74.0))
    loaded, empty = (run("abd", rows, loads=share).gauge_psi("cylinder", 3) for share in (1.0, 0.6))
    np.testing.assert_allclose(empty, 0.6 * loaded, rtol=0.0, atol=1e-9)


def test_a_retainer_holds_its_pressure_on_a_release() -> None:
    rows = ((0.0, 90.0), (BEGAN, 70.0), (40.0, 90.0), (140.0, 90.0))
    held, free = (run("abd", rows, retainers=psi).gauge_psi("cylinder", 3) for psi in (20.0, 0.0))
    assert held[400:].min() == pytest.approx(20.0, abs=0.05)
    assert free[-1] < 0.5
    np.testing.assert_array_equal(held[:400], free[:400])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"loads": 1.2}, "loads do not fit"),
        ({"loads": (1.0, 0.6)}, "loads do not fit"),
        ({"retainers": -1.0}, "retainers"),
    ],
    ids=["more than loaded", "two for one pair", "below the atmosphere"],
)
def test_what_fits_no_train_is_refused(options: dict, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        Consist(pairs=1, **options)


# --- distributed power


def test_a_radio_is_late_and_holds_what_it_heard_last() -> None:
    command = np.repeat([90.0, 80.0, 70.0], [10, 30, 30])
    late = Radio(delay=0.5).heard(command, 0.1)
    np.testing.assert_array_equal(late[5:], command[:-5])
    assert set(Radio(loss=1.0).heard(command, 0.1)) == {90.0}


@pytest.mark.parametrize("seed", range(5))
def test_what_is_lost_is_sent_again_every_second(seed: int) -> None:
    command = np.repeat([90.0, 70.0], [5, 1000])
    heard = Radio(delay=0.0, loss=0.9, repeat=1.0, seed=seed).heard(command, 0.1)
    arrives = np.argmax(np.random.default_rng(seed).random(100) >= 0.9)
    assert np.argmax(heard == 70.0) == 5 + 10 * arrives


@pytest.mark.parametrize("wrong", [{"delay": -1.0}, {"loss": 1.5}, {"repeat": 0.0}])
def test_no_radio(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match="not a radio"):
        Radio(**wrong)


def test_a_locomotive_at_the_end_applies_the_last_car_sooner_and_a_lost_link_takes_that_away() -> None:
    rows = Command.from_rows([(0.0, 90.0), (BEGAN, 74.0), (40.0, 74.0)])
    train = Consist(pairs=50, locomotives=(50,))
    radios = {"at once": None, "late": Radio(delay=2.0), "lost": Radio(loss=1.0)}
    last = {
        name: simulate(rows, consist=train, radio=radio).gauge_psi("cylinder", 101) for name, radio in radios.items()
    }
    begins = {name: 0.1 * float(np.argmax(one > 5.0)) - BEGAN for name, one in last.items()}
    assert begins["late"] - begins["at once"] == pytest.approx(2.0, abs=0.25)
    assert last["lost"].max() < 0.5 * last["at once"].max()
