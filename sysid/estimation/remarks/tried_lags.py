"""Output errors with other lags than a fitted one has, sought from its poles: whether a record asks for them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.models import AbstractModel, ProcessModel, TransferFunction
from sysid.models.contract.ratio import Ratio

Array = NDArray[np.float64]

MOST_COLUMNS = 60
"""Columns beyond which nothing is tried."""
STEPS, HALVES, DONE = 8, 4, 1e-4
"""Gauss-Newton steps of each model, how often one is halved, and by how little a step is the last."""
MOST_RADIUS = 1.0 + 1e-9
"""Magnitude of a pole from which a run over the record is no use to compare with."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Tried:
    """Models of output error of one output: numerators, first states and a constant follow from the denominators.

    Args:
        inputs: Less their means, shape ``(n_samples, n_inputs)``.
        output: Likewise, shape ``(n_samples,)``.
        usable: Which samples count.
        lags: Of each input the first and the last lag.
        F: Of each input its denominator, in ``1/z``.
        shared: Whether all have one.
    """

    inputs: Array
    output: Array
    usable: NDArray[np.bool_]
    lags: tuple[tuple[int, int], ...]
    F: tuple[Array, ...]
    shared: bool

    @property
    def columns(self) -> int:
        """Of all that is fitted."""
        states = [len(F) - 1 for F in (self.F[:1] if self.shared else self.F)]
        return sum(last - first + 1 for first, last in self.lags) + 2 * sum(states) + 1

    def linear(self) -> Array:
        """What the output is made of for these denominators, shape ``(n_samples, n_columns)``."""
        parts = [
            _late(scipy.signal.lfilter([1.0], F, u), lag)
            for u, F, (first, last) in zip(self.inputs.T, self.F, self.lags, strict=True)
            for lag in range(first, last + 1)
        ]
        impulse = np.eye(1, len(self.output))[0]
        for F in self.F[:1] if self.shared else self.F:
            begun = scipy.signal.lfilter([1.0], F, impulse)
            parts += [_late(begun, lag) for lag in range(len(F) - 1)]
        return np.column_stack([*parts, np.ones(len(self.output))])

    def moves(self, columns: Array, weights: Array) -> Array:
        """How the run moves with the coefficients of the denominators."""
        found, at = [], 0
        states = sum(last - first + 1 for first, last in self.lags)
        each = []
        for F, (first, last) in zip(self.F, self.lags, strict=True):
            n = last - first + 1
            part = columns[:, at : at + n] @ weights[at : at + n]
            at += n
            if not self.shared:
                n = len(F) - 1
                part = part + columns[:, states : states + n] @ weights[states : states + n]
                states += n
            each.append(part)
        if self.shared:
            each = [columns[:, :-1] @ weights[:-1]]
        for F, part in zip(self.F, each, strict=False):
            filtered = -scipy.signal.lfilter([1.0], F, part)
            found += [_late(filtered, lag) for lag in range(1, len(F))]
        return np.column_stack(found) if found else np.zeros((len(self.output), 0))

    def moved(self, by: Array) -> Tried:
        """With other denominators."""
        found, at = [], 0
        for F in self.F[:1] if self.shared else self.F:
            n = len(F) - 1
            found.append(np.concatenate([[1.0], F[1:] + by[at : at + n]]))
            at += n
        return replace(self, F=tuple(found * len(self.F) if self.shared else found))

    def solved(self) -> tuple[Array, Array, Array]:
        """Columns, weights, and what is left of the samples that count."""
        columns = self.linear()
        rows = columns[self.usable]
        scale = np.maximum(np.linalg.norm(rows, axis=0), np.finfo(np.float64).tiny)
        weights = np.linalg.lstsq(rows / scale, self.output[self.usable], rcond=1e-12)[0] / scale
        return columns, weights, self.output[self.usable] - rows @ weights

    def stable(self) -> bool:
        """Whether it can be run over the record."""
        return all(np.isfinite(F).all() and _radius(F) <= MOST_RADIUS for F in self.F)

    def best(self) -> tuple[Tried, Array]:
        """The denominators that this leads to, and what they leave."""
        here = self
        columns, weights, left = here.solved()
        for _ in range(STEPS):
            J = here.moves(columns, weights)[here.usable]
            found = here.stepped(_step(columns[here.usable], J, left), float(left @ left))
            if found is None:
                break
            before = float(left @ left)
            here, (columns, weights, left) = found
            if left @ left > (1.0 - DONE) * before:
                break
        return here, left

    def own(self, errors: Array) -> Array:
        """What a model's own run leaves of the samples that count: with other first states it is the same model's."""
        begun = self.linear()[self.usable, sum(last - first + 1 for first, last in self.lags) :]
        errors = errors[self.usable]
        return np.asarray(errors - begun @ np.linalg.lstsq(begun, errors, rcond=1e-12)[0])

    def stepped(self, step: Array, loss: float) -> tuple[Tried, tuple[Array, Array, Array]] | None:
        """Where a step, or half of it and so on, leaves less; ``None`` where none does."""
        for halves in range(HALVES):
            there = self.moved(step / 2**halves)
            if there.stable():
                found = there.solved()
                if found[2] @ found[2] < loss:
                    return there, found
        return None

    def best_beside(self, other: Tried) -> Array:
        """The least that is left from here and from the denominators of another."""
        return min((self.best()[1], replace(self, F=other.F).best()[1]), key=lambda left: float(left @ left))

    def gain(self, j: int) -> float:
        """Part of the squared error that one lag less of an input leaves, by one step from here."""
        columns, weights, left = self.solved()
        J = self.moves(columns, weights)[self.usable]
        base = np.column_stack([columns[self.usable], J])
        first = self.lags[j][0]
        new = _late(scipy.signal.lfilter([1.0], self.F[j], self.inputs[:, j]), first - 1)[self.usable]
        q = scipy.linalg.orth(base / np.maximum(np.linalg.norm(base, axis=0), np.finfo(np.float64).tiny))
        left, new = (x - q @ (q.T @ x) for x in (left, new))
        power = float(new @ new) * float(left @ left)
        return 1.0 - (float(new @ left) ** 2 / power if power > 0.0 else 0.0)

    def with_lags(self, j: int, first: int, last: int) -> Tried:
        """With other lags of one input."""
        return replace(self, lags=(*self.lags[:j], (first, last), *self.lags[j + 1 :]))

    def with_pole(self, j: int) -> Tried:
        """With a pole more, at zero, for one input, or for all that share them."""
        more = [np.append(F, 0.0) if self.shared or k == j else F for k, F in enumerate(self.F)]
        return replace(self, F=tuple(more))


