"""The thermal network compiled: in its own modes it is linear, but for what its cooled face radiates.

Each mode is integrated exactly over a part of a sample, with the radiation as a polynomial through its values at a few
nodes, which are found by fixed-point iteration (exponential collocation, Hochbruck and Ostermann 2010, section 2.2).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numba import njit
from scipy.linalg import expm
from slow_models import AREA, FILM, Array, wall

PARTS, NODES, ROUNDS = 4, np.array([0.0, 0.25, 0.75, 1.0]), 12


@lru_cache
def modes(dt: float, conductivity: float) -> tuple[Array, ...]:
    """The wall in its own modes.

    Returns:
        Decay of each mode up to each node, shape ``(n_nodes, n_modes)``; its answer there to a heat flow that is 1 at
        one node and 0 at the others, shape ``(n_nodes, n_modes, n_nodes)``; each layer's share of each mode.
    """
    capacity, conduct = wall(conductivity)
    root, states, n = np.sqrt(capacity), len(capacity), len(NODES)
    a = np.diag(conduct, 1) + np.diag(conduct, -1)
    a -= np.diag(a.sum(axis=0))
    a[0, 0] -= FILM
    a[-1, -1] -= FILM
    rates, vectors = np.linalg.eigh(a / np.outer(root, root))
    chain = np.zeros((states, n + 1, n + 1))
    chain[:, range(n), range(1, n + 1)] = 1.0
    chain[:, 0, 0] = rates * dt
    # Integrals of exp(rate (node - s)) s^k / k! up to each node (Van Loan 1978).
    powers = np.array([expm(node * chain) for node in NODES])[:, :, 0, :]
    factorials = [math.factorial(k) for k in range(n)]
    answers = dt * (powers[:, :, 1:] * factorials) @ np.linalg.inv(np.vander(NODES, increasing=True))
    return np.ascontiguousarray(powers[:, :, 0]), answers, vectors / root[:, np.newaxis]


@njit
def run(inputs: Array, decay: Array, answers: Array, layers: Array, z: Array) -> Array:
    """Temperatures of the heated face and of the middle at the end of each sample; ``z`` is left at the end."""
    first, last, n = layers[0], layers[-1], len(decay)
    found, flow, free = np.empty((len(inputs), 2)), np.empty(n), np.empty(n)
    own = np.empty((n, n))
    for i in range(n):
        for j in range(n):
            own[i, j] = np.sum(last * last * answers[i, :, j])
    for k in range(len(inputs)):
        air = inputs[k, 1]
        heat = inputs[k, 0] + FILM * air
        for _ in range(PARTS):
            for i in range(n):
                free[i] = np.sum(last * (decay[i] * z + heat * first * np.sum(answers[i], axis=1)))
            face = np.full(n, free[0])
            for _ in range(ROUNDS):
                flow = FILM * air + AREA * (air**4 - face**4)
                face = free + own @ flow
            z[:] = decay[-1] * z + heat * first * np.sum(answers[-1], axis=1) + last * (answers[-1] @ flow)
        found[k, 0] = np.sum(first * z)
        found[k, 1] = np.sum(layers[len(z) // 2] * z)
    return found


def thermal_run(h: float, inputs: Array, conductivity: float) -> Array:
    """As ``slow_models.thermal_run``, of no tolerance."""
    decay, answers, layers = modes(h / PARTS, conductivity)
    z = np.linalg.solve(layers, np.full(len(layers), 293.15))
    given = np.ascontiguousarray(inputs)
    return np.asarray(run(given, decay, answers, layers, z))
