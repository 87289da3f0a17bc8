"""What a search for the poles of a transfer function is about: data and structure, for any dead times."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sysid.errors import FitDivergedError
from sysid.estimation.linear import slow_poles
from sysid.estimation.linear.delay_search import FEW
from sysid.estimation.linear.pole_starts import PoleStart
from sysid.estimation.linear.transfer_function.integrators import all_at_one, with_edge
from sysid.estimation.linear.transfer_function.runs import Delays, End
from sysid.estimation.linear.transfer_function.training import Terms, TransferFunctionTraining
from sysid.estimation.linear.transfer_function.uncertainty import transfer_function_uncertainty
from sysid.estimation.linear.variable_projection import PoleParameters, SeparableProvider, Separated
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import AbstractModel, Scaling, TransferFunction, TransferFunctionModel
from sysid.models.converting.orthonormal_basis import Domain
from sysid.models.converting.realisation import parted

Score = Callable[[AbstractModel], float] | None

APART = 1e-3
"""Part of the way to the next whole sample by which a dead time is moved to see what that does."""


class AbstractProblem(ABC):
    """Data and structure, for any dead times."""

    orders: TransferFunction
    training: TransferFunctionTraining
    scaling: Scaling
    terms: Terms
    between: bool = False
    """Whether dead times that are searched may end between samples."""
    as_scored: Score = None
    """Of a model its error over the records from the start that was declared, where one was."""

    @abstractmethod
    def provider(self, delays: Delays, *, unknown: int | None = None) -> SeparableProvider:
        """The least-squares problem with these dead times.

        Args:
            delays: In samples, one per input.
            unknown: First samples of each record that do not count because an input came before it; by default the
                longest dead time. Dead times are compared on the same samples.

        Returns:
            The problem.
        """

    @abstractmethod
    def starts(self, provider: SeparableProvider, *, few: bool, alone: bool = True) -> list[PoleStart]:
        """Where to begin.

        Args:
            provider: The least-squares problem.
            few: Only what is needed to compare dead times.
            alone: Whether no minimum of a smaller structure stands beside them; what takes long may stay away then.

        Returns:
            The starts.
        """

    def delay_range(self) -> tuple[int, int]:
        """Shortest and longest dead time that is tried."""
        most = FEW if self.training.max_delay is None else self.training.max_delay
        return 0 if self.orders.domain is Domain.CONTINUOUS else min(1, most), most

    def likely_delays(self, least: int, most: int) -> list[list[int]]:  # noqa: ARG002 - spectra do not show places
        """For each input the dead times about which to look.

        Args:
            least: The shortest.
            most: The longest.

        Returns:
            Likely ones, the likeliest first.
        """
        return [[least]] * len(self.orders.poles)

    def told(self, end: End) -> tuple[str, ...]:  # noqa: ARG002 - points of a spectrum have no order in time
        """What a reader should know of the errors at an end.

        Args:
            end: The end.

        Returns:
            Notes.
        """
        return ()

    def at_end(self, end: End) -> tuple[str, ...]:  # noqa: ARG002 - of records told with their first samples
        """That something stands at the end of what was tried.

        Args:
            end: The end.

        Returns:
            Sentences, which are warnings.
        """
        return ()

    def part(self) -> Self | None:
        """The same problem on some samples of long records; ``None`` where all are looked at throughout."""
        return None

    def about_part(self) -> str:
        """What is told of a fit whose starts were compared on this part."""
        return ""

    def with_orders(self, orders: TransferFunction) -> Self:
        """The same data for another structure.

        Args:
            orders: The structure.

        Returns:
            The problem.
        """
        return dataclasses.replace(self, orders=orders)  # type: ignore[type-var]

    @property
    def goes_on(self) -> bool:
        """Whether it begins where another fit has ended, beside which smaller structures have nothing to say."""
        return False

    def unbounded(self) -> Self | None:
        """The same problem with poles anywhere; ``None`` where that means nothing."""
        return None

    def levelled(self, end: End) -> Self | None:  # noqa: ARG002 - a spectrum has no level
        """The same problem about the input at which what integrates stands.

        Args:
            end: With its poles at 1 where they are those of integrators.

        Returns:
            It; ``None`` where nothing integrates, or that means nothing.
        """
        return None

    def asked_from(self, end: End) -> float:
        """Magnitude in the z plane from which a pole is asked about, whether it may lie at the edge or beyond.

        Args:
            end: The minimum among stable poles.

        Returns:
            It. Where noise and wrong dynamics hide an integrator, that search ends a few of them within the edge.
        """
        return 1.0 - slow_poles.REACH / max(end.lengths)

    def held_back(self, radius: float, end: End) -> bool:
        """Whether a pole stands at its bound, so that nothing says where it is.

        Args:
            radius: Magnitude of the slowest pole in the z plane.
            end: The minimum among stable poles.

        Returns:
            Whether it does.
        """
        return slow_poles.undecided(radius, end.lengths)

    def free_starts(self, provider: SeparableProvider) -> list[PoleStart]:  # noqa: ARG002 - see the base class
        """Starts whose poles need not be stable.

        Args:
            provider: The least-squares problem.

        Returns:
            The starts, that which the data suggest first.
        """
        return []

    def pole_parameters(self, longest: float) -> PoleParameters:
        """How the poles are described.

        Args:
            longest: Length of the longest record in samples.

        Returns:
            Poles whose time constants stay below :data:`slow_poles.SLOWEST` records.
        """
        rate = 1.0 / (slow_poles.SLOWEST * longest)
        discrete = self.orders.domain is Domain.DISCRETE
        return PoleParameters(
            n_poles=self.orders.poles,
            domain=self.orders.domain,
            stable=self.training.stable is not False,
            slowest=rate if discrete else rate / self.terms.sample_time,
        )

    def begun_in_motion(self) -> Self | None:
        """The same problem where no record begins at rest; ``None`` where none is taken to."""
        return None

    def direct(self, delays: tuple[int, ...]) -> tuple[int, ...]:
        """Dead times, none where an input clearly acts within the sample; of spectra they stay.

        Args:
            delays: Those that were found, from 1 on.

        Returns:
            The dead times.
        """
        return delays

    def model(self, end: End) -> tuple[TransferFunctionModel, Uncertainty | None]:
        """The model at an end, and how uncertain its parameters are, where that is known.

        Args:
            end: The end.

        Returns:
            Both.

        Raises:
            FitDivergedError: If its free run is not finite.
        """
        provider = end.provider
        separated = provider.separated(end.theta)
        if separated is None:
            raise FitDivergedError(
                "the free run at the end of the fit is not finite",
                last_state=end.theta,
                remedy="lower the number of poles",
            )
        model = TransferFunctionModel(
            orders=replace(self.orders, delays=end.delays),
            sections=end.sections,
            taps=_split(separated.weights, self.orders.zeros),
            constant=float(separated.weights[provider.n_taps]) if provider.constant else 0.0,
            scaling=self.scaling,
            mapping=self.terms.mapping,
            sample_time=self.terms.sample_time,
            input_units=self.terms.input_units,
            output_unit=self.terms.output_unit,
            rest_output=self.terms.rest_output,
        )
        # Of errors through a mirrored predictor the derivatives at fixed numerators are not known.
        known = None
        if not separated.mirrored:
            known = transfer_function_uncertainty(model, provider, separated, self._late(end, separated))
        return model, known

    def _late(self, end: End, separated: Separated) -> dict[int, NDArray[np.float64]]:
        """By input whose dead time was found between samples how the output moves with it, per second."""
        found = {}
        for j, delay in enumerate(end.delays):
            part = parted(delay)[1]
            if not part or self.orders.delays is not None:
                continue
            step, both = APART * min(part, 1.0 - part), []
            for sign in (1.0, -1.0):
                provider = self.provider((*end.delays[:j], delay + sign * step, *end.delays[j + 1 :]))
                columns = tuple(record.columns(separated.bases) for record in provider.records)
                both.append(provider.design(columns, separated.constants) @ separated.weights)
            found[j] = (both[0] - both[1]) / (2.0 * step * self.terms.sample_time)
        return found

    def at_one(self, end: End, *, every: bool = False) -> End:
        """The end with all poles at 1, and pairs on the circle, that records of this length do not tell from there.

        Args:
            end: The end.
            every: Whether all that are near are put there, and who asks judges.

        Returns:
            The other one, with the loss that it has; see :mod:`sysid.estimation.linear.transfer_function.integrators`.
        """
        near = slow_poles.REACH / max(len(record.target) for record in end.provider.records)
        put = all_at_one if every else with_edge
        return put(end, self.orders.domain, self.terms.sample_time, near)


def _split(weights: NDArray[np.float64], n_zeros: tuple[int, ...]) -> tuple[NDArray[np.float64], ...]:
    """The taps of each input from the solution of the linear part."""
    ends = np.cumsum([zeros + 1 for zeros in n_zeros])
    return tuple(np.split(weights[: ends[-1]], ends[:-1]))
