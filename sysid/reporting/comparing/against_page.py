"""The page of a comparison: verdict first, then the cases, the pictures, and what differs between the runs."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import sysid
from sysid.atomic import replacing
from sysid.reporting.comparing.against import Comparison, Contest, Side, compare_runs
from sysid.reporting.figures import fit_figures as figures
from sysid.reporting.html import page_template, readable
from sysid.reporting.numbers import quantity, seconds, times
from sysid.reporting.parts import Part, Section, Tile, Verdict, identifier, picture
from sysid.reporting.tables import DIVERGED, Cell, Column, Table
from sysid.units import squared


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
        draft.write_text(_render_comparison(found, f"{stem}.json"), encoding="utf-8")
    return path


def _render_comparison(found: Comparison, numbers: str) -> str:
    """The page, HTML 5 in one piece; ``numbers`` is the name of the file with the same numbers."""
    sections = (*(_cases(found, output) for output in found.outputs), *_pictures(found), _what_differs(found))
    ours, theirs = found.ours, found.theirs
    told = [f"{_chosen(side, found)} of {readable(side.results.created)}" for side in (ours, theirs)]
    return page_template("comparison.html.j2").render(
        document=Page(verdict=_verdict(found), sections=sections),
        verdict=_verdict(found),
        heading=f"{ours.name} against {theirs.name}",
        subtitle=f"{told[0]} against {told[1]}, {' and '.join(found.outputs)}.",
        facts=[(side.name, side.results.command) for side in (ours, theirs)],
        numbers=numbers,
        version=sysid.__version__,
    )


def _chosen(side: Side, found: Comparison) -> str:
    """What a run puts up in the outputs that both have."""
    return ", ".join(dict.fromkeys(side.entries[output].name for output in found.outputs))


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
    points = [("Sizes", f"{_sizes(ours, found)} against {_sizes(found.theirs, found)}.")]
    timed = [one for one in judged if math.isfinite(one.ours.run_time_s) and math.isfinite(one.theirs.run_time_s)]
    if timed:
        slow = max(timed, key=lambda contest: contest.ours.simulated_s)
        points.append(
            (
                "Speed",
                f"A free run of {quantity(slow.ours.simulated_s, 's')} ({slow.case}) takes "
                f"{seconds(slow.ours.run_time_s)} against {seconds(slow.theirs.run_time_s)}.",
            )
        )
    if judged:
        points.append(("Largest gain", _extreme(min(judged, key=_order), found)))
        points.append(("Largest loss", _extreme(max(judged, key=_order), found)))
    return Verdict(headline=headline, tiles=tiles, points=tuple(points), warnings=_warnings(found))


def _better(contest: Contest) -> bool:
    ours, theirs = contest.ours.error, contest.theirs.error
    return math.isfinite(ours) and (not math.isfinite(theirs) or ours < theirs)


def _order(contest: Contest) -> float:
    """From the largest gain to the largest loss; a run that alone diverges has lost more than any other."""
    if not math.isfinite(contest.ours.error):
        return math.inf
    return -math.inf if not math.isfinite(contest.theirs.error) else contest.ratio


def _extreme(contest: Contest, found: Comparison) -> str:
    unit = squared(found.ours.entries[contest.output].unit)
    ours = quantity(contest.ours.error, unit, missing=DIVERGED)
    theirs = quantity(contest.theirs.error, unit, missing=DIVERGED)
    share = "" if math.isnan(contest.ratio) else f", {times(contest.ratio)} of it"
    return f"{found.called(contest)}: mse {ours} against {theirs}{share}."


def _sizes(side: Side, found: Comparison) -> str:
    counts = dict.fromkeys(side.entries[output].parameters for output in found.outputs)
    return " and ".join("an unknown number of parameters" if n is None else f"{n} parameters" for n in counts)


def _warnings(found: Comparison) -> tuple[str, ...]:
    told = []
    unknown = [found.called(one) for one in found.contests if not (one.ours.target and one.theirs.target)]
    other = [found.called(one) for one in found.contests if not one.same and one.ours.target and one.theirs.target]
    if other:
        told.append(
            f"The targets of {', '.join(other)} differ between the runs: those cases are shown, but not counted."
        )
    if unknown:
        told.append(
            f"Of {', '.join(unknown)} it is not known whether both runs have the same target, as one is of an earlier "
            "release: those cases are shown, but not counted."
        )
    mappings = [
        (ours, theirs)
        for output in found.outputs
        if (ours := found.ours.entries[output].facts.get("mapping"))
        and (theirs := found.theirs.entries[output].facts.get("mapping"))
        and ours != theirs
    ]
    told += [f"The mappings differ: {ours} against {theirs}." for ours, theirs in mappings]
    if any(what in {"cpu", "cores"} for what, _, _ in found.differences):
        told.append("The runs were made on different machines: their run times are not comparable.")
    return tuple(told)


def _cases(found: Comparison, output: str) -> Section:
    contests = [contest for contest in found.contests if contest.output == output]
    one, other = found.ours.entries[output], found.theirs.entries[output]
    first, second = found.ours.name, found.theirs.name
    shared = [column for column in one.columns if column.key in {theirs.key for theirs in other.columns}]
    head = [("case", ""), ("role", "")]
    for index, column in enumerate(shared):
        unit = f" [{column.below}]" if column.below else ""
        head += [(f"{column.heading}{unit}", first), (column.heading, second)]
        head += [("ratio", "below 1 is better")] if index == 0 else []
    several = len(found.outputs) > 1
    table = Table(
        caption=f"Free runs case by case{f', {output}' if several else ''}.",
        head=tuple(head),
        rows=tuple(_case_row(contest, shared) for contest in contests),
        note="Counted are cases that neither run was fitted to or chosen on, with the same target in both.",
    )
    series = [
        figures.Series(name=name, values={c.case: getattr(c, side).error for c in contests})
        for side, name in (("ours", first), ("theirs", second))
    ]
    drawing = figures.cases_figure(series, [c.case for c in contests], quantity=f"free-run mse [{squared(one.unit)}]")
    caption = figures.cases_caption(series, "Free-run mse by case", "run")
    name = identifier(output) if several else ""
    return Section(
        anchor=f"cases-{name}" if several else "cases",
        title=f"Case by case: {output}" if several else "Case by case",
        parts=(table, picture(drawing, "Free-run mse", caption, f"mse-{name}" if several else "mse")),
    )


def _case_row(contest: Contest, columns: Sequence[Column]) -> tuple[Cell, ...]:
    role = "" if contest.ours.role is None else contest.ours.role.value
    cells = [Cell(text=contest.case, header=True, below="" if contest.counts else "not counted"), Cell(text=role)]
    for index, column in enumerate(columns):
        for entry in (contest.ours, contest.theirs):
            word = "-" if math.isfinite(entry.error) else DIVERGED
            cells.append(column.cell(entry.figures[column.key], missing=word))
        if index == 0:
            ratio = "none" if math.isnan(contest.ratio) else times(contest.ratio)
            cells.append(Cell(text=ratio, value=contest.ratio, mark="number"))
    return tuple(cells)


def _pictures(found: Comparison) -> list[Section]:
    parts: list[Part] = []
    drawn = [one for one in found.contests if one.same and one.ours.signals and one.theirs.signals]
    for index, contest in enumerate(drawn):
        ours, theirs = contest.ours.signals, contest.theirs.signals
        if ours is None or theirs is None:
            continue
        figure = figures.case_figure(
            ours.time,
            ours.target,
            ours.simulated,
            title=found.called(contest),
            label=contest.output,
            unit=found.ours.entries[contest.output].unit,
            other=theirs.simulated,
            names=(found.ours.name, found.theirs.name),
            columns=max(60, min(450, 450 * 30 // len(drawn))),
        )
        caption = f"{found.called(contest)}: target and both free runs above, their errors below."
        parts.append(picture(figure, found.called(contest), caption, f"case-{index}"))
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
