"""What is told of the runs of a reference."""

from __future__ import annotations

from pathlib import Path

from sysid.references.runs import Outcome, ReferenceRuns
from sysid.references.told import reasons_of, unlike
from tests.references.test_runs import CASES, reference


def test_reasons_are_counted() -> None:
    many = [Outcome(case=CASES[0], trace=None, reason=reason) for reason in "abbc"]
    assert reasons_of(many, 2) == "b (2 times); a; and 1 other reasons"
    assert not reasons_of([Outcome(case=CASES[0], trace=None)])
    where = ["y is nan at 2.2 s", "no", "y is nan at 17 s", "y is nan at 1e-5 s", "line 3", "line 12", "u1", "no"]
    many = [Outcome(case=CASES[0], trace=None, reason=reason) for reason in where]
    told = "y is nan at 2.2 s (3 times, with other numbers); no (2 times); line 3; line 12; and 1 other reasons"
    assert reasons_of(many, 4) == told


def test_a_reference_that_does_not_repeat_itself_is_told(tmp_path: Path) -> None:
    """A function may keep what it likes from run to run: a surrogate would be held against records of chance."""
    with ReferenceRuns(config=reference("remembers"), folder=tmp_path, workers=1) as runs:
        told = unlike(runs, runs.run(CASES))
        assert unlike(runs, runs.run(CASES)) is None  # nothing is run
    assert told is not None
    assert "a, run once more, gives another record: y is up to 3 off, in a range of 2.2" in told
    with ReferenceRuns(config=reference("first_order"), folder=tmp_path, workers=1) as runs:
        assert unlike(runs, runs.run(CASES)) is None
