"""One record as an estimator sees it: inputs, output, what came before, and what each sample counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError
from sysid.models import (
    AbstractModel,
    Beginning,
    History,
    Lags,
    Mapping,
    Scaling,
    Start,
    StartKind,
    VectorScaling,
    beginning,
)
from sysid.models.channels.history import bridged
from sysid.models.contract.beginning import window
from sysid.traces import Trace


@dataclass(frozen=True, kw_only=True, eq=False)
class Experiment:
    """One record as an estimator sees it.

    Args:
        inputs: Shape ``(n_samples, n_inputs)``, in the channels' units.
        output: Measured output, shape ``(n_samples,)``, or ``(n_samples, n_outputs)`` for a model of several outputs.
        history: The samples before the first.
        weights: Weight of each squared residual, shape ``(n_samples,)``; zero where a sample does not count.
            ``None`` for all ones.
        usable: Which samples are not masked, shape ``(n_samples,)``; ``None`` for all.
        past: Which samples of the history are measured and not masked, shape ``(n_past,)``; nothing is known of what
            came before them. ``None`` where the history is declared: the system had stood there for ever.
        n_first: Samples, those of a measured history included, on which the state before the record is estimated when
            a free run over it is scored; 0 where none is.
        each: Weight of each squared residual of each output, shape ``(n_samples, n_outputs)``, where some outputs count
            in samples in which others do not; who cannot tell them apart goes by ``weights``, where none does.
    """

    inputs: NDArray[np.float64]
    output: NDArray[np.float64]
    history: History
    weights: NDArray[np.float64] | None = None
    usable: NDArray[np.bool_] | None = None
    past: NDArray[np.bool_] | None = None
    n_first: int = 0
    each: NDArray[np.float64] | None = None

    @classmethod
    def from_trace(
        cls, trace: Trace, mapping: Mapping, start: Start, rest_output: float | NDArray[np.float64]
    ) -> Experiment:
        """The record of one trace.

        Args:
            trace: The trace.
            mapping: Which channels go in, which comes out.
            start: Where its history comes from.
            rest_output: Output at rest; an array, one value an output, for a model of several outputs.

        Returns:
            The experiment, without the samples that became history. For an estimated start it is the whole record,
            before which nothing is known.

        Raises:
            ChannelError: If the trace lacks a channel of the mapping.
            TraceError: If the trace is not longer than a measured start.
        """
        inputs, output = trace.columns(mapping.inputs), trace.columns(mapping.outputs)
        if not isinstance(rest_output, np.ndarray):
            mapping.check_single()
            output = output[:, 0]
        trace, each = trace.seen_by(mapping.channels), _each(trace, mapping)
        history = replace(start.history(inputs, output, rest_output, trace.usable_samples), case=trace.name)
        n = start.n_measured
        if start.kind is StartKind.ESTIMATED:
            begun = Beginning(history=history, first=0)
            whole = cls._of(trace, inputs, output, begun, past=np.zeros(1, dtype=np.bool_), each=each)
            return replace(whole, n_first=window(1, trace.usable_samples, inputs, asked=n))
        past = trace.usable_samples[:n] if n else None
        return replace(
            cls._of(trace, inputs, output, Beginning(history=history, first=n), past=past, each=each), n_first=n
        )

    @classmethod
    def for_model(cls, trace: Trace, model: AbstractModel, start: Start) -> Experiment:
        """The record of one trace as the free run of a model goes over it, from where that begins.

        Args:
            trace: The trace.
            model: The model, whose initial state is estimated where the start says so.
            start: Where its history comes from.

        Returns:
            The experiment, without the samples before the first that is scored.

        Raises:
            ChannelError: If the trace lacks a channel of the model's mapping.
            TraceError: If the trace is not longer than a measured start.
        """
        inputs, output = trace.columns(model.mapping.inputs), model.measured(trace)
        trace, each = trace.seen_by(model.mapping.channels), _each(trace, model.mapping)
        begun = beginning(model, inputs, output, start, trace.usable_samples, case=trace.name)
        past = trace.usable_samples[: begun.first] if begun.first else None
        return cls._of(trace, inputs, output, begun, past=past, each=each)

    @classmethod
    def _of(
        cls,
        trace: Trace,
        inputs: NDArray[np.float64],
        output: NDArray[np.float64],
        begun: Beginning,
        *,
        past: NDArray[np.bool_] | None,
        each: NDArray[np.bool_] | None,
    ) -> Experiment:
        n, whole = begun.first, trace.usable_samples
        usable = whole[n:]
        weights = None if usable.all() else usable.astype(np.float64)
        if trace.weights is not None:
            weights = usable * trace.weights[n:]
        counts = np.ones(1) if trace.weights is None else trace.weights[n:]
        return cls(
            inputs=inputs[n:],
            output=bridged(output, whole if each is None else each)[n:],
            history=begun.history,
            weights=weights,
            usable=None if usable.all() else usable,
            past=past,
            each=None if each is None else each[n:] * counts[:, None],
        )

    @property
    def free(self) -> bool:
        """Whether the state before the record is estimated: nothing was declared of what came before it."""
        return self.past is not None

    @property
    def begun_anywhere(self) -> Experiment:
        """The same record with nothing declared of what came before it: what integrates has no equilibrium there."""
        return self if self.free else replace(self, past=np.zeros(1, dtype=np.bool_))

    def from_measured(self, lags: Lags) -> Experiment:
        """The same record from where all lags of a row are in it, its first samples being the history.

        Args:
            lags: What a row looks at.

        Returns:
            The record; as it is where its history is declared or measured.

        Raises:
            TraceError: If the record is no longer than the lags.
        """
        n = max(lags.depth, 1)
        if self.past is None or self.past.any():
            return self
        if len(self.output) <= n:
            raise TraceError(
                "the record is too short for its lags",
                expected=f"more than {n} samples",
                got=f"{len(self.output)} samples",
                remedy="use fewer or shorter lags, or a longer record",
            )
        usable = np.ones(len(self.output), dtype=np.bool_) if self.usable is None else self.usable
        return Experiment(
            inputs=self.inputs[n:],
            output=self.output[n:],
            history=History(inputs=self.inputs[:n], output=self.output[:n]),
            weights=None if self.weights is None else self.weights[n:],
            usable=None if self.usable is None else self.usable[n:],
            past=usable[:n],
            each=None if self.each is None else self.each[n:],
        )

    def one_step(self, lags: Lags) -> Experiment:
        """The same record as rows that are fitted one step ahead see it.

        A row that looks at a sample which is masked, or which came before the record and was not declared, does not
        count: what stands there is a filling, and nobody's regressor.

        Args:
            lags: What a row looks at.

        Returns:
            The record with the weights of its rows.
        """
        known = self.known_rows(lags.depth, {*lags.output, *(lag for of in lags.inputs for lag in of)})
        if known.all():
            return self
        each = None if self.each is None else self.each * known[:, np.newaxis]
        return replace(self, weights=self._weighted(known), each=each)

    def _weighted(self, known: NDArray[np.bool_]) -> NDArray[np.float64]:
        weights = np.ones(len(known)) if self.weights is None else self.weights
        return np.where(known, weights, 0.0)

    def known_rows(self, depth: int, lags: set[int]) -> NDArray[np.bool_]:
        """Rows whose samples at some lags are measured, or declared to have stood there before the record.

        Args:
            depth: The longest lag of any row.
            lags: In samples.

        Returns:
            Shape ``(n_samples,)``.
        """
        n = len(self.output)
        usable = np.ones(n, dtype=np.bool_) if self.usable is None else self.usable
        past = np.ones(depth, dtype=np.bool_) if self.past is None else np.concatenate([np.zeros(depth), self.past])
        known = np.concatenate([past[len(past) - depth :].astype(np.bool_), usable])
        rows = np.ones(n, dtype=np.bool_)
        for lag in lags:
            rows &= known[depth - lag : depth - lag + n]
        return rows

    @property
    def past_weights(self) -> NDArray[np.float64]:
        """Weights of the history's samples where they are fitted too: zero for those that are masked."""
        return np.ones(len(self.history.output)) if self.past is None else self.past.astype(np.float64)

    @property
    def n_counted(self) -> int:
        """Samples that count."""
        return len(self.output) if self.weights is None else int(np.count_nonzero(self.weights))


