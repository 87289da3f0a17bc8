"""A whole to go on from, out of a bundle or a line."""

from __future__ import annotations

import hashlib
from pathlib import Path

from sysid.errors import ConfigError
from sysid.models import Cascade, Interpolation
from sysid.models.channels.ends import Ends
from sysid.workbench.runner.store import LINE, read_json


def read_whole(bundle: Path) -> tuple[Cascade, str]:
    """The whole of a bundle, or of a line.

    Args:
        bundle: Its folder or its zip, as a run of an assembly leaves it, or ``sysid publish`` beside a report; or a
            folder with a line.

    Returns:
        The whole, and a sentence on where it comes from.

    Raises:
        BundleError: If the bundle is damaged or lacking.
        ConfigError: If it is no assembly's.
    """
    from sysid.export import read_bundle

    if (line := bundle / LINE).is_file():
        digest = hashlib.sha256(line.read_bytes()).hexdigest()[:12]
        return _whole_of(Interpolation.from_dict(read_json(line))), f"Begun from the line {bundle.name} ({digest}...)."
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


def _whole_of(line: Interpolation) -> Cascade:
    """What runs along a line, and what else stands at a position; rest and limits are declared anew."""
    if line.beside:
        raise ConfigError(
            "the mean of several wholes is none to begin from",
            expected="the line or the bundle of one whole",
            got=f"a line that is the mean of {1 + len(line.beside)}",
            remedy="name the run that left one of them",
        )
    known = set(line.along.outputs)
    return Cascade(
        models=(*line.along.models, *(m for m in line.at_place.models if not set(Ends.of(m).outputs) & known))
    )
