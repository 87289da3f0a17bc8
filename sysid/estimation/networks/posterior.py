r"""The posterior of a fitted network: how far its parameters, and with them its output, may be off.

At a minimum :math:`\hat\theta` of the penalised loss (``regularisation.py``) the posterior is taken to be the Gaussian
whose precision is the curvature there (MacKay 1992, "A practical Bayesian framework for backpropagation networks",
section 3.2), in the Gauss-Newton approximation:

.. math::
    \theta \sim \mathcal N(\hat\theta, \Sigma), \qquad \Sigma^{-1} = H = \frac{\beta}{c} J^T J + A,
    \qquad A = \mathrm{diag}(\alpha).

:math:`\beta` (``Prior.beta``) is already the precision of the residuals over their correlation time, so that
residuals that persist do not count as new information at every sample; :math:`c` (``copies``) is how often each record
was used, since a copy with an offset has no noise of its own. As for the evidence, everything comes from
:math:`M = A^{-1/2} H A^{-1/2} = L L^T`, whose eigenvalues are at least 1 whatever the rank of :math:`J`. Training
stands in a basis, :math:`\theta_\text{plain} = P\theta`, and what is kept is a factor of the covariance of the plain
parameters:

.. math:: F = P A^{-1/2} L^{-T}, \qquad \Sigma_\text{plain} = F F^T.

An output depends on the parameters through its sensitivities :math:`j_t = d\hat y_t / d\theta`, the rows of the
Jacobian in free run or one step ahead, and a measured output has the residuals' variance :math:`\sigma^2` besides:

.. math:: \mathrm{var}(y_t) = \lVert F^T j_t \rVert^2 + \sigma^2.

:math:`\sigma^2` is a figure of its own for each of the two: the mean squared residual on the estimation records, times
:math:`N / (N - c\,\tau\gamma)` for the parameters that were fitted (of free-run residuals, :math:`\tau` at a time
count as one; one step ahead each counts). Where errors of several outputs hang together, :math:`\tau` is as many times
as long as they repeat each other (:func:`repeated`). :math:`\tau` here, and in :math:`\beta`, is that of an
autoregression of the residuals (:func:`~sysid.estimation.nonparametric.noise.persistence`) where that is longer than
what training counted.
What a free run leaves is not noise but an error of the model, which depends on what the inputs do; the records that
it was fitted to show the least of it. Where there are traces that trained nothing (``selection``),
:func:`calibrate` therefore compares the standardised errors there with what the Gaussian promises, and ``spread``
widens the intervals by the ratio of their 95 % quantiles (a split conformal interval, Lei et al. 2018,
"Distribution-free predictive inference for regression", section 5.2, applied to whole records).

Limits: the Gaussian is local and the output is linearised in the parameters, so other minima count for nothing; a model
that was stopped early does not stand at a minimum; the residuals' variance is one number, too wide where the output
rests and too narrow where it moves fast; the spread is that of one level, and of traces that also chose between the
starts; errors at neighbouring samples are dependent, so that an interval says nothing about a whole record at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.least_squares.evidence import SAMPLES_PER_PARAMETER
from sysid.estimation.least_squares.state import State
from sysid.estimation.networks.provider import RecursionProvider
from sysid.estimation.nonparametric.noise import persistence
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.results.result import Evidence, Loop
from sysid.models import AbstractModel, Recursion
from sysid.models.contract import gaps
from sysid.models.lagged.vector_recursion import VectorRecursion
from sysid.models.linear.innovation_moves import prediction_moves

CALIBRATED_AT = 0.95
"""The level at which the spread is found."""

LEAST_NOISE_SHARE = 0.05
"""Least share of the samples that is taken to be left for the residuals' variance once the parameters are paid for."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Noise:
    """Errors that remain, of the free run and one step ahead.

    Args:
        free_run: Of the free run; for a model of several outputs, here and below, an array with one figure an output.
        one_step: One step ahead.
    """

    free_run: float | NDArray[np.float64]
    one_step: float | NDArray[np.float64]

    def of(self, loop: Loop) -> float | NDArray[np.float64]:
        """The figure of one of the two.

        Args:
            loop: ``CLOSED`` for the free run.

        Returns:
            The figure.
        """
        return self.free_run if loop is Loop.CLOSED else self.one_step


