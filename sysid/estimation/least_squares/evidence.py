r"""Bayesian regularisation: the prior, the evidence, and the number of parameters that the data determine.

The penalised loss is :math:`F = \beta E_D + \sum_g \alpha_g E_g` with :math:`E_D = \frac12\sum e^2` and
:math:`E_g = \frac12\sum_{i\in g} (\theta_i - \mu_i)^2`: a Gaussian noise of precision :math:`\beta` and, for each
group :math:`g` of weights, a Gaussian prior of precision :math:`\alpha_g` around :math:`\mu`. At a minimum of
:math:`F`, with :math:`A = \mathrm{diag}(\alpha)` and :math:`H = \beta J^T J + A`, the evidence is largest where
(MacKay 1992, "A practical Bayesian framework for backpropagation networks", eqs. 24 to 28; Foresee and Hagan
1997, who use the Gauss-Newton matrix for :math:`H`)

.. math::
    \gamma_g = n_g - \alpha_g\,\mathrm{tr}_g H^{-1}, \qquad
    \alpha_g = \frac{\gamma_g}{2 E_g}, \qquad \beta = \frac{N - \sum_g \gamma_g}{2 E_D},

    \ln p(D) = -F - \tfrac12 \ln\det H + \tfrac12\sum_g n_g\ln\alpha_g + \tfrac{N}{2}\ln\frac{\beta}{2\pi}.

**Why it does not break where** :math:`J^T J` **is singular.** Everything is computed from
:math:`M = A^{-1/2} H A^{-1/2} = I + \beta A^{-1/2} J^T J A^{-1/2}`, whose eigenvalues are at least 1 whatever the
rank of :math:`J`: :math:`\gamma_g = \sum_{i \in g} (1 - (M^{-1})_{ii})` lies between 0 and :math:`n_g` term by
term, and :math:`\ln\det H = \ln\det M + \sum\ln\alpha`. An eigenvalue sum over :math:`J^T J` itself, where
rounding makes small eigenvalues negative, does not have that property.

**Residuals that persist.** The formulas take every residual as new information. Free-run residuals of a deterministic
system are correlated over tens to hundreds of samples (:math:`\tau`, ``correlation_time``); counting all of them makes
:math:`\beta` too large by that factor and switches the regularisation off. The likelihood is therefore raised to the
power :math:`1/\tau`: :math:`N/\tau` samples of loss :math:`E_D/\tau`. With :math:`\tau = 1` this is MacKay's update.

Starts of one structure end with different :math:`\tau`, and an evidence of more samples is the larger one whatever they
say. So it is told for all of them, :math:`\tau \ln p(D)`: what one independent sample says, :math:`N` times.

Limits: the update does not guarantee that the evidence increases; a power of the likelihood is an approximation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.least_squares.provider import Linearisation
from sysid.estimation.least_squares.small_matrices import add_to_diagonal, cholesky, inverse_of
from sysid.estimation.results.result import Evidence
from sysid.kernels.arrays import read_only

BETA_LIMIT = float(np.finfo(np.float64).eps ** -2)
"""Precision of the residuals where nothing but rounding is left of them: outputs are scaled to about 1."""

ALPHA_BOUNDS = (1e-9, 1e9)
"""Bounds of a prior's precision in scaled numbers, where weights of order 1 are ordinary: a group outside them is
free, or switched off, for every practical purpose."""


SAMPLES_PER_PARAMETER = 4.0
"""Independent samples that each parameter is granted at least: a record so short, or residuals so persistent, that
fewer remain would leave the precision of the residuals undetermined."""

SAMPLES_PER_EFFECTIVE_PARAMETER = 2.0
"""The same for each parameter that the data determine, where the evidence is cautious: a prior that holds most of many
parameters at their centre then leaves the samples of these to the others. Of 1, 2, 4 and 8, two did best on plants and
measured records of 300 to 1,000 samples (``tests/benchmarks/short_records.py``)."""


STEPS = 5
"""Steps of the evidence's fixed-point iteration where parameters do not move meanwhile."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Group:
    """Weights that share one prior.

    Args:
        name: For people.
        members: Positions in the flat parameter vector.
        known: Whether its precision is known, and not the evidence's to find.
    """

    name: str
    members: NDArray[np.int64]
    known: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Prior:
    """Centre, groups and precisions of the weights, and the precision of the noise.

    Args:
        centre: Where each parameter is drawn to, shape ``(n_parameters,)``.
        groups: Disjoint groups that cover all parameters.
        alphas: Precision of each group, shape ``(n_groups,)``.
        beta: Precision of the residuals over their correlation time: what multiplies the loss.
        cautious: Whether samples are granted to those parameters alone that the data determine.
    """

    centre: NDArray[np.float64]
    groups: tuple[Group, ...]
    alphas: NDArray[np.float64]
    beta: float
    cautious: bool = False

    @cached_property
    def precision(self) -> NDArray[np.float64]:
        """Precision of each parameter, shape ``(n_parameters,)``."""
        precision = np.empty(len(self.centre))
        for group, alpha in zip(self.groups, self.alphas, strict=True):
            precision[group.members] = alpha
        return read_only(precision)

    def penalty(self, theta: NDArray[np.float64]) -> float:
        """The prior's part of the loss, over ``beta``, so that it adds to the residuals' part.

        Args:
            theta: Flat parameters.

        Returns:
            Half the sum of ``alpha / beta`` times the squared distances from the centre.
        """
        away = theta - self.centre
        return 0.5 * float(away @ (self.precision * away)) / self.beta


