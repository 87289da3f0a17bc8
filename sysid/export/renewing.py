"""A stored bundle's files once more, with the code as it is: from its own model, without the run that it came from."""

from __future__ import annotations

import copy
import csv
import io
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import BundleError, ConfigError
from sysid.export.bundle import Bundle
from sysid.export.expected_runs import ParityCase, case_from_rest, parity_cases, random_cases
from sysid.export.manifest import SCHEMA_VERSION, amplification, of_another, software
from sysid.export.reading import read_attachment, read_bundle
from sysid.export.stability import WORST
from sysid.export.surrogate import Surrogate
from sysid.export.writing import Content, allowed_of, publish_bundle
from sysid.models import Cascade, Start, StartKind
from sysid.traces import TraceSet

RECORD = "verify/record1.csv"
"""The beginning of a case, from rest: what every bundle keeps of its data."""
FIRST_WHOLE = 3
"""The version from which on ``model.json`` says everything by output and by model."""


def renew_bundle(
    bundle: Path,
    folder: Path,
    *,
    formats: Sequence[str] | None = None,
    traces: TraceSet | None = None,
    whole: Cascade | None = None,
    doubt: str | None = None,
) -> Bundle:
    """Write a stored bundle's files again, or in other formats, once each has reproduced the stored model.

    Nothing is trained, and figures, ranges and provenance stay what they are. Each file is run on the record that the
    bundle keeps of its first case, from rest, and on 100 random sequences: of the other cases a bundle keeps figures,
    not samples. Whoever has them hands them over. What was allowed in the outputs' unit is allowed again.

    Args:
        bundle: The bundle's folder or zip, or the folder of the run that exported it.
        folder: Where the new one goes; what lies there is replaced if it is a bundle, or empty. It may be the same.
        formats: Names of exporters; by default those that the bundle has.
        traces: The cases that the bundle was written on, as its ``model.json`` names them by digest.
        whole: What takes the place of the bundle's whole and answers as it does: one that says where it does not know.
        doubt: A sentence of how far that can be trusted, for the model card.

    Returns:
        The new bundle. The same one, formats and software give the same bytes.

    Raises:
        BundleError: If a file is missing, changed or newer than this version can read, or the bundle is of the first
            versions.
        ConfigError: If a format is unknown, the traces are others, or the other whole answers otherwise.
        MissingExtraError: If a package that a format needs is not installed.
        ParityError: If a file differs from the model by more than is allowed; nothing is published then.
    """
    old = read_bundle(bundle)
    if old.metadata["schema_version"] < FIRST_WHOLE:
        raise BundleError(
            "the bundle is too old to be written again from itself",
            where=str(old.folder),
            expected=f"schema_version {FIRST_WHOLE} or later",
            got=old.metadata["schema_version"],
            remedy="export it from its run: sysid export PIPELINE --fit NAME",
        )
    if whole is not None:
        _check_alike(old, whole)
        old = replace(old, model=whole)
    surrogate = _surrogate(old)
    cases = _cases(old, surrogate, traces)
    sequences = random_cases(surrogate)
    manifest = _manifest(old, surrogate, cases, sequences, whole=traces is not None)
    if whole is not None:
        manifest = of_another(manifest, surrogate)
    if doubt is not None:
        manifest["provenance"]["doubt"] = doubt
    extra = {WORST: data} if (data := read_attachment(old, WORST)) is not None else {}
    sizes = cases if traces is not None else (*cases, *(one for one in sequences if np.isfinite(one.output).all()))
    content = Content(
        surrogate=surrogate,
        formats=tuple(formats or dict.fromkeys(file.format for file in old.files)),
        cases=cases,
        sequences=sequences,
        allowed=allowed_of(sizes, *(_tolerance(old, dtype) for dtype in ("float64", "float32"))),
        extra=extra,
    )
    return publish_bundle(Path(folder), old.model, manifest, content)


