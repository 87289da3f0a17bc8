"""Estimates without a structure, impulse and frequency responses: they say what they are, and draw themselves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

from sysid.api.given import TracesLike, traces_of
from sysid.api.looking import Given, mapping_of
from sysid.api.per_output import PerOutput
from sysid.api.several import Several, members
from sysid.errors import ConfigError
from sysid.estimation import FitResult
from sysid.estimation.nonparametric import impulse, response
from sysid.estimation.nonparametric.impulse_response import ImpulseResponse as Estimated
from sysid.estimation.nonparametric.kernels import Kernel
from sysid.estimation.nonparametric.spectra import SpectralMethod
from sysid.models import Mapping
from sysid.reporting.frequency import HERTZ, FrequencyUnit
from sysid.traces import Role, TraceSet

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure
    from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ImpulseResponse(Estimated):
    """An impulse response that draws itself; printed, it is what it says of each input."""

    def __str__(self) -> str:
        step, deviation = self.step()
        lines = [f"impulse response, {self.mapping}: {100 * self.explained:.1f} % of the output explained"]
        ends = zip(self.mapping.inputs, self.dead_times, self.settling(), step, deviation, strict=True)
        for name, dead, settling, rise, error in ends:
            acts = f"dead time {dead.best} ({dead.low} to {dead.high}) samples, settled after {settling} of them"
            gain = f"gain {rise[-1]:.4g} +- {1.96 * error[-1]:.2g} (95 %)"
            lines.append(f"{name}: {acts}, {gain}" if dead.acts else f"{name}: no effect that can be measured")
        return "\n".join([*lines, *self.notes])

    __repr__ = __str__

    def plot(self) -> Figure:
        """The response of every input with its 95 % band.

        Returns:
            A figure of matplotlib's.
        """
        from sysid.reporting.figures.response_figure import impulse_figure

        return impulse_figure(self)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ImpulseResponses(PerOutput[ImpulseResponse]):
    """The impulse responses of a record of several outputs; see the base class."""

    def plot(self) -> dict[str, Figure]:
        """The response of every input with its 95 % band.

        Returns:
            A figure of matplotlib's for each output.
        """
        return {name: one.plot() for name, one in self.outputs.items()}


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class FrequencyResponse(response.FrequencyResponse):
    """A frequency response that draws itself, beside models if asked; printed, it says what it is."""

    def __str__(self) -> str:
        low, high = HERTZ.told(self.frequency[[0, -1]])
        head = f"frequency response, {self.mapping}: {self.method.value}, {len(self.frequency)} points"
        return "\n".join([f"{head} from {low:.4g} to {high:.4g} Hz, averages {self.averages:.3g}", *self.notes])

    __repr__ = __str__

    def plot(self, *fits: FitResult | Several, unit: str = HERTZ.value) -> Figure:
        """Gain, phase and coherence with 95 % bands, and the responses of linear models over them.

        Args:
            fits: Of this output, or of several among which it is; networks are left out, as they have no response.
            unit: Of the frequencies that are drawn: ``"Hz"``, or ``"rad/s"``, as ``frequency`` has them.

        Returns:
            A figure of matplotlib's.

        Raises:
            ConfigError: If it is another unit.
        """
        from sysid.reporting.figures.response_figure import response_figure

        parts = [part for one in fits for part in members(one)]
        return response_figure(self, parts, FrequencyUnit.of(unit))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class FrequencyResponses(PerOutput[FrequencyResponse]):
    """The frequency responses of a record of several outputs; see the base class."""

    def plot(self, *fits: FitResult | Several, unit: str = HERTZ.value) -> dict[str, Figure]:
        """Gain, phase and coherence with 95 % bands, and the responses of linear models over them.

        Args:
            fits: Linear models of these outputs, each drawn over its own.
            unit: Of the frequencies that are drawn: ``"Hz"``, or ``"rad/s"``.

        Returns:
            A figure of matplotlib's for each output.

        Raises:
            ConfigError: If it is another unit.
        """
        return {name: one.plot(*fits, unit=unit) for name, one in self.outputs.items()}


def _estimation(traces: TraceSet) -> tuple[Any, ...]:
    return traces.with_role(Role.ESTIMATION) or traces.traces


def impulse_response(
    traces: TracesLike,
    mapping: Given | None = None,
    *,
    lags: int | None = None,
    dead_times: Sequence[int] | None = None,
    kernel: str | Kernel | None = None,
    noise_order: int | None = None,
) -> ImpulseResponse | ImpulseResponses:
    """The impulse response of every input, regularised, with bands; no structure is chosen.

    Args:
        traces: The data set; its estimation traces, all where there are none.
        mapping: As for :func:`~sysid.api.looking.advise`.
        lags: Length in samples; as long as it takes to settle by default.
        dead_times: Of each input, in samples; found by default.
        kernel: ``"TC"`` or ``"DC"``; the one with the larger evidence by default.
        noise_order: Order of the noise's autoregression; chosen by default, 0 for white noise.

    Returns:
        The response; of several outputs, that of each, ``found["y1"]``.

    Raises:
        ConfigError: If an option is out of range.
        TraceError: If the record is too short, or an input never changes.
    """
    traces = traces_of(traces, word="impulse_response")
    chosen = None if kernel is None else _choice(kernel, Kernel, "kernel")

    def estimated(one: Mapping) -> ImpulseResponse:
        found = impulse.estimate_impulse_response(
            _estimation(traces), one, lags=lags, dead_times=dead_times, kernel=chosen, noise_order=noise_order
        )
        return ImpulseResponse(**{field.name: getattr(found, field.name) for field in fields(Estimated)})

    each = {one.output: estimated(one) for one in mapping_of(traces, mapping).each}
    return ImpulseResponses(outputs=each) if len(each) > 1 else next(iter(each.values()))


def frequency_response(
    traces: TracesLike,
    mapping: Given | None = None,
    *,
    method: str | SpectralMethod = "SPA",
    resolution: float | None = None,
    frequency: NDArray[np.float64] | None = None,
    period: int | None = None,
) -> FrequencyResponse | FrequencyResponses:
    """The frequency response of every input, and the coherence, with bands; no structure is chosen.

    Args:
        traces: The data set; its estimation traces, all where there are none.
        mapping: As for :func:`~sysid.api.looking.advise`.
        method: ``"SPA"`` (Blackman and Tukey), ``"Welch"`` or ``"ETFE"``.
        resolution: In rad/s; finer costs wider bands.
        frequency: In rad/s, for SPA.
        period: Of a periodic input, in samples, for ETFE.

    Returns:
        The response; of several outputs, that of each, ``found["y1"]``.

    Raises:
        ConfigError: If an option is out of range.
        TraceError: If the record is too short.
    """
    traces = traces_of(traces, word="frequency_response")
    chosen = _choice(method, SpectralMethod, "method")

    def estimated(one: Mapping) -> FrequencyResponse:
        found = response.estimate_frequency_response(
            _estimation(traces), one, method=chosen, resolution=resolution, frequency=frequency, period=period
        )
        known = {field.name: getattr(found, field.name) for field in fields(response.FrequencyResponse)}
        return FrequencyResponse(**known)

    each = {one.output: estimated(one) for one in mapping_of(traces, mapping).each}
    return FrequencyResponses(outputs=each) if len(each) > 1 else next(iter(each.values()))


def _choice(value: Any, choices: type[Any], what: str) -> Any:
    if isinstance(value, choices):
        return value
    known = {str(one.value).lower(): one for one in choices}
    if str(value).lower() not in known:
        names = ", ".join(str(one.value) for one in choices)
        raise ConfigError(f"there is no such {what}", expected=names, got=repr(value), remedy=f"give one of {names}")
    return known[str(value).lower()]
