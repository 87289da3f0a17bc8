"""A member or a whole of an assembly as a bundle, whether or not it is what the run chose."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from sysid.composite.fixed_members import with_fixed
from sysid.estimation import CascadeFit, FitResult
from sysid.models import Cascade, Start
from sysid.traces import TraceSet
from sysid.validation import evaluate, evaluate_cascade
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.fits.shared_config import ExportConfig

if TYPE_CHECKING:
    from sysid.export import Bundle


def export_model(
    config: AssemblyConfig,
    cases: TraceSet,
    found: FitResult | CascadeFit | Cascade,
    folder: Path,
    provenance: dict[str, Any],
) -> Bundle:
    """Write a bundle.

    Args:
        config: The pipeline.
        cases: The cases, on which each file is checked against the model.
        found: A member's fit, alone and behind measured inputs, or a whole.
        folder: Where the bundle goes.
        provenance: What it says of where it is from.

    Returns:
        The bundle.

    Raises:
        ParityError: If a file differs from the model by more than the tolerance.
    """
    from sysid.export import export_bundle
    from sysid.export.exporters import wanted_formats

    asked = config.export or ExportConfig()
    shared: dict[str, Any] = {
        "formats": wanted_formats(asked.formats).names,
        "tolerance": asked.tolerance,
        "provenance": provenance,
    }
    if isinstance(found, FitResult):
        # A member may read what is declared beside it.
        seen = TraceSet(
            name=cases.name,
            traces=tuple(with_fixed(config.composite.fixed, cases.traces)),
            roles=cases.roles,
            source=cases.source,
        )
        start = Start()
        return export_bundle(found, seen, folder, start=start, metrics=evaluate(found.model, seen, start), **shared)
    whole = found.model if isinstance(found, CascadeFit) else found
    leaving = [name for name in config.leaving if name in whole.outputs]  # a spread of a mean alone
    whole = whole.upstream_of([*config.wanted, *leaving])
    metrics = evaluate_cascade(whole, cases)
    return export_bundle(whole, cases, folder, outputs=leaving, metrics=metrics, **shared)
