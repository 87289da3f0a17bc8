"""Results as they are stored: figures and signals of a fit, and the results.json of a run."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from sysid.estimation import CascadeFit, FitResult, Posterior, Status
from sysid.models import Mapping as Mapped
from sysid.reporting.curves import CURVES_FILE
from sysid.reporting.records import SCHEMA_VERSION
from sysid.reporting.sections.fit_tables import DRAWN
from sysid.reporting.sweep_record import SweepRecord
from sysid.traces import Role, TraceSet
from sysid.validation import CaseIntervals, CaseResult, Evaluation, Figures
from sysid.validation.beyond import beyond
from sysid.validation.first_state import first_states
from sysid.validation.metrics import mean_fit
from sysid.validation.repeated import repeated
from sysid.validation.still import still
from sysid.workbench.fits.choice import Choice
from sysid.workbench.fits.config import PipelineConfig
from sysid.workbench.fits.data import Data
from sysid.workbench.fits.evidence import linearity
from sysid.workbench.fits.steps import Scores
from sysid.workbench.runner.events import FitReady
from sysid.workbench.runner.store import read_arrays, read_json, write_arrays, write_json

SIGNALS = ("time", "target", "simulated", "predicted")
COUNTS = "counts"
"""What is kept of every case, sample by sample."""

CHOSE = ("selection_rms_shares", "selection_errors", "estimation_errors")
"""What is kept of the traces that choose."""

INTERVAL = ("low", "high")
"""What is kept besides where there are intervals."""


def write_fit(folder: Path, fit: FitResult) -> list[Path]:
    """Store a fit.

    Args:
        folder: The fit's folder.
        fit: The fit.

    Returns:
        The files written.
    """
    write_json(folder / "fit.json", fit.to_dict())
    posterior = folder / "posterior.npz"
    if fit.posterior is None:
        posterior.unlink(missing_ok=True)  # of an earlier fit
        return [folder / "fit.json"]
    write_arrays(posterior, fit.posterior.to_arrays())
    return [folder / "fit.json", posterior]


def read_fit(folder: Path) -> FitResult:
    """The fit that :func:`write_fit` stored."""
    fit, posterior = FitResult.from_dict(read_json(folder / "fit.json")), folder / "posterior.npz"
    return replace(fit, posterior=Posterior.from_arrays(read_arrays(posterior))) if posterior.is_file() else fit


def write_scores(folder: Path, scores: Scores) -> list[Path]:
    """Store figures and signals.

    Args:
        folder: The fit's folder.
        scores: The figures.

    Returns:
        The files written.
    """
    cases = scores.evaluation.cases
    arrays = {f"{name}/{signal}": getattr(case, signal) for name, case in cases.items() for signal in SIGNALS}
    arrays |= {
        f"{name}/{signal}": getattr(case.intervals, signal)
        for name, case in cases.items()
        if case.intervals is not None
        for signal in INTERVAL
    }
    arrays |= {
        f"{name}/{COUNTS}": case.counts.astype(np.float64) for name, case in cases.items() if case.counts is not None
    }
    write_arrays(folder / "signals.npz", arrays)
    figures = {name: case.to_dict() for name, case in cases.items()}
    chose = {"selection_mse": scores.selection_mse, **{name: list(getattr(scores, name)) for name in CHOSE}}
    write_json(folder / "evaluation.json", {"cases": figures, **chose})
    return [folder / "signals.npz", folder / "evaluation.json"]


def write_residuals(folder: Path, residuals: Mapping[str, Any]) -> list[Path]:
    """Store what :func:`sysid.workbench.fits.evidence.residuals` found.

    Args:
        folder: The fit's folder.
        residuals: JSON values.

    Returns:
        The files written.
    """
    write_json(folder / "residuals.json", residuals)
    return [folder / "residuals.json"]


def write_curves(folder: Path, curves: Mapping[str, Any] | None) -> list[Path]:
    """Store what :func:`sysid.workbench.fits.evidence.curves` found.

    Args:
        folder: The fit's folder.
        curves: JSON values; ``None`` for a model without curves.

    Returns:
        The files written.
    """
    file = folder / CURVES_FILE
    if curves is None:
        file.unlink(missing_ok=True)  # of a structure that stood here before
        return []
    write_json(file, curves)
    return [file]


def read_scores(folder: Path) -> Scores:
    """The figures and signals that :func:`write_scores` stored."""
    stored = read_json(folder / "evaluation.json")
    arrays = read_arrays(folder / "signals.npz")
    cases = {
        name: CaseResult(
            case=name,
            role=Role(fields["role"]),
            free_run=Figures.from_dict(fields["free_run"]),
            one_step=Figures.from_dict(fields["one_step"]),
            run_time_s=fields["run_time_s"],
            first=fields["begins_at"],
            counts=arrays[f"{name}/{COUNTS}"] > 0.0 if f"{name}/{COUNTS}" in arrays else None,
            intervals=CaseIntervals.from_dict(fields["coverage"], *(arrays[f"{name}/{signal}"] for signal in INTERVAL))
            if "coverage" in fields
            else None,
            by_state={state: (Figures.from_dict(one), float(one["share"])) for state, one in fields["by_state"].items()}
            if "by_state" in fields
            else None,
            constants=fields.get("constants", {}),
            **_signals(arrays, name),
        )
        for name, fields in stored["cases"].items()
    }
    return Scores(
        evaluation=Evaluation(cases=cases),
        selection_mse=float(stored["selection_mse"]),
        **{name: tuple(map(float, stored[name])) for name in CHOSE},
    )


def _signals(arrays: Mapping[str, Any], name: str) -> dict[str, Any]:
    return {signal: np.asarray(arrays[f"{name}/{signal}"], dtype=np.float64) for signal in SIGNALS}


def _fit_record(ready: FitReady, exports: Sequence[Mapping[str, Any]], traces: TraceSet) -> dict[str, Any]:
    """One fit as it stands in results.json; it may go without some of the cases, where none was fitted."""
    fit, model = ready.fit, ready.fit.model
    stored, fitted = fit.to_dict(), traces.with_role(Role.ESTIMATION)
    scored = [trace for trace in traces if traces.roles[trace.name] is not Role.ESTIMATION]
    channels = (*model.mapping.inputs, *model.mapping.outputs)
    further = *beyond(model, fitted, scored), *repeated(channels, fitted, scored)
    further = *further, *still(model.mapping, fitted, scored), *first_states(model, traces, ready.pipeline.start)
    return {
        "name": ready.config.name,
        "slug": ready.config.slug,
        "mapping": str(ready.pipeline.mapping),
        "system": ready.system,
        "model_slug": ready.model_slug or ready.config.slug,
        "structure": model.structure.to_dict(),
        "label": model.label,
        "loop": fit.loop.value,
        "train_time_s": fit.train_time_s,
        "status": fit.status.name,
        "seed": fit.seed,
        "initial": ready.config.initial,
        "notes": [*further, *fit.notes],
        "warnings": [*fit.warnings, *further],
        "evidence": stored["evidence"],
        "attempts": stored["attempts"],
        "stability": stored["stability"],
        "n_parameters": model.n_parameters,
        "selection_mse": ready.selection_mse,
        "cases": {name: case.to_dict() for name, case in ready.evaluation.cases.items()},
        "exports": [dict(entry) for entry in exports],
        "learning_curve": {name: stored["history"][name] for name in ("iteration", "mse")},
    }


def results_document(
    *,
    config: PipelineConfig,
    command: str,
    environment: Mapping[str, Any],
    data: Data,
    fits: Sequence[FitReady],
    choice: Choice | None,
    exports: Sequence[Mapping[str, Any]],
    advice: Sequence[Mapping[str, Any]] = (),
    orders: Sequence[Mapping[str, Any]] = (),
    sweep: SweepRecord | None = None,
) -> dict[str, Any]:
    """The contents of results.json; its contract is in ``docs/results.md``.

    Args:
        config: The pipeline.
        command: The command that makes the run again.
        environment: The machine and the packages.
        data: The traces.
        fits: The fits that are ready.
        choice: Which of them is put first.
        exports: Exported files of that fit.
        advice: What was found in the traces, output by output, once they were looked at.
        orders: What a search of the orders found, by output.
        sweep: That found the fits, if one did.

    Returns:
        JSON values, apart from NaN and the infinities.
    """
    traces = data.traces
    chosen = [] if choice is None else [one for one in fits if (one.system or one.config.name) == choice.name]
    first = chosen[0].config.name if chosen else None
    start = config.start
    return {
        "schema_version": SCHEMA_VERSION,
        "kind": "fits" if sweep is None else "sweep",
        "pipeline": config.name,
        "description": config.description,
        "command": command,
        "created": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
        "environment": dict(environment),
        "seed": config.seed,
        "data": _data(traces),
        "selection": {
            "name": config.selection or traces.name,
            "cases": {trace.name: {"samples": len(trace), "digest": trace.digest} for trace in data.selection},
        }
        if data.selection
        else None,
        "start": {"kind": start.kind.value, "n_measured": start.n_measured},
        "fits": [_fit_record(ready, exports if ready.config.name == first else (), traces) for ready in fits],
        "systems": _system_records(fits),
        "orders": [dict(one) for one in orders],
        "best": asdict(choice) | {"name": first} if choice else None,
        "linearity": linearity(fits, choice.name if choice else None),
        "advice": list(advice),
        "published": config.report.published,
        "drawn": config.report.drawn or DRAWN,
        "frequency": config.report.frequency.value,
        "sweep": None if sweep is None else sweep.summary.model_dump(),
    }


def _data(traces: TraceSet) -> dict[str, Any]:
    cases = {
        trace.name: {
            "role": traces.roles[trace.name].value,
            "samples": len(trace),
            "duration_s": trace.duration,
            "provenance": list(trace.provenance),
        }
        for trace in traces
    }
    about = {"name": traces.name, "digest": traces.digest, "sample_time": traces.sample_time, "source": traces.source}
    return {**about, "cases": cases}


def _system_records(fits: Sequence[FitReady]) -> list[dict[str, Any]]:
    """The fits of several outputs as wholes, as they stand in results.json; none of fits of one output."""
    groups: dict[str, list[FitReady]] = {}
    for ready in fits:
        if ready.system is not None:
            groups.setdefault(ready.system, []).append(ready)
    return [_system(name, outputs) for name, outputs in groups.items()]


def _system(name: str, outputs: Sequence[FitReady]) -> dict[str, Any]:
    models = {ready.model_slug: ready.fit for ready in outputs}
    cases = [ready.evaluation.cases for ready in outputs]
    whole = Mapped(inputs=outputs[0].pipeline.mapping.inputs, outputs=[ready.output for ready in outputs])
    return {
        "name": name,
        "mapping": str(whole),
        "label": _labels(dict.fromkeys(fit.model.label for fit in models.values())),
        "fits": {ready.output: ready.config.name for ready in outputs},
        "models": len(models),
        "n_parameters": sum(fit.model.n_parameters for fit in models.values()),
        "train_time_s": sum(fit.train_time_s for fit in models.values()),
        "cases": {
            case: {
                "role": cases[0][case].role.value,
                "mean_fit": mean_fit(one[case].free_run.nrmse_fit for one in cases),
                "run_time_s": sum(
                    {ready.model_slug: ready.evaluation.cases[case].run_time_s for ready in outputs}.values()
                ),
            }
            for case in cases[0]
        },
    }


def _labels(different: Iterable[str]) -> str:
    """The structures of a whole: models of its outputs may have other dead times, or other orders."""
    first, *others = different
    return f"{first} and {others[0]}" if len(others) == 1 else f"{first} and {len(others)} others" if others else first


def export_record(entry: Any, folder: str, unit: str, run_times: Sequence[Any] = ()) -> dict[str, Any]:
    """One exported file as it stands in results.json.

    Args:
        entry: The bundle's entry.
        folder: The bundle's folder, relative to the run folder.
        unit: The output's unit.
        run_times: What was measured of all files.

    Returns:
        JSON values.
    """
    return {
        "format": entry.format,
        "file": f"{folder}/{entry.name}",
        "largest_difference": entry.largest_difference,
        "tolerance": entry.tolerance,
        "unit": unit,
        "run_times": [
            {"cars": one.cars, "seconds": one.seconds, "ratio": one.ratio}
            for one in run_times
            if (one.name, one.format) == (entry.name, entry.format)
        ],
    }


def is_final(fit: FitResult | CascadeFit) -> bool:
    """Whether a fit ran to its end; an interrupted one is used now and done again next time."""
    return fit.status is not Status.INTERRUPTED
