"""The model card: what a person must know before using a surrogate, after Mitchell et al. (2019)."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from typing import Any

from sysid.export.flags import MEANING
from sysid.export.templating import render


def model_card(manifest: Dict[str, Any]) -> str:
    """The model card as Markdown.

    Args:
        manifest: Content of ``model.json``, with the exported files.

    Returns:
        The text; the same for the same manifest.
    """
    units = {channel["name"]: channel["unit"] for channel in manifest["outputs"]}
    unit = ", ".join(dict.fromkeys(units.values()))
    metrics = manifest["metrics"] or {}
    told = {
        "begins": _begins(manifest["cases_start"], metrics),
        "beside": [one["name"] for one in manifest["attachments"]],
    }
    timed = any(case.get("run_time_s") is not None for case in metrics.values())
    return render("model_card.md.j2", **manifest, **told, timed=timed, meaning=MEANING, units=units, unit=unit)


def _begins(start: Dict[str, Any], metrics: Dict[str, Any]) -> str:
    """How the free runs of the figures begin, as a sentence."""
    if start["kind"] == "rest":
        return "Each free run starts at rest."
    if start["kind"] == "first-sample":
        return "Each free run starts from the first measured sample."
    entries = [one for case in metrics.values() for one in case.get("outputs", {"": case}).values()]
    counts = sorted({int(one.get("begins_at", start["n_measured"])) for one in entries})
    counts = counts or [start["n_measured"]]
    many = f"{counts[0]}" if counts[0] == counts[-1] else f"{counts[0]} to {counts[-1]}"
    if start["kind"] == "measured":
        return f"Each free run goes on from the first {many} samples of its record, which are not scored."
    which = f"first {many}" if counts[-1] else "first"  # of several models older bundles do not say on how many
    return f"The initial state is estimated on the {which} samples, which are not scored."
