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

    found: pint.UnitRegistry[float] = pint.UnitRegistry(cache_folder=None)
    found.define("hns = 1e-7 second")  # hundreds of nanoseconds, in which Windows and .NET count
    return found


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
        "rad": "rad|radian|radians|rads|рад",
        "s": "sec|secs|second|seconds|sek|sek.|sec.|sekunden|с|сек",
        "ms": "msec|msecs|millisecond|milliseconds|мс",
        "us": "usec|µsec|microsecond|microseconds|мкс",
        "min": "min|min.|minute|minutes|mins|minuten|мин",
        "hour": "hours|hrs|hr|std|std.|stunde|stunden|ч",
        "1": "-|–|--|none|dimensionless|unitless|n/a|na|ratio|bool|p.u.|pu|per unit",
        "percent": "%|pct|%rh|% rh|%r.h.|prozent|percent|per cent|pourcent",
        "rpm": "rpm|u/min|umdr./min|umdr/min|rev/min|r/min|revs/min|revolutions/min|tr/min|umin|upm|об/мин",
        "kN*m": "knm|kn-m|kn·m",
        "N*mm": "nmm|n-mm|n·mm",
        "Pa*s": "pas|pa.s|pa·s",
        "mPa*s": "mpas|mpa.s|mpa·s",
        "ft^3/min": "cfm",
        "hp": "hp",
        "g_0": "g's|g-force",
        "N/mm^2": "n/mm2",
        "kgf/cm^2": "kp/cm2|kp/cm²|кгс/см2|кгс/см²",
        "torr": "torr",
        "gauss": "gauss",
        "lb": "lbm",
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
    **{"м": "m", "мм": "mm", "см": "cm", "км": "km", "Н": "N", "кН": "kN", "Нм": "N*m", "Н·м": "N*m", "л": "liter"},
    **{"г": "g", "т": "t", "Дж": "J", "кДж": "kJ", "МВт": "MW", "мВ": "mV", "мА": "mA", "Ом": "ohm", "кгс": "kgf"},
    # pint's picohenry, and a capital of it that nobody means either.
    **{"pH": "1", "PH": "1", "ph": "1"},
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
_NORMAL_VOLUME = re.compile(
    r"[NS](?:m\s*(?:\^|\*\*)?\s*[3³]|[lL](?![A-Za-z])|cm)|(?i:std|norm|nom)[. ]\W*(?i:m|l|ft|c)"
)
_SHARE = re.compile(
    r"%\s*(?:open|auf|O2|CO2|H2O|\(?v/v\)?|\(?w/w\)?)|(?:vol|mol|wt|w|mass|masse|gew)[.-]{0,2}\s?%", re.I
)
"""Shares of something: to pint, %MW are megawatts and mol% moles."""
_BELOW = re.compile(r"(?P<above>[^/]+)/\s*(?P<below>[^\W\d_]+[-^²³\d]*(?:[ .·][^\W\d_]+[²³^\d]*)+|m[\^]?[2²]K|kgK)")
"""``W/m2 K``, ``kJ/kg.K``: a blank or a point below a stroke joins what stands there; to pint, K would be above."""
_POWER = re.compile(r"\b([kcdmµu]?m|s|min|h|hr|in|ft|kg|K|V|A|N|mol)(-?[1-6])\b")
_WORD = re.compile(r"[A-Za-z°µΩ%А-яЁё]+")
_JOINED = re.compile(r"[ .·]|(?<=[\d²])(?=K)|(?<=kg)(?=K)")
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
    if _SHARE.fullmatch(text):
        return "percent"
    if below := _BELOW.fullmatch(text):
        return plain_unit(f"{below['above']}/({_JOINED.sub('*', below['below'])})")
    words = _WORD.sub(lambda word: _meant(word[0]), text)
    # As people mean it first: in Nm/A, pint would find a unit of yarn. A letter is what pint knows it as, if it can.
    longer = _WORD.sub(lambda word: _meant(word[0]) if len(word[0]) > 1 else word[0], text)
    tries = (longer, _POWER.sub(r"\1^\2", longer), text, _POWER.sub(r"\1^\2", words))
    return next((unit for unit in tries if _is_pint(unit)), None)


def _meant(word: str) -> str:
    unit = _EXACT.get(word) or _WRITTEN.get(word.casefold(), word)
    return f"({unit})" if "*" in unit or "/" in unit else unit


def _is_pint(text: str) -> bool:
    try:
        registry().parse_units(text)
        found = [registry().parse_unit_name(word) for word in _LETTERS.findall(text)]
    except Exception:  # noqa: BLE001 - pint raises many unrelated classes (tokenizer errors among them)
        return False
    return not any(names and names[0][0] and names[0][1] in _UNPREFIXED for names in found)
