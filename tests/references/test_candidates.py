"""New experiments: round by round others, held-out ones others still, and never the design's own."""

from __future__ import annotations

from sysid.references.candidates import Candidates
from sysid.references.design import Counts, Design, designed
from tests.references.test_design import CONFIG


def test_no_two_rounds_share_an_experiment_nor_does_the_design() -> None:
    design = Design(duration=20.0, runs=Counts(estimation=6, selection=6, test=6))
    new = Candidates(reference=CONFIG, design=design, count=6)
    rounds = [new.cases(number) for number in range(3)]
    own = [case for some in designed(CONFIG, design).values() for case in some]
    every = [case for some in (*rounds, own) for case in some]
    assert len({case.inputs.tobytes() for case in every}) == len({case.name for case in every}) == 36
    assert [case.inputs.tobytes() for case in new.cases(2)] == [case.inputs.tobytes() for case in rounds[2]]
