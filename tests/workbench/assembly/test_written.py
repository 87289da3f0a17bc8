"""What a whole is made of, stage by stage."""

from __future__ import annotations

from sysid.composite.fixed_members import fixed_model
from sysid.composite.members import assembled
from sysid.composite.stages import reading_more
from sysid.workbench.assembly.written import written
from tests.composite.composites import fixed, models, pipe, trace


def test_a_stage_names_its_networks_where_they_are_others_than_before_and_counts_what_is_declared():
    relay = fixed("BP+AR -> RL", gains={"BP": 1, "AR": -1}, instances=("", "9"))
    asked = pipe(fixed=(relay,))
    alone = assembled(asked, {**models(), "RL": fixed_model(relay, trace())})
    wider = reading_more(alone, {"AR": {"RL": (1,)}})
    label = alone.member("AR").structure.label
    said = written(asked, {"each alone": alone, "round 1": alone, "round 2": wider, "round 3": wider})
    assert sorted(said["each alone"][:-1]) == sorted(
        f"{one}: {label}" for one in ("STP -> BP", "STP -> BP9", "BP+STP -> AR", "BP9+STP -> AR9")
    )
    assert said["each alone"][-1] == "and 2 that the pipeline declares"
    assert said["round 1"] == said["round 3"] == ["all as before"]
    assert said["round 2"] == [f"BP+STP+RL -> AR: {wider.member('AR').structure.label}", "the rest as before"]