def experiments_of(
    traces: Sequence[Trace], mapping: Mapping, start: Start, rest_output: float | NDArray[np.float64]
) -> tuple[Experiment, ...]:
    """The experiments of several traces.

    Args:
        traces: The traces; never concatenated.
        mapping: Which channels go in, which comes out.
        start: Where each history comes from.
        rest_output: Output at rest, as for :meth:`Experiment.from_trace`.

    Returns:
        One experiment per trace.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        TraceError: If a trace is not longer than a measured start, or has values that cannot be squared.
    """
    for trace in traces:
        trace.check_sizes([*mapping.inputs, *mapping.outputs])
    return tuple(Experiment.from_trace(trace, mapping, start, rest_output) for trace in traces)


def unit_range(experiments: Sequence[Experiment]) -> Scaling:
    """The scaling that maps what the samples range over, but for masked ones, onto -1 to 1.

    Args:
        experiments: The records, of one output.

    Returns:
        The scaling.
    """
    seen = [(e.inputs, e.output) if e.usable is None else (e.inputs[e.usable], e.output[e.usable]) for e in experiments]
    kept = [pair for pair in seen if len(pair[1])] or [(e.inputs, e.output) for e in experiments]
    return Scaling.to_unit_range([inputs for inputs, _ in kept], [output for _, output in kept])


def unit_ranges(experiments: Sequence[Experiment]) -> VectorScaling:
    """The same for records of several outputs.

    Args:
        experiments: The records, whose outputs have columns.

    Returns:
        The scaling.
    """
    each = [[replace(e, output=e.output[:, at]) for e in experiments] for at in range(experiments[0].output.shape[1])]
    return VectorScaling.of([unit_range(of_one) for of_one in each])


def _each(trace: Trace, mapping: Mapping) -> NDArray[np.bool_] | None:
    """Which samples count for each output, where outputs differ in that, shape ``(n_samples, n_outputs)``."""
    counts = trace.counted(mapping.inputs, mapping.outputs)
    return None if (counts == counts[:, :1]).all() else counts
