"""Powers that may be no number, and how they are written so that they always are."""

from __future__ import annotations

import pytest

from sysid.equations import System
from sysid.equations.broken_powers import broken_powers


@pytest.mark.parametrize(
    ("right", "found"),
    [
        ("x^2 + x^-1 + 2^x", []),
        ("x^0.5", [("x^0.5", "max(x, 0)^0.5")]),
        ("u - (x - a)^-a", [("(x - a)^(-a)", "max(x - a, 0)^(-a)")]),
        ("max(x, 0)^a + max(0.1, x)**a + abs(x)^a + exp(x)^a + (x^2)^0.25", []),
        ("max(x, a)^a", [("max(x, a)^a", "max(max(x, a), 0)^a")]),
        ("x^a + x^a", [("x^a", "max(x, 0)^a")]),
    ],
)
def test_what_may_be_below_0_is_found_once(right: str, found: list[tuple[str, str]]) -> None:
    assert (
        list(broken_powers(System.read(f"dx/dt = {right}", ["a"] if "a" in right.replace("max", "") else []))) == found
    )
