"""The steps of a fit to a measured frequency response: functions of what is asked that give a result.

Each step has a ``*_key`` beside it: the digest of everything that its result depends on.
"""

from __future__ import annotations

import dataclasses
import hashlib
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sysid.api.measured_responses.fitting import fitted_structure
from sysid.api.measured_responses.orders import ResponseOrderSearch, Tried, search_orders_of
from sysid.api.measured_responses.problem import ResponseProblem
from sysid.api.measured_responses.response_fit import ResponseFit, export_response
from sysid.code_digest import code_digest
from sysid.export.exporters import wanted_formats
from sysid.ingest.inspecting.undescribed import GuessedWarning
from sysid.ingest.responses import read_response
from sysid.models import TransferFunctionModel
from sysid.names import slug
from sysid.reporting.responses.results import (
    CurveRecord,
    ParameterRecord,
    ResponseFitRecord,
    ResponseOrderRow,
    ResponseOrdersRecord,
    RootRecord,
)
from sysid.traces.measured_response import MeasuredResponse
from sysid.workbench.responses.config import ResponseConfig
from sysid.workbench.runner.store import digest, strict

if TYPE_CHECKING:
    from sysid.export import Bundle


def load_response(config: ResponseConfig, beside: Path) -> MeasuredResponse:
    """Read what was measured.

    Args:
        config: The pipeline.
        beside: Folder of the pipeline's file: a path is relative to it, or else to the current folder.

    Returns:
        The response; what was guessed stands in its notes.

    Raises:
        UserError: If it cannot be read.
    """
    local = beside / config.data
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", GuessedWarning)  # told at the end, and on the page
        return read_response(
            str(local if local.exists() else config.data), columns=config.columns, units=config.units,
            files=config.files,
        )  # fmt: skip


def problem_of(config: ResponseConfig, measured: MeasuredResponse) -> ResponseProblem:
    """What is fitted, checked.

    Args:
        config: The pipeline.
        measured: The response.

    Returns:
        The problem.

    Raises:
        ConfigError: If an option does not apply.
    """
    return ResponseProblem.of(
        measured, config.mapping, sample_time=config.sample_time, weighting=config.weighting,
        units=config.channel_units, training=config.options,
    )  # fmt: skip


def data_digest(measured: MeasuredResponse) -> str:
    """SHA-256 of frequencies, values and coherence.

    Args:
        measured: The response.

    Returns:
        64 hexadecimal digits.
    """
    found = hashlib.sha256()
    for part in (measured.frequency, measured.values, measured.coherence):
        found.update(b"-" if part is None else np.ascontiguousarray(part).tobytes())
    return found.hexdigest()


def fit_key(config: ResponseConfig, measured: MeasuredResponse) -> str:
    """Digest of everything that a fit depends on.

    Args:
        config: The pipeline.
        measured: The response.

    Returns:
        64 hexadecimal digits.
    """
    terms = {
        "data": data_digest(measured),
        "name": measured.name,
        "notes": list(measured.notes),
        **{
            name: str(getattr(config, name))
            for name in ("mapping", "channel_units", "poles", "zeros", "delays", "sample_time", "domain", "weighting")
        },
        "training": str(dataclasses.asdict(config.options)),
        "code": code_digest(
            "sysid.workbench.responses.steps:fit_response", "sysid.workbench.responses.steps:record_of"
        ),
    }
    return digest(strict(terms))


def fit_response(problem: ResponseProblem, config: ResponseConfig, say: Callable[[str], None]) -> ResponseFit:
    """The fit of the orders that were asked for, or of the best of their range.

    Args:
        problem: What is fitted.
        config: The pipeline.
        say: Told of each structure that was compared.

    Returns:
        The fit.

    Raises:
        UserError: If the points do not allow it.
    """
    if not config.searched:
        return fitted_structure(problem, config.structure)

    def told(one: Tried) -> None:
        say(f"{one.poles} poles and {one.zeros} zeros: {one.fit.fit_percent:.2f} %")

    least, most = config.poles
    found = search_orders_of(
        problem, (least, most), config.zeros, domain=config.domain, delays=config.delays, on_tried=told
    )
    return found.fit


