"""Tables, charts and sentences of a judgement, as JSON values: what a report shows without knowing what a train is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from sysid.rail.judging.judge import Rung, tolerable_mse

Results = Mapping[str, Mapping[str, Any]]
"""By scenario: a difference with its speed traces, or why there is none."""

FIGURES = {"distance": "distance", "time": "stop time", "force": "largest coupler force"}
"""Relative differences, and what they are called."""


def consequence_document(
    *,
    train: str,
    speed: float,
    limit: float,
    judged: Mapping[str, Results],
    ladders: Mapping[str, Sequence[Mapping[str, float]]],
) -> dict[str, Any]:
    """The whole document.

    Args:
        train: Its name.
        speed: At the beginning of a stop in km/h.
        limit: Relative consequence in percent that is asked for.
        judged: Results by subject and scenario.
        ladders: Artificial errors by kind, rising.

    Returns:
        JSON values.
    """
    rungs = {kind: [_rung(entry) for entry in rows] for kind, rows in ladders.items()}
    tolerable = {
        kind: {figure: tolerable_mse(rows, figure=figure, limit=limit / 100.0) for figure in FIGURES}
        for kind, rows in rungs.items()
    }
    tables = [_summary(judged, limit), _tolerable_table(rungs, tolerable, limit)]
    tables += [_differences(subject, results) for subject, results in judged.items()]
    tables.append(_forces(judged))
    return {
        "title": "Consequence",
        "headline": _headline(judged, speed),
        "sentences": [
            f"{train}: the same train, line and handle with the reference brake and with each model, from {speed:g} "
            "km/h. Distance and time are those of the centre of mass until it stands; forces are the largest in any "
            "coupler; deceleration and jerk are the first vehicle's over one second.",
            _tolerance_sentence(tolerable, limit),
        ],
        "tables": tables,
        "charts": [_ladder_chart(rungs, judged, limit), *_speed_charts(judged)],
        "metrics": {subject: _metrics(results) for subject, results in judged.items()},
    }


def _rung(entry: Mapping[str, float]) -> Rung:
    return Rung(
        size=entry["size_psi"],
        mse=entry["mse_psi2"],
        distance=entry["distance"],
        time=entry["time"],
        force=entry["force"],
    )


def _run(results: Results) -> Results:
    """The scenarios that could be run."""
    return {name: result for name, result in results.items() if "refused" not in result}


def _worst(results: Results, figure: str) -> float:
    return max((abs(result[f"{figure}_percent"]) for result in _run(results).values()), default=math.nan)


def _mean_mse(results: Results) -> float:
    values = [result["mse_psi2"] for result in _run(results).values()]
    return sum(values) / len(values) if values else math.nan


def _headline(judged: Mapping[str, Results], speed: float) -> str:
    said = []
    for subject, results in judged.items():
        stops = {name: result for name, result in _run(results).items() if name in {"full service", "emergency"}}
        parts = [
            f"{name} {result['distance_percent']:+.2f} % in distance and {result['force_percent']:+.2f} % in the "
            f"largest coupler force at {result['mse_psi2']:.3g} psi²"
            for name, result in stops.items()
        ]
        said.append(f"{subject}: {'; '.join(parts) or 'no stop could be run'}")
    return f"From {speed:g} km/h, against the reference. {'. '.join(said)}."


def _tolerance_sentence(tolerable: Mapping[str, Mapping[str, float]], limit: float) -> str:
    parts = [
        f"as {'a bias of every car' if kind == 'bias' else 'slow noise of each car'}, distance "
        f"{_upto(found['distance'])} and largest coupler force {_upto(found['force'])}"
        for kind, found in tolerable.items()
    ]
    return f"How large an error may be before the consequence passes {limit:g} %: {'; '.join(parts)}."


def _upto(mse: float) -> str:
    if math.isnan(mse):
        return "passes it at every size tried"
    return "stays within it at every size tried" if math.isinf(mse) else f"up to {mse:.2g} psi²"


def _table(
    caption: str, head: Sequence[tuple[str, str]], rows: Sequence[Sequence[Any]], note: str = ""
) -> dict[str, Any]:
    return {
        "caption": caption,
        "head": [list(entry) for entry in head],
        "rows": [list(row) for row in rows],
        "note": note,
    }


def _summary(judged: Mapping[str, Results], limit: float) -> dict[str, Any]:
    rows = []
    for subject, results in judged.items():
        run = _run(results)
        within = sum(all(abs(r[f"{figure}_percent"]) <= limit for figure in FIGURES) for r in run.values())
        worst = [_worst(results, figure) for figure in FIGURES]
        rows.append([subject, _mean_mse(results), *worst, f"{within} of {len(run)}", str(len(results) - len(run))])
    head = [("model", ""), ("cylinder mse", "psi², mean")]
    head += [(name, "%, worst") for name in FIGURES.values()]
    head += [(f"all within {limit:g} %", "scenarios"), ("not possible", "scenarios")]
    return _table("What each model's error does to the train, over all scenarios.", head, rows)


def _tolerable_table(
    rungs: Mapping[str, Sequence[Rung]], tolerable: Mapping[str, Mapping[str, float]], limit: float
) -> dict[str, Any]:
    rows = [
        [kind, f"{rung.size:g}", rung.mse, *(100.0 * getattr(rung, figure) for figure in FIGURES)]
        for kind, row in rungs.items()
        for rung in row
    ]
    limits = [
        [f"{kind}: passes {limit:g} % at", "psi²", None, *(_finite(found[figure]) for figure in FIGURES)]
        for kind, found in tolerable.items()
    ]
    head = [
        ("error", ""),
        ("size", "psi"),
        ("cylinder mse", "psi²"),
        *((name, "%, worst") for name in FIGURES.values()),
    ]
    note = (
        "The reference brake with an artificial error on every cylinder that is not empty: a bias of all cars, the "
        "worst that an error of a size can be, or slow noise of its own on each. The last rows give the mse at which "
        "each figure passes the limit, in psi²; empty where none of the sizes tried does, or all do."
    )
    return _table("How large an error may be: worst relative consequence by size.", head, [*rows, *limits], note)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _differences(subject: str, results: Results) -> dict[str, Any]:
    rows: list[list[Any]] = []
    for name, result in results.items():
        if "refused" in result:
            rows.append([name, *[None] * 6, result["refused"]])
            continue
        ours, theirs = result["other"], result["reference"]
        rows.append(
            [
                name,
                result["mse_psi2"],
                *(result[f"{figure}_percent"] for figure in FIGURES),
                3.6 * result["speed_m_s"],
                100.0 * (ours["deceleration_m_s2"] / theirs["deceleration_m_s2"] - 1.0)
                if theirs["deceleration_m_s2"] > 0.0
                else None,
                f"{ours['jerk_m_s3']:.2f} for {theirs['jerk_m_s3']:.2f}",
            ]
        )
    head = [("scenario", ""), ("cylinder mse", "psi²"), *((name, "%") for name in FIGURES.values())]
    head += [("speed", "km/h, largest"), ("deceleration", "%"), ("jerk", "m/s³")]
    return _table(f"{subject} against the reference, by scenario.", head, rows)


def _forces(judged: Mapping[str, Results]) -> dict[str, Any]:
    rows: list[list[Any]] = []
    names = dict.fromkeys(name for results in judged.values() for name in _run(results))
    for name in names:
        first = next(_run(results)[name] for results in judged.values() if name in _run(results))
        rows.append([name, "reference", *_places(first["reference"])])
        rows += [
            ["", subject, *_places(results[name]["other"])]
            for subject, results in judged.items()
            if name in _run(results)
        ]
    head = [
        ("scenario", ""), ("brake", ""), ("distance", "m"), ("time", "s"), ("buff", "kN"), ("where", "coupler, time"),
        ("draft", "kN"), ("where", "coupler, time"), ("stands", "at the end"),
    ]  # fmt: skip
    return _table("Stops and largest coupler forces, and where they occur.", head, rows)


def _places(found: Mapping[str, Any]) -> list[Any]:
    return [
        found["distance_m"],
        found["time_s"],
        found["peak_buff_kn"],
        f"{found['peak_buff_coupler']}, {found['peak_buff_time_s']:.1f} s",
        found["peak_draft_kn"],
        f"{found['peak_draft_coupler']}, {found['peak_draft_time_s']:.1f} s",
        "yes" if found["stopped"] else "no",
    ]


def _ladder_chart(rungs: Mapping[str, Sequence[Rung]], judged: Mapping[str, Results], limit: float) -> dict[str, Any]:
    lines: list[dict[str, Any]] = []
    for kind, rows in rungs.items():
        for figure in ("distance", "force"):
            y = [100.0 * getattr(rung, figure) for rung in rows]
            lines.append({"name": f"{FIGURES[figure]}, {kind}", "x": [rung.mse for rung in rows], "y": y})
    for subject, results in judged.items():
        run = {name: result for name, result in _run(results).items() if result["mse_psi2"] > 0.0}
        for figure in ("distance", "force"):
            points = sorted((result["mse_psi2"], abs(result[f"{figure}_percent"])) for result in run.values())
            points = [point for point in points if point[1] > 0.0]
            name = f"{subject}: {FIGURES[figure]}"
            lines.append({"name": name, "x": [p[0] for p in points], "y": [p[1] for p in points], "marks": True})
    ends = [rung.mse for rows in rungs.values() for rung in rows]
    if ends:
        span = [min(ends), max(ends)]
        lines.append({"name": f"{limit:g} %", "x": span, "y": [limit, limit], "target": True})
    return {
        "title": "What an error costs",
        "caption": "Relative consequence against the mean square error of the cylinder pressures. Lines: artificial "
        "errors of the reference, worst scenario; marks: each model in each scenario.",
        "x": "cylinder mse [psi²]",
        "y": "consequence [%]",
        "logarithmic": True,
        "lines": lines,
    }


def _speed_charts(judged: Mapping[str, Results]) -> list[dict[str, Any]]:
    charts = []
    names = dict.fromkeys(name for results in judged.values() for name in _run(results))
    for name in names:
        lines: list[dict[str, Any]] = []
        for subject, results in judged.items():
            if name not in _run(results):
                continue
            traces = results[name]["speed_traces"]
            if not lines:
                lines.append(_line("reference", traces["reference"], target=True))
            lines.append(_line(subject, traces["other"]))
        charts.append(
            {
                "title": f"Speed: {name}",
                "caption": f"Speed of the first vehicle, {name}: the reference brake and each model.",
                "x": "time [s]",
                "y": "speed [km/h]",
                "lines": lines,
            }
        )
    return charts


def _line(name: str, trace: Mapping[str, list[float]], *, target: bool = False) -> dict[str, Any]:
    return {"name": name, "x": trace["time"], "y": trace["speed"], "target": target}


def _metrics(results: Results) -> dict[str, float]:
    """Numbers to track with a model, by name."""
    found = {f"worst_{figure}_percent": _worst(results, figure) for figure in FIGURES}
    found["mean_cylinder_mse"] = _mean_mse(results)
    for name, result in _run(results).items():
        for figure in FIGURES:
            found[f"{figure}_percent/{name}"] = result[f"{figure}_percent"]
        found[f"cylinder_mse/{name}"] = result["mse_psi2"]
    return {name: float(value) for name, value in found.items() if math.isfinite(value)}
