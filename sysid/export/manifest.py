"""``model.json``: what a bundle says about itself. Plain JSON, versioned, sealed by a digest."""

from __future__ import annotations

import hashlib
import json
import math
import platform
from collections.abc import Mapping as Dict
from collections.abc import Sequence
from importlib import metadata, resources
from pathlib import Path
from typing import Any, Protocol

import sysid
from sysid.estimation.result import FitResult
from sysid.export.exporter import ExportedFile
from sysid.export.layout import LinearState, layout_of
from sysid.export.parity import Parity, ParityCase
from sysid.export.surrogate import Range, Surrogate
from sysid.models import AbstractModel, History, Start
from sysid.traces import Role, Trace, TraceSet

SCHEMA_VERSION = 2
"""Raised when a reader of an earlier version would misread the file. Every version from 1 on can be read: 2 added what
lies beside the exported files (``attachments``), and parity over random sequences."""
SCHEMA = "model.schema.json"
"""The JSON schema of ``model.json``, which travels in every bundle."""
MANIFEST = "model.json"
CARD = "MODEL_CARD.md"
PACKAGES = ("numpy", "numba", "onnx", "onnxruntime", "torch")
"""Packages that compute, write or check what is in a bundle."""


class CaseMetrics(Protocol):
    """The figures of a model on one case."""

    def to_dict(self) -> dict[str, Any]:
        """The figures as JSON values: ``role``, ``free_run``, ``one_step``, ``run_time_s`` and more."""


class Metrics(Protocol):
    """The figures of a model on all cases, such as :class:`sysid.validation.Evaluation`."""

    @property
    def cases(self) -> Dict[str, CaseMetrics]:
        """Figures by name of the case."""


def describe(
    fit: FitResult, traces: TraceSet, start: Start, metrics: Metrics | None, provenance: Dict[str, Any]
) -> dict[str, Any]:
    """Everything that ``model.json`` says before the files are known.

    Args:
        fit: The fitted model.
        traces: The cases, and the estimation traces that declare the range of the inputs.
        start: How the free runs began.
        metrics: The figures, if there are any.
        provenance: Where the fit comes from.

    Returns:
        JSON values; a number that is not finite is ``None``.
    """
    model, recursion = fit.model, fit.model.recursion
    scaling = recursion.scaling
    estimation = traces.with_role(Role.ESTIMATION)
    stored = model.to_dict()
    manifest = {
        "schema_version": SCHEMA_VERSION,
        "label": model.structure.label,
        "structure": stored["structure"],
        "mapping": str(model.mapping),
        "sample_time_s": model.sample_time,
        "inputs": [
            _channel(name, unit, traces, estimation)
            for name, unit in zip(model.mapping.inputs, model.input_units, strict=True)
        ],
        "output": _channel(model.mapping.output, model.output_unit, traces, estimation),
        "scaling": {
            "input_offset": list(scaling.input_offset),
            "input_scale": list(scaling.input_scale),
            "output_offset": scaling.output_offset,
            "output_scale": scaling.output_scale,
        },
        "output_bounds": [
            bound * scaling.output_scale + scaling.output_offset for bound in (recursion.low, recursion.high)
        ],
        "model": stored,
        "n_parameters": model.n_parameters,
        "state": Surrogate.of(model).state_text(),
        "initialisation": _initialisation(fit, _example(traces)),
        "fit": {
            "status": fit.status.name,
            "status_text": fit.status.value,
            "loop": fit.loop.value,
            "seed": fit.seed,
            "train_time_s": fit.train_time_s,
            "notes": list(fit.notes),
        },
        "cases_start": {"kind": start.kind.value, "n_measured": start.n_measured},
        "metrics": None if metrics is None else {name: case.to_dict() for name, case in metrics.cases.items()},
        "provenance": {**provenance, "data": _data(traces), "software": _software()},
    }
    return {name: _json(value) for name, value in manifest.items()}


def file_entry(file: ExportedFile, parity: Parity, folder: Path) -> dict[str, Any]:
    """What ``model.json`` says about an exported file.

    Args:
        file: The file.
        parity: How far it is from the model.
        folder: Where it lies.

    Returns:
        JSON values.
    """
    return {
        "name": file.name,
        "format": file.format,
        "kind": file.kind.value,
        "dtype": file.dtype,
        "details": dict(file.details),
        "companions": list(file.companions),
        "sha256": sha256(folder / file.name),
        "parity": parity.to_dict(),
    }


def attachments(purposes: Dict[str, str], folder: Path) -> list[dict[str, str]]:
    """What ``model.json`` says about the files that are not exports: headers, records, programs, the schema.

    Args:
        purposes: What each is, by its path in the bundle.
        folder: The bundle's.

    Returns:
        JSON values.
    """
    return [
        {"name": name, "purpose": purpose, "sha256": sha256(folder / name)}
        for name, purpose in sorted(purposes.items())
    ]


