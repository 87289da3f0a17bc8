r"""The pretraining to a free run: one step ahead on samples that fill the space of the regressors.

A free run is dear to train from a random start: each iteration runs over every sample of every record, most of which
say the same (a system at rest, held, slowly charging), and far from a minimum the errors of all earlier samples stand
in the way of each one. The step that the recursion makes is a function of its regressors, though, and a function can be
learnt from few samples if they are the right ones. The pretraining therefore

1. takes ``samples`` of all records, with probability falling with the root of how many others stand in the same cell
   of the regressors' space. Cells are spaced by :math:`\operatorname{arsinh}(x / 0.01)`: what drives a system is often
   small most of the time, and its sign matters there;
2. draws hidden weights of very different sharpness, log-uniform from :data:`SMOOTHEST` to :data:`SHARPEST`, each
   neuron's kink through one of the samples: valves, limits and friction switch within a hundredth of the range, where a
   layer that tiles the unit cube evenly (Nguyen and Widrow 1990) has no neuron;
3. minimises the one-step error on them, with the same engine and priors.

What comes out is not yet a simulator, since errors one step ahead say little of how they add up, but it is a start from
which the free run converges in tens of iterations instead of hundreds.

Limits: with measured noise the one-step minimum is biased (errors in the regressors), and many iterations lead away
from where a few lead; the samples chosen are in memory with their Jacobian block by block.
"""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.provider import AbstractProvider, Linearisation
from sysid.estimation.linear.regression import lagged
from sysid.estimation.networks.basis import RegressorBasis
from sysid.estimation.networks.initialise import READOUT_SPREAD, Layout
from sysid.estimation.networks.program_provider import BLOCK
from sysid.estimation.records.experiment import Experiment
from sysid.kernels.neurons import NEURONS, Neuron
from sysid.models import NARXModel, VectorNARXModel

SMOOTHEST, SHARPEST = 0.7, 100.0
"""Least and greatest length of a neuron's weights at the start, over regressors of size 1. At 100 a neuron switches
within a hundredth of the range."""

CELLS = 14
"""Cells along each regressor in which samples are counted."""

FINEST = 1e-2
"""Size of a scaled regressor below which cells are evenly spaced, and above which they widen in proportion."""


