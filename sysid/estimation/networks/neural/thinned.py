r"""Records that are sampled much faster than they move: starts are raced on low-passed records of fewer samples.

A structure that is shaken from 2 to 15 Hz and sampled at 400 Hz says in 80 samples a second all that it says in 400. An
iteration over these costs a fifth; and steps between neighbouring samples are no longer so small that the poles of all
modes crowd about one, where matrices are nearly those of a chain of sums. So the linear model and all starts see every
so-manieth sample of low-passed records. What is chosen is then made a
model at the records' own rate (``finer.py``). From there on the model is
trained over all samples, so that nothing of the records is left out of what is found in the end.

Limits: what an output does beyond the band in which the inputs lie, as a joint that rattles, is seen by the last
iterations alone. A state that sums up its inputs for ever has no place between samples: such models are not begun so.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.networks.neural.finer import HALF_WIDTH, finer, taps
from sysid.estimation.networks.training import Training
from sysid.estimation.results.result import FitResult, Status
from sysid.models import Mapping, Start, StartKind
from sysid.traces import Trace

Array = NDArray[np.float64]

LONG, LEAST = 20_000, 200
"""Samples of all records together from which on they are thinned without being asked, as an iteration is cheap below;
and samples of each that have to be left."""

INPUT_BEYOND, OUTPUT_BEYOND = 1e-4, 0.02
"""Share of a channel's variance that may lie beyond the band that is kept. Outputs may have more: noise, and what the
last iterations see."""

HARMONICS = 2.5
"""Times the inputs' band that is kept: a curve answers a frequency at twice and three times it."""

MOST = 16
"""Every so-manieth sample at most."""

SHARE = 0.6
"""Of a fit's time that goes by thinned records."""

NOTHING = (
    "What was found on every {nth} sample of low-passed records is no model of all samples, and was not gone on with."
)
"""What is said where a fit has to begin anew."""

