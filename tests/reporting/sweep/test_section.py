"""What a report says of a sweep: its best beside published ones, its front, its pictures."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from sysid.errors import ConfigError
from sysid.reporting.numbers import quantity, times
from sysid.reporting.published.tables import read_published
from sysid.reporting.sweep.figures import heat_maps, over_trials_figure, parallel_figure, pareto_figure
from sysid.reporting.sweep.section import sweep_figures, sweep_points, sweep_sections
from sysid.reporting.sweep.tables import (
    beside_table,
    best_table,
    cost_table,
    mean_not_fitted,
    published_ranks,
)
from sysid.reporting.sweep_record import SWEEP_FILE, SweepRecord, Trial, TrialCase, read_sweep, write_sweep


def trial(number: int, delays: int, neurons: int, **change: Any) -> Trial:
    rng = np.random.default_rng(number)
    error = float(np.exp(rng.normal()) / (delays * neurons))
    cases = {
        name: TrialCase(
            role=role, free_run_mse=error * f, one_step_mse=1e-3 * error * f, run_time_s=1e-3 * (1 + neurons)
        )
        for name, role, f in (("EST01", "estimation", 0.5), ("VAL01", "validation", 1.0), ("VAL02", "validation", 3.0))
    }
    fields: dict[str, Any] = {
        "number": number,
        "key": f"key {number}",
        "label": f"NARX {delays}/1/{neurons}",
        "structure": {"kind": "NARX", "neurons": neurons},
        "values": {"input_delays": delays, "neurons": neurons},
        "status": "CONVERGED",
        "usable": True,
        "seconds": 2.0,
        "cpu_s": 1.0,
        "parameters": 4 * neurons,
        "operations": 4 * neurons,
        "selection_free_run_mse": error,
        "selection_one_step_mse": 1e-3 * error,
        "cases": cases,
    }
    return Trial(**(fields | change))


def record(**change: Any) -> SweepRecord:
    trials = [trial(6 * (d - 1) + n, d, n) for d in (1, 2, 3) for n in range(1, 7)]
    trials[4] = trials[4].model_copy(update={"dropped_at": 1, "selection_free_run_mse": 1e-9})
    trials[5] = trials[5].model_copy(update={"usable": False, "status": "UNSTABLE", "selection_free_run_mse": math.nan})
    best = min((t for t in trials if t.in_full), key=lambda t: t.selection_free_run_mse)
    fields: dict[str, Any] = {
        "name": "s",
        "mapping": "BP+AR -> BC",
        "unit": "psi",
        "method": "grid",
        "points": 18,
        "objectives": ["free_run_mse", "run_time"],
        "choose_by": "free_run_mse",
        "choose_on": "selection",
        "chosen_by": "Least.",
        "rungs": [{"iterations": 5, "record": 0.5, "keep": 0.9}],
        "workers": 2,
        "wall_s": 100.0,
        "winner": best.number,
        "beside": [trials[0]],
        "trials": trials,
    }
    return SweepRecord(**(fields | change))


def texts(table: Any) -> list[list[str]]:
    return [[cell.text for cell in row] for row in table.rows]


def test_the_table_of_the_best_leaves_out_what_was_dropped_or_unusable() -> None:
    found = record()
    table = best_table(found, "free_run_mse", mse="free_run_mse")
    ranked = sorted(found.tried_in_full, key=lambda t: t.selection_free_run_mse)[:5]
    assert [row[1].replace("\u00a0", " ") for row in texts(table)] == [t.label for t in ranked]
    assert len(found.tried_in_full) == 16


def test_published_ranks_stand_beside_ours() -> None:
    ranks = published_ranks(read_published("lopes-2021"), "BP+AR -> BC", "accuracy")
    assert [(r.rank, r.structure, r.mse) for r in ranks[:2]] == [
        (1, "NARX 4/4/20", 2.5176e-5),
        (2, "NARX 3/4/20", 2.6821e-5),
    ]
    speed = published_ranks(read_published("lopes-2021"), "BP+AR -> BC", "speed")
    assert [(r.structure, r.run_time) for r in speed] == [
        ("NARX 1/1/5", 0.1917),
        ("NARX 1/1/9", 0.1935),
        ("NARX 1/1/13", 0.194),
        ("NARX 1/1/8", 0.1945),
        ("NARX 1/1/12", 0.195),
    ]
    table = best_table(record(), "one_step_mse", mse="one_step_mse", published=ranks)
    assert [row[6].replace("\u00a0", " ") for row in texts(table)] == [r.structure for r in ranks]
    assert published_ranks(read_published("lopes-2021"), "STP -> BP", "accuracy") == []


def test_the_winner_stands_beside_what_was_chosen_by_hand_on_unseen_cases() -> None:
    found = record()
    table = beside_table(found)
    assert table is not None
    assert [name for name, _ in table.head] == ["structure", "VAL01", "VAL02", "mean", "selection"]
    winner = found.winning
    assert winner is not None
    mean = (winner.cases["VAL01"].free_run_mse + winner.cases["VAL02"].free_run_mse) / 2
    assert table.rows[0][3].value == pytest.approx(mean)
    assert "did choose" in str(beside_table(record(choose_on="cases")))


def test_the_front_is_what_nobody_beats() -> None:
    found = record()
    points = {t.number: (t.selection_free_run_mse, t.mean("run_time_s")) for t in found.tried_in_full}
    unbeaten = {
        n
        for n, (e, s) in points.items()
        if not any(e2 <= e and s2 <= s and (e2, s2) != (e, s) for e2, s2 in points.values())
    }
    assert {t.number for t in found.front()} == unbeaten
    assert 0 < len(unbeaten) < len(points)


def test_names_on_the_front_do_not_meet() -> None:
    rng = np.random.default_rng(0)
    steps = np.cumsum(rng.uniform(0.001, 0.1, 40))
    along = [
        trial(
            n + 1, 1, 1, label=f"NARX 5/5/{n}", selection_free_run_mse=float(np.exp(-s)), cases=timed(1e-3 * np.exp(s))
        )
        for n, s in enumerate(steps)
    ]
    figure = pareto_figure(record(trials=along, winner=1, beside=[], points=40))
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    (axes,) = figure.axes
    boxes = [text.get_window_extent(canvas.get_renderer()) for text in axes.texts]
    assert len(boxes) > 3
    assert {axes.texts[0].get_text(), axes.texts[1].get_text()} == {"NARX 5/5/0", "NARX 5/5/39"}
    assert not [(a, b) for a, b in itertools.combinations(boxes, 2) if a.overlaps(b)]


def timed(seconds: float) -> dict[str, TrialCase]:
    return {"VAL01": TrialCase(role="validation", free_run_mse=1.0, one_step_mse=1.0, run_time_s=seconds)}


def test_what_it_took_is_told() -> None:
    words = dict(texts(cost_table(record())))
    assert words["dropped after 5 iterations on 50% of the record"] == "1"
    assert words["failed, stopped, or not usable"] == "1"


def test_maps_are_over_the_two_longest_ranges() -> None:
    figure = heat_maps(record(), "free_run_mse")
    assert figure is not None
    (image,) = (axes.images[0] for axes in figure.axes if axes.images)
    assert image.get_array().shape == (3, 6)
    assert heat_maps(record(trials=[trial(n, 1, n) for n in range(1, 7)]), "free_run_mse") is None


def test_a_few_trials_are_counted_in_whole_numbers_and_drawn_so_that_they_are_seen() -> None:
    few = record(trials=[trial(n, 1, n) for n in range(1, 4)], winner=1, beside=[])
    axes = over_trials_figure(few, "run_time", title="t").axes[0]
    assert all(float(tick).is_integer() for tick in axes.get_xticks())
    assert axes.lines[0].get_markersize() > 6.0
    parallel = parallel_figure(few)
    assert parallel is not None
    colours = [line.get_color() for line in parallel.axes[0].lines]
    assert max(sum(one[:3]) for one in colours if not isinstance(one, str)) < 2.0, "no pale yellow on white"


@pytest.mark.parametrize(
    "draw", [pareto_figure, parallel_figure, lambda r: over_trials_figure(r, "run_time", title="t")]
)
def test_a_sweep_of_one_trial_is_drawn_too(draw: Any) -> None:
    lone = record(trials=[trial(1, 1, 1)], winner=1, beside=[])
    figure = draw(lone)
    assert figure is None or figure.axes


def test_a_run_with_a_sweep_has_a_section_of_it_and_one_without_has_none(tmp_path: Path) -> None:
    assert sweep_sections(tmp_path, None) == []
    write_sweep(tmp_path, record())
    assert read_sweep(tmp_path).trials[:5] == record().trials[:5]
    (section,) = sweep_sections(tmp_path, read_published("lopes-2021"))
    assert len([part for part in section.parts if hasattr(part, "svg")]) == len(sweep_figures(record())) == 5


def test_the_verdict_tells_what_the_sweep_found_beside_what_is_published_and_what_was_chosen_by_hand(
    tmp_path: Path,
) -> None:
    assert sweep_points(tmp_path, None) == []
    one_step = {"choose_by": "one_step_mse", "choose_on": "cases"}
    trials = [*record().trials, trial(19, 4, 20, label="NARX 4/4/20")]
    best = min((t for t in trials if t.in_full), key=lambda t: t.mean("one_step_mse"))
    found = record(**one_step, trials=trials, winner=best.number)
    write_sweep(tmp_path, found)
    ((keyword, text),) = sweep_points(tmp_path, read_published("lopes-2021"))
    assert keyword == "Sweep"
    text = text.replace("\u00a0", " ")
    ratio = best.mean("one_step_mse") / 2.5176e-5
    assert f"(NARX 4/4/20, Table 4.3): ours is {times(ratio)} that".replace("\u00a0", " ") in text
    for words in ("17 trained in full and usable", "1 dropped before their end", "1 unstable in free run"):
        assert words in text
    assert f"{best.label} has {quantity(mean_not_fitted(best), 'psi²')} on average".replace("\u00a0", " ") in text


def test_the_verdict_calls_no_error_the_least_that_is_not(tmp_path: Path) -> None:
    """A search may choose a smaller model, and its error had been called the least of all."""
    least, other = sorted(record().tried_in_full, key=lambda t: t.selection_free_run_mse)[:2]
    told = {}
    for winner in (least, other):
        write_sweep(tmp_path, record(method="auto", winner=winner.number, beside=[]))
        ((_, text),) = sweep_points(tmp_path, None)
        told[winner.label] = text.replace("\u00a0", " ")
    ours, theirs = (quantity(one.selection_free_run_mse, "psi²").replace("\u00a0", " ") for one in (other, least))
    assert told[least.label].startswith(f"{least.label} has the least free-run mse on what chose, {theirs}, of 18")
    assert told[other.label].startswith(f"{other.label} has a free-run mse on what chose of {ours}, of 18 trials")
    assert f"; {least.label} has the least, {theirs}." in told[other.label]


def test_published_values_are_drawn_at_the_trials_of_their_structures() -> None:
    ranks = published_ranks(read_published("lopes-2021"), "BP+AR -> BC", "accuracy")
    shown = record(trials=[*record().trials, trial(19, 4, 20, label="NARX 4/4/20")])
    for name, value in (("one_step_mse", 2.5176e-5), ("run_time", ranks[0].run_time)):
        (axes,) = over_trials_figure(shown, name, title="t", published=ranks).axes
        (line,) = (line for line in axes.lines if str(line.get_label()).startswith("published"))
        assert list(zip(line.get_xdata(), line.get_ydata(), strict=True)) == [(19, value)]


@pytest.mark.parametrize("text", ["", "{}", '{"schema_version": 99}'], ids=["empty", "no fields", "newer"])
def test_a_damaged_record_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / SWEEP_FILE).write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match="sweep"):
        read_sweep(tmp_path)


def test_the_summary_counts_what_became_of_every_trial() -> None:
    swept = record()
    found = swept.summary
    assert (found.points, found.trials, found.in_full, found.dropped, found.unusable) == (
        18,
        18,
        16,
        1,
        {"UNSTABLE": 1},
    )
    assert swept.winning is not None
    assert (found.winner, found.label, found.unit) == (swept.winner, swept.winning.label, "psi²")
    assert found.least == swept.winning.selection_free_run_mse
    assert found.front == [one.number for one in swept.front()]
    assert record(winner=None).summary.label == ""
