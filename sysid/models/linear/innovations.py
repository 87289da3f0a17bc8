"""Linear state spaces in innovations form, as matrices: what subspace methods find and prediction errors refine."""

from __future__ import annotations

import math
from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.linalg import lapack

from sysid.kernels import innovations as kernel
from sysid.models.linear.at_rest import state_at_rest

Array = NDArray[np.float64]

_CLEARLY, _EDGE = 10.0, 1e-3
"""How many times smaller numbers have to get for other coordinates; and how far from the unit circle poles are taken to
stand when those are looked for."""
_TINY, _TOGETHER = 1e-100, 1e12
"""What no number is divided by; and how nearly alike modes may be to be told apart."""

_NAMES = ("A", "B", "C", "D", "K", "constant")


@dataclass(frozen=True, kw_only=True, eq=False)
class Innovations:
    r"""``x(t+1) = A x + B u + K e``, ``y = C x + D u + c + e`` with white innovations ``e``.

    Args:
        A: Shape ``(n_state, n_state)``.
        B: Shape ``(n_state, n_inputs)``.
        C: Shape ``(n_outputs, n_state)``.
        D: Shape ``(n_outputs, n_inputs)``.
        K: Shape ``(n_state, n_outputs)``; zeros where the noise is added to the output.
        constant: Output without inputs, shape ``(n_outputs,)``.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    K: Array
    constant: Array

    def __post_init__(self) -> None:
        for name in _NAMES:
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name)))

    def to_dict(self) -> dict[str, Any]:
        """The matrices as JSON values."""
        return {name: getattr(self, name).tolist() for name in _NAMES}

    @classmethod
    def from_dict(cls, fields: Dict[str, Any]) -> Innovations:
        """The system that :meth:`to_dict` wrote."""
        p, n = len(fields["constant"]), len(fields["A"])
        shapes = {"A": (n, n), "B": (n, -1), "C": (p, n), "D": (p, -1), "K": (n, p), "constant": (p,)}
        parts = {name: np.asarray(fields[name], dtype=np.float64).reshape(shape) for name, shape in shapes.items()}
        return cls(**parts)

    @property
    def entries(self) -> Array:
        """Every entry of every matrix, row by row: ``A``, ``B``, ``C``, ``D``, ``K``, the constant."""
        return np.concatenate([getattr(self, name).ravel() for name in _NAMES])

    def at(self, entries: Array) -> Innovations:
        """The system of this size with other entries, in the order of :attr:`entries`."""
        parts, first = {}, 0
        for name in _NAMES:
            shape = getattr(self, name).shape
            last = first + math.prod(shape)
            parts[name], first = entries[first:last].reshape(shape), last
        return Innovations(**parts)

    @property
    def n_state(self) -> int:
        """Length of the state."""
        return len(self.A)

    @property
    def n_inputs(self) -> int:
        """Number of inputs."""
        return int(self.B.shape[1])

    @property
    def n_outputs(self) -> int:
        """Number of outputs."""
        return len(self.C)

    @cached_property
    def predictor(self) -> Array:
        """The state matrix of the one-step predictor, ``A - K C``."""
        return np.asarray(self.A - self.K @ self.C)

    @cached_property
    def radius(self) -> float:
        """Largest magnitude of a pole."""
        return spectral_radius(self.A)

    @cached_property
    def predictor_radius(self) -> float:
        """Largest magnitude of a pole of the one-step predictor; that of the system where no noise is modelled."""
        return self.radius if np.array_equal(self.predictor, self.A) else spectral_radius(self.predictor)

    def poles(self) -> NDArray[np.complex128]:
        """Eigenvalues of ``A``."""
        return np.asarray(scipy.linalg.eigvals(self.A) if self.n_state else np.zeros(0), dtype=np.complex128)

    def predicted(self, inputs: Array, outputs: Array, x: Array) -> tuple[Array, Array]:
        """One-step prediction over a record.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``.
            outputs: Measured, shape ``(n_samples, n_outputs)``.
            x: State before the first sample; becomes the state after the last one.

        Returns:
            The prediction, shape ``(n_samples, n_outputs)``, and the states it was made from.
        """
        states, predicted = np.empty((len(inputs), self.n_state)), np.empty((len(inputs), self.n_outputs))
        matrices = (self.A, self.B, self.C, self.D, self.K, self.constant)
        kernel.predict(*matrices, np.ascontiguousarray(inputs), np.ascontiguousarray(outputs), x, states, predicted)
        return predicted, states

    def simulated(self, inputs: Array, x: Array) -> Array:
        """Free run over some inputs; ``x`` becomes the state after them."""
        return self.without_noise().predicted(inputs, np.full((len(inputs), self.n_outputs), np.nan), x)[0]

    def without_noise(self) -> Innovations:
        """The same system without a model of its noise."""
        return replace(self, K=np.zeros_like(self.K))

    def standing(self, inputs: Array, outputs: Array) -> Array:
        """The predictor's state after inputs and outputs that have stood at some values for ever.

        Without a model of the noise outputs have a say where the system integrates alone.

        Args:
            inputs: Shape ``(n_inputs,)``.
            outputs: Shape ``(n_outputs,)``.

        Returns:
            Shape ``(n_state,)``; the shortest where there are many.
        """
        if not self.K.any():
            return state_at_rest((self.A, self.B, self.C, self.D, self.constant), inputs, outputs)
        drive = self.B @ inputs + self.K @ (outputs - self.D @ inputs - self.constant)
        return np.asarray(scipy.linalg.lstsq(np.eye(self.n_state) - self.predictor, drive, cond=1e-9)[0])

    def padded(self, states: int) -> Innovations:
        """The same system with states more that nothing reaches and nobody sees."""
        more = states - self.n_state
        if more <= 0:
            return self
        below, beside = ((0, more), (0, 0)), ((0, 0), (0, more))
        return replace(
            self,
            A=np.pad(self.A, (0, more)),
            B=np.pad(self.B, below),
            C=np.pad(self.C, beside),
            K=np.pad(self.K, below),
        )

    def behind(self, shifts: Sequence[int]) -> Innovations:
        """The same system with inputs that come later, by states that hand them on from sample to sample.

        Args:
            shifts: By how many samples each input is late.

        Returns:
            The system; its own states stand first.
        """
        n, at = self.n_state, self.n_state
        if not any(shifts):
            return self
        system = self.padded(n + sum(shifts))
        A, B, C, D = (part.copy() for part in (system.A, system.B, system.C, system.D))
        for j, k in enumerate(shifts):
            if not k:
                continue
            last = at + k - 1
            A[at + 1 : at + k, at:last] = np.eye(k - 1)
            A[:n, last], C[:, last] = self.B[:, j], self.D[:, j]
            B[:, j], D[:, j] = 0.0, 0.0
            B[at, j] = 1.0
            at += k
        return replace(system, A=A, B=B, C=C, D=D)

    def in_coordinates(self, T: Array, back: Array) -> Innovations:
        """The same system with the state ``T x``, where ``back`` is the inverse of ``T``."""
        return replace(self, A=T @ self.A @ back, B=T @ self.B, C=self.C @ back, K=T @ self.K)

    def balanced(self) -> Innovations:
        """The same system in coordinates in which its stable predictor is balanced.

        Returns:
            The system; as it is where a state is neither reached nor seen, or the Gramians cannot be computed.
        """
        if self.n_state == 0 or self.predictor_radius >= 1.0:
            return self
        drive = np.concatenate([self.B - self.K @ self.D, self.K], axis=1)
        return self.in_coordinates(*self._balance(self.predictor, drive))

    def steady(self) -> tuple[Array, Array] | None:
        """Coordinates in which a free run loses no digits.

        Of a record with hardly any noise the predictor forgets at once what the system keeps for long: balanced for the
        one, the matrices of the other have entries of thousands that cancel in each step.

        Returns:
            ``T`` and its inverse, for :meth:`in_coordinates`; ``None`` where they are hardly better, or cannot be
            computed.
        """
        if not self.n_state or not np.isfinite(self.entries).all():
            return None
        poles, vectors = scipy.linalg.eig(self.A)
        kept = [k for k, pole in enumerate(poles) if pole.imag >= 0.0]
        parts = [part for k in kept for part in (vectors[:, k].real, vectors[:, k].imag)[: 1 + bool(poles[k].imag)]]
        try:
            back = np.column_stack(parts)
            if not np.linalg.cond(back) < _TOGETHER:
                return None
            T = np.linalg.inv(back)
            # Each mode is driven as much as it is seen: enough where one is so little of either that it stays so.
            reached, seen = np.linalg.norm(T @ self.B, axis=1), np.linalg.norm(self.C @ back, axis=0)
            size = np.sqrt(np.maximum(seen, _TINY) / np.maximum(reached, _TINY))
            T, back = size[:, np.newaxis] * T, back / size
            modal = self.in_coordinates(T, back)
            U, V = modal._balance(modal.A * ((1.0 - _EDGE) / max(1.0, self.radius)), modal.B)
            T, back = U @ T, back @ V
        except np.linalg.LinAlgError:
            return None
        better = _CLEARLY * self.in_coordinates(T, back)._cancelling < self._cancelling
        return (T, back) if better else None

    @property
    def _cancelling(self) -> float:
        """How large the numbers are whose sums a free run is."""
        across = float(np.linalg.norm(self.B) * np.linalg.norm(self.C))
        return max(float(np.linalg.norm(self.A)), across)

    def _balance(self, A: Array, drive: Array) -> tuple[Array, Array]:
        """Coordinates in which a stable matrix with these drives and the outputs is balanced, and back; or none."""
        none = np.eye(self.n_state)
        try:
            P = root_of(_gramian(A, drive @ drive.T))
            Q = root_of(_gramian(A.T, self.C.T @ self.C))
            U, sizes, Vt = scipy.linalg.svd(Q.T @ P)
            if not sizes[-1] > 1e-12 * sizes[0]:
                return none, none
            # Both directions come from the factors: nothing is inverted but the singular values.
            return (U / np.sqrt(sizes)).T @ Q.T, P @ Vt.T / np.sqrt(sizes)
        except (np.linalg.LinAlgError, ValueError):
            return none, none


def spectral_radius(A: Array) -> float:
    """Largest magnitude of an eigenvalue; infinite where it cannot be told."""
    if not len(A):
        return 0.0
    if not np.isfinite(A).all():
        return np.inf
    # Straight to LAPACK: a search asks at every step, of matrices for which SciPy's wrapper takes most of the time.
    real, imaginary, _, _, wrong = lapack.dgeev(A, compute_vl=0, compute_vr=0, lwork=_room(len(A)))
    return np.inf if wrong else float(np.abs(real + 1j * imaginary).max())


@cache
def _room(n: int) -> int:
    """What LAPACK takes for the eigenvalues of ``n`` rows in blocks."""
    return int(lapack.dgeev_lwork(n, compute_vl=0, compute_vr=0)[0])


def _gramian(A: Array, Q: Array) -> Array:
    """The sum of ``A^k Q A'^k`` over all ``k``, by doubling (Smith 1968); right however near to 1 a pole is."""
    P, power = Q, A
    for _ in range(60):
        more = power @ P @ power.T
        P = P + more
        if not np.abs(more).max(initial=0.0) > 1e-16 * np.abs(P).max(initial=0.0):
            break
        power = power @ power
    return P


def root_of(gramian: Array) -> Array:
    """A factor ``G`` with ``G G' `` the Gramian, whose small eigenvalues rounding may have made negative."""
    sizes, vectors = scipy.linalg.eigh(0.5 * (gramian + gramian.T))
    return np.asarray(vectors * np.sqrt(np.maximum(sizes, 0.0)))