ITERATIONS, PATIENCE = 60, 6
"""Iterations over all samples at most, which begin near a minimum; and over how many of them progress is judged."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Thinned:
    """Every so-manieth sample of some records.

    Args:
        every: That number, 2 or more.
        given: What is fitted, by name.
        training: How.
        sparse: Of ``given`` what is another thing for thinned records.
    """

    every: int
    given: Dict[str, Any]
    training: Training
    sparse: Dict[str, Any]

    @classmethod
    def of(cls, given: Dict[str, Any], training: Training) -> Thinned | None:
        """Thin the records of a fit, where that is worth it.

        Args:
            given: What is fitted and what chooses, by the names of
                :func:`sysid.estimation.networks.neural.state_space.fit_neural_state_space`.
            training: Whose ``thin`` says by how much; by default as the records' band allows.

        Returns:
            What starts are raced on; ``None`` where all samples are.
        """
        traces, mapping, start = given["traces"], given["mapping"], given["start"]
        every = training.thin or band_allows(traces, mapping)
        every = min(every, max(min(map(len, (*traces, *given["selection"]))) // LEAST, 1))
        # What is united is not trained any more; a state that sums up its inputs has no place between samples.
        if every == 1 or training.ensemble > 1 or given["network"].integrators:
            return None
        held = start.kind in {StartKind.REST, StartKind.FIRST_SAMPLE}
        sparse = {
            name: tuple(thinned(trace, mapping, every, held=held) for trace in given[name])
            for name in ("traces", "selection")
        }
        # Few samples of these would show no state.
        begins = start if held else Start(kind=StartKind.ESTIMATED)
        return cls(every=every, given=given, training=training, sparse={**sparse, "start": begins, "vet": None})

    def fit(self, one: Callable[..., FitResult]) -> FitResult:
        """Fit thinned records, then all samples from there.

        Args:
            one: Fits what it is given by these names, and how it is trained.

        Returns:
            The fit to all samples.
        """
        limit = self.training.max_time_s
        own = replace(self.training, thin=1, stable=self.training.stable is not False)
        first = one(**{**self.given, **self.sparse}, training=replace(own, max_time_s=SHARE * limit))
        later = replace(own, max_time_s=max(limit - first.train_time_s, 0.0))
        model: Any = first.model
        form = finer(model.recursion, self.sparse["traces"], self.given["traces"], model.mapping, self.every)
        if form is None:
            found = one(**self.given, training=later)
            took = first.train_time_s + found.train_time_s
            return replace(found, notes=(*found.notes, NOTHING.format(nth=_nth(self.every))), train_time_s=took)
        interrupted = first.status is Status.INTERRUPTED
        limits = replace(
            later,
            starts=1,
            max_iterations=min(ITERATIONS, later.max_iterations),
            patience=min(PATIENCE, later.patience),
            max_time_s=0.0 if interrupted else later.max_time_s,
        )
        begun = replace(model, theta=form.theta, sample_time=model.sample_time / self.every)
        found = self.told(one(**self.given, training=limits, initial=replace(first, model=begun)), first)
        return replace(found, status=Status.INTERRUPTED) if interrupted else found

    def told(self, found: FitResult, first: FitResult) -> FitResult:
        """The fit that says what it began with.

        Args:
            found: The fit to all samples.
            first: That to thinned records.

        Returns:
            The fit, which has taken the time of both.
        """
        starts = len({one.start for one in first.attempts})
        what = f"{starts} starts were" if starts > 1 else "It was first"
        note = f"{what} trained on every {_nth(self.every)} sample of low-passed records, which move slowly beside \
their sample time; what was chosen was trained on over all samples (`thin: 1` trains on all of them throughout)."
        return replace(
            found, notes=(*first.notes, note, *found.notes), train_time_s=first.train_time_s + found.train_time_s
        )


def _nth(number: int) -> str:
    return {2: "second", 3: "third"}.get(number, f"{number}th")


def band_allows(traces: Sequence[Trace], mapping: Mapping) -> int:
    """Every so-manieth sample of which says what all of them say.

    Args:
        traces: The records.
        mapping: Which channels go in, which come out.

    Returns:
        The number, 1 for records that are short, that jump, or that have no inputs.
    """
    if sum(map(len, traces)) < LONG or not mapping.inputs:
        return 1
    band = max(HARMONICS * beyond(traces, name, INPUT_BEYOND) for name in mapping.inputs)
    band = max(band, *(beyond(traces, name, OUTPUT_BEYOND) for name in mapping.outputs))
    return max(1, int(1.0 / max(band, 1.0 / MOST)))


def beyond(traces: Sequence[Trace], name: str, share: float) -> float:
    """The frequency beyond which no more than a share of a channel's variance lies, in half sampling rates.

    Args:
        traces: The records.
        name: The channel.
        share: Of its variance over all of them.

    Returns:
        The frequency, 0 to 1.
    """
    edges = np.linspace(0.0, 1.0, 257)
    power = np.zeros(len(edges) - 1)
    for trace in traces:
        values = _filled(trace, name)
        values = (values - np.linspace(values[0], values[-1], len(values))) * np.hanning(len(values))
        spectrum = np.abs(np.fft.rfft(values)) ** 2
        power += np.histogram(np.linspace(0.0, 1.0, len(spectrum)), edges, weights=spectrum / len(values))[0]
    above = np.cumsum(power[::-1])[::-1]
    within = np.flatnonzero(above <= share * above[0])
    return float(edges[within[0]]) if len(within) else 1.0


def thinned(trace: Trace, mapping: Mapping, every: int, *, held: bool) -> Trace:
    """Every so-manieth sample of a trace, low-passed without delay.

    Args:
        trace: The trace.
        mapping: Whose channels are kept.
        every: That number.
        held: Whether its channels stood before it as at its first sample; else they go on as they begin.

    Returns:
        The trace; samples next to masked ones are masked.
    """
    columns = [_low_passed(_filled(trace, name), every, held=held)[::every] for name in mapping.channels]
    usable = trace.usable
    if usable is not None:
        each = (
            usable[:, None] if usable.ndim == 1 else usable[:, [trace.channel_names.index(n) for n in mapping.channels]]
        )
        near = np.ones(4 * every + 1)
        masked = [np.convolve(~column, near, mode="same")[::every] > 0.5 for column in each.T]
        usable = ~(masked[0] if len(masked) == 1 else np.column_stack(masked))
    return replace(
        trace,
        sample_time=every * trace.sample_time,
        channels=tuple(trace.channel(name) for name in mapping.channels),
        values=np.column_stack(columns),
        usable=usable,
        weights=None if trace.weights is None else trace.weights[::every],
    )


def _filled(trace: Trace, name: str) -> Array:
    """A channel with what is masked bridged."""
    values, known = trace[name], trace.usable
    if known is None:
        return values
    known = known if known.ndim == 1 else known[:, trace.channel_names.index(name)]
    places = np.arange(len(values))
    return np.interp(places, places[known], values[known]) if known.any() else values


def _low_passed(values: Array, every: int, *, held: bool) -> Array:
    """One channel low-passed, of the same length."""
    half = min(HALF_WIDTH * every, len(values) - 1)
    before = np.full(half, values[0]) if held else 2.0 * values[0] - values[half:0:-1]
    after = 2.0 * values[-1] - values[-2 : -half - 2 : -1]
    return np.convolve(np.concatenate([before, values, after]), taps(every), mode="same")[half : half + len(values)]
