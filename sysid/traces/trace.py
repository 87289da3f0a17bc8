"""A trace: one experiment, and what of it counts."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import overload

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError, TraceError
from sysid.traces.channel import Channel, check_text
from sysid.traces.stretch import Stretch

SMALLEST, LARGEST = 1e-150, 1e150
"""Magnitudes between which a channel's largest value may lie: beyond them a sum of squares is none in float64."""


def _is_given_away(values: object) -> bool:
    """Whether an array can be kept without a copy: float64, row by row, read-only, and nobody else's view."""
    return (
        type(values) is np.ndarray
        and values.dtype == np.float64
        and values.flags.c_contiguous
        and values.flags.owndata
        and not values.flags.writeable
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Trace:
    """One experiment.

    Args:
        name: Name of the case (``"EST01"``).
        sample_time: Seconds between samples.
        channels: What the columns of ``values`` are.
        values: Shape ``(n_samples, n_channels)``, float64; copied and made read-only. An array that is read-only and
            owns its memory is given away: it is kept as it is, since a long record would be in memory twice.
        start_time: Time of the first sample in seconds.
        usable: Shape ``(n_samples,)``, bool; ``False`` marks samples (gaps) that count in no loss and
            in no figure of merit. ``(n_samples, n_channels)`` marks them for each channel; kept as one column where all
            are alike. ``None`` means that all count.
        provenance: What was done to the samples on their way here, one sentence each.
        weights: What each sample counts in the loss of a fit, from 0 on, shape ``(n_samples,)``; figures of merit do
            not know them. ``None`` means that all count alike.

    Raises:
        TraceError: If shapes disagree, a value is not finite, or the sample time is not positive.

    Example:
        >>> trace = Trace(name="a", sample_time=0.1, channels=(Channel(name="u", unit="V"),), values=np.zeros((3, 1)))
        >>> trace.time.tolist(), trace["u"].shape
        ([0.0, 0.1, 0.2], (3,))
    """

    name: str
    sample_time: float
    channels: tuple[Channel, ...]
    values: NDArray[np.float64]
    start_time: float = 0.0
    usable: NDArray[np.bool_] | None = None
    provenance: tuple[str, ...] = ()
    weights: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        values = self.values
        if not _is_given_away(values):
            values = np.array(values, dtype=np.float64, order="C")
            values.setflags(write=False)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "channels", tuple(self.channels))
        object.__setattr__(self, "provenance", tuple(self.provenance))
        check_text(self.name, "the name of a trace")
        self._check()
        if self.usable is not None:
            usable = np.array(self.usable, dtype=np.bool_)
            if usable.ndim == 2 and (usable == usable[:, :1]).all():
                usable = usable[:, 0].copy()
            usable.setflags(write=False)
            object.__setattr__(self, "usable", usable)
        if self.weights is not None:
            object.__setattr__(self, "weights", self._checked_weights())

    def _checked_weights(self) -> NDArray[np.float64]:
        weights = np.array(self.weights, dtype=np.float64)
        if weights.shape != (len(self.values),) or not np.isfinite(weights).all() or weights.min() < 0.0:
            raise TraceError(
                "the weights do not match the samples",
                where=f"trace {self.name}",
                expected=f"{len(self.values)} numbers from 0 on",
                got=f"shape {weights.shape}, from {weights.min(initial=np.inf):g} to {weights.max(initial=-np.inf):g}",
                remedy="give one weight per sample",
            )
        weights.setflags(write=False)
        return weights

    def _check(self) -> None:
        if self.values.ndim != 2 or self.values.shape[1] != len(self.channels):
            raise TraceError(
                "values and channels do not match",
                where=f"trace {self.name}",
                expected=f"values of shape (n_samples, {len(self.channels)})",
                got=f"shape {self.values.shape}",
                remedy="give one column per channel",
            )
        names = self.channel_names
        repeated = sorted({name for name in names if names.count(name) > 1})
        if repeated:
            raise TraceError(
                f"channel {', '.join(repeated)} appears more than once",
                where=f"trace {self.name}",
                expected="a different name for each channel",
                got=", ".join(names),
                remedy="rename or drop one of them",
            )
        self._check_samples()

    def _check_samples(self) -> None:
        if not (np.isfinite(self.sample_time) and self.sample_time > 0.0):
            raise TraceError(
                "the sample time is not positive",
                where=f"trace {self.name}",
                expected="seconds between samples, above 0",
                got=self.sample_time,
                remedy="correct sample_time",
            )
        if len(self.values) == 0:
            raise TraceError(
                "the trace has no samples", where=f"trace {self.name}", remedy="check the file it came from"
            )
        bad = ~np.isfinite(self.values)
        if bad.any():
            row, column = (int(index) for index in np.argwhere(bad)[0])
            raise TraceError(
                f"{int(bad.sum())} values are not finite",
                where=f"trace {self.name}, channel {self.channel_names[column]}, sample {row}",
                expected="finite numbers",
                got=self.values[row, column],
                remedy="ask for a repair at ingest, or mark the samples as not usable",
            )
        if self.usable is not None and np.shape(self.usable) not in {(len(self.values),), self.values.shape}:
            raise TraceError(
                "the usable mask does not match the samples",
                where=f"trace {self.name}",
                expected=f"shape ({len(self.values)},) or {self.values.shape}",
                got=f"shape {np.shape(self.usable)}",
                remedy="give one truth value per sample, or one per sample and channel",
            )

    def require(self, names: Sequence[str]) -> None:
        """Refuse names that no channel has.

        Args:
            names: Channel names.

        Raises:
            ChannelError: If one is missing; all missing ones are named.
        """
        missing = [name for name in names if name not in self]
        if missing:
            raise ChannelError(missing, self.channel_names, where=f"trace {self.name}")

    def check_sizes(self, names: Sequence[str]) -> None:
        """Refuse channels whose squares are no numbers any more: no sum of squares, and so no fit, would be right.

        Args:
            names: The channels that are squared.

        Raises:
            ChannelError: If a channel is missing.
            TraceError: If the largest magnitude of one is neither 0 nor between 1e-150 and 1e150.
        """
        self.require(names)
        for name, column in ((name, self[name]) for name in names):
            largest = float(max(column.max(), -column.min()))  # without a copy: records are long
            if not (largest == 0.0 or SMALLEST <= largest <= LARGEST):
                raise TraceError(
                    f"the values are too {'large' if largest > LARGEST else 'small'} to be squared",
                    where=f"trace {self.name}, channel {name}",
                    expected=f"a largest magnitude between {SMALLEST:g} and {LARGEST:g}, or 0",
                    got=f"{largest:.4g}",
                    remedy="multiply the channel by a power of ten, or give it in another unit; where such a value "
                    "stands for a missing one, name it under missing",
                )

    def __len__(self) -> int:
        return len(self.values)

    def __repr__(self) -> str:
        channels = ", ".join(channel.label for channel in self.channels)
        return f"<Trace {self.name}: {len(self):,} samples of {self.sample_time:g} s; {channels}>"

    @overload
    def __getitem__(self, key: str) -> NDArray[np.float64]: ...

    @overload
    def __getitem__(self, key: slice) -> Trace: ...

    def __getitem__(self, key: str | slice) -> NDArray[np.float64] | Trace:
        """A channel by its name; of a slice of samples, those as a trace: ``trace[:300]``."""
        return self._cut(key) if isinstance(key, slice) else self.values[:, self.index(key)]

    def _cut(self, window: slice) -> Trace:
        start, stop, step = window.indices(len(self))
        if step != 1 or stop <= start:
            raise TraceError(
                "no part of a trace",
                where=f"trace {self.name}",
                expected=f"a slice of at least one of {len(self)} samples, in steps of 1",
                got=f"{window}",
                remedy="correct the slice; fewer samples a second are made by grid={'method': 'average'} with a "
                "sample_time, which filters before",
            )
        usable = None if self.usable is None else self.usable[start:stop]
        return replace(
            self,
            values=self.values[start:stop],
            start_time=float(self.start_time + self.sample_time * start),
            usable=None if usable is None or usable.all() else usable,
            weights=None if self.weights is None else self.weights[start:stop],
            provenance=(*self.provenance, f"samples {start} to {stop - 1} of {len(self)}"),
        )

    def __contains__(self, channel: object) -> bool:
        return channel in self.channel_names

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Names of the channels, in column order."""
        return tuple(channel.name for channel in self.channels)

    @property
    def time(self) -> NDArray[np.float64]:
        """Time of each sample in seconds, shape ``(n_samples,)``."""
        return self.start_time + self.sample_time * np.arange(len(self.values), dtype=np.float64)

    @property
    def duration(self) -> float:
        """Seconds covered: samples times sample time."""
        return len(self.values) * self.sample_time

    @property
    def usable_samples(self) -> NDArray[np.bool_]:
        """The samples that count in all channels, shape ``(n_samples,)``; all where no mask was given."""
        return self.usable_of(self.channel_names)

    def usable_of(self, names: Iterable[str]) -> NDArray[np.bool_]:
        """The samples that count in each of some channels.

        Args:
            names: Channel names, as the inputs and outputs of a mapping; those that are not there count everywhere.

        Returns:
            Shape ``(n_samples,)``.
        """
        if self.usable is None or self.usable.ndim == 1:
            return np.ones(len(self.values), dtype=np.bool_) if self.usable is None else self.usable
        return np.asarray(self.usable[:, [self.index(name) for name in names if name in self]].all(axis=1))

    def counted(self, inputs: Iterable[str], outputs: Iterable[str]) -> NDArray[np.bool_]:
        """The samples that count for each of some outputs: where it and every input does, whatever others lack.

        Args:
            inputs: Channel names; those that are not there count everywhere.
            outputs: Likewise.

        Returns:
            Shape ``(n_samples, n_outputs)``.
        """
        known = tuple(inputs)
        return np.column_stack([self.usable_of((*known, name)) for name in outputs])

    def masked(self, channel: str | None = None, *, start: float | None = None, stop: float | None = None) -> Trace:
        """The trace without samples of a stretch of time, in which a sensor was stuck, saturated or disturbed.

        What is read from a file is masked there, before anything is filled or resampled (``repairs: {mask: ...}``).

        Args:
            channel: The channel; all of them where none is named.
            start: Seconds, in the trace's own time: the first sample that does not count.
            stop: The last one.

        Returns:
            The trace, whose provenance says so.

        Raises:
            ChannelError: If there is no such channel.
            TraceError: If the stretch has no end, holds no sample, or leaves a channel none.

        Example:
            >>> u = Channel(name="u", unit="V")
            >>> trace = Trace(name="a", sample_time=0.1, channels=(u,), values=np.zeros((4, 1)))
            >>> trace.masked("u", start=0.1, stop=0.2).usable_samples.tolist()
            [True, False, False, True]
        """
        stretch = Stretch(start=start, stop=stop)
        inside = stretch.holds(self.time, self.sample_time)
        usable = np.ones(self.values.shape, dtype=np.bool_)
        if self.usable is not None:
            usable &= self.usable if self.usable.ndim == 2 else self.usable[:, np.newaxis]
        which = np.arange(len(self.channels)) if channel is None else np.array([self.index(channel)])
        usable[np.ix_(inside, which)] = False
        if not stretch.told or not inside.any() or not usable.any(axis=0).all():
            raise TraceError(
                "a stretch to be masked holds no sample" if not inside.any() else "a mask leaves a channel no sample",
                where=f"trace {self.name}",
                expected=f"start, stop, or both, from {self.time[0]:.10g} s to {self.time[-1]:.10g} s",
                got=stretch.told or "neither",
                remedy="correct start and stop, in seconds of the trace's own time; leave a useless channel out",
            )
        note = f"{channel or 'all channels'}: {int(inside.sum())} samples masked, {stretch.told}"
        return replace(self, usable=usable, provenance=(*self.provenance, note))

    def seen_by(self, names: Iterable[str], *, each: bool = False) -> Trace:
        """The trace as who knows some of its channels alone sees it: what others lack is nothing to it.

        Args:
            names: Channel names, as those of a mapping.
            each: Whether the mask stays one of each channel; else a sample counts where it does in all of them.

        Returns:
            The trace; itself where its mask is of samples already.
        """
        if self.usable is None or self.usable.ndim == 1:
            return self
        known = {*names}
        others = np.array([name not in known for name in self.channel_names])
        usable = self.usable | others if each else self.usable_of(known)
        return replace(self, usable=None if usable.all() else usable)

    @property
    def digest(self) -> str:
        """SHA-256 over everything that a fit can see: time, channels, values, mask and weights."""
        head = [self.start_time, self.sample_time, [[c.name, c.unit, c.reference.value] for c in self.channels]]
        sha = hashlib.sha256(json.dumps(head).encode())
        sha.update(self.values.data.cast("B"))  # of itself: a long record is not copied
        mask = self.usable_samples if self.usable is None else self.usable  # of channels it has more bits
        sha.update(np.packbits(mask).tobytes())
        if self.weights is not None:
            sha.update(self.weights.tobytes())
        return sha.hexdigest()

    def index(self, channel: str) -> int:
        """Column of a channel.

        Args:
            channel: Its name.

        Returns:
            The column in ``values``.

        Raises:
            ChannelError: If there is no such channel.
        """
        try:
            return self.channel_names.index(channel)
        except ValueError:
            raise ChannelError([channel], self.channel_names, where=f"trace {self.name}") from None

    def channel(self, name: str) -> Channel:
        """The channel of that name (:class:`ChannelError` if there is none)."""
        return self.channels[self.index(name)]

    def columns(self, names: Sequence[str]) -> NDArray[np.float64]:
        """Several channels side by side.

        Args:
            names: Channel names.

        Returns:
            Shape ``(n_samples, len(names))``, C order.

        Raises:
            ChannelError: If one is missing; all missing ones are named.
        """
        self.require(names)
        return np.ascontiguousarray(self.values[:, [self.index(name) for name in names]])