@dataclass(frozen=True, kw_only=True, eq=False)
class StepSamples(AbstractProvider):
    """One-step residuals at chosen samples, as a function of parameters in the basis of training.

    Args:
        layout: Where the parameters stand.
        regressors: In the basis, shape ``(n_rows, n_regressors)``.
        target: Scaled outputs, shape ``(n_rows, n_outputs)``; not a number where one does not count.
        neuron: The kind of the neurons.
    """

    layout: Layout
    regressors: NDArray[np.float64]
    target: NDArray[np.float64]
    neuron: Neuron
    n_samples: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "n_samples", int(np.count_nonzero(np.isfinite(self.target))))

    @classmethod
    def of(
        cls,
        template: NARXModel | VectorNARXModel,
        experiments: Sequence[Experiment],
        layout: Layout,
        basis: RegressorBasis,
        *,
        samples: int,
        seed: int,
    ) -> StepSamples:
        """Choose samples of some records.

        Args:
            template: The model, for its scaling and lags.
            experiments: The records; samples of weight zero are never chosen, nor those that look at masked ones.
            layout: Where the parameters stand.
            basis: The basis of training.
            samples: How many to choose; all of them where there are fewer.
            seed: Of the choice.

        Returns:
            The provider.
        """
        rows, targets = [], []
        for experiment in experiments:
            whole, target = regressors_of(template, experiment, layout)
            low, high = template.recursion.bounds.T  # at a limit a step says only that it would go on
            seen = experiment.one_step(layout.columns)
            weights = np.ones(1) if seen.weights is None else seen.weights[:, np.newaxis]
            each = (weights if seen.each is None else seen.each) > 0.0
            counted = each & (target > low) & (target < high)
            some = counted.any(axis=1)
            rows.append(whole if some.all() else whole[some])
            targets.append(np.where(counted, target, np.nan)[some])
            del whole  # of long records each copy is the largest thing that there is
        plain = rows[0] if len(rows) == 1 else np.concatenate(rows)
        rows.clear()
        plain -= basis.centre
        regressors, target = plain @ basis.matrix.T, np.concatenate(targets)
        del plain
        if len(regressors) > samples:
            chosen = space_filling(regressors, samples, np.random.default_rng(seed))
            regressors, target = regressors[chosen], target[chosen]
        return cls(
            layout=layout,
            regressors=np.ascontiguousarray(regressors),
            target=target,
            neuron=NEURONS[template.network.activation],
        )

    def draw(self, rng: np.random.Generator, centre: NDArray[np.float64]) -> NDArray[np.float64]:
        """A random start with kinks of every sharpness, where the samples are.

        Args:
            rng: Source of randomness.
            centre: Where the linear part starts, shape ``(n_parameters,)``.

        Returns:
            Flat parameters in the basis.
        """
        k, r = self.layout.neurons, self.regressors.shape[1]
        theta = centre.copy()
        directions = rng.standard_normal((k, r))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        sharpness = np.exp(rng.uniform(np.log(SMOOTHEST), np.log(SHARPEST), k))
        weights = sharpness[:, None] * directions
        through = self.regressors[rng.integers(len(self.regressors), size=k)]
        theta[self.layout.hidden] = np.concatenate([weights.ravel(), -np.sum(weights * through, axis=1)])
        theta[self.layout.readout] = (
            READOUT_SPREAD * rng.standard_normal((len(self.layout.outputs), k)) / sharpness
        ).ravel()
        if self.layout.gated:
            theta[self.layout.gates] = (READOUT_SPREAD * rng.standard_normal((k, r)) / sharpness[:, None]).ravel()
        return theta

    def loss(self, theta: NDArray[np.float64]) -> float:
        """Half the sum of squared residuals; see the base class."""
        total = 0.0
        for rows in self._blocks():
            residual = self._pass(theta, rows).residual.ravel()
            total += 0.5 * float(residual @ residual)
        return total if np.isfinite(total) else np.inf

    def linearise(self, theta: NDArray[np.float64], *, correlation: bool = True) -> Linearisation:  # noqa: ARG002 - it is 1
        """Loss, gradient and Gauss-Newton matrix; see the base class.

        Samples that were chosen for being different are independent, so that the correlation time is 1.
        """
        loss, gradient, matrix = 0.0, np.zeros(len(theta)), np.zeros((len(theta), len(theta)))
        for rows in self._blocks():
            passed = self._pass(theta, rows)
            for output, residual in enumerate(passed.residual.T):
                J = self._jacobian(passed, output, len(theta))
                loss += 0.5 * float(residual @ residual)
                gradient += J.T @ residual
                matrix += J.T @ J
        return Linearisation(loss=loss, gradient=gradient, gauss_newton=matrix)

    def _blocks(self) -> list[slice]:
        return [slice(first, first + BLOCK) for first in range(0, len(self.target), BLOCK)]

    def _pass(self, theta: NDArray[np.float64], rows: slice) -> _Pass:
        layout, x, target = self.layout, self.regressors[rows], self.target[rows]
        k, r, m = layout.neurons, x.shape[1], len(layout.outputs)
        affine = theta[layout.affine]
        sums = x @ theta[: k * r].reshape(k, r).T + theta[k * r : k * (r + 1)]
        h = self.neuron.value(sums)
        readout = theta[layout.readout].reshape(m, k)
        gates = x @ theta[layout.gates].reshape(k, r).T if layout.gated else np.zeros(1)
        linear = affine[m:].reshape(m, -1)
        found, counts = np.empty(target.shape), np.isfinite(target)
        for j in range(m):
            straight = affine[j] + (x @ linear[j] if layout.linear else 0.0)
            found[:, j] = np.sum((readout[j] + gates) * h, axis=1) + straight - target[:, j]
        return _Pass(x, sums, h, gates, readout, np.where(counts, found, 0.0), counts)

    def _jacobian(self, passed: _Pass, output: int, n_parameters: int) -> NDArray[np.float64]:
        """Of an output; zeros where it does not count."""
        layout, x, h = self.layout, passed.x, passed.h
        k, r = layout.neurons, x.shape[1]
        slopes = self.neuron.slope(passed.sums) * (passed.readout[output] + passed.gates)
        J = np.zeros((len(x), n_parameters))
        J[:, : k * r] = (slopes[:, :, None] * x[:, None, :]).reshape(len(x), -1)
        J[:, k * r : k * (r + 1)] = slopes
        J[:, layout.readout.start + output * k : layout.readout.start + (output + 1) * k] = h
        J[:, layout.affine.start + output] = 1.0
        if layout.linear:
            J[:, layout.linear_part(output)] = x
        if layout.gated:
            J[:, layout.gates] = (h[:, :, None] * x[:, None, :]).reshape(len(x), -1)
        own = passed.counts[:, output]
        if not own.all():
            J[~own] = 0.0
        return J


