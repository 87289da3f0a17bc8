"""A whole with its doubts: the committee that is made by hand, with its threshold, from what is asked."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.composite import Doubt, Perturbation, committee, doubt_figures, doubt_threshold, doubting, perturbed
from sysid.errors import ConfigError
from tests.composite.test_committee import WHOLES, measured
from tests.composite.test_perturbed import record, valve

TRUTH = [record(top, valve()) for top in (0.5, 0.95, 1.02, 1.5)]


def test_what_is_moved_up_and_down_doubts_each_for_itself() -> None:
    found = doubting(
        valve(0.98), Doubt(output="y", error=1.0, perturb=(Perturbation(channel="u", by=0.1, readers=("R",)),)), TRUTH
    )
    members = [valve(0.98), *(perturbed(valve(0.98), "u", by, readers=["R"]) for by in (0.1, -0.1))]
    threshold = doubt_threshold(members, TRUTH, "y", error=1.0, each=True)
    by_hand = committee(members, {"y": threshold}, each=True)
    assert found.whole.to_dict() == by_hand.to_dict()
    assert found.figures == doubt_figures(by_hand, TRUTH, "y", error=1.0)
    assert f"y in doubt from a difference of {threshold:.3g} " in found.sentence
    u = TRUTH[2]["u"][:, None]
    np.testing.assert_array_equal(found.whole.simulate(u)["y"], valve(0.98).simulate(u)["y"])


def test_wholes_beside_it_are_one_committee() -> None:
    traces = [measured(seed, WHOLES[0]) for seed in (1, 2)]
    found = doubting(WHOLES[0], Doubt(output="AR", error=0.5, false=0.2), traces, beside=WHOLES[1:])
    threshold = doubt_threshold(WHOLES, traces, "AR", error=0.5, false=0.2)
    assert found.whole.to_dict() == committee(WHOLES, {"AR": threshold}).to_dict()
    assert found.figures.false == pytest.approx(0.2, abs=0.01)


def test_nobody_beside_it_is_no_doubt() -> None:
    with pytest.raises(ConfigError, match="not a committee"):
        doubting(valve(), Doubt(output="y", error=1.0), TRUTH)


@pytest.mark.parametrize("asked", [{"error": 0.0}, {"error": 1.0, "false": 0.0}, {"error": 1.0, "false": 1.0}])
def test_what_cannot_be_doubted_is_refused(asked: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match="not what can be doubted"):
        Doubt(output="y", **asked)
