"""The look at data first, and the signals of an experiment, which answer and draw themselves."""

from __future__ import annotations

import dataclasses
import datetime
import warnings
from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sysid import advice as room
from sysid.api.given import TracesLike, traces_of
from sysid.api.notebook import html_of
from sysid.api.per_output import PerOutput, framed
from sysid.errors import ConfigError
from sysid.excitation import AbstractExcitation, excitation
from sysid.ingest.inspecting.undescribed import GuessedWarning
from sysid.ingest.tables.durations import length_of_time
from sysid.ingest.writers import write_trace
from sysid.models import Mapping
from sysid.models.orders.typed_fields import plain_values
from sysid.reporting.advice.record import AdviceRecord
from sysid.reporting.advice.words import lines
from sysid.reporting.frequency import HERTZ, FrequencyUnit
from sysid.traces import TraceSet

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

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
class SystemAdvice(PerOutput[Advice]):
    """What is in a record of several outputs; see the base class."""

    def to_frame(self) -> pd.DataFrame:
        """A row for each finding and each suggestion.

        Returns:
            Columns ``output``, ``question``, ``verdict``, ``says``, ``do``.
        """
        return framed(self.outputs)


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


def advise(traces: TracesLike, mapping: Given | None = None) -> Advice | SystemAdvice:
    """Look at a data set: what is in it, what is wrong with it, what to try.

    Args:
        traces: The data set; its estimation and selection traces are looked at, all where there are none.
        mapping: Inputs and output; not needed for one channel, for two, or where all names tell (``u1``, ``y``); what
            was guessed is told.

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
    """A mapping as it was given, or what the names of the channels say, or how two of them move.

    Args:
        traces: The data set.
        mapping: As it was given.
        option: What stands before a mapping where it is given: ``--mapping`` on the command line.

    Returns:
        The mapping.

    Raises:
        ConfigError: If it was not given, and nothing tells inputs and outputs apart.

    Warns:
        GuessedWarning: If it is not the order of the channels that was taken, the last one being the output.
    """
    if mapping is not None:
        return Mapping.of(mapping)
    names = tuple(channel.name for channel in traces.channels)
    plain = Mapping(inputs=names[:-1], outputs=names[-1:])
    if (found := room.guessed(traces)) is None:
        raise ConfigError(
            "nothing tells inputs and output apart",
            where=f"data set {traces.name}",
            expected="a mapping of its channels",
            got=", ".join(names),
            remedy=f'write for example {option}"{plain}"',
        )
    if found.reason:
        told = f'guessed: {found.mapping}: {found.reason}; {option}"{found.mapping}" says so, {option}"{plain}" not'
        warnings.warn(f"{traces.name}: {told}", GuessedWarning, stacklevel=3)
    return found.mapping


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
