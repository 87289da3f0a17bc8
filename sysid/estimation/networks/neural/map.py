r"""The map from one sample to a state, learnt where no record begins by it.

A neural state space says by a linear map ``E`` at which state it stands when its oldest known sample is all that is
known: a run from ``initial``, a start of ``first-sample`` or ``rest``, and every exported file begin there, and an
estimated state is sought around it. Where each record has an initial state of its own, no residual reads the map. It is
then the regression of the states on the samples,

.. math:: \min_E \; \tfrac1N \sum_t |E z_t - x_t|^2 + \tfrac1K \sum_k |E z_k^* - x_k^*|^2,

over the ``N`` samples of the records, with :math:`z_t = [u_t; y_t; 1]` measured and :math:`x_t` the state of the free
run, and over ``K`` equilibria: inputs that the records have, held until the model stands still. The first tells where a
plant in motion is, the second where one is that has stood; they count alike.

A model with integrators does not settle. Its second part are the states at which its records begin, and they count
:data:`AS_BEGUN` times: of a slow state that a few samples do not show, a run is as far off for ever as the map is.

Limits: one linear map cannot give both of a strongly nonlinear plant. Several samples say more, and are estimated with
(:meth:`NeuralForm.corrected`).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.networks.neural.provider import NeuralProvider
from sysid.models import NeuralForm

HELD, LONGEST, STILL = 16, 4096, 1e-6
"""Inputs that are held; samples for which they are at most; and how little a state still moves in a sample, where its
range is of order 1, when it has settled."""
AS_BEGUN = 1e4
"""Times that the states at which records of a model with integrators begin count as much as those that they visit."""
DEPENDENT = 1e-10
"""Singular values below this part of the largest belong to samples that depend on each other: a channel that never
moves, or an output that its inputs give alone."""


def learnt_map(provider: NeuralProvider, theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """The parameters with the map to the initial state that the records and the equilibria show.

    Args:
        provider: The records.
        theta: Flat parameters, shape ``(n_parameters,)``.

    Returns:
        The same shape; as it was where a record begins by the map, which the fit has then estimated, or where a free
        run explodes.
    """
    if not provider.all_free:
        return theta
    width = provider.template.sizes.inputs + provider.template.sizes.outputs + 1
    square, across = np.zeros((width, width)), np.zeros((width, provider.template.sizes.states))
    sums = provider.template.sizes.integrators > 0
    second = _begun(provider, theta) if sums else _equilibria(provider, theta)
    for pairs, weight in ((_visited(provider, theta), 1.0), (second, AS_BEGUN if sums else 1.0)):
        own, joint, counted = np.zeros_like(square), np.zeros_like(across), 0
        for z, x in pairs:
            own += z.T @ z
            joint += z.T @ x
            counted += len(z)
        square += weight * own / max(counted, 1)
        across += weight * joint / max(counted, 1)
    if not np.isfinite(square).all() or not np.isfinite(across).all():
        return theta
    found = theta.copy()
    found[provider.template.sizes.start] = np.linalg.lstsq(square, across, rcond=DEPENDENT)[0].T.ravel()
    return found


Pairs = Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]
"""Some samples as the map reads them, and the states before them."""


def _visited(provider: NeuralProvider, theta: NDArray[np.float64]) -> Pairs:
    """Samples that count and states of the records, in blocks."""
    for (u, y), counts, blocks in zip(provider.signals, provider.counted, provider.paths(theta), strict=True):
        for rows, path in blocks:
            kept = counts[rows]
            yield np.column_stack([u[rows], y[rows], np.ones(len(path))])[kept], path[kept]


def _begun(provider: NeuralProvider, theta: NDArray[np.float64]) -> Pairs:
    """The first sample of each record, and the state before it."""
    for (u, y), blocks in zip(provider.signals, provider.paths(theta), strict=True):
        _, path = next(blocks)
        yield np.column_stack([u[:1], y[:1], np.ones(1)]), path[:1]


def _equilibria(provider: NeuralProvider, theta: NDArray[np.float64]) -> Pairs:
    """Inputs of the records and the outputs at which the model settles with them, and the states there."""
    form: NeuralForm = provider.at(theta)
    records = [u for u, _ in provider.signals]
    ends = np.cumsum([len(u) for u in records])
    samples, states = [], []
    for place in np.linspace(0, ends[-1] - 1, HELD).astype(np.int64):
        of = int(np.searchsorted(ends, place, side="right"))
        u = records[of][place - ends[of]]
        x, n = np.zeros(form.sizes.states), 64
        while n <= LONGEST:
            form.run(np.tile(u, (n, 1)), x)
            before = x.copy()
            y = form.run(u[None], x)[0]
            if np.abs(x - before).max() < STILL:
                if np.abs(x).max() < form.bound and np.isfinite(y).all():
                    samples.append(np.concatenate([u, y, [1.0]]))
                    states.append(x)
                break
            n *= 2
    width = form.sizes.inputs + form.sizes.outputs + 1
    yield np.reshape(samples, (-1, width)), np.reshape(states, (-1, form.sizes.states))
