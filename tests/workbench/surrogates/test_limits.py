"""What limits a surrogate: told by how it does on what was fitted beside what was not, and how its training ended."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sysid.traces import Role
from sysid.workbench.surrogates.limits import limits


def shown(share: float, count: int = 200) -> Any:
    return SimpleNamespace(
        share=share, errors=np.zeros((count, 2)), tolerance=0.01, outputs=("a", "b"), spans=np.array([10.0, 2.0])
    )


def searched(hurried: str = "", *, spent: bool = False) -> Any:
    return SimpleNamespace(hurried=hurried, spent=spent, record=SimpleNamespace(trials=[None, None]))


def results(status: str, fitted: float) -> Any:
    """Ten experiments that were fitted, so many within 1 % of the ranges 10 and 2, and one that chose."""

    def fit(output: str, span: float) -> SimpleNamespace:
        errors = [0.005 * span if k < 10 * fitted else 0.02 * span for k in range(10)]
        cases = {
            f"E{k}": SimpleNamespace(role=Role.ESTIMATION, free_run=SimpleNamespace(mse=e**2))
            for k, e in enumerate(errors)
        }
        cases["S"] = SimpleNamespace(role=Role.SELECTION, free_run=SimpleNamespace(mse=1e9))
        return SimpleNamespace(name=f"found, {output}", label="NSS 2/8", status=status, cases=cases)

    systems = [SimpleNamespace(fits={"a": "found, a", "b": "found, b"})]
    return SimpleNamespace(fits=[fit("a", 10.0), fit("b", 2.0)], systems=systems, best=SimpleNamespace(name="found, a"))


@pytest.mark.parametrize(
    ("status", "fitted", "share", "limit"),
    [
        ("CONVERGED", 1.0, 0.6, "data: 100 % of the experiments that were fitted are within 1 %, and 60 % of new ones"),
        ("TIME_LIMIT", 1.0, 0.6, "data: "),
        ("TIME_LIMIT", 0.6, 0.58, "time: NSS 2/8 still gained when its training had to end, and 60 % of the"),
        ("MAX_ITERATIONS", 0.3, 0.3, "time: "),
        ("CONVERGED", 0.6, 0.58, "structure: the training of NSS 2/8 had come to its end, and 60 % of the"),
        ("STALLED", 0.0, 0.0, "structure: "),
    ],
)
def test_what_limits_it_is_told_with_what_helps(status: str, fitted: float, share: float, limit: str) -> None:
    (said,) = limits(results(status, fitted), shown(share))
    assert said.startswith(f"what limits it is {limit}")
    assert "help" in said or "write what you know as equations" in said


def test_nothing_limits_what_is_good_enough_and_nothing_is_said_where_nobody_knows() -> None:
    assert limits(results("TIME_LIMIT", 1.0), shown(0.995)) == []
    unknown = results("CONVERGED", 0.5)
    unknown.best = None
    assert limits(unknown, shown(0.5)) == []


def test_where_there_was_no_time_for_a_search_its_structure_is_not_blamed() -> None:
    for iterations in (None, 50):
        assert limits(results("CONVERGED", 0.0), shown(0.0), searched=searched("no time"), iterations=iterations) == []


def test_nor_is_it_where_the_budget_ended_the_search() -> None:
    (said,) = limits(results("CONVERGED", 0.0), shown(0.0), searched=searched(spent=True))
    assert said.startswith("what limits it is the search, which ended after 2 trials as its budget was spent")
    assert "More --minutes try other structures" in said
    (said,) = limits(results("CONVERGED", 0.0), shown(0.0), searched=searched())
    assert said.startswith("what limits it is structure")


def test_a_budget_of_iterations_is_not_called_time() -> None:
    (said,) = limits(results("MAX_ITERATIONS", 0.3), shown(0.3), searched=searched(), iterations=500)
    assert said.startswith("what limits it is its iterations")
    assert said.endswith("More than 500 iterations help")
    (said,) = limits(results("CONVERGED", 0.3), shown(0.3), searched=searched(spent=True), iterations=500)
    assert "More than 500 iterations try other structures" in said
    assert "--minutes" not in said
