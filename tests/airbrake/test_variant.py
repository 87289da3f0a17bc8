"""Variants: presets, switches by name, and combinations that cannot work."""

import pytest

from sysid.airbrake.variant import LISTING, PHYSICAL, QuickService, Variant
from sysid.errors import ConfigError


def test_the_defaults_are_the_print() -> None:
    assert Variant() == LISTING


def test_switches_change_one_thing() -> None:
    changed = PHYSICAL.with_options({"quick_service": "none", "relay_band": 3000})
    assert changed.quick_service is QuickService.NONE
    assert changed.relay_band == 3000.0
    assert changed.with_options({"quick_service": "local", "relay_band": PHYSICAL.relay_band}) == PHYSICAL


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"latched": True}, "unknown switch latched"),
        ({"piston": 1.0}, "wrong type"),
        ({"laminar_ratio": True}, "wrong type"),
        ({"rising_delay": "long"}, "wrong type"),
        ({"quick_service": "telepathy"}, "unknown quick service"),
        ({"feed_closed_in_lap": True}, "needs latched_release"),
        ({"graduating_lap": True}, "needs latched_release"),
        ({"equalising_rate": 1e4}, "needs relay_band"),
        ({"pipe_momentum": True}, "needs laminar_ratio"),
        ({"rising_delay": 0.0}, "not positive"),
        ({"relay_band": -1.0}, "not positive"),
        ({"leakage": -1.0}, "not a rate"),
        ({"leakage": float("nan")}, "not a rate"),
        ({"rising_delay": None}, "wrong type"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_what_cannot_work_is_refused(options: dict, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        LISTING.with_options(options)
