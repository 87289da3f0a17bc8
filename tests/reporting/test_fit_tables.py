"""What is drawn of many cases."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sysid.reporting.sections.fit_tables import drawn_cases, told_of_drawn, worst_case
from sysid.traces import Role


@pytest.mark.parametrize(
    ("test", "estimation", "most", "expected"),
    [
        *((4, 8, 12, (4, 8)), (4, 9, 12, (4, 8)), (20, 30, 12, (8, 4)), (20, 2, 12, (10, 2)), (0, 40, 12, (0, 12))),
        *((40, 0, 12, (12, 0)), (20, 30, 3, (2, 1)), (1, 9, 4, (1, 3)), (5, 5, 1, (1, 0))),
    ],
)
def test_of_many_cases_the_worst_are_drawn_those_that_were_not_fitted_first(
    test: int, estimation: int, most: int, expected: tuple[int, int]
) -> None:
    roles = [Role.TEST] * test + [Role.ESTIMATION] * estimation
    errors = np.random.default_rng(0).permutation(len(roles)).astype(float)
    cases = {
        f"c{k}": SimpleNamespace(role=role, free_run=SimpleNamespace(mse=errors[k])) for k, role in enumerate(roles)
    }
    cases["c0"].free_run.mse = np.nan  # it diverged
    fit: Any = SimpleNamespace(cases=cases)
    drawn = drawn_cases(fit, most)
    assert drawn == [name for name in cases if name in drawn]
    for role, count in zip((Role.TEST, Role.ESTIMATION), expected, strict=True):
        own = [name for name in cases if cases[name].role is role]
        own.sort(key=lambda name: -np.nan_to_num(cases[name].free_run.mse, nan=np.inf))
        assert {name for name in drawn if cases[name].role is role} == set(own[:count])
    assert worst_case(fit) in drawn
    assert bool(told_of_drawn(len(drawn), len(cases))) is (len(cases) > most)
