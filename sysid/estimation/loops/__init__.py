"""A linear system closed by one element that is not linear: found in records, and written as equations."""

from __future__ import annotations

from sysid.estimation.loops.loop import Found, Loop
from sysid.estimation.loops.race import found_loop
from sysid.estimation.loops.written import grey_box_of

__all__ = ["Found", "Loop", "found_loop", "grey_box_of"]