def record_of(fit: ResponseFit) -> ResponseFitRecord:
    """A fit as it stands in results.json.

    Args:
        fit: The fit.

    Returns:
        The record, without exports.
    """
    model = fit.model
    assert isinstance(model, TransferFunctionModel)  # noqa: S101 - no other is fitted to a response
    decibel, degrees, at = fit.furthest
    ends = model.ends
    fields: dict[str, Any] = {
        "mapping": str(model.mapping),
        "slug": slug(str(model.mapping)),
        "label": model.label,
        "structure": model.structure.to_dict(),
        "status": fit.status.name,
        "units": (ends.input_units[0], ends.output_units[0]),
        "sample_time": model.sample_time,
        "dead_time": model.delays[0] * model.sample_time,
        "weighting": fit.weighting.value,
        "fit_percent": fit.fit_percent,
        "left_out_percent": fit.left_out_percent,
        "furthest_db": decibel,
        "furthest_degrees": degrees,
        "furthest_at": at,
        "n_parameters": model.n_parameters,
        "train_time_s": fit.train_time_s,
        "seed": fit.seed,
        "parameters": _parameters(fit),
        "poles": _roots(model.poles(0)),
        "zeros": _roots(np.roots(_falling(model))),
        "notes": list(fit.notes),
        "warnings": list(fit.warnings),
        "orders": None if fit.orders is None else _orders(fit.orders),
        "curve": _curve(fit),
    }
    return ResponseFitRecord(**fields)


def _falling(model: TransferFunctionModel) -> NDArray[np.float64]:
    """The numerator by falling powers of ``s`` or ``z``."""
    top = np.asarray(model.numerator(0), dtype=np.float64)
    return np.trim_zeros(top if model.orders.domain.value == "discrete" else top[::-1], "f")


def _parameters(fit: ResponseFit) -> list[ParameterRecord]:
    known = fit.uncertainty
    if known is None:
        return []
    rows = zip(known.names, known.values, known.standard_deviations, known.interval(), strict=True)
    return [
        ParameterRecord(name=name, value=float(value), deviation=float(spread), low=float(low), high=float(high))
        for name, value, spread, (low, high) in rows
    ]


def _roots(roots: NDArray[Any]) -> list[RootRecord]:
    return [RootRecord(real=float(one.real), imaginary=float(one.imag)) for one in np.sort_complex(roots)]


def _orders(found: ResponseOrderSearch) -> ResponseOrdersRecord:
    rows = [ResponseOrderRow.model_validate(row) for row in found.to_frame().to_dict("records")]
    return ResponseOrdersRecord(told=found.told, rows=rows, failed=list(found.failed))


def _curve(fit: ResponseFit) -> CurveRecord:
    measured, values = fit.response, fit.values
    return CurveRecord(
        frequency=measured.frequency.tolist(),
        measured_real=measured.values.real.tolist(),
        measured_imaginary=measured.values.imag.tolist(),
        model_real=values.real.tolist(),
        model_imaginary=values.imag.tolist(),
        coherence=None if measured.coherence is None else measured.coherence.tolist(),
    )


def export_key(fit: str, config: ResponseConfig) -> str:
    """Digest of everything that a bundle depends on.

    Args:
        fit: Key of the exported fit.
        config: The pipeline, with an ``export``.

    Returns:
        64 hexadecimal digits.
    """
    assert config.export is not None  # noqa: S101 - asked before
    export = config.export.model_dump(mode="json") | {"formats": list(wanted_formats(config.export.formats).names)}
    files = ("sysid/export/templates", "sysid/export/fmi_headers", "sysid/export/schemas")
    code = code_digest(
        "sysid.api.measured_responses.response_fit:export_response",
        "sysid.export:export_bundle",
        "sysid.models:model_from_dict",
        files=files,
    )
    return digest({"fit": fit, "export": export, "code": code})


def export(
    fit: Any, measured: MeasuredResponse, config: ResponseConfig, folder: Path, provenance: dict[str, Any]
) -> Bundle:
    """Write a fit's files and check each against the model.

    Args:
        fit: The fit.
        measured: The response.
        config: The pipeline.
        folder: Where the bundle goes.
        provenance: What the bundle says about where it comes from.

    Returns:
        The bundle.

    Raises:
        ParityError: If a file differs from the model by more than the tolerance.
    """
    asked = config.export
    return export_response(
        fit, measured, folder, formats=wanted_formats(None if asked is None else asked.formats).names,
        tolerance=None if asked is None else asked.tolerance, provenance=provenance,
    )  # fmt: skip
