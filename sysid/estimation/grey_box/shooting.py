r"""Multiple shooting: the free run in windows, each from a state of its own, held together by what they leave apart.

From parameters that are far off a free run soon has nothing to do with the record, and its error has a minimum wherever
the two happen to fall together. Over a short window that begins at a state which the output shows it has hardly time to
go astray, and the error is smooth in the parameters. So the records are cut into windows; the states at which they
begin are trained with the parameters; and the residuals are those of the outputs and, where one window ends and the
next begins,

.. math:: d_i = w \, (x_i(\theta, x^0_i) - x^0_{i+1}) / s,

with :math:`s` what the states range over (Bock 1981, "Numerical treatment of inverse problems in chemical reaction
kinetics"; Ribeiro et al. 2020, "On the smoothness of nonlinear system identification", on what it does to the error).
With :math:`w \to \infty` it is the free run of the whole record. The sensitivities are the exact ones of the kernels.

Parameters that start above 0 and may not go below it are trained as logarithms here: they are as likely to be three
times too great as three times too small. Weights of networks stay as they are.

Limits: the matrix is dense, in parameters and the states of all windows (:data:`MOST`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.grey_box.provider import EquationProvider
from sysid.estimation.grey_box.record import Record
from sysid.estimation.least_squares.provider import Linearisation
from sysid.models.grey_box.equation_form import EquationForm

Array = NDArray[np.float64]

SHORTEST = 12
"""Samples of a window at least."""

WINDOWS, MOST = 32, 240
"""Windows at most, each of which costs time of its own; and initial states of all together."""

LARGEST_LOG = 30.0
"""By how many powers of e a parameter may grow."""

FARTHEST = 10.0
"""How far from its level a state is looked for at which a window begins, in its scales."""

NOISE, STEPS, ENOUGH = 1e-2, 4, 1e-2
"""Mean square error of an output beside which a state is expected within its scale; Gauss-Newton steps to the state
that a window shows; and the gain below which the last one was enough."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Shooting(EquationProvider):
    """Residuals of the windows, and of what they leave apart.

    Args:
        form: As for whole records; no state of it is fixed, the first windows' being held by their bounds.
        records: The windows.
        follows: Of each, whether it goes on from the one before.
        first: Least and greatest state before a record, in units, shapes ``(n_states,)``.
        logs: Of each parameter, whether it is trained as a logarithm, shape ``(q,)``.
        held: Of each, whether it stays as it is.
        begun: Parameters as they begin, as they are trained here.
        weight: Of what windows leave apart.
    """

    follows: tuple[bool, ...]
    first: tuple[Array, Array]
    logs: NDArray[np.bool_]
    held: NDArray[np.bool_]
    begun: Array
    weight: float = 1.0

    @classmethod
    def of(cls, whole: EquationProvider, theta: Array) -> Shooting:
        """The windows of some records.

        Args:
            whole: The records.
            theta: What is trained of them.

        Returns:
            The residuals; states have the levels and scales of the records.
        """
        q, terms = len(whole.scale), whole.form.terms
        windows = [cut(record, _samples(whole)) for record in whole.records]
        logs = (whole.limits[0] >= 0.0) & (theta[:q] > 0.0)
        endless = np.full(len(terms.level), np.inf)
        pinned = [np.where(terms.fixed, terms.level, side) for side in (terms.low, terms.high)]
        free = replace(terms, fixed=np.zeros_like(terms.fixed), low=-endless, high=endless)
        return cls(
            form=replace(whole.form, terms=free),
            records=tuple(one for some in windows for one in some),
            scale=whole.scale,
            limits=whole.limits,
            noise=whole.noise,
            follows=tuple(i > 0 for some in windows for i in range(len(some))),
            first=(pinned[0], pinned[1]),
            logs=logs,
            held=np.isin(np.arange(q), _weights(whole)),
            begun=np.where(logs, np.log(np.where(logs, theta[:q], 1.0)), theta[:q]),
        )

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Of parameters as they are trained here, and of states; see the base class."""
        terms, q, both = self.form.terms, len(self.scale), []
        for row, states, endless in zip(self.limits, self.first, (-np.inf, np.inf), strict=True):
            side = np.full(self.n_parameters, endless)
            own = row / self.scale
            with np.errstate(divide="ignore"):  # the logarithm of 0 is no bound
                own = np.where(self.logs, np.log(np.where(self.logs, own, 1.0)), own)
            side[:q] = np.where(self.held, self.begun, own)
            for i in np.flatnonzero(~np.array(self.follows)):
                if self.records[i].free:
                    side[self.places(int(i))] = (states - terms.level) / terms.scale
            both.append(side)
        low, high = both
        low[:q][self.logs] = np.maximum(low[:q][self.logs], -LARGEST_LOG + self.begun[self.logs])
        high[:q][self.logs] = np.minimum(high[:q][self.logs], LARGEST_LOG + self.begun[self.logs])
        return low, high

    def plain(self, theta: Array) -> Array:
        """What is trained here with parameters over their scales in place of their logarithms."""
        found, q = theta.copy(), len(self.scale)
        found[:q] = np.where(self.logs, np.exp(np.where(self.logs, theta[:q], 0.0)), theta[:q])
        return found

    def loss(self, theta: Array) -> float:
        """Half the sum of squared residuals; see the base class."""
        theta = self.plain(theta)
        shared, total, x = self.at(theta), 0.0, self.form.terms.level
        with np.errstate(over="ignore", invalid="ignore"):  # a window that explodes has no loss
            for i, record in enumerate(self.records):
                form, end = self.of_record(shared, theta, i), x
                x = self.begin(form, theta, i)
                apart = self._apart(end, x) if self.follows[i] else np.zeros(1)
                error = record.errors(form.run(record.u, x), self.unit)
                total += 0.5 * float(np.vdot(error, error) + apart @ apart)
        return total if np.isfinite(total) else np.inf

    def _apart(self, end: Array, begun: Array) -> Array:
        return self.weight * (end - begun) / self.form.terms.scale

    @np.errstate(over="ignore", invalid="ignore")  # of a window that explodes, too
    def linearise(self, theta: Array, *, correlation: bool = True) -> Linearisation:  # noqa: ARG002 - pieces have none
        """Loss, gradient and Gauss-Newton matrix of the windows and of their joints; see the base class."""
        theta = self.plain(theta)
        shared, every = self.at(theta), np.arange(len(theta))
        gradient, matrix, loss = np.zeros(len(theta)), np.zeros((len(theta), len(theta))), 0.0

        def add(error: Array, J: Array, places: NDArray[np.int64]) -> float:
            gradient[places] += J.T @ error
            matrix[np.ix_(places, places)] += J.T @ J
            return 0.5 * float(error @ error)

        x, S, before = self.form.terms.level, np.zeros((0, 0)), every
        for i in range(len(self.records)):
            form = self.of_record(shared, theta, i)
            begun, moves, places = self.begun_moves(form, theta, i)
            scale = self.scales_of(places)
            if self.follows[i]:
                own = every[self.places(i)]
                J = np.concatenate([S / self.form.terms.scale[:, None], -np.eye(len(own))], axis=1)
                loss += add(self._apart(x, begun), self.weight * J, np.concatenate([before, own]))
            x, S, before = begun, moves, places
            for error, J in self.blocks(form, i, x, S, scale):
                loss += add(error.ravel(), J.reshape(-1, len(places)), places)
            S = S * scale
        slopes = np.ones(len(theta))
        slopes[: len(self.scale)] = np.where(self.logs, theta[: len(self.scale)], 1.0)
        return Linearisation(loss=loss, gradient=gradient * slopes, gauss_newton=matrix * np.outer(slopes, slopes))

    def begun_at(self, whole: EquationProvider, theta: Array) -> tuple[Shooting, Array]:
        """Where training begins: states that the windows show one after another, and what they range over.

        Args:
            whole: The records.
            theta: What is trained of them.

        Returns:
            The residuals with levels and scales of the states, and what is trained.
        """
        start = np.concatenate([self.begun, np.zeros(self.n_parameters - len(self.begun))])
        plain, found, record = self.plain(start), list[Array](), -1
        shared, x = self.at(plain), self.form.terms.level
        for i, window in enumerate(self.records):
            form = self.of_record(shared, plain, i)
            if self.follows[i]:
                found.append(self._shown_from(form, window, (x, found[-1])))
            else:
                record += 1
                found.append(whole.begin(whole.of_record(whole.at(theta), theta, record), theta, record))
            x = found[-1].copy()
            with np.errstate(over="ignore", invalid="ignore"):
                form.run(window.u, x)
        seen, terms = np.array(found), self.form.terms
        low, high = seen.min(axis=0), seen.max(axis=0)
        span = np.where(high > low, (high - low) / 2.0, terms.scale)
        level = np.where(terms.declared, terms.level, (low + high) / 2.0)
        ranged = replace(self, form=replace(self.form, terms=replace(terms, level=level, scale=span)))
        return ranged, ranged.with_states(start, found)

    def _shown_from(self, form: EquationForm, window: Record, expected: tuple[Array, Array]) -> Array:
        """The state that a window shows, from where the one before ended or began: the better of the two."""
        level, scale = form.terms.level, form.terms.scale
        near = [x for x in expected if np.isfinite(x).all() and (np.abs(x - level) <= FARTHEST * scale).all()]
        found = [self._corrected(form, window, x) for x in near or [expected[1]]]
        return min(found, key=lambda one: one[0])[1]

    def _corrected(self, form: EquationForm, window: Record, expected: Array) -> tuple[float, Array]:
        """A state near the expected one by damped Gauss-Newton steps, and its cost."""
        scale, n = form.terms.scale, len(expected)

        def cost(xi: Array) -> float:
            error = window.errors(form.run(window.u, expected + scale * xi), self.unit)
            found = float(np.vdot(error, error)) / NOISE + float(xi @ xi)
            return found if np.isfinite(found) else np.inf

        with np.errstate(over="ignore", invalid="ignore"):
            xi, damping = np.zeros(n), 1e-3
            now = cost(xi)
            for _ in range(STEPS):
                y, J = form.moved(window.u, expected + scale * xi, np.diag(scale), 0)
                away = window.errors(y, self.unit).ravel()
                rows = np.where((window.known)[:, None, None], J / self.unit[:, None], 0.0).reshape(-1, n)
                if not (np.abs(rows) < 1e100).all() or not np.isfinite(away).all():
                    break
                H, g = rows.T @ rows / NOISE + np.eye(n), rows.T @ away / NOISE + xi
                trial = xi - np.linalg.solve(H + damping * np.diag(np.diag(H)), g)
                then = cost(trial)
                if then < now:
                    done = now - then <= ENOUGH * now
                    xi, now, damping = trial, then, damping / 10.0
                    if done:
                        break
                else:
                    damping *= 100.0
        return now, expected + scale * xi

    def ended(self, whole: EquationProvider, trained: Array, theta: Array) -> Array:
        """What is trained of whole records where their windows have come together.

        Args:
            whole: The records.
            trained: What is trained here.
            theta: What was trained of the records.

        Returns:
            The same with the windows' parameters and the first windows' states.
        """
        found, plain = theta.copy(), self.plain(trained)
        found[: len(self.scale)] = plain[: len(self.scale)]
        firsts = [i for i, follows in enumerate(self.follows) if not follows]
        found = whole.with_states(found, [self.begin(self.form, plain, i) for i in firsts])
        return np.asarray(np.clip(found, *whole.bounds))


def in_windows(whole: EquationProvider, theta: Array) -> tuple[EquationProvider, Array]:
    """The windows of some records as records of their own, each begun at the state that it shows.

    Args:
        whole: The records.
        theta: What is trained of them.

    Returns:
        The windows, and what is trained of them: the same parameters, and their states.
    """
    windows, trained = Shooting.of(whole, theta).begun_at(whole, theta)
    form, records = windows.form, windows.records
    found = EquationProvider(form=form, records=records, scale=whole.scale, limits=whole.limits, noise=whole.noise)
    return found, windows.plain(trained)


def _samples(whole: EquationProvider) -> int:
    """Of a window, so that there are not too many states."""
    total = sum(len(record.output) for record in whole.records)
    windows = max(min(WINDOWS, MOST // max(whole.form.lowered.n_states, 1)), 1)
    return max(SHORTEST, -(-total // windows))


def _weights(whole: EquationProvider) -> NDArray[np.int64]:
    """Where the networks' weights stand."""
    low = whole.form.lowered
    return np.arange(low.n_estimated - low.n_weights, low.n_estimated)


def cut(record: Record, samples: int) -> list[Record]:
    """A record in windows of the same length, about.

    Args:
        record: The record.
        samples: Of a window.

    Returns:
        The windows; each but the first has a state of its own before it.
    """
    n = len(record.output)
    edges = np.linspace(0, n, max(1, round(n / samples)) + 1).astype(int)
    return [
        replace(
            record,
            u=record.u[a:b],
            output=record.output[a:b],
            roots=None if record.roots is None else record.roots[a:b],
            free=record.free or a > 0,
            n_first=0,
        )
        for a, b in pairwise(edges)
    ]