def _check_alike(old: Bundle, whole: Cascade) -> None:
    """Refuse a whole whose answers are not those that the figures of the bundle are of."""
    names = [str(entry["name"]) for entry in old.outputs]
    alike = isinstance(old.model, Cascade) and set(whole.inputs) == set(old.model.inputs)
    if alike and set(names) <= set(whole.outputs):
        surrogate = _surrogate(old)
        u = _recorded(old, surrogate)
        before, after = surrogate.simulate(u), _surrogate(replace(old, model=whole)).simulate(u)
        alike = np.array_equal(before, after, equal_nan=True)
    if not alike:
        raise ConfigError(
            "that whole does not answer as the bundle does",
            where=str(old.folder),
            expected=f"the whole of the bundle, which computes {', '.join(names)}, with something beside it",
            got=f"{', '.join(whole.inputs)} in, {', '.join(whole.outputs)} computed",
            remedy="export another whole with its own cases: export_bundle",
        )


def _surrogate(old: Bundle) -> Surrogate:
    ranges = {entry["name"]: tuple(entry["range"]) for entry in old.inputs if entry["range"] is not None}
    values = old.metadata["initialisation"]["values"]
    firsts = {entry["name"]: float(values[entry["name"]]) for entry in old.inputs}
    return Surrogate.of(old.model, ranges, firsts, [str(entry["name"]) for entry in old.outputs])


def _cases(old: Bundle, surrogate: Surrogate, traces: TraceSet | None) -> tuple[ParityCase, ...]:
    """The cases that were handed over, or the record that the bundle keeps."""
    if traces is None:
        return (case_from_rest(surrogate, _first_case(old), _recorded(old, surrogate)),)
    known = old.metadata["provenance"]["data"]
    if traces.digest != known["sha256"]:
        raise ConfigError(
            "the traces are not those that the bundle was written on",
            where=str(old.folder),
            expected=f"{known['name']}, SHA-256 {known['sha256']}",
            got=f"{traces.name}, SHA-256 {traces.digest}",
            remedy="hand over those, or none: the files are then run on the record that the bundle keeps",
        )
    begun = old.metadata["cases_start"]
    start = Start(kind=StartKind(begun["kind"]), n_measured=begun["n_measured"])
    return parity_cases(surrogate, traces, Start() if old.model.single is None else start)


def _tolerance(old: Bundle, dtype: str) -> float | None:
    """What files of a number type were allowed, where that was given and not a share of the outputs' size."""
    parities = [entry["parity"] for entry in old.metadata["files"] if entry["dtype"] == dtype]
    return max((float(one["tolerance"]) for one in parities if one.get("share") is None), default=None)


def _first_case(old: Bundle) -> str:
    traces = old.metadata["provenance"].get("data", {}).get("traces", [])
    return str(traces[0]["name"]) if traces else "record1"


def _recorded(old: Bundle, surrogate: Surrogate) -> NDArray[np.float64]:
    """The inputs of the record, in their units."""
    data = read_attachment(old, RECORD)
    if data is None:
        raise BundleError(
            "the bundle has no record of its first case", where=str(old.folder), expected=RECORD, got="no such file"
        )
    rows = list(csv.reader(io.StringIO(data.decode("utf-8"))))[1:]
    return np.array([row[1 : 1 + len(surrogate.inputs)] for row in rows], dtype=np.float64)


def _manifest(
    old: Bundle, surrogate: Surrogate, cases: Sequence[ParityCase], sequences: Sequence[ParityCase], *, whole: bool
) -> dict[str, Any]:
    """What it says about itself, with what the code as it is makes of the model."""
    manifest = copy.deepcopy(old.metadata)
    begun = np.array([surrogate.inputs[i].start for i in range(len(surrogate.inputs))])
    manifest |= {"schema_version": SCHEMA_VERSION, "state": surrogate.state_text()}
    manifest["initialisation"]["state"] = surrogate.at_rest(begun).tolist()
    provenance = manifest["provenance"]
    # Of a bundle that was written again itself, what it was first.
    provenance.setdefault("exported_again", {"from": manifest["digest"], "software": provenance.get("software")})
    provenance["exported_again"]["run_on"] = "every case" if whole else f"the beginning of {cases[0].name}, from rest,"
    provenance["software"] = software()
    if "rate_per_s" not in manifest["amplification"]:
        manifest["amplification"] = amplification(cases, sequences, surrogate.sample_time)
    return manifest
