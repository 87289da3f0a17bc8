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