@dataclass(frozen=True, eq=False)
class WhileUsed:
    """Samples that are there while starts use them: of all samples they are as large as the records with all lags.

    Args:
        make: Makes them; ``None`` where there are none.
    """

    make: Callable[[], StepSamples | None]
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _last: list[weakref.ref[StepSamples]] = field(default_factory=list)

    def made(self) -> StepSamples | None:
        """Those that another start has at the moment, or new ones."""
        with self._lock:
            found = self._last[0]() if self._last else None
            if found is None and (found := self.make()) is not None:
                self._last[:] = [weakref.ref(found)]
            return found


@dataclass(frozen=True, eq=False)
class _Pass:
    """Some samples: regressors, their sums, activations, gates, readouts, residuals, and which of these count."""

    x: NDArray[np.float64]
    sums: NDArray[np.float64]
    h: NDArray[np.float64]
    gates: NDArray[np.float64]
    readout: NDArray[np.float64]
    residual: NDArray[np.float64]
    counts: NDArray[np.bool_]


def regressors_of(
    model: NARXModel | VectorNARXModel, experiment: Experiment, layout: Layout
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What a network reads of a record one step ahead, and what it should put out, in scaled numbers.

    Args:
        model: The network, for its scaling.
        experiment: The record.
        layout: What of it reads which lags.

    Returns:
        Shape ``(n_samples, n_regressors)``, and the outputs, shape ``(n_samples, n_outputs)``.
    """
    form, n = model.recursion, len(experiment.output)
    u, y = form.extended(experiment.inputs, experiment.history)
    y[-n:] = target = model.scaling.scale_output(experiment.output).reshape(n, -1)
    return lagged(np.concatenate([u, y], axis=1), y, layout.columns, n), target


def space_filling(regressors: NDArray[np.float64], samples: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Samples that fill the space of the regressors more evenly than all of them do.

    Args:
        regressors: Scaled to size 1, shape ``(n_samples, n_regressors)``.
        samples: How many to choose; all of them where there are fewer.
        rng: Source of randomness.

    Returns:
        Their positions in ascending order.

    Example:
        >>> crowd = np.zeros((1000, 1))
        >>> crowd[500:510, 0] = np.linspace(-1.0, 1.0, 10)
        >>> chosen = space_filling(crowd, 40, np.random.default_rng(0))
        >>> len(chosen), int(np.isin(np.arange(500, 510), chosen).sum())  # 1 % of the samples, 10 % of the choice
        (40, 4)
    """
    if len(regressors) <= samples:
        return np.arange(len(regressors))
    spread = np.arcsinh(regressors / FINEST) / np.arcsinh(1.0 / FINEST)
    cells = np.clip(((spread + 1.0) * (CELLS / 2)).astype(np.int64), 0, CELLS - 1)
    _, place, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    probability = 1.0 / np.sqrt(counts[place.ravel()])
    chosen = rng.choice(len(regressors), samples, replace=False, p=probability / probability.sum())
    return np.sort(chosen).astype(np.int64)
