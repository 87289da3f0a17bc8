"""What the steps of fits are called, and what is told of each when it is done."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sysid.estimation import FitResult
from sysid.units import in_unit, squared
from sysid.workbench.fits import steps
from sysid.workbench.fits.config import FitConfig
from sysid.workbench.fits.data import Data
from sysid.workbench.fits.record import is_final
from sysid.workbench.runner.naming import cases_of


def fit_title(fit: FitConfig) -> str:
    """The step of a fit, for people.

    Args:
        fit: The fit.

    Returns:
        For example ``"Fitting open loop, NARX 1/1/2"``.
    """
    return f"Fitting {fit.name}" if fit.name == fit.structure.label else f"Fitting {fit.name}, {fit.structure.label}"


def cases_told(data: Data) -> str:
    """How many traces there are, and which share samples with what is fitted."""
    cases = cases_of(data.traces) + (f", {len(data.selection)} to choose by" if data.selection else "")
    return "; ".join(
        [cases, *(f"{name} has samples of {other}, which is fitted" for name, other in data.traces.shared)]
    )


def how_ended(fit: FitResult) -> str:
    """How long a fit took; how it ended, where it is not what it should be."""
    said = "" if fit.status.usable and is_final(fit) else f", {fit.status.value}"
    return f"{fit.train_time_s:.1f} s{said}"


def worst_told(scores: steps.Scores) -> str:
    """How a fit came out, in a line."""
    worst = max(scores.evaluation.cases.values(), key=lambda case: case.free_run.mse)
    return f"free run at worst {in_unit(f'{worst.free_run.mse:.3g}', squared(worst.free_run.unit))} ({worst.case})"


def looked_told(found: Sequence[Mapping[str, Any]]) -> str:
    """How many findings ask to be looked at, and where they stand.

    Example:
        >>> looked_told([{"findings": [{"verdict": "LOOK"}, {"verdict": "FINE"}]}])
        '1 of 2 findings ask to be looked at, in the report under: What is in this record?'
    """
    verdicts = [one["verdict"] for advice in found for one in advice["findings"]]
    looks = verdicts.count("LOOK")
    where = ", in the report under: What is in this record?" if looks else ""
    return f"{looks} of {len(verdicts)} findings ask to be looked at{where}"
