"""Writing a bundle: each file has reproduced its model before the folder appears."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sysid.atomic import replacing, replacing_folder
from sysid.errors import ConfigError
from sysid.estimation.results.result import FitResult
from sysid.export.archive import write_archive
from sysid.export.bundle import Bundle, bundle_files
from sysid.export.card import model_card
from sysid.export.case_inputs import with_case_inputs
from sysid.export.expected_runs import ParityCase, parity_cases, random_cases
from sysid.export.exporters import exporter, usual_formats
from sysid.export.manifest import (
    CARD,
    MANIFEST,
    SCHEMA,
    CascadeMetrics,
    Metrics,
    amplification,
    attachments,
    describe,
    file_entry,
    schema_text,
    seal,
    sha256,
)
from sysid.export.own_figures import own_figures, side_by_side
from sysid.export.parity import Allowed, check_parity
from sysid.export.ranges import declared_ranges, first_inputs
from sysid.export.stability import WORST, check_free_run, state_stability, state_unbounded
from sysid.export.surrogate import Surrogate
from sysid.export.verification import write_verification
from sysid.models import AbstractModel, Cascade, Start
from sysid.models.cascades.wiring import Member, Wiring
from sysid.traces import TraceSet

EXTRA = {WORST: "the random sequence on which the free run did worst"}
"""What a bundle may hold beside what is made from its model, and what each is."""


def export_bundle(
    fit: FitResult | Cascade,
    traces: TraceSet,
    folder: Path,
    *,
    start: Start | None = None,
    outputs: Sequence[str] | None = None,
    formats: Sequence[str] | None = None,
    tolerance: float | None = None,
    tolerance_float32: float | None = None,
    metrics: Metrics | CascadeMetrics | None = None,
    fits: Dict[str, FitResult] | None = None,
    provenance: Dict[str, Any] | None = None,
) -> Bundle:
    """Write a fitted model or a whole cascade as a bundle, once each file has reproduced all cases and 100 random runs.

    The model's free run is checked over 1,000 random sequences too; a bundle whose free run is unstable is written, and
    its status says so.

    Parameters that differ by case are inputs of the files, each with the range that the fitted cases have; a fit whose
    model is that of one case (``replace(fit, model=fit.model.for_case("run1"))``) has them inside.

    The folder appears, or is replaced, only when the new bundle is complete. The same fit, traces and metrics
    give the same bytes.

    Args:
        fit: The fitted model, or a cascade of models.
        traces: The cases that each file is run on; the estimation traces also declare the range of the inputs. A
            cascade's cases need its inputs alone.
        folder: Where the bundle goes. What lies there is replaced if it is a bundle, or empty.
        start: How the free run over each case begins; at rest by default. The files of a cascade are compared from
            rest; for it this says how the runs of its figures began, and runs of its bundle begin.
        outputs: Which outputs of a cascade leave it, in this order; all by default. What lies between them is
            computed, and nobody is told that it is at a limit.
        formats: Names of exporters; by default ONNX and C, as far as they can be written here. What is left out is
            said in a warning.
        tolerance: Largest difference from the model allowed, in the outputs' unit; by default 1e-9 of the largest value
            that each output has over the cases, which is the same whatever the unit.
        tolerance_float32: The same for files that compute in float32; by default 1e-5 of it, and never less than
            ``tolerance``.
        metrics: The figures on the cases, as :func:`sysid.validation.evaluate` or ``evaluate_cascade`` give them; by
            default they are computed here, without run times, as far as the cases have the outputs.
        fits: Where a cascade's models come from, by mapping.
        provenance: JSON values about where the fit comes from, kept as they are. A ``training`` among them,
            with the data sets that were ``fitted`` and that have ``chosen`` (``name`` and ``sha256`` of each) and
            ``notes``, is told on the card apart from the cases, on which the surrogate was scored.

    Returns:
        The bundle.

    Raises:
        ConfigError: If a format or an output is unknown, a parameter is not finite, or the folder holds something that
            is not a bundle.
        MissingExtraError: If a package that a format needs is not installed.
        ChannelError: If a trace lacks a channel of the mapping.
        ParityError: If a file differs from the model by more than the tolerance; nothing is published then.
    """
    formats = usual_formats(formats)
    recorded = traces
    if isinstance(fit, Cascade) and not side_by_side(fit):
        start = None  # such models begin at rest
    if metrics is None:
        metrics = own_figures(fit if isinstance(fit, Cascade) else fit.model, traces, start, outputs)
    if isinstance(fit, FitResult):
        fit, traces = with_case_inputs(fit, traces, start or Start())
    source = fit if isinstance(fit, Cascade) else fit.model
    known = dict(fits or {}) if isinstance(fit, Cascade) else {str(fit.model.mapping): fit}
    surrogate = _surrogate(source, traces, outputs)
    cases, sequences = parity_cases(surrogate, traces, start or Start()), random_cases(surrogate)
    alone = source.models[0].single if len(source.models) == 1 else None
    stability = None if alone is None else check_free_run(alone, traces)
    manifest = describe(
        surrogate, known, traces, start=start, metrics=metrics, provenance=provenance or {}, recorded=recorded
    )
    manifest["amplification"] = amplification(cases, sequences, surrogate.sample_time)
    manifest["stability"] = None
    extra = {}
    if stability is not None:
        state_stability(manifest, stability)
        extra[WORST] = stability.worst_csv().encode()
    state_unbounded(manifest, sequences)
    if manifest["fit"] is not None:
        manifest["stages"][0]["fit"] = manifest["fit"]
    content = Content(
        surrogate=surrogate,
        formats=formats,
        cases=cases,
        sequences=sequences,
        allowed=allowed_of(cases, tolerance, tolerance_float32),
        extra=extra,
    )
    return publish_bundle(Path(folder), source, manifest, content)


@dataclass(frozen=True, kw_only=True, eq=False)
class Content:
    """What a bundle is made of, beside what it says about itself.

    Args:
        surrogate: What is exported.
        formats: Names of exporters.
        cases: The cases that each file is run on.
        sequences: The random sequences that it is run on too.
        allowed: How far it may be from the model, by number type.
        extra: Files that are neither exported nor made from the model, by name.
    """

    surrogate: Surrogate
    formats: Sequence[str]
    cases: tuple[ParityCase, ...]
    sequences: tuple[ParityCase, ...]
    allowed: Dict[str, Allowed]
    extra: Dict[str, bytes]


def allowed_of(
    cases: Sequence[ParityCase], tolerance: float | None = None, tolerance_float32: float | None = None
) -> dict[str, Allowed]:
    """How far files may be from the model.

    Args:
        cases: The model's runs, whose outputs' sizes count.
        tolerance: What was given in the outputs' unit.
        tolerance_float32: The same for files that compute in float32.

    Returns:
        By number type; float32 is never held to less than float64.
    """
    allowed = {"float64": Allowed.of(cases, "float64", tolerance)}
    coarse = Allowed.of(cases, "float32", tolerance_float32)
    return allowed | {"float32": replace(coarse, each=np.maximum(coarse.each, allowed["float64"].each))}


def publish_bundle(folder: Path, source: AbstractModel | Cascade, manifest: dict[str, Any], content: Content) -> Bundle:
    """Write the files, run each against the model, and publish all of them with what is said about them.

    Args:
        folder: Where the bundle goes.
        source: The model or cascade.
        manifest: What ``model.json`` says but for its files; they are added.
        content: What is written.

    Returns:
        The bundle.

    Raises:
        ConfigError: If the folder holds something that is not a bundle.
        ParityError: If a file differs from the model by more than the tolerance; nothing is published then.
    """
    surrogate, cases, sequences, allowed = content.surrogate, content.cases, content.sequences, content.allowed
    writers = [exporter(name) for name in content.formats]
    _check_free(folder)
    with replacing_folder(folder) as draft:
        written = [file for writer in writers for file in writer.write(surrogate, draft)]
        checked = [
            check_parity(file, draft, cases, sequences, allowed=allowed[file.dtype], outputs=surrogate.outputs)
            for file in written
        ]
        purposes = {name: f"needed by {file.name}" for file in written for name in file.companions}
        drawn = next((case for case in sequences if np.isfinite(case.output).all()), sequences[0])
        purposes |= write_verification(surrogate, written, (cases[0], drawn), draft, allowed)
        for name, data in content.extra.items():
            (draft / name).write_bytes(data)
            purposes[name] = EXTRA[name]
        (draft / SCHEMA).write_text(schema_text(), encoding="utf-8", newline="\n")
        purposes[SCHEMA] = f"JSON schema of {MANIFEST}"
        manifest["files"] = [file_entry(file, parity, draft) for file, parity in zip(written, checked, strict=True)]
        manifest["attachments"] = attachments(purposes, draft)
        (draft / CARD).write_text(model_card(manifest), encoding="utf-8", newline="\n")
        manifest["card"] = {"name": CARD, "sha256": sha256(draft / CARD)}
        (draft / MANIFEST).write_text(seal(manifest), encoding="utf-8", newline="\n")
    return Bundle(folder=folder, model=source, metadata=manifest, files=bundle_files(manifest))


def zip_bundle(folder: Path, path: Path | None = None) -> Path:
    """Pack a bundle into one file; the same bundle gives the same bytes.

    Args:
        folder: The bundle.
        path: The file; by default beside the folder, under its name with ``.zip``.

    Returns:
        The file, which :func:`sysid.export.read_bundle` reads as it reads a folder.
    """
    folder = Path(folder)
    path = folder.with_name(f"{folder.name}.zip") if path is None else Path(path)
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    with replacing(path) as draft:
        write_archive(draft, {file.relative_to(folder).as_posix(): file.read_bytes() for file in files})
    return path


def _surrogate(source: AbstractModel | Cascade, traces: TraceSet, outputs: Sequence[str] | None) -> Surrogate:
    for model in source.models:
        _check_finite(model)
    inputs = Wiring.of(source.models).inputs
    return Surrogate.of(source, declared_ranges(inputs, traces), first_inputs(inputs, traces), outputs)


def _check_finite(model: Member) -> None:
    numbers = model.recursion.numbers
    lost = int(np.sum(~np.isfinite(numbers)))
    if lost:  # such a file would reproduce its model: both compute nothing but NaN
        raise ConfigError(
            "the model has parameters that are not finite",
            where=model.structure.label,
            expected="finite numbers",
            got=f"{lost} of {len(numbers)} are not",
            remedy="export a fit whose status is usable",
        )


def _check_free(folder: Path) -> None:
    if folder.exists() and not (folder.is_dir() and (not any(folder.iterdir()) or (folder / MANIFEST).is_file())):
        raise ConfigError(
            "the bundle's folder is already used for something else",
            where=str(folder),
            expected="a new or empty folder, or one with an earlier bundle",
            got="a file" if folder.is_file() else f"a folder without {MANIFEST}",
            remedy="choose another folder, or remove what lies there",
        )
