"""Seeded random commands: what a driver may do with the handle, for choosing between models and for stress."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sysid.airbrake.command import EMERGENCY, Command
from sysid.errors import ConfigError


@dataclass(frozen=True, kw_only=True)
class RandomCommand:
    """The range within which commands are drawn. All draws are uniform within their limits.

    An application is a minimum one, an intermediate one or full service, reached in one or several steps
    and held; it ends in a full release or, first, in a partial one. An emergency is held and released to
    the running pressure.

    Args:
        duration: Length in s.
        running_pressure: Released position in psi gauge.
        minimum_reduction: Smallest reduction in psi.
        full_reduction: Full service reduction in psi.
        steps: Largest number of steps of a graduated application.
        hold: Shortest and longest time at a position, in s.
        recharge: Shortest and longest time released, in s.
        partial_release: Probability that an application is released in part first.
        emergency: Probability that an application is an emergency.
        positions: Positions in psi gauge that applications are confined to, in one or several steps downwards;
            ``None`` for any between minimum and full service.

    Raises:
        ConfigError: If a limit is not a limit.

    Example:
        >>> draws = RandomCommand(duration=600.0)
        >>> draws.draw(7) == draws.draw(7), draws.draw(7) == draws.draw(8)
        (True, False)
    """

    duration: float
    running_pressure: float = 90.0
    minimum_reduction: float = 5.8
    full_reduction: float = 25.8
    steps: int = 4
    hold: tuple[float, float] = (10.0, 90.0)
    recharge: tuple[float, float] = (30.0, 300.0)
    partial_release: float = 0.15
    emergency: float = 0.0
    positions: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        limits = {
            "hold": 0.1 <= self.hold[0] <= self.hold[1],
            "recharge": 0.1 <= self.recharge[0] <= self.recharge[1],
            "minimum_reduction": 0.0 < self.minimum_reduction <= self.full_reduction,
            "full_reduction": self.full_reduction < self.running_pressure,
            "steps": self.steps >= 1,
            "partial_release": 0.0 <= self.partial_release <= 1.0,
            "emergency": 0.0 <= self.emergency <= 1.0,
            "duration": self.duration > 0.1,
            "positions": self.positions is None
            or (len(self.positions) > 0 and all(0.0 < p < self.running_pressure for p in self.positions)),
        }
        for name, holds in limits.items():
            if not holds:
                raise ConfigError(
                    f"{name} is out of range",
                    where="random command",
                    got=getattr(self, name),
                    remedy="see RandomCommand",
                )

    def draw(self, seed: int) -> Command:
        """One command.

        Args:
            seed: Any integer of at least 0; the same seed gives the same command.

        Returns:
            A command with times in tenths of a second and pressures in tenths of a psi.
        """
        rng = np.random.default_rng(seed)
        times, pressures = [0.0], [self.running_pressure]
        clock = rng.uniform(*self.hold)
        while clock < self.duration:
            for pressure, held in self._cycle(rng):
                times.append(round(clock, 1))
                pressures.append(round(pressure, 1))
                clock += held
        kept = [(t, p) for t, p in zip(times, pressures, strict=True) if t < self.duration]
        return Command(times=tuple(t for t, _ in kept), pressures=tuple(p for _, p in kept), duration=self.duration)

    def _cycle(self, rng: np.random.Generator) -> list[tuple[float, float]]:
        """Positions and the time each is held, from one application to the end of its recharge."""
        released = (self.running_pressure, rng.uniform(*self.recharge))
        if rng.random() < self.emergency:
            return [(EMERGENCY, rng.uniform(*self.hold)), released]
        if self.positions is not None:
            count = int(rng.integers(1, min(self.steps, len(self.positions)) + 1))
            chosen = sorted(rng.choice(self.positions, size=count, replace=False), reverse=True)
            return [*((float(position), rng.uniform(*self.hold)) for position in chosen), released]
        kind = rng.integers(4)  # 0 minimum, 1 full, else between
        deepest = self.minimum_reduction if kind == 0 else self.full_reduction
        if kind > 1:
            deepest = rng.uniform(self.minimum_reduction, self.full_reduction)
        count = int(rng.integers(1, self.steps + 1))
        reductions = np.linspace(self.minimum_reduction, deepest, count) if count > 1 and kind else np.array([deepest])
        positions = [(self.running_pressure - float(r), rng.uniform(*self.hold)) for r in reductions]
        if rng.random() < self.partial_release:
            kept = rng.uniform(0.0, 0.8) * deepest
            positions.append((self.running_pressure - kept, rng.uniform(*self.hold)))
        return [*positions, released]
