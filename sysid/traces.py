"""Trace and TraceSet: the words that every other room speaks.

A **trace** is one experiment: a uniform sample time, named channels with units, float64, frozen. A
**trace set** is a group of traces with a role each. Experiments are never concatenated: a recursion
starts afresh in each of them.
"""

from __future__ import annotations

import enum
import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError, ConfigError, TraceError, did_you_mean
from sysid.units import Reference, is_same_unit

ROUNDING, EVEN = 1e-6, 0.95
"""Part of a signal's range that is rounding, as float32 leaves it; and part of the distances between its values that
are multiples of one, where that is the step of a converter."""
FEW_STEPS, VISIBLE = 4, 0.01
"""Steps that a signal of a converter has at least: a switch has fewer; and least part of a signal's standard deviation
that a coarse step is."""
SMALLEST, LARGEST = 1e-150, 1e150
"""Magnitudes between which a channel's largest value may lie: beyond them a sum of squares is none in float64."""


def check_text(text: str, what: str) -> None:
    """Refuse text that is not made of whole characters: a lone surrogate, as from names of files that are no text.

    Args:
        text: Anything that somebody named.
        what: What it is, for the error.

    Raises:
        TraceError: If it cannot be written as UTF-8.
    """
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        whole = text.encode("utf-8", "replace").decode()
        raise TraceError(
            f"{what} holds half a character, which no file can hold", where=ascii(text),
            expected="text that can be written as UTF-8", got=ascii(text),
            remedy=f"name it in whole characters, for example {whole!r}",
        ) from None  # fmt: skip


def _is_given_away(values: object) -> bool:
    """Whether an array can be kept without a copy: float64, row by row, read-only, and nobody else's view."""
    return (
        type(values) is np.ndarray
        and values.dtype == np.float64
        and values.flags.c_contiguous
        and values.flags.owndata
        and not values.flags.writeable
    )


class Role(enum.Enum):
    """What a trace may be used for. Scores on a trace count only if nothing was chosen on it."""

    ESTIMATION = "estimation"
    SELECTION = "selection"
    VALIDATION = "validation"
    TEST = "test"


@dataclass(frozen=True, kw_only=True)
class Channel:
    """A named quantity.

    Args:
        name: Short name, unique in its trace (``"BP"``).
        unit: A unit known to pint (``"psi"``); ``"1"`` for a pure number.
        reference: For pressures, what they are measured from.
        description: What it is, for people.

    Raises:
        TraceError: If a text holds half a character, which no file can be written with.
    """

    name: str
    unit: str
    reference: Reference = Reference.NONE
    description: str = ""

    def __post_init__(self) -> None:
        for what, text in (("name", self.name), ("unit", self.unit), ("description", self.description)):
            check_text(text, f"the {what} of a channel")

    @property
    def label(self) -> str:
        """Name and unit as they stand on an axis, for example ``BP [psi gauge]``."""
        suffix = "" if self.reference is Reference.NONE else f" {self.reference.value}"
        return f"{self.name} [{self.unit}{suffix}]"


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
                where=f"trace {self.name}, channel {names[column]}, sample {row}",
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

    def check_sizes(self, names: Sequence[str]) -> None:
        """Refuse channels whose squares are no numbers any more: no sum of squares, and so no fit, would be right.

        Args:
            names: The channels that are squared.

        Raises:
            ChannelError: If a channel is missing.
            TraceError: If the largest magnitude of one is neither 0 nor between 1e-150 and 1e150.
        """
        missing = [name for name in names if name not in self]
        if missing:
            raise ChannelError(missing, self.channel_names, where=f"trace {self.name}")
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

    def __getitem__(self, channel: str) -> NDArray[np.float64]:
        return self.values[:, self.index(channel)]

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
        sha.update(self.values.tobytes())
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
        missing = [name for name in names if name not in self.channel_names]
        if missing:
            raise ChannelError(missing, self.channel_names, where=f"trace {self.name}")
        return np.ascontiguousarray(self.values[:, [self.index(name) for name in names]])


