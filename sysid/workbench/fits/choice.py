"""Which fit of a pipeline is put first, by what, and before which others."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.estimation import FitResult
from sysid.estimation.results.result import Status
from sysid.estimation.results.tolerance import outside
from sysid.reporting.numbers import quantity
from sysid.traces import Role
from sysid.units import squared
from sysid.validation.resolution import tied
from sysid.workbench.fits.steps import Scores

Pairs = Sequence[tuple[FitResult, Scores]]
"""Of a fit, for each of its outputs the model and its figures."""
NAMED = 3
"""Of those that cannot be told from the chosen one, so many are named."""


@dataclass(frozen=True, kw_only=True)
class Choice:
    """Which fit is put first.

    Args:
        name: The fit.
        chosen_by: By which figure, on which traces, as a sentence.
        cases_chose: Whether the cases that are scored took part in the choice.
        withheld: Whether it may not be exported, being unstable.
    """

    name: str
    chosen_by: str
    cases_chose: bool = False
    withheld: bool = False


def choose(
    fits: Mapping[str, Pairs],
    asked: str,
    sizes: Sequence[float] = (1.0,),
    *,
    unstable: bool = True,
    tolerance: float | None = None,
) -> Choice:
    """Choose the fit that is exported and put first in the report.

    Args:
        fits: By name of the fit, for each of its outputs the fit and its figures.
        asked: ``best``, or the name of a fit.
        sizes: For each output the squared error that counts as one.
        unstable: Whether an unstable fit may be exported; else the best of the others is.
        tolerance: Share of each output's range: who stays within it over more of the selection traces comes first;
            ``None`` for the error alone.

    Returns:
        The choice. Cases for validation have no say in it.
    """
    if not unstable:
        stable = {
            name: pairs for name, pairs in fits.items() if all(fit.status is not Status.UNSTABLE for fit, _ in pairs)
        }
        found = choose(stable or fits, asked, sizes, tolerance=tolerance)
        if found.name in stable:
            left = ", ".join(name for name in fits if name not in stable)
            only = f" Only stable fits may be exported; {left} is not." if left and asked == "best" else ""
            return replace(found, chosen_by=found.chosen_by + only)
        return replace(
            found, withheld=True, chosen_by=f"{found.chosen_by} It is not exported: its free run is unstable."
        )
    if asked != "best":
        return Choice(name=asked, chosen_by="Named in the pipeline.")

    # An unstable fit is compared by its figures like the others, and says what it is in its status.
    usable = {name: pairs for name, pairs in fits.items() if all(fit.status.comparable for fit, _ in pairs)} or fits
    selection = not any(math.isnan(scores.selection_mse) for pairs in usable.values() for _, scores in pairs)
    mse = {name: _mean(_mse, pairs, sizes, selection=selection) for name, pairs in usable.items()}
    lost = {name: _outside(pairs, tolerance) if selection else 0 for name, pairs in usable.items()}
    best = min(mse, key=lambda name: (lost[name], mse[name]))
    what = "mean squared error" if len(sizes) == 1 else "mean over the outputs of squared error over variance,"
    # Evidence cannot be compared between open and closed loop: their residuals are not the same.
    on = "the selection traces" if selection else "the estimation traces, for want of selection traces"
    sentence = f"Least {what} of the free run on {on}"
    if mse[best] > min(mse.values()):
        sentence = f"Over more selection traces within {tolerance:.3g} of the range than those of less {what}"
    unit = squared(usable[best][0][0].model.ends.output_units[0]) if len(sizes) == 1 else "1"
    errors = {name: _mean(_errors, pairs, sizes, selection=selection) for name, pairs in usable.items()}
    told = against(best, mse, partial(quantity, unit=unit), errors)
    favours = "" if selection or not _differ(usable) else " It favours the model with the most parameters."
    return Choice(name=best, chosen_by=f"{sentence}{told}.{favours}")


def _differ(fits: Mapping[str, Pairs]) -> bool:
    """Whether some have more parameters than others."""
    return len({sum(fit.model.n_parameters for fit, _ in pairs) for pairs in fits.values()}) > 1


def _mse(scores: Scores, *, selection: bool) -> float:
    return scores.selection_mse if selection else scores.evaluation.mean_mse(Role.ESTIMATION)


def _errors(scores: Scores, *, selection: bool) -> NDArray[np.float64]:
    return np.array(scores.selection_errors if selection else scores.estimation_errors)


def _mean(figure: Callable[..., Any], pairs: Pairs, sizes: Sequence[float], *, selection: bool) -> Any:
    """The mean of a figure over the outputs, each over its size."""
    each = [figure(scores, selection=selection) / size for (_, scores), size in zip(pairs, sizes, strict=True)]
    return sum(each) / len(each)


def against(best: str, values: Mapping[str, float], shown: Callable[[float], str], errors: Mapping[str, Any]) -> str:
    """What chose, and what it was chosen before: all that it cannot be told from, else the next.

    Args:
        best: Name of what was chosen.
        values: By name the figure that chose; less is better.
        shown: The figure in words.
        errors: By name the squared errors that it is the mean of, by part of what chose; empty where it is none.

    Returns:
        The end of a sentence, from its colon on; empty where the figure is no number.
    """
    if not math.isfinite(values[best]):
        return ""
    others = sorted((name for name in values if name != best and math.isfinite(values[name])), key=values.__getitem__)
    alike = [name for name in others if tied(errors[best], errors[name])]
    if alike:
        more = f" and {len(alike) - NAMED} more" if len(alike) > NAMED else ""
        named = ", ".join(f"{name} ({shown(values[name])})" for name in alike[:NAMED])
        return f": {shown(values[best])}, tied with {named}{more}: the difference is within one standard error"
    return f": {shown(values[best])}" + "".join(f", before {shown(values[name])} of {name}" for name in others[:1])


def _outside(pairs: Pairs, tolerance: float | None) -> int:
    """Selection traces on which some output leaves the tolerance."""
    if tolerance is None:
        return 0
    return outside(np.array([scores.selection_rms_shares for _, scores in pairs]).T, tolerance)
