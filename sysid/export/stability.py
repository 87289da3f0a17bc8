"""What a bundle says of its model's free run over random sequences, with the worst of them."""

from __future__ import annotations

from typing import Any

from sysid.estimation.result import Status
from sysid.estimation.stability.check import FreeRunCheck, StabilityOptions
from sysid.estimation.stability.free_run import Stability
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


def state_stability(manifest: dict[str, Any], stability: Stability | None) -> None:
    """Put the finding into a manifest, and into the fit's status where the free run is unstable.

    Args:
        manifest: Content of ``model.json``, with the fit.
        stability: The finding, if there is one.
    """
    manifest["stability"] = None if stability is None else stability.to_dict()
    if stability is not None and not stability.stable:
        manifest["fit"] |= {"status": Status.UNSTABLE.name, "status_text": Status.UNSTABLE.value}
