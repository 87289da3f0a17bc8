r"""A neural state space whose neurons read, and move, a few directions: begun from one whose neurons are free.

Which combinations of states and inputs bend is hidden in a network with free neurons. Along a record its slope
:math:`J_t = V \mathrm{diag}(\sigma'_t) W` has a mean, which is linear, and what changes around it lives in the
directions that bend: the leading eigenvectors of :math:`\sum_t (J_t - \bar J)^T (J_t - \bar J)` (active subspaces,
Constantine 2015), measured by how far the record goes in each. What neurons read outside of them becomes linear with
the mean slope; what they move outside of a few directions becomes its regression on state and input. From random
directions alone more fits end in other minima.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.networks.neural.finer import evened
from sysid.estimation.networks.neural.provider import NeuralProvider
from sysid.estimation.networks.training import Training
from sysid.estimation.results.result import FitResult, Status
from sysid.kernels.neurons import NEURONS
from sysid.models import AbstractStructure, NeuralEnsemble, NeuralForm, NeuralStateSpace

Array = NDArray[np.float64]

SEEN = 2_000
"""Places along the records where slopes are taken."""

GIVEN, NARROWED = "from a given fit: ", "in few directions: "
"""What runs of a fit are called that is given another: where both are parts of one, those of that one are others."""

LEAST = 1e-6
"""Variance of a direction that a record hardly goes in, over the largest."""


def in_few_directions(given: Mapping[str, Any], training: Training, one: Callable[..., FitResult]) -> FitResult:
    """The fit of a network whose neurons read a few directions, begun from that of one whose neurons are free.

    Args:
        given: What is fitted, by the names of
            :func:`sysid.estimation.networks.neural.state_space.fit_neural_state_space`.
        training: How; the free one may take half of its time.
        one: Fits what it is given by these names.

    Returns:
        The fit, which has taken the time of both.
    """
    network: NeuralStateSpace = given["network"]
    free = {**given, "network": replace(network, directions=None), "vet": None}
    first = one(**free, training=replace(training, ensemble=1, max_time_s=0.5 * training.max_time_s))
    interrupted = first.status is Status.INTERRUPTED
    left = 0.0 if interrupted else max(training.max_time_s - first.train_time_s, 0.0)
    found = one(**given, training=replace(training, max_time_s=left), initial=first)
    found = replace(found, status=Status.INTERRUPTED) if interrupted else found
    note = f"Begun from {first.model.label}, whose neurons read everything: what bends there gave the directions."
    seconds = first.train_time_s + found.train_time_s
    return replace(found, notes=(note, *found.notes), train_time_s=seconds)


def run_name(initial: FitResult, network: AbstractStructure) -> str:
    """What the runs of a fit are called that begins from another.

    Args:
        initial: The other one.
        network: What is fitted.

    Returns:
        The name, with which others begin.
    """
    return GIVEN if initial.model.structure == network else NARROWED


def begun_from(initial: FitResult, provider: NeuralProvider) -> Array:
    """The parameters of an initial fit; of an ensemble those of its first member, the best of them.

    Args:
        initial: The fit, of the same structure or of one whose neurons are free.
        provider: The residuals of what is to start from it.

    Returns:
        Flat parameters of the model.
    """
    form: Any = initial.model.recursion
    sizes = provider.template.sizes
    first: NeuralForm = form.members[0] if isinstance(form, NeuralEnsemble) else form
    if first.sizes == sizes or sizes.directions is None:
        return first.numbers
    own = replace(provider, template=first)
    every = max(1, sum(len(u) for u, _ in own.signals) // SEEN)  # the states of a long record are not kept together
    visited = [
        np.column_stack([path, u[rows]])[::every]
        for (u, _), blocks in zip(own.signals, own.paths(own.begun(first.theta)), strict=True)
        for rows, path in blocks
    ]
    return narrowed(first, np.concatenate(visited), sizes.directions).numbers


def narrowed(form: NeuralForm, z: Array, directions: int) -> NeuralForm:
    """The model whose neurons read and move a few directions, nearest to one along its own free run.

    Args:
        form: The model, its neurons free.
        z: States and scaled inputs that it visits, shape ``(n_samples, n_states + n_inputs)``.
        directions: How many.

    Returns:
        The model, of sizes with these directions.
    """
    s = replace(form.sizes, directions=directions)
    theta = form.theta.copy()
    _read_few(form, theta, z, directions)
    _move_few(form, theta, z, directions)
    return replace(form, sizes=s, theta=s.hold(evened(theta, s, z[:, : s.states])))


def _read_few(form: NeuralForm, theta: Array, z: Array, directions: int) -> None:
    """Change ``theta``: its neurons read the directions that bend; what they do along the others is linear."""
    s, slope = form.sizes, NEURONS[form.activation].slope
    middle, root, back = z.mean(axis=0), *_roots(np.cov(z.T).reshape(s.row - 1, s.row - 1))
    parts, spread = list[tuple[Array, Array, Array]](), np.zeros_like(root)
    for hidden, readout, linear in (
        (s.hidden, s.readout, s.linear), (s.output_hidden, s.output_readout, s.output_linear),
    ):  # fmt: skip
        W, M = theta[hidden].reshape(-1, s.row), theta[linear].reshape(-1, s.row)  # views
        V = theta[readout].reshape(len(M), -1)
        slopes = slope(z @ W[:, :-1].T + W[:, -1])
        mean = slopes.mean(axis=0)
        # The sum of (J - mean J)^T (J - mean J), without a J for every sample.
        apart, read = slopes - mean, W[:, :-1] @ root
        spread += read.T @ ((V.T @ V) * (apart.T @ apart)) @ read
        parts.append((W, M, (V * mean) @ W[:, :-1]))
    Q = linalg.eigh(spread)[1][:, -directions:]
    left = np.eye(s.row - 1) - root @ Q @ Q.T @ back
    for W, M, mean in parts:
        W[:, -1] += W[:, :-1] @ left @ middle
        W[:, :-1] -= W[:, :-1] @ left
        M[:, :-1] += mean @ left
        M[:, -1] -= mean @ left @ middle


def _move_few(form: NeuralForm, theta: Array, z: Array, directions: int) -> None:
    """Change ``theta``: its neurons move the states in a few directions; what they do in the others is linear."""
    s = form.sizes
    W, V = theta[s.hidden].reshape(-1, s.row), theta[s.readout].reshape(s.states, -1)
    rows = np.column_stack([z, np.ones(len(z))])
    bent = NEURONS[form.activation].value(rows @ W.T)
    line = np.linalg.lstsq(rows, bent, rcond=LEAST)[0]
    moved = (bent - rows @ line) @ V.T
    U = linalg.eigh(moved.T @ moved)[1][:, -directions:]
    left = V - U @ (U.T @ V)
    theta[s.linear] += (left @ line.T).ravel()
    V -= left  # a view: the parameters change with it


def _roots(covariance: Array) -> tuple[Array, Array]:
    """The symmetric root of a covariance, and its inverse."""
    values, vectors = linalg.eigh(covariance)
    deviations = np.sqrt(np.maximum(values, max(LEAST * values[-1], np.finfo(np.float64).tiny)))
    return (vectors * deviations) @ vectors.T, (vectors / deviations) @ vectors.T
