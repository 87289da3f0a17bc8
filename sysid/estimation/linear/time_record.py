"""Records over time that a transfer function is fitted to: columns by passes through its sections."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.linear.predictor import MirroredPredictor
from sysid.estimation.linear.records import AbstractRecord, Bases, full, tap_slices
from sysid.kernels import linear as kernel
from sysid.kernels.arrays import GONE, forget_what_has_died_away
from sysid.models.converting.orthonormal_basis import BasisSection, Domain, growth
from sysid.models.converting.realisation import Realisation, realise


@dataclass(frozen=True, kw_only=True, eq=False)
class TimeRecord(AbstractRecord):
    """A record over time, in scaled numbers.

    Args:
        inputs: Each input, delayed by its dead time, shape ``(n_rows, n_inputs)``.
        past: Value that each input has had for ever before, shape ``(n_inputs,)``.
        target: Measured output, shape ``(n_rows,)``.
        root_weights: Square root of each sample's weight, shape ``(n_rows,)``.
        domain: Of the bases.
        sample_time: Seconds; used for continuous bases.
        free_start: Whether the state before the first row is fitted, rather than the equilibrium at ``past``.
        moving: By input, whether it goes straight from sample to sample, for continuous bases; otherwise it is held.
        late: Of each input the part of a sample by which it is later still, for continuous bases; by default none.
        before: Of each input that is, its value in the row before the first, shape ``(n_inputs,)``.
    """

    inputs: NDArray[np.float64]
    past: NDArray[np.float64]
    target: NDArray[np.float64]
    root_weights: NDArray[np.float64]
    domain: Domain
    sample_time: float
    free_start: bool
    moving: tuple[bool, ...]
    late: tuple[float, ...] = ()
    before: NDArray[np.float64] | None = None

    def predictor(self, bases: Bases) -> MirroredPredictor | None:
        """From a fitted initial state alone; see the base class."""
        if not self.free_start:
            return None
        # Asked of every trial step: sections tell their poles in no time, a realisation and its eigenvalues do not.
        edge = 1.0 if self.domain is Domain.DISCRETE else 0.0
        if all(growth(section.denominator, self.domain) <= edge for basis in bases for section in basis):
            return None
        return _predictor(bases, tuple(map(self._sampling, range(len(bases)))), len(self.target))

    def private(self, bases: Bases) -> int:
        """The initial state, if it is fitted; see the base class."""
        return sum(section.order for basis in bases for section in basis) if self.free_start else 0

    def columns(self, bases: Bases) -> NDArray[np.float64]:
        """Responses to the inputs, then to a pulse before the record; see the base class."""
        through = self.predictor(bases)
        if through is not None:
            found = [through.responses(j, self.inputs[:, j]) for j in range(len(bases))]
            return np.concatenate([*found, through.beginnings()], axis=1)
        parts = [_pass(basis, self._sampling(j), *self._driven(j)) for j, basis in enumerate(bases)]
        if self.free_start:
            parts.append(_beginnings(bases, self.domain, self.sample_time, len(self.target)))
        return np.concatenate(parts, axis=1)

    def _sampling(self, j: int) -> _Sampling:
        return _Sampling(self.domain, self.sample_time, self.moving[j], self.late[j] if self.late else 0.0)

    def _driven(self, j: int) -> tuple[NDArray[np.float64], float, float]:
        """An input, what it has been for ever before, and the sample before its first."""
        past = float(self.past[j])
        return self.inputs[:, j], past, past if self.before is None else float(self.before[j])

    def tangents(self, bases: Bases, columns: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
        """One more pass through each section; see the base class."""
        parts = []
        own = tap_slices(bases)
        free = tap_slices(full(bases, self.domain)) if self.free_start else ()
        shared = own[-1].stop
        for j, basis in enumerate(bases):
            if self.domain is Domain.DISCRETE:
                y = columns[:, own[j]] @ weights[own[j]]
                past = float(_static_taps(basis, self.past[j]) @ weights[own[j]]) if self.past[j] != 0.0 else 0.0
                if free:
                    at = slice(shared + free[j].start, shared + free[j].stop)
                    y = y + columns[:, at] @ weights[at]
                parts.append(_discrete_tangents(basis, y, past))
            else:
                part = _continuous_tangents(basis, self._sampling(j), self._driven(j), weights[own[j]])
                if free:
                    at = slice(shared + free[j].start, shared + free[j].stop)
                    pulse = _pulse(self.domain, len(self.target))
                    held = _Sampling(self.domain, self.sample_time)
                    begun = _continuous_tangents(full(bases, self.domain)[j], held, (pulse, 0.0, 0.0), weights[at])
                    part = part + begun[-len(self.target) :]
                parts.append(part)
        return np.concatenate(parts, axis=1)


class _Sampling(NamedTuple):
    """How the samples of a system come from one another."""

    domain: Domain
    sample_time: float
    moving: bool = False
    late: float = 0.0

    def of(self, system: Realisation) -> Realisation:
        """The samples of a continuous system."""
        return system.sampled(self.sample_time, moving=self.moving, late=self.late)


def _continuous_tangents(
    basis: tuple[BasisSection, ...],
    how: _Sampling,
    driven: tuple[NDArray[np.float64], float, float],
    weights: NDArray[np.float64],
) -> NDArray[np.float64]:
    """The basis with every section once more behind its output, sampled as one system: driven by samples and a past."""
    main = realise(basis, how.domain)
    again = [realise((_bare(section),), how.domain) for section in basis]
    n, order = len(main.A), len(main.A) + sum(len(part.A) for part in again)
    A, C = np.zeros((order, order)), np.zeros((sum(len(part.C) for part in again), order))
    B = np.concatenate([main.B, np.zeros(order - n)])
    A[:n, :n] = main.A
    output = weights @ main.C
    at, row = n, 0
    for part in again:
        own = slice(at, at + len(part.A))
        A[own, own], A[own, :n] = part.A, np.outer(part.B, output)
        C[row : row + len(part.C), own] = part.C
        at, row = own.stop, row + len(part.C)
    whole = Realisation(A=A, B=B, C=-C, D=np.zeros(len(C)))
    return _run_sampled(whole, how, *driven)


@lru_cache(maxsize=32)
def _predictor(bases: Bases, each: tuple[_Sampling, ...], n_rows: int) -> MirroredPredictor | None:
    """The predictor over so many rows, made once for all records that are as long."""
    systems = _sampled(bases, each)
    return None if systems is None else MirroredPredictor.of(systems, n_rows)


@lru_cache(maxsize=32)
def _sampled(bases: Bases, each: tuple[_Sampling, ...]) -> tuple[Realisation, ...] | None:
    """What each input passes from sample to sample; ``None`` where it cannot be computed with."""
    systems = tuple(realise(basis, how.domain) for basis, how in zip(bases, each, strict=True))
    if each[0].domain is Domain.CONTINUOUS:
        fastest = max((float(np.abs(system.A).max(initial=0.0)) for system in systems), default=0.0)
        if not fastest * each[0].sample_time <= _FASTEST:
            return None
        systems = tuple(how.of(system) for system, how in zip(systems, each, strict=True))
    finite = all(np.isfinite(part).all() for one in systems for part in (one.A, one.B, one.C, one.D))
    return systems if finite else None


def _beginnings(bases: Bases, domain: Domain, sample_time: float, n_rows: int) -> NDArray[np.float64]:
    """What a pulse before a record leaves in it, made once for all records that are as long and not too long."""
    return (_kept_beginnings if n_rows <= _KEPT else _made_beginnings)(bases, domain, sample_time, n_rows)


def _made_beginnings(bases: Bases, domain: Domain, sample_time: float, n_rows: int) -> NDArray[np.float64]:
    """No longer than they last: what has died away is nothing, and takes longest to be followed."""
    m = min(n_rows, _FIRST)
    while True:
        pulse = _pulse(domain, m)
        made = np.concatenate(
            [_pass(basis, _Sampling(domain, sample_time), pulse, 0.0, 0.0)[-m:] for basis in full(bases, domain)],
            axis=1,
        )
        if m == n_rows or not np.abs(made[-_FIRST // 2 :]).max() >= GONE:
            break
        m = min(4 * m, n_rows)
    forget_what_has_died_away(made)
    return np.concatenate([made, np.zeros((n_rows - m, made.shape[1]))]) if m < n_rows else made


_FIRST = 4096
"""Rows over which a response is looked at first, for whether it lasts longer."""


_KEPT = 20_000
"""Rows up to which responses are kept for the next record."""
_kept_beginnings = lru_cache(maxsize=2)(_made_beginnings)


def _pulse(domain: Domain, n_rows: int) -> NDArray[np.float64]:
    """A pulse that leaves any state behind: in the first row, or before it where the output takes a sample."""
    return np.eye(n_rows + (domain is Domain.CONTINUOUS), 1)[:, 0]


def _pass(
    basis: tuple[BasisSection, ...], how: _Sampling, x: NDArray[np.float64], past: float, before: float
) -> NDArray[np.float64]:
    if how.domain is Domain.DISCRETE:
        return _discrete_columns(basis, x, past)
    return _run_sampled(realise(basis, how.domain), how, x, past, before)


def _bare(section: BasisSection) -> BasisSection:
    """The section alone, tapped at ``s`` and 1 over its denominator, the coefficients ``c1`` and ``c0``."""
    taps = np.array([[1.0, 0.0]]) if section.order == 1 else np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    return BasisSection(denominator=section.denominator, taps=taps, onward=np.eye(section.order + 1)[0])


_FASTEST = 1e8
"""Rate times sample time above which a trial step has left what can be sampled."""


def _run_sampled(
    system: Realisation, how: _Sampling, x: NDArray[np.float64], past: float, before: float
) -> NDArray[np.float64]:
    """A continuous system's outputs at the samples; NaN where its rates cannot be computed with."""
    y = np.full((len(x), len(system.C)), np.nan)
    rates = np.abs(system.A) * how.sample_time
    if not np.isfinite(rates).all() or rates.max() > _FASTEST:
        return y
    system = how.of(system)
    if not np.isfinite(system.A).all():
        return y
    state = system.equilibrium(past) if past != 0.0 else np.zeros(len(system.A))
    if how.late:
        state[-1] = before
    kernel.state_space(system.A, system.B[:, np.newaxis], system.C, system.D[:, np.newaxis], x[:, np.newaxis], state, y)
    return y


