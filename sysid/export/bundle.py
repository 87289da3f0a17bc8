"""Writing a bundle: a folder that holds a surrogate and everything its receiver needs to run and to judge it."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator, Sequence
from collections.abc import Mapping as Dict
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sysid.atomic import replacing
from sysid.errors import ChannelError, ConfigError
from sysid.estimation.result import FitResult
from sysid.export.archive import write_archive
from sysid.export.card import model_card
from sysid.export.case_inputs import with_case_inputs
from sysid.export.exporters import exporter, usual_formats
from sysid.export.manifest import (
    CARD,
    MANIFEST,
    SCHEMA,
    CascadeMetrics,
    Metrics,
    amplification,
    attachments,
    declared_ranges,
    describe,
    file_entry,
    first_inputs,
    schema_text,
    seal,
    sha256,
)
from sysid.export.parity import check_parity, parity_cases, random_cases
from sysid.export.stability import WORST, check_free_run, state_stability
from sysid.export.surrogate import Surrogate
from sysid.export.verification import write_verification
from sysid.ingest.arrays import inputs_of
from sysid.models import AbstractModel, Cascade, Start
from sysid.models.wiring import Member, Wiring
from sysid.traces import TraceSet


@dataclass(frozen=True, kw_only=True)
class BundleFile:
    """An exported file in a bundle.

    Args:
        name: File name.
        format: Name of the exporter, such as ``"onnx"``.
        kind: ``"step"`` or ``"sequence"``.
        dtype: Of the numbers.
        sha256: Of the bytes.
        largest_difference: From the model, over all cases and random sequences, in the output's unit.
        case: The case with the largest difference.
        tolerance: What was allowed.
    """

    name: str
    format: str
    kind: str
    dtype: str
    sha256: str
    largest_difference: float
    case: str
    tolerance: float


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Bundle:
    """A bundle on disk.

    Args:
        folder: Where it lies.
        model: The model or cascade, built from ``model.json``.
        metadata: Everything that ``model.json`` says.
        files: The exported files.
    """

    folder: Path
    model: AbstractModel | Cascade
    metadata: dict[str, Any]
    files: tuple[BundleFile, ...]

    def __repr__(self) -> str:
        files = ", ".join(file.name for file in self.files) or "no files"
        return f"<Bundle of {self.metadata.get('label', 'a model')} in {self.folder}: {files}>"

    @property
    def inputs(self) -> tuple[dict[str, Any], ...]:
        """What ``model.json`` says of each input: name, unit, reference, range."""
        return tuple(self.metadata["inputs"])

    @property
    def outputs(self) -> tuple[dict[str, Any], ...]:
        """The same of each output; before version 3 there was one."""
        return tuple(self.metadata.get("outputs") or [self.metadata["output"]])

    def simulate(self, u: Any, *, initial: float | Dict[str, float] | None = None) -> Any:
        """Free run of the model over inputs that are in memory.

        Args:
            u: Inputs: an array of shape ``(n_samples,)`` or ``(n_samples, n_inputs)`` in the bundle's order, or a frame
                or dict with columns by name, in the bundle's units; for a model without input the number of samples.
            initial: Output before the first sample, in its unit, or one for each output by name; the declared levels
                where nothing is said.

        Returns:
            For a pandas frame a frame of the outputs with the same index; else an array of shape ``(n_samples,)``, or
            ``(n_samples, n_outputs)`` where there are several.

        Raises:
            ChannelError: If an input is missing, or ``initial`` names no output.
            ConfigError: If an array has another number of columns, its samples are at another distance, or ``initial``
                says nothing to the model.
        """
        names = tuple(str(entry["name"]) for entry in self.outputs)
        surrogate = Surrogate.of(self.model, {}, outputs=names)
        if surrogate.ticks:
            inputs = np.zeros((len(inputs_of(u, ())), 1))
        else:
            inputs = inputs_of(
                u, tuple(str(entry["name"]) for entry in self.inputs), sample_time=self.model.sample_time
            )
        given = dict(initial) if isinstance(initial, Dict) else {} if initial is None else dict.fromkeys(names, initial)
        strangers = [name for name in given if name not in names]
        if strangers:
            raise ChannelError(strangers, names, where="initial")
        found = surrogate.chosen(surrogate.run_from(inputs, {name: float(level) for name, level in given.items()}))
        if hasattr(u, "columns") and hasattr(u, "index"):
            return type(u)(found, index=u.index, columns=list(names))
        return found[:, 0] if len(names) == 1 else found


def export_bundle(
    fit: FitResult | Cascade,
    traces: TraceSet,
    folder: Path,
    *,
    start: Start | None = None,
    outputs: Sequence[str] | None = None,
    formats: Sequence[str] | None = None,
    tolerance: float = 1e-9,
    tolerance_float32: float = 1e-3,
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
        start: How the free run over each case begins; at rest by default, and always for a cascade.
        outputs: Which outputs of a cascade leave it, in this order; all by default. What lies between them is
            computed, and nobody is told that it is at a limit.
        formats: Names of exporters; by default ONNX and C, as far as they can be written here. What is left out is
            said in a warning.
        tolerance: Largest difference from the model allowed, in the outputs' unit.
        tolerance_float32: The same for files that compute in float32.
        metrics: The figures on the cases, as :func:`sysid.validation.evaluate` or ``evaluate_cascade`` give them.
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
    writers = [exporter(name) for name in usual_formats(formats)]
    recorded = traces
    if isinstance(fit, FitResult):
        fit, traces = with_case_inputs(fit, traces, start or Start())
    source = fit if isinstance(fit, Cascade) else fit.model
    known = dict(fits or {}) if isinstance(fit, Cascade) else {str(fit.model.mapping): fit}
    start = Start() if start is None or source.single is None else start
    surrogate = _surrogate(source, traces, outputs)
    cases, sequences = parity_cases(surrogate, traces, start), random_cases(surrogate)
    stability = None if source.single is None else check_free_run(source.single, traces)
    unit = ", ".join(dict.fromkeys(port.unit for port in surrogate.outputs))
    allowed = {"float64": tolerance, "float32": max(tolerance, tolerance_float32)}
    with _published(Path(folder)) as draft:
        written = [file for writer in writers for file in writer.write(surrogate, draft)]
        checked = [
            check_parity(file, draft, cases, sequences, tolerance=allowed[file.dtype], unit=unit) for file in written
        ]
        purposes = {name: f"needed by {file.name}" for file in written for name in file.companions}
        purposes |= write_verification(surrogate, written, (cases[0], sequences[0]), draft, allowed)
        if stability is not None:
            (draft / WORST).write_text(stability.worst_csv(), encoding="utf-8", newline="\n")
            purposes[WORST] = "the random sequence on which the free run did worst"
        (draft / SCHEMA).write_text(schema_text(), encoding="utf-8", newline="\n")
        purposes[SCHEMA] = f"JSON schema of {MANIFEST}"
        manifest = describe(
            surrogate, known, traces, start=start, metrics=metrics, provenance=provenance or {}, recorded=recorded
        )
        manifest["amplification"] = amplification(cases, sequences, surrogate.sample_time)
        manifest["stability"] = None
        if stability is not None:
            state_stability(manifest, stability)
            manifest["stages"][0]["fit"] = manifest["fit"]
        manifest["files"] = [file_entry(file, parity, draft) for file, parity in zip(written, checked, strict=True)]
        manifest["attachments"] = attachments(purposes, draft)
        (draft / CARD).write_text(model_card(manifest), encoding="utf-8", newline="\n")
        manifest["card"] = {"name": CARD, "sha256": sha256(draft / CARD)}
        (draft / MANIFEST).write_text(seal(manifest), encoding="utf-8", newline="\n")
    return Bundle(folder=Path(folder), model=source, metadata=manifest, files=bundle_files(manifest))


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


def bundle_files(manifest: Dict[str, Any]) -> tuple[BundleFile, ...]:
    """The exported files that a manifest lists.

    Args:
        manifest: Content of ``model.json``.

    Returns:
        One entry per file.
    """
    return tuple(
        BundleFile(
            name=entry["name"],
            format=entry["format"],
            kind=entry["kind"],
            dtype=entry["dtype"],
            sha256=entry["sha256"],
            largest_difference=max(
                entry["parity"]["largest_difference"], entry["parity"].get("random_difference", 0.0)
            ),
            case=entry["parity"]["case"],
            tolerance=entry["parity"]["tolerance"],
        )
        for entry in manifest["files"]
    )


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


@contextmanager
def _published(folder: Path) -> Iterator[Path]:
    """A draft folder beside ``folder`` that takes its place when the block ends without an error."""
    if folder.exists() and not (folder.is_dir() and (not any(folder.iterdir()) or (folder / MANIFEST).is_file())):
        raise ConfigError(
            "the bundle's folder is already used for something else",
            where=str(folder),
            expected="a new or empty folder, or one with an earlier bundle",
            got="a file" if folder.is_file() else f"a folder without {MANIFEST}",
            remedy="choose another folder, or remove what lies there",
        )
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{folder.name}.", dir=folder.parent) as workplace:
        draft, old = Path(workplace) / "new", Path(workplace) / "old"
        draft.mkdir()
        yield draft
        if folder.exists():
            folder.rename(old)
        try:
            draft.rename(folder)
        except OSError:
            if old.exists():
                old.rename(folder)
            raise
        shutil.rmtree(old, ignore_errors=True)
