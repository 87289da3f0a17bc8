"""Motion against dry friction, between stops: found in records, and written as equations with numbers to estimate."""

from __future__ import annotations

from sysid.estimation.friction.found import Friction, found_friction
from sysid.estimation.friction.written import grey_boxes_of

__all__ = ["Friction", "found_friction", "grey_boxes_of"]
