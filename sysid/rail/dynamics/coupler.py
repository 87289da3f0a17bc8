"""The connection of two vehicles: slack, draft gears with friction, and what stops them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.airbrake.settings import check_numbers
from sysid.errors import ConfigError


@dataclass(frozen=True, kw_only=True)
class Coupler:
    r"""Two draft gears in series and the slack between their couplers, alike in draft and in buff.

    Over the compression ``a = |extension| - slack / 2`` the mean of loading and unloading is elastic: it rises to the
    preload over ``toe``, then with ``stiffness`` up to ``travel``, then with ``stop_stiffness``. Friction adds
    ``friction`` times the mean while loading and takes it away while unloading (no more than at full travel), so that
    :math:`F = F_e(\delta) + \mu |F_e| s(\dot\delta / v_s)` with :math:`s(x) = x / \sqrt{1 + x^2}`: an elastic part
    with a potential and a part that only dissipates.

    All defaults are ours. Two gears of 3 1/4 in make ``travel``, and full travel takes some 2.15 MN, or 480,000 lb: of
    the size of a gear to AAR M-901E (Miner TF-880, data sheet: 2.93 in at a reaction of 566,000 lb, at most 3.15 in).
    Bunched to stretched under moderate force is 4 to 6 in, the slack that US 9,120,493 names.

    Args:
        slack: Free play in m.
        preload: Mean force in N at which the gears begin to move.
        toe: Compression in m over which the force rises to the preload.
        stiffness: Of the mean force in N/m.
        travel: Compression in m at which the gears are closed.
        stop_stiffness: In N/m beyond it: the sills.
        friction: Share of the mean force, from 0 to below 1.
        friction_speed: Relative speed in m/s over which friction turns round.

    Raises:
        ConfigError: If a number is out of range.

    Example:
        >>> coupler = Coupler()
        >>> coupler.force(0.01), round(coupler.loading_force(0.5 * coupler.slack + coupler.travel) / 1e6, 2)
        (0.0, 2.15)
    """

    slack: float = 0.025
    preload: float = 5.0e4
    toe: float = 0.004
    stiffness: float = 8.6e6
    travel: float = 0.165
    stop_stiffness: float = 2.0e8
    friction: float = 0.5
    friction_speed: float = 0.02

    def __post_init__(self) -> None:
        check_numbers(self, "a coupler", from_zero=("slack", "preload", "friction"))
        if not (self.toe < self.travel and self.friction < 1.0):
            raise ConfigError(
                "not a coupler", where="coupler", expected="toe below travel, friction below 1",
                got=f"toe {self.toe:g} m of {self.travel:g} m, friction {self.friction:g}",
                remedy="correct the value; units are SI",
            )  # fmt: skip

    @property
    def row(self) -> NDArray[np.float64]:
        """What the kernel reads, in its order."""
        return np.array(
            [
                0.5 * self.slack,
                self.preload,
                self.toe,
                self.stiffness,
                self.travel,
                self.stop_stiffness,
                self.friction,
                self.friction_speed,
            ]
        )

    def force(self, extension: float) -> float:
        """Elastic (mean) force in N at an extension in m, positive in draft."""
        a = abs(extension) - 0.5 * self.slack
        if a <= 0.0:
            return 0.0
        closed = self.preload + self.stiffness * (self.travel - self.toe)
        if a < self.toe:
            size = self.preload / self.toe * a
        elif a < self.travel:
            size = self.preload + self.stiffness * (a - self.toe)
        else:
            size = closed + self.stop_stiffness * (a - self.travel)
        return float(np.copysign(size, extension))

    def friction_force(self, extension: float) -> float:
        """Largest friction in N at an extension in m."""
        closed = self.preload + self.stiffness * (self.travel - self.toe)
        return self.friction * min(abs(self.force(extension)), closed)

    def loading_force(self, extension: float) -> float:
        """Force in N while the gears are being closed, positive in draft."""
        mean = self.force(extension)
        return float(mean + np.copysign(self.friction_force(extension), mean)) if mean else 0.0

    def energy(self, extension: float) -> float:
        """Stored energy in J at an extension in m: the integral of :meth:`force`."""
        a = abs(extension) - 0.5 * self.slack
        if a <= 0.0:
            return 0.0
        rise = min(a, self.toe)
        total = 0.5 * self.preload / self.toe * rise * rise
        run = min(max(a - self.toe, 0.0), self.travel - self.toe)
        total += self.preload * run + 0.5 * self.stiffness * run * run
        past = max(a - self.travel, 0.0)
        closed = self.preload + self.stiffness * (self.travel - self.toe)
        return total + closed * past + 0.5 * self.stop_stiffness * past * past
