"""Residuals and Jacobians of the free run of equations, for the Levenberg-Marquardt engine."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.grey_box.record import Record
from sysid.estimation.least_squares.correlation import correlation_time
from sysid.estimation.least_squares.provider import AbstractProvider, Linearisation
from sysid.estimation.records.first_samples import is_another, moves_of_shown
from sysid.kernels.arrays import forget_what_has_died_away
from sysid.models.grey_box.equation_form import EquationForm

Array = NDArray[np.float64]

BLOCK = 2_000
"""Samples whose Jacobian is in memory at the same time."""


@dataclass(frozen=True, kw_only=True, eq=False)
class EquationProvider(AbstractProvider):
    """Residuals of an :class:`EquationForm` in free run, over the outputs' scales.

    What is trained is ``[parameters and weights over their scales | parameters by case of the second case, of the
    third, ... over theirs | initial states, less their levels, over theirs]``, initial states of those records that
    nothing is declared of. The first case's parameters stand among the others.

    Args:
        form: Programs, scaling and what is known of the states; its first parameters are ignored.
        records: The records.
        scale: Of each parameter and weight, those of further cases included, in its unit, shape ``(q,)``.
        limits: Least and greatest of each, in its unit, shape ``(2, q)``.
        noise: How much of each output is left, relative to the others: what its residuals count over.
    """

    form: EquationForm
    records: tuple[Record, ...]
    scale: Array
    limits: Array
    noise: Array | None = None
    n_samples: int = field(init=False)
    n_parameters: int = field(init=False)
    """Those of the model and of the records' initial states."""

    def __post_init__(self) -> None:
        counted = sum(record.counted for record in self.records)
        object.__setattr__(self, "n_samples", counted)
        object.__setattr__(self, "n_parameters", len(self.scale) + len(self.open_states) * len(self._free))

    @property
    def unit(self) -> Array:
        """What the residuals of each output are over, in its unit."""
        return self.form.output_scale if self.noise is None else self.form.output_scale * self.noise

    def left(self, theta: Array) -> Array:
        """Root of the mean square that some parameters leave of each output, over its scale.

        Args:
            theta: What is trained.

        Returns:
            Shape ``(n_outputs,)``.
        """
        shared, total = self.at(theta), np.zeros(self.form.n_outputs)
        for i, record in enumerate(self.records):
            form = self.of_record(shared, theta, i)
            error = record.errors(form.run(record.u, self.begin(form, theta, i)), form.output_scale)
            total += np.sum(error**2, axis=0)
        return np.sqrt(total * form.n_outputs / max(self.n_samples, 1))

    @property
    def open_states(self) -> NDArray[np.int64]:
        """States of which a record's own value is estimated."""
        return np.flatnonzero(~self.form.terms.fixed)

    @property
    def _free(self) -> list[int]:
        return [i for i, record in enumerate(self.records) if record.free]

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Of parameters and of initial states, in what is trained."""
        terms, places = self.form.terms, self.open_states
        both = []
        for row, states in zip(self.limits, (terms.low, terms.high), strict=True):
            begun = (states[places] - terms.level[places]) / terms.scale[places]
            both.append(np.concatenate([row / self.scale, *[begun] * len(self._free)]))
        return both[0], both[1]

    def places(self, record: int) -> slice:
        """Where the initial state of a record that has one of its own stands."""
        n = len(self.open_states)
        at = len(self.scale) + self._free.index(record) * n
        return slice(at, at + n)

    @property
    def n_of_form(self) -> int:
        """Parameters and weights of the form, each once."""
        return self.form.lowered.n_estimated

    def columns(self, number: int) -> NDArray[np.int64]:
        """Where the parameters and weights of a record stand in what is trained, shape ``(p,)``."""
        cases, p = self.form.cases, self.n_of_form
        return np.arange(p) if cases is None else cases.columns(self.records[number].name, p)

    def at(self, theta: Array) -> EquationForm:
        """The form with these parameters, those by case being the first case's.

        Args:
            theta: What is trained.

        Returns:
            The form.
        """
        p = self.n_of_form
        return self.form.with_theta(theta[:p] * self.scale[:p])

    def of_record(self, form: EquationForm, theta: Array, number: int) -> EquationForm:
        """A form with the parameters by case that a record has.

        Args:
            form: Any with the parameters that all share.
            theta: What is trained.
            number: Which record.

        Returns:
            The form; as it is where nothing differs by case.
        """
        if form.cases is None:
            return form
        places = self.columns(number)[form.cases.places]
        return form.with_constants(theta[places] * self.scale[places])

    def with_states(self, theta: Array, states: Sequence[Array]) -> Array:
        """The same parameters with other initial states.

        Args:
            theta: What is trained.
            states: One for each record, in units.

        Returns:
            What is trained, with these.
        """
        changed, terms, free = theta.copy(), self.form.terms, self.open_states
        for i, record in enumerate(self.records):
            if record.free:
                changed[self.places(i)] = ((states[i] - terms.level) / terms.scale)[free]
        return changed

    def begin(self, form: EquationForm, theta: Array, number: int) -> Array:
        """The state before a record.

        Args:
            form: With the parameters, those by case being the record's.
            theta: What is trained.
            number: Which record.

        Returns:
            Shape ``(n_states,)``, in units.
        """
        record, terms = self.records[number], form.terms
        if not record.free:
            return form.resting(*record.rest)
        if record.shows is not None:
            return self._shown(form, record, record.shows)
        x = terms.level.copy()
        free = self.open_states
        x[free] += terms.scale[free] * theta[self.places(number)]
        return x

    @staticmethod
    def _shown(form: EquationForm, record: Record, known: NDArray[np.bool_]) -> Array:
        """The state that the first samples of a record show, as where a run is scored."""
        n = record.n_first
        return form.estimated(record.u[:n], record.output[:n], form.resting(*record.rest), known)

    def as_scored(self, theta: Array) -> EquationProvider | None:
        """The same residuals, begun as where runs are scored, where these would be others.

        Args:
            theta: What is trained.

        Returns:
            The residuals, which heed the initial states of such records no more; ``None`` where there are none.
        """
        shared, records = self.at(theta), list(self.records)
        for i, record in enumerate(records):
            if not record.n_first or record.shows is not None or not len(self.open_states):
                continue
            form, known = self.of_record(shared, theta, i), record.known
            states = (self._shown(form, record, known[: record.n_first]), self.begin(form, theta, i))
            with np.errstate(over="ignore", invalid="ignore"):
                shown, trained = (record.errors(form.run(record.u, x), self.unit) for x in states)
            n = record.n_first  # of which a state that is shown leaves less than others, or it was not found
            if is_another(shown[n:], trained[n:]) and not is_another(shown[:n], trained[:n]):
                records[i] = record.from_shown()
        same = all(one is other for one, other in zip(records, self.records, strict=True))
        return None if same else replace(self, records=tuple(records))

    def loss(self, theta: Array) -> float:
        """Half the weighted sum of squared residuals; see the base class."""
        shared, total = self.at(theta), 0.0
        with np.errstate(over="ignore", invalid="ignore"):  # a free run that explodes has no loss
            for i, record in enumerate(self.records):
                form = self.of_record(shared, theta, i)
                error = record.errors(form.run(record.u, self.begin(form, theta, i)), self.unit)
                total += 0.5 * float(np.vdot(error, error))
        return total if np.isfinite(total) else np.inf

    @np.errstate(over="ignore", invalid="ignore")  # likewise
    def linearise(self, theta: Array, *, correlation: bool = True) -> Linearisation:
        """Loss, gradient and Gauss-Newton matrix; see the base class."""
        gradient, matrix, shared = np.zeros(len(theta)), np.zeros((len(theta), len(theta))), self.at(theta)
        loss = correlated = samples = 0.0
        for number in range(len(self.records)):
            errors, form = [], self.of_record(shared, theta, number)
            x, S, places = self.begun_moves(form, theta, number)
            for error, J in self.blocks(form, number, x, S, self.scales_of(places)):
                flat = J.reshape(J.shape[0] * J.shape[1], J.shape[2])  # of none, too
                loss += 0.5 * float(np.vdot(error, error))
                gradient[places] += flat.T @ error.ravel()
                matrix[np.ix_(places, places)] += flat.T @ flat
                errors.append(error)
            for column in np.concatenate(errors).T:
                correlated += len(column) * (correlation_time(column) if correlation else np.nan)
                samples += len(column)
        return Linearisation(
            loss=loss, gradient=gradient, gauss_newton=matrix, correlation_time=correlated / max(samples, 1.0)
        )

    def begun_moves(self, form: EquationForm, theta: Array, number: int) -> tuple[Array, Array, NDArray[np.int64]]:
        """The state before a record and how it moves.

        Args:
            form: With the record's parameters.
            theta: What is trained.
            number: Which record.

        Returns:
            Shapes ``(n_states,)`` and ``(n_states, n_columns)``, in units, parameters being in theirs; and where the
            columns stand in what is trained.
        """
        record, p = self.records[number], self.n_of_form
        if record.shows is not None:
            return *self._shown_moves(form, record, record.shows), self.columns(number)
        if not record.free:
            return *form.resting_moves(*record.rest, p), self.columns(number)
        free = self.open_states
        x, S = self.begin(form, theta, number), np.zeros((form.lowered.n_states, p + len(free)))
        S[free, p + np.arange(len(free))] = form.terms.scale[free]
        return x, S, np.concatenate([self.columns(number), np.arange(len(theta))[self.places(number)]])

    def scales_of(self, places: NDArray[np.int64]) -> Array:
        """What columns of :meth:`begun_moves` are multiplied by, to be by what is trained."""
        p = self.n_of_form
        return np.concatenate([self.scale[places[:p]], np.ones(len(places) - p)])

    def blocks(
        self, form: EquationForm, number: int, x: Array, S: Array, scale: Array
    ) -> Iterator[tuple[Array, Array]]:
        """Weighted errors of a record and their derivatives by some of what is trained.

        Args:
            form: With the record's parameters.
            number: Which record.
            x: The state before it; in the end that after it.
            S: How it moves; likewise.
            scale: What the derivatives are multiplied by.

        Yields:
            Errors and derivatives of some samples.
        """
        record, p = self.records[number], self.n_of_form
        for first in range(0, len(record.output), BLOCK):
            rows = slice(first, min(first + BLOCK, len(record.output)))
            y, J = form.moved(record.u[rows], x, S, p)
            forget_what_has_died_away(S)
            J *= scale
            J /= self.unit[:, None]
            if record.roots is not None:
                J = np.where(record.roots[rows, :, None] > 0.0, J * record.roots[rows, :, None], 0.0)
            yield record.errors(y, self.unit, rows), J

    def _shown_moves(self, form: EquationForm, record: Record, known: NDArray[np.bool_]) -> tuple[Array, Array]:
        """The state that the first samples of a record show, and how it moves with parameters and weights."""
        p, free, scale = self.n_of_form, self.open_states, form.terms.scale
        x = self._shown(form, record, known)
        S = np.zeros((len(x), p + len(free)))
        S[free, p + np.arange(len(free))] = scale[free]
        _, J = form.moved(record.u[: record.n_first], x.copy(), S, p)
        rows = (J / self.unit[:, None])[known].reshape(-1, p + len(free))
        S = np.zeros((len(x), p))
        S[free] = scale[free, None] * moves_of_shown(rows[:, p:], rows[:, :p])
        return x, S

    def paths(self, theta: Array) -> list[tuple[Array, Array]]:
        """What the programs read, and every state that the records visit.

        Args:
            theta: What is trained.

        Returns:
            One pair for each record.
        """
        shared, found = self.at(theta), []
        for i, record in enumerate(self.records):
            form = self.of_record(shared, theta, i)
            path = np.empty((len(record.u), form.lowered.n_states))
            form.run(record.u, self.begin(form, theta, i), path)
            found.append((record.u, path))
        return found

    def states(self, theta: Array, samples: int) -> list[Array]:
        """The state before each record, as its first samples show it.

        Args:
            theta: Parameters; initial states among them are ignored.
            samples: How many.

        Returns:
            One for each record, in units; at rest for those that are.
        """
        shared, found = self.at(theta), []
        for i, record in enumerate(self.records):
            form = self.of_record(shared, theta, i)
            x = form.resting(*record.rest)
            if record.free:
                known = record.known[:samples]
                x = form.estimated(record.u[:samples], record.output[:samples], x, known)
            found.append(x)
        return found

    def with_form(self, form: EquationForm) -> EquationProvider:
        """The same records under another form of the same sizes."""
        return replace(self, form=form)
