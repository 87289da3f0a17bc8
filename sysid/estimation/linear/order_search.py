"""ARX order search: the one-step loss of every candidate, exactly, from one factorisation."""

from __future__ import annotations

import enum
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.atomic import replacing
from sysid.errors import TraceError
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.linear.arx import first_output
from sysid.estimation.linear.order_grid import OrderGrid
from sysid.estimation.linear.regression import blocks_of
from sysid.estimation.nonparametric.evidence import triangle
from sysid.estimation.records.experiment import Experiment, experiments_of
from sysid.kernels import linear_orders as kernel
from sysid.models import ARX, Mapping, Start
from sysid.traces import Trace


class Criterion(enum.Enum):
    """What the loss is weighed against the number of parameters with; the value is its name in tables."""

    LOSS = "loss"
    """The mean squared one-step error alone; never chooses a smaller model."""
    AIC = "AIC"
    """Akaike 1974: ``N ln V + 2 p``."""
    AICC = "AICc"
    """Hurvich and Tsai 1989: AIC with ``2 p (p + 1) / (N - p - 1)`` added, for short records."""
    BIC = "BIC"
    """Schwarz 1978, Rissanen's MDL: ``N ln V + p ln N``."""


ROUNDING = 1e-12
"""Root mean square error over that of the output below which an error is rounding, and no measure of a structure: it
had decided which orders a record without noise was given."""


def _rounding_of(experiments: Sequence[Experiment]) -> float:
    """The mean squared error below which errors of an output are rounding, over the samples that count."""
    seen = [one.output if one.weights is None else one.output[one.weights > 0.0] for one in experiments]
    return float(ROUNDING**2 * np.mean(np.concatenate(seen) ** 2))


def weighed(mse: NDArray[np.float64], p: NDArray[np.int64], n: int, criterion: Criterion) -> NDArray[np.float64]:
    """A criterion from errors and sizes; smaller is better.

    Args:
        mse: Mean squared one-step errors, shape ``(n_candidates,)``.
        p: Numbers of parameters, likewise.
        n: Samples that count.
        criterion: Which.

    Returns:
        Shape ``(n_candidates,)``.
    """
    if criterion is Criterion.LOSS:
        return mse
    fit = n * np.log(np.maximum(mse, np.finfo(np.float64).tiny))
    if criterion is Criterion.BIC:
        return np.asarray(fit + p * np.log(n))
    correction = 2.0 * p * (p + 1) / np.maximum(n - p - 1, 1) if criterion is Criterion.AICC else 0.0
    return np.asarray(fit + 2.0 * p + correction)


@dataclass(frozen=True, kw_only=True, eq=False)
class OrderLosses:
    """The one-step loss of every candidate.

    Args:
        na: Shape ``(n_candidates,)``.
        nb: Shape ``(n_candidates, n_inputs)``.
        nk: Shape ``(n_candidates, n_inputs)``.
        mse: Mean squared one-step error on the estimation traces, in the output's unit squared, shape
            ``(n_candidates,)``.
        n_samples: Samples that count.
        intercept: Whether a constant is fitted.
        rounding: Mean squared error below which all are alike: of structures that are exact the smallest is the best,
            not the one that rounding favours.
    """

    na: NDArray[np.int16]
    nb: NDArray[np.int16]
    nk: NDArray[np.int16]
    mse: NDArray[np.float64]
    n_samples: int
    intercept: bool
    rounding: float = 0.0

    def __len__(self) -> int:
        return len(self.mse)

    @property
    def n_parameters(self) -> NDArray[np.int64]:
        """Number of fitted parameters of each candidate, shape ``(n_candidates,)``."""
        return np.asarray(self.na + self.nb.sum(axis=1) + self.intercept, dtype=np.int64)

    def orders(self, index: int) -> ARX:
        """The structure of one candidate.

        Args:
            index: Which.

        Returns:
            The structure.
        """
        nb, nk = tuple(self.nb[index].tolist()), tuple(self.nk[index].tolist())
        return ARX(na=int(self.na[index]), nb=nb, nk=nk, intercept=self.intercept)

    def score(self, criterion: Criterion) -> NDArray[np.float64]:
        """A criterion for every candidate; smaller is better.

        Args:
            criterion: Which.

        Returns:
            Shape ``(n_candidates,)``.
        """
        return weighed(np.maximum(self.mse, self.rounding), self.n_parameters, self.n_samples, criterion)

    def best(self, criterion: Criterion = Criterion.BIC) -> ARX:
        """The candidate with the least criterion.

        Args:
            criterion: Which.

        Returns:
            Its structure.
        """
        return self.orders(int(np.argmin(self.score(criterion))))

    def shortlist(self, count: int) -> NDArray[np.int64]:
        """Candidates worth a free run: the best few of every number of parameters.

        The least one-step losses of all belong to the largest models, and they differ by next to nothing; the free
        run is often better with few parameters. So each number of parameters sends its best, in turn.

        Args:
            count: How many.

        Returns:
            Indices of at most ``count`` candidates, by number of parameters.
        """
        p = self.n_parameters
        by_size = np.lexsort((self.mse, p))
        firsts = np.searchsorted(p[by_size], p[by_size], side="left")
        place = np.arange(len(by_size)) - firsts
        chosen = by_size[np.argsort(place, kind="stable")[:count]]
        return np.asarray(chosen[np.lexsort((self.mse[chosen], p[chosen]))], dtype=np.int64)

    def write(self, path: Path) -> None:
        """Store all candidates as a compressed ``.npz`` file.

        Args:
            path: Where to.
        """
        columns = {"na": self.na, "nb": self.nb, "nk": self.nk, "mse": self.mse}
        with replacing(Path(path)) as draft, draft.open("wb") as file:
            numbers = {"n_samples": self.n_samples, "intercept": self.intercept, "rounding": self.rounding}
            np.savez_compressed(file, **numbers, **columns)  # type: ignore[arg-type]  # numpy's stub takes its keyword for ours

    @classmethod
    def read(cls, path: Path) -> OrderLosses:
        """Read what :meth:`write` wrote.

        Args:
            path: The file.

        Returns:
            The losses.
        """
        with np.load(path, allow_pickle=False) as file:
            columns = {name: file[name] for name in ("na", "nb", "nk", "mse")}
            rounding = float(file["rounding"]) if "rounding" in file else 0.0
            return cls(
                **columns, n_samples=int(file["n_samples"]), intercept=bool(file["intercept"]), rounding=rounding
            )


