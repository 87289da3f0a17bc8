"""The verdict: which model, how good, how fast, where it is weak, in sentences made from stored figures."""

from __future__ import annotations

import math
from collections.abc import Mapping as Dict
from collections.abc import Sequence

from sysid.estimation import Status
from sysid.names import output_side
from sysid.reporting.fit_records import CaseRecord, FitRecord
from sysid.reporting.numbers import number, quantity, seconds, times
from sysid.reporting.parts import Tile, Verdict
from sysid.reporting.results import Results
from sysid.reporting.sections.fit_tables import mean_mse, real_time_factor, scored_cases
from sysid.reporting.worst_instants import Instant
from sysid.traces import Role
from sysid.units import squared


def verdict(results: Results, instants: Dict[str, Sequence[Instant]], comparability: str) -> Verdict:
    """Say which model was chosen and what it is worth.

    Args:
        results: The results, with published figures where there are some.
        instants: The worst instants of what was chosen, by name of the fit, worst first.
        comparability: What a comparison with the published figures can and cannot say.

    Returns:
        The verdict.
    """
    best = results.best_fit
    if best is None or results.best is None:
        return Verdict(
            headline="No fit was chosen.",
            tiles=(),
            points=(("Fits", f"{len(results.fits)} fits are compared below; none was marked as the best."),),
            warnings=_warnings(results, None),
        )
    points: list[tuple[str, str]] = []
    for fit in results.best_fits:
        cases, of = _judged(fit), "" if fit.system is None else f", {output_side(fit.mapping)}"
        points.append((f"Accuracy{of}", _accuracy(fit, cases, cases_chose=results.best.cases_chose)))
        published = _published(cases, comparability)
        points += [(f"Published{of}", published)] if published else []
        points.append((f"Weakness{of}", _weakness(fit, cases, instants[fit.name])))
    points.insert(-1 if best.system is None else len(points), ("Speed", _speed(_judged(best), results)))
    points += [("Choice", results.best.chosen_by), ("Export", _export(best))]
    tiles = [tile for fit in results.best_fits for tile in _tiles(fit, _judged(fit))]
    return Verdict(
        headline=_headline(results, best),
        tiles=tuple(tiles),
        points=tuple(points),
        warnings=tuple(dict.fromkeys(text for fit in results.best_fits for text in _warnings(results, fit))),
    )


def _headline(results: Results, best: FitRecord) -> str:
    whole = next((one for one in results.systems if one.name == best.system), None)
    if whole is not None:
        what = "one model" if whole.models == 1 else f"{whole.models} models run as one"
        return f"Best model of {whole.mapping}: {whole.name} ({whole.label}, {what}, {whole.n_parameters} parameters)."
    count = "" if best.n_parameters is None else f", {best.n_parameters} parameters"
    return f"Best model of {best.mapping}: {best.name} ({best.label}, trained in {best.loop.value} loop{count})."


def _judged(fit: FitRecord) -> Dict[str, CaseRecord]:
    return scored_cases(fit) or fit.cases


def _tiles(fit: FitRecord, cases: Dict[str, CaseRecord]) -> tuple[Tile, ...]:
    mean = sum(case.free_run.mse for case in cases.values()) / len(cases)
    fits = [case.free_run.nrmse_fit for case in cases.values() if math.isfinite(case.free_run.nrmse_fit)]
    errors = [case.free_run.max_abs_error for case in cases.values()]
    factor = min(real_time_factor(case) for case in cases.values())
    if fit.system is not None:
        words = f"lowest fit of {output_side(fit.mapping)}, free run"
        return (Tile(figure=quantity(min(fits), "%", digits=4) if fits else "-", words=words),)
    return (
        Tile(figure=quantity(mean, squared(fit.unit), missing="diverged"), words="mean mse, free run"),
        Tile(figure=quantity(min(fits), "%", digits=4) if fits else "-", words="lowest fit, free run"),
        Tile(figure=quantity(_largest(errors), fit.unit, missing="diverged"), words="largest error of any sample"),
        Tile(figure=times(factor), words="faster than real time, at least"),
    )


def _largest(values: Sequence[float]) -> float:
    return math.nan if any(math.isnan(value) for value in values) else max(values)


def _accuracy(fit: FitRecord, cases: Dict[str, CaseRecord], *, cases_chose: bool) -> str:
    of_squares = squared(fit.unit)
    kind = "that it was neither fitted to nor chosen on" if scored_cases(fit) else "of this run"
    if cases_chose:
        kind = "that it was not fitted to, but that took part in its choice"
    finite = {name: case for name, case in cases.items() if math.isfinite(case.free_run.mse)}
    if not finite:
        return f"The free run diverges on every one of the {_count(len(cases), 'case')} {kind}."
    low = min(finite, key=lambda name: finite[name].free_run.mse)
    high = max(finite, key=lambda name: finite[name].free_run.mse)
    if len(cases) == 1:
        (error,) = (case.free_run.mse for case in finite.values())
        rms = quantity(math.sqrt(error), fit.unit)
        return (
            f"In free run on {low}, the one case {kind}, the mse is {quantity(error, of_squares)}: a root mean square "
            f"error of {rms}."
        )
    text = (
        f"In free run on the {_count(len(cases), 'case')} {kind}, the mse lies between "
        f"{quantity(finite[low].free_run.mse, of_squares)} ({low}) and "
        f"{quantity(finite[high].free_run.mse, of_squares)} ({high})"
    )
    if len(finite) < len(cases):
        return f"{text}; on {', '.join(sorted(set(cases) - set(finite)))} it diverges."
    text += f", on average {quantity(mean_mse(fit, 'free_run'), of_squares)}" if scored_cases(fit) else ""
    rms = quantity(math.sqrt(finite[high].free_run.mse), fit.unit)
    return f"{text}. The root mean square error of the worst case is {rms}."


