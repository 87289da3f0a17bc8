"""Records as linear estimators with hidden states see them: scaled, with what is known of their beginning."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.records.experiment import Experiment, unit_range
from sysid.models import Scaling

Array = NDArray[np.float64]


SLOWER, LEAST_ROWS = (5, 20), 100
"""Samples whose means a record that is sampled fast is looked at by; and how many of these there have to be."""


def blocks_of(signal: Array, every: int) -> Array:
    """A signal in blocks of so many samples, shape ``(n_samples // every, every, ...)``; what is left over goes."""
    n = len(signal) // every
    return signal[: n * every].reshape(n, every, *signal.shape[1:])


def means_of(signal: Array, every: int) -> Array:
    """The mean of each of those blocks."""
    return np.asarray(blocks_of(signal, every).mean(axis=1))


@dataclass(frozen=True, kw_only=True, eq=False)
class Segment:
    """An unbroken piece of a record, in scaled numbers.

    Args:
        inputs: Shape ``(n_samples, n_inputs)``.
        outputs: Shape ``(n_samples, n_outputs)``.
        root_weights: Square root of each sample's weight, shape ``(n_samples,)``.
        rest: Inputs and outputs that stood before the first sample, shapes ``(n_inputs,)`` and ``(n_outputs,)``;
            ``None`` where nothing is known of what came before, so that the initial state is estimated.
    """

    inputs: Array
    outputs: Array
    root_weights: Array
    rest: tuple[Array, Array] | None = None

    def __len__(self) -> int:
        """Samples."""
        return len(self.outputs)

    def first(self, n: int) -> Segment:
        """Its first samples."""
        at = slice(0, n)
        return replace(
            self, inputs=self.inputs[at], outputs=self.outputs[at], root_weights=self.root_weights[at]
        )  # fmt: skip

    def means(self, every: int) -> Segment:
        """The piece as if it had been sampled more slowly, each sample the mean of so many."""
        return replace(
            self,
            inputs=means_of(self.inputs, every),
            outputs=means_of(self.outputs, every),
            root_weights=blocks_of(self.root_weights, every).min(axis=1),
        )

    def delayed(self, shifts: Sequence[int], *, unknown: int, masked: bool) -> Segment:
        """The piece with inputs that come later; see :func:`delayed_inputs`.

        Args:
            shifts: By how many samples each input is late.
            unknown: First samples that are left out where nothing is known of what came before: those whose input
                stood there.
            masked: Whether a sample whose input was masked counts no more than that input.

        Returns:
            The piece, without samples where it is no longer than that.
        """
        if not any(shifts) and not unknown:
            return self
        held = self.inputs[0] if self.rest is None else self.rest[0]
        roots, at = self.root_weights, slice(unknown if self.rest is None else 0, None)
        for k in set(shifts) if masked else ():
            seen = np.concatenate([np.ones(min(k, len(roots))), roots[: max(len(roots) - k, 0)]]) > 0.0
            roots = np.where(seen, roots, 0.0)
        late = delayed_inputs(self.inputs, held, shifts)
        return replace(self, inputs=late[at], outputs=self.outputs[at], root_weights=roots[at])

    @property
    def whole(self) -> bool:
        """Whether every sample counts."""
        return bool((self.root_weights > 0.0).all())

    def pieces(self) -> list[Segment]:
        """The stretches between samples that do not count, each with a state of its own where it begins after one."""
        if self.whole:
            return [self]
        counts = np.concatenate([[False], self.root_weights > 0.0, [False]])
        edges = np.flatnonzero(counts[1:] != counts[:-1])
        found = []
        for first, last in edges.reshape(-1, 2):
            at = slice(int(first), int(last))
            rest = self.rest if first == 0 else None
            piece = replace(
                self, inputs=self.inputs[at], outputs=self.outputs[at], root_weights=self.root_weights[at], rest=rest
            )
            found.append(piece)
        return found


TORN = 0.05
"""Part of the samples that first states of stretches between masked samples may take before it is told."""


def torn(segments: Sequence[Segment], states: int, *, records: int) -> tuple[str, ...]:
    """What many first states do to a model of the noise: one of each record or unmasked stretch.

    Args:
        segments: The stretches.
        states: Of the model.
        records: How many records they are parts of.

    Returns:
        One sentence where these states are many beside the samples; none elsewhere.
    """
    count, free = sum(map(len, segments)), sum(one.rest is None for one in segments)
    if free < 2 or free * states <= TORN * count * segments[0].outputs.shape[1]:
        return ()
    each = f"of some {count / free:.3g} samples, and each has {states} numbers of its own for its first state"
    if len(segments) <= records:
        return (f"These are {free} records {each}: coefficients lean by more than their intervals say. Record longer.",)
    return (
        f"Masked samples part these records into {free} stretches {each}: coefficients lean by more than their "
        "intervals say. Fill single samples (repairs: {nan: interpolate}), or fit a structure without a model of the "
        "noise (OE, TF), whose run goes on through masked samples.",
    )


def delayed_inputs(inputs: Array, held: Array, shifts: Sequence[int]) -> Array:
    """Inputs that come later.

    Args:
        inputs: Shape ``(n_samples, n_inputs)``.
        held: What each had always been before, shape ``(n_inputs,)``.
        shifts: By how many samples each is late.

    Returns:
        Shape ``(n_samples, n_inputs)``.

    Example:
        >>> delayed_inputs(np.array([[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]), np.array([0.0, 9.0]), (0, 2)).T.tolist()
        [[1.0, 2.0, 3.0], [9.0, 9.0, 1.0]]
    """
    n = len(inputs)
    columns = [np.concatenate([np.full(min(k, n), held[j]), inputs[: max(n - k, 0), j]]) for j, k in enumerate(shifts)]
    return np.column_stack(columns) if columns else inputs


def scaling_of(experiments: Sequence[Experiment], *, constant: bool) -> Scaling:
    """The scaling of a linear model.

    Args:
        experiments: The records.
        constant: Whether a constant output is fitted, or left open by an integrator. Where it is not, nothing may be
            taken away from inputs and outputs: zero has to stay zero.

    Returns:
        The range of each channel onto -1 to 1, or without its offsets.
    """
    found = unit_range(experiments)
    return found if constant else replace(found, input_offset=(0.0,) * len(found.input_offset), output_offset=0.0)


def segments_of(experiments: Sequence[Experiment], scaling: Scaling) -> tuple[Segment, ...]:
    """Experiments of one output as segments.

    Args:
        experiments: The records.
        scaling: Between units and scaled numbers.

    Returns:
        One segment a record, its measured history put before it.
    """
    return tuple(_segment(experiment, scaling) for experiment in experiments)


def side_by_side(each: Sequence[Sequence[Segment]]) -> tuple[Segment, ...]:
    """Segments of several outputs from those of each.

    Args:
        each: For each output the segments of the same records.

    Returns:
        One segment a record.
    """
    return tuple(_joined(parts) for parts in zip(*each, strict=True))


def _joined(parts: Sequence[Segment]) -> Segment:
    rests = [part.rest for part in parts if part.rest is not None]
    rest = (rests[0][0], np.concatenate([outputs for _, outputs in rests])) if rests else None
    return replace(parts[0], outputs=np.concatenate([part.outputs for part in parts], axis=1), rest=rest)


def _segment(experiment: Experiment, scaling: Scaling) -> Segment:
    inputs, output = experiment.inputs, experiment.output
    weights = np.ones(len(output)) if experiment.weights is None else experiment.weights
    if experiment.past is not None and experiment.past.any():
        inputs = np.concatenate([experiment.history.inputs, inputs])
        output = np.concatenate([experiment.history.output, output])
        weights = np.concatenate([experiment.past_weights, weights])
    history = experiment.history
    stood = scaling.scale_inputs(history.inputs[:1])[0], np.atleast_1d(scaling.scale_output(history.output[0]))
    return Segment(
        inputs=scaling.scale_inputs(inputs),
        outputs=scaling.scale_output(output)[:, np.newaxis],
        root_weights=np.sqrt(weights),
        rest=None if experiment.free else stood,
    )