def _ignore(_done: int, _total: int) -> None:
    """The callback of those who do not watch."""


@one_blas_thread()
def search_orders(
    traces: Sequence[Trace],
    mapping: Mapping,
    grid: OrderGrid,
    *,
    start: Start | None = None,
    rest_output: float | None = None,
    workers: int = 2,
    on_progress: Callable[[int, int], None] = _ignore,
) -> OrderLosses:
    """The one-step least-squares loss of every candidate of a grid.

    Each loss is that of :func:`sysid.estimation.fit_arx` on the same traces, computed from one QR factorisation; where
    samples are masked, over the rows on which the largest candidate looks at none of them.

    Args:
        traces: Estimation traces.
        mapping: Which channels go in, which comes out.
        grid: The candidates.
        start: What stands before each trace; at rest by default.
        rest_output: Output at rest in its unit; the mean of the traces' first samples by default.
        workers: Threads.
        on_progress: Told after each combination of dead times how many candidates are done, and of how many.

    Returns:
        All losses.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        TraceError: If there are fewer samples than parameters of the largest candidate.
    """
    m = len(mapping.inputs)
    rest = first_output(traces, mapping) if rest_output is None else rest_output
    given = experiments_of(traces, mapping, start or Start(), rest)
    lags = grid.lags(m)
    # The rows are the same for every candidate: those on which the largest looks at no masked sample.
    experiments = [experiment.one_step(lags) for experiment in given]
    rows = sum(experiment.n_counted for experiment in experiments)
    # The column of the intercept stands first: it is in every candidate.
    laid = (np.column_stack(block) for block in blocks_of(experiments, lags))
    if 0 < rows <= lags.n_regressors + grid.intercept:
        raise TraceError(
            "fewer samples than the largest candidate has parameters",
            expected=f"more than {lags.n_regressors + grid.intercept}",
            got=rows,
            remedy="lower the orders, or use longer traces",
        )
    reduced = triangle(laid, free=0)
    table = np.column_stack([reduced.R, reduced.z])
    tolerance = rows * np.finfo(np.float64).eps * np.linalg.norm(table, axis=0)
    factor = np.ascontiguousarray(table.T)
    rank = 0
    target, everything = table.shape[1] - 1, np.arange(table.shape[1])
    if grid.intercept:
        rank = kernel.reflect(factor, 0, everything[1:], target - 1, target, 0, tolerance[0])
    # Where the columns of each input begin, and those of the output.
    starts = 1 + np.cumsum([0, *map(len, lags.inputs)])
    outputs = everything[starts[-1] : target]
    dead_times = grid.dead_times(m)
    per_block = grid.size(m) // len(dead_times)
    n_leaves = len(grid.counts(m))
    # A time series is to the kernel a system of one input that has no columns.
    ends = (grid.least(m), grid.most(m)) if m else ([0], [0])
    least, most = (np.array(one, dtype=np.int64) for one in ends)

    def block(dead: tuple[int, ...]) -> NDArray[np.float64]:
        columns = np.zeros((len(most), int(most.max())), dtype=np.int64)
        for i, nk in enumerate(dead):
            columns[i, : most[i]] = starts[i] + nk - lags.inputs[i][0] + np.arange(most[i]) if most[i] else 0
        losses = np.empty((n_leaves, grid.max_na + 1))
        kernel.nested_losses(factor, rank, columns, least, most, outputs, target, tolerance, losses)
        return losses[:, grid.min_na :]

    blocks = []
    with ThreadPoolExecutor(workers) as pool:
        for losses in pool.map(block, dead_times):
            blocks.append(losses)
            on_progress(len(blocks) * per_block, grid.size(m))
    found = _collected(np.array(blocks) / rows, grid, dead_times, rows)
    return replace(found, rounding=_rounding_of(experiments))


def _collected(
    mse: NDArray[np.float64], grid: OrderGrid, dead_times: list[tuple[int, ...]], n_samples: int
) -> OrderLosses:
    """Candidates side by side: dead times, then numbers of past inputs, then of past outputs, the last fastest."""
    nb = np.array(grid.counts(len(dead_times[0])), dtype=np.int16)
    na = np.arange(grid.min_na, grid.max_na + 1, dtype=np.int16)
    n_k, n_b, n_a = len(dead_times), len(nb), len(na)
    return OrderLosses(
        na=np.tile(na, n_k * n_b),
        nb=np.tile(np.repeat(nb, n_a, axis=0), (n_k, 1)),
        nk=np.repeat(np.array(dead_times, dtype=np.int16), n_b * n_a, axis=0),
        mse=mse.reshape(-1),
        n_samples=n_samples,
        intercept=grid.intercept,
    )
