"""The sample time that lines above a table of text say: ``Fs = 10 Hz``, ``Sample interval (ms);0,5``."""

from __future__ import annotations

import re
from collections.abc import Iterable

_EITHER = (
    r"sampling|sampled(?:[ _]at)?|abtastung"
    r"|(?:scan|log(?:ging)?|record(?:ing)?|acquisition|data|update)[ _-]?(?:rate|frequency|interval|period|time)"
)
"""Words that may say a rate or a time: which, says the unit."""
_RATE = r"fs|f_s|sampl(?:e|ing)[ _-]?(?:rate|frequency)|scan[ _-]?rate|abtast(?:rate|frequenz)|sps"
_PERIOD = (
    r"ts|t_s|dt|delta[ _]?t|delta[ _]?x|(?:x[ _-]?)?increment|hresolution"
    r"|sampl(?:e|ing)[ _-]?(?:time|interval|period)|time[ _-]?step"
    r"|abtast(?:zeit|intervall)"
)
IN_HERTZ = {"": 1.0, "hz": 1.0, "khz": 1e3, "mhz": 1e6, "1/s": 1.0, "s/s": 1.0, "sa/s": 1.0, "samples/s": 1.0}
IN_SECONDS = {"": 1.0, "s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0}
"""What a number of a rate, or a time, is multiplied with by the unit beside it; empty for none."""
_LINE = re.compile(
    rf"[^\w]*(?:(?P<rate>{_RATE})|(?P<period>{_PERIOD})|(?P<either>{_EITHER}))\s*(?:[\[(](?P<head>[^\])]*)[\])])?\s*[:=;,\s]\s*"
    r"[\"']?(?P<number>\d+(?:[.,]\d+)?(?:e[+-]?\d+)?)[\s,;]*[\[(]?(?P<tail>[\w/µ]*)[\])]?[\"';,\s]*",
    re.IGNORECASE,
)


def said_step(lines: Iterable[str]) -> float | None:
    """The sample time that lines of text say.

    Args:
        lines: What stands above the table.

    Returns:
        Seconds between samples; ``None`` where no line says it, or two say different ones.

    Example:
        >>> said_step(["% Fs = 10 Hz"]), said_step(["Sample interval (ms);0,5"]), said_step(["Date: 10.3.2024"])
        (0.1, 0.0005, None)
    """
    found = {step for step in map(_step, lines) if step is not None}
    return found.pop() if len(found) == 1 else None


def _once(line: str) -> str:
    """A line that says the same of each column, ``SampleRate,1.0E+3,1.0E+3``, saying it once."""
    word, *cells = re.split(r"[;\t]|,(?=\d+\.|\s)", line)
    return f"{word};{cells[0]}" if len(cells) > 1 and len(set(cells)) == 1 else line


def _step(line: str) -> float | None:
    match = _LINE.fullmatch(_once(line))
    if match is None:
        return None
    unit = (match["head"] or match["tail"] or "").strip().lower()
    rate = bool(match["rate"]) or (bool(match["either"]) and unit in IN_HERTZ)
    if match["either"] and not unit:
        return None
    factor = (IN_HERTZ if rate else IN_SECONDS).get(unit)
    value = float(match["number"].replace(",", "."))
    if factor is None or not 0.0 < value * factor < float("inf"):
        return None
    return 1.0 / (value * factor) if rate else value * factor
