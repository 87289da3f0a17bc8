"""Tables of the report that are made of what a whole was put to."""

from __future__ import annotations

from sysid.composite.limit_check import LimitCheck, Passed
from sysid.composite.members import assembled
from sysid.composite.monte_carlo import stress
from sysid.workbench.assembly.views import limits_table, stress_tables
from tests.composite.composites import models, pipe, trace
from tests.composite.test_monte_carlo import Halves


def test_states_have_a_table_of_their_own():
    whole, sequences = assembled(pipe(), models()), [trace(seed=s) for s in range(5)]
    plain, by_state = stress_tables(stress(whole, sequences, "AR", 1.0, annotator=Halves()))
    assert [row[0] for row in by_state["rows"]] == ["early", "late"]
    assert "share of sequences under 1 psi" in [row[0] for row in plain["rows"]], "with the output's unit"
    assert stress_tables(stress(whole, sequences, "AR", 1.0)) == [plain]


def test_a_limit_that_the_traces_pass_is_a_row():
    passed = Passed(output="level", limit="most", most=2.0, summed=3.5, trace="t1", unit="cm")
    table = limits_table(LimitCheck(limits=(passed,), traces=3))
    assert table["rows"] == [["most", "level (cm)", 2.0, 3.5, "t1"]]
