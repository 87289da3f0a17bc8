r"""A model of thinned records, made one of all samples.

A neural state space that was trained on every ``d``-th sample of low-passed records becomes one of a single step,

.. math:: x_{k+1} = A x_k + B u_k + c + V g(x_k, u_k) \quad\to\quad
          x_{t+1} = A^{1/d} x_t + B' u_t + c' + V' g(x_t, u_t).

:math:`A` is the best linear approximation of the state equation over the states that it visits, or its linear part
alone, and :math:`g` what that leaves of the neurons. A root keeps frequency and damping of every mode; :math:`B'`,
:math:`c'` and :math:`V'` are the regression that leads from one of the visited states to the next, which are known
between the samples as all of it is band-limited. The output equation is the same. Far from its resonance the phase of a
mode is a little off then, which training over all samples mends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.kernels.neurons import NEURONS
from sysid.models import Mapping, NeuralForm
from sysid.models.networks.neural_sizes import Sizes
from sysid.traces import Trace

Array = NDArray[np.float64]

HALF_WIDTH, SHAPE = 16, 10.0
"""Zeros of the low-pass filter's impulse response on either side, and the shape of Kaiser's window over them: what is
between samples is then known to 1e-5 up to 0.8 of the band."""

REGRESSED = 40_000
"""Samples over which the step from one state to the next is regressed, at most."""

ENDS = 2 * HALF_WIDTH
"""Thinned samples at either end of a path that are not known between."""

EDGE, LOST = 1.0 - 1e-4, 0.5
"""Where the slowest mode is drawn that would not die away; and share of the outputs' variances that a model which goes
on at the records' own rate leaves at most: training leads it back from a phase that is off, and from nothing else."""

SPREAD, LEAST_VARIANCE = 0.4, 1e-6
"""Standard deviation of a state, in all directions, where fits scale states to -1 to 1; and part of the largest
variance that each is taken to have at least."""

CLEAR = 1e8
"""Condition of a system's modes beyond which they are not told apart."""


def taps(every: int) -> Array:
    """A low-pass filter to the band of every so-manieth sample, whose response is one where nothing changes.

    Args:
        every: That number.

    Returns:
        The impulse response, of odd length, with its middle in the middle.
    """
    half = HALF_WIDTH * every
    found = np.sinc(np.arange(-half, half + 1) / every) * np.kaiser(2 * half + 1, SHAPE)
    return np.asarray(found / found.sum())


def _between(path: Array, every: int) -> Array:
    """Band-limited columns of every so-manieth sample, and what they are between: ``every`` times as many rows."""
    spread = np.zeros((len(path) * every, path.shape[1]))
    spread[::every] = path
    filtered = every * taps(every)
    return np.column_stack([np.convolve(column, filtered, mode="same") for column in spread.T])


def finer(
    form: NeuralForm, sparse: Sequence[Trace], traces: Sequence[Trace], mapping: Mapping, every: int
) -> NeuralForm | None:
    """A model of thinned records, at the records' own rate.

    Args:
        form: The model, of one step of the thinned records.
        sparse: The thinned records.
        traces: The records.
        mapping: What drives it, and what it answers.
        every: Steps of the records in one of these.

    Returns:
        The model of one step of the records, in other coordinates of its states; ``None`` where what is found is no
        model of the records.
    """
    s = form.sizes
    most = REGRESSED // every // max(len(sparse), 1) + 2 * ENDS
    paths = []
    for trace in sparse:  # from where a run begins does not matter: every step of it is one of the model
        u = form.scaled(trace.columns(mapping.inputs)[:most])
        path = form.path(u, form.resting(u[0], np.zeros(s.outputs)))
        if len(path) > 2 * ENDS + 1 and np.isfinite(path).all():
            paths.append(np.column_stack([path, u]))
    if not paths:
        return None
    z = np.concatenate([_with_one(path) for path in paths])
    _, W, _ = _dynamic(form.theta, s)
    R = np.linalg.lstsq(z, _neurons(form, W, z), rcond=None)[0].T if s.neurons else np.zeros((0, s.row))
    fine = [_with_one(_between(path, every))[ENDS * every : -ENDS * every] for path in paths]
    # Either what neurons do on average is a part of the modes, or it is not.
    stepped = [_stepped(form, share * R, fine, every) for share in (1.0, 0.0)]
    found = [*stepped, *(_read_anew(one, traces, mapping) for one in stepped)]
    errors = [_error(one, traces, mapping) for one in found]
    best = int(np.argmin(errors))
    return replace(found[best], theta=evened(found[best].theta, s, z[:, : s.states])) if errors[best] < LOST else None


