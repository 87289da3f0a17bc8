"""Units of equations: what contradicts itself is told, and what has no unit is taken for what fits."""

from __future__ import annotations

import re

import pytest

from sysid.equations import System
from sysid.equations.units_checked import unit_contradictions

CARRIAGE = "dq/dt = v; dv/dt = (35.15*u - fv*v - fc*sign(v))/mass; y = q"
FRICTION = {"u": "V", "y": "m", "fv": "N*s/m", "fc": "N", "mass": "kg"}
ROOM = "r = relay(T, on=22, off=low); dT/dt = (outside - T)/tau + r*heat"
HEATED = {"T": "degC", "outside": "degC", "low": "degC", "tau": "s", "heat": "K/s"}
DRAG = {"rho": "kg/m^3", "v": "m/s", "area": "m^2", "y": "N"}
PARAMETERS = ("fv", "fc", "mass", "low", "tau", "heat", "area", "a", "b", "e", "gas", "rho", "late")

TOGETHER = [
    pytest.param(CARRIAGE, FRICTION, id="a force that a number makes of a voltage"),
    pytest.param(ROOM, HEATED, id="temperatures and their differences"),
    pytest.param(ROOM, HEATED | {"outside": "K"}, id="a temperature whose zero lies elsewhere"),
    pytest.param("dh/dt = q/area/60", {"h": "cm", "q": "cm^3/min", "area": "cm^2"}, id="a number that converts"),
    pytest.param(
        "y = flow*4180*(T - 15) + gas*(T - outside)",
        {"flow": "kg/s", "T": "degC", "gas": "W/K", "outside": "degC", "y": "W"},
        id="a heat capacity in a bare number",
    ),
    pytest.param("dx/dt = a*u - b*sqrt(x)", {"x": "cm", "u": "V", "a": "cm/V/s", "b": "cm^0.5/s"}, id="a root"),
    pytest.param("dx/dt = a*(u - 2*x)", {"x": "V", "u": "V"}, id="a parameter of no unit"),
    pytest.param("dx/dt = (u - x)/2", {"x": "V", "u": "V"}, id="a time constant in a bare number"),
    pytest.param("y = a*exp(-e/(gas*T))", {"e": "J/mol", "gas": "J/(mol*K)", "T": "K"}, id="Arrhenius"),
    pytest.param("y = 0.5*rho*v^2*area", DRAG, id="drag"),
    pytest.param("y = max(x, 0) + delay(x, late)", {"x": "m", "y": "m", "late": "s"}, id="a delay"),
    pytest.param(
        "over = max(x - b, 0)/2; dx/dt = a*u - over; y = x - b",
        {"u": "V", "b": "V"},
        id="a rate of which part is unknown",
    ),
    pytest.param("y = x^a + net(p; neurons=2)", {"x": "m", "p": "bar", "y": "V", "a": "1"}, id="what cannot be known"),
]
APART = [
    pytest.param(CARRIAGE, FRICTION | {"fc": "N*m"}, "fv * v is in N, and fc * sign(v) in m*N", id="a sum"),
    pytest.param(CARRIAGE, FRICTION | {"mass": "g"}, "rate of v is in m/s**2, and its equation gives N/g", id="grams"),
    pytest.param(ROOM, HEATED | {"low": "V"}, "T is in °C, and low in V, in the equation of r", id="a relay"),
    pytest.param(ROOM, HEATED | {"outside": "degF"}, "outside is in °F, and T in °C", id="two degrees"),
    pytest.param(ROOM, HEATED | {"tau": "min"}, "°C/min, and r * heat in K/s", id="minutes beside seconds"),
    pytest.param("y = p - x", {"p": "bar", "x": "psi"}, "p is in bar, and x in psi", id="one thing in two units"),
    pytest.param("y = where(p > x, p, 0)", {"p": "bar", "x": "V"}, "p is in bar, and x in V", id="a comparison"),
    pytest.param("y = a*sin(x)", {"a": "V", "x": "deg"}, "sin(x) is of what is in deg: radians", id="degrees"),
    pytest.param("y = a*log(x)", {"a": "V", "x": "bar"}, "log(x) is of what is in bar, where a pure", id="a logarithm"),
    pytest.param("y = delay(x, late)", {"x": "m", "late": "ms"}, "late by what is in ms: seconds", id="a delay in ms"),
    pytest.param("dx/dt = v", {"x": "m", "v": "mm/s"}, "The rate of x is in m/s, and its equation gives mm/s", id="mm"),
    pytest.param("x[k+1] = a*x + b", {"x": "m", "a": "m", "b": "m"}, "a * x is in m**2, and b in m", id="next sample"),
    pytest.param("y = 2*rho*v", DRAG, "y is in N, and its equation gives kg/m**2/s", id="a factor that is forgotten"),
    pytest.param("y = a*x", {"a": "fofo", "x": "V"}, "a is in fofo, which is no unit that is known", id="no unit"),
    pytest.param(
        "y = a*x", {"a": "dB/m", "x": "m"}, "a is in dB/m, which is no unit that is known", id="decibels over"
    ),
]


def found(text: str, units: dict[str, str]) -> list[str]:
    words = {*re.findall(r"\w+", text)}
    return unit_contradictions(System.read(text, [name for name in PARAMETERS if name in words]), units)


@pytest.mark.parametrize(("text", "units"), TOGETHER)
def test_nothing_is_told_of_what_goes_together(text: str, units: dict[str, str]) -> None:
    assert found(text, units) == []


@pytest.mark.parametrize(("text", "units", "told"), APART)
def test_what_contradicts_itself_is_told_once(text: str, units: dict[str, str], told: str) -> None:
    sentences = found(text, units)
    assert len(sentences) == 1
    assert told in sentences[0]


def test_a_long_sum_and_many_definitions_are_looked_through() -> None:
    terms = " + ".join(["x"] * 3000)
    chain = "\n".join(f"a{i} = b{i}*a{i + 1}" for i in range(250))
    names = [f"b{i}" for i in range(250)]
    units = dict.fromkeys(names, "m/m") | {"x": "m", "p": "bar"}
    text = f"{chain}\na250 = x\ny = a0 + {terms} + p"
    assert unit_contradictions(System.read(text, names), units) == [
        "a0 is in m, and p in bar, in the equation of y: they are added or compared."
    ]
