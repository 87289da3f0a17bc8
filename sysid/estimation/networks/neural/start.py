"""The best linear model of the records in free run, from which the fits of a neural state space start."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.errors import FitDivergedError, UserError
from sysid.estimation.clock import now
from sysid.estimation.least_squares.evidence import Group, Prior
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.termination import Termination
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.linear.regression import lagged
from sysid.estimation.linear.state_space.search import search
from sysid.estimation.linear.state_space.training import StateSpaceTraining
from sysid.estimation.networks.neural import recalled
from sysid.estimation.networks.neural.integrators import summed
from sysid.estimation.networks.neural.provider import NeuralProvider
from sysid.estimation.records.experiment import Experiment
from sysid.kernels import linear as linear_kernel
from sysid.models import Lags, LinearStateSpace, NeuralForm
from sysid.models.linear.linear_state_space import MOST_STATES
from sysid.models.networks.neural_sizes import Sizes

ARX_ORDERS = (2, 4, 10)
"""Orders of the regressions whose impulse responses are realised: a regression suits noise in the equation, which a
free run does not have, so several are tried and the free run decides."""

HORIZON, LARGEST_HANKEL = 150, 600
"""Samples of impulse response in each direction of the Hankel matrix, and its rows at most, where outputs are many."""

LARGEST_POLE = 0.999
"""Poles of the linear start are drawn inside this radius: a start must be stable, the fit need not stay inside."""

SIGN_ROUNDS = 10
"""Times that the signs of a rectified output are guessed anew from the model that the last guess gave."""

LINEAR_ITERATIONS = 60

TELLING, FEWEST = 4_000, 4
"""Samples of whole records by which a linear model is found, where there are more, and records at least."""


SETTLING = 1e-3
"""What is left of a unit after all that a regression takes of its past, below which its constant is no level."""

FLAT_ALPHA = 1e-6
"""Precision of the prior while the linear model is fitted: enough to hold directions that change nothing, as any change
of coordinates of the state does."""


def linear_start(provider: NeuralProvider, *, until: float = math.inf) -> NDArray[np.float64]:
    """The best linear model of the records in free run, in the parameters of a provider with neurons.

    A regression of high order gives an impulse response; the largest singular vectors of its Hankel matrix give the
    states (Ho and Kalman 1966); Levenberg-Marquardt then fits matrices and initial states to the free run. With several
    outputs the linear state space that is fitted to all of them by subspace methods and the free run is tried, too.

    Args:
        provider: The records, and the sizes wanted.
        until: When it has to have ended, on the clock of ``sysid.estimation.clock.now``; what is not fitted by then is
            taken as it is.

    Returns:
        Flat parameters, shape ``(provider.n_parameters,)``; the neurons' are zero.
    """
    whole = provider.template
    s = replace(whole.sizes, neurons=0, output_neurons=0)
    told = recalled.of(provider, s)
    if told is not None and told.theta is not None:
        return _with_neurons(provider, told.theta)
    # Without bounds of the output: a start that lies beyond them throughout would have no gradient to come back by.
    template = NeuralForm(
        sizes=s, theta=np.zeros(s.count), scaling=whole.scaling, rectified=whole.rectified, bound=np.inf
    )
    everything = replace(provider, template=template)
    linear = replace(everything, experiments=some_of(provider))
    with one_blas_thread():  # more threads than one cost more than they give at these sizes
        began, fits = now(), list[NDArray[np.float64]]()
        for left, order in zip(range(len(ARX_ORDERS), 0, -1), ARX_ORDERS, strict=True):
            fits.append(_fitted(linear, _realised(linear, order), (until - now()) / (left + 1)))
        # What it takes cannot be bounded closely: it is left out where the others took most of the time.
        if s.outputs > 1 and not whole.rectified and until - now() >= now() - began:
            fits += [_fitted(linear, one, until - now()) for one in _by_subspace(linear, until)]
    theta = s.hold(_levelled(everything, _unit_states(everything, min(fits, key=linear.loss))))
    if told is not None:
        told.keep(theta)
    return _with_neurons(provider, theta)


def some_of(provider: NeuralProvider) -> tuple[Experiment, ...]:
    """The records by which a linear model is found: of many whole ones no more than tell it.

    A start is not better for samples beyond :data:`TELLING`, and of two outputs took as long on all of them as the
    training that follows. Where a record begins at a state of its own, all are taken.
    """
    experiments, total = provider.experiments, sum(len(one.output) for one in provider.experiments)
    count = max(math.ceil(TELLING / max(total, 1) * len(experiments)), FEWEST)
    if count >= len(experiments) or provider.n_parameters > provider.template.sizes.count:
        return experiments
    return tuple(experiments[k] for k in np.linspace(0, len(experiments) - 1, count).round().astype(int))


def _with_neurons(provider: NeuralProvider, theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """A linear model in the parameters of a provider with neurons, which do nothing."""
    sizes = provider.template.sizes
    s, base = replace(sizes, neurons=0, output_neurons=0), np.zeros(provider.n_parameters)
    for to, of in ((sizes.linear, s.linear), (sizes.output_linear, s.output), (sizes.start, s.start)):
        base[to] = theta[of]
    base[sizes.count :] = theta[s.count :]
    return base


def _by_subspace(provider: NeuralProvider, until: float) -> list[NDArray[np.float64]]:
    """The state space that a linear fit finds; nothing where the records are too short for it."""
    s = provider.template.sizes
    if s.states > MOST_STATES:
        return []
    orders = LinearStateSpace(states=s.states, feedthrough=True, noise=False)
    try:
        seconds = max(0.5 * (until - now()), 1e-3)
        training = StateSpaceTraining(max_iterations=LINEAR_ITERATIONS, max_time_s=seconds)
        found = search(provider.segments, orders, training).system
    except (UserError, FitDivergedError, np.linalg.LinAlgError):
        return []
    return [_parameters(provider, (found.A, found.B, found.C, found.D, found.constant))]


def _parameters(provider: NeuralProvider, matrices: tuple[NDArray[np.float64], ...]) -> NDArray[np.float64]:
    """``A``, ``B``, ``C``, ``D`` and constants as flat parameters, sums last; a record begins in equilibrium."""
    s = provider.template.sizes
    A, B, C, D, constant = summed(matrices, s.integrators)
    theta = np.zeros(provider.n_parameters)
    theta[s.linear] = np.column_stack([A, B, np.zeros(s.states)]).ravel()
    theta[s.output] = np.column_stack([C, D, constant]).ravel()
    gain = np.linalg.lstsq(np.eye(s.states) - A, B, rcond=None)[0] if s.inputs else B
    theta[s.start] = np.column_stack([gain, np.zeros((s.states, s.outputs + 1))]).ravel()
    return theta


def _levelled(provider: NeuralProvider, theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same model, whose map from one sample heeds the outputs where the records' own states leave the map free.

    The map gives the equilibrium at some inputs. What is measured away from the outputs there moves the state as it
    does over the records: by the regression of the states' distance from equilibrium on the outputs'.
    """
    s = provider.template.sizes
    if not provider.all_free or provider.template.rectified:
        return theta
    E, L = theta[s.start].reshape(s.states, -1).copy(), theta[s.output].reshape(s.outputs, s.row)
    paths, inputs = np.concatenate(provider.states(theta)), np.concatenate([u for u, _ in provider.signals])
    apart = paths - np.column_stack([inputs, np.ones(len(inputs))]) @ E[:, [*range(s.inputs), -1]].T
    level = apart @ L[:, : s.states].T
    if not np.isfinite(level).all():
        return theta
    slope = np.linalg.lstsq(level.T @ level, level.T @ apart, rcond=None)[0].T
    if not np.isfinite(slope).all():
        return theta
    # The outputs in equilibrium, as a function of inputs and 1.
    steady = np.column_stack([L[:, s.states : -1], np.zeros((s.outputs, s.outputs)), L[:, -1]])
    E -= slope @ (steady + L[:, : s.states] @ E)
    E[:, s.inputs : s.inputs + s.outputs] += slope
    changed = theta.copy()
    changed[s.start] = E.ravel()
    return changed


