"""Records as the free run of a neural state space sees them, and where it begins: declared, estimated, or shown."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.linear.segments import Segment
from sysid.estimation.networks.program_provider import BLOCK
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.records.first_samples import is_another, moves_of_shown
from sysid.kernels import neural_state_space as kernel
from sysid.models import NeuralForm
from sysid.models.networks.neural_form import Seen


@dataclass(frozen=True, eq=False)
class NeuralRecord:
    """An experiment in scaled numbers, the samples of its history included.

    ``target`` has shape ``(n_samples, n_outputs)``, ``root_weights`` one that goes with it. ``oldest`` is what the map
    to the initial state reads: scaled inputs, scaled outputs, 1. ``free`` says where the record's own initial state
    stands among the parameters; ``None`` where the map gives it. ``seen`` are the first samples where the record begins
    at the state that they show, and they do not count: its own state among the parameters is then one near that.
    """

    u: NDArray[np.float64]
    target: NDArray[np.float64]
    root_weights: NDArray[np.float64] | None
    oldest: NDArray[np.float64]
    free: slice | None
    seen: Seen | None = None

    def weighted(self, values: NDArray[np.float64], rows: slice = slice(None)) -> NDArray[np.float64]:
        """Residuals, or rows of the Jacobian, ``(n_samples, n_outputs, ...)``, with an axis for both and weights."""
        if self.root_weights is not None:
            roots = self.root_weights[rows]
            roots = roots if values.ndim == 2 else roots[:, :, None]
            # What does not count is nought even where a run has diverged by then.
            values = np.where(roots > 0.0, values, 0.0) * roots
        return values.reshape(len(values) * values.shape[1], *values.shape[2:])


@dataclass(frozen=True, kw_only=True, eq=False)
class NeuralRecords:
    """Records as the free run of a :class:`NeuralForm` sees them, and the states at which it begins.

    The parameters are the form's, followed by the initial states of those records of which nothing is declared before
    their first measured sample: such a record begins where its history does, its state there is estimated, and the
    history's samples count like the others. Elsewhere the state is the form's for a system that has stood there.

    Args:
        template: Sizes, flags, scaling and bounds; its parameters are ignored.
        experiments: The records.
        output_weights: Weight of each output's squared residuals, where they do not all count alike.
        from_shown: Records that begin at the state that their first samples show, and not at one of their own.
        stable: Parameters without which neurons would let the states grow for ever have no loss: what bounded neurons
            add to a linear part that dies away stays bounded, whatever the inputs and wherever a run begins.
    """

    template: NeuralForm
    experiments: tuple[Experiment, ...]
    output_weights: tuple[float, ...] | None = None
    from_shown: frozenset[int] = frozenset()
    stable: bool = False
    n_samples: int = field(init=False)
    n_parameters: int = field(init=False)
    """Those of the model and of the records' initial states."""
    _records: tuple[NeuralRecord, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "experiments", tuple(self.experiments))
        records, at = [], self.template.sizes.count
        for number, experiment in enumerate(self.experiments):
            record = self._record(experiment, at, number)
            records.append(record)
            at = at if record.free is None else record.free.stop
        object.__setattr__(self, "_records", tuple(records))
        object.__setattr__(self, "n_parameters", at)
        object.__setattr__(self, "n_samples", int(sum(map(self._counted, records))))

    def _counted(self, record: NeuralRecord) -> int:
        """Residuals that count."""
        if record.root_weights is None:
            return int(record.target.size)
        per_sample = self.template.sizes.outputs // int(record.root_weights.shape[1])
        return per_sample * int(np.count_nonzero(record.root_weights))

    def _record(self, experiment: Experiment, at: int, number: int) -> NeuralRecord:
        history, scaling = experiment.history, self.template.scaling
        # One measured sample is a system that has stood there, here as in every free run of the model.
        stood = len(history.output) == 1 and (experiment.past is None or bool(experiment.past.any()))
        n_past = len(history.output) if not stood and experiment.past is not None and experiment.past.any() else 0
        u, target = experiment.inputs, experiment.output
        if n_past:  # else a long record is not copied
            u, target = np.concatenate([history.inputs[:n_past], u]), np.concatenate([history.output[:n_past], target])
        roots = None
        before = experiment.past_weights[:n_past]
        if experiment.weights is not None or not before.all():
            weights = np.ones(len(experiment.output)) if experiment.weights is None else experiment.weights
            each = weights[:, None] if experiment.each is None else experiment.each
            roots = np.sqrt(np.concatenate([np.repeat(before[:, None], each.shape[1], axis=1), each]))
        if self.output_weights is not None:
            roots = np.sqrt(self.output_weights) * (np.ones((len(target), 1)) if roots is None else roots)
        scaled, outputs, n = self.template.scaled(u), self.template.scaled_outputs(target), 0
        if number in self.from_shown:
            n = experiment.n_first
            roots = np.ones((len(target), 1)) if roots is None else roots.copy()
        seen = None if n == 0 or roots is None else Seen(scaled[:n], outputs[:n], roots[:n].min(axis=1) > 0.0)
        if roots is not None:
            roots[:n] = 0.0
        oldest = np.concatenate(
            [scaling.scale_inputs(history.inputs[:1])[0], self.template.scaled_outputs(history.output[:1])[0], [1.0]]
        )
        return NeuralRecord(
            u=scaled,
            target=outputs,
            root_weights=roots,
            oldest=oldest,
            free=slice(at, at + self.template.sizes.states) if experiment.free and not stood else None,
            seen=seen,
        )

    @property
    def all_free(self) -> bool:
        """Whether every record has an initial state of its own, so that nothing is known of the map to it."""
        return all(record.free is not None for record in self._records)

    @property
    def signals(self) -> tuple[tuple[NDArray[np.float64], NDArray[np.float64]], ...]:
        """Scaled inputs and scaled outputs of each record, the history's samples included."""
        return tuple((record.u, record.target) for record in self._records)

    @property
    def counted(self) -> tuple[NDArray[np.bool_], ...]:
        """Which samples of each record count, the history's included."""
        return tuple(
            np.ones(len(r.u), dtype=np.bool_) if r.root_weights is None else r.root_weights.min(axis=1) > 0.0
            for r in self._records
        )

    @property
    def segments(self) -> tuple[Segment, ...]:
        """The records as a linear estimator sees them."""
        scaling, found = self.template, []
        for record, experiment in zip(self._records, self.experiments, strict=True):
            weights = np.ones(len(record.u)) if record.root_weights is None else record.root_weights.min(axis=1)
            history = experiment.history
            stood = (scaling.scaled(history.inputs[:1])[0], scaling.scaled_outputs(history.output[:1])[0])
            rest = None if record.free is not None else stood
            found.append(Segment(inputs=record.u, outputs=record.target, root_weights=weights, rest=rest))
        return tuple(found)

    def at(self, theta: NDArray[np.float64]) -> NeuralForm:
        """The form with these parameters.

        Args:
            theta: Flat parameters, those of the records' initial states included or not.

        Returns:
            The form.
        """
        return replace(self.template, theta=theta[: self.template.sizes.count])

    def states(self, theta: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        """Every state that the records visit.

        Args:
            theta: Flat parameters.

        Returns:
            One array of shape ``(n_samples, n_states)`` per record.
        """
        return tuple(np.concatenate([path for _, path in blocks]) for blocks in self.paths(theta))

    def paths(self, theta: NDArray[np.float64]) -> Iterator[Iterator[tuple[slice, NDArray[np.float64]]]]:
        """The states of :meth:`states` in blocks, so that no record's lie side by side.

        Args:
            theta: Flat parameters.

        Yields:
            For each record its blocks: which samples, and the states before them.
        """
        form = self.at(theta)

        def blocks(record: NeuralRecord) -> Iterator[tuple[slice, NDArray[np.float64]]]:
            x = self._begin(record, theta)
            for first in range(0, len(record.u), BLOCK):
                rows = slice(first, min(first + BLOCK, len(record.u)))
                yield rows, form.path(record.u[rows], x)

        yield from map(blocks, self._records)

    def begun(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """Parameters of the model for these records, whose own initial states are where the map puts them.

        Args:
            theta: Flat parameters; those of other records' initial states may stand behind the model's.

        Returns:
            Shape ``(n_parameters,)``.
        """
        found = np.zeros(self.n_parameters)
        found[: self.template.sizes.count] = theta[: self.template.sizes.count]
        for record in self._records:
            if record.free is not None:
                found[record.free] = self._begin(replace(record, free=None), found)
        return found

    def _begin(self, record: NeuralRecord, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """State before the record's first sample. Not bounded: a bound here would hide the way back."""
        if record.free is not None:
            own = theta[record.free].copy()
            return own if record.seen is None else self._shown(record.seen, record, theta, own)
        E = theta[self.template.sizes.start].reshape(self.template.sizes.states, -1)
        return np.asarray(E @ record.oldest)

    def _shown(
        self, seen: Seen, record: NeuralRecord, theta: NDArray[np.float64], near: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """The state that the first samples of a record show, sought from a state near it."""
        form = self.at(theta)
        inputs, output = record.oldest[: form.sizes.inputs], record.oldest[form.sizes.inputs : -1]
        return form.search(seen, form.resting(inputs, output)).found([near])

    def as_scored(self, theta: NDArray[np.float64]) -> Self | None:
        """The same residuals, begun as where runs are scored, where these would be others.

        Args:
            theta: Flat parameters.

        Returns:
            The residuals, which heed the initial states of such records no more; ``None`` where there are none.
        """
        others = set[int]()
        for number, (record, experiment) in enumerate(zip(self._records, self.experiments, strict=True)):
            n = experiment.n_first
            if n == 0 or record.free is None or record.seen is not None:
                continue
            own = theta[record.free]
            seen = Seen(record.u[:n], record.target[:n], self.counted[number][:n])
            shown, trained = (
                record.weighted(self.at(theta).run(record.u, x) - record.target)[n * record.target.shape[1] :]
                for x in (self._shown(seen, record, theta, own), own.copy())
            )
            if is_another(shown, trained):
                others.add(number)
        return replace(self, from_shown=self.from_shown | others) if others else None

    @property
    def shown(self) -> list[str]:
        """Names of the records that begin at the state that their first samples show."""
        return [self.experiments[number].history.case for number in sorted(self.from_shown)]

    @property
    def _n_raw(self) -> int:
        """Columns of a row as the kernel writes it: dynamics, the state that the record begins at, output."""
        return int(self.template.sizes.output.stop) + self.template.sizes.states

    def _of_begun(
        self, record: NeuralRecord, theta: NDArray[np.float64]
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Which parameters the state that a record begins at comes from, and its derivative by them."""
        identity, places = np.eye(self.template.sizes.states, dtype=np.float64), np.arange(self.n_parameters)
        if record.seen is not None:
            return self._shown_moves(record.seen, record, theta)
        if record.free is not None:
            return places[record.free], identity
        return places[self.template.sizes.start], np.kron(identity, record.oldest).astype(np.float64, copy=False)

    def _shown_moves(
        self, seen: Seen, record: NeuralRecord, theta: NDArray[np.float64]
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """The parameters of both equations, and how the state that some samples show moves with them."""
        sizes, known = self.template.sizes, seen.known
        n, dynamic = sizes.states, sizes.dynamic.stop
        S = np.zeros((n, dynamic + n))
        S[:, dynamic:] = np.eye(n)
        y, raw = np.empty(seen.output.shape), np.empty((*seen.output.shape, self._n_raw))
        kernel.sensitivities(seen.inputs, self._begin(record, theta), S, *self.template.arguments(theta), y, raw)
        rows = raw[known].reshape(-1, self._n_raw)
        begun = slice(dynamic, dynamic + n)
        D = moves_of_shown(rows[:, begun], np.delete(rows, begun, axis=1))
        return np.r_[sizes.dynamic, sizes.output], D
