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
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

import sysid
from sysid.estimation.results.result import FitResult
from sysid.export.expected_runs import ParityCase
from sysid.export.exporter import ExportedFile
from sysid.export.forms.layout import HiddenState
from sysid.export.forms.stage import Port, Stage
from sysid.export.heeded import heeded
from sysid.export.ranges import example_of, range_of
from sysid.export.surrogate import Surrogate
from sysid.extras import has
from sysid.models import EquationModel, Start
from sysid.traces import Role, Trace, TraceSet
from sysid.units import Reference

if TYPE_CHECKING:
    from sysid.export.parity import Parity

SCHEMA_VERSION = 5
"""Raised when a reader of an earlier version cannot read the file, or would misread it. Every version from 1 on can be
read: 2 added what lies beside the exported files (``attachments``), and parity over random sequences; 3 has several
outputs and models in place of one (``outputs``, ``stages``), and float32 files whose state is longer by the remainders;
4 has networks with gates, models that read each other in a circle, and neural state spaces, whose state at rest has a
constant and a bound; 5 has assemblies that put out some of what they compute, and equations, whose states are in
units."""
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


class CascadeMetrics(Protocol):
    """The figures of a cascade, such as :class:`sysid.validation.CascadeEvaluation`."""

    @property
    def outputs(self) -> Dict[str, Any]:
        """Figures by output, each as of a model."""


def describe(
    surrogate: Surrogate,
    fits: Dict[str, FitResult],
    traces: TraceSet,
    *,
    start: Start | None,
    metrics: Metrics | CascadeMetrics | None,
    provenance: Dict[str, Any],
    recorded: TraceSet | None = None,
) -> dict[str, Any]:
    """Everything that ``model.json`` says before the files are known.

    Args:
        surrogate: What is exported.
        fits: The fits that its models come from, by mapping; models without one are told without.
        traces: The cases, and the estimation traces that declare the range of the inputs.
        start: How the free runs began; at rest where nobody said.
        metrics: The figures, if there are any.
        provenance: Where the fit comes from.
        recorded: The cases as they were recorded, where channels were added since.

    Returns:
        JSON values; a number that is not finite is ``None``.
    """
    source, estimation = surrogate.source, traces.with_role(Role.ESTIMATION)
    stored, single = source.to_dict(), source.single is not None
    limits = {} if single else stored["limits"]
    stages = [_stage(stage, fits.get(str(stage.model.mapping))) for stage in surrogate.stages]
    manifest = {
        "schema_version": SCHEMA_VERSION,
        "label": surrogate.label,
        "structure": stored["structure"],
        "mapping": surrogate.mapping,
        "sample_time_s": surrogate.sample_time,
        "inputs": [_channel(port, traces, estimation) for port in surrogate.inputs],
        "outputs": [
            _channel(port, traces, estimation) | {"limits": limits.get(port.name, {"low": None, "high": None})}
            for port in surrogate.outputs
        ],
        "stages": stages,
        "model": stored,
        "n_parameters": source.n_parameters,
        "state": surrogate.state_text(),
        "initialisation": _initialisation(surrogate, example_of(traces)),
        "fit": stages[0]["fit"] if len(stages) == 1 else None,
        "cases_start": _begun(start, several=not single),
        "metrics": None if metrics is None else _metrics(metrics),
        "provenance": {**provenance, "data": _data(recorded or traces), "software": software()},
    }
    return {name: _json(value) for name, value in manifest.items()}


def of_another(manifest: Dict[str, Any], surrogate: Surrogate) -> dict[str, Any]:
    """What ``model.json`` says, with another model in place of its own, which answers as that does.

    Args:
        manifest: Its content.
        surrogate: The other model, whose members are told with the fits of the same mappings.

    Returns:
        The content.
    """
    stored, fits = surrogate.source.to_dict(), {stage["mapping"]: stage["fit"] for stage in manifest["stages"]}
    levels = {port.name: port.level for port in surrogate.channels}
    first = np.array([port.start for port in surrogate.inputs])
    changed = {
        "structure": stored["structure"],
        "stages": [_stage(one, None) | {"fit": fits.get(str(one.model.mapping))} for one in surrogate.stages],
        "model": stored,
        "n_parameters": surrogate.source.n_parameters,
        "initialisation": manifest["initialisation"] | {"levels": levels, "values": _at_rest(surrogate, first)},
    }
    return {**manifest, **{name: _json(value) for name, value in changed.items()}}


def _begun(start: Start | None, *, several: bool) -> dict[str, Any]:
    """How the free runs began; of several models with whether somebody said so."""
    begun = start or Start()
    return {"kind": begun.kind.value, "n_measured": begun.n_measured} | ({"said": start is not None} if several else {})


