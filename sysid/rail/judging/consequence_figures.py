"""What a judgement found, as figures under named keys: whoever shows them need not know what a train is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

from sysid.rail.judging.judge import ErrorSensitivity, tolerable_mse

Results = Mapping[str, Mapping[str, Any]]
"""By scenario: a difference with its speed traces, or why there is none."""

ERROR: Final = "cylinder_mse"
LIMITED: Final = ("distance_percent", "time_percent", "force_percent")
"""Relative differences that the limit is for."""

DIFFERENCES: Final[dict[str, tuple[str, str, str]]] = {
    ERROR: ("cylinder mse", "psi²", "Mean square difference of the cylinder pressures over the braked vehicles."),
    "distance_percent": ("distance", "%", "Of the centre of mass until it stands, relative."),
    "time_percent": ("stop time", "%", "Until the centre of mass stands, relative."),
    "force_percent": ("largest coupler force", "%", "Largest draft or buff force of any coupler, relative."),
    "speed_kmh": ("speed", "km/h", "Largest difference of the first vehicle's speed."),
    "deceleration_percent": ("deceleration", "%", "Largest of the first vehicle over one second, relative."),
}
"""A model against the reference: name, unit and meaning by key."""

MEASURES: Final[dict[str, tuple[str, str, str]]] = {
    "distance_m": ("distance", "m", "Of the centre of mass until it stands, or to the end."),
    "time_s": ("time", "s", "Until the centre of mass stands, or to the end."),
    "peak_buff_kn": ("buff", "kN", "Largest buff force, negative."),
    "peak_buff_coupler": ("buff at", "coupler", "Number of the coupler with it."),
    "peak_buff_time_s": ("buff after", "s", "When it occurs."),
    "peak_draft_kn": ("draft", "kN", "Largest draft force."),
    "peak_draft_coupler": ("draft at", "coupler", "Number of the coupler with it."),
    "peak_draft_time_s": ("draft after", "s", "When it occurs."),
    "deceleration_m_s2": ("deceleration", "m/s²", "Largest of the first vehicle over one second."),
    "jerk_m_s3": ("jerk", "m/s³", "Largest of the first vehicle over one second."),
    "stopped": ("stands", "at the end", "Whether every vehicle stood at the end."),
}
"""What came of a run, with the reference and with a model alike."""

SIGNALS: Final = {"speed": ("speed", "km/h", "Of the first vehicle.")}

HEADLINE: Final = ("full service", "emergency")
"""The stops that the first sentence tells of."""

KINDS: Final = {"bias": "a bias of every car", "noise": "slow noise of each car"}


def consequence_document(
    *,
    train: str,
    speed: float,
    limit: float,
    judged: Mapping[str, Results],
    sensitivities: Mapping[str, Sequence[Mapping[str, float]]],
) -> dict[str, Any]:
    """All figures.

    Args:
        train: Its name.
        speed: At the beginning of a stop in km/h.
        limit: Relative consequence in percent that is asked for.
        judged: Results by subject and scenario.
        sensitivities: Artificial errors by kind, rising.

    Returns:
        JSON values, as a report of judgements reads them.
    """
    scenes = list(dict.fromkeys(name for results in judged.values() for name in results))
    run = [result for results in judged.values() for result in results.items() if "refused" not in result[1]]
    return {
        "schema_version": 2,
        "title": "Consequence",
        "method": f"{train}: the same train, line and handle with the reference brake and with each model, from "
        f"{speed:g} km/h. Distance and time are those of the centre of mass until it stands; forces are the largest in "
        "any coupler; deceleration and jerk are the first vehicle's over one second.",
        "reference_name": "reference brake",
        "scenes": scenes,
        "headline_scenes": [name for name in HEADLINE if name in scenes],
        "quantities": {
            key: {"name": name, "unit": unit, "meaning": meaning}
            for key, (name, unit, meaning) in {**DIFFERENCES, **MEASURES, **SIGNALS}.items()
        },
        "error": ERROR,
        "limited": list(LIMITED),
        "limit": limit,
        "reference": {
            name: {
                "measures": _measures(result["reference"]),
                "signals": {"speed": _curve(result["speed_traces"]["reference"])},
            }
            for name, result in reversed(run)  # the first subject's stands last, and stays
        },
        "subjects": {
            subject: {name: _scene(result) for name, result in results.items()} for subject, results in judged.items()
        },
        "sensitivity": [_sensitivity(kind, rows, limit) for kind, rows in sensitivities.items()],
    }


def _scene(result: Mapping[str, Any]) -> dict[str, Any]:
    if "refused" in result:
        return {"refused": result["refused"]}
    ours, theirs = result["other"]["deceleration_m_s2"], result["reference"]["deceleration_m_s2"]
    figures = {
        ERROR: result["mse_psi2"],
        **{key: result[key] for key in LIMITED},
        "speed_kmh": 3.6 * result["speed_m_s"],
        "deceleration_percent": 100.0 * (ours / theirs - 1.0) if theirs > 0.0 else math.nan,
    }
    return {
        "differences": figures,
        "measures": _measures(result["other"]),
        "signals": {"speed": _curve(result["speed_traces"]["other"])},
    }


def _measures(found: Mapping[str, Any]) -> dict[str, Any]:
    return {key: found[key] for key in MEASURES}


def _curve(trace: Mapping[str, list[float]]) -> dict[str, list[float]]:
    return {"time": trace["time"], "value": trace["speed"]}


def _sensitivity(kind: str, rows: Sequence[Mapping[str, float]], limit: float) -> dict[str, Any]:
    series = [
        ErrorSensitivity(
            size=row["size_psi"], mse=row["mse_psi2"], distance=row["distance"], time=row["time"], force=row["force"]
        )
        for row in rows
    ]
    return {
        "kind": kind,
        "meaning": KINDS[kind],
        "unit": "psi",
        "steps": [
            {
                "size": one.size,
                "error": one.mse,
                "differences": {key: 100.0 * float(getattr(one, _figure(key))) for key in LIMITED},
            }
            for one in series
        ],
        "tolerances": [
            _tolerance(key, tolerable_mse(series, figure=_figure(key), limit=limit / 100.0)) for key in LIMITED
        ],
    }


def _tolerance(key: str, mse: float) -> dict[str, Any]:
    reached = "passed" if math.isnan(mse) else "within" if math.isinf(mse) else "crossed"
    return {"quantity": key, "reached": reached, "error": mse if math.isfinite(mse) else math.nan}


def _figure(key: str) -> str:
    """What a sensitivity calls a relative difference."""
    return key.removesuffix("_percent")
