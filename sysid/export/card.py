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
    return render("model_card.md.j2", **manifest, meaning=MEANING, units=units, unit=unit)
