"""Weight sharing: one set of weights for all instances, each trace as one instance sees it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sysid.composite.composite import Composite
from sysid.composite.fixed_members import fixed_model, with_fixed
from sysid.composite.members import assembled
from sysid.composite.plan import RoundPlan
from sysid.composite.rounds.round import JointRound
from sysid.composite.rounds.shared_weights import SharedWeights
from sysid.composite.stages import reading_more
from sysid.errors import ConfigError
from sysid.estimation import JointTraining
from sysid.models import Cascade, Limit, Mapping
from sysid.traces import Channel, Trace
from tests.composite.composites import fixed, member
from tests.models.cascades.cascades import network

ROUND = RoundPlan(
    members=("AR", "BC"),
    share_weights=True,
    targets={"AR": 1.0, "BC": 1.0},
    training=JointTraining(max_iterations=2, checkpoints=1, workers=1),
)
BOTH = ("", "9")
LINE = Composite(
    members=(
        member("STP -> BP"),
        member("BP -> BP9"),
        member("BP+STP -> AR", instances=BOTH, shared=("STP",)),
        member("BP+AR+RL -> BC", 0.0, instances=BOTH),
    ),
    fixed=(fixed("BP+AR -> RL", gains={"BP": 1, "AR": -1, "RL": 3}, constant=-1, instances=BOTH),),
)


def trace(seed: int) -> Trace:
    rng = np.random.default_rng(seed)
    names = ("STP", "BP", "AR", "BC", "BP9", "AR9", "BC9")
    values = rng.uniform(60.0, 90.0, (120, len(names)))
    channels = tuple(Channel(name=name, unit="psi") for name in names)
    (seen,) = with_fixed(LINE.fixed, [Trace(name=f"t{seed}", sample_time=0.1, channels=channels, values=values)])
    return seen


def whole() -> Cascade:
    fitted = {
        "BP": network("STP -> BP", seed=1),
        "BP9": replace(network("STP -> BP", seed=2), mapping=Mapping.parse("BP -> BP9")),
        "AR": network("BP+STP -> AR", seed=3),
        "BC": replace(network("BP+AR+RL -> BC", seed=4), rest_output=0.0),
    }
    declared = {one.output: fixed_model(one, trace(0)) for one in LINE.fixed}
    units = {name: ("psi", "psi", "1")[: len(model.mapping.inputs)] for name, model in fitted.items()}
    fitted = {name: replace(model, input_units=units[name]) for name, model in fitted.items()}
    return assembled(LINE, {**fitted, **declared})


def shared(**changes) -> SharedWeights:
    return SharedWeights.of(LINE, replace(ROUND, **changes), whole())


@pytest.mark.parametrize(
    ("limits", "got"),
    [
        ({"AR": Limit(low=0.0), "AR9": Limit(low=5.0)}, "low 5"),
        ({"AR": Limit(high="BP"), "AR9": Limit(high="BP")}, "high BP"),
        ({"AR9": Limit(low=5.0)}, "low 5"),
    ],
)
def test_instances_that_share_weights_have_the_same_limits(limits: dict[str, Limit], got: str):
    with pytest.raises(ConfigError, match="different limits") as told:
        SharedWeights.of(replace(LINE, limits=limits), ROUND, whole())
    assert told.value.got.startswith(got)
    same = {"AR": Limit(high="BP"), "AR9": Limit(high="BP9")}
    assert SharedWeights.of(replace(LINE, limits=same), ROUND, whole()).instances == BOTH


def test_a_declared_member_stands_in_all_its_places_too():
    seen = trace(0)
    assert seen.channel_names[-2:] == ("RL", "RL9")
    swapped = with_fixed(LINE.fixed, [replace(seen, channels=_swapped(seen))])[0]
    assert_array_equal(swapped.values[:, -2:], seen.values[:, [-1, -2]])
    assert whole().member("RL9").mapping.inputs == ("BP9", "AR9")
    assert (whole().limits["RL9"].low, whole().limits["RL9"].high) == (0, 1)


def _swapped(seen: Trace) -> tuple[Channel, ...]:
    other = {"BP": "BP9", "AR": "AR9", "BP9": "BP", "AR9": "AR", "RL": "r", "RL9": "r9"}
    return tuple(replace(one, name=other.get(one.name, one.name)) for one in seen.channels)


def test_one_place_is_run_and_what_comes_from_elsewhere_is_its_input():
    part = shared().part
    assert (set(part.inputs), set(part.outputs)) == ({"BP", "STP"}, {"AR", "BC", "RL"})


def test_each_trace_is_as_one_place_sees_it_with_what_the_whole_puts_out_there():
    given = [trace(0), trace(1), trace(2)]
    for number, (seen, of, place) in enumerate(zip(shared().traces(given), given, ("", "9", ""), strict=True)):
        ran = whole().simulate_trace(of)
        assert_array_equal(seen["BP"], ran[f"BP{place}"])
        assert_array_equal(seen["STP"], of["STP"])
        for name in ("AR", "BC", "RL"):
            assert_array_equal(seen[name], of[f"{name}{place}"])
        assert seen.name == f"t{number} {place}".strip()


def test_what_is_named_as_measured_is_as_measured_at_its_place():
    given = [trace(0), trace(1)]
    stand = shared(measured=("BP", "RL"))
    assert set(stand.part.outputs) == {"AR", "BC"}
    for seen, of, place in zip(stand.traces(given), given, ("", "9"), strict=True):
        for name in ("BP", "AR", "BC", "RL"):
            assert_array_equal(seen[name], of[f"{name}{place}"])


def test_after_the_round_every_place_has_the_same_new_weights():
    before = whole()
    estimation, selection = [trace(s) for s in range(4)], [trace(5)]
    ready = JointRound.of(LINE, ROUND, before, estimation=estimation, selection=selection)
    fit = ready.put(ready.fit())
    for name in ("AR", "BC"):
        assert not np.array_equal(fit.model.member(name).theta, before.member(name).theta)
        assert_array_equal(fit.model.member(f"{name}9").theta, fit.model.member(name).theta)
        assert fit.model.member(f"{name}9").mapping == before.member(f"{name}9").mapping
    for name in ("BP", "BP9"):
        assert_array_equal(fit.model.member(name).theta, before.member(name).theta)
    (chosen,) = [one for one in fit.attempts if one.chosen]
    assert chosen.selection_mse == pytest.approx(ready.error(fit.model))
    assert fit.attempts[0].selection_mse == pytest.approx(ready.error(before))


def test_what_a_member_has_come_to_read_it_reads_at_its_own_place():
    """A circle closed in an earlier round, at the first place alone, stands in all of them after the next."""
    stand = SharedWeights.of(LINE, ROUND, reading_more(whole(), {"AR": {"BC": (1,)}}))
    found = stand.put(stand.part)
    assert found.member("AR").mapping.inputs == ("BP", "STP", "BC")
    assert found.member("AR9").mapping.inputs == ("BP9", "STP", "BC9")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        pytest.param({"members": ("BP",)}, "cannot share their weights", id="one instance"),
        pytest.param({"targets": {"BP9": 1.0}}, "AR at 2, BP9 elsewhere", id="a target elsewhere"),
        pytest.param({"members": None}, "names no members", id="no members"),
    ],
)
def test_what_does_not_stand_in_several_instances_is_refused(change, said):
    with pytest.raises(ConfigError, match=said):
        shared(**change)
