"""Records whose inputs move between samples, and such as are held: told where a plant is fitted to the former."""

import dataclasses

import numpy as np
import pytest
from scipy import signal

import sysid
from sysid.estimation import fitting
from sysid.models import Mapping, Start, StartKind
from sysid.traces import Trace
from tests.estimation.linear_systems import trace_of

ONE, TWO = Mapping.parse("u1 -> y"), Mapping.parse("u1+u2 -> y")
ESTIMATED = Start(kind=StartKind.ESTIMATED)
SOONER = "sooner than this model has it"
FINE = 40
PLANTS = {1: ([2.0], [1.0, 1.0]), 2: ([1.0, 0.5], [1.0, 1.4, 1.0])}
"""By number of poles; one sample is a fifth of a radian of them."""
T = 0.5


def record(
    order: int, kind: str, *, noise: float, seed: int = 0, n: int = 600, late: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Input and output of a plant that is run forty times between samples, so many samples late."""
    rng, t = np.random.default_rng(seed), np.arange(n * FINE) * T / FINE
    if kind == "ramps":
        u = np.interp(t, np.arange(0.0, t[-1] + 4.0, 3.0), rng.uniform(-1, 1, len(np.arange(0.0, t[-1] + 4.0, 3.0))))
    else:
        u = sum(np.sin(w * t + p) for w, p in zip(np.geomspace(0.05, 1.5, 8), rng.uniform(0, 7, 8), strict=True))
    if kind == "held":
        u = np.repeat(u[::FINE], FINE)
    if kind == "levels":
        u = np.repeat(rng.choice([-1.0, 1.0], n), FINE)
    held = kind in {"held", "levels"}
    num, den, _ = signal.cont2discrete(PLANTS[order], T / FINE, "zoh" if held else "foh")
    dead = round(late * FINE)
    y = np.concatenate([np.zeros(dead), signal.lfilter(np.ravel(num), den, u)])[: len(u) : FINE]
    return u[::FINE], y + noise * np.std(y) * rng.normal(size=n)


def structures(poles: int) -> list:
    zeros = poles - 1
    continuous = {"poles": (poles,), "zeros": (zeros,), "delays": (0,), "domain": "continuous"}
    return [
        sysid.ARX(na=poles, nb=(poles,), nk=(1,)),
        sysid.OE(nb=(poles,), nf=(poles,), nk=(1,)),
        sysid.LinearStateSpace(states=poles),
        sysid.TransferFunction(**continuous),
        sysid.ProcessModel(type="P2ZU" if zeros else "P1"),
    ]


def warned(structure, u, y, mapping=ONE) -> list[str]:
    fit = fitting.fit([trace_of(u, y, sample_time=T)], mapping, structure, start=ESTIMATED, stability=None)
    return [told for told in fit.warnings if SOONER in told]


@pytest.mark.parametrize("kind", ["sines", "ramps"])
@pytest.mark.parametrize("poles", PLANTS)
def test_an_input_that_moves_between_samples_is_told_with_the_option_that_mends_it(poles: int, kind: str) -> None:
    u, y = record(poles, kind, noise=0.01)
    words = ["nk: 0 and nb", "nk: 0 and nb", "feedthrough: true", "write intersample: foh", "intersample: foh"]
    for structure, word in zip(structures(poles), words, strict=True):
        (told,) = warned(structure, u, y)
        assert word in told


def test_what_it_says_is_what_the_option_gives() -> None:
    u, y = record(1, "sines", noise=0.01)
    held, moving = (
        sysid.TransferFunction(poles=1, zeros=0, delays=0, domain="continuous", intersample=between)
        for between in ("zoh", "foh")
    )
    (told,) = warned(held, u, y)
    fits = [
        fitting.fit([trace_of(u, y, sample_time=T)], ONE, one, start=ESTIMATED, stability=None)
        for one in (held, moving)
    ]
    for fit, said in zip(fits, ("without it one of", "has a fit of"), strict=True):
        percent = float(told.split(said)[1].split(" %")[0])
        own = 100.0 * (1.0 - np.sqrt(fit.history["mse"][-1]) / np.std(y))
        assert percent == pytest.approx(own, abs=0.3)
    assert not warned(moving, u, y)
    assert not warned(sysid.OE(nb=(2,), nf=(1,), nk=(0,)), u, y)


@pytest.mark.parametrize("kind", ["held", "levels"])
@pytest.mark.parametrize(("poles", "fitted"), [(1, 1), (2, 2), (2, 1)])
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_inputs_that_are_held_bring_no_word_not_even_of_a_model_too_small(kind, poles, fitted, noise) -> None:
    u, y = record(poles, kind, noise=noise, seed=3)
    assert not any(warned(structure, u, y) for structure in structures(fitted))


def test_of_two_inputs_the_one_that_moves_is_told() -> None:
    moves, y = record(1, "sines", noise=0.0)
    held, z = record(2, "levels", noise=0.0, seed=4)
    u = np.column_stack([held, moves])
    (told,) = warned(sysid.OE(nb=(2, 1), nf=(2, 1), nk=(1, 1)), u, y + z, TWO)
    assert told.startswith("y answers u2 sooner")


def test_a_controller_is_not_read_backwards() -> None:
    rng, n = np.random.default_rng(3), 600
    target = signal.lfilter([0.1], [1.0, -0.9], np.repeat(rng.choice([-1.0, 1.0], 40), 15))
    u, y, x = np.zeros(n), np.zeros(n), 0.0
    for k in range(n):
        y[k] = x + 0.1 * rng.normal()
        u[k] = 0.5 * (target[k] - y[k])
        x = np.exp(-T) * x + 2.0 * (1.0 - np.exp(-T)) * u[k]
    assert not any(warned(structure, u, y) for structure in structures(1))


def test_masked_samples_say_nothing() -> None:
    u, y = record(1, "sines", noise=0.01)
    usable = np.arange(600) % 7 != 0
    trace = trace_of(u, np.where(usable, y, 0.0), sample_time=T)
    masked = Trace(name="masked", sample_time=T, channels=trace.channels, values=trace.values, usable=usable)
    fit = fitting.fit([masked], ONE, sysid.OE(nb=(1,), nf=(1,), nk=(1,)), start=ESTIMATED, stability=None)
    assert any(SOONER in told for told in fit.warnings)


HELD_TOLD = "as if it were held between samples"


def moving(poles: int) -> sysid.TransferFunction:
    return sysid.TransferFunction(
        poles=(poles,), zeros=(poles - 1,), delays=(0,), domain="continuous", intersample="foh"
    )


def said_held(u, y, poles: int) -> list[str]:
    fit = fitting.fit([trace_of(u, y, sample_time=T)], ONE, moving(poles), start=ESTIMATED, stability=None)
    return [told for told in fit.warnings if HELD_TOLD in told]


@pytest.mark.parametrize("kind", ["held", "levels"])
@pytest.mark.parametrize("poles", PLANTS)
def test_an_input_that_is_held_is_told_where_the_model_has_it_move(poles: int, kind: str) -> None:
    told = said_held(*record(poles, kind, noise=0.01), poles)
    assert len(told) == 1 and "intersample: zoh" in told[0]


@pytest.mark.parametrize("kind", ["sines", "ramps"])
@pytest.mark.parametrize("poles", PLANTS)
def test_an_input_that_does_move_is_not_said_to_be_held(poles: int, kind: str) -> None:
    for seed in range(4):
        assert not said_held(*record(poles, kind, noise=(0.01, 0.1)[seed % 2], seed=seed), poles)


def test_a_model_with_too_few_poles_is_not_told_of_a_hold() -> None:
    for seed in range(4):
        assert not said_held(*record(2, "sines", noise=0.01, seed=seed), 1)


def continuous(poles: int, zeros: int) -> sysid.TransferFunction:
    return sysid.TransferFunction(poles=poles, zeros=zeros, domain="continuous")


def told_late(structure: sysid.TransferFunction, u: np.ndarray, y: np.ndarray) -> list[str]:
    fit = fitting.fit([trace_of(u, y, sample_time=T)], ONE, structure, start=ESTIMATED, stability=None)
    return [told for told in fit.warnings if "delays: auto" in told]


@pytest.mark.parametrize("late", [0.5, 1.3])
@pytest.mark.parametrize("poles", PLANTS)
def test_a_dead_time_that_ends_between_samples_is_found_and_one_of_whole_samples_told(poles: int, late: float) -> None:
    """Such fits ended 3 to 5 points below what the record allows, CONVERGED, without a word."""
    u, y = record(poles, "levels", noise=0.01, late=late)
    given = dataclasses.replace(continuous(poles, poles - 1), delays=(int(late),))
    (told,) = told_late(given, u, y)
    assert "no whole number of samples" in told
    said = float(told.split(", and ")[1].split(" %")[0])
    fit = fitting.fit(
        [trace_of(u, y, sample_time=T)], ONE, continuous(poles, poles - 1), start=ESTIMATED, stability=None
    )
    assert said == pytest.approx(100.0 * (1.0 - np.sqrt(fit.history["mse"][-1]) / np.std(y)), abs=0.3)
    assert fit.model.delays[0] == pytest.approx(late, abs=0.02) and not fit.warnings


def test_a_zero_that_is_missing_is_told_as_that() -> None:
    u, y = record(2, "levels", noise=0.01)
    (told,) = told_late(continuous(2, 0), u, y)
    assert "Write zeros: 1" in told


@pytest.mark.parametrize("late", [0.0, 2.0])
@pytest.mark.parametrize("poles", PLANTS)
def test_a_dead_time_of_whole_samples_brings_no_word(poles: int, late: float) -> None:
    u, y = record(poles, "levels", noise=0.05, late=late, seed=2)
    assert not told_late(continuous(poles, poles - 1), u, y)