def update(prior: Prior, theta: NDArray[np.float64], at: Linearisation, n_samples: int) -> tuple[Prior, Evidence]:
    """One step of the evidence's fixed-point iteration, and the evidence with the precisions before it.

    Args:
        prior: Precisions now.
        theta: Flat parameters, near a minimum of the penalised loss.
        at: Loss, Gauss-Newton matrix and correlation time there.
        n_samples: Samples that count.

    Returns:
        The prior with new precisions, and the evidence found.
    """
    root = np.sqrt(prior.beta / prior.precision)
    M = at.gauss_newton * root[:, None] * root[None, :]
    add_to_diagonal(M, 1.0)
    shrunk, log_det = _inverse_diagonal(M)
    determined = np.clip(1.0 - shrunk, 0.0, 1.0)
    gammas = np.array([determined[group.members].sum() for group in prior.groups])
    granted = SAMPLES_PER_PARAMETER * len(theta)
    if prior.cautious:
        granted = SAMPLES_PER_EFFECTIVE_PARAMETER * float(gammas.sum())
    tau = min(at.correlation_time, max(1.0, n_samples / max(granted, 1.0)))
    independent = n_samples / tau
    energies = np.array([0.5 * np.sum((theta - prior.centre)[group.members] ** 2) for group in prior.groups])
    penalised = prior.beta * at.loss + float(prior.alphas @ energies)
    evidence = Evidence(
        log_evidence=tau * (-penalised - 0.5 * log_det)
        + 0.5 * n_samples * float(np.log(prior.beta * tau / (2.0 * np.pi))),
        beta=prior.beta * tau,
        alphas=_named(prior.groups, prior.alphas),
        effective_parameters=_named(prior.groups, gammas),
        parameters={group.name: len(group.members) for group in prior.groups},
        correlation_time=tau,
    )
    tiny = np.finfo(np.float64).tiny
    with np.errstate(over="ignore"):  # weights that stand at their centre: what overflows is bounded
        alphas = np.clip(gammas / np.maximum(2.0 * energies, tiny), *ALPHA_BOUNDS)
    alphas = np.where([group.known for group in prior.groups], prior.alphas, alphas)
    left = max(independent - float(gammas.sum()), 1.0)
    beta = min(left / max(2.0 * at.loss, tiny * left), BETA_LIMIT)
    return replace(prior, alphas=alphas, beta=beta), evidence


def settled(prior: Prior, theta: NDArray[np.float64], at: Linearisation, n_samples: int) -> tuple[Prior, Evidence]:
    """Precisions and evidence of parameters that do not move meanwhile.

    Args:
        prior: Precisions now.
        theta: Flat parameters.
        at: Loss, Gauss-Newton matrix and correlation time there.
        n_samples: Samples that count.

    Returns:
        The prior after some steps of the iteration, and the evidence before the last of them.
    """
    prior, evidence = update(prior, theta, at, n_samples)
    for _ in range(STEPS - 1):
        prior, evidence = update(prior, theta, at, n_samples)
    return prior, evidence


def _named(groups: Sequence[Group], values: NDArray[np.float64]) -> dict[str, float]:
    return {group.name: float(value) for group, value in zip(groups, values, strict=True)}


def _inverse_diagonal(M: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Diagonal of the inverse, and the log determinant, of a matrix whose eigenvalues are at least 1."""
    factor = cholesky(M)
    if factor is None:
        # Rounding in entries above 1e16 can outweigh the identity; the true eigenvalues are known to be 1 or more.
        values, vectors = linalg.eigh(M)
        values = np.maximum(values, 1.0)
        return (vectors**2) @ (1.0 / values), float(np.log(values).sum())
    inverse = inverse_of(factor)
    return np.einsum("ij,ij->j", inverse, inverse), 2.0 * float(np.log(np.diag(factor)).sum())
