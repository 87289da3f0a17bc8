"""Residuals and Jacobians of the free run of a neural state space, for the Levenberg-Marquardt engine."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.experiment import Experiment
from sysid.estimation.first_samples import is_another, moves_of_shown
from sysid.estimation.least_squares.correlation import correlation_time
from sysid.estimation.least_squares.provider import AbstractProvider, Linearisation
from sysid.estimation.linear.segments import Segment
from sysid.estimation.networks.program_provider import BLOCK
from sysid.kernels import neural_state_space as kernel
from sysid.kernels.arrays import forget_what_has_died_away
from sysid.models import NeuralForm
from sysid.models.neural_form import Seen


@dataclass(frozen=True, eq=False)
class _Record:
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
class NeuralProvider(AbstractProvider):
    """Residuals of a :class:`NeuralForm` in free run.

    The parameters are the form's, followed by the initial states of those records of which nothing is declared before
    their first measured sample: such a record begins where its history does, its state there is estimated, and the
    history's samples count like the others. Elsewhere the state is the form's for a system that has stood there.

    Args:
        template: Sizes, flags, scaling and bounds; its parameters are ignored.
        experiments: The records.
        output_weights: Weight of each output's squared residuals, where they do not all count alike.
        from_shown: Records that begin at the state that their first samples show, and not at one of their own.
    """

    template: NeuralForm
    experiments: tuple[Experiment, ...]
    output_weights: tuple[float, ...] | None = None
    from_shown: frozenset[int] = frozenset()
    n_samples: int = field(init=False)
    n_parameters: int = field(init=False)
    """Those of the model and of the records' initial states."""
    _records: tuple[_Record, ...] = field(init=False, repr=False)

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

    def _counted(self, record: _Record) -> int:
        """Residuals that count."""
        if record.root_weights is None:
            return int(record.target.size)
        per_sample = self.template.sizes.outputs // int(record.root_weights.shape[1])
        return per_sample * int(np.count_nonzero(record.root_weights))

    def _record(self, experiment: Experiment, at: int, number: int) -> _Record:
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
        return _Record(
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

        def blocks(record: _Record) -> Iterator[tuple[slice, NDArray[np.float64]]]:
            x = self._begin(record, theta)
            for first in range(0, len(record.u), BLOCK):
                rows = slice(first, min(first + BLOCK, len(record.u)))
                yield rows, form.path(record.u[rows], x)

        yield from map(blocks, self._records)

    def loss(self, theta: NDArray[np.float64]) -> float:
        """Half the weighted sum of squared residuals; see the base class."""
        total = 0.0
        for record in self._records:
            residual = record.weighted(self._error(record, theta))
            with np.errstate(over="ignore", invalid="ignore"):  # a free run that explodes has no loss
                total += 0.5 * float(residual @ residual)
        return total if np.isfinite(total) else np.inf

    def _error(self, record: _Record, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """The free run less what was measured, in one array: a long record's is many MB."""
        y = np.empty(record.target.shape)
        kernel.free_run(record.u, self._begin(record, theta), *self.template.arguments(theta), y)
        y -= record.target
        return y

    def linearise(self, theta: NDArray[np.float64]) -> Linearisation:
        """Loss, gradient and Gauss-Newton matrix; see the base class."""
        # A random start whose free run explodes has none; it is not told as a warning, the engine sees it.
        with np.errstate(over="ignore", invalid="ignore"):
            return self._linearised(theta, correlation=True)

    def without_news(self, theta: NDArray[np.float64]) -> Linearisation:
        """The same without the correlation time; see the base class."""
        with np.errstate(over="ignore", invalid="ignore"):  # likewise
            return self._linearised(theta, correlation=False)

    def _linearised(self, theta: NDArray[np.float64], *, correlation: bool) -> Linearisation:
        gradient, matrix = np.zeros(len(theta)), np.zeros((len(theta), len(theta)))
        loss, correlated = 0.0, 0.0
        for record in self._records:
            residuals = np.empty((len(record.u), self.template.sizes.outputs))
            raw_gradient, raw_matrix = np.zeros(self._n_raw), np.zeros((self._n_raw, self._n_raw))
            for rows, y, raw in self._raw(record, theta):
                residual = record.weighted(y - record.target[rows], rows)
                weighted = record.weighted(raw, rows)
                loss += 0.5 * float(residual @ residual)
                raw_gradient += weighted.T @ residual
                raw_matrix += weighted.T @ weighted  # one array twice: NumPy calls syrk, half the flops
                residuals[rows] = residual.reshape(-1, residuals.shape[1])
            self._add(self._of_begun(record, theta), raw_gradient, raw_matrix, gradient, matrix)
            for whole in residuals.T if correlation else ():
                correlated += len(whole) * correlation_time(whole)
        held = self.template.sizes.held
        gradient[held], matrix[held], matrix[:, held] = 0.0, 0.0, 0.0
        return Linearisation(
            loss=loss,
            gradient=gradient,
            gauss_newton=matrix,
            correlation_time=correlated / sum(record.target.size for record in self._records)
            if correlation
            else np.nan,
        )

    def jacobian(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """The whole Jacobian of the scaled outputs, unweighted, records one after the other.

        Args:
            theta: Flat parameters.

        Returns:
            Shape ``(n_samples_of_all_records * n_outputs, n_parameters)``, a sample's outputs side by side.
        """
        blocks = [block.copy() for r in self._records for _, _, block in self._blocks(r, theta)]
        return np.concatenate(blocks).reshape(-1, len(theta))

    def outputs(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """The scaled free runs, records one after the other.

        Args:
            theta: Flat parameters.

        Returns:
            Shape ``(n_samples_of_all_records, n_outputs)``.
        """
        return np.concatenate([y.copy() for record in self._records for _, y, _ in self._blocks(record, theta)])

    def variances(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean squared residual of each output over the samples that count, in scaled numbers.

        Args:
            theta: Flat parameters.

        Returns:
            Shape ``(n_outputs,)``.
        """
        total, counted = np.zeros(self.template.sizes.outputs), np.zeros(self.template.sizes.outputs)
        for record in self._records:
            squares = self._error(record, theta)
            squares *= squares
            if record.root_weights is None:
                total, counted = total + np.sum(squares, axis=0), counted + len(squares)
                continue
            weights = record.root_weights**2
            total += np.sum(weights * squares, axis=0)
            counted += weights.sum(axis=0)  # with the weights of outputs, which thus are none
        return np.asarray(total / counted)

    def there_and_back(self, theta: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        """Scaled outputs over each record, and from there on over its inputs backwards, with signs and without bounds.

        Args:
            theta: Flat parameters.

        Returns:
            One array of shape ``(2 * n_samples, n_outputs)`` per record.
        """
        form = replace(self.at(theta), rectified=False, low=-np.inf, high=np.inf)
        return tuple(form.run(np.concatenate([r.u, r.u[::-1]]), self._begin(r, theta)) for r in self._records)

    def loss_of(self, outputs: Sequence[NDArray[np.float64]]) -> float:
        """Half the weighted sum of squared residuals of given runs.

        Args:
            outputs: For each record scaled outputs with signs and without bounds, shape ``(n_samples, n_outputs)``.

        Returns:
            The loss.
        """
        form, total = self.template, 0.0
        for record, signed in zip(self._records, outputs, strict=True):
            y = np.clip(np.abs(signed) if form.rectified else signed, form.low, form.high)
            residual = record.weighted(y - record.target)
            total += 0.5 * float(residual @ residual)
        return total

    def at(self, theta: NDArray[np.float64]) -> NeuralForm:
        """The form with these parameters.

        Args:
            theta: Flat parameters, those of the records' initial states included or not.

        Returns:
            The form.
        """
        return replace(self.template, theta=theta[: self.template.sizes.count])

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

    def _begin(self, record: _Record, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """State before the record's first sample. Not bounded: a bound here would hide the way back."""
        if record.free is not None:
            own = theta[record.free].copy()
            return own if record.seen is None else self._shown(record.seen, record, theta, own)
        E = theta[self.template.sizes.start].reshape(self.template.sizes.states, -1)
        return np.asarray(E @ record.oldest)

    def _shown(
        self, seen: Seen, record: _Record, theta: NDArray[np.float64], near: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """The state that the first samples of a record show, sought from a state near it."""
        form = self.at(theta)
        return form.sought(
            seen, form.resting(record.oldest[: form.sizes.inputs], record.oldest[form.sizes.inputs : -1]), [near]
        )

    def as_scored(self, theta: NDArray[np.float64]) -> NeuralProvider | None:
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

    def _of_begun(self, record: _Record, theta: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Which parameters the state that a record begins at comes from, and its derivative by them."""
        identity, places = np.eye(self.template.sizes.states, dtype=np.float64), np.arange(self.n_parameters)
        if record.seen is not None:
            return self._shown_moves(record.seen, record, theta)
        if record.free is not None:
            return places[record.free], identity
        return places[self.template.sizes.start], np.kron(identity, record.oldest).astype(np.float64, copy=False)

    def _shown_moves(
        self, seen: Seen, record: _Record, theta: NDArray[np.float64]
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

    def _add(
        self,
        of_begun: tuple[NDArray[np.int64], NDArray[np.float64]],
        raw_gradient: NDArray[np.float64],
        raw_matrix: NDArray[np.float64],
        gradient: NDArray[np.float64],
        matrix: NDArray[np.float64],
    ) -> None:
        """Add the normal equations of one record's rows as the kernel writes them to those of the parameters."""
        n, dynamic, output = self.template.sizes.states, self.template.sizes.dynamic, self.template.sizes.output
        begun = slice(dynamic.stop, dynamic.stop + n)
        kept = np.r_[dynamic, begun.stop : self._n_raw]
        places = np.r_[dynamic, output]
        to, D = of_begun
        gradient[places] += raw_gradient[kept]
        gradient[to] += D.T @ raw_gradient[begun]
        matrix[np.ix_(places, places)] += raw_matrix[np.ix_(kept, kept)]
        across = raw_matrix[kept, begun] @ D
        matrix[np.ix_(places, to)] += across
        matrix[np.ix_(to, places)] += across.T
        matrix[np.ix_(to, to)] += D.T @ raw_matrix[begun, begun] @ D

    def _raw(
        self, record: _Record, theta: NDArray[np.float64]
    ) -> Iterator[tuple[slice, NDArray[np.float64], NDArray[np.float64]]]:
        """Outputs, and rows of the Jacobian as the kernel writes them; both are written over by the next block."""
        sizes = self.template.sizes
        n, dynamic = sizes.states, sizes.dynamic.stop
        x = self._begin(record, theta)
        S = np.zeros((n, dynamic + n))
        S[:, dynamic:] = np.eye(n)
        raw, y = np.empty((BLOCK, sizes.outputs, self._n_raw)), np.empty((BLOCK, sizes.outputs))
        for first in range(0, len(record.target), BLOCK):
            rows = min(BLOCK, len(record.target) - first)
            kernel.sensitivities(
                record.u[first : first + rows], x, S, *self.template.arguments(theta), y[:rows], raw[:rows]
            )
            forget_what_has_died_away(S)
            yield slice(first, first + rows), y[:rows], raw[:rows]

    def _blocks(
        self, record: _Record, theta: NDArray[np.float64]
    ) -> Iterator[tuple[slice, NDArray[np.float64], NDArray[np.float64]]]:
        dynamic, output = self.template.sizes.dynamic, self.template.sizes.output
        begun = slice(dynamic.stop, dynamic.stop + self.template.sizes.states)
        to, D = self._of_begun(record, theta)
        for rows, y, raw in self._raw(record, theta):
            J = np.zeros((*raw.shape[:2], len(theta)))
            J[..., dynamic], J[..., output] = raw[..., dynamic], raw[..., begun.stop :]
            J[..., to] += raw[..., begun] @ D
            J[..., self.template.sizes.held] = 0.0
            yield rows, y, J
