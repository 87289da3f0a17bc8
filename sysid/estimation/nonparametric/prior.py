"""The priors of all inputs together, and their hyperparameters of largest evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.small_matrices import back_substituted
from sysid.estimation.nonparametric.evidence import Posterior, Triangle, factored, from_the_left, posterior
from sysid.estimation.nonparametric.kernels import Hyperparameters, Kernel

SCALES = (0.0, 4.0, 8.0)
"""Natural logarithms of the variances, in units of the noise's, that a search begins with."""
CONSTANTS = (0.05, 0.15, 0.4)
"""Time constants that it begins with, as parts of the length."""


PLACES = 24
"""Dead times that are looked at all over a record, before every sample about the best of them."""
STEP, MOST_SPREAD = 1e-2, 0.7
"""Step of differences of a gradient, and largest standard deviation, of a hyperparameter's logarithm: a factor of 2."""
DOUBT = 3.0
"""Natural logarithm of the ratio of evidences up to which two answers are both possible: a factor of 20."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Prior:
    """Of every input: log variance, log time constant in samples and, for DC, log correlation length in samples.

    Args:
        kernel: Which.
        length: Lags of each input.
        dead: Dead times, shape ``(n_inputs,)``.
        theta: Shape ``(n_inputs * kernel.size,)``.
    """

    kernel: Kernel
    length: int
    dead: NDArray[np.int64]
    theta: NDArray[np.float64]

    @cached_property
    def kept(self) -> NDArray[np.bool_]:
        """Which lags of all inputs lie behind the dead times, shape ``(n_inputs * length,)``."""
        return (np.arange(self.length) >= self.dead[:, np.newaxis]).ravel()

    @property
    def hyperparameters(self) -> tuple[Hyperparameters, ...]:
        """In units of the noise variance, counted from each dead time."""
        found = []
        for row in self.theta.reshape(len(self.dead), -1):
            decay = float(np.exp(-2.0 * np.exp(-row[1])))
            correlation = np.sqrt(decay) if self.kernel is Kernel.TC else float(np.exp(-np.exp(-row[2])))
            found.append(Hyperparameters(scale=float(np.exp(row[0])), decay=decay, correlation=float(correlation)))
        return tuple(found)

    def in_units(self, noise_variance: float, inputs: NDArray[np.float64]) -> tuple[Hyperparameters, ...]:
        """The hyperparameters in output units squared by input unit squared."""
        return tuple(
            Hyperparameters(scale=h.scale * noise_variance / float(u) ** 2, decay=h.decay, correlation=h.correlation)
            for h, u in zip(self.hyperparameters, inputs, strict=True)
        )

    def shifted(self, j: int, dead: int) -> Prior:
        """The same prior, the dead time of one input being another; that of the length leaves the input out."""
        return replace(self, dead=np.where(np.arange(len(self.dead)) == j, dead, self.dead))

    def factor(self) -> NDArray[np.float64]:
        """The Cholesky factor of the covariance of the lags that are kept."""
        parts = [h.factor(self.length - int(k)) for h, k in zip(self.hyperparameters, self.dead, strict=True)]
        if len(parts) == 1:
            return parts[0]
        ends = np.cumsum([0, *map(len, parts)])
        L = np.zeros((ends[-1], ends[-1]))
        for part, a, b in zip(parts, ends[:-1], ends[1:], strict=True):
            L[a:b, a:b] = part
        return L


def tuned(
    data: Triangle,
    length: int,
    dead: NDArray[np.int64],
    kernels: Sequence[Kernel],
    *,
    start: Prior | None = None,
) -> Prior:
    """The prior of largest evidence.

    Args:
        data: The regression on all lags of every input.
        length: Lags of each input.
        dead: Dead times.
        kernels: Those that are tried.
        start: Where to begin; at some places of a grid by default.

    Returns:
        The prior.
    """
    from scipy.optimize import minimize

    best: tuple[float, Prior] | None = None
    for kernel in kernels:
        search = _Search(data=data, kernel=kernel, length=length, dead=dead)
        known = start or (best[1] if best else None)
        starts = search.grid() if known is None else [search.like(known)]
        theta = max(starts, key=search.value)
        found = minimize(
            search.descent, theta, jac=True, method="L-BFGS-B", bounds=search.bounds,
            options={"maxiter": 50, "ftol": 1e-8, "gtol": 1e-3},
        )  # fmt: skip
        if best is None or -float(found.fun) > best[0]:
            best = -float(found.fun), search.prior(np.asarray(found.x))
    assert best is not None  # noqa: S101 - there is a kernel
    return best[1]


def with_doubt(data: Triangle, prior: Prior) -> Posterior:
    """The posterior under a prior that is itself known only as well as the data tell it.

    Far out in the tail of a response its decay decides how wide the bands are, and a decay that is taken for certain
    makes them too narrow. The hyperparameters are spread as the curvature of the evidence has it, and means and
    covariances averaged over points on either side along its axes (Julier and Uhlmann 2004, "Unscented filtering and
    nonlinear estimation").

    Args:
        data: The regression on the lags of every input.
        prior: Of largest evidence.

    Returns:
        The posterior of that prior, with the covariance over all points.
    """
    search = _Search(data=data, kernel=prior.kernel, length=prior.length, dead=prior.dead)
    low, high = np.array(search.bounds).T
    best, kept = posterior(data.columns(prior.kept), prior.factor()), data.columns(prior.kept)
    axes = _axes(search, prior.theta, low, high)
    covariance, count = np.zeros_like(best.covariance), 2 * axes.shape[1]
    for away in (*axes.T, *-axes.T):
        moved = search.prior(np.clip(prior.theta + away, low, high))
        one = posterior(kept, moved.factor())
        apart = one.mean - best.mean
        covariance += (one.covariance + np.outer(apart, apart)) / count
    # What every point leaves out cannot make the bands narrower than those of the best one.
    wider = np.maximum(np.diag(best.covariance) - np.diag(covariance), 0.0)
    return replace(best, covariance=covariance + np.diag(wider))


def _axes(
    search: _Search, theta: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Axes of the hyperparameters' spread as columns, each as long as points along it are away."""
    d, slopes = len(theta), []
    for i in range(d):
        step = np.eye(d)[i] * STEP
        ahead, behind = (np.clip(theta + way * step, low, high) for way in (1.0, -1.0))
        slopes.append((search.descent(ahead)[1] - search.descent(behind)[1]) / max(float((ahead - behind)[i]), STEP))
    H = np.array(slopes)
    if not np.isfinite(H).all():
        return np.zeros((d, d))
    curvature, directions = np.linalg.eigh(0.5 * (H + H.T))
    spread = np.minimum(1.0 / np.sqrt(np.maximum(curvature, 1e-12)), MOST_SPREAD)
    return np.asarray(directions * (spread * np.sqrt(d)))


@dataclass(frozen=True, kw_only=True)
class DeadTime:
    """When an input begins to act, in samples.

    Args:
        best: Where the evidence is largest.
        low: The earliest that the data allow, to a factor of 20 of the evidence.
        high: The latest.
        odds: Natural logarithm of the evidence for a response against none at all.
    """

    best: int
    low: int
    high: int
    odds: float

    @property
    def acts(self) -> bool:
        """Whether the output answers to the input at all, to a factor of 20 of the evidence."""
        return self.odds > DOUBT


def dead_times(data: Triangle, prior: Prior, *, most: int) -> tuple[tuple[DeadTime, ...], Prior]:
    """The dead times of largest evidence, one input after the other.

    Args:
        data: The regression on all lags of every input.
        prior: With any dead times; its kernel is kept.
        most: The longest dead time that is looked for.

    Returns:
        The dead times, and the prior that begins at the earliest ones that the data allow.
    """
    found: list[DeadTime] = []
    for number in range(2):  # that of an input moves with those of the others
        found = []
        for j in range(len(prior.dead)):
            one = _scanned(data, prior, j, most, everywhere=number == 0)
            found.append(one)
            prior = prior.shifted(j, one.best)
        prior = tuned(data, prior.length, prior.dead, (prior.kernel,), start=prior)
    for j, one in enumerate(found):
        prior = prior.shifted(j, one.low)
    return tuple(found), prior


def _scanned(data: Triangle, prior: Prior, j: int, most: int, *, everywhere: bool) -> DeadTime:
    """The dead time of one input: at places all over if asked, and about the best of them at every sample."""
    values = dict[int, float]()
    without, own = prior.shifted(j, prior.length), np.repeat(np.arange(len(prior.dead)) == j, prior.length)
    left, constant = data.beside(without.kept, without.factor()) if (~own).any() else (data, 0.0)
    # Columns before the dead times of other inputs are in no prior.
    left = left.columns(own[~without.kept])
    alone = replace(prior, dead=prior.dead[j : j + 1], theta=prior.theta.reshape(len(prior.dead), -1)[j])

    def value(k: int) -> float:
        if k not in values:
            values[k] = _value(left, alone.shifted(0, k)) - constant
        return values[k]

    step = max(1, most // PLACES)
    places = range(0, most + 1, step) if everywhere else [int(min(prior.dead[j], most))]
    best = max(places, key=value)
    low = high = best
    # Outwards, as long as an answer there is possible, and past the places next to the best in any case.
    for way in (-1, 1):
        k = best
        while 0 <= k + way <= most:
            k += way
            if value(k) < max(values.values()) - DOUBT and (not everywhere or abs(k - best) >= step):
                break
    best = max(values, key=value)
    near = {k for k, one in values.items() if one >= values[best] - DOUBT}
    low = high = best
    while low - 1 in near:
        low -= 1
    while high + 1 in near:
        high += 1
    return DeadTime(best=best, low=low, high=high, odds=values[best] - value(prior.length))


def _value(data: Triangle, prior: Prior) -> float:
    return factored(data.columns(prior.kept), prior.factor()).log_evidence if prior.kept.any() else _nothing(data)


def _nothing(data: Triangle) -> float:
    return factored(data.columns(np.arange(data.R.shape[1]) == 0), np.zeros((1, 1))).log_evidence


@dataclass(frozen=True, kw_only=True, eq=False)
class _Search:
    data: Triangle
    kernel: Kernel
    length: int
    dead: NDArray[np.int64]

    @property
    def bounds(self) -> list[tuple[float, float]]:
        one = [(-12.0, 60.0), (np.log(0.2), np.log(20.0 * self.length)), (np.log(0.1), np.log(1e3))]
        return one[: self.kernel.size] * len(self.dead)

    @cached_property
    def kept(self) -> Triangle:
        """The regression on the lags that are kept: the same for all that is tried."""
        return self.data.columns(self.prior(np.zeros(0)).kept)

    def prior(self, theta: NDArray[np.float64]) -> Prior:
        return Prior(kernel=self.kernel, length=self.length, dead=self.dead, theta=theta)

    def grid(self) -> list[NDArray[np.float64]]:
        """The same prior for every input."""
        m = len(self.dead)
        rows = [
            (scale, np.log(max(constant * self.length, 0.5)), np.log(max(constant * self.length, 0.5)))
            for scale in SCALES
            for constant in CONSTANTS
        ]
        return [np.tile(row[: self.kernel.size], m) for row in rows]

    def like(self, prior: Prior) -> NDArray[np.float64]:
        """Another prior in the words of this kernel."""
        rows = prior.theta.reshape(len(prior.dead), -1)
        rows = np.column_stack([rows[:, :2], rows[:, 1]]) if rows.shape[1] == 2 else rows
        low, high = np.array(self.bounds).T
        return np.clip(rows[:, : self.kernel.size].ravel(), low, high)

    def value(self, theta: NDArray[np.float64]) -> float:
        return factored(self.kept, self.prior(theta).factor()).log_evidence

    def descent(self, theta: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        """Minus the logarithm of the evidence and its gradient."""
        prior = self.prior(theta)
        data, L = self.kept, prior.factor()
        whole = factored(data, L)
        mean = L @ back_substituted(whole.R, whole.z)
        w = data.R.T @ (data.z - data.R @ mean)
        both = data.gram[0]
        half = back_substituted(whole.R, from_the_left(L, both), transposed=True)
        S = both - half.T @ half
        G = 0.5 * (S - np.outer(w, w) * (data.samples / whole.rest))
        return -whole.log_evidence, self._gradient(prior, L, G)

    def _gradient(self, prior: Prior, L: NDArray[np.float64], G: NDArray[np.float64]) -> NDArray[np.float64]:
        slopes, at = [], 0
        for row, k in zip(prior.theta.reshape(len(self.dead), -1), self.dead, strict=True):
            n = self.length - int(k)
            block = slice(at, at + n)
            P = (L[block, block] @ L[block, block].T) * G[block, block]
            i, between = _places(n)
            both, apart = float(P.sum(axis=1) @ i), float((P * between).sum())
            of_decay = both * 2.0 * np.exp(-row[1])  # both = sum P (i + j) / 2
            if self.kernel is Kernel.TC:
                slopes += [float(P.sum()), of_decay + apart * np.exp(-row[1])]
            else:
                slopes += [float(P.sum()), of_decay, apart * np.exp(-row[2])]
            at += n
        return np.array(slopes)


@lru_cache(maxsize=16)
def _places(n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lags, and how far each is from each."""
    i = np.arange(n, dtype=np.float64)
    return i, np.abs(i[:, None] - i[None, :])
