"""Numbers that several files of this room share."""

from __future__ import annotations

GRAVITY = 9.80665
"""Standard acceleration of free fall in m/s2 (ISO 80000-3)."""

MPH = 0.44704
"""One mile per hour in m/s."""

KMH = 1.0 / 3.6
"""One kilometre per hour in m/s."""

POUND_FORCE = 4.4482216152605
"""One pound-force in N."""

SHORT_TON = 907.18474
"""One short ton in kg."""
