r"""Prediction errors of a state space, with exact gradients, as a function of its local coordinates.

The initial state of a record enters its predictions linearly, through :math:`\tilde A^t`; it is eliminated by
projection (Golub and Pereyra 1973; Kaufman 1975), so that a hundred records cost no more parameters than one. Records
that begin at rest have the state of inputs and outputs that stood; its dependence on the matrices is part of the
gradient.
Errors of several outputs are weighted by the inverse of their covariance, which makes least squares the maximum of the
likelihood once the covariance has settled.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.least_squares.provider import AbstractProvider, Linearisation
from sysid.estimation.linear.segments import Segment
from sysid.estimation.linear.state_space.coordinates import AbstractChart, Directions
from sysid.estimation.linear.subspace.system import EDGE
from sysid.kernels import innovations as kernel
from sysid.models.linear.innovations import Innovations

Array = NDArray[np.float64]

ROWS = 8_192
"""Samples whose gradient is held at a time."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Run:
    """The prediction over one record, from its initial state.

    Args:
        start: The initial state.
        residual: Prediction minus measurement, shape ``(n_samples, n_outputs)``, unweighted.
        states: Shape ``(n_samples, n_state)``.
        free: Responses of the outputs to the initial state, shape ``(n_outputs, n_rows, n_state)``, as long as they
            last.
        span: Orthonormal basis of the weighted responses, rows by sample and output; empty for a declared start.
    """

    start: Array
    residual: Array
    states: Array
    free: Array
    span: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class PredictionErrors(AbstractProvider):
    """One-step errors over some records.

    Args:
        chart: What the parameters are.
        segments: The records, in scaled numbers; where the noise is modelled, without gaps.
        whitening: What errors of one sample are multiplied with, shape ``(n_outputs, n_outputs)``.
        stable: Whether poles outside the unit circle are refused.
        largest: Magnitude from which they are then.
    """

    chart: AbstractChart
    segments: Sequence[Segment]
    whitening: Array
    stable: bool
    largest: float = EDGE
    n_samples: int = field(init=False)
    _last: dict[bytes, tuple[Run, ...]] = field(init=False, repr=False, default_factory=dict)

    def __post_init__(self) -> None:
        counted = sum(int(np.count_nonzero(segment.root_weights)) for segment in self.segments)
        object.__setattr__(self, "n_samples", counted * len(self.whitening))

    def loss(self, theta: Array) -> float:
        """Half the weighted sum of squares; infinite where the predictor is not stable."""
        system = self.chart.system(theta)
        if not self.allowed(system):
            return np.inf
        total = 0.0
        with np.errstate(all="ignore"):
            for segment, run in zip(self.segments, self._runs(theta, system), strict=True):
                total += 0.5 * float(np.sum(self.weighted(run.residual, segment) ** 2))
        return total if np.isfinite(total) else np.inf

    def _runs(self, theta: Array, system: Innovations) -> tuple[Run, ...]:
        """The predictions over all records; of a step that is tried and then taken they are made once."""
        key = theta.tobytes()
        if key not in self._last:
            found = tuple(self.run(system, segment) for segment in self.segments)
            self._last.clear()
            self._last[key] = found
        return self._last[key]

    def allowed(self, system: Innovations) -> bool:
        """Whether a system may be a step: its predictor is stable and, where that is asked, the system too."""
        with_noise = bool(system.K.any())
        if with_noise and not system.predictor_radius < 1.0:
            return False
        return system.radius < self.largest if self.stable else system.radius < _LOST

    def linearise(self, theta: Array, *, correlation: bool = True) -> Linearisation:  # noqa: ARG002 - it is 1
        """Loss, gradient and Gauss-Newton matrix; see the base class."""
        system, P = self.chart.system(theta), self.chart.n_parameters
        loss, g, H = 0.0, np.zeros(P), np.zeros((P, P))
        width = system.n_outputs
        with np.errstate(all="ignore"):
            for segment, run, blocks in self.jacobians(theta):
                weighted, seen = self.weighted(run.residual, segment), np.zeros((run.span.shape[1], P))
                for rows, block in blocks:
                    J = block.reshape(-1, P)
                    r = weighted[rows].ravel()
                    loss += 0.5 * float(r @ r)
                    g += J.T @ r
                    H += J.T @ J
                    part = run.span[rows.start * width : rows.stop * width]
                    seen += part.T @ J[: len(part)]
                H -= seen.T @ seen
        if not np.isfinite(loss):
            return Linearisation(loss=np.inf, gradient=np.zeros(P), gauss_newton=np.eye(P))
        diagonal = np.diag(H)
        floor = max(float(diagonal.max(initial=0.0)), np.finfo(np.float64).tiny) * 1e-24
        H[np.diag_indices_from(H)] = np.maximum(diagonal, floor)
        return Linearisation(loss=loss, gradient=g, gauss_newton=H)

    def jacobians(self, theta: Array) -> Iterator[tuple[Segment, Run, Iterator[tuple[slice, Array]]]]:
        """Derivatives of the weighted errors, record by record and block by block, from initial states that stay.

        Args:
            theta: The vector.

        Yields:
            A record, its prediction, and some samples with their derivatives, shape ``(n_rows, n_outputs,
            n_parameters)``.
        """
        system = self.chart.system(theta)
        reach = _Reach.of(self.chart.directions(theta), system)
        for segment, run in zip(self.segments, self._runs(theta, system), strict=True):
            yield segment, run, self._blocks(segment, run, reach)

    def _blocks(self, segment: Segment, run: Run, reach: _Reach) -> Iterator[tuple[slice, Array]]:
        system, width = reach.system, reach.system.n_outputs
        z = np.zeros((width, reach.n_sources, system.n_state))
        for first in range(0, len(segment), ROWS):
            rows = slice(first, min(first + ROWS, len(segment)))
            J = reach.jacobian(segment, run, rows, z)
            J = np.einsum("ij,tjk->tik", self.whitening, J) if width > 1 else J * self.whitening[0, 0]
            yield rows, J * segment.root_weights[rows, np.newaxis, np.newaxis]

    def run(self, system: Innovations, segment: Segment) -> Run:
        """The prediction over a record, from the initial state that fits it best or that was declared."""
        free = _free_response(system, len(segment))
        x = np.zeros(system.n_state) if segment.rest is None else system.standing(*segment.rest)
        start, span = x.copy(), np.zeros((0, 0))
        with np.errstate(all="ignore"):
            predicted, states = system.predicted(segment.inputs, segment.outputs, x)
            residual = predicted - segment.outputs
            if segment.rest is None and system.n_state and np.isfinite(residual).all():
                n = free.shape[1]
                columns = np.einsum("ij,jtk->tik", self.whitening, free)
                columns = (columns * segment.root_weights[:n, np.newaxis, np.newaxis]).reshape(-1, system.n_state)
                size = np.linalg.norm(columns, axis=0)
                scale = np.where(size > 0.0, size, 1.0)
                U, sizes, Vt = linalg.svd(columns / scale, full_matrices=False)
                kept = sizes > 1e-11 * max(float(sizes[0]), 1e-300)
                span = U[:, kept]
                seen = span.T @ self.weighted(residual, segment)[:n].ravel()
                start = -((Vt[kept].T / sizes[kept]) @ seen) / scale
                # What the state before the record changes is added where it lasts: as exact as another run.
                residual[:n] += np.einsum("otk,k->to", free, start)
                states = states + _states_from(system, start, len(segment))
        return Run(start=start, residual=residual, states=states, free=free, span=span)

    def covariance(self, system: Innovations) -> Array:
        """Covariance of the errors that count."""
        count = sum(int(np.count_nonzero(segment.root_weights)) for segment in self.segments)
        total = np.zeros((system.n_outputs, system.n_outputs))
        for r in self.errors(system):
            total += r.T @ r
        return total / max(count, 1)

    def errors(self, system: Innovations) -> list[Array]:
        """Errors of each record, those that do not count as zero."""
        found = []
        for segment in self.segments:
            residual = self.run(system, segment).residual * segment.root_weights[:, np.newaxis]
            found.append(np.where(segment.root_weights[:, np.newaxis] > 0.0, residual, 0.0))
        return found

    def weighted(self, residual: Array, segment: Segment) -> Array:
        """Errors of a record as they count: each of size 1, and independent of the others of its sample."""
        return np.asarray((residual @ self.whitening.T) * segment.root_weights[:, np.newaxis])


