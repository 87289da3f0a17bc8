"""What is fitted to a measured frequency response: its points, what counts of their errors, the fit to some of them."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from sysid.api.estimates import FrequencyResponse
from sysid.errors import ConfigError
from sysid.estimation import FitResult, Spectrum, TransferFunctionTraining, fit_spectra
from sysid.estimation.linear.frequency_response.dead_time import with_dead_time
from sysid.estimation.linear.frequency_response.fit import LONGEST
from sysid.models import Domain, Mapping, TransferFunction, TransferFunctionModel
from sysid.traces.measured_response import MeasuredResponse
from sysid.units import check_unit

POINTS_A_PERIOD = 20.0
"""Samples in a period of the highest frequency, of a continuous model whose sample time nobody says: that of its dead
time and of the files that run it."""
CERTAIN = 0.9999
"""Coherence from which more of it says nothing more."""


class Weighting(Enum):
    """What counts of the error at each frequency: of its square divided by another."""

    NONE = "none"
    """The error itself: resonances, and low frequencies, count most."""
    RELATIVE = "relative"
    """The error over the response's size, as a Bode diagram shows it (MATLAB's ``inv``)."""
    ROOT = "root"
    """The error over the root of that size (MATLAB's ``invsqrt``)."""
    COHERENCE = "coherence"
    """The error over what the measured coherence says of its own."""

    def weights(self, response: MeasuredResponse) -> NDArray[np.float64]:
        """The weight of each point's squared error.

        Args:
            response: What was measured.

        Returns:
            Shape ``(n_points,)``.

        Raises:
            ConfigError: If a coherence is asked for that was not measured.
        """
        size = np.abs(response.values)
        square = np.maximum(size, 1e-12 * float(size.max())) ** 2
        if self is Weighting.COHERENCE:
            if response.coherence is None:
                raise ConfigError(
                    "there is no coherence to weight by", where=response.name, expected="a column of it",
                    got="gain and phase alone", remedy="weighting='relative' counts every point's error over its size",
                )  # fmt: skip
            known = np.clip(response.coherence, 0.0, CERTAIN)
            return np.asarray(known / (1.0 - known) / square)
        power = {Weighting.NONE: 0.0, Weighting.RELATIVE: 1.0, Weighting.ROOT: 0.5}[self]
        return np.asarray(square**-power)

    @classmethod
    def of(cls, given: str | Weighting) -> Weighting:
        """The weighting of a name.

        Args:
            given: Its value, or itself.

        Returns:
            It.

        Raises:
            ConfigError: If there is no such one.
        """
        known = {one.value: one for one in cls}
        if isinstance(given, cls):
            return given
        if given not in known:
            raise ConfigError.unknown(
                "there is no such weighting", str(given), known, "give one of these", where="weighting"
            )
        return known[str(given)]


@dataclass(frozen=True, kw_only=True, eq=False)
class ResponseProblem:
    """A measured response, and how transfer functions are fitted to it.

    Args:
        measured: The points.
        mapping: What input and output are called.
        units: Of both, by name.
        weighting: What counts of the errors.
        weights: Of each point's squared error, shape ``(n_points,)``.
        sample_time: In seconds; of a continuous model ``None`` for one that is found.
        training: How to fit.
    """

    measured: MeasuredResponse
    mapping: Mapping
    units: Dict[str, str]
    weighting: Weighting
    weights: NDArray[np.float64]
    sample_time: float | None
    training: TransferFunctionTraining | None

    @classmethod
    def of(
        cls,
        response: MeasuredResponse | FrequencyResponse,
        mapping: str | Mapping | None,
        *,
        sample_time: float | None,
        weighting: str | Weighting,
        units: Dict[str, str] | None,
        training: TransferFunctionTraining | None,
    ) -> ResponseProblem:
        """What was asked for, checked; see :func:`sysid.fit_response`."""
        measured, weighting = _measured(response), Weighting.of(weighting)
        given = mapping or (response.mapping if isinstance(response, FrequencyResponse) else "u -> y")
        mapped = Mapping.of(given)
        if len(mapped.inputs) != 1 or len(mapped.outputs) != 1:
            raise ConfigError(
                "a frequency response is from one input to one output", where="mapping", expected="for example u -> y",
                got=str(mapped), remedy="fit each pair by itself; sysid.estimation.fit_spectra takes several inputs",
            )  # fmt: skip
        if sample_time is not None and not 0.0 < sample_time < np.inf:
            raise ConfigError(
                "not a sample time", where="sample_time", expected="seconds, above 0", got=sample_time,
                remedy="correct it",
            )  # fmt: skip
        return cls(
            measured=measured, mapping=mapped, weighting=weighting, weights=weighting.weights(measured),
            units={name: check_unit((units or {}).get(name, "1")) for name in mapped.channels},
            sample_time=None if sample_time is None else float(sample_time), training=training,
        )  # fmt: skip

    def fitted(self, structure: TransferFunction) -> FitResult:
        """The fit of a structure to all points, with the dead time that leaves least.

        Args:
            structure: Its orders.

        Returns:
            The fit.

        Raises:
            ConfigError: If the structure has no sample time.
        """
        first = self.fit_at(structure, self._time_of(structure))
        found = self._with_dead_time(structure, first)
        if found is first:
            return first
        lost = tuple(one for one in first.warnings if LONGEST in one and one not in found.warnings)
        return replace(found, notes=(*found.notes, *lost), warnings=(*found.warnings, *lost))

    def fitted_from(self, structure: TransferFunction, begin: TransferFunctionModel) -> FitResult:
        """The fit of a structure from the poles of a model, with a dead time near that of it.

        Args:
            structure: Its orders.
            begin: The model.

        Returns:
            The fit.
        """
        fixed = replace(structure, delays=begin.delays)
        return self._with_dead_time(structure, self.fit_at(fixed, begin.sample_time, begin=begin))

    def _with_dead_time(self, structure: TransferFunction, first: FitResult) -> FitResult:
        """A fit with the dead time in seconds that leaves least, where nobody said it or a sample time."""
        if self.sample_time is not None or structure.delays is not None:
            return first

        def fit_at(time: float, delay: int, begin: TransferFunctionModel) -> FitResult:
            return self.fit_at(replace(structure, delays=(delay,)), time, begin=begin)

        return with_dead_time(first, fit_at, n_residuals=2 * len(self.measured))

    def fit_at(
        self,
        structure: TransferFunction,
        sample_time: float,
        *,
        begin: TransferFunctionModel | None = None,
        kept: NDArray[np.bool_] | None = None,
    ) -> FitResult:
        """The fit of a structure with one sample time.

        Args:
            structure: Its orders; dead times that it leaves open are searched among its multiples.
            sample_time: In seconds.
            begin: A model whose poles are the only start.
            kept: Which points are fitted, shape ``(n_points,)``; all by default.

        Returns:
            The fit.
        """
        kept = np.ones(len(self.measured), dtype=bool) if kept is None else kept
        return fit_spectra(
            Spectrum.of_response(self.measured.frequency[kept], self.measured.values[kept], weights=self.weights[kept]),
            self.mapping,
            replace(structure, intercept=False),
            self.training,
            begin=begin,
            sample_time=sample_time,
            input_units=(self.units[self.mapping.inputs[0]],),
            output_unit=self.units[self.mapping.output],
        )

    def _time_of(self, structure: TransferFunction) -> float:
        """The sample time of a first fit, in seconds."""
        if self.sample_time is not None:
            return self.sample_time
        if structure.domain is Domain.DISCRETE:
            raise ConfigError(
                "a discrete model has a sample time",
                where="sample_time",
                expected="seconds",
                got="none",
                remedy="give sample_time=0.01 (--sample-time), or fit a continuous one: domain='continuous'",
            )
        return float(f"{2.0 * np.pi / self.measured.frequency[-1] / POINTS_A_PERIOD:.2g}")


def _measured(response: object) -> MeasuredResponse:
    if isinstance(response, MeasuredResponse):
        return response
    if isinstance(response, FrequencyResponse) and response.values.shape[1] == 1:
        seen = np.isfinite(response.values[:, 0])
        coherence = response.coherence[seen] if np.isfinite(response.coherence[seen]).all() else None
        return MeasuredResponse(
            name=str(response.mapping), frequency=response.frequency[seen], values=response.values[seen, 0],
            coherence=coherence,
        )  # fmt: skip
    raise ConfigError(
        "not a frequency response of one input",
        where="response",
        expected="what sysid.response_data gives, or sysid.frequency_response of one input",
        got=type(response).__name__,
        remedy="read it first: sysid.response_data('sweep.csv')",
    )