def tried_of(
    model: AbstractModel, own: dict[int, Ratio], inputs: Array, output: Array, usable: NDArray[np.bool_]
) -> Tried | None:
    """The models that are tried, from the poles of the one that was fitted; ``None`` where there are none to try."""
    if not own or not np.isfinite(output[usable]).all():
        return None
    T = model.sample_time
    F = tuple(_denominator(ratio, T) for ratio in own.values())
    shared = all(len(one) == len(F[0]) and np.array_equal(one, F[0]) for one in F) and not isinstance(
        model.structure, TransferFunction | ProcessModel
    )
    lags = tuple(_lags(ratio, moves=moving_in(model, j)) for j, ratio in own.items())
    # What inputs did before the record is in the first states, once all lags that are tried lie in the record.
    seen = usable & (np.arange(len(usable)) > max(last for _, last in lags))
    if seen.sum() < usable.sum() // 2:
        return None
    found = Tried(
        inputs=inputs[:, list(own)],
        output=np.where(usable, output, 0.0) - output[usable].mean(),
        usable=seen,
        lags=lags,
        F=F,
        shared=shared or len(F) == 1,
    )
    many = found.columns > min(MOST_COLUMNS, seen.sum() // 10)
    return None if many or not found.stable() else found


def moving_in(model: AbstractModel, j: int) -> bool:
    """Whether a model takes an input to move between samples."""
    structure = model.structure
    return isinstance(structure, TransferFunction) and structure.moving(model.mapping.inputs)[j]


def _lags(ratio: Ratio, *, moves: bool) -> tuple[int, int]:
    """First and last lag of an input in the difference equation of its samples."""
    if ratio.discrete:
        moved = np.flatnonzero(ratio.B)
        first = int(moved[0]) if len(moved) else 0
        return int(ratio.delay) + first, int(ratio.delay) + len(ratio.B) - 1
    n, B = len(ratio.F) - 1, np.trim_zeros(ratio.B, "b")
    k, part = divmod(ratio.delay, 1.0)
    first = int(k) + (len(B) <= n and not moves)
    return first, int(k) + n + (part > 0.0)


def _denominator(ratio: Ratio, T: float) -> Array:
    """In ``1/z``, with a first coefficient of 1."""
    if ratio.discrete:
        return np.asarray(ratio.F / ratio.F[0])
    poles = np.roots(np.trim_zeros(ratio.F, "b")[::-1])
    return np.asarray(np.real(np.poly(np.exp(poles * T))))


def _radius(F: Array) -> float:
    return float(np.abs(np.roots(F)).max(initial=0.0))


def _step(columns: Array, J: Array, left: Array) -> Array:
    """Of the coefficients of the denominators, the rest following (Kaufman 1975)."""
    both = np.column_stack([columns, J])
    scale = np.maximum(np.linalg.norm(both, axis=0), np.finfo(np.float64).tiny)
    found = np.linalg.lstsq(both / scale, left, rcond=1e-12)[0] / scale
    return np.asarray(found[columns.shape[1] :])


def _late(x: Array, lag: int) -> Array:
    """A signal some samples later, from zero; inputs before the record are a matter of the first states."""
    return x if lag == 0 else np.concatenate([np.zeros(lag), x[:-lag]])