def _published(cases: Dict[str, CaseRecord], comparability: str) -> str:
    ratios = {
        name: case.published["free_run"].ratio
        for name, case in cases.items()
        if case.published and "free_run" in case.published and math.isfinite(case.published["free_run"].ratio)
    }
    if not ratios:
        return ""
    better = sum(ratio <= 1.0 for ratio in ratios.values())
    low, high = min(ratios, key=lambda name: ratios[name]), max(ratios, key=lambda name: ratios[name])
    return (
        f"At or below the published free-run mse on {better} of {_count(len(ratios), 'case')}: from "
        f"{times(ratios[low])} ({low}) to {times(ratios[high])} ({high}) of it. {comparability}".strip()
    )


def _speed(cases: Dict[str, CaseRecord], results: Results) -> str:
    slow = min(cases, key=lambda name: real_time_factor(cases[name]))
    case = cases[slow]
    machine = results.environment.get("cpu") or "the machine named below"
    return (
        f"A free run of {quantity(case.simulated_s, 's')} ({slow}) takes {seconds(case.run_time_s)}: "
        f"{number(real_time_factor(case), digits=2)} times faster than real time on {machine}."
    )


def _weakness(fit: FitRecord, cases: Dict[str, CaseRecord], instants: Sequence[Instant]) -> str:
    diverging = [name for name, case in cases.items() if not math.isfinite(case.free_run.mse)]
    if diverging:
        return f"The free run diverges on {', '.join(diverging)}: do not use this model there."
    worst = max(cases, key=lambda name: cases[name].free_run.mse)
    text = f"Weakest on {worst} (mse {quantity(cases[worst].free_run.mse, squared(fit.unit))})."
    if len(cases) == 1 and instants:  # what is said of its accuracy says that
        text = ""
    if instants:
        instant = instants[0]
        text += (
            f" The largest error, {quantity(instant.error, fit.unit)}, occurs in {instant.case} at "
            f"{instant.time:g}\u00a0s, where the target is {quantity(instant.target, fit.unit, digits=5)} and "
            f"the free run {quantity(instant.simulated, fit.unit, digits=5)}."
        )
    return text.strip()


def _export(fit: FitRecord) -> str:
    if not fit.exports:
        return "Not exported."
    worst = max(fit.exports, key=lambda export: export.largest_difference)
    formats = ", ".join(dict.fromkeys(export.format for export in fit.exports))
    return (
        f"Frozen as {formats}; the files differ from the model by at most "
        f"{quantity(worst.largest_difference, fit.unit)} on any case (allowed: {number(worst.tolerance)})."
    )


def _warnings(results: Results, best: FitRecord | None) -> tuple[str, ...]:
    found = []
    if best is not None:
        if not scored_cases(best):
            found.append(
                "There is no validation or test case: the figures are those of traces that the model has seen."
            )
        if results.best is not None and results.best.cases_chose:
            found.append(
                "No case is unseen here: all of them took part in the choice, as in the sweep that is repeated. What "
                "is called unseen below was not fitted to."
            )
        found += _seen_again(best)
        if best.status in Status.__members__ and not Status[best.status].usable:
            found.append(f"{best.name}: {best.status_sentence}")
        found += [
            f"{export.file} differs from its model by more than the tolerance: do not use it."
            for export in best.exports
            if not export.largest_difference <= export.tolerance
        ]
        found += _overtaken(results, best)
    for fit in results.fits:
        diverging = [name for name, case in fit.cases.items() if not math.isfinite(case.free_run.mse)]
        if diverging and not results.chosen(fit):
            found.append(f"{fit.name}: the free run diverges on {', '.join(diverging)}.")
    return tuple(found)


def _seen_again(best: FitRecord) -> list[str]:
    """Cases that are called unseen and whose figures are those of a fitted one to the last digit: the same record."""
    known = {(c.n_samples, c.free_run.mse): name for name, c in best.cases.items() if c.role is Role.ESTIMATION}
    cases = ((name, known.get((case.n_samples, case.free_run.mse))) for name, case in scored_cases(best).items())
    return [
        f"{name} has the very figures of {twin}, which was fitted: it is the same record, and tests nothing."
        for name, twin in cases
        if twin is not None and best.cases[name].free_run.mse > 0.0
    ]


def _overtaken(results: Results, best: FitRecord) -> list[str]:
    """Say so where the traces that choose and the cases that score do not agree."""
    rivals = [fit for fit in results.fits if fit.mapping == best.mapping and mean_mse(fit, "free_run") < _mean(best)]
    if not rivals:
        return []
    ahead = min(rivals, key=lambda fit: mean_mse(fit, "free_run"))
    of_squares = squared(best.unit)
    theirs = quantity(mean_mse(ahead, "free_run"), of_squares)
    ours = quantity(mean_mse(best, "free_run"), of_squares, missing="diverged")
    if results.best is not None and results.best.cases_chose:
        return [f"{ahead.name} has a lower mean free-run mse ({theirs} against {ours}), which is not what chose."]
    return [
        f"{ahead.name} has a lower mean free-run mse on the unseen cases ({theirs} against {ours}); "
        "the choice rests on other traces, so that these cases stay unseen."
    ]


def _mean(fit: FitRecord) -> float:
    """Mean free-run mse on the unseen cases; infinite where it diverges."""
    mean = mean_mse(fit, "free_run")
    return math.inf if math.isnan(mean) and scored_cases(fit) else mean


def _count(n: int, noun: str) -> str:
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"
