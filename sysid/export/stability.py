"""What a bundle says of its model's free run over random sequences, with the worst of them."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from sysid.estimation.results.result import Status
from sysid.estimation.stability.check import FreeRunCheck, StabilityOptions
from sysid.estimation.stability.free_run import Stability
from sysid.export.expected_runs import ParityCase
from sysid.export.verification import FOLDER
from sysid.models import AbstractModel
from sysid.traces import Role, TraceSet

WORST = f"{FOLDER}/worst.csv"
"""The worst sequence in a bundle."""


def check_free_run(model: AbstractModel, traces: TraceSet) -> Stability | None:
    """Run a model over excursions of its estimation traces, as its fit was checked.

    Args:
        model: The model.
        traces: The cases.

    Returns:
        What was found; ``None`` where no estimation trace is long enough to make sequences from.
    """
    estimation = traces.with_role(Role.ESTIMATION)
    return FreeRunCheck.of(StabilityOptions(), model.mapping, estimation).finding(model) if estimation else None


class UnboundedRunWarning(UserWarning):
    """A surrogate that grows without bound within the declared ranges of its inputs."""


def state_unbounded(manifest: dict[str, Any], sequences: Sequence[ParityCase]) -> None:
    """Say where the model itself grows without bound on inputs within their declared ranges, and warn of it.

    Held inputs are among the random sequences, and may not be among the excursions of the records that the check of
    the free run is made of.

    Args:
        manifest: Content of ``model.json``, with the fit; a cascade has none of its own.
        sequences: The random sequences.
    """
    lost = sum(not np.isfinite(case.output).all() for case in sequences)
    if not lost:
        return
    told = (
        f"On {lost} of {len(sequences)} random sequences within the declared ranges of the inputs (steps, ramps, held "
        "levels) the model itself grows without bound, and its files with it."
    )
    warnings.warn(
        f"{told} Fit with more records, fewer terms or lags, or in closed loop.", UnboundedRunWarning, stacklevel=3
    )
    fit = manifest["fit"]
    if fit is not None:
        fit |= {"status": Status.UNSTABLE.name, "status_text": Status.UNSTABLE.value, "notes": [told, *fit["notes"]]}


def state_stability(manifest: dict[str, Any], stability: Stability | None) -> None:
    """Put the finding into a manifest, and into the fit's status where the free run is unstable.

    Args:
        manifest: Content of ``model.json``, with the fit.
        stability: The finding, if there is one.
    """
    manifest["stability"] = None if stability is None else stability.to_dict()
    if stability is not None and not stability.stable:
        manifest["fit"] |= {"status": Status.UNSTABLE.name, "status_text": Status.UNSTABLE.value}
