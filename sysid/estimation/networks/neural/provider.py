"""Residuals and Jacobians of the free run of a neural state space, for the Levenberg-Marquardt engine."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.correlation import correlation_time
from sysid.estimation.least_squares.provider import AbstractWeighing, Linearisation
from sysid.estimation.networks.neural.records import NeuralRecord, NeuralRecords
from sysid.estimation.networks.program_provider import BLOCK
from sysid.kernels import neural_state_space as kernel
from sysid.kernels.arrays import forget_what_has_died_away


@dataclass(frozen=True, kw_only=True, eq=False)
class NeuralProvider(NeuralRecords, AbstractWeighing):
    """Residuals of a :class:`NeuralForm` in free run, as a function of its parameters and the records' states."""

    def nearest(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """Parameters whose matrices have their rank again; see the base class."""
        return theta if self.template.sizes.directions is None else self.template.sizes.hold(theta)

    def loss(self, theta: NDArray[np.float64]) -> float:
        """Half the weighted sum of squared residuals; see the base class."""
        if self.stable and not self._dies_away(theta):
            return np.inf
        total = 0.0
        for record in self._records:
            residual = record.weighted(self._error(record, theta))
            with np.errstate(over="ignore", invalid="ignore"):  # a free run that explodes has no loss
                total += 0.5 * float(residual @ residual)
        return total if np.isfinite(total) else np.inf

    def _dies_away(self, theta: NDArray[np.float64]) -> bool:
        """Whether the states die away where neurons do nothing."""
        n = self.template.sizes.states
        M = theta[self.template.sizes.linear].reshape(n, -1)[:, :n]
        return bool(np.isfinite(M).all()) and float(np.abs(np.linalg.eigvals(M)).max()) < 1.0

    def _error(self, record: NeuralRecord, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """The free run less what was measured, in one array: a long record's is many MB."""
        y = np.empty(record.target.shape)
        kernel.free_run(record.u, self._begin(record, theta), *self.template.arguments(theta), y)
        y -= record.target
        return y

    # A random start whose free run explodes has none; it is not told as a warning, the engine sees it.
    @np.errstate(over="ignore", invalid="ignore")
    def linearise(self, theta: NDArray[np.float64], *, correlation: bool = True) -> Linearisation:
        """Loss, gradient and Gauss-Newton matrix; see the base class."""
        gradient, matrix = np.zeros(len(theta)), np.zeros((len(theta), len(theta)))
        loss, correlated = 0.0, 0.0
        for record in self._records:
            residuals = np.empty((len(record.u), self.template.sizes.outputs))
            raw_gradient, raw_matrix = np.zeros(self._n_raw), np.zeros((self._n_raw, self._n_raw))
            for rows, y, raw in self._raw(record, theta):
                residual = record.weighted(y - record.target[rows], rows)
                weighted = record.weighted(raw, rows)
                loss += 0.5 * float(residual @ residual)
                raw_gradient += weighted.T @ residual
                raw_matrix += weighted.T @ weighted  # one array twice: NumPy calls syrk, half the flops
                residuals[rows] = residual.reshape(-1, residuals.shape[1])
            self._add(self._of_begun(record, theta), raw_gradient, raw_matrix, gradient, matrix)
            for whole in residuals.T if correlation else ():
                correlated += len(whole) * correlation_time(whole)
        self.template.sizes.along(theta, gradient, matrix, matrix.T)
        return Linearisation(
            loss=loss,
            gradient=gradient,
            gauss_newton=matrix,
            correlation_time=correlated / sum(record.target.size for record in self._records)
            if correlation
            else np.nan,
        )

    def jacobian(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """The whole Jacobian of the scaled outputs, unweighted, records one after the other.

        Args:
            theta: Flat parameters.

        Returns:
            Shape ``(n_samples_of_all_records * n_outputs, n_parameters)``, a sample's outputs side by side.
        """
        blocks = [block.copy() for r in self._records for _, _, block in self._blocks(r, theta)]
        return np.concatenate(blocks).reshape(-1, len(theta))

    def outputs(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """The scaled free runs, records one after the other.

        Args:
            theta: Flat parameters.

        Returns:
            Shape ``(n_samples_of_all_records, n_outputs)``.
        """
        return np.concatenate([y.copy() for record in self._records for _, y, _ in self._blocks(record, theta)])

    def variances(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean squared residual of each output; see the base class."""
        total, counted = np.zeros(self.template.sizes.outputs), np.zeros(self.template.sizes.outputs)
        for record in self._records:
            squares = self._error(record, theta)
            squares *= squares
            if record.root_weights is None:
                total, counted = total + np.sum(squares, axis=0), counted + len(squares)
                continue
            weights = record.root_weights**2
            total += np.sum(weights * squares, axis=0)
            counted += weights.sum(axis=0)  # with the weights of outputs, which thus are none
        return np.asarray(total / counted)

    def with_output_weights(self, weights: tuple[float, ...]) -> NeuralProvider:
        """The same residuals with other weights; see the base class."""
        return replace(self, output_weights=weights)

    def there_and_back(self, theta: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        """Scaled outputs over each record, and from there on over its inputs backwards, with signs and without bounds.

        Args:
            theta: Flat parameters.

        Returns:
            One array of shape ``(2 * n_samples, n_outputs)`` per record.
        """
        form = replace(self.at(theta), rectified=False, low=-np.inf, high=np.inf)
        return tuple(form.run(np.concatenate([r.u, r.u[::-1]]), self._begin(r, theta)) for r in self._records)

    def loss_of(self, outputs: Sequence[NDArray[np.float64]]) -> float:
        """Half the weighted sum of squared residuals of given runs.

        Args:
            outputs: For each record scaled outputs with signs and without bounds, shape ``(n_samples, n_outputs)``.

        Returns:
            The loss.
        """
        form, total = self.template, 0.0
        for record, signed in zip(self._records, outputs, strict=True):
            y = np.clip(np.abs(signed) if form.rectified else signed, form.low, form.high)
            residual = record.weighted(y - record.target)
            total += 0.5 * float(residual @ residual)
        return total

    def _add(
        self,
        of_begun: tuple[NDArray[np.int64], NDArray[np.float64]],
        raw_gradient: NDArray[np.float64],
        raw_matrix: NDArray[np.float64],
        gradient: NDArray[np.float64],
        matrix: NDArray[np.float64],
    ) -> None:
        """Add the normal equations of one record's rows as the kernel writes them to those of the parameters."""
        n, dynamic, output = self.template.sizes.states, self.template.sizes.dynamic, self.template.sizes.output
        begun = slice(dynamic.stop, dynamic.stop + n)
        kept = np.r_[dynamic, begun.stop : self._n_raw]
        places = np.r_[dynamic, output]
        to, D = of_begun
        gradient[places] += raw_gradient[kept]
        gradient[to] += D.T @ raw_gradient[begun]
        matrix[np.ix_(places, places)] += raw_matrix[np.ix_(kept, kept)]
        across = raw_matrix[kept, begun] @ D
        matrix[np.ix_(places, to)] += across
        matrix[np.ix_(to, places)] += across.T
        matrix[np.ix_(to, to)] += D.T @ raw_matrix[begun, begun] @ D

    def _raw(
        self, record: NeuralRecord, theta: NDArray[np.float64]
    ) -> Iterator[tuple[slice, NDArray[np.float64], NDArray[np.float64]]]:
        """Outputs, and rows of the Jacobian as the kernel writes them; both are written over by the next block."""
        sizes = self.template.sizes
        n, dynamic = sizes.states, sizes.dynamic.stop
        x = self._begin(record, theta)
        S = np.zeros((n, dynamic + n))
        S[:, dynamic:] = np.eye(n)
        raw, y = np.empty((BLOCK, sizes.outputs, self._n_raw)), np.empty((BLOCK, sizes.outputs))
        for first in range(0, len(record.target), BLOCK):
            rows = min(BLOCK, len(record.target) - first)
            kernel.sensitivities(
                record.u[first : first + rows], x, S, *self.template.arguments(theta), y[:rows], raw[:rows]
            )
            forget_what_has_died_away(S)
            yield slice(first, first + rows), y[:rows], raw[:rows]

    def _blocks(
        self, record: NeuralRecord, theta: NDArray[np.float64]
    ) -> Iterator[tuple[slice, NDArray[np.float64], NDArray[np.float64]]]:
        dynamic, output = self.template.sizes.dynamic, self.template.sizes.output
        begun = slice(dynamic.stop, dynamic.stop + self.template.sizes.states)
        to, D = self._of_begun(record, theta)
        for rows, y, raw in self._raw(record, theta):
            J = np.zeros((*raw.shape[:2], len(theta)))
            J[..., dynamic], J[..., output] = raw[..., dynamic], raw[..., begun.stop :]
            J[..., to] += raw[..., begun] @ D
            self.template.sizes.along(theta, J)
            yield rows, y, J
