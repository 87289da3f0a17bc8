"""The candidates of an ARX order search."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

from sysid.errors import ConfigError
from sysid.models import Lags


@dataclass(frozen=True, kw_only=True)
class OrderGrid:
    """The candidates of a search: every combination of orders and dead times.

    Args:
        max_na: Largest number of past outputs; all from ``min_na`` on are tried.
        max_nb: Largest number of past values, the same for each input; all from ``min_nb`` on are tried.
        max_nk: Largest dead time; all from ``min_nk`` on are tried, for each input by itself.
        min_na: Smallest number of past outputs.
        min_nb: Smallest number of past values of each input.
        min_nk: Smallest dead time.
        intercept: Fit a constant beside the lags.
        read: So many of the last inputs are outputs beside the one that is fitted (:class:`~sysid.models.VectorARX`):
            of each, up to ``max_na`` past values are tried, from none on, and no dead time.

    Raises:
        ConfigError: If a range is empty or negative.

    Example:
        >>> OrderGrid(max_na=30, max_nb=30, max_nk=4).size(2)
        675000
    """

    max_na: int
    max_nb: int
    max_nk: int
    min_na: int = 1
    min_nb: int = 1
    min_nk: int = 0
    intercept: bool = True
    read: int = 0

    def __post_init__(self) -> None:
        for name in ("na", "nb", "nk"):
            low, high = getattr(self, f"min_{name}"), getattr(self, f"max_{name}")
            if not 0 <= low <= high:
                raise ConfigError(
                    f"not a range of {name}",
                    expected=f"0 <= min_{name} <= max_{name}",
                    got=f"{low} to {high}",
                    remedy="correct the range",
                )

    def size(self, n_inputs: int) -> int:
        """Number of candidates.

        Args:
            n_inputs: Input channels.

        Returns:
            The number.
        """
        counts = math.prod(high - low + 1 for low, high in self._ranges(n_inputs))
        nk = self.max_nk - self.min_nk + 1
        return int((self.max_na - self.min_na + 1) * counts * nk ** (n_inputs - self.read))

    def least(self, n_inputs: int) -> list[int]:
        """Smallest number of past values of each input.

        Args:
            n_inputs: Input channels, outputs that are read among them.

        Returns:
            One number an input.
        """
        return [self.min_nb] * (n_inputs - self.read) + [0] * self.read

    def most(self, n_inputs: int) -> list[int]:
        """Largest number of past values of each input.

        Args:
            n_inputs: Likewise.

        Returns:
            One number an input.
        """
        return [self.max_nb] * (n_inputs - self.read) + [self.max_na] * self.read

    def counts(self, n_inputs: int) -> list[tuple[int, ...]]:
        """All combinations of numbers of past values, the last input fastest.

        Args:
            n_inputs: Likewise.

        Returns:
            One tuple per combination.
        """
        return list(itertools.product(*(range(low, high + 1) for low, high in self._ranges(n_inputs))))

    def _ranges(self, n_inputs: int) -> list[tuple[int, int]]:
        """Smallest and largest number of past values of each input."""
        return list(zip(self.least(n_inputs), self.most(n_inputs), strict=True))

    def lags(self, n_inputs: int) -> Lags:
        """All that any candidate looks at.

        Args:
            n_inputs: Likewise.

        Returns:
            The lags.
        """
        own = tuple(range(self.min_nk, self.max_nk + self.max_nb))
        past = tuple(range(1, self.max_na + 1))
        return Lags(inputs=(*(own,) * (n_inputs - self.read), *(past,) * self.read), output=past)

    def dead_times(self, n_inputs: int) -> list[tuple[int, ...]]:
        """All combinations of dead times, the last input fastest; that of an output that is read is 1.

        Args:
            n_inputs: Input channels, outputs that are read among them.

        Returns:
            One tuple per combination.
        """
        own = range(self.min_nk, self.max_nk + 1)
        return list(itertools.product(*[own] * (n_inputs - self.read), *[(1,)] * self.read))
