"""The second half of an ARX order search: the free run of a shortlist on every case, and the best kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.linear.arx import fit_arx
from sysid.estimation.linear.order_search import OrderLosses
from sysid.estimation.results.result import FitResult
from sysid.models import Mapping, Start, beginning
from sysid.traces import Trace
from sysid.validation.metrics import Figures, figures, mean_fit
from sysid.validation.resolution import exact, parts_of, tied


@dataclass(frozen=True, kw_only=True, eq=False)
class Finalist:
    """One candidate in free run.

    Args:
        fit: The fitted model.
        cases: Figures of the free run by name of the case, and of the output where there are several.
        one_step_mse: Mean squared one-step error on the estimation traces.
        errors: Squared errors of the free run over the target's variance, by part of each case.
    """

    fit: FitResult
    cases: dict[str, Figures]
    one_step_mse: float
    errors: tuple[float, ...] = ()

    @property
    def mean_fit(self) -> float:
        """Mean NRMSE fit in percent over cases whose output varies; minus infinity where a free run is not finite."""
        return mean_fit(case.nrmse_fit for case in self.cases.values())

    @property
    def pole_radius(self) -> float:
        """Magnitude of its largest pole from sample to sample: stable below 1; NaN where there is none to tell."""
        radius = self.fit.model.pole_radius
        return float("nan") if radius is None else float(radius)

    @property
    def std_fit(self) -> float:
        """Standard deviation of the NRMSE fit over the same cases in percent; NaN where a free run is not finite."""
        fits = np.array([case.nrmse_fit for case in self.cases.values() if not np.isnan(case.nrmse_fit)])
        return float(np.std(fits)) if len(fits) and np.isfinite(fits).all() else float("nan")

    def to_dict(self) -> dict[str, Any]:
        """The figures and the structure as JSON values."""
        return {
            "structure": self.fit.model.structure.to_dict(),
            "n_parameters": self.fit.model.n_parameters,
            "one_step_mse": self.one_step_mse,
            "cases": {name: case.to_dict() for name, case in self.cases.items()},
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class Finalists:
    """A shortlist, the best mean fit first.

    Args:
        ranked: The candidates.
        unstable: How many of them ran away on some case.
    """

    ranked: tuple[Finalist, ...]
    unstable: int

    @property
    def best(self) -> Finalist:
        """The candidate with the highest mean fit over the cases."""
        return self.ranked[0]


def _ignore(_done: int, _total: int) -> None:
    """The callback of those who do not watch."""


@one_blas_thread()
def run_finalists(
    losses: OrderLosses,
    traces: Sequence[Trace],
    mapping: Mapping,
    cases: Sequence[Trace],
    *,
    count: int = 500,
    start: Start | None = None,
    rest_output: float | None = None,
    workers: int = 2,
    on_progress: Callable[[int, int], None] = _ignore,
) -> Finalists:
    """Fit a shortlist and run each model freely over every case.

    Args:
        losses: All candidates.
        traces: Estimation traces, those of the search.
        mapping: Which channels go in, which comes out.
        cases: What chooses. A score on a case counts only if nothing was chosen on it: give selection traces.
        count: Length of the shortlist.
        start: How each free run begins, as in the search.
        rest_output: Output at rest in its unit, as in the search.
        workers: Threads.
        on_progress: Told after each candidate how many are done, and of how many.

    Returns:
        The candidates, best mean fit first.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
    """
    chosen = losses.shortlist(count)
    begin = start or Start()

    def one(index: int) -> Finalist:
        fit = fit_arx(traces, mapping, losses.orders(index), start=begin, rest_output=rest_output)
        return finalist_of(fit, cases, begin, float(losses.mse[index]))

    finalists = []
    with ThreadPoolExecutor(workers) as pool:
        for finalist in pool.map(one, chosen.tolist()):
            finalists.append(finalist)
            on_progress(len(finalists), len(chosen))
    ranked = sorted(finalists, key=lambda entry: -entry.mean_fit)
    return Finalists(ranked=tuple(ranked), unstable=sum(not np.isfinite(entry.mean_fit) for entry in ranked))


def finalist_of(fit: FitResult, cases: Sequence[Trace], start: Start, one_step_mse: float) -> Finalist:
    """Run a model freely over every case.

    Args:
        fit: The fitted model.
        cases: The traces.
        start: How each free run begins, and from which sample on it is scored.
        one_step_mse: Mean squared one-step error on the estimation traces.

    Returns:
        The candidate.
    """
    model, found, errors = fit.model, dict[str, Figures](), list[float]()
    outputs, units = model.mapping.outputs, model.ends.output_units
    for case in cases:
        inputs, target = case.columns(model.mapping.inputs), model.measured(case)
        begun = beginning(model, inputs, target, start, case.usable_of(model.mapping.channels))
        scored = slice(begun.first, None)
        run: NDArray[np.float64] = model.simulate(inputs[scored], begun.history)
        counts = case.counted(model.mapping.inputs, outputs)[scored]
        both = zip(target[scored].reshape(len(run), -1).T, run.reshape(len(run), -1).T, counts.T, strict=True)
        for output, unit, (measured, simulated, counted) in zip(outputs, units, both, strict=True):
            name = case.name if len(outputs) == 1 else f"{case.name}, {output}"
            found[name] = figures(measured, simulated, unit, counted)
            spread = float(np.std(measured[counted])) if counted.any() else 0.0
            with np.errstate(over="ignore", invalid="ignore"):  # of a run that has left
                away = (measured - simulated)[counted] / spread if spread > 0.0 else np.empty(0)
            errors += parts_of(away)
    return Finalist(fit=fit, cases=found, one_step_mse=one_step_mse, errors=tuple(errors))


def smallest_first(ranked: Sequence[Finalist]) -> tuple[Finalist, ...]:
    """The smallest of those that cannot be told from the best put before the others.

    Args:
        ranked: Candidates, best mean fit first.

    Returns:
        They, the others in their order.
    """
    if not ranked:
        return ()
    alike = alike_with(ranked[0], ranked)
    first = min(alike, key=lambda one: (one.fit.model.n_parameters, ranked.index(one)))
    return (first, *(one for one in ranked if one is not first))


def alike_with(best: Finalist, others: Sequence[Finalist]) -> list[Finalist]:
    """Those that cannot be told from the best, it among them.

    Args:
        best: The candidate with the best mean fit.
        others: All candidates.

    Returns:
        They, in their order; none of them is unstable.
    """
    rounding = exact(best.errors)
    return [
        one
        for one in others
        if one is best
        or (
            (np.isfinite(one.mean_fit) and not one.pole_radius >= 1.0)
            and (tied(best.errors, one.errors) or (rounding and exact(one.errors)))
        )
    ]
