"""Damping strategies: how far a Levenberg-Marquardt step may go. A new one is a file here, and a row of the table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sysid.estimation.least_squares.damping.base import AbstractDamping
from sysid.estimation.least_squares.damping.levenberg import LevenbergDamping
from sysid.estimation.least_squares.damping.marquardt import MarquardtDamping

DAMPINGS: dict[str, type[AbstractDamping]] = {
    strategy.kind: strategy
    for strategy in (
        MarquardtDamping,
        LevenbergDamping,
    )
}
"""By the name that training options know it under; the first is the default."""

DEFAULT = MarquardtDamping.kind


def damping_of(kept: Mapping[str, Any]) -> AbstractDamping:
    """A damping that was put aside with its fit.

    Args:
        kept: From :meth:`AbstractDamping.to_dict`; without a kind it is of a time when there was one.

    Returns:
        The damping.
    """
    return DAMPINGS[kept.get("kind", DEFAULT)].from_dict(kept)
