"""An input that acts through play, as a valve's stem that sticks: found in records, and written as equations."""

from __future__ import annotations

from sysid.estimation.play.found import Play, found_play
from sysid.estimation.play.written import grey_boxes_of

__all__ = ["Play", "found_play", "grey_boxes_of"]
