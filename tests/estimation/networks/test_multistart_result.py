"""How a multistart ended: said of the state that was chosen, and not of the start that ran longest."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from sysid.estimation.networks.starts.result import multistart_status
from sysid.estimation.results.result import Status


def candidate(number: int, iteration: int, status: Status, cautious: bool = False) -> Any:
    solution = SimpleNamespace(status=status, state=SimpleNamespace(iteration=iteration))
    return SimpleNamespace(number=number, model=None, cautious=cautious, solution=solution)


@pytest.mark.parametrize(
    ("chosen", "others", "ended"),
    [
        ((0, 300, Status.MAX_ITERATIONS), [(1, 30, Status.MAX_ITERATIONS)], Status.MAX_ITERATIONS),
        ((0, 30, Status.MAX_ITERATIONS), [(0, 60, Status.MAX_ITERATIONS)], Status.STOPPED_EARLY),
        ((0, 30, Status.MAX_ITERATIONS), [(1, 300, Status.MAX_ITERATIONS)], Status.STOPPED_EARLY),
        ((0, 30, Status.CONVERGED), [(1, 300, Status.MAX_ITERATIONS)], Status.CONVERGED),
        ((0, 30, Status.TIME_LIMIT), [(1, 300, Status.TIME_LIMIT)], Status.TIME_LIMIT),
        ((0, 30, Status.CONVERGED), [(0, 300, Status.MAX_ITERATIONS, True)], Status.CONVERGED),
    ],
    ids=["ran out", "did better before", "given up for others", "a minimum", "no time", "beside a cautious fit"],
)
def test_iterations_ran_out_only_where_there_were_no_more(
    chosen: tuple[int, int, Status], others: list[tuple[Any, ...]], ended: Status
) -> None:
    best = candidate(*chosen)
    assert multistart_status(best, [best, *(candidate(*one) for one in others)], [], interrupted=False) is ended
