"""What a surrogate is made from and how its time is shared, before anything is run or written."""

from __future__ import annotations

from pathlib import Path

import pytest

from sysid.errors import ConfigError
from sysid.references.config import ReferenceConfig
from sysid.references.described import Wish
from sysid.references.design import Design
from sysid.references.sources import source_of
from sysid.workbench.surrogates.plan import affordable, times, written
from tests.workbench.surrogates.test_proof import REFERENCE


def test_a_reference_that_never_gives_a_record_is_refused_before_anything_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path / "cache"))
    (tmp_path / "bug.py").write_text("def bug(time, inputs, parameters):\n    return inputs[:, 3]\n", encoding="utf-8")
    wish = Wish(ranges={"u": (0.0, 2.0)}, parameters={}, outputs=("y",), sample_time=0.5, duration=20.0)
    with pytest.raises(ConfigError, match="gave no record of 3 experiments") as caught:
        written(source_of(f"{tmp_path / 'bug.py'}:bug"), wish, tmp_path / "out", minutes=1.0, workers=1, seed=0)
    assert "out of bounds for axis 1 with size 1 (bug.py, line 2) (3 times)" in str(caught.value.got)
    assert not (tmp_path / "out").exists()


def test_a_search_has_the_time_that_experiments_proof_and_report_leave_and_what_takes_longer_is_told() -> None:
    given = {"minutes": 5.0, "spent": 20.0, "workers": 2, "finish": 35.0}
    plan = times(0.03, experiments=1000, **given)
    assert plan.spent + plan.search + plan.finish + plan.proof == 300.0
    assert plan.sentence(1000).endswith("15 s for 1,000 experiments of the proof.")
    assert plan.sentence(20, 1000).endswith("15 s for 20 experiments of the proof or more.")
    slow = times(6.0, experiments=1000, **given)
    assert slow.search == 0.4 * 300.0
    assert "about 52.9 min in all, more than the 5.0 min that were asked for. Fewer experiments" in slow.sentence(1000)
    little = times(0.001, experiments=20, **{**given, "minutes": 0.5})
    assert little.sentence(20).endswith("that were asked for. There is room for it in more --minutes.")
    busy = times(0.001, experiments=20, slowed=12.0, **{**given, "minutes": 0.5})
    assert busy.sentence(20).endswith("The machine is busy: a second of work takes 12 s now.")


def test_what_a_search_keeps_for_itself_where_scores_and_report_take_longer_is_in_what_is_told() -> None:
    """24 s were told, and 46 s were taken: a search gives no more than half of its time to what follows it."""
    plan = times(0.001, minutes=1.0, spent=23.0, experiments=20, workers=1, finish=69.0)
    assert (plan.shared, plan.search) == (93.0, 46.5)
    assert "46 s for a model, 69 s for scores" in plan.sentence(20)
    assert "about 2.3 min in all" in plan.sentence(20)


def test_a_proof_that_was_asked_for_takes_its_time_beside_the_minutes_and_is_told_before() -> None:
    given = {"minutes": 1.0, "spent": 5.0, "workers": 1, "finish": 15.0, "apart": True}
    plan = times(0.05, experiments=1000, **given)
    assert (plan.proof, plan.search, plan.asked) == (50.0, 40.0, 110.0)
    assert plan.sentence(1000).endswith(
        "15 s for scores, export and report, and, on top of them, 50 s for the 1,000 experiments that --proof asks "
        "for: about 1.8 min in all."
    )
    late = times(0.05, experiments=1000, **{**given, "spent": 60.0})
    assert "about 2.5 min in all, more than the 60 s that were asked for. There is room" in late.sentence(1000)


@pytest.mark.parametrize(("minutes", "count"), [(0.5, 16), (1.0, 24), (60.0, 60)])
def test_no_more_experiments_are_asked_for_than_trials_fit_in_the_time(
    minutes: float, count: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Of a minute, ninety records took the search all that it had: their look, scores and pictures."""
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path))
    config = ReferenceConfig.model_validate(REFERENCE)
    design = Design.model_validate({"duration": 250.0})
    found = affordable(config, design, minutes=minutes, workers=2)
    assert (found.estimation, found.selection, found.test) == (count, count // 4, count // 4)


def test_what_a_first_run_has_to_load_is_no_time_of_the_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight experiments of sixty were afforded for a reference that is compiled as it is called first."""
    monkeypatch.setenv("SYSID_CACHE", str(tmp_path / "cache"))
    (tmp_path / "loads.py").write_text(
        "import time\n\nLOADED = []\n\n\ndef loads(t, u, p):\n"
        "    if not LOADED:\n        LOADED.append(time.sleep(2.5))\n    return u\n",
        encoding="utf-8",
    )
    fields = {**REFERENCE, "python": "loads:loads", "folder": str(tmp_path)}
    design = Design.model_validate({"duration": 250.0})
    found = affordable(ReferenceConfig.model_validate(fields), design, minutes=1.0, workers=1)
    assert found.estimation == 24
