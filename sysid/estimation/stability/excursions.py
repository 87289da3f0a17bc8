"""Excursions of records: random sequences that a system might have been given, made of what it was given.

Passages of the records, in random order, each begun where the
record comes close to where the passage before ended, in level and in direction, of the inputs and of the outputs; the
matched-block bootstrap of Carlstein, Do, Hall, Hesterberg and Künsch 1998 ("Matched-block bootstrap for dependent
data", Bernoulli 4). What is left of a jump is led over the beginning of the next passage, and each passage runs
somewhat faster or slower than it was recorded. At the end the sequence follows a record to a plateau, a place where
inputs and outputs have stood still for long, and is held there as long: the output has to settle where it settled in
the record. Only plateaus at which a record also began are taken, where there are such: a system may hold an output that
depends on how its inputs got where they are, but whatever came before, it comes back to its rest.

An output that has stood elsewhere under the inputs of rest has none to come back to: what integrates stays where it is,
and where its run settles is not judged.

Limits: an excursion asks more than the system does: it passes joints, speeds and pairs of inputs that the system itself
would not. Its targets before the end are not what the system would have put out. Without a plateau at rest any plateau
is taken, and records without any can show that a run stays bounded, not where it settles.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError
from sysid.estimation.stability.sequences import AbstractSequences, InputSequence, plateaus
from sysid.kernels import passages
from sysid.kernels.arrays import read_only
from sysid.traces import Trace

AT_REST = 0.05
"""Share of a channel's range within which it is where a record began."""


KEPT = 0.1
"""Share of an output's range away from where records began at which it has stood under the same inputs: it stays."""


MOST_KEPT = 32_000_000
"""Bytes of the sequences of one set of records that are kept for further fits to it."""


CANDIDATES = 128
"""Places that are looked at for the next passage; the closest is taken. More of them make smaller jumps and fewer
different sequences."""


@lru_cache(maxsize=4)
def _kept(content: bytes, n_inputs: int, seed: int) -> dict[int, InputSequence]:
    """Sequences of the same records that were drawn before, by their number.

    Every fit of a pipeline is checked over the same ones, and its export again; to draw 1,000 takes longer than to run
    a linear model over them.
    """
    del content, n_inputs, seed
    return {}


