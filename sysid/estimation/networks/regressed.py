r"""Where a random start begins: its hidden layer as drawn, what is linear in its parameters by least squares.

Once the hidden weights are drawn, a network is linear in all other parameters (the variable projection of Golub and
Pereyra 1973, doi:10.1137/0710036, taken once). One step ahead, on measured regressors, these are a linear least squares
problem. It costs about as much as one iteration of the free run, and saves the dozen that lead from "the output stays
as it is" to a model that follows the record roughly.

The least error one step ahead says little of the free run: noise in the past outputs biases it, and large weights of
opposite sign, which few samples tell apart, run away where outputs feed back. So it is solved with each of
:data:`RIDGES`, which hold the neurons' weights (and gates) back but not the linear part. Of the starts whose free run
over the same records is about as close as the closest one's, the one that is held back most is taken, or the drawn one
where none is closer.

Limits: samples are those of the fit, so that a record of few samples is followed closely by weights that mean little
elsewhere; the evidence has to shrink them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.provider import AbstractProvider
from sysid.estimation.least_squares.small_matrices import cholesky, solved
from sysid.estimation.networks.pretraining import StepSamples

RIDGES = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)
"""What holds the readout back, in units of the mean square of what it weighs. Sampled fast, a step is a thousandth of
the range, and takes the small ones."""

ALIKE = 4.0
"""Of losses that are no reason to take the weaker of two ridges: a factor of two of the error."""

AFFINE = 1e-8
"""The same for constant and linear part, parameter by parameter: so that two alike columns have a solution."""


def regressed(theta: NDArray[np.float64], samples: StepSamples, provider: AbstractProvider) -> NDArray[np.float64]:
    """A start whose linear parameters are those of the least error one step ahead, where its run is then closer.

    Args:
        theta: The start as it was drawn, in the basis of training, shape ``(n_parameters,)``.
        samples: One-step residuals in the same basis.
        provider: What is trained: its loss chooses.

    Returns:
        Parameters of the same shape; as drawn where nothing is closer.
    """
    layout, at = samples.layout, samples.linearise(theta)
    if not at.finite:
        return theta
    neurons = np.r_[layout.readout, layout.gates]
    places = np.r_[neurons, layout.affine]
    matrix, gradient = at.gauss_newton[np.ix_(places, places)], at.gradient[places]
    weighed, affine = np.split(np.diag(matrix), [len(neurons)])
    closer: list[tuple[float, NDArray[np.float64]]] = []
    drawn = provider.loss(theta)
    for ridge in RIDGES:
        held = np.concatenate([np.full(len(neurons), ridge * weighed.sum() / max(1, len(neurons))), AFFINE * affine])
        factor = cholesky(matrix + np.diag(held))
        if factor is None:
            continue
        moved = theta.copy()
        moved[places] -= solved(factor, gradient)
        loss = provider.loss(moved)
        if loss < drawn:
            closer.append((loss, moved))
    least = min((loss for loss, _ in closer), default=drawn)
    return next((moved for loss, moved in reversed(closer) if loss <= ALIKE * least), theta)
