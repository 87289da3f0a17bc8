"""What comes after a search has a place in its time: in a short one fewer cases are drawn."""

from __future__ import annotations

import pytest

from sysid.field_checks import check
from sysid.models import ARX
from sysid.reporting.sections.fit_tables import DRAWN
from sysid.workbench.auto.config import AutoConfig
from sysid.workbench.auto.finish import (
    DRAWING_S,
    MOST,
    PICTURE_S,
    SLOWEST_PACE,
    drawn_in,
    finish_s,
    pace,
    slowness,
    time_told,
)

SEARCH = {"kind": "auto", "name": "a", "data": "rig", "mapping": "u -> a+b+c+d+e"}
STRUCTURE = ARX(na=1, nb=(1,), nk=(1,))


@pytest.mark.parametrize(
    ("given", "drawn"),
    [
        ({"minutes": 0.5}, 1),
        ({"minutes": 1.5}, 2),
        ({"minutes": 0.1}, 1),
        ({"minutes": 10.0}, DRAWN),
        ({"iterations": 100}, DRAWN),
        ({"minutes": 0.5, "report": {"drawn": 7}}, 7),
    ],
)
def test_how_many_cases_are_drawn_is_decided_by_the_time_or_said(given: dict[str, object], drawn: int) -> None:
    config = check(AutoConfig, {**SEARCH, **given}, where="here")
    assert config.sweep(STRUCTURE).report.drawn == drawn


def test_pictures_that_are_not_drawn_take_no_time() -> None:
    long, short = finish_s(40, 5, slowed=1.0, paced=1.0), finish_s(40, 5, 30.0, slowed=1.0, paced=1.0)
    assert long - short == pytest.approx(2.0 * PICTURE_S * 5 * (DRAWN - drawn_in(30.0, 5)))


def test_what_follows_is_planned_by_what_this_machine_takes_for_a_picture() -> None:
    assert 0.05 < pace() <= SLOWEST_PACE
    assert pace() == pace(), "measured once"
    now, twice = (finish_s(40, 2, slowed=1.0, paced=times * pace()) for times in (1.0, 2.0))
    assert twice == pytest.approx(2.0 * now)
    assert finish_s(40, 2, slowed=1.0) == now


def test_a_picture_during_which_garbage_is_looked_for_says_nothing_of_the_machine(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls, clock = [0], [0.0]

    def drawn(*_: object, **__: object) -> None:
        calls[0] += 1
        clock[0] += DRAWING_S * (3.0 if calls[0] <= 2 else 1.0)

    monkeypatch.setattr("sysid.reporting.figures.fit_figures.case_figure", drawn)
    monkeypatch.setattr("sysid.reporting.figures.svg.svg", lambda *_, **__: None)
    monkeypatch.setattr("time.process_time", lambda: clock[0])
    assert pace.__wrapped__() == pytest.approx(1.0)


def test_a_time_that_is_too_short_says_how_long_it_takes_and_what_would_do() -> None:
    said = time_told(30.0, 63.0)
    assert "30 s are too few" in said
    assert "after some 78 s: give it 2.1 min or more" in said
    assert "63 s of it" not in said
    assert time_told(600.0, 20.0).startswith("Time: 10.0 min at most, about 20 s of it")


def test_a_second_of_work_takes_a_second_or_more() -> None:
    assert 1.0 <= slowness() <= MOST