def _stepped(form: NeuralForm, R: Array, paths: Sequence[Array], every: int) -> NeuralForm:
    """The model whose steps lead along paths of state, inputs and 1, its modes those of its linear part with ``R``."""
    s = form.sizes
    M, W, V = _dynamic(form.theta, s)
    A = root((M + V @ R)[:, : s.states], every)
    rows, targets = [], []
    for path in paths:
        fresh = _neurons(form, W, path) - path @ R.T
        rows.append(np.column_stack([path[:-1, s.states :], fresh[:-1]]))
        targets.append(path[1:, : s.states] - path[:-1, : s.states] @ A.T)
    found = _regression(np.concatenate(rows), np.concatenate(targets))
    after = found[:, s.row - s.states :]
    linear = np.column_stack([A, found[:, : s.row - s.states]]) - after @ R
    linear[:, : s.states] *= min(1.0, EDGE / float(np.abs(linalg.eigvals(linear[:, : s.states])).max()))
    theta = form.theta.copy()
    theta[s.linear], theta[s.readout] = linear.ravel(), after.ravel()
    return replace(form, theta=s.hold(theta))


def _read_anew(form: NeuralForm, traces: Sequence[Trace], mapping: Mapping) -> NeuralForm:
    """The model whose linear output is the regression of what was measured on the states of its own free run."""
    s = form.sizes
    rows, targets = [], []
    for trace in traces:
        u = form.scaled(trace.columns(mapping.inputs)[:REGRESSED])
        y = form.scaled_outputs(trace.columns(mapping.outputs)[:REGRESSED])
        z = _with_one(np.column_stack([form.path(u, form.resting(u[0], y[0])), u]))
        bent = NEURONS[form.activation].value(z @ form.theta[s.output_hidden].reshape(-1, s.row).T)
        rows.append(z)
        targets.append(y - bent @ form.theta[s.output_readout].reshape(s.outputs, -1).T)
    theta = form.theta.copy()
    if not form.rectified and all(np.isfinite(one).all() for one in (*rows, *targets)):
        theta[s.output_linear] = _regression(np.concatenate(rows), np.concatenate(targets)).ravel()
    return replace(form, theta=theta)


def _error(form: NeuralForm, traces: Sequence[Trace], mapping: Mapping) -> float:
    """Mean square of what a free run leaves of the beginning of some records, over the outputs' variances."""
    shares = []
    for trace in traces:
        u = form.scaled(trace.columns(mapping.inputs)[:REGRESSED])
        y = form.scaled_outputs(trace.columns(mapping.outputs)[:REGRESSED])
        away = form.run(u, form.resting(u[0], y[0])) - y
        shares.append(np.mean(away**2, axis=0) / np.maximum(np.var(y, axis=0), np.finfo(np.float64).tiny))
    error = float(np.mean(shares))
    return error if np.isfinite(error) else np.inf


def evened(theta: Array, s: Sizes, path: Array) -> Array:
    """The same model in states that vary alike in every direction.

    A run that begins at few measured samples seeks a state near what the oldest tells, as near in one direction as in
    another. Where some directions are hardly ever visited it would find one that the plant is never in.
    """
    values, vectors = linalg.eigh(path.T @ path / len(path))
    spreads = np.sqrt(np.maximum(values, values[-1] * LEAST_VARIANCE))
    to = (vectors * (SPREAD / spreads)) @ vectors.T
    back = (vectors * (spreads / SPREAD)) @ vectors.T
    theta, n = theta.copy(), s.states
    for part in (s.linear, s.readout, s.start):
        theta[part] = (to @ theta[part].reshape(n, -1)).ravel()
    for part in (s.linear, s.hidden, s.output_linear, s.output_hidden):
        rows = theta[part].reshape(-1, s.row)
        rows[:, :n] = rows[:, :n] @ back  # a view: the parameters change with it
    return theta


def _with_one(path: Array) -> Array:
    return np.column_stack([path, np.ones(len(path))])


def _dynamic(theta: Array, s: Sizes) -> tuple[Array, Array, Array]:
    return (
        theta[s.linear].reshape(s.states, s.row),
        theta[s.hidden].reshape(s.neurons, s.row),
        theta[s.readout].reshape(s.states, s.neurons),
    )


def _neurons(form: NeuralForm, W: Array, z: Array) -> Array:
    return NEURONS[form.activation].value(z @ W.T)


def _regression(rows: Array, targets: Array) -> Array:
    """Coefficients of targets, shape ``(n_targets, n_columns)``; columns that depend on each other share theirs."""
    sizes = np.linalg.norm(rows, axis=0)
    sizes[sizes == 0.0] = 1.0
    return np.asarray((np.linalg.lstsq(rows / sizes, targets, rcond=1e-8)[0] / sizes[:, None]).T)


def root(A: Array, every: int) -> Array:
    """A matrix whose power is another one, but for modes that have no place between samples.

    Args:
        A: The other one.
        every: The power.

    Returns:
        The root. A pole on the negative axis, which alternates from sample to sample, becomes one that dies away as
        fast without it.

    Example:
        >>> root(np.array([[0.25, 0.0], [0.0, -0.25]]), 2).round(6).tolist()
        [[0.5, 0.0], [0.0, 0.5]]
    """
    values, vectors = linalg.eig(A)
    if np.linalg.cond(vectors) > CLEAR:
        return np.asarray(linalg.fractional_matrix_power(A, 1.0 / every).real)
    alternates = (np.abs(values.imag) <= 1e-9 * np.abs(values)) & (values.real < 0.0)
    roots = np.where(alternates, np.abs(values), values).astype(complex) ** (1.0 / every)
    return np.asarray(linalg.solve(vectors.T, (vectors * roots).T).T.real)