_LOST = 1.5
"""Radius of a system beyond which a free run is lost within some hundred samples."""


def _lasting(system: Innovations, n: int) -> int:
    """Samples after which an initial state no longer shows."""
    rate = system.predictor_radius
    if rate <= 0.0:
        return min(n, 10 * system.n_state + 10)
    if rate >= 1.0 - 1e-9:
        return n
    return min(n, int(np.ceil(np.log(1e-15) / np.log(rate))) + 10 * system.n_state + 10)


def _free_response(system: Innovations, n: int) -> Array:
    """What a unit of each state before the first sample does to the outputs, as long as it lasts."""
    length = _lasting(system, n)
    pulse = np.zeros((length + 1, 1))
    pulse[0] = 1.0
    out = np.empty((system.n_outputs, length + 1, system.n_state))
    z = np.zeros((system.n_outputs, 1, system.n_state))
    kernel.responses(np.ascontiguousarray(system.predictor.T), system.C, pulse, z, out)
    return out[:, 1:]


def _states_from(system: Innovations, start: Array, n: int) -> Array:
    """The states that follow from an initial one alone, through the predictor."""
    found, length = np.zeros((n, system.n_state)), _lasting(system, n)
    none = np.zeros((system.n_state, 1))
    alone = Innovations(
        A=system.predictor, B=none, C=np.zeros((1, system.n_state)), D=np.zeros((1, 1)), K=none, constant=np.zeros(1)
    )
    _, found[:length] = alone.predicted(np.zeros((length, 1)), np.full((length, 1), np.nan), start.copy())
    return found


