r"""A neural state space whose neurons read, and move, a few directions: begun from one whose neurons are free.

Which combinations of states and inputs bend is hidden in a network with free neurons. Along a record its slope
:math:`J_t = V \mathrm{diag}(\sigma'_t) W` has a mean, which is linear, and what changes around it lives in the
directions that bend: the leading eigenvectors of :math:`\sum_t (J_t - \bar J)^T (J_t - \bar J)` (active subspaces,
Constantine 2015), measured by how far the record goes in each. What neurons read outside of them becomes linear with
the mean slope; what they move outside of a few directions becomes its regression on state and input. From random
directions alone fits end in other minima: of six simulated plants with a curve between linear blocks two did.
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
from sysid.estimation.results.result import FitResult
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
    later = replace(training, max_time_s=max(training.max_time_s - first.train_time_s, 0.0))
    found = one(**given, training=later, initial=first)
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
    paths, inputs = own.states(own.begun(first.theta)), [u for u, _ in own.signals]
    return narrowed(first, np.column_stack([np.concatenate(paths), np.concatenate(inputs)]), sizes.directions).numbers


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
    z = z[:: max(1, len(z) // SEEN)]
    _read_few(form, theta, z, directions)
    _move_few(form, theta, z, directions)
    return replace(form, sizes=s, theta=s.hold(evened(theta, s, z[:, : s.states])))


def _read_few(form: NeuralForm, theta: Array, z: Array, directions: int) -> None:
    """Change ``theta``: its neurons read the directions that bend; what they do along the others is linear."""
    s, slope = form.sizes, NEURONS[form.activation].slope
    parts = ((s.hidden, s.readout, s.linear), (s.output_hidden, s.output_readout, s.output_linear))
    middle = z.mean(axis=0)
    root, back = _roots(np.cov(z.T).reshape(s.row - 1, s.row - 1))
    means, spread = [], np.zeros_like(root)
    for hidden, readout, linear in parts:
        W, V = theta[hidden].reshape(-1, s.row), theta[readout].reshape(len(theta[linear]) // s.row, -1)
        slopes = np.einsum("ij,tj,jk->tik", V, slope(z @ W[:, :-1].T + W[:, -1]), W[:, :-1])
        means.append(slopes.mean(axis=0))
        apart = (slopes - means[-1]) @ root
        spread += np.einsum("tij,tik->jk", apart, apart)
    Q = linalg.eigh(spread)[1][:, -directions:]
    left = np.eye(s.row - 1) - root @ Q @ Q.T @ back
    for (hidden, _, linear), mean in zip(parts, means, strict=True):
        W, M = theta[hidden].reshape(-1, s.row), theta[linear].reshape(-1, s.row)  # views
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
