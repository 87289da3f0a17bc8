"""Free runs of one recursion for many cars at once; the recursion itself is ``sysid.kernels.recursion.free_run``."""

from __future__ import annotations

import numpy as np
from numba import njit

from sysid.kernels.recursion import free_run


@njit(cache=True, nogil=True)
def advance(u, y, depth, n_steps, input_channel, input_lag, output_lag, theta, n_neurons, kinds, bounds):
    """Run every car over the same steps, writing ``y[:, depth:]`` in place.

    Args:
        u: Scaled inputs with history, shape ``(cars, depth + n_steps, n_inputs)``.
        y: Scaled outputs with history, shape ``(cars, depth + n_steps)``.
        depth: Past samples before step 0.
        n_steps: Steps to run.
        input_channel: As in the recursion.
        input_lag: As in the recursion.
        output_lag: As in the recursion.
        theta: Parameters of each car, shape ``(cars, n_parameters)``.
        n_neurons: Number of neurons.
        kinds: Code of their kind in each car's model, shape ``(cars,)``.
        bounds: Lower and upper bound of each car's output, shape ``(cars, 2)``.
    """
    kept, held = np.empty((0, 0)), np.empty((0, 0), dtype=np.int8)
    for car in range(len(u)):
        free_run(
            u[car], y[car], y[car], depth, n_steps, input_channel, input_lag, output_lag, theta[car], n_neurons,
            kinds[car], bounds[car, 0], bounds[car, 1], kept, held,
        )  # fmt: skip
