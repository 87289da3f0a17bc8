"""The page of a comparison: verdict first, then the cases, the pictures, and what differs between the runs."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path

import sysid
from sysid.atomic import replacing
from sysid.reporting.comparing.against import Comparison, Contest, compare_runs
from sysid.reporting.figures import fit_figures as figures
from sysid.reporting.html import page_template, readable
from sysid.reporting.numbers import quantity, seconds, times
from sysid.reporting.parts import Part, Section, Tile, Verdict, picture
from sysid.reporting.tables import DIVERGED, Cell, Table, figure_cell


@dataclass(frozen=True, kw_only=True)
class Page:
    """What the template lays out.

    Args:
        verdict: Stands first.
        sections: The rest, in order.
    """

    verdict: Verdict
    sections: tuple[Section, ...]


def write_comparison(run: Path, against: Path) -> Path:
    """Write the report of a run against another one; nothing is fitted or simulated.

    Args:
        run: Folder of the run.
        against: Folder of the run that it is compared with.

    Returns:
        The page, ``report/against-<name>.html`` in the first run's folder; the same numbers lie beside it as JSON.

    Raises:
        ConfigError: If a folder holds no results, or the runs have nothing in common.
    """
    found = compare_runs(run, against)
    stem = f"against-{''.join(c if c.isalnum() else '-' for c in found.theirs.name)}"
    path = Path(run) / "report" / f"{stem}.html"
    with replacing(path.with_suffix(".json")) as draft:
        draft.write_text(json.dumps(found.to_dict(), indent=1, allow_nan=False) + "\n", encoding="utf-8")
    with replacing(path) as draft:
        draft.write_text(render_comparison(found, f"{stem}.json"), encoding="utf-8")
    return path


def render_comparison(found: Comparison, numbers: str) -> str:
    """The page.

    Args:
        found: The comparison.
        numbers: Name of the file with the same numbers.

    Returns:
        HTML 5 in one piece.
    """
    sections = (_cases(found), *_pictures(found), _what_differs(found))
    ours, theirs = found.ours, found.theirs
    return page_template("comparison.html.j2").render(
        document=Page(verdict=_verdict(found), sections=sections),
        verdict=_verdict(found),
        heading=f"{ours.name} against {theirs.name}",
        subtitle=f"{ours.fit.name} of {readable(ours.results.created)} against {theirs.fit.name} of "
        f"{readable(theirs.results.created)}, {ours.fit.mapping}.",
        facts=[(side.name, side.results.command) for side in (ours, theirs)],
        numbers=numbers,
        version=sysid.__version__,
    )


def _verdict(found: Comparison) -> Verdict:
    judged, ours = found.judged, found.ours
    wins = [contest for contest in judged if _better(contest)]
    ratio = found.mean_ratio
    if not judged:
        headline = "The runs share no unseen case with the same target: nothing can be said about which is better."
    elif all(contest.ratio == 1.0 for contest in judged):
        headline = f"The runs are equal on every one of {len(judged)} unseen cases."
    elif len(wins) == len(judged):
        headline = f"{ours.name} is better on every one of {len(judged)} unseen cases."
    elif not wins:
        headline = f"{ours.name} is better on none of {len(judged)} unseen cases."
    else:
        headline = f"{ours.name} is better on {len(wins)} of {len(judged)} unseen cases."
    tiles = () if math.isnan(ratio) else (Tile(figure=times(ratio), words="its free-run mse, geometric mean"),)
    points = [("Sizes", f"{_size(ours.fit.n_parameters)} against {_size(found.theirs.fit.n_parameters)}.")]
    if judged:
        slow = max(judged, key=lambda contest: contest.ours.simulated_s)
        points.append(
            (
                "Speed",
                f"A free run of {quantity(slow.ours.simulated_s, 's')} ({slow.case}) takes "
                f"{seconds(slow.ours.run_time_s)} against {seconds(slow.theirs.run_time_s)}.",
            )
        )
        points.append(("Largest gain", _extreme(min(judged, key=_order), found)))
        points.append(("Largest loss", _extreme(max(judged, key=_order), found)))
    return Verdict(headline=headline, tiles=tiles, points=tuple(points), warnings=_warnings(found))


def _better(contest: Contest) -> bool:
    ours, theirs = contest.ours.free_run.mse, contest.theirs.free_run.mse
    return math.isfinite(ours) and (not math.isfinite(theirs) or ours < theirs)


def _order(contest: Contest) -> float:
    """From the largest gain to the largest loss; a run that alone diverges has lost more than any other."""
    if not math.isfinite(contest.ours.free_run.mse):
        return math.inf
    return -math.inf if not math.isfinite(contest.theirs.free_run.mse) else contest.ratio


def _extreme(contest: Contest, found: Comparison) -> str:
    unit = f"{found.ours.fit.unit}²"
    ours = quantity(contest.ours.free_run.mse, unit, missing=DIVERGED)
    theirs = quantity(contest.theirs.free_run.mse, unit, missing=DIVERGED)
    share = "" if math.isnan(contest.ratio) else f", {times(contest.ratio)} of it"
    return f"{contest.case}: mse {ours} against {theirs}{share}."


def _size(parameters: int | None) -> str:
    return "an unknown number of parameters" if parameters is None else f"{parameters} parameters"


def _warnings(found: Comparison) -> tuple[str, ...]:
    told = []
    other = [contest.case for contest in found.contests if not contest.same]
    if other:
        told.append(
            f"The targets of {', '.join(other)} differ between the runs: those cases are shown, but not counted."
        )
    if found.ours.fit.mapping != found.theirs.fit.mapping:
        told.append(f"The mappings differ: {found.ours.fit.mapping} against {found.theirs.fit.mapping}.")
    if any(what in {"cpu", "cores"} for what, _, _ in found.differences):
        told.append("The runs were made on different machines: their run times are not comparable.")
    return tuple(told)


def _cases(found: Comparison) -> Section:
    unit = found.ours.fit.unit
    rows = tuple(
        (
            Cell(text=one.case, header=True, below="" if one.counts else "not counted"),
            Cell(text=one.ours.role.value),
            figure_cell(one.ours.free_run.mse, missing=DIVERGED),
            figure_cell(one.theirs.free_run.mse, missing=DIVERGED),
            Cell(text="none" if math.isnan(one.ratio) else times(one.ratio), value=one.ratio, mark="number"),
            figure_cell(one.ours.free_run.nrmse_fit, missing="-", digits=4),
            figure_cell(one.theirs.free_run.nrmse_fit, missing="-", digits=4),
            figure_cell(one.ours.free_run.max_abs_error, missing=DIVERGED),
            figure_cell(one.theirs.free_run.max_abs_error, missing=DIVERGED),
        )
        for one in found.contests
    )
    first, second = found.ours.name, found.theirs.name
    table = Table(
        caption="Free runs case by case.",
        head=(
            ("case", ""),
            ("role", ""),
            (f"mse [{unit}²]", first),
            ("mse", second),
            ("ratio", "below 1 is better"),
            ("fit [%]", first),
            ("fit", second),
            (f"largest error [{unit}]", first),
            ("largest error", second),
        ),
        rows=rows,
        note="Counted are cases that neither run was fitted to or chosen on, with the same target in both.",
    )
    series = [
        figures.Series(name=name, values={c.case: getattr(c, side).free_run.mse for c in found.contests})
        for side, name in (("ours", first), ("theirs", second))
    ]
    drawing = figures.cases_figure(series, [c.case for c in found.contests], quantity=f"free-run mse [{unit}²]")
    caption = "Free-run mse by case; logarithmic, lower is better. A run without a mark diverges."
    return Section(
        anchor="cases", title="Case by case", parts=(table, picture(drawing, "Free-run mse", caption, "mse"))
    )


def _pictures(found: Comparison) -> list[Section]:
    output, unit = found.ours.fit.mapping.rpartition("->")[2].strip(), found.ours.fit.unit
    parts: list[Part] = []
    for index, contest in enumerate(contest for contest in found.contests if contest.same):
        ours, theirs = found.ours.signals[contest.case], found.theirs.signals[contest.case]
        figure = figures.case_figure(
            ours.time,
            ours.target,
            ours.simulated,
            title=contest.case,
            label=output,
            unit=unit,
            other=theirs.simulated,
            names=(found.ours.name, found.theirs.name),
        )
        caption = f"{contest.case}: target and both free runs above, their errors below."
        parts.append(picture(figure, contest.case, caption, f"case-{index}"))
    return [Section(anchor="pictures", title="Side by side", parts=tuple(parts))] if parts else []


def _what_differs(found: Comparison) -> Section:
    if not found.differences:
        return Section(anchor="differences", title="What differs", parts=("Nothing but the figures differs.",))
    table = Table(
        caption="What differs between the runs, figures apart.",
        head=(("", ""), (found.ours.name, ""), (found.theirs.name, "")),
        rows=tuple((Cell(text=what, header=True), Cell(text=a), Cell(text=b)) for what, a, b in found.differences),
    )
    return Section(anchor="differences", title="What differs", parts=(table,))
