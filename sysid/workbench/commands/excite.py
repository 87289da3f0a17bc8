"""``sysid excite``: the inputs of an experiment, as a file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sysid.api.looking import excite
from sysid.errors import ConfigError
from sysid.reporting.numbers import number
from sysid.workbench.runner.console import console


def excite_command(
    kind: str, out: Path, *, given: Mapping[str, Any], span: str, band: str | None, names: str, units: str
) -> None:
    """Draw an excitation and write it; what was not typed is ``None`` among the options given."""
    pairs = "two numbers, as 0:10, or a pair for each channel, as 0:10,2:8"
    spans = [_pair(one, "--range", pairs) for one in span.split(",")]
    low, high = spans[0] if len(spans) == 1 else zip(*spans, strict=True)
    options = {key: value for key, value in given.items() if value is not None}
    if band is not None:
        options["band"] = _pair(band, "--band", "two frequencies in Hz, as 0.01:2")
    labels = [name.strip() for name in names.split(",")]
    each = [unit.strip() for unit in units.split(",")]
    found = excite(kind, low=low, high=high, names=labels, units=each[0] if len(each) == 1 else each, **options)
    path = found.save(out)
    target = console()
    seconds = len(found) * found.plan.sample_time
    target.print(
        f"{kind}: {len(found)} samples, one every {found.plan.sample_time:g} s, {seconds:g} s in all", soft_wrap=True
    )
    for name, unit, x, crest in zip(found.names, found.units, found.values.T, found.crest_factors, strict=True):
        said = f"{name} [{unit}]: {x.min():.6g} to {x.max():.6g}, crest factor {number(crest)}"
        target.print(said, markup=False, soft_wrap=True)
    target.print(f"written: {path}", soft_wrap=True, markup=False)


def _pair(text: str, flag: str, expected: str) -> tuple[float, float]:
    parts = text.split(":")
    try:
        low, high = (float(part) for part in parts)
    except ValueError:
        raise ConfigError(
            f"{flag} is not a pair of numbers", where="the command line", expected=expected, got=text,
            remedy=f"write {flag} with {expected}",
        ) from None  # fmt: skip
    return low, high
