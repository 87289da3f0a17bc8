"""The look at data first, and the estimates without a structure that it rests on, which answer and draw themselves."""

from __future__ import annotations

import dataclasses
import datetime
from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sysid import advice as room
from sysid.api.given import TracesLike, traces_of
from sysid.api.notebook import html_of
from sysid.api.several import Several, members
from sysid.errors import ConfigError
from sysid.estimation import FitResult
from sysid.estimation.nonparametric import impulse, response
from sysid.estimation.nonparametric.impulse_response import ImpulseResponse as Estimated
from sysid.estimation.nonparametric.kernels import Kernel
from sysid.estimation.nonparametric.spectra import SpectralMethod
from sysid.excitation import AbstractExcitation, excitation
from sysid.ingest.tables.durations import length_of_time
from sysid.ingest.writers import write_trace
from sysid.models import Mapping
from sysid.models.orders.typed_fields import plain_values
from sysid.reporting.advice.record import AdviceRecord
from sysid.reporting.advice.words import lines
from sysid.reporting.frequency import HERTZ, FrequencyUnit
from sysid.traces import Role, TraceSet

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

Given = str | Mapping | Dict[str, Any]
"""How a mapping is written."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Advice(room.Advice):
    """What is in a record; printed, it is a list of findings with what to do."""

    @property
    def record(self) -> AdviceRecord:
        """As it is stored in ``results.json``."""
        return AdviceRecord.model_validate(self.to_dict())

    def to_frame(self) -> pd.DataFrame:
        """A row for each finding and each suggestion.

        Returns:
            Columns ``question``, ``verdict``, ``says``, ``do``.
        """
        import pandas as pd

        return pd.DataFrame(lines(self.record), columns=["question", "verdict", "says", "do"])

    def plot(self, *, unit: str = HERTZ.value) -> Figure:
        """Impulse response, frequency response and coherence.

        Args:
            unit: Of the frequencies that are drawn: ``"Hz"`` or ``"rad/s"``.

        Returns:
            A figure of matplotlib's.

        Raises:
            ConfigError: If it is another unit, or there is nothing to draw: no input moves, or the record is too short.
        """
        from sysid.reporting.figures.advice_figure import advice_figure

        figure = advice_figure(self.record, FrequencyUnit.of(unit))
        if figure is None:
            raise ConfigError(
                "there is nothing to draw",
                where=f"data set {self.data}",
                expected="an input that moves, and some twenty samples",
                remedy="print the advice: it says why",
            )
        return figure

    def __str__(self) -> str:
        text, before = [f"{self.data}, {self.mapping}"], ""
        for question, verdict, says, do in lines(self.record):
            text += [question] if question != before else []
            before = question
            text += [f"  {f'[{verdict}] ' if verdict else ''}{says}"] + ([f"      {do}"] if do else [])
        return "\n".join(text)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return html_of(self)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SystemAdvice:
    """What is in a record of several outputs.

    Args:
        outputs: The findings, by output.
    """

    outputs: Dict[str, Advice]

    def to_frame(self) -> pd.DataFrame:
        """A row for each finding and each suggestion.

        Returns:
            Columns ``output``, ``question``, ``verdict``, ``says``, ``do``.
        """
        import pandas as pd

        frames = [one.to_frame().assign(output=name) for name, one in self.outputs.items()]
        return pd.concat(frames, ignore_index=True)[["output", "question", "verdict", "says", "do"]]

    def __str__(self) -> str:
        return "\n\n".join(map(str, self.outputs.values()))

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return html_of(self)


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


@dataclass(frozen=True, kw_only=True, eq=False)
class Excitation(excitation.Excitation):
    """The signals of an experiment, which save and draw themselves."""

    def save(self, path: str | Path) -> Path:
        """Write the signals to a file, with time and units.

        Args:
            path: Ending in ``.csv`` or ``.parquet``.

        Returns:
            The path.

        Raises:
            UserError: If it cannot be written.
        """
        return write_trace(self.trace(), path)

    def plot(self) -> Figure:
        """The signals over time, and their spectra.

        Returns:
            A figure of matplotlib's.
        """
        from sysid.reporting.figures.excitation_figure import excitation_figure

        return excitation_figure(self)


def _estimation(traces: TraceSet) -> tuple[Any, ...]:
    return traces.with_role(Role.ESTIMATION) or traces.traces


def advise(traces: TracesLike, mapping: Given | None = None) -> Advice | SystemAdvice:
    """Look at a data set: what is in it, what is wrong with it, what to try.

    Args:
        traces: The data set; its estimation and selection traces are looked at, all where there are none.
        mapping: Inputs and output; not needed for two channels, the second being the output, or for one.

    Returns:
        The findings: printed, they are sentences. Of several outputs, those of each.

    Raises:
        ConfigError: If nothing tells inputs and output apart.
        ChannelError: If a channel of the mapping is missing.

    Example:
        >>> import numpy as np, sysid
        >>> u = np.repeat([0.0, 1.0, -1.0, 0.5, 0.0], 20)
        >>> traces = sysid.data((u, np.convolve(u, [0.0, 0.0, 0.5, 0.25])[:100]), sample_time=0.1)
        >>> found = sysid.advise(traces, "u -> y")
        >>> found.find("excitation.few_moves", "u").figures["moves"]
        4
    """
    traces = traces_of(traces, word="advise")
    chosen = mapping_of(traces, mapping)
    found = {one.output: _advice(room.advise(traces, one)) for one in chosen.each}
    return SystemAdvice(outputs=found) if len(found) > 1 else next(iter(found.values()))


def _advice(found: room.Advice) -> Advice:
    return Advice(**{field.name: getattr(found, field.name) for field in dataclasses.fields(room.Advice)})


def mapping_of(traces: TraceSet, mapping: Given | None, *, option: str = "mapping=") -> Mapping:
    """A mapping as it was given, or the only one that a data set of one or two channels has.

    Args:
        traces: The data set.
        mapping: As it was given.
        option: What stands before a mapping where it is given: ``--mapping`` on the command line.

    Returns:
        The mapping.

    Raises:
        ConfigError: If it was not given, and there are more channels.
    """
    names = [channel.name for channel in traces.channels]
    if mapping is not None:
        return Mapping.of(mapping)
    if len(names) <= 2:
        return Mapping(inputs=tuple(names[:-1]), outputs=(names[-1],))
    example = Mapping(inputs=tuple(names[:-1]), outputs=(names[-1],))
    raise ConfigError(
        "nothing tells inputs and output apart",
        where=f"data set {traces.name}",
        expected="a mapping of its channels",
        got=", ".join(names),
        remedy=f'write for example {option}"{example}"',
    )


def impulse_response(
    traces: TracesLike,
    mapping: Given | None = None,
    *,
    lags: int | None = None,
    dead_times: Sequence[int] | None = None,
    kernel: str | Kernel | None = None,
    noise_order: int | None = None,
) -> ImpulseResponse:
    """The impulse response of every input, regularised, with bands; no structure is chosen.

    Args:
        traces: The data set; its estimation traces, all where there are none.
        mapping: As for :func:`advise`.
        lags: Length in samples; as long as it takes to settle by default.
        dead_times: Of each input, in samples; found by default.
        kernel: ``"TC"`` or ``"DC"``; the one with the larger evidence by default.
        noise_order: Order of the noise's autoregression; chosen by default, 0 for white noise.

    Returns:
        The response.

    Raises:
        ConfigError: If an option is out of range.
        TraceError: If the record is too short, or an input never changes.
    """
    traces = traces_of(traces, word="impulse_response")
    found = impulse.estimate_impulse_response(
        _estimation(traces),
        mapping_of(traces, mapping),
        lags=lags,
        dead_times=dead_times,
        kernel=None if kernel is None else _choice(kernel, Kernel, "kernel"),
        noise_order=noise_order,
    )
    return ImpulseResponse(**{field.name: getattr(found, field.name) for field in dataclasses.fields(Estimated)})


def frequency_response(
    traces: TracesLike,
    mapping: Given | None = None,
    *,
    method: str | SpectralMethod = "SPA",
    resolution: float | None = None,
    frequency: NDArray[np.float64] | None = None,
    period: int | None = None,
) -> FrequencyResponse:
    """The frequency response of every input, and the coherence, with bands; no structure is chosen.

    Args:
        traces: The data set; its estimation traces, all where there are none.
        mapping: As for :func:`advise`.
        method: ``"SPA"`` (Blackman and Tukey), ``"Welch"`` or ``"ETFE"``.
        resolution: In rad/s; finer costs wider bands.
        frequency: In rad/s, for SPA.
        period: Of a periodic input, in samples, for ETFE.

    Returns:
        The response.

    Raises:
        ConfigError: If an option is out of range.
        TraceError: If the record is too short.
    """
    traces = traces_of(traces, word="frequency_response")
    found = response.estimate_frequency_response(
        _estimation(traces),
        mapping_of(traces, mapping),
        method=_choice(method, SpectralMethod, "method"),
        resolution=resolution,
        frequency=frequency,
        period=period,
    )
    return FrequencyResponse(
        **{field.name: getattr(found, field.name) for field in dataclasses.fields(response.FrequencyResponse)}
    )


def _choice(value: Any, choices: type[Any], what: str) -> Any:
    if isinstance(value, choices):
        return value
    known = {str(one.value).lower(): one for one in choices}
    if str(value).lower() not in known:
        names = ", ".join(str(one.value) for one in choices)
        raise ConfigError(f"there is no such {what}", expected=names, got=repr(value), remedy=f"give one of {names}")
    return known[str(value).lower()]


def excite(
    kind: str | AbstractExcitation,
    *,
    sample_time: float | datetime.timedelta,
    samples: int | None = None,
    duration: float | datetime.timedelta | None = None,
    low: float | Sequence[float] = -1.0,
    high: float | Sequence[float] = 1.0,
    names: str | Sequence[str] = "u",
    units: str | Sequence[str] = "1",
    seed: int = 0,
    **options: Any,
) -> Excitation:
    """Draw the inputs of an experiment: signals that stay within a range and hold the frequencies that are asked for.

    Args:
        kind: ``prbs``, ``multisine``, ``noise``, ``chirp``, ``staircase``, ``aprbs``, ``ramps``, ``sine`` or
            ``pulses``; or one with its options, as ``PRBS(clock=4)``.
        sample_time: Seconds between samples, or a duration.
        samples: Length, or
        duration: in seconds, or as a duration.
        low: Lower end of the range, one for all channels or one each.
        high: Upper end.
        names: Of the channels.
        units: Of the channels.
        seed: Of everything that is random.
        **options: Of the kind: see :mod:`sysid.excitation`.

    Returns:
        The signals: an array, a frame, a file.

    Raises:
        ConfigError: If there is no such kind or option, or a number is out of range.

    Example:
        >>> found = excite("multisine", samples=1000, sample_time=0.01, low=0.0, high=10.0, band=(0.5, 5.0))
        >>> found.values.shape, bool(0.0 <= found.values.min() and found.values.max() <= 10.0)
        ((1000, 1), True)
    """
    times = {"sample_time": sample_time, "duration": duration}
    times = {name: length_of_time(value, where=name) for name, value in times.items()}
    numbers = {**times, "samples": samples, "low": low, "high": high}
    plain = plain_values({**numbers, "seed": seed, **options})
    found = excitation.excite(kind, names=names, units=units, **plain)
    return Excitation(**{field.name: getattr(found, field.name) for field in dataclasses.fields(excitation.Excitation)})
