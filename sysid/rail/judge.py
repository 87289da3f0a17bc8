"""Judging a brake by its consequences: scenarios with the reference and with it, and how large an error may be."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.rail.brake import AbstractBrake, BrakeOutput, Signal
from sysid.rail.drive import Run
from sysid.rail.scenarios import Comparison, Difference, Scenario, consequence
from sysid.units import PSI_IN_PA

MakeBrake = Callable[[], AbstractBrake]
"""Makes a fresh brake, charged and released."""


def cylinder_mse(reference: Run, other: Run) -> float:
    """Mean square difference of the cylinder pressures of two runs in psi2.

    Args:
        reference: A run.
        other: Another of the same train.

    Returns:
        Over the vehicles that are braked in the reference and the time that both lasted.
    """
    common = min(len(reference.cylinders), len(other.cylinders))
    braked = reference.cylinders.max(axis=0) > 0.0
    error = (other.cylinders[:common, braked] - reference.cylinders[:common, braked]) / PSI_IN_PA
    return float(np.mean(error**2)) if error.size else 0.0


def compare(scenarios: Mapping[str, Scenario], *, reference: MakeBrake, other: MakeBrake) -> Comparison:
    """Run scenarios with two brakes.

    Args:
        scenarios: By name.
        reference: Makes the trusted brake.
        other: Makes the brake that is judged: a surrogate, a record, another variant.

    Returns:
        The comparison.

    Raises:
        ConfigError: If a brake does not fit the train.
    """
    differences = {}
    for name, scenario in scenarios.items():
        trusted, judged = scenario.run(reference()), scenario.run(other())
        differences[name] = Difference(
            reference=consequence(scenario, trusted),
            other=consequence(scenario, judged),
            mse=cylinder_mse(trusted, judged),
        )
    return Comparison(differences=differences)


class ErringBrake(AbstractBrake):
    """A brake with an error of a known size on every cylinder that is not empty: what a surrogate's error would do.

    Args:
        brake: The brake without it.
        bias: In psi, on every car.
        noise: Standard deviation in psi of a slowly changing error, its own on every car.
        time_constant: In s, of that error: a surrogate's error changes no faster than the pressure it follows.
        seed: Of the noise.

    Raises:
        ConfigError: If a number is out of range.
    """

    def __init__(
        self, brake: AbstractBrake, *, bias: float = 0.0, noise: float = 0.0, time_constant: float = 5.0, seed: int = 0
    ) -> None:
        if noise < 0.0 or time_constant <= 0.0:
            raise ConfigError(
                "not an error of a brake",
                where="erring brake",
                expected="noise from 0 on, a time constant above 0",
                got=(noise, time_constant),
            )
        self.sample_time, self.vehicles = brake.sample_time, brake.vehicles
        self._brake, self._bias, self._noise = brake, bias, noise
        self._keep = float(np.exp(-brake.sample_time / time_constant))
        self._rng = np.random.default_rng(seed)
        self._state = noise * self._rng.standard_normal(brake.vehicles)

    def advance(self, command: NDArray[np.float64], *, speed: Signal = 1.0, tail_vent: Signal = 0.0) -> BrakeOutput:
        """Advance; see :meth:`AbstractBrake.advance`."""
        output = self._brake.advance(command, speed=speed, tail_vent=tail_vent)
        fresh = self._noise * np.sqrt(1.0 - self._keep**2) * self._rng.standard_normal(output.cylinders.shape)
        error = np.empty_like(output.cylinders)
        for k in range(len(error)):
            self._state = self._keep * self._state + fresh[k]
            error[k] = self._state
        # An empty cylinder stays empty: a model's rest value is exact.
        erring = np.where(
            output.cylinders > PSI_IN_PA, output.cylinders + (self._bias + error) * PSI_IN_PA, output.cylinders
        )
        return BrakeOutput(
            cylinders=np.maximum(erring, 0.0),
            equalising=output.equalising,
            head_pipe=output.head_pipe,
            tail_pipe=output.tail_pipe,
        )


@dataclass(frozen=True, kw_only=True)
class Tolerable:
    """How large an error may be before the consequence passes a limit.

    Args:
        mse: The largest mean square error tried in psi2 for which it stays within the limit; NaN if none did.
        tried: Mean square error and worst relative consequence of each size of error, in order.
    """

    mse: float
    tried: tuple[tuple[float, float], ...]


def tolerable_mse(
    scenarios: Mapping[str, Scenario],
    *,
    reference: MakeBrake,
    sizes: Sequence[float],
    figure: str = "distance",
    limit: float = 0.01,
    biased: bool = True,
    seed: int = 0,
) -> Tolerable:
    """At what mean square error of the cylinder pressure a consequence falls under a limit.

    Args:
        scenarios: By name.
        reference: Makes the trusted brake.
        sizes: Of the error in psi, increasing.
        figure: ``distance``, ``time`` or ``force``.
        limit: Of its relative difference in the worst scenario.
        biased: Whether the error is a bias of every car, the worst that an error of a size can be, or noise.
        seed: Of the noise.

    Returns:
        The error.
    """
    tried = []
    for size in sizes:

        def erring(size: float = size) -> AbstractBrake:
            error = {"bias": size} if biased else {"noise": size}
            return ErringBrake(reference(), **error, seed=seed)

        comparison = compare(scenarios, reference=reference, other=erring)
        mse = float(np.mean([difference.mse for difference in comparison.differences.values()]))
        tried.append((mse, comparison.worst(figure)))
    within = [mse for mse, worst in tried if worst <= limit]
    return Tolerable(mse=max(within, default=float("nan")), tried=tuple(tried))
