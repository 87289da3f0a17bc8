"""Of the best trials the first whose free run is stable, and of those alike one that forgets where it began."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from sysid.estimation import Loop, Status
from sysid.workbench.sweep.checks import Checks


def checks(monkeypatch: pytest.MonkeyPatch, found: list[tuple[Status, int]]) -> Checks:
    """Checks of trials of which it is said how their free run ended, and on how many sequences it does not forget."""
    bench: Any = SimpleNamespace(stability=SimpleNamespace(choose=True))
    one = Checks(driver=SimpleNamespace(), bench=bench)  # type: ignore[arg-type]
    fits = [
        SimpleNamespace(status=status, stability={"apart": apart} if apart else {}, loop=Loop.CLOSED)
        for status, apart in found
    ]
    monkeypatch.setattr(Checks, "_stored", lambda _, trial: [fits[trial.number]])
    monkeypatch.setattr(Checks, "checked", lambda _, trial: [fits[trial.number]])
    return one


GOOD, SWINGS, RUNS_AWAY = (Status.CONVERGED, 0), (Status.CONVERGED, 8), (Status.UNSTABLE, 0)


@pytest.mark.parametrize(
    ("found", "errors", "chosen", "refused"),
    [
        ([GOOD, GOOD], [1.0, 1.1], 0, 0),
        ([RUNS_AWAY, GOOD], [1.0, 9.0], 1, 1),
        ([SWINGS, GOOD], [1.0, 1.3], 1, 0),
        ([SWINGS, GOOD], [1.0, 1.5], 0, 0),  # the plant may swing by itself: one that does not is far worse
        ([SWINGS, RUNS_AWAY, GOOD], [1.0, 1.1, 1.2], 2, 0),
        ([RUNS_AWAY, SWINGS, SWINGS], [1.0, 1.1, 1.2], 1, 1),
    ],
)
def test_the_first_stable_one_and_of_those_alike_one_that_forgets(
    monkeypatch: pytest.MonkeyPatch,
    found: list[tuple[Status, int]],
    errors: list[float],
    chosen: int,
    refused: int,
) -> None:
    ranked: Any = [SimpleNamespace(number=n, selection_free_run_mse=mse) for n, mse in enumerate(errors)]
    winner, passed_over = checks(monkeypatch, found).first_stable(ranked)
    assert (winner.number, passed_over) == (chosen, refused)


def test_one_that_stays_within_the_tolerance_less_often_is_not_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """A charge stays where it was left: a network that forgot was within 1 % nowhere, one before it on two thirds."""
    ranked: Any = [
        SimpleNamespace(number=n, selection_free_run_mse=mse, within=partial(lambda share, _: share, share))
        for n, (mse, share) in enumerate([(0.25, 0.67), (0.19, 0.0), (0.2, 0.8)])
    ]
    one = checks(monkeypatch, [SWINGS, GOOD, GOOD])
    assert one.first_stable(ranked)[0].number == 1
    assert replace(one, tolerance=0.01).first_stable(ranked)[0].number == 2
    assert replace(one, tolerance=0.01).first_stable(ranked[:2])[0].number == 0


def test_a_trial_that_saw_pieces_is_checked_over_the_whole_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of pieces of 94 samples sequences are so short that a run lost its way on none; of the record, on 7 of 60."""
    from sysid.workbench.sweep import checks as module

    asked: list[Any] = []
    fit = SimpleNamespace(status=Status.CONVERGED, stability={"apart": 0}, to_dict=lambda: {"of": "pieces"})

    def checked(one: Any, estimation: Any, _: Any) -> Any:
        asked.append(estimation)
        return one

    monkeypatch.setattr(module, "with_stability", checked)
    monkeypatch.setattr(module.FitResult, "from_dict", lambda _: fit)
    monkeypatch.setattr(Checks, "_stored", lambda *_: [fit])
    bench: Any = SimpleNamespace(
        stability=SimpleNamespace(terms={}), traces=SimpleNamespace(with_role=lambda _: ["pieces"])
    )
    driver: Any = SimpleNamespace(last={1: SimpleNamespace(key="k")}, store=SimpleNamespace(path=tmp_path))
    one: Any = SimpleNamespace(number=1)
    record: Any = SimpleNamespace(digest="d")
    Checks(driver=driver, bench=bench).checked(one)
    assert asked == []  # as the trial was
    Checks(driver=driver, bench=bench, whole=[record]).checked(one)
    assert asked == [[record]]
