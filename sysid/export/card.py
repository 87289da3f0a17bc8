"""The model card: what a person must know before using a surrogate, after Mitchell et al. (2019)."""

from __future__ import annotations

from collections.abc import Iterator
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


def in_short(manifest: Dict[str, Any]) -> str:
    """What the card says in some sentences: structure, data, accuracy, and how the model was made.

    Args:
        manifest: Content of ``model.json``.

    Returns:
        Plain text.
    """
    model = f"{manifest['mapping']}: {manifest['label']}, {manifest['n_parameters']} parameters, one sample every "
    return " ".join([f"{model}{manifest['sample_time_s']:.12g} s.", _made(manifest), *_accuracy(manifest)])


def _made(manifest: Dict[str, Any]) -> str:
    """How a model was fitted, on what data, and by which command."""
    provenance = manifest["provenance"]
    loops = {(stage.get("fit") or {}).get("loop") for stage in manifest["stages"]}
    made = "Fitted to its own free run" if loops == {"closed"} else "Fitted"
    data = [one["name"] for one in provenance.get("training", {}).get("fitted", [])] or [
        name for name in [(provenance.get("data") or {}).get("name")] if name
    ]
    if data:
        made += f" on data set{'s' if len(data) > 1 else ''} {', '.join(data)}"
    return f"{made} by {provenance['command']}." if provenance.get("command") else f"{made}."


def _accuracy(manifest: Dict[str, Any]) -> Iterator[str]:
    """The free run's fit over the cases that were not fitted, from the worst on."""
    cases = manifest["metrics"] or {}
    scored = {name: case for name, case in cases.items() if case.get("role") != "estimation"}
    fits = [
        (one["free_run"]["nrmse_fit"], f"{output} of {name}" if output else name)
        for name, case in (scored or cases).items()
        for output, one in case.get("outputs", {"": case}).items()
        if one["free_run"]["nrmse_fit"] is not None
    ]
    if not fits:
        return
    (least, where), (most, _) = min(fits), max(fits)
    which = "cases that it was not fitted to" if scored else "the cases that it was fitted to"
    if len(fits) == 1:
        yield f"Fit in free run over {which}: {least:.4g} % ({where})."
    else:
        yield f"Fit in free run over {which}: {least:.4g} ({where}) to {most:.4g} %."


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
