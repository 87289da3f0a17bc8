"""What a fit of several outputs answers to who compares and saves it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from sysid.estimation import FitResult
from sysid.models import Cascade


class Several(Protocol):
    """Fits of several outputs as one system."""

    @property
    def fits(self) -> Mapping[str, FitResult]:
        """By output."""

    @property
    def outputs(self) -> tuple[str, ...]:
        """The outputs."""

    @property
    def model(self) -> Cascade:
        """All of them as one."""


def members(fit: FitResult | Several) -> list[FitResult]:
    """The fits of one output each, or of all at once, that a fit is made of: of one itself."""
    return [fit] if isinstance(fit, FitResult) else list(fit.fits.values())
