"""The door to data sets: recipes, options, units, and what it refuses."""

import numpy as np
import pytest

from sysid.airbrake.generate import generate
from sysid.errors import ConfigError, UnitError
from sysid.excitation import excite
from sysid.traces import Channel
from sysid.units import Reference

PSI = {"unit": "psi", "reference": Reference.GAUGE}
CHANNELS = tuple(Channel(name=name, **PSI) for name in ("STP", "BP", "AR", "BC"))
RECIPE = {"command": [[0, 90], [20, 70], [300, 90]], "time_unit": "ds"}
SMALL = {"pairs": 2}


def made(recipe=RECIPE, options=SMALL, channels=CHANNELS, sample_time=0.1):
    return generate(case="A", recipe=recipe, options=options, channels=channels, sample_time=sample_time)


def test_a_trace_has_the_channels_asked_for() -> None:
    trace = made()
    assert (trace.name, trace.sample_time, trace.channels, len(trace)) == ("A", 0.1, CHANNELS, 300)
    assert trace["STP"][[0, 19, 20, -1]].tolist() == [90.0, 90.0, 70.0, 70.0]
    assert trace["BP"][0] == pytest.approx(90.0)
    assert trace["BC"][-1] == pytest.approx(49.0, abs=2.0)
    assert "variant acoustic" in trace.provenance[0]


def test_other_units_are_the_same_pressures() -> None:
    channels = (
        Channel(name="BP", unit="bar", reference=Reference.ABSOLUTE),
        Channel(name="BC", unit="kPa", reference=Reference.GAUGE),
        Channel(name="STP", unit="kPa", reference=Reference.GAUGE),
    )
    other, psi = made(channels=channels), made()
    np.testing.assert_allclose(other["BP"], psi["BP"] * 0.06894757 + 1.01325, rtol=1e-6)
    np.testing.assert_allclose(other["BC"], psi["BC"] * 6.894757, rtol=1e-6)
    assert other["STP"][0] == pytest.approx(620.528, abs=1e-2)


def test_quantities_name_channels_and_nodes() -> None:
    options = SMALL | {"quantities": {"HEAD": {"pipe": 2}, "TAIL": {"cylinder": 5}, "K": "command", "Q": "auxiliary"}}
    trace = made(options=options, channels=tuple(Channel(name=name, **PSI) for name in ("TAIL", "HEAD", "K", "Q")))
    straight = made(options=SMALL | {"node": 5})
    np.testing.assert_array_equal(trace["TAIL"], straight["BC"])
    np.testing.assert_array_equal(trace["K"], straight["STP"])
    assert trace["HEAD"][25] < straight["BP"][25]
    np.testing.assert_array_equal(trace["Q"], made()["AR"])


def test_switches_reach_the_physics() -> None:
    listing = made(options=SMALL | {"variant": "listing"})
    mended = made(options=SMALL | {"variant": "listing", "switches": {"piston": True}})
    assert listing["BC"][-1] > mended["BC"][-1] + 3.0
    assert "piston=True" in mended.provenance[0]


def test_equipment_brings_its_valve_and_its_running_pressure() -> None:
    uic = SMALL | {"equipment": "uic-p", "loads": 0.5, "locomotives": [2]}
    command = {"command": [[0, 72.5], [20, 40], [300, 40]], "time_unit": "ds"}
    trace = made(recipe=command, options=uic)
    assert trace["BP"][0] == pytest.approx(72.52, abs=0.02)  # 5 bar
    assert trace["BC"][-1] == pytest.approx(0.5 * 55.114, abs=0.5)  # 3.8 bar
    assert "equipment uic-p" in trace.provenance[0]
    late = made(recipe=command, options=uic | {"radio": {"delay": 5.0}})
    assert late["BP"][60] > trace["BP"][60] + 1.0


def test_a_random_recipe_repeats_from_its_seed() -> None:
    recipe = {"random": {"seed": 3, "duration": 60.0, "emergency": 0.5}}
    assert made(recipe=recipe).digest == made(recipe=recipe).digest
    assert made(recipe=recipe).digest != made(recipe={"random": {"seed": 4, "duration": 60.0}}).digest


@pytest.mark.parametrize("kind", ["ramps", "aprbs", "sine"])
def test_an_excitation_moves_the_handle(kind: str) -> None:
    drawn = {"kind": kind, "seed": 3, "duration": 60.0, "low": 70.0}
    trace = made(recipe={"excitation": drawn})
    expected = excite(kind, sample_time=0.1, duration=60.0, low=70.0, high=90.0, seed=3)
    np.testing.assert_allclose(trace["STP"], expected.values[:, 0], rtol=0.0, atol=1e-12)
    assert trace["BC"].max() > 1.0


@pytest.mark.parametrize(
    ("change", "error", "said"),
    [
        ({"recipe": {}}, ConfigError, "one of command, random and excitation"),
        ({"recipe": {"command": [[0, 90], [1, 80]], "seed": 3}}, ConfigError, "recipe of case A, field seed"),
        ({"recipe": {"random": {"duration": 5.0}}}, ConfigError, r"random\.seed"),
        ({"recipe": {"excitation": {"kind": "ramp", "seed": 1, "duration": 9.0}}}, ConfigError, "mean ramps"),
        ({"recipe": {"excitation": {"kind": "sine", "seed": 1}}}, ConfigError, r"excitation\.duration"),
        ({"recipe": {"command": [[0, 120], [9, 90]]}}, ConfigError, "exceeds the running pressure"),
        ({"recipe": {"random": {"seed": 1, "duration": 9.0, "steps": 0}}}, ConfigError, "steps is out of range"),
        ({"options": {"pairs": 0}}, ConfigError, "options of the generator, field pairs"),
        ({"options": {"variant": "real"}}, ConfigError, "unknown variant"),
        ({"options": {"equipment": "kunze-knorr"}}, ConfigError, "unknown equipment"),
        ({"options": {"equipment": "abd", "variant": "listing"}}, ConfigError, "both given"),
        ({"options": {"radio": {"loss": 2.0}, "locomotives": [1]}}, ConfigError, "not a radio"),
        ({"options": {"radio": {"delay": 2.0}}}, ConfigError, "radio changes nothing here"),
        ({"options": {"speed": 5.0}}, ConfigError, "speed changes nothing here"),
        ({"options": {"pairs": True}}, ConfigError, "field pairs"),
        ({"recipe": {"command": [[0, 90], [1.01, 70], [1.03, 90], [9, 90]]}}, ConfigError, "falls between two samples"),
        ({"options": {"switches": {"pistons": True}}}, ConfigError, "unknown switch pistons"),
        ({"options": {"node": 4}}, ConfigError, "no auxiliary pressure at node 4"),
        ({"options": {"quantities": {"BP": "steam"}}}, ConfigError, "unknown quantity"),
        ({"options": {"quantities": {"BP": {"pipe": 2, "cylinder": 3}}}}, ConfigError, "unknown quantity"),
        ({"options": {"quantities": {"BP": {}}}}, ConfigError, "unknown quantity"),
        ({"channels": (Channel(name="T", unit="K"),)}, ConfigError, "does not know what channel T is"),
        ({"channels": (Channel(name="BC", unit="K", reference=Reference.GAUGE),)}, UnitError, "cannot convert"),
        ({"channels": (Channel(name="BC", unit="psi"),)}, UnitError, "a reference is known on one side"),
    ],
    ids=lambda value: str(value)[:48] if isinstance(value, dict) else "",
)
def test_what_cannot_be_made_is_refused(change: dict, error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        made(**change)
