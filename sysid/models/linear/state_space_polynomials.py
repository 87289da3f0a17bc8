"""A linear state space as polynomials in ``1/z``, and what their coefficients are called."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sysid.models.channels.mapping import Mapping
from sysid.models.linear.innovations import Innovations

if TYPE_CHECKING:
    from sysid.models.linear.linear_state_space import LinearStateSpace


def state_space_names(orders: LinearStateSpace, mapping: Mapping) -> tuple[str, ...]:
    """What the coefficients of a state space's polynomials are called.

    Args:
        orders: The structure, with its dead times.
        mapping: Its channels.

    Returns:
        ``B(input, lag)``, ``F(lag)``, ``C(lag)`` of the innovations and ``constant``; of several outputs
        ``B(output, input, lag)``, ``F(lag)``, ``C(output, innovation, lag)`` and ``constant(output)``.
    """
    outputs, first, n = mapping.outputs, orders.shortest, orders.states
    of = [""] if len(outputs) == 1 else [f"{name}, " for name in outputs]
    late = zip(mapping.inputs, orders.shifts(len(mapping.inputs)), strict=True)
    lags = {u: range(first + k, n + 1 + k) for u, k in late}
    names = [f"B({o}{u}, {lag})" for o in of for u, at in lags.items() for lag in at]
    names += [f"F({lag})" for lag in range(1, n + 1)]
    names += [f"C({o}{e}{lag})" for o in of for e in of for lag in range(1, n + 1)] * orders.noise
    single = len(outputs) == 1
    return (*names, *(["constant"] if single else [f"constant({name})" for name in outputs]) * orders.intercept)


def polynomials(system: Innovations) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    r"""A state space as polynomials in ``1/z``, by Faddeev and LeVerrier.

    :math:`\det(I - A q^{-1})` and :math:`C\,\mathrm{adj}(I - A q^{-1})\,B q^{-1} + D \det` come out of one
    recursion of products and sums, so that complex steps give exact derivatives.

    Args:
        system: The system.

    Returns:
        The denominator, shape ``(n + 1,)``; the numerators of inputs, shape ``(n_outputs, n_inputs, n + 1)``; and those
        of innovations, shape ``(n_outputs, n_outputs, n + 1)``.
    """
    A, n = system.A, system.n_state
    drive = np.concatenate([system.B, system.K], axis=1)
    direct = np.concatenate([system.D, np.eye(system.n_outputs)], axis=1)
    F = np.zeros(n + 1, dtype=A.dtype)
    F[0] = 1.0
    rows = np.zeros((system.n_outputs, drive.shape[1], n + 1), dtype=A.dtype)
    M = np.eye(n, dtype=A.dtype)
    for k in range(1, n + 1):
        rows[:, :, k] = system.C @ M @ drive
        AM = A @ M
        F[k] = -np.trace(AM) / k
        M = AM + F[k] * np.eye(n)
    rows += direct[:, :, np.newaxis] * F
    m = system.n_inputs
    return F, rows[:, :m], rows[:, m:]