@dataclass(frozen=True, kw_only=True, eq=False)
class Excursions(AbstractSequences):
    """Passages of records, joined where they match.

    Args:
        inputs: Names of the input channels.
        outputs: Names of the output channels.
        sample_time: Seconds between samples.
        records: Inputs and outputs side by side, each of shape ``(n_samples, n_inputs + n_outputs)``.
        samples: Length of a sequence before it is led to its plateau.
        passage: Shortest and longest passage, in samples.
        hold: Samples for which a record has to stand still on a plateau, and for which it is held at the end.
        warp: How many times faster or slower than recorded a passage may run.
        amplitude: How many times as far from the middle of their range as in the records inputs go. Beyond 1 nobody
            knows where the outputs stand, so that no plateau is judged.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    sample_time: float
    records: tuple[NDArray[np.float64], ...]
    samples: int
    passage: tuple[int, int]
    hold: int
    warp: float = 1.25
    amplitude: float = 1.0
    _features: NDArray[np.float64] = field(init=False, repr=False)
    _rows: NDArray[np.float64] = field(init=False, repr=False)
    _left: NDArray[np.int64] = field(init=False, repr=False)
    _firsts: NDArray[np.int64] = field(init=False, repr=False)
    _group: NDArray[np.int64] = field(init=False, repr=False)
    _to_plateau: NDArray[np.int64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        rows = np.ascontiguousarray(self.records[0] if len(self.records) == 1 else np.concatenate(self.records))
        span = np.ptp(rows, axis=0)
        scale = np.where(span > 0.0, span, 1.0)
        slopes, left, still = [], [], []
        begins = np.stack([record[0] for record in self.records])
        for record in self.records:
            n, step = len(record), max(1, self.passage[0] // 10)
            ahead = np.minimum(np.arange(n) + step, n - 1)
            slopes.append((record[ahead] - record) / scale)
            left.append(np.arange(n, 0, -1))
            still.append(plateaus(record / scale, self.hold))
        rest = [s & _near(record, begins, scale) for s, record in zip(still, self.records, strict=True)]
        ends = rest if any(flags.any() for flags in rest) else still
        if self._stays(still, begins, scale):
            ends = [np.zeros_like(flags) for flags in still]
        reach = [_next(flags) for flags in ends]
        firsts = np.cumsum([0, *(len(record) for record in self.records[:-1])])
        width = rows.shape[1]
        features = np.empty((len(rows), 2 * width))
        np.divide(rows, scale, out=features[:, :width])
        moves = np.concatenate(slopes, out=features[:, width:])
        del slopes
        largest = np.maximum(moves.max(axis=0), -moves.min(axis=0))
        moves /= np.where(largest > 0.0, 2.0 * largest, 2.0)
        object.__setattr__(self, "_rows", rows)
        object.__setattr__(self, "_features", features)
        object.__setattr__(self, "_left", np.concatenate(left))
        object.__setattr__(
            self,
            "_to_plateau",
            np.concatenate([np.where(r >= 0, r + f, -1) for r, f in zip(reach, firsts, strict=True)]),
        )
        object.__setattr__(self, "_firsts", firsts)
        object.__setattr__(self, "_group", self._groups())

    @cached_property
    def _content(self) -> bytes:
        """What the sequences depend on, beside their seed and number and which columns are inputs."""
        content = hashlib.blake2b(repr((self.samples, self.passage, self.hold, self.warp, self.amplitude)).encode())
        for record in self.records:
            content.update(repr(record.shape).encode())
            content.update(np.ascontiguousarray(record, dtype="<f8").data)
        return content.digest()

    @cached_property
    def _bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Least and greatest value of each column."""
        return self._rows.min(axis=0), self._rows.max(axis=0)

    @cached_property
    def _places(self) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """Of each group the rows at which a passage may begin, and those from which a plateau is reached."""
        found = []
        for group in range(int(self._group.max()) + 1):
            alike = self._group == group
            long = alike & (self._left > self.passage[0])
            long = long if long.any() else alike & (self._left > 1)
            found.append((np.flatnonzero(long), np.flatnonzero(alike & (self._to_plateau >= 0))))
        return found

    @cached_property
    def _fixed(self) -> list[int]:
        """Inputs that never move within a record: parameters of what was recorded, as a mass is."""
        return [j for j in range(len(self.inputs)) if all(np.ptp(record[:, j]) == 0.0 for record in self.records)]

    @cached_property
    def _moving(self) -> list[int]:
        """The other inputs."""
        return [j for j in range(len(self.inputs)) if j not in self._fixed]

    def _stays(self, still: list[NDArray[np.bool_]], begins: NDArray[np.float64], scale: NDArray[np.float64]) -> bool:
        """Whether an output has stood elsewhere than where a record began, the inputs being as they were there.

        What integrates, and friction that holds, leave an output where it is: there is no rest to come back to.
        """
        m = len(self.inputs)
        for record, stands in zip(self.records, still, strict=True):
            inputs = _near(record[:, :m], begins[:, :m], scale[:m])
            away = np.abs(record[:, np.newaxis, m:] - begins[:, m:]) > KEPT * scale[m:]
            if bool(np.any(stands & inputs & np.all(np.any(away, axis=2), axis=1))):
                return True
        return False

    def _groups(self) -> NDArray[np.int64]:
        """Of each row, with which others its passages may be joined: a parameter does not move within a sequence."""
        if not self._fixed:
            return np.zeros(len(self._rows), dtype=np.int64)
        return np.unique(self._rows[:, self._fixed], axis=0, return_inverse=True)[1].reshape(-1).astype(np.int64)

    @classmethod
    def of(
        cls, traces: Sequence[Trace], inputs: Sequence[str], outputs: Sequence[str], amplitude: float = 1.0
    ) -> Excursions:
        """The excursions of some traces, with lengths that go with theirs.

        Args:
            traces: At least one.
            inputs: Names of the input channels.
            outputs: Names of the output channels.
            amplitude: How many times as far from their middle as in the records inputs go.

        Returns:
            The source: sequences of a quarter of the longest trace and at most 5,000 samples, in passages of a
            hundredth to an eighth of it.

        Raises:
            ChannelError: If a trace lacks a channel.
            TraceError: If no trace has 20 usable samples in a row.
        """
        names = [*inputs, *outputs]
        records = tuple(part for trace in traces for part in usable_parts(trace, names))
        if not records:
            raise TraceError("no trace is long enough for excursions", expected="20 usable samples in a row")
        longest = max(len(record) for record in records)
        whole = max(len(trace) for trace in traces)  # a piece of a record stands still no sooner than the record
        return cls(
            inputs=tuple(inputs),
            outputs=tuple(outputs),
            sample_time=traces[0].sample_time,
            records=records,
            samples=min(max(longest // 4, 20), 5000),
            passage=(max(longest // 100, 2), max(longest // 8, 4)),
            hold=max(whole // 20, 20),
            amplitude=amplitude,
        )

    @property
    def source(self) -> str:
        """Where the sequences come from, as a sentence."""
        plateaus = "held on a recorded plateau in the end" if self.has_plateaus else "without a plateau to end on"
        return (
            f"Passages of {self.passage[0] * self.sample_time:g} to {self.passage[1] * self.sample_time:g} s of the "
            f"estimation traces, joined where they match, up to {self.warp:g} times faster or slower, {plateaus}"
            f"{f', inputs {self.amplitude:g} times as far from their middle' if self.amplitude != 1.0 else ''}."
        )

    @property
    def has_plateaus(self) -> bool:
        """Whether the records stand still anywhere."""
        return bool((self._to_plateau >= 0).any())

    @property
    def output_range(self) -> NDArray[np.float64]:
        """Least and greatest value of each output in the records, shape ``(2, n_outputs)``."""
        outputs = self._rows[:, len(self.inputs) :]
        return np.stack([outputs.min(axis=0), outputs.max(axis=0)])

    def draw(self, count: int, seed: int) -> Iterator[InputSequence]:
        """The sequences; each depends on the seed and its own number alone."""
        low, high = self._bounds
        m = len(self.inputs)
        middle = (low[self._moving] + high[self._moving]) / 2.0
        kept = _kept(self._content, m, seed)
        for number in range(count):
            if number in kept:
                yield kept[number]
                continue
            rows, held = self._sequence(np.random.default_rng([seed, number]))
            rows[:, self._fixed] = rows[0, self._fixed]  # to the last bit, whatever interpolation has rounded
            if self.amplitude != 1.0:
                rows[:, self._moving] = middle + self.amplitude * (rows[:, self._moving] - middle)
            judged = np.zeros(len(rows), dtype=bool)
            if held and self.amplitude == 1.0:
                judged[len(rows) - max(1, held // 10) :] = True
            for array in (rows, judged):
                array.setflags(write=False)
            drawn = InputSequence(name=f"sequence {number + 1}", inputs=rows[:, :m], targets=rows[:, m:], judged=judged)
            if (len(kept) + 1) * rows.nbytes <= MOST_KEPT:
                kept[number] = drawn
            yield drawn

    def _sequence(self, rng: np.random.Generator) -> tuple[NDArray[np.float64], int]:
        """Rows of inputs and outputs, and how many of them at the end are held."""
        at = int(self._firsts[rng.integers(0, len(self._firsts))])
        # Of each passage the row, how many rows it goes over and at which steps, its samples, and whether it is led.
        parts: list[tuple[int, float, float, int, bool]] = []
        total = 0
        long, ends = self._places[self._group[at]]
        while total < self.samples:
            if parts:
                at = self._match(rng, at, long)
            faster = self.warp ** rng.uniform(-1.0, 1.0)
            span = min(int(rng.integers(*self.passage)) * faster, int(self._left[at]) - 1)
            count = max(2, round(span / faster))
            parts.append((at, span, span / (count - 1), count, bool(parts)))
            at += int(span)
            total += count
        if not len(ends):
            return self._joined(parts), 0
        at = self._match(rng, at, ends)
        rest = int(self._to_plateau[at])
        # At least so long a way that the plateau is reached from the record, and not by the leading over.
        way = max(rest + 1 - at, 2 * self.passage[0])
        parts += [(at, rest - at, 1.0, way, True), (rest, 0.0, 0.0, self.hold, False)]
        return self._joined(parts), self.hold

    def _match(self, rng: np.random.Generator, end: int, places: NDArray[np.int64]) -> int:
        """Of some places one like that where a passage ended, but not that one."""
        drawn = places[rng.integers(0, len(places), CANDIDATES)]
        return int(passages.closest(self._features, drawn, end, self.passage[0]))

    def _joined(self, parts: list[tuple[int, float, float, int, bool]]) -> NDArray[np.float64]:
        """The passages side by side, within the bounds of the records."""
        at, span, step, count, led = zip(*parts, strict=True)
        rows = np.empty((sum(count), self._rows.shape[1]))
        lengths = np.array(span, dtype=np.float64), np.array(step, dtype=np.float64)
        passages.joined(
            read_only(self._rows), np.array(at), *lengths, np.array(count), np.array(led), self.passage[0],
            *self._bounds, rows,
        )  # fmt: skip
        return rows


def usable_parts(trace: Trace, names: Sequence[str]) -> list[NDArray[np.float64]]:
    """Stretches without gaps, long enough to take passages from.

    Args:
        trace: A record.
        names: Channels, in the order of the columns.

    Returns:
        Each of shape ``(n_samples, len(names))``, of 20 samples at least.
    """
    columns, usable = trace.columns(names), trace.usable_samples
    edges = np.flatnonzero(np.diff(np.concatenate([[0], usable.astype(np.int8), [0]])))
    return [columns[a:b] for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= 20]


def _near(record: NDArray[np.float64], places: NDArray[np.float64], scale: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Samples at which every column is near one of some places."""
    near = [np.all(np.abs(record - place) <= AT_REST * scale, axis=1) for place in places]
    return np.asarray(np.any(near, axis=0))


def _next(flags: NDArray[np.bool_]) -> NDArray[np.int64]:
    """For each sample the position of the next one that is flagged, itself included; -1 where there is none."""
    n = len(flags)
    following = np.where(flags, np.arange(n), n)
    nearest = np.minimum.accumulate(following[::-1])[::-1]
    return np.asarray(np.where(nearest < n, nearest, -1))
