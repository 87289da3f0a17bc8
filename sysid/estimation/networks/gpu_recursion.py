r"""The free run of many candidates at once, with its normal equations, in torch: the twin for a graphics processor.

The compiled kernels run one candidate after the other and are hard to beat there: a step depends on the one before.
What a graphics processor can do is the same step for hundreds of candidates, as in a race of many starts. The equations
are those of ``kernels/recursion.py`` with one more index, the candidate's: activations and outputs step by step; the
direct part of the Jacobian for a block of samples at once; then its recursion over the lagged outputs, row by row; and
batched products for :math:`J^T W J` and :math:`J^T W e`. All of it works in double or single precision, on any device
of torch.

Limits: as many small launches per sample as the step has operations, so that with few candidates, or on a processor
without a device, the kernels are faster by far; one output; all candidates share lags and neurons.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.estimation.networks.provider import Experiment, RecursionProvider

if TYPE_CHECKING:
    import torch
    from torch import Tensor

DEVICES = ("auto", "cpu", "cuda")
PRECISIONS = ("float64", "float32")

ROWS = 256
"""Rows of the Jacobian that are alive at a time: for 256 candidates of 300 parameters some 160 MB in double."""


@dataclass(frozen=True, kw_only=True, eq=False)
class BatchedLinearisation:
    """What a Gauss-Newton method needs to know, for each candidate.

    Args:
        loss: Half the weighted sum of squared residuals in scaled numbers, shape ``(n_candidates,)``.
        gradient: Shape ``(n_candidates, n_parameters)``.
        gauss_newton: Shape ``(n_candidates, n_parameters, n_parameters)``.
    """

    loss: NDArray[np.float64]
    gradient: NDArray[np.float64]
    gauss_newton: NDArray[np.float64]


def device_named(name: str) -> str:
    """The device of torch that a choice means on this machine.

    Args:
        name: ``auto`` (the graphics processor if there is one), ``cpu`` or ``cuda``.

    Returns:
        ``cpu`` or ``cuda``.

    Raises:
        ConfigError: If the choice is unknown, or asks for a device that is not there.

    Example:
        >>> device_named("cpu")
        'cpu'
    """
    import torch

    if name not in DEVICES:
        raise ConfigError(
            "unknown device",
            where="device",
            expected=" or ".join(DEVICES),
            got=repr(name),
            remedy="write device: auto",
        )
    present = torch.cuda.is_available()
    if name == "cuda" and not present:
        raise ConfigError(
            "there is no graphics processor that torch can use",
            where="device",
            expected="a CUDA device and a build of torch for it",
            got=f"torch {torch.__version__} without one",
            remedy="write device: auto, which uses one where there is one",
        )
    return "cuda" if present and name != "cpu" else "cpu"


@dataclass(frozen=True, eq=False)
class _Parts:
    """The candidates' parameters by name, each with the candidate's index first."""

    W: Tensor
    b: Tensor
    v: Tensor
    c: Tensor
    w: Tensor | None
    V: Tensor | None

    def gains(self, x: Tensor) -> Tensor:
        """What stands before each activation, for regressors of shape ``(..., n_candidates, n_regressors)``."""
        import torch

        return self.v if self.V is None else self.v + torch.einsum("...cr,ckr->...ck", x, self.V)


@dataclass(frozen=True, eq=False)
class _Run:
    """One run of all candidates over a record, time first."""

    x: Tensor
    """Regressors, shape ``(n_samples, n_candidates, n_regressors)``."""
    h: Tensor
    """Activations, shape ``(n_samples, n_candidates, n_neurons)``."""
    free: Tensor
    """1 where the output is not clipped, shape ``(n_samples, n_candidates)``."""
    y: Tensor
    """Scaled output, shape ``(n_samples, n_candidates)``."""


class BatchedRecursion:
    """Free runs and normal equations of many candidates that share records, lags and neurons.

    Args:
        provider: The records and the template; its loop must be closed.
        device: ``auto``, ``cpu`` or ``cuda``.
        precision: ``float64`` or ``float32``; results come back in double either way.

    Raises:
        ConfigError: If the device or the precision cannot be had, or the provider's loop is open.
    """

    def __init__(self, provider: RecursionProvider, *, device: str = "auto", precision: str = "float64") -> None:
        import torch

        if not provider.closed or provider.horizon is not None or provider.stride != 1:
            raise ConfigError(
                "candidates are batched in free run over whole records alone",
                expected="a closed loop without horizon or stride",
                got=f"closed {provider.closed}, horizon {provider.horizon}, stride {provider.stride}",
            )
        if precision not in PRECISIONS:
            raise ConfigError("unknown precision", where="precision", expected=" or ".join(PRECISIONS), got=precision)
        self.template = provider.template
        self.device = device_named(device)
        self.dtype: torch.dtype = getattr(torch, precision)
        self._records = [self._record(experiment) for experiment in provider.experiments]

    def _tensor(self, values: NDArray[np.float64]) -> Tensor:
        import torch

        return torch.as_tensor(np.ascontiguousarray(values), dtype=self.dtype, device=self.device)

    def _record(self, experiment: Experiment) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Input regressors of all samples, outputs before the first, target, square roots of the weights."""
        lags, n = self.template.lags, len(experiment.output)
        u, y = self.template.extended(experiment.inputs, experiment.history)
        columns = [u[lags.depth - lag : lags.depth - lag + n, i] for i, own in enumerate(lags.inputs) for lag in own]
        regressors = np.column_stack(columns) if columns else np.empty((n, 0))
        roots = np.ones(n) if experiment.weights is None else np.sqrt(experiment.weights)
        target = self.template.scaling.scale_output(experiment.output)
        return self._tensor(regressors), self._tensor(y[: lags.depth]), self._tensor(target), self._tensor(roots)

    def simulate(self, thetas: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        """Free runs in scaled numbers.

        Args:
            thetas: Flat parameters, shape ``(n_candidates, n_parameters)``.

        Returns:
            One array of shape ``(n_candidates, n_samples)`` per record.
        """
        parts = self._parts(thetas)
        return [self._run(parts, *record[:2]).y.T.double().cpu().numpy() for record in self._records]

    def loss(self, thetas: NDArray[np.float64]) -> NDArray[np.float64]:
        """Half the weighted sum of squared residuals of each candidate; ``inf`` where it is not finite.

        Args:
            thetas: Flat parameters, shape ``(n_candidates, n_parameters)``.

        Returns:
            Shape ``(n_candidates,)``.
        """
        parts = self._parts(thetas)
        total = np.zeros(len(thetas))
        for inputs, past, target, roots in self._records:
            residual = (self._run(parts, inputs, past).y - target[:, None]) * roots[:, None]
            total += 0.5 * residual.square().sum(0).double().cpu().numpy()
        return np.where(np.isfinite(total), total, np.inf)

    def linearise(self, thetas: NDArray[np.float64]) -> BatchedLinearisation:
        """Loss, gradient and Gauss-Newton matrix of each candidate.

        Args:
            thetas: Flat parameters, shape ``(n_candidates, n_parameters)``.

        Returns:
            All three, in double precision.
        """
        import torch

        n, p = thetas.shape
        parts = self._parts(thetas)
        loss = torch.zeros(n, dtype=self.dtype, device=self.device)
        gradient = torch.zeros((n, p), dtype=self.dtype, device=self.device)
        matrix = torch.zeros((n, p, p), dtype=self.dtype, device=self.device)
        for inputs, past, target, roots in self._records:
            run = self._run(parts, inputs, past)
            residual = (run.y - target[:, None]) * roots[:, None]
            loss += 0.5 * residual.square().sum(0)
            for rows, block in self._jacobian(parts, run, p):
                weighted = block * roots[rows, None, None]
                J = weighted.permute(1, 0, 2)
                gradient += torch.einsum("tcp,tc->cp", weighted, residual[rows])
                matrix += J.transpose(1, 2) @ J
        return BatchedLinearisation(
            loss=loss.double().cpu().numpy(),
            gradient=gradient.double().cpu().numpy(),
            gauss_newton=matrix.double().cpu().numpy(),
        )

    def _parts(self, thetas: NDArray[np.float64]) -> _Parts:
        r, k = self.template.lags.n_regressors, self.template.neurons
        theta = self._tensor(thetas)
        n = len(theta)
        constant = k * (r + 2)
        return _Parts(
            W=theta[:, : k * r].reshape(n, k, r),
            b=theta[:, k * r : k * (r + 1)],
            v=theta[:, k * (r + 1) : constant],
            c=theta[:, constant],
            w=theta[:, constant + 1 : constant + 1 + r] if theta.shape[1] > constant + 1 else None,
            V=theta[:, constant + 1 + r :].reshape(n, k, r) if theta.shape[1] > constant + 1 + r else None,
        )

    def _run(self, parts: _Parts, inputs: Tensor, past: Tensor) -> _Run:
        import torch

        lags, n = self.template.lags, len(parts.c)
        n_in, depth, samples = inputs.shape[1], lags.depth, len(inputs)

        def empty(*shape: int) -> Tensor:
            return torch.empty(shape, dtype=self.dtype, device=self.device)

        y = empty(depth + samples, n)
        y[:depth] = past[:, None]
        x = empty(samples, n, lags.n_regressors)
        x[:, :, :n_in] = inputs[:, None]
        h = empty(samples, n, self.template.neurons)
        free = empty(samples, n)
        for t in range(samples):
            for i, lag in enumerate(lags.output):
                x[t, :, n_in + i] = y[depth + t - lag]
            h[t] = torch.tanh(torch.baddbmm(parts.b[:, :, None], parts.W, x[t][:, :, None])[:, :, 0])
            total = parts.c + (parts.gains(x[t]) * h[t]).sum(1)
            if parts.w is not None:
                total = total + (parts.w * x[t]).sum(1)
            y[depth + t] = torch.clamp(total, self.template.low, self.template.high)
            free[t] = y[depth + t] == total
        return _Run(x, h, free, y[depth:])

    def _jacobian(self, parts: _Parts, run: _Run, p: int) -> Iterator[tuple[slice, Tensor]]:
        """Blocks of the Jacobian, time first; each holds on to the rows that the next one's recursion needs."""
        import torch

        lags = self.template.lags
        samples, n, _ = run.x.shape
        n_in, carry = len(lags.input_lag), max(lags.output, default=0)
        before = torch.zeros((carry, n, p), dtype=self.dtype, device=self.device)
        for first in range(0, samples, ROWS):
            rows = slice(first, min(first + ROWS, samples))
            x, h, free = run.x[rows], run.h[rows], run.free[rows]
            slope = parts.gains(x) * (1.0 - h * h)
            columns = [(slope[..., None] * x[:, :, None, :]).flatten(2), slope, h, torch.ones_like(free)[..., None]]
            if parts.w is not None:
                columns.append(x)
            if parts.V is not None:
                columns.append((h[..., None] * x[:, :, None, :]).flatten(2))
            J = torch.cat([before, torch.cat(columns, dim=2) * free[..., None]])
            feedback = torch.einsum("tck,ckl->tcl", slope, parts.W[:, :, n_in:])
            if parts.w is not None:
                feedback = feedback + parts.w[:, n_in:]
            if parts.V is not None:
                feedback = feedback + torch.einsum("tck,ckl->tcl", h, parts.V[:, :, n_in:])
            feedback = feedback * free[..., None]
            # Rows before the first sample are zero, as the history does not depend on the parameters.
            for t in range(len(x)):
                for i, lag in enumerate(lags.output):
                    J[carry + t] += feedback[t, :, i, None] * J[carry + t - lag]
            before = J[len(x) :].clone() if carry else before
            yield rows, J[carry:]
