"""Numbers as engineers read them: three significant digits, powers of ten, words for what is not a number."""

from __future__ import annotations

import math

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: float, *, digits: int = 3, missing: str = "not defined") -> str:
    r"""A number with a few significant digits.

    Args:
        value: The number.
        digits: Significant digits.
        missing: What to say for NaN.

    Returns:
        The text; ``infinite`` for an infinity.

    Example:
        >>> number(0.0041493), number(2.2391e-5), number(-1234.5), number(float("nan"))
        ('0.00415', '2.24\xa0×\xa010⁻⁵', '−1230', 'not defined')
    """
    if math.isnan(value):
        return missing
    if math.isinf(value):
        return "infinite" if value > 0 else "minus infinite"
    if value == 0.0:
        return "0"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    power = int(exponent)
    if -4 < power < 6:
        rounded = round(value, digits - 1 - power)
        text = f"{rounded:.{max(0, digits - 1 - power)}f}"
        # A narrow space between thousands, which is not a decimal sign in any language.
        text = f"{rounded:,.0f}".replace(",", "\u202f") if power >= 4 else text
    else:
        text = f"{mantissa}\u00a0×\u00a010{superscript(power)}"
    return text.replace("-", "−")


def superscript(power: int) -> str:
    """A whole number as it stands above the line.

    Example:
        >>> superscript(-12)
        '⁻¹²'
    """
    return str(power).translate(_SUPERSCRIPT)


def quantity(value: float, unit: str, *, digits: int = 3, missing: str = "not defined") -> str:
    r"""A number with its unit, never parted at the end of a line.

    Args:
        value: The number.
        unit: The unit.
        digits: Significant digits.
        missing: What to say for NaN.

    Returns:
        The text, with the unit where it is a number and the unit is not the pure number's.

    Example:
        >>> quantity(0.0541, "psi"), quantity(float("nan"), "psi", missing="diverged"), quantity(0.5, "1")
        ('0.0541\xa0psi', 'diverged', '0.500')
    """
    text = number(value, digits=digits, missing=missing)
    return f"{text}\u00a0{unit}" if math.isfinite(value) and unit != "1" else text


def seconds(value: float) -> str:
    r"""A duration in the unit that suits it.

    Args:
        value: Seconds.

    Returns:
        The duration with its unit.

    Example:
        >>> seconds(0.00123), seconds(41.7), seconds(4500.0)
        ('1.23\xa0ms', '41.7\xa0s', '75.0\xa0min')
    """
    if not math.isfinite(value):
        return "not measured"
    for limit, factor, unit in ((1e-3, 1e6, "µs"), (1.0, 1e3, "ms"), (120.0, 1.0, "s"), (7200.0, 1 / 60, "min")):
        if value < limit:
            return quantity(value * factor, unit)
    return quantity(value / 3600, "h")


def pole(radius: float) -> str:
    """The magnitude of a largest pole, with as many digits as show on which side of 1 it lies.

    Args:
        radius: The magnitude; NaN for a model that is not linear.

    Returns:
        It, and a word where it is not stable: at 1, but for rounding, it integrates.

    Example:
        >>> pole(0.9512), pole(0.99996), pole(1.02), pole(float("nan"))
        ('0.951', '0.99996', '1.02, unstable', '')
        >>> pole(1.0 + 2e-8)
        '1, integrates'
    """
    if math.isnan(radius):
        return ""
    if -1e-9 <= radius - 1.0 <= 1e-6:
        return "1, integrates"
    digits = 3 if abs(radius - 1.0) > 5e-4 else 5
    return f"{radius:.{digits}g}" if radius < 1.0 else f"{radius:.{digits}g}, unstable"


def times(value: float) -> str:
    r"""A ratio.

    Args:
        value: The ratio.

    Returns:
        The ratio with a multiplication sign.

    Example:
        >>> times(0.0312), times(1234.0)
        ('0.031\xa0×', '1200\xa0×')
    """
    return f"{number(value, digits=2)}\u00a0×" if math.isfinite(value) else "not defined"