def _coefficients(section: BasisSection) -> tuple[float, float]:
    d = section.denominator
    return float(d[1]), float(d[2]) if len(d) == 3 else 0.0


def _discrete_columns(basis: Sequence[BasisSection], x: NDArray[np.float64], past: float) -> NDArray[np.float64]:
    n = len(x)
    columns = np.empty((n, sum(len(section.taps) for section in basis)), order="F")
    x = np.ascontiguousarray(x)
    v = np.empty(n + 2)
    at = 0
    for i, section in enumerate(basis):
        before = _held(past, section)
        v[:2] = before
        kernel.all_pole(x, *_coefficients(section), before, v[2:])
        delayed = (v[2:], v[1:-1], v[:-2])
        for numerator in section.taps:
            columns[:, at] = _combined(numerator, delayed)
            at += 1
        if i + 1 < len(basis):
            x = _combined(section.onward, delayed)
            past = before * float(section.onward.sum())
    return columns


def _held(past: float, section: BasisSection) -> float:
    """A section's all-pole output while its input is held; zero for no input, also where the section integrates."""
    return past / float(section.denominator.sum()) if past != 0.0 else 0.0


def _combined(numerator: NDArray[np.float64], delayed: tuple[NDArray[np.float64], ...]) -> NDArray[np.float64]:
    result = float(numerator[0]) * delayed[0]
    for weight, signal in zip(numerator[1:].tolist(), delayed[1:], strict=False):
        if weight:
            result += weight * signal
    return result


def _static_taps(basis: Sequence[BasisSection], past: float) -> NDArray[np.float64]:
    """Every tap while the input is held."""
    values: list[float] = []
    for section in basis:
        v = _held(past, section)
        values += [v * float(numerator.sum()) for numerator in section.taps]
        past = v * float(section.onward.sum())
    return np.array(values)


def _discrete_tangents(basis: Sequence[BasisSection], y: NDArray[np.float64], past: float) -> NDArray[np.float64]:
    n = len(y)
    result = np.empty((n, sum(section.order for section in basis)), order="F")
    y = np.ascontiguousarray(-y)
    v = np.empty(n + 2)
    at = 0
    for section in basis:
        before = -_held(past, section)
        v[:2] = before
        kernel.all_pole(y, *_coefficients(section), before, v[2:])
        for lag in range(1, section.order + 1):
            result[:, at] = v[2 - lag : n + 2 - lag]
            at += 1
    return result
