"""What is linear from sample to sample, and reset at events: found in records, and written as equations."""

from __future__ import annotations

from sysid.estimation.resets.found import derived_from, found_resets, switches
from sysid.estimation.resets.reset_map import Armed, Guard, ResetMap, Rest
from sysid.estimation.resets.written import grey_box_of

__all__ = ["Armed", "Guard", "ResetMap", "Rest", "derived_from", "found_resets", "grey_box_of", "switches"]