def schema_text() -> str:
    """The JSON schema of ``model.json`` as it is published."""
    folder = resources.files("sysid.export") / "schemas"
    return (folder / f"model-{SCHEMA_VERSION}.schema.json").read_text(encoding="utf-8")


def seal(manifest: dict[str, Any]) -> str:
    """Add the digest over everything else, and write the manifest as text.

    Args:
        manifest: Content of ``model.json``; ``digest`` is set.

    Returns:
        The text of the file.
    """
    manifest["digest"] = manifest_digest(manifest)
    return json.dumps(manifest, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def manifest_digest(manifest: Dict[str, Any]) -> str:
    """SHA-256 over a manifest's values without its own digest; indentation and order of names do not matter.

    Args:
        manifest: Content of ``model.json``.

    Returns:
        64 hexadecimal digits.
    """
    content = {name: value for name, value in manifest.items() if name != "digest"}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def sha256(path: Path) -> str:
    """SHA-256 of a file.

    Args:
        path: The file.

    Returns:
        64 hexadecimal digits.
    """
    return hashlib.sha256(path.read_bytes()).hexdigest()


def declared_ranges(model: AbstractModel, traces: TraceSet) -> dict[str, Range]:
    """The range that each input has in the estimation traces, which is what a bundle is declared for.

    Args:
        model: The model.
        traces: The cases.

    Returns:
        By channel; empty without estimation traces.
    """
    estimation = traces.with_role(Role.ESTIMATION)
    return {name: found for name in model.mapping.inputs if (found := _range(name, estimation))}


def first_inputs(model: AbstractModel, traces: TraceSet) -> dict[str, float]:
    """What each input is at the beginning of the first estimation trace, or of the first trace without one.

    Args:
        model: The model.
        traces: The cases.

    Returns:
        By channel.
    """
    example = _example(traces)
    return {name: float(example[name][0]) for name in model.mapping.inputs}


def _example(traces: TraceSet) -> Trace:
    estimation = traces.with_role(Role.ESTIMATION)
    return estimation[0] if estimation else traces.traces[0]


def amplification(cases: Sequence[ParityCase], sequences: Sequence[ParityCase]) -> dict[str, Any]:
    """How much the model's free run makes of a small change of its output before the first sample.

    Args:
        cases: The cases.
        sequences: The random sequences.

    Returns:
        JSON values.
    """
    worst = max((*cases, *sequences), key=lambda case: case.amplification)
    return {
        "largest": worst.amplification if math.isfinite(worst.amplification) else None,
        "case": worst.name,
        "meaning": "largest change of an output over the change of the output before the first sample that caused it; "
        "a difference in the last digit of a number grows by as much",
    }


def _range(name: str, estimation: tuple[Trace, ...]) -> Range | None:
    if not estimation:
        return None
    return min(float(t[name].min()) for t in estimation), max(float(t[name].max()) for t in estimation)


def _channel(name: str, unit: str, traces: TraceSet, estimation: tuple[Trace, ...]) -> dict[str, Any]:
    channel = traces.traces[0].channel(name)
    found = _range(name, estimation)
    return {
        "name": name,
        "unit": unit,
        "reference": channel.reference.value,
        "description": channel.description,
        "range": None if found is None else list(found),
    }


def _initialisation(fit: FitResult, example: Trace) -> dict[str, Any]:
    model = fit.model
    inputs = example.columns(model.mapping.inputs)[0]
    layout = layout_of(model)
    state = layout.from_history(History.at_rest(inputs=inputs, output=model.rest_output))
    lines = "a system at rest: every number of a channel's delay line is (its value at rest - offset) / scale"
    return {
        "rule": "a system at rest: the equilibrium at its inputs" if isinstance(layout, LinearState) else lines,
        "values": {
            **dict(zip(model.mapping.inputs, inputs.tolist(), strict=True)),
            model.mapping.output: model.rest_output,
        },
        "values_from": f"the inputs' first sample in {example.name}; the output's declared rest value",
        "state": state.tolist(),
    }


def _data(traces: TraceSet) -> dict[str, Any]:
    return {
        "name": traces.name,
        "source": traces.source,
        "sha256": traces.digest,
        "traces": [
            {
                "name": trace.name,
                "role": traces.roles[trace.name].value,
                "sha256": trace.digest,
                "n_samples": len(trace),
                "duration_s": trace.duration,
                "history": list(trace.provenance),
            }
            for trace in traces
        ],
    }


def _software() -> dict[str, str]:
    packages = {name: metadata.version(name) for name in PACKAGES}
    return {"sysid-workbench": sysid.__version__, "python": platform.python_version(), **packages}


def _json(value: Any) -> Any:
    """The same values with ``None`` for every number that is not finite, which JSON cannot write."""
    if isinstance(value, Dict):
        return {str(name): _json(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_json(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
