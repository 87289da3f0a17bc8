"""Linear models as objects of python-control, for Bode and step responses, pole-zero maps and controller design.

They relate deviations from an operating point: python-control has no place for a model's constant. The package is
imported when a function is called, because it takes half a second.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.models.arx import ARXModel
from sysid.models.orthonormal_basis import Domain
from sysid.models.transfer_function import TransferFunctionModel


def arx_transfer_function(model: ARXModel) -> Any:
    """An ARX model as ``control.TransferFunction``.

    Args:
        model: The model.

    Returns:
        One row, one column per input, with the model's sample time.
    """
    import control

    F = np.concatenate([[1.0], -model.a])
    B = [
        np.concatenate([np.zeros(nk), b, [0.0] * (not len(b))]) for b, nk in zip(model.b, model.orders.nk, strict=True)
    ]
    pairs = [_in_powers_of_z(b, F) for b in B]
    return control.TransferFunction(
        [[num for num, _ in pairs]],
        [[den for _, den in pairs]],
        model.sample_time,
        inputs=list(model.mapping.inputs),
        outputs=[model.mapping.output],
    )


def transfer_function(model: TransferFunctionModel, *, pade_order: int = 3) -> Any:
    """A transfer function as ``control.TransferFunction``.

    Args:
        model: The model.
        pade_order: Order of the Padé approximation of a continuous model's dead time.

    Returns:
        One row, one column per input; discrete with the model's sample time, or continuous. The polynomials of many
        poles carry fewer digits than :func:`state_space`.
    """
    import control

    discrete = model.orders.domain is Domain.DISCRETE
    nums, dens = [], []
    for j, delay in enumerate(model.delays):
        B, F = model.numerator(j), model.denominator(j)
        if discrete:
            num, den = _in_powers_of_z(np.concatenate([np.zeros(delay), B]), F)
        else:
            num, den = B[::-1], F[::-1]
            if delay:
                dead_num, dead_den = control.pade(delay * model.sample_time, pade_order)
                num, den = np.convolve(num, dead_num), np.convolve(den, dead_den)
        nums.append(num)
        dens.append(den)
    return control.TransferFunction(
        [nums],
        [dens],
        model.sample_time if discrete else 0,
        inputs=list(model.mapping.inputs),
        outputs=[model.mapping.output],
    )


def state_space(model: ARXModel | TransferFunctionModel) -> Any:
    """A linear model as a discrete ``control.StateSpace`` in the channels' units: exactly the recursion that is run.

    Args:
        model: The model. A continuous one is sampled, its inputs held, its dead times exact.

    Returns:
        The state space, with the model's sample time.
    """
    import control

    A, B, C, D = _lag_matrices(model) if isinstance(model, ARXModel) else _matrices(model)
    return control.StateSpace(
        A, B, C, D, model.sample_time, inputs=list(model.mapping.inputs), outputs=[model.mapping.output]
    )


Matrices = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


def _matrices(model: TransferFunctionModel) -> Matrices:
    form = model.recursion
    gain, scale = form.scaling.output_scale, np.array(form.scaling.input_scale)
    return form.A, form.B / scale, gain * form.C[np.newaxis], gain * form.D[np.newaxis] / scale


def _lag_matrices(model: ARXModel) -> Matrices:
    """Delay lines of the output and of each input as a state, newest first."""
    lags = model.orders.lags
    lengths = [len(lags.output), *(max(per, default=0) for per in lags.inputs)]
    first = np.concatenate([[0], np.cumsum(lengths)])
    n, m = int(first[-1]), lags.n_inputs
    C, D = np.zeros((1, n)), np.zeros((1, m))
    C[0, : lengths[0]] = model.a
    for j, (per, b) in enumerate(zip(lags.inputs, model.b, strict=True)):
        for lag, weight in zip(per, b.tolist(), strict=True):
            if lag == 0:
                D[0, j] = weight
            else:
                C[0, first[1 + j] + lag - 1] = weight
    A, B = np.eye(n, k=-1), np.zeros((n, m))
    for j, (at, length) in enumerate(zip(first[:-1], lengths, strict=True)):
        if length:
            A[at] = C[0] if j == 0 else 0.0
            B[at] = D[0] if j == 0 else np.eye(m)[j - 1]
    return A, B, C, D


def _in_powers_of_z(B: NDArray[np.float64], F: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Polynomials in ``1/z`` as polynomials in ``z`` of the same ratio, descending."""
    n = max(len(B), len(F))
    return np.pad(B, (0, n - len(B))), np.pad(F, (0, n - len(F)))