def _stage(stage: Stage, fit: FitResult | None) -> dict[str, Any]:
    """One of the models: how it is scaled, what it is held within, and the fit that it comes from."""
    form, n = stage.form, stage.form.n_inputs
    bounds = [
        [bound * scale + offset for bound in (form.low, form.high)]
        for offset, scale in zip(form.offset[n:], form.scale[n:], strict=True)
    ]
    return {
        "mapping": str(stage.model.mapping),
        "label": stage.model.label,
        "structure": stage.model.to_dict()["structure"],
        "n_parameters": stage.model.n_parameters,
        "scaling": {
            "input_offset": list(form.offset[:n]),
            "input_scale": list(form.scale[:n]),
            "output_offset": list(form.offset[n:]),
            "output_scale": list(form.scale[n:]),
        },
        "output_bounds": bounds,
        "fit": None
        if fit is None
        else {
            "status": fit.status.name,
            "status_text": fit.status.value,
            "loop": fit.loop.value,
            "seed": fit.seed,
            "train_time_s": fit.train_time_s,
            "notes": list(fit.notes),
        },
    }


def _metrics(metrics: Metrics | CascadeMetrics) -> dict[str, Any]:
    """Figures by case: of a model as they are; of a cascade by output, with what is the whole's beside them."""
    if not hasattr(metrics, "outputs"):
        return {name: case.to_dict() for name, case in metrics.cases.items()}
    found: dict[str, Any] = {}
    for output, evaluation in metrics.outputs.items():
        for name, case in evaluation.cases.items():
            figures = case.to_dict()
            whole = {key: figures.get(key) for key in ("role", "n_samples", "run_time_s")}
            entry = found.setdefault(name, whole | {"outputs": {}})
            entry["outputs"][output] = {
                key: figures[key] for key in ("free_run", "one_step", "begins_at") if key in figures
            }
    return found


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


AMPLIFIES = 1e3
"""From here on rounding is told to matter: 13 digits that two compilers have in common are 10 at the end of a run."""


def amplification(cases: Sequence[ParityCase], sequences: Sequence[ParityCase], sample_time: float) -> dict[str, Any]:
    """How much the model's free run makes of a small change of its output before the first sample.

    Args:
        cases: The cases.
        sequences: The random sequences.
        sample_time: Seconds.

    Returns:
        JSON values; ``rate_per_s`` is the mean rate at which the logarithm grew until the largest change was reached
        (a finite-time Lyapunov exponent), 0 where nothing grows.
    """
    worst = max((*cases, *sequences), key=lambda case: case.amplification)
    finite, after = math.isfinite(worst.amplification), (worst.reached + 1) * sample_time
    return {
        "largest": worst.amplification if finite else None,
        "case": worst.name,
        "after_s": after,
        "rate_per_s": math.log(max(worst.amplification, 1.0)) / after if finite else None,
        "amplifies": not worst.amplification < AMPLIFIES,
        "meaning": "largest change of an output over the change of the output before the first sample that caused it; "
        "a difference in the last digit of a number grows by as much",
    }


def _channel(port: Port, traces: TraceSet, estimation: tuple[Trace, ...]) -> dict[str, Any]:
    """A channel as the traces describe it; an output that they lack is known by its model alone."""
    first = traces.traces[0]
    channel = first.channel(port.name) if port.name in first.channel_names else None
    found = range_of(port.name, estimation)
    return {
        "name": port.name,
        "unit": port.unit,
        "reference": Reference.NONE.value if channel is None else channel.reference.value,
        "description": "" if channel is None else channel.description,
        "range": None if found is None else list(found),
    }


def _initialisation(surrogate: Surrogate, example: Trace) -> dict[str, Any]:
    first = surrogate.inputs_of(example)[0]
    lines = "a system at rest: every number of a channel's delay line is (its value at rest - offset) / scale"
    spaces = [stage for stage in surrogate.stages if isinstance(stage.state, HiddenState)]
    equations = any(stage.searched for stage in surrogate.stages)
    return {
        "rule": lines
        + ("; equations are where they are declared to be, or where nothing changes" if equations else "")
        + ("; a state space is where its inputs, and in a neural one its output, hold it" if spaces else ""),
        "levels": {port.name: port.level for port in surrogate.channels},
        "values": _at_rest(surrogate, first),
        "values_from": f"the inputs' first sample in {example.name}, and the levels: numbers, or inputs; an output "
        "whose states rest where the inputs alone say is what these give",
        "state": surrogate.at_rest(first).tolist(),
    }


def _at_rest(surrogate: Surrogate, first: NDArray[np.float64]) -> dict[str, float]:
    """Every channel of a system at rest: its level, or what states give that heed none, or are declared."""
    names = [port.name for port in surrogate.channels]
    values, run = surrogate.levels(first), surrogate.simulate(first[np.newaxis])[0]
    equations = [model for model in surrogate.source.models if isinstance(model, EquationModel)]
    declared = {name: model.grey.begins[name].start for model in equations for name in model.grey.begins}
    for column, given, says in zip(surrogate.columns, run, heeded(surrogate), strict=True):
        value = declared.get(names[column], given)
        if not says and np.isfinite(value):
            values[column] = value
    return dict(zip(names, values.tolist(), strict=True))


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


def software() -> dict[str, str]:
    """Versions of what writes and checks a bundle.

    Returns:
        By name.
    """
    packages = {name: metadata.version(name) for name in PACKAGES if has(name)}
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
