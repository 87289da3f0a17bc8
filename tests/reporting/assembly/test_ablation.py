"""Ablation in words: whether a step held, and its figures."""

from __future__ import annotations

import pytest

from sysid.reporting.assembly.ablation import CLAIMS, ablation_point, ablation_table, held
from sysid.reporting.assembly.results import AblationComparison, AblationRecord, AssemblyResults

INF, NAN = float("inf"), float("nan")


@pytest.mark.parametrize(
    ("pairs", "verdict"),
    [
        ([(2.0, 1.0), (3.0, 1.0)], "held"),
        ([(2.0, 1.0), (1.0, 3.0)], "held for a only"),
        ([(1.0, 1.0), (1.0, 3.0)], "did not hold"),
        ([(INF, 1.0)], "held"),
        ([(NAN, 1.0)], "held"),
        ([(INF, INF)], "did not hold"),
        ([(1.0, NAN)], "did not hold"),
    ],
)
def test_a_step_holds_as_far_as_its_comparisons_do(pairs: list[tuple[float, float]], verdict: str) -> None:
    parts = [AblationComparison(what="ab"[i], before=b, after=a) for i, (b, a) in enumerate(pairs)]
    step = AblationRecord(step="retrain", comparisons=parts)
    assert held(step) == verdict
    assert ablation_point([step])[1].endswith(f": {verdict}.")


def test_the_table_has_figures_and_says_what_diverges(results: AssemblyResults) -> None:
    first, second = ablation_table(results.ablation).rows
    assert [cell.text for cell in first[2:]] == ["diverges", "1.00", "", "held", "Table 2"]
    assert first[0].text == CLAIMS["close_loop"].text
    assert [cell.value for cell in second[2:4]] == [0.25, 0.5]
