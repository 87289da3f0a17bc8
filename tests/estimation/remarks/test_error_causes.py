"""An error that is more than it need be is told by its cause; a right model in any noise is not accused."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid
from sysid.estimation.remarks.error_causes import causes
from sysid.estimation.remarks.fitted_run import FreeRun
from sysid.models import History, Mapping

N = 600
CAUSES = {
    "lone": "lone samples of y jump away",
    "end": "y stands at its greatest value in",
    "drift": "y drifts: besides what its inputs do it rises",
    "nothing": "Nothing in these records says that y moves with u",
    "memory": "the model has too little memory",
    "curve": "along a curve that the model lacks",
    "play": "after a play, as with backlash",
    "lasting": "is no noise of a sensor",
}


def _u(seed: int) -> np.ndarray:
    return np.repeat(np.random.default_rng(seed).uniform(-1.0, 1.0, N // 10), 10)


def _slow(x: np.ndarray, tau: float = 6.0) -> np.ndarray:
    pole = np.exp(-1.0 / tau)
    return lfilter([0.0, 1.0 - pole], [1.0, -pole], x)


def _truth(u: np.ndarray) -> np.ndarray:
    return _slow(np.tanh(2.0 * u)) + 0.3 * _slow(u, 15.0)


def _play(u: np.ndarray, width: float) -> np.ndarray:
    at, held = 0.0, []
    for value in u:
        at = min(max(at, value - width), value + width)
        held.append(at)
    return np.array(held)


def _told(u: np.ndarray, y: np.ndarray, simulated: np.ndarray, parameters: int = 10, **beside: np.ndarray) -> list[str]:
    model = SimpleNamespace(
        mapping=Mapping(inputs=("u",), outputs=("y",)),
        pole_radius=None,
        n_parameters=parameters,
        simulate=lambda inputs, _: np.zeros(len(inputs)),
    )
    run = FreeRun(
        inputs=u[:, np.newaxis],
        output=y[:, np.newaxis],
        simulated=simulated[:, np.newaxis],
        usable=np.ones(len(u), dtype=bool),
        history=History.at_rest(inputs=[0.0], output=0.0),
        beside=beside,
    )
    return causes(model, run)


def _noise(kind: str, rng: np.random.Generator) -> np.ndarray:
    e = rng.laplace(size=N) if kind == "heavy" else rng.standard_normal(N)
    pole = {"white": 0.0, "heavy": 0.0, "coloured": 0.7, "walk": 1.0}[kind]
    e = lfilter([1.0], [1.0, -pole], e)
    return e / e.std()


@pytest.mark.parametrize("kind", ["white", "heavy", "coloured", "walk"])
@pytest.mark.parametrize("level", [0.12, 0.5, 1.0])
def test_a_right_model_is_not_accused(kind: str, level: float) -> None:
    for seed in range(4):
        u = _u(seed)
        clean = _truth(u)
        told = _told(u, clean + level * clean.std() * _noise(kind, np.random.default_rng(seed)), clean)
        assert [one for one in told if CAUSES["lasting"] not in one and "drifts" not in one] == []
        # Of an error that wanders it is said that it wanders; that is no fault of the model's.
        assert bool(told) == (kind == "walk" and level > 0.2)


def _wrong(cause: str, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    u = _u(seed)
    clean, e = _truth(u), rng.standard_normal(N)
    y, simulated = clean + 0.02 * e, clean
    if cause == "lone":
        y[rng.integers(1, N - 1, 4)] += 5.0
    elif cause == "end":
        y = np.minimum(y, 0.4)
    elif cause == "drift":
        y = y + np.linspace(0.0, 2.0, N)
    elif cause == "nothing":
        y, simulated = 0.1 * np.cumsum(e) + e, 0.3 * clean
    elif cause == "memory":
        y = y + _slow(u, 20.0)
    elif cause == "curve":
        y = y + _slow(u**2)
    elif cause == "play":
        u = np.interp(np.arange(N), np.arange(0, N + 12, 12), rng.uniform(-1.0, 1.0, N // 12 + 1))
        y, simulated = _slow(_play(u, 0.4)) + 0.01 * e, 0.6 * _slow(u)
    else:
        y = y + 2.0 * _slow(_u(seed + 100), 15.0)
    return u, y, simulated


@pytest.mark.parametrize("cause", CAUSES)
def test_each_cause_is_told_and_no_other(cause: str) -> None:
    for seed in range(3):
        told = _told(*_wrong(cause, seed))
        assert len(told) == 1, told
        assert CAUSES[cause] in told[0]


def test_masked_samples_say_nothing() -> None:
    u, y, simulated = _wrong("curve", 0)
    model = SimpleNamespace(mapping=Mapping(inputs=("u",), outputs=("y",)), pole_radius=None, n_parameters=10)
    run = FreeRun(
        inputs=u[:, np.newaxis],
        output=np.where(np.arange(N) < 90, y, np.nan)[:, np.newaxis],
        simulated=simulated[:, np.newaxis],
        usable=np.arange(N) < 90,
        history=History.at_rest(inputs=[0.0], output=0.0),
    )
    assert causes(model, run) == []  # too few
    spoilt = _wrong("curve", 0)[1]
    spoilt[200:220] = 1e6
    masked = FreeRun(
        inputs=run.inputs,
        output=spoilt[:, np.newaxis],
        simulated=run.simulated,
        usable=~((np.arange(N) >= 200) & (np.arange(N) < 220)),
        history=run.history,
    )
    (told,) = causes(model, masked)
    assert CAUSES["curve"] in told


BUDGET = sysid.Training(max_iterations=10, starts=1)


@pytest.mark.parametrize(
    ("structure", "training"),
    [
        (sysid.ARX(na=1, nb=1, nk=1), None),
        (sysid.OE(nb=1, nf=1, nk=1), None),
        (sysid.NeuralStateSpace(states=1, neurons=0), BUDGET),
        (sysid.HammersteinWiener(states=1), BUDGET),
        (sysid.PolynomialNARX(input_delays=1, output_delays=1, degree=1), BUDGET),
        (sysid.GreyBox(equations="dx/dt = (u - x)/tau\ny = g*x", parameters={"tau": 5.0, "g": 1.0}), BUDGET),
    ],
    ids=lambda one: getattr(one, "kind", ""),
)
def test_every_structure_says_what_its_error_is_of(structure: object, training: object) -> None:
    """The output is a parabola of the input, and none of these bends."""
    u = _u(3)
    traces = sysid.data((u, _slow(3.0 * u**2) + _slow(u)), sample_time=1.0)
    fit = sysid.fit(traces, "u -> y", structure, training, stability=sysid.StabilityOptions(count=0))
    assert len([one for one in fit.warnings if CAUSES["curve"] in one]) == 1
    assert set(fit.warnings) <= set(fit.notes)


@pytest.mark.parametrize("held", [1, 20, 37])
def test_a_dead_time_is_told_as_it_is_where_levels_are_held(held: int) -> None:
    """Levels go back and forth: what a change did 41 samples later was told of the one before, 20 samples too early."""
    rng = np.random.default_rng(held)
    u = np.repeat(rng.uniform(-1.0, 1.0, 1500 // held + 1), held)[:1500]
    y = lfilter([*np.zeros(41), 0.1], [1.0, -0.9], u) + 0.005 * rng.standard_normal(1500)
    fit = sysid.fit(sysid.data((u, y), sample_time=0.1), "u -> y", sysid.ARX(na=1, nb=1, nk=1))
    assert [note for note in fit.notes if "Begin there (nk: 41)" in note]


@pytest.mark.parametrize("seed", [1, 2, 11])
def test_a_dead_time_beside_a_slow_input_is_no_curve(seed: int) -> None:
    """No row of filters made it, and products of them did: a network was recommended for a linear plant."""
    rng = np.random.default_rng(seed)
    u, v = np.repeat(rng.choice([0.0, 1.0], 60), 10), np.repeat(rng.uniform(0.0, 5.0, 40), 15)
    y = lfilter([0.0] * 4 + [0.3], [1.0, -0.85], u) + lfilter([0.0, 0.05], [1.0, -0.95], v)
    y += 20.0 + 0.02 * rng.standard_normal(600)
    traces = sysid.data({"u": u, "v": v, "y": y}, inputs=["u", "v"], outputs="y", sample_time=1.0)
    fit = sysid.fit(traces, "u+v -> y", sysid.ARX(na=2, nb=2, nk=1))
    assert any("too little memory, or not the right one" in warning for warning in fit.warnings)
    assert not any("curve" in warning for warning in fit.warnings)


@pytest.mark.parametrize("seed", range(6))
def test_an_output_behind_a_curve_and_filters_moves_with_its_inputs(seed: int) -> None:
    """An even curve of what two inputs do slowly, followed once more: it was said that nothing moves it with them."""
    rng = np.random.default_rng(seed)
    u, v = (np.repeat(rng.uniform(-1.0, 1.0, 100), hold)[:400] for hold in (8, 5))
    within = _slow(0.15 * np.tanh(2.0 * u) + 0.05 * v)
    y = _slow(within**2, 2.0)
    model = SimpleNamespace(mapping=Mapping(inputs=("u", "v"), outputs=("y",)), pole_radius=None, n_parameters=10)
    run = FreeRun(
        inputs=np.column_stack([u, v]),
        output=y[:, np.newaxis],
        simulated=np.full((400, 1), y.mean()),
        usable=np.ones(400, dtype=bool),
        history=History.at_rest(inputs=[0.0, 0.0], output=0.0),
    )
    (told,) = causes(model, run)
    assert "along a curve that the model lacks" in told


def test_channels_that_the_model_does_not_read_and_that_move_its_error_are_named() -> None:
    u, w, v = _u(0), _u(1), _u(2)
    y = _slow(u) + 0.5 * _slow(w, 9.0) + 0.01 * np.random.default_rng(3).standard_normal(N)
    (told,) = _told(u, y, _slow(u), valve=w, weather=v, stood=np.ones(N))
    assert "moves with earlier values of valve, which the record has" in told
    (told,) = _told(u, y + 0.4 * _slow(v, 4.0), _slow(u), valve=w, weather=v, other=_u(5))
    assert re.search("earlier values of (valve and weather|weather and valve), which", told)


def test_a_drift_is_not_told_by_a_clock_that_was_recorded() -> None:
    u, clock = _u(0), np.linspace(0.0, 2.0, N)
    told = _told(u, _slow(u) + clock, _slow(u) + 1.0, clock=clock, counts=np.floor(20.0 * clock))
    assert len(told) == 1
    assert CAUSES["drift"] in told[0]


@pytest.mark.parametrize("seed", range(8))
def test_a_channel_that_wanders_by_itself_is_not_accused(seed: int) -> None:
    rng = np.random.default_rng(seed)
    u, walk = _u(seed), np.cumsum(rng.standard_normal(N))
    lasting = lfilter([1.0], [1.0, -0.97], 0.1 * rng.standard_normal(N))
    told = _told(u, _slow(u) + lasting, _slow(u), walk=walk / np.std(walk), noise=rng.standard_normal(N))
    assert not any("does not read" in one for one in told)


def test_outputs_that_drive_each_other_are_told_where_each_has_a_model_of_its_own() -> None:
    u, x, values = np.column_stack([_u(0), _u(1)]), np.zeros(2), []
    for now in u:
        values.append(x)
        x = np.array([[0.9, 0.1], [-0.2, 0.8]]) @ x + np.array([[0.1, 0.05], [0.0, 0.2]]) @ now
    traces = sysid.data((u, np.array(values)), sample_time=1.0)
    apart = sysid.fit(traces, "u1+u2 -> y1+y2", sysid.ARX(na=1, nb=1, nk=1))
    assert any(one.startswith("y2: ") and "earlier values of y1, which the record has" in one for one in apart.warnings)
    together = sysid.fit(traces, "u1+u2 -> y1+y2", sysid.NARX(input_delays=1, output_delays=1, neurons=0))
    assert not together.warnings


STRUCTURES = [
    sysid.ARX(na=2, nb=2, nk=1),
    sysid.TransferFunction(poles=1, zeros=0),
    sysid.LinearStateSpace(states=1, noise=False),
]


@pytest.mark.parametrize("structure", STRUCTURES, ids=lambda one: type(one).__name__)
def test_a_run_that_follows_how_its_record_begins_and_no_input_says_so(structure: object) -> None:
    rng = np.random.default_rng(5)
    u, decay = rng.normal(size=1000), 5.0 * 0.995 ** np.arange(1000)
    begins = "The free run of y follows how the record begins, and not u"
    y = decay + 0.15 * rng.normal(size=1000)
    fit = sysid.fit(sysid.data({"u": u, "y": y}, sample_time=0.1), "u -> y", structure)
    assert any(text.startswith(begins) for text in fit.warnings)
    moved = y + 4.0 * lfilter([0.0, 0.1], [1.0, -0.9], u)
    fit = sysid.fit(sysid.data({"u": u, "y": moved}, sample_time=0.1), "u -> y", structure)
    assert not any(text.startswith(begins) for text in fit.warnings)


@pytest.mark.parametrize("structure", [sysid.OE(nb=2, nf=2, nk=1), sysid.ARX(na=2, nb=2, nk=1)])
def test_a_curve_before_a_resonance_is_told(structure: sysid.OE) -> None:
    """A dead zone before a lightly damped plant is no sum of curves behind slow filters: 20 % were lost in silence."""
    rng = np.random.default_rng(2)
    u = np.repeat(rng.uniform(-1.5, 1.5, 300), 3)
    moved = np.sign(u) * np.maximum(np.abs(u) - 0.6, 0.0)
    y = lfilter([0.0, 0.6, 0.4], np.poly([0.9 * np.exp(1.0j), 0.9 * np.exp(-1.0j)]).real, moved)
    traces = sysid.data((u, y + 0.03 * y.std() * rng.standard_normal(len(u))), sample_time=1.0)
    told = sysid.fit(traces, "u -> y", structure).warnings
    assert [one for one in told if CAUSES["curve"] in one]