@dataclass(frozen=True, kw_only=True, eq=False)
class _Reach:
    """How parameters act through sources, one row of the state each, and at once.

    Args:
        system: The system.
        sources: Which of states, inputs, errors and the constant act through the state.
        through: From responses to parameters, shape ``(n_sources * n_state, n_parameters)``.
        direct: For each output from states, inputs and the constant, shape ``(n_outputs, n + m + 1, n_parameters)``.
        moved: What the parameters do to an equilibrium: of ``A`` and of ``B``, shapes ``(n, n, n_parameters)`` and
            ``(n, m, n_parameters)``.
    """

    system: Innovations
    sources: NDArray[np.intp]
    through: Array
    direct: Array
    moved: tuple[Array, Array]

    @classmethod
    def of(cls, d: Directions, system: Innovations) -> _Reach:
        """The reach of parameters that move a system's matrices in these directions."""
        K, n, P = system.K, system.n_state, d.A.shape[-1]
        acts = np.concatenate(
            [
                np.swapaxes(d.A - np.einsum("ik,kjp->ijp", K, d.C), 0, 1),
                np.swapaxes(d.B - np.einsum("ik,kjp->ijp", K, d.D), 0, 1),
                np.swapaxes(d.K, 0, 1),
                -(K @ d.constant)[np.newaxis],
            ]
        )  # sources, rows of the state, parameters
        sources = np.flatnonzero(np.abs(acts).max(axis=(1, 2), initial=0.0))
        direct = np.concatenate([d.C, d.D, d.constant[:, np.newaxis]], axis=1)
        return cls(
            system=system,
            sources=sources,
            through=acts[sources].reshape(len(sources) * n, P),
            direct=direct,
            moved=(d.A, d.B),
        )

    @property
    def n_sources(self) -> int:
        """How many act through the state."""
        return len(self.sources)

    def jacobian(self, segment: Segment, run: Run, rows: slice, z: Array) -> Array:
        """Derivatives of the predictions of some samples, shape ``(n_rows, n_outputs, n_parameters)``; moves ``z``."""
        system, count = self.system, rows.stop - rows.start
        ones = np.ones((count, 1))
        signals = np.concatenate([run.states[rows], segment.inputs[rows], -run.residual[rows], ones], axis=1)
        out = np.empty((system.n_outputs, count, self.through.shape[0]))
        chosen = np.ascontiguousarray(signals[:, self.sources])
        kernel.responses(np.ascontiguousarray(system.predictor.T), system.C, chosen, z, out)
        now = np.concatenate([run.states[rows], segment.inputs[rows], ones], axis=1)
        J = np.empty((count, system.n_outputs, self.through.shape[1]))
        for o in range(system.n_outputs):
            J[:, o] = out[o] @ self.through + now @ self.direct[o]
        if segment.rest is not None and rows.start < run.free.shape[1]:
            inputs, outputs = segment.rest
            innovation = outputs - system.C @ run.start - system.D @ inputs - system.constant
            stood = np.concatenate([run.start, inputs, innovation, np.ones(1)])[self.sources]
            change = np.einsum("s,sip->ip", stood, self.through.reshape(self.n_sources, system.n_state, -1))
            moved = linalg.lstsq(np.eye(system.n_state) - system.predictor, change, cond=1e-9)[0]
            last = min(rows.stop, run.free.shape[1])
            J[: last - rows.start] += np.einsum("otk,kp->top", run.free[:, rows.start : last], moved)
        return J
