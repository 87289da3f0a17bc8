"""What the screen says of fits beside their figures."""

from __future__ import annotations

from types import SimpleNamespace

from sysid.workbench.fits.table import told_of_fits


def _fit(name: str, status: str, *warnings: str) -> SimpleNamespace:
    return SimpleNamespace(name=name, status=status, warnings=list(warnings))


def test_what_is_to_be_looked_at_stands_below_the_table() -> None:
    fits = [
        _fit("good", "CONVERGED"),
        _fit("bent", "CONVERGED", "y drifts.", "u never changes."),
        _fit("gone", "UNSTABLE", "y drifts."),
    ]
    good, bent, gone = (told_of_fits(SimpleNamespace(fits=[fit])) for fit in fits)
    assert good == []
    assert bent == ["Look at bent: y drifts. (1 more in the report)"]
    assert gone[0].startswith("Look at gone: The free run leaves its bounds")
    assert gone[0].endswith("(1 more in the report)")


def test_what_is_said_of_several_fits_alike_is_said_once() -> None:
    fits = [
        _fit("a", "CONVERGED", "u is new.", "y drifts."),
        _fit("b", "CONVERGED"),
        _fit("c", "CONVERGED", "u is new.", "x"),
    ]
    assert told_of_fits(SimpleNamespace(fits=fits)) == ["Look at a; c: u is new. (1 more in the report)"]
