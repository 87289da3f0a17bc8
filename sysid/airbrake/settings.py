"""Numbers of a dataclass held against what a physical setting may be."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection
from numbers import Integral, Real
from typing import Any

from sysid.errors import ConfigError


def check_numbers(owner: Any, what: str, *, from_zero: Collection[str] = ()) -> None:
    """Refuse what no setting can be; ``min(...) <= 0`` alone lets NaN pass.

    Args:
        owner: A dataclass; its fields declared ``float`` or ``int`` are looked at.
        what: It is, with its article, for the error.
        from_zero: Fields that may be 0; all others are above it.

    Raises:
        ConfigError: If one of them is no finite number (a whole one, where it is declared so), or out of range.
    """
    for field in dataclasses.fields(owner):
        if field.type not in {"float", "int"}:
            continue
        value, least = getattr(owner, field.name), "from 0 on" if field.name in from_zero else "above 0"
        kind = Integral if field.type == "int" else Real
        good = isinstance(value, Real) and isinstance(value, kind) and not isinstance(value, bool)
        if not (good and math.isfinite(value) and (value >= 0 if field.name in from_zero else value > 0)):
            raise ConfigError(
                f"not {what}: {field.name} cannot be used", where=f"{what}, {field.name}",
                expected=f"a {'whole' if field.type == 'int' else 'finite'} number {least}", got=value,
                remedy=f"leave {field.name} out for its default of {field.default:g}"
                if isinstance(field.default, int | float) else "correct it",
            )  # fmt: skip
