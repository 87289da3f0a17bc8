"""A whole to go on from, out of a bundle."""

from __future__ import annotations

from pathlib import Path

from sysid.errors import ConfigError
from sysid.models import Cascade


def read_whole(bundle: Path) -> tuple[Cascade, str]:
    """The whole of a bundle.

    Args:
        bundle: Its folder or its zip, as a run of an assembly leaves it, or ``sysid publish`` beside a report.

    Returns:
        The whole, and a sentence on where it comes from.

    Raises:
        BundleError: If the bundle is damaged or lacking.
        ConfigError: If it is no assembly's.
    """
    from sysid.export import read_bundle

    read = read_bundle(bundle)
    if not isinstance(read.model, Cascade):
        raise ConfigError(
            "there is no whole to begin from",
            where=bundle,
            expected="the bundle of an assembly",
            got=f"one model, {read.model.mapping}",
            remedy="name the bundle of a run of kind assembly",
        )
    command = (read.metadata.get("provenance") or {}).get("command", "an unknown command")
    digest = str(read.metadata["digest"])[:12]
    return read.model, f"Begun from the networks of {bundle.name} ({command}; digest {digest}...)."