def _realised(provider: NeuralProvider, order: int) -> NDArray[np.float64]:
    """A linear model from a regression; with rectified outputs, from one on the signs that the last one found."""
    s = provider.template.sizes
    signals = list(provider.signals)
    rounds = SIGN_ROUNDS if provider.template.rectified else 1
    signed = [(u, y * (np.sign(u[:, :1]) if s.inputs else 1.0)) for u, y in signals] if rounds > 1 else signals
    for _ in range(rounds):
        matrices = _realise(*_regression(signed, s.inputs, order), s)
        theta = _parameters(provider, matrices)
        if rounds > 1:
            runs = [_simulate(matrices, u) for u, _ in signals]
            signed = [(u, y * np.sign(run)) for (u, y), run in zip(signals, runs, strict=True)]
    return theta


def _regression(
    signals: list[tuple[NDArray[np.float64], NDArray[np.float64]]], n_inputs: int, order: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """A regression of the outputs on their past and the inputs.

    A record that is too short for its lags has no row; the longest one says how many there may be.

    Returns:
        Coefficients of the past outputs, shape ``(order, n_outputs, n_outputs)``, of the inputs, ``(order + 1,
        n_outputs, n_inputs)``, and the constants.
    """
    longest, n_y = max(len(y) for _, y in signals), signals[0][1].shape[1]
    order = min(order, max(longest // 4, 1), longest - 1)
    signals = [(u, y) for u, y in signals if len(y) > order]
    now, past = tuple(range(order + 1)), tuple(range(1, order + 1))
    lags = Lags(inputs=(*(now,) * n_inputs, *(past,) * n_y), output=())
    rows = np.concatenate([lagged(np.column_stack([u, y]), y[:, 0], lags, len(y) - order) for u, y in signals])
    target = np.concatenate([y[order:] for _, y in signals])
    found = np.linalg.lstsq(np.column_stack([rows, np.ones(len(rows))]), target, rcond=None)[0]
    own = found[n_inputs * (order + 1) : -1].reshape(n_y, order, n_y).transpose(1, 2, 0)
    inputs = found[: n_inputs * (order + 1)].reshape(n_inputs, order + 1, n_y).transpose(1, 2, 0)
    share = np.eye(n_y) - own.sum(axis=0)
    settles = linalg.eigvals(share).real.min() > SETTLING
    return own, inputs, np.linalg.solve(share, found[-1]) if settles else np.zeros(n_y)


def _realise(
    past: NDArray[np.float64], inputs: NDArray[np.float64], constant: NDArray[np.float64], s: Sizes
) -> tuple[NDArray[np.float64], ...]:
    """Ho-Kalman realisation of the regression's impulse responses; without an input, of those to what is new."""
    order, n_y = len(past), s.outputs
    if s.inputs == 0:
        inputs = np.eye(n_y)[np.newaxis]
    horizon = min(HORIZON, max(LARGEST_HANKEL // n_y, 20))
    responses = np.zeros((2 * horizon + 1, n_y, inputs.shape[2]))
    companion = np.eye(n_y * order, k=-n_y)
    companion[:n_y] = np.concatenate(past, axis=1) if order else 0.0
    radius = float(np.abs(linalg.eigvals(companion)).max()) if order else 0.0
    # An unstable regression is slowed down to the edge; what is wanted is the shape of its first samples.
    shrink = LARGEST_POLE / max(radius, LARGEST_POLE)
    past = past * (shrink ** np.arange(1, order + 1))[:, np.newaxis, np.newaxis]
    responses[: len(inputs)] = inputs[: len(responses)]
    for t in range(1, len(responses) if order else 0):
        reach = min(order, t)
        responses[t] += np.cumsum(past[:reach] @ responses[t - reach : t][::-1], axis=0)[-1]
    places = 1 + np.arange(horizon)[:, None] + np.arange(horizon)
    hankel = responses[places].transpose(0, 2, 1, 3).reshape(horizon * n_y, -1)
    left, values, right = linalg.svd(hankel, full_matrices=False)
    root = np.sqrt(np.maximum(values[: s.states], 1e-12 * values[0]))
    observable = left[:, : s.states] * root
    A = np.linalg.lstsq(observable[:-n_y], observable[n_y:], rcond=None)[0]
    A *= min(1.0, LARGEST_POLE / max(float(np.abs(linalg.eigvals(A)).max()), 1e-12))
    B = root[:, None] * right[: s.states, : s.inputs]
    return A, B, observable[:n_y], responses[0, :, : s.inputs], constant


def _simulate(matrices: tuple[NDArray[np.float64], ...], u: NDArray[np.float64]) -> NDArray[np.float64]:
    A, B, C, D, constant = matrices
    y = np.empty((len(u), len(C)))
    x = np.linalg.lstsq(np.eye(len(A)) - A, B @ u[0], rcond=None)[0]
    linear_kernel.state_space(A, B, C, D, u, x, y)
    return y + constant


def _fitted(provider: NeuralProvider, theta: NDArray[np.float64], seconds: float) -> NDArray[np.float64]:
    termination = Termination(max_iterations=LINEAR_ITERATIONS, tolerance=1e-3, max_time_s=max(seconds, 0.0))
    engine = LevenbergMarquardt(termination=termination, evidence_after=None)
    everything = Group(name="all", members=np.arange(len(theta)))
    prior = Prior(centre=theta, groups=(everything,), alphas=np.array([FLAT_ALPHA]), beta=1.0)
    return engine.minimise_within(provider, theta, prior).theta


def _unit_states(provider: NeuralProvider, theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same model with states that range to 1 over the records, where the hidden layer expects them."""
    s = provider.template.sizes
    paths = np.concatenate(provider.states(theta))
    low, high = paths.min(axis=0), paths.max(axis=0)
    scale, centre = np.maximum((high - low) / 2.0, 1e-9), (high + low) / 2.0
    M = theta[s.linear].reshape(s.states, s.row).copy()
    A, L = M[:, : s.states].copy(), theta[s.output].reshape(s.outputs, s.row).copy()
    M[:, : s.states] = A * scale / scale[:, None]
    M[:, s.states :] /= scale[:, None]
    M[:, -1] += (A @ centre - centre) / scale
    changed = theta.copy()
    changed[s.linear] = M.ravel()
    L[:, -1] += [row @ centre for row in L[:, : s.states]]
    L[:, : s.states] *= scale
    changed[s.output] = L.ravel()
    E = theta[s.start].reshape(s.states, -1) / scale[:, None]
    E[:, -1] -= centre / scale
    changed[s.start] = E.ravel()
    changed[s.count :] = ((theta[s.count :].reshape(-1, s.states) - centre) / scale).ravel()
    return changed
