"""How units are written: the words that people use, and those that pint knows."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pint


@cache
def registry() -> pint.UnitRegistry[float]:
    """The units that pint knows; it takes 0.3 s to import and build, which only those who convert pay for."""
    import pint

    return pint.UnitRegistry(cache_folder=None)


# What people write and pint does not know, or takes for something else: "amps" are attometres per second to it,
# "Nm" is a unit of yarn, "U/min" are enzyme units per minute.
_WRITTEN = {
    word: unit
    for unit, words in {
        "V": "volt|volts|vdc|vac",
        "A": "amp|amps|ampere|amperes|adc|aac",
        "W": "watt|watts",
        "N": "newton|newtons",
        "Pa": "pascal|pascals",
        "ohm": "ohm|ohms",
        "Hz": "hertz|hz|cps",
        "K": "kelvin|kelvins|degk|°k",
        "degC": "celsius|celcius|centigrade|deg celsius|degrees celsius|grad c|grad celsius|°с|"
        "degc|deg_c|deg c|deg. c|degrees c|degree c|°c|º c|ºc|° c|℃",
        "degF": "fahrenheit|degrees fahrenheit|degf|deg_f|deg f|deg. f|degrees f|degree f|°f|ºf|° f|℉",
        "m": "meter|meters|metre|metres",
        "deg": "°|º|degs|degrees|degree|grad|altgrad|degr",
        "rad": "radian|radians|rads",
        "s": "sec|secs|second|seconds|sek|sek.|sec.|sekunden|с|сек",
        "ms": "msec|msecs|millisecond|milliseconds|мс",
        "us": "usec|µsec|microsecond|microseconds",
        "min": "min|min.|minute|minutes|mins|minuten|мин",
        "hour": "hours|hrs|hr|std|std.|stunde|stunden|ч",
        "1": "-|–|--|none|dimensionless|unitless|n/a|na|ratio|bool",
        "percent": "%|pct|%rh|% rh|%r.h.|prozent",
        "rpm": "rpm|u/min|rev/min|r/min|revs/min|revolutions/min|tr/min|umin|upm|об/мин",
        "kN*m": "knm|kn-m|kn·m",
        "N*mm": "nmm|n-mm|n·mm",
        "Pa*s": "pas|pa.s|pa·s",
        "mPa*s": "mpas|mpa.s|mpa·s",
        "ft^3/min": "cfm",
        "hp": "hp",
        "g_0": "g's|g-force",
        "N/mm^2": "n/mm2",
        "kgf/cm^2": "kp/cm2|kp/cm²",
        "mmH2O": "mmws|mm ws|mm h2o|mmwc|mm wc",
        "mH2O": "mws",
        "kg": "kgs|кг",
        "N*m": "nm|n-m|n·m|n m|n.m|newton-meter|newtonmeter|newton meters",
        "lbf*ft": "lb-ft|ft-lb|ft-lbs|lbf-ft|ft-lbf|lbft|ft lb",
        "km/hour": "kph|kmh|km/hr",
        "liter": "liter|liters|litre|litres|ltr",
        "liter/min": "lpm|ltr/min|liters/min|litres/min",
        "gallon/min": "gpm|gal/min",
        "psi": "psi|lb/in2|lbf/in2",
        **{unit: unit.casefold() for unit in ("bar", "mbar", "kPa", "hPa", "kHz", "mmHg", "inHg", "mmH2O", "inH2O")},
        **{unit: unit.casefold() for unit in ("kWh", "kW", "kN", "kohm", "MPa")},
    }.items()
    for word in words.split("|")
}
_EXACT = {
    **{f"{prefix}{text}": f"{prefix}VA" for prefix in ("", "k", "M") for text in ("var", "VAr", "VAR", "Var")},
    **{f"{prefix}Ohm": f"{prefix}ohm" for prefix in ("m", "k", "M")},
    **{"nm": "nm", "kn": "knot", "mS": "mS", "MS": "MS", "mPa": "mPa", "mpa": "mPa", "KG": "kg", "Kg": "kg"},
    **{"C": "degC", "F": "degF", "PS": "metric_horsepower", "mb": "mbar", "mNm": "mN*m", "MNm": "MN*m"},
    **{"В": "V", "А": "A", "Вт": "W", "кВт": "kW", "Па": "Pa", "кПа": "kPa", "МПа": "MPa", "бар": "bar", "Гц": "Hz"},
    **{"м": "m", "мм": "mm", "см": "cm", "Н": "N", "Нм": "N*m", "Н·м": "N*m", "л/мин": "liter/min", "м³/ч": "m^3/hour"},
}
"""Texts whose capitals matter: a nanometre is no newton metre. C is of degrees, not coulombs."""
_UNPREFIXED = frozenset(
    {"inch", "foot", "yard", "mile", "fermi", "barn", "pint", "day", "hour", "minute", "year", "week", "month"}
    | {"number_meter", "technical_atmosphere", "degree", "pound", "point", "ounce", "grain"}
)
"""Units that nobody writes with a prefix: Min are no mega-inches, and cfm no centi-fermi."""

# pint evaluates the exponents of a unit: 9**9**9**9 in a header would keep it busy for ever.
_TOWER = re.compile(r"(?:\*\*|\^)[^*/^]*(?:\*\*|\^)|\d{5,}")
_LONGEST_UNIT = 40
# Normal and standard volumes (at 0 degC or 15 degC, by convention) are no unit of volume.
_NORMAL_VOLUME = re.compile(r"[NS](?:m\s*(?:\^|\*\*)?\s*[3³]|[lL](?![A-Za-z])|cm)")
_POWER = re.compile(r"\b([kcdmµu]?m|s|min|h|hr|in|ft|kg|K|V|A|N|mol)(-?[1-6])\b")
_WORD = re.compile(r"[A-Za-z°µΩ%]+")
_LETTERS = re.compile(r"[^\W\d_]+")

USUAL_UNITS = frozenset(
    {
        "1",
        "s",
        "ms",
        "us",
        "ns",
        "min",
        "h",
        "V",
        "mV",
        "kV",
        "A",
        "mA",
        "Pa",
        "hPa",
        "kPa",
        "MPa",
        "bar",
        "mbar",
        "psi",
    }
    | {"m", "mm", "cm", "km", "um", "kg", "g", "N", "kN", "W", "kW", "J", "kJ", "Hz", "kHz", "K", "degC", "rad", "deg"}
    | {"rpm", "percent", "m/s", "mm/s", "m/s^2", "km/h", "rad/s", "deg/s", "ohm", "l/min", "L/min"}
)
"""Units that need not be looked up: pint takes 0.3 s to import and build."""


@cache
def plain_unit(unit: str) -> str | None:
    """A unit as people write it, in the words that pint knows.

    Args:
        unit: For example ``"Amps"``, ``"m3/h"``, ``"Deg C"``, ``"kPa"``.

    Returns:
        For example ``"A"``, ``"m^3/h"``, ``"degC"``, ``"kPa"``; ``None`` if it is no unit that is known.

    Example:
        >>> plain_unit("Newtons"), plain_unit("m3/h"), plain_unit("Nm3/h")
        ('N', 'm^3/h', None)
    """
    text = unit.strip()
    if text in USUAL_UNITS:
        return text
    if not text or len(text) > _LONGEST_UNIT or _TOWER.search(text) or _NORMAL_VOLUME.match(text):
        return None
    written = _EXACT.get(text) or _WRITTEN.get(text.casefold())
    if written is not None:
        return written
    words = _WORD.sub(lambda word: _EXACT.get(word[0]) or _WRITTEN.get(word[0].casefold(), word[0]), text)
    return next((t for t in (text, _POWER.sub(r"\1^\2", text), _POWER.sub(r"\1^\2", words)) if _is_pint(t)), None)


def _is_pint(text: str) -> bool:
    try:
        registry().parse_units(text)
        found = [registry().parse_unit_name(word) for word in _LETTERS.findall(text)]
    except Exception:  # noqa: BLE001 - pint raises many unrelated classes (tokenizer errors among them)
        return False
    return not any(names and names[0][0] and names[0][1] in _UNPREFIXED for names in found)
