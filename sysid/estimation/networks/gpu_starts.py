r"""Many random starts at once on a graphics processor: short batched fits, of which the best go on as starts.

Each candidate runs the Levenberg-Marquardt iteration of ``levenberg_marquardt.py`` for itself (its own damping, its own
acceptance), but all of them take their step together: one batched linearisation, one batched solve, one batched free
run. The prior's precision stays what it was at the begin; the evidence comes in the fits that follow.

Worth it where a device is present and candidates are hundreds: a batch takes little longer than one candidate. Without
a device the kernels race starts faster than torch does, and nothing here is used unless asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.evidence import Prior
from sysid.estimation.least_squares.levenberg_marquardt import MIN_GAIN
from sysid.estimation.networks.gpu_recursion import BatchedRecursion
from sysid.estimation.networks.initialise import AbstractLayout
from sysid.estimation.networks.provider import RecursionProvider

FIRST_DAMPING = 1e-3
"""As the engine's."""

INITIAL_ALPHA = 1e-2
"""Precision of the weights, as in ``starts.py``."""

ITERATIONS = 15
"""Steps that each scout takes: enough to see which starts leave their first plateau."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Scout:
    """One candidate after its short fit.

    Args:
        seed: Of its random start.
        theta: Flat parameters in the basis of training.
        loss: Half the weighted sum of squared residuals, in scaled numbers.
    """

    seed: int
    theta: NDArray[np.float64]
    loss: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Patrol:
    """What all scouts share.

    Args:
        provider: The records, in free run.
        to_plain: From the basis of training to plain parameters, shape ``(n_parameters, n_parameters)``.
        layout: What draws the starts.
        centre: Centre of the prior in the basis, shape ``(n_parameters,)``.
        regularisation: Precision of the prior over that of the residuals; ``None`` for the one that a single fit begins
            with, from the median candidate's error.
        device: ``auto``, ``cpu`` or ``cuda``.
        precision: ``float64`` or ``float32``.
    """

    provider: RecursionProvider
    to_plain: NDArray[np.float64]
    layout: AbstractLayout
    centre: NDArray[np.float64]
    regularisation: float | None = None
    device: str = "auto"
    precision: str = "float64"

    def scouts(self, seeds: Sequence[int], iterations: int = ITERATIONS) -> list[Scout]:
        """Fit one start per seed for a few iterations, all at once.

        Args:
            seeds: One per candidate.
            iterations: Steps taken or tried.

        Returns:
            The candidates, least loss first; those whose free run is lost come last.
        """
        batch = BatchedRecursion(self.provider, device=self.device, precision=self.precision)
        P = self.to_plain
        thetas = np.stack([self.layout.draw(np.random.default_rng(seed), self.centre) for seed in seeds])
        damping, growth = np.full(len(seeds), FIRST_DAMPING), np.full(len(seeds), 2.0)
        at = batch.linearise(thetas @ P.T)
        loss, gradient, matrix = at.loss, at.gradient @ P, P.T @ at.gauss_newton @ P
        given = self.regularisation
        if given is None:
            given = INITIAL_ALPHA * 2.0 * float(np.median(loss)) / self.provider.n_samples
        prior = self.layout.prior(self.centre, alpha=given, beta=1.0)
        for _ in range(iterations):
            steps, promised = _steps(prior, thetas, gradient, matrix, damping)
            trial = thetas + steps
            trial_loss = batch.loss(trial @ P.T)
            before = loss + _penalties(prior, thetas)
            with np.errstate(invalid="ignore", divide="ignore"):
                gain = (before - trial_loss - _penalties(prior, trial)) / promised
            taken: NDArray[np.bool_] = np.asarray((gain > MIN_GAIN) & (promised > 0.0))
            # Nielsen 1999, eq. 3.3, as in damping.py, with one factor per candidate.
            shrink = np.maximum(1.0 / 3.0, 1.0 - (2.0 * np.where(taken, gain, 0.5) - 1.0) ** 3)
            damping = np.where(taken, damping * shrink, damping * growth)
            growth = np.where(taken, 2.0, 2.0 * growth)
            thetas = np.where(taken[:, None], trial, thetas)
            if not taken.any():
                continue
            at = batch.linearise(thetas[taken] @ P.T)
            loss[taken], gradient[taken], matrix[taken] = at.loss, at.gradient @ P, P.T @ at.gauss_newton @ P
        found = [
            Scout(seed=seed, theta=theta, loss=float(value))
            for seed, theta, value in zip(seeds, thetas, loss, strict=True)
        ]
        return sorted(found, key=lambda scout: scout.loss if np.isfinite(scout.loss) else np.inf)


def _penalties(prior: Prior, thetas: NDArray[np.float64]) -> NDArray[np.float64]:
    away = thetas - prior.centre
    return np.asarray(0.5 * np.einsum("cp,p,cp->c", away, prior.precision / prior.beta, away))


def _steps(
    prior: Prior,
    thetas: NDArray[np.float64],
    gradient: NDArray[np.float64],
    matrix: NDArray[np.float64],
    damping: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Each candidate's damped step and the decrease that its linearisation promises; none where it is not finite."""
    ridge = prior.precision / prior.beta
    g = gradient + ridge * (thetas - prior.centre)
    H = matrix + np.diag(ridge)
    usable: NDArray[np.bool_] = np.asarray(np.isfinite(H).all(axis=(1, 2)) & np.isfinite(g).all(axis=1))
    H = np.where(usable[:, None, None], H, np.eye(len(ridge)))
    g = np.where(usable[:, None], g, 0.0)
    diagonal = np.einsum("cpp->cp", H)
    root = 1.0 / np.sqrt(np.maximum(diagonal, np.finfo(np.float64).tiny))
    A = H * root[:, :, None] * root[:, None, :] + damping[:, None, None] * np.eye(len(ridge))
    steps = -root * np.linalg.solve(A, (root * g)[:, :, None])[:, :, 0]
    promised = -(np.einsum("cp,cp->c", g, steps) + 0.5 * np.einsum("cp,cpq,cq->c", steps, H, steps))
    return steps, promised
