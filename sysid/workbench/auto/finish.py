"""What a search takes once its model is found: scores, export and report. They are not bounded, and told before."""

from __future__ import annotations

import time
from functools import cache

import numpy as np

from sysid.reporting.sections.fit_tables import DRAWN

FINISHING_S, OUTPUT_S, PICTURE_S = 4.0, 3.0, 0.2
"""Processor seconds that scores, export and what has to be loaded for them take, those of each output, and each picture
of the report, on a machine that takes :data:`DRAWING_S` for one picture."""
PAGE_S = 2.0
"""Of that, what the page alone takes beside its pictures."""
DRAWING_S, DRAWN_FOR_IT, SLOWEST_PACE = 0.04, 4, 20.0
"""Processor seconds of a picture that is drawn to measure a machine by, how many are, and how much slower it may be at
most."""
PAGE_SHARE, FEWEST = 0.06, 1
"""Share of the time of a search that pictures of single cases may take, and cases that are drawn in any case."""
SPILL = 0.05
"""Share of the time by which scores, export and report may end after it."""
MOST_KEPT = 0.5
"""Share of the time that is kept for them at most: a search of a minute on a busy machine has to try something."""
PROBE_S, MOST = 0.2, 20.0
"""Processor seconds for which the machine is looked at, and how much slower it may be found at most."""


def drawn_in(wall_s: float | None, outputs: int) -> int:
    """How many cases are drawn: of five outputs all pictures would take longer than a search of a minute.

    Args:
        wall_s: Seconds of the search; ``None`` where iterations are counted.
        outputs: Of each record.

    Returns:
        Cases of each output, :data:`FEWEST` to :data:`~sysid.reporting.sections.fit_tables.DRAWN`.

    Example:
        >>> drawn_in(30.0, 1), drawn_in(30.0, 5), drawn_in(300.0, 5)
        (4, 1, 9)
    """
    if wall_s is None:
        return DRAWN
    return int(min(max(PAGE_SHARE * wall_s / (2.0 * PICTURE_S * outputs), FEWEST), DRAWN))


def finish_s(
    records: int, outputs: int, wall_s: float | None = None, *, drawn: int | None = None, slowed: float | None = None,
    paced: float | None = None,
) -> float:  # fmt: skip
    """About how long scores, export and report take.

    Args:
        records: Of the data; the report draws so many of them as :func:`drawn_in` says.
        outputs: Of each.
        wall_s: Seconds of the search; ``None`` where iterations are counted.
        drawn: Cases of each output that are drawn, where that was said.
        slowed: How many times as long a second of work takes; measured now by default.
        paced: How many times as much work it is as where the constants were measured; measured by default.

    Returns:
        Seconds by the clock.

    Example:
        >>> round(finish_s(20, 2, slowed=1.0, paced=1.0), 3)
        19.6
    """
    work = FINISHING_S + outputs * OUTPUT_S + _pictures_s(records, outputs, drawn or drawn_in(wall_s, outputs))
    return (slowness() if slowed is None else slowed) * (pace() if paced is None else paced) * work


def page_s(records: int, outputs: int, wall_s: float | None = None) -> float:
    """About how long the report takes, beside what else the machine does now.

    Args:
        records: As for :func:`finish_s`.
        outputs: Likewise.
        wall_s: Likewise.

    Returns:
        Seconds by the clock.
    """
    return slowness() * pace() * (PAGE_S + _pictures_s(records, outputs, drawn_in(wall_s, outputs)))


def _pictures_s(records: int, outputs: int, drawn: int) -> float:
    """Processor seconds of a gallery of all models, and of each model by itself."""
    return PICTURE_S * 2.0 * min(records, drawn) * outputs


@cache
def pace() -> float:
    """How much processor time this machine takes, as a picture shows that is drawn now, once in a process.

    The least of a few: for the first, fonts are looked for and much is loaded, and in one of the next all that was
    loaded is searched for garbage, which takes twice as long as the picture.

    Returns:
        Times that of the machine on which the constants were measured.
    """
    from sysid.reporting.figures.fit_figures import case_figure
    from sysid.reporting.figures.svg import svg

    x, seconds = np.linspace(0.0, 1.0, 600), list[float]()
    for _ in range(DRAWN_FOR_IT):
        began = time.process_time()
        figure = case_figure(x, np.sin(9.0 * x), np.cos(9.0 * x), title="pace", label="y", unit="")
        svg(figure, title="pace", description="pace", name="pace")
        seconds.append(time.process_time() - began)
    return min(min(seconds) / DRAWING_S, SLOWEST_PACE)


def slowness() -> float:
    """How many seconds by the clock a second of this process's work takes, beside what else the machine does.

    Returns:
        1 on a quiet machine.
    """
    wall, cpu = time.perf_counter(), time.process_time()
    while (worked := time.process_time() - cpu) < PROBE_S:
        pass
    return min(max(1.0, (time.perf_counter() - wall) / worked), MOST)


def time_told(wall_s: float, finish: float) -> str:
    """What a search's time is for, in words, before it begins.

    Args:
        wall_s: Seconds of the search.
        finish: Of scores, export and report, as :func:`finish_s` says.

    Returns:
        A sentence; where these take more than a search leaves them, how long all will take, and what would do.

    Example:
        >>> time_told(600.0, 20.0)
        'Time: 10.0 min at most, about 20 s of it for scores, export and report.'
        >>> time_told(30.0, 60.0).splitlines()[1]
        'The search ends after half of the time, and the command after some 75 s: give it 2.0 min or more.'
    """
    most = MOST_KEPT * wall_s
    if finish <= most + SPILL * wall_s:
        return f"Time: {span(wall_s)} at most, about {span(finish)} of it for scores, export and report."
    enough = span(max(90.0, finish / MOST_KEPT))
    return (
        f"Time: {span(wall_s)} are too few on this machine as busy as it is: scores, export and report alone take "
        f"about {span(finish)}.\nThe search ends after half of the time, and the command after some "
        f"{span(wall_s - most + finish)}: give it {enough} or more."
    )


def span(seconds: float) -> str:
    """A time in words.

    Args:
        seconds: The time.

    Returns:
        Minutes, or seconds of less than one and a half.

    Example:
        >>> span(200.0), span(35.0)
        ('3.3 min', '35 s')
    """
    return f"{seconds / 60.0:.1f} min" if seconds >= 90.0 else f"{seconds:.0f} s"
