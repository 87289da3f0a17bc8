"""The rounds of training end to end as a table: a row each, and what their fits said folded away below."""

from __future__ import annotations

from typing import Any

import pytest

from sysid.estimation import Status
from sysid.reporting.assembly.results import AssemblyResults
from sysid.reporting.assembly.rounds import rounds_table


def test_a_row_has_the_figures_of_its_round(results: AssemblyResults) -> None:
    table = rounds_table(results.rounds)
    (row,) = table.rows
    assert [cell.text if cell.value is None else cell.value for cell in row] == [
        "1", "upper, lower", "", 2, 4, 1.5, 2.0, 0.25, 0.125, "stopped early",
    ]  # fmt: skip
    assert table.folded == ("Round 1: Chosen by the selection traces.", f"Round 1: {Status.STOPPED_EARLY.value}")


@pytest.mark.parametrize(
    ("changes", "column", "said"),
    [
        ({"name": "2.1 of active learning"}, 0, "2.1 of active learning"),
        ({"trained": ["AR", "BC"], "all_instances": True}, 1, "AR, BC, in all instances"),
        ({"measured": ["BP", "AR", "ER"]}, 2, "BP, AR, ER"),
        ({"measured": ["BP", "AR", "ER", "VO"]}, 2, "4 outputs"),
        ({"loss": float("nan")}, 6, ""),
        ({"status": "NOT_IMPROVED"}, 9, "not improved"),
    ],
)
def test_a_cell_says_which_start_it_was_names_a_few_outputs_and_counts_many(
    results: AssemblyResults, changes: dict[str, Any], column: int, said: str
) -> None:
    (row,) = rounds_table([results.rounds[0].model_copy(update=changes)]).rows
    assert row[column].text == said