@dataclass(frozen=True, kw_only=True, eq=False)
class Posterior:
    """The Gaussian posterior of a model's parameters.

    Args:
        factor: ``F`` with covariance ``F F^T`` of the flat parameters of the model's recursion, or of the polynomials
            of a transfer function, shape ``(n_parameters, n_directions)``.
        noise: Variance of the residuals, in the output's unit squared.
        spread: Factor of the standard deviations, at least 1: how much larger errors were on traces that train nothing.
    """

    factor: NDArray[np.float64]
    noise: Noise
    spread: Noise = Noise(free_run=1.0, one_step=1.0)

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Of the flat parameters, shape ``(n_parameters, n_parameters)``."""
        return np.asarray(self.factor @ self.factor.T)

    def parameter_variance(
        self, model: AbstractModel, experiment: Experiment, loop: Loop, *, steps: int = 1
    ) -> NDArray[np.float64]:
        """The part of an output's variance that is due to the parameters.

        Args:
            model: The model that the posterior belongs to.
            experiment: Inputs, history and, one step ahead, the measured output.
            loop: ``CLOSED`` for the free run.
            steps: How far ahead, where it is not the free run; beyond one of linear models.

        Returns:
            Of the output's shape, in its unit squared; NaN one step ahead where there is no such run.
        """
        form = model.recursion
        if not form.predicts and loop is not Loop.CLOSED:
            return np.full(experiment.output.shape, np.nan)
        with np.errstate(all="ignore"):  # what the data leave open may move the output beyond all numbers
            measured = None if loop is Loop.CLOSED else experiment.output
            given = (self.factor, experiment.inputs, experiment.history, measured)
            moves = model.output_moves(*given) if steps == 1 else prediction_moves(model, *given, steps=steps)
            if moves is not None:
                variance = np.einsum("...j,...j->...", moves, moves)
                return np.where(np.isfinite(variance), variance, np.inf)
        assert isinstance(form, Recursion | VectorRecursion)  # noqa: S101 - the forms without moves of their own
        provider = RecursionProvider(template=form, experiments=(experiment,), closed=loop is Loop.CLOSED)
        found = provider.output_variance(form.theta, self.factor).reshape(experiment.output.shape)
        return found * np.square(form.scaling.output_scale)

    def to_arrays(self) -> dict[str, NDArray[np.float64]]:
        """The fields as arrays, to be stored."""
        return {
            "factor": self.factor,
            "noise": np.array([self.noise.free_run, self.noise.one_step]),
            "spread": np.array([self.spread.free_run, self.spread.one_step]),
        }

    @classmethod
    def from_arrays(cls, arrays: dict[str, NDArray[np.float64]]) -> Posterior:
        """The posterior that :meth:`to_arrays` wrote.

        Args:
            arrays: What it wrote.

        Returns:
            The posterior.
        """
        noise, spread = (
            Noise(free_run=_figure(arrays[name][0]), one_step=_figure(arrays[name][1])) for name in ("noise", "spread")
        )
        return cls(factor=arrays["factor"], noise=noise, spread=spread)


def _figure(stored: Any) -> float | NDArray[np.float64]:
    """A figure, or those of several outputs."""
    return np.asarray(stored, dtype=np.float64) if np.ndim(stored) else float(stored)


def laplace(
    state: State,
    model: AbstractModel,
    to_plain: NDArray[np.float64],
    experiments: Sequence[Experiment],
    *,
    copies: int,
    stride: int = 1,
) -> Posterior | None:
    """The posterior at the end of a fit.

    Args:
        state: Where the fit stands, in the basis of training.
        model: The model there.
        to_plain: From parameters in the basis to the model's, shape ``(n_parameters, n_directions)``.
        experiments: The records that were fitted.
        copies: How often each record is among them.
        stride: Every so-manieth sample counted.

    Returns:
        The posterior, not calibrated; ``None`` where the evidence was never computed.
    """
    evidence = state.evidence
    if evidence is None:
        return None
    root = 1.0 / np.sqrt(state.prior.precision)
    counted = len(model.mapping.outputs) * sum(e.n_counted for e in experiments)
    slower = _slower(model, experiments, evidence, counted, stride)
    M = (state.prior.beta / (copies * slower)) * state.at.gauss_newton * root[:, None] * root[None, :]
    M[np.diag_indices_from(M)] += 1.0
    paid = slower * copies * stride * evidence.correlation_time * evidence.total_effective_parameters
    left, white = (
        max(1.0 - each / counted, LEAST_NOISE_SHARE) for each in (paid, copies * evidence.total_effective_parameters)
    )
    errors = remaining(model, experiments)
    noise = Noise(free_run=errors.free_run / left, one_step=errors.one_step / white)
    return Posterior(factor=to_plain @ (root[:, None] * _inverse_root(M)), noise=noise)


def _slower(
    model: AbstractModel, experiments: Sequence[Experiment], evidence: Evidence, counted: int, stride: int
) -> float:
    """By how much the free run's errors persist longer than training took them to, and repeat each other.

    The evidence sums the autocorrelations of what a fit leaves, which has lost its slowest part to the fit; that is
    steady enough to train by, and too short to say how well the parameters are known. Errors of several outputs that
    hang together are counted there once an output.
    """
    longest = counted / (SAMPLES_PER_PARAMETER * max(evidence.total_effective_parameters, 1.0))
    errors = free_run_errors(model, experiments)
    found = min(persistence(errors), longest)
    return max(found / (stride * evidence.correlation_time), 1.0) * repeated(errors, len(model.mapping.outputs))


def repeated(errors: Sequence[NDArray[np.float64]], n_outputs: int) -> float:
    """How often the errors of several outputs say the same: the largest eigenvalue of their correlations.

    A sum over outputs takes their errors for independent. Where they are not, the variance of what is estimated from
    them is larger, by this at most (a sandwich, White 1982, "Maximum likelihood estimation of misspecified models").

    Args:
        errors: Of each record and output in turn, shape ``(n_samples,)``.
        n_outputs: Outputs.

    Returns:
        From 1 to the number of outputs.

    Example:
        >>> e = np.array([1.0, -1.0, 1.0, -1.0])
        >>> repeated([e, 3.0 * e], 2), repeated([e, np.array([1.0, 1.0, -1.0, -1.0])], 2)
        (2.0, 1.0)
    """
    table = np.array([np.concatenate(list(errors[at::n_outputs])) for at in range(n_outputs)])
    size = np.sqrt(np.mean(table**2, axis=1))
    if n_outputs == 1 or not np.isfinite(table).all() or not (size > 0.0).all():
        return 1.0
    together = (table / size[:, np.newaxis]) @ (table / size[:, np.newaxis]).T / table.shape[1]
    return float(np.clip(np.linalg.eigvalsh(together)[-1], 1.0, n_outputs))


def free_run_errors(model: AbstractModel, experiments: Sequence[Experiment]) -> list[NDArray[np.float64]]:
    """Errors of the free run over some records, those that do not count as zero.

    Args:
        model: The model.
        experiments: The records, each with the history that its run begins with.

    Returns:
        For each record and output shape ``(n_samples,)``; of several outputs relative to their sizes.
    """
    found: list[NDArray[np.float64]] = []
    for e in experiments:
        left = (model.simulate(e.inputs, e.history) - e.output).reshape(len(e.output), -1)
        counts = np.ones(len(left), dtype=bool) if e.weights is None else e.weights > 0.0
        found += list(np.where(counts[:, np.newaxis], left, 0.0).T)
    n = len(model.mapping.outputs)
    if n > 1:  # in units of their own: over their sizes, so that none of them speaks for all
        sizes = [np.sqrt(np.mean(np.concatenate(found[output::n]) ** 2)) for output in range(n)]
        found = [error / (sizes[at % n] or 1.0) for at, error in enumerate(found)]
    return found


def remaining(model: AbstractModel, experiments: Sequence[Experiment]) -> Noise:
    """Mean squared errors over some records.

    Args:
        model: The model.
        experiments: The records, each with the history that its run begins with.

    Returns:
        Of both runs, in the outputs' units squared; NaN one step ahead where there is no such run.
    """
    form, counted = model.recursion, sum(e.n_counted for e in experiments)
    if isinstance(form, Recursion):
        found = []
        for closed in (True, False):
            provider = RecursionProvider(template=form, experiments=tuple(experiments), closed=closed)
            found.append(2.0 * provider.loss(form.theta) / counted * form.scaling.output_scale**2)
        return Noise(free_run=found[0], one_step=found[1])
    figures: list[NDArray[np.float64]] = []
    for closed in (True, False):
        total = np.zeros(len(model.mapping.outputs))
        for e in experiments if closed or form.predicts else ():
            run = _run(model, e, closed=closed)
            weights = np.ones(len(run)) if e.weights is None else e.weights
            total += [float(np.sum(column * weights)) for column in ((run - e.output) ** 2).reshape(len(run), -1).T]
        figures.append(total / max(counted, 1) if closed or form.predicts else np.full(len(total), np.nan))
    free_run, one_step = (each if model.structure.several_outputs else float(each[0]) for each in figures)
    return Noise(free_run=free_run, one_step=one_step)


def _inverse_root(M: NDArray[np.float64]) -> NDArray[np.float64]:
    """``R`` with ``R R^T`` the inverse of a matrix whose eigenvalues are at least 1."""
    try:
        factor = linalg.cholesky(M, lower=True)
    except linalg.LinAlgError:
        # As in the evidence: rounding can outweigh the identity, and the true eigenvalues are known to be 1 or more.
        values, vectors = linalg.eigh(M)
        return np.asarray(vectors / np.sqrt(np.maximum(values, 1.0)))
    return np.asarray(linalg.solve_triangular(factor, np.eye(len(M)), lower=True).T)


def calibrate(posterior: Posterior, model: AbstractModel, experiments: Sequence[Experiment]) -> Posterior:
    """Widen the intervals to what the errors are on records that trained nothing.

    Args:
        posterior: The posterior.
        model: Its model.
        experiments: Such records; none leave the posterior as it is.

    Returns:
        The posterior with its spread.
    """
    if not experiments:
        return posterior
    one = np.ones(len(model.mapping.outputs))
    spreads = {Loop.CLOSED: one, Loop.OPEN: one}
    for loop in Loop if model.recursion.predicts else (Loop.CLOSED,):
        ratios = [_standardised(posterior, model, experiment, loop) for experiment in experiments]
        promised = float(scipy.stats.norm.ppf(0.5 + 0.5 * CALIBRATED_AT))
        found = np.quantile(np.concatenate(ratios), CALIBRATED_AT, axis=0) / promised
        spreads[loop] = np.where(np.isfinite(found), np.maximum(found, 1.0), 1.0).reshape(one.shape)
    closed, opened = (value if model.structure.several_outputs else float(value[0]) for value in spreads.values())
    return replace(posterior, spread=Noise(free_run=closed, one_step=opened))


def _standardised(posterior: Posterior, model: AbstractModel, e: Experiment, loop: Loop) -> NDArray[np.float64]:
    """Absolute errors over their standard deviations, where samples count; of each output."""
    variance = posterior.parameter_variance(model, e, loop)
    closed = loop is Loop.CLOSED
    output = _run(model, e, closed=closed)
    counted = np.ones(len(output), dtype=bool) if e.weights is None else e.weights > 0.0
    deviation = np.sqrt(variance + posterior.noise.of(loop))
    return np.asarray(np.abs(output - e.output)[counted] / np.maximum(deviation[counted], np.finfo(np.float64).tiny))


def _run(model: AbstractModel, e: Experiment, *, closed: bool) -> NDArray[np.float64]:
    """The free run over a record, or the prediction one step ahead."""
    if closed:
        return model.simulate(e.inputs, e.history)
    return gaps.predicted(model, e.inputs, e.output, e.history, e.usable)
