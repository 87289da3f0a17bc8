"""Tables of an assembly: what stands in which row and column, from stored figures."""

from __future__ import annotations

from typing import Any

import pytest

from sysid.reporting.assembly.results import AssemblyResults, EquationRecord
from sysid.reporting.assembly.tables import (
    active_learning_table,
    equation_table,
    limit_check_table,
    limit_table,
    monte_carlo_tables,
    position_table,
    stage_table,
    time_table,
)
from sysid.reporting.sections.fit_tables import export_table
from sysid.reporting.tables import Table


def values(table: Table | None) -> list[list[Any]]:
    """Its numbers, and its words where a cell has none; every row as wide as its head."""
    assert table is not None
    assert {len(row) for row in table.rows} == {len(table.head)}
    return [[cell.text if cell.value is None else cell.value for cell in row] for row in table.rows]


def test_stages_stand_above_what_is_published(results: AssemblyResults) -> None:
    assert values(stage_table(results, "lower")) == [
        ["each alone", 0.5, "diverges", 0.25],
        ["trained end to end (chosen)", 0.25, 0.3, 0.125],
        ["Table 1", "", 0.4, ""],
        ["aimed at: 0.5 of it", "", 0.2, ""],
    ]


def test_run_times_are_told_in_milliseconds_and_for_each_second(results: AssemblyResults) -> None:
    assert values(time_table(results)) == [["A", 300.0, 3.0, 10.0], ["V", 300.0, 6.0, 20.0]]


def test_random_sequences_by_quantile_by_kind_and_by_state(results: AssemblyResults) -> None:
    assert results.monte_carlo is not None
    all_of_them, by_kind, by_state = monte_carlo_tables(results.monte_carlo)
    assert [row[1] for row in values(all_of_them)] == [0.1, 0.6, 0.75, 1, 0.6]
    assert values(by_kind) == [["ramps", 3, 1, 50.0, 0.1, 0.4], ["sine", 2, 0, 100.0, 0.2, 0.3]]
    assert values(by_state) == [["filling", 0.05, 0.3]]


def test_added_data_are_counted_and_each_round_is_put_to_the_random_sequences(results: AssemblyResults) -> None:
    (found,) = results.active_learning
    rows = values(active_learning_table(found, results.whole.stage))
    assert rows == [
        ["0", 0, 2, 120, "", 0.0, 0.2, 0.9, 0.25, 0.0, 5.0],
        ["1 (chosen)", 3, 5, 300, 2.5, 50.0, 0.2, pytest.approx(0.4), 0.125, pytest.approx(10.0), 4.0],
    ]
    assert all(type(value) is int for row in rows for value in row[1:4])


@pytest.mark.parametrize("without", [(0, 1), (0,)])
def test_a_round_that_was_not_put_to_them_has_no_figure(results: AssemblyResults, without: tuple[int, ...]) -> None:
    (found,) = results.active_learning
    rounds = [one.model_copy(update={"monte_carlo": None}) if one.number in without else one for one in found.rounds]
    rows = values(active_learning_table(found.model_copy(update={"rounds": rounds}), ""))
    assert rows[0][9:] == ([] if len(without) == 2 else ["", ""])


def test_what_is_known_stands_as_the_pipeline_has_it() -> None:
    known = [
        EquationRecord(output="RM", unit="psi", equation="RM = clamp(BP - AR, -2, 2)", instances=["", "10"]),
        EquationRecord(output="RL", unit="1", equation="RL = switch(BP - AR)"),
    ]
    assert values(equation_table(known)) == [
        ["RM = clamp(BP - AR, -2, 2)", "psi", "nothing, 10"],
        ["RL = switch(BP - AR)", "", "nothing"],
    ]
    assert values(equation_table(known[1:])) == [["RL = switch(BP - AR)", ""]]
    estimated = known[1].model_copy(update={"equation": "RL = switch(k*BP)", "parameters": {"k": 0.25}})
    assert values(equation_table([known[1], estimated])) == [
        ["RL = switch(BP - AR)", "", ""],
        ["RL = switch(k*BP)", "", "k = 0.25"],
    ]


def test_each_side_of_a_limit_has_a_row(results: AssemblyResults) -> None:
    assert values(limit_table(results.limits)) == [
        ["lower at its lower limit", "0 cm", pytest.approx(100.0 / 6.0), ""],
        ["lower at its upper limit", "rim", 0.0, ""],
    ]


def test_limits_that_are_passed_are_named(results: AssemblyResults) -> None:
    assert results.limit_check is not None
    assert values(limit_check_table(results.limit_check)) == [["rim", "lower (cm)", 2.0, 3.5, "t1"]]
    held = results.limit_check.model_copy(update={"limits": results.limit_check.limits[1:]})
    assert limit_check_table(held) is None


def test_positions_that_were_fitted_are_told_apart(results: AssemblyResults) -> None:
    assert results.interpolation is not None
    one = results.interpolation.outputs["lower"]
    assert values(position_table(one, results.interpolation.run_time_s, "lower")) == [
        ["A", 0.25, 0.25, 4.0, 0.0, 2.0],
        ["V", 0.125, 0.125, 4.0, 0.375, 4.0],
    ]


def test_positions_that_were_all_fitted_leave_nothing_unseen(results: AssemblyResults) -> None:
    assert results.interpolation is not None
    one = results.interpolation.outputs["lower"].model_copy(update={"fitted": [True] * 3})
    assert values(position_table(one, results.interpolation.run_time_s, "lower"))[0][1:4] == ["", "", ""]


def test_exports_are_named_by_their_file(results: AssemblyResults) -> None:
    found = values(export_table([("whole", one) for one in results.exports], "cm"))
    assert found == [["c", "whole", "bundle/model.c", 1e-9, 1e-6, "within tolerance"]]