@dataclass(frozen=True, kw_only=True, eq=False)
class TraceSet:
    """Named traces with a role each.

    Args:
        name: Name of the data set.
        traces: The experiments; all share sample time and channels.
        roles: Role of each trace, by name; those not named are for validation.
        source: How the traces came to be, for people (a command, a file, a rig).

    Raises:
        TraceError: If names repeat, a role names no trace, or sample times or channels differ.
    """

    name: str
    traces: tuple[Trace, ...]
    roles: Mapping[str, Role] = field(default_factory=dict)
    source: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "traces", tuple(self.traces))
        object.__setattr__(
            self, "roles", {t.name: self.roles.get(t.name, Role.VALIDATION) for t in self.traces} | dict(self.roles)
        )
        if not self.traces:
            raise TraceError("the trace set is empty", where=f"data set {self.name}", remedy="give at least one trace")
        names = self.names
        if len(set(names)) != len(names):
            raise TraceError(
                "two traces have the same name",
                where=f"data set {self.name}",
                expected="a different name for each trace",
                got=", ".join(names),
                remedy="rename one of them",
            )
        strangers = sorted(set(self.roles) - set(names))
        if strangers:
            raise TraceError(
                f"a role is given to {', '.join(strangers)}, which is not in the set",
                where=f"data set {self.name}",
                expected=f"one of {', '.join(names)}",
                got=", ".join(strangers),
                remedy=did_you_mean(strangers[0], names, "correct the name in roles"),
            )
        first = self.traces[0]
        for trace in self.traces[1:]:
            self._check_alike(first, trace)

    def _check_alike(self, first: Trace, other: Trace) -> None:
        if not np.isclose(first.sample_time, other.sample_time, rtol=1e-9, atol=0.0):
            raise TraceError(
                "the traces have different sample times",
                where=f"data set {self.name}, trace {other.name}",
                expected=f"{first.sample_time:g} s as in {first.name}",
                got=f"{other.sample_time:g} s",
                remedy="resample them to one sample time at ingest",
            )
        ours, theirs = ([(c.name, c.unit, c.reference) for c in t.channels] for t in (first, other))
        if ours != theirs:
            raise TraceError(
                "the traces have different channels",
                where=f"data set {self.name}, trace {other.name}",
                expected=", ".join(channel.label for channel in first.channels),
                got=", ".join(channel.label for channel in other.channels),
                remedy="choose the same channels, in the same units, for every trace",
            )

    def __len__(self) -> int:
        return len(self.traces)

    def __repr__(self) -> str:
        first, samples = self.traces[0], sum(map(len, self.traces))
        roles = ", ".join(f"{len(ours)} {role.value}" for role in Role if (ours := self.with_role(role)))
        channels = ", ".join(channel.label for channel in first.channels)
        return f"<TraceSet {self.name}: {roles}; {samples:,} samples of {first.sample_time:g} s; {channels}>"

    def __iter__(self) -> Iterator[Trace]:
        return iter(self.traces)

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __getitem__(self, name: str) -> Trace:
        for trace in self.traces:
            if trace.name == name:
                return trace
        raise TraceError(
            f"no trace named {name}",
            where=f"data set {self.name}",
            expected=f"one of {', '.join(self.names)}",
            got=name,
            remedy=did_you_mean(name, self.names, "correct the name of the case"),
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the traces, in order."""
        return tuple(trace.name for trace in self.traces)

    @property
    def sample_time(self) -> float:
        """Seconds between samples, the same for every trace."""
        return self.traces[0].sample_time

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels that every trace has."""
        return self.traces[0].channels

    @property
    def digest(self) -> str:
        """SHA-256 over names, roles and the digests of the traces."""
        parts = [[t.name, self.roles[t.name].value, t.digest] for t in self.traces]
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()

    @property
    def shared(self) -> tuple[tuple[str, str], ...]:
        """Cases that choose or are scored and have samples of one that is fitted, with the name of that one.

        Found where both have the same values at the same times, be it by a copy or by two cuts of one record.
        """
        fitted = self.with_role(Role.ESTIMATION)
        scored = self.with_role(Role.SELECTION, Role.VALIDATION, Role.TEST)
        pairs = ((one, next((other for other in fitted if _share_samples(one, other)), None)) for one in scored)
        return tuple((one.name, other.name) for one, other in pairs if other is not None)

    def with_role(self, *roles: Role) -> tuple[Trace, ...]:
        """The traces that have one of these roles, in order."""
        return tuple(trace for trace in self.traces if self.roles[trace.name] in roles)


def _share_samples(one: Trace, other: Trace) -> bool:
    """Whether two records have the same values where their times overlap, and these are no constants."""
    later = round((other.start_time - one.start_time) / one.sample_time)
    mine, theirs = one.values[max(later, 0) :], other.values[max(-later, 0) :]
    n = min(len(mine), len(theirs))
    return n > 1 and np.array_equal(mine[:n], theirs[:n]) and bool((np.ptp(mine[:n], axis=0) > 0.0).any())


def converter_step(values: NDArray[np.float64]) -> float | None:
    """The step of a converter, where all values are multiples of one.

    Args:
        values: Finite, shape ``(n,)``.

    Returns:
        The step, in the values' unit; ``None`` where they have none, or are too few to say.

    Example:
        >>> converter_step(np.round(np.sin(np.arange(200.0)) / 0.1) * 0.1).__round__(9)
        0.1
    """
    apart = np.diff(np.unique(values)) if len(values) >= 20 else np.empty(0)
    apart = apart[apart > ROUNDING * apart.sum()]
    if not 0 < len(apart) <= 0.7 * len(values) or apart.sum() / FEW_STEPS < apart.min():
        return None
    count = apart / apart.min()
    return float(apart.min()) if np.mean(np.abs(count - np.round(count)) < 0.05) > EVEN else None


def coarse_step(values: NDArray[np.float64]) -> float | None:
    """The step of a converter that is coarse: a signal that moves by less from sample to sample shows its steps.

    Args:
        values: Neighbouring samples, finite, shape ``(n,)``.

    Returns:
        The step, in the values' unit; ``None`` where it is fine, or the signal goes several steps at a time, as
        commands do.
    """
    step = converter_step(values)
    if step is None:
        return None
    moves = np.abs(np.diff(values))
    one_by_one = np.median(moves[moves > 0.5 * step]) < 1.5 * step
    shown = step**2 > np.mean(moves**2) and step > VISIBLE * float(values.std())
    return step if one_by_one and shown else None


def check_units(units: Mapping[str, str], trace: Trace) -> None:
    """Refuse a record whose numbers would be taken for others.

    Args:
        units: The unit of each channel that is read, of which the record may lack some.
        trace: The record.

    Raises:
        ConfigError: If a channel is in another unit.
    """
    there = {channel.name: channel.unit for channel in trace.channels}
    for name, unit in units.items():
        if name in there and not is_same_unit(there[name], unit):
            raise ConfigError(
                "the record has a channel in another unit than the model",
                where=f"trace {trace.name}, channel {name}",
                expected=unit,
                got=there[name],
                remedy=f"read it in {unit}: the channel's unit in a dataset.yaml converts it; sysid.data takes numbers "
                f"as they are, so bring them to {unit} first and say units={{{name!r}: {unit!r}}}",
            )
