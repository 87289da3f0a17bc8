"""Judging a brake by its consequences: scenarios with the reference and with it, and how large an error may be."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.rail.dynamics.brake import AbstractBrake, BrakeOutput, Signal
from sysid.rail.dynamics.drive import Run
from sysid.rail.judging.scenarios import Comparison, Difference, Scenario, consequence
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
    return Comparison(
        differences={
            name: difference(scenario, scenario.run(reference()), scenario.run(other()))
            for name, scenario in scenarios.items()
        }
    )


def difference(scenario: Scenario, trusted: Run, judged: Run) -> Difference:
    """One run against another.

    Args:
        scenario: That both were made in.
        trusted: With the reference.
        judged: With the brake that is judged.

    Returns:
        The difference.
    """
    return Difference(
        reference=consequence(scenario, trusted), other=consequence(scenario, judged), mse=cylinder_mse(trusted, judged)
    )


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
class ErrorSensitivity:
    """What an artificial error of one size does, in the worst of some scenarios.

    Args:
        size: Of the error in psi.
        mse: Mean square error of the cylinder pressures that comes of it, in psi2: mean over the scenarios.
        distance: Largest relative difference of the distance.
        time: Of the time.
        force: Of the largest coupler force.
    """

    size: float
    mse: float
    distance: float
    time: float
    force: float


def error_sensitivity(
    scenarios: Mapping[str, Scenario], *, reference: MakeBrake, size: float, biased: bool = True
) -> ErrorSensitivity:
    """Run scenarios with a brake that errs by so much.

    Args:
        scenarios: By name.
        reference: Makes the trusted brake.
        size: Of the error in psi.
        biased: Whether the error is a bias of every car, the worst that an error of a size can be, or noise.

    Returns:
        What came of it.

    Raises:
        ConfigError: If the brake does not fit the train.
    """
    bias, noise = (size, 0.0) if biased else (0.0, size)
    comparison = compare(scenarios, reference=reference, other=lambda: ErringBrake(reference(), bias=bias, noise=noise))
    return ErrorSensitivity(
        size=size,
        mse=float(np.mean([difference.mse for difference in comparison.differences.values()])),
        distance=comparison.worst("distance"),
        time=comparison.worst("time"),
        force=comparison.worst("force"),
    )


def tolerable_mse(series: Sequence[ErrorSensitivity], *, figure: str = "distance", limit: float = 0.01) -> float:
    """At what mean square error a consequence passes a limit.

    Args:
        series: By rising error.
        figure: ``distance``, ``time`` or ``force``.
        limit: Of its relative difference.

    Returns:
        In psi2, between the last error up to which all are within the limit and the next, in proportion on logarithmic
        scales; NaN if the first is beyond it, infinite if none is.

    Example:
        >>> series = [ErrorSensitivity(size=s, mse=s * s, distance=0.002 * s, time=0.0, force=0.0) for s in (1.0, 10.0)]
        >>> tolerable_mse(series), tolerable_mse(series, figure="time")
        (25.0, inf)
    """
    worst = [float(getattr(one, figure)) for one in series]
    beyond = next((k for k, value in enumerate(worst) if value > limit), None)
    if beyond is None:
        return float("inf")
    if beyond == 0:
        return float("nan")
    (low, high), (a, b) = worst[beyond - 1 : beyond + 1], (series[beyond - 1].mse, series[beyond].mse)
    if low <= 0.0:
        return a
    share = np.log(limit / low) / np.log(high / low)
    return float(round(np.exp(np.log(a) + share * np.log(b / a)), 12))
