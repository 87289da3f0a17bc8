"""Members: put in their places, fitted on traces of all of them, left out where others are to be heard."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sysid.composite.fixed_members import known_model
from sysid.composite.members import assembled, in_place, own_traces, simulated_inputs, whole_score, written
from sysid.composite.monte_carlo import stress
from sysid.composite.stages import choose_together, reading_more
from sysid.errors import ConfigError
from sysid.models import Mapping, mean_of
from sysid.traces import Channel, Trace
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.views import stress_tables
from sysid.yaml_files import check, parse_yaml
from tests.models.cascades import network
from tests.workbench.assembly.conftest import PIPELINE

TWO_PLACES = """\
kind: assembly
name: train
data: cases
training: excitation
outputs: [BP, AR]
members:
  - {mapping: STP -> BP, structure: {kind: NARX, input_delays: [0, 1, 3], output_delays: 2, neurons: 3}, rest: 90}
  - {mapping: STP -> BP9, structure: {kind: NARX, input_delays: [0, 1, 3], output_delays: 2, neurons: 3}, rest: 90}
  - mapping: BP+STP -> AR
    structure: {kind: NARX, input_delays: [0, 1, 3], output_delays: 2, neurons: 3}
    rest: 90
    places: ["", "9"]
    shared: [STP]
rest: {BP: STP, AR: STP}
limits: {AR: {high: BP}}
"""


def config(text: str = TWO_PLACES) -> AssemblyConfig:
    return check(AssemblyConfig, parse_yaml(text, where="text"), where="text")


def models():
    return {
        "BP": network("STP -> BP", seed=1),
        "BP9": replace(network("STP -> BP", seed=2), mapping=Mapping.parse("STP -> BP9")),
        "AR": network("BP+STP -> AR", seed=3),
    }


def trace(n: int = 120, seed: int = 0) -> Trace:
    rng = np.random.default_rng(seed)
    names = ("STP", "BP", "AR", "BP9", "AR9")
    values = rng.uniform(60.0, 90.0, (n, len(names)))
    values[:, 0] = np.repeat(rng.uniform(64.0, 90.0, n // 20), 20)
    return Trace(
        name="T", sample_time=0.1, channels=tuple(Channel(name=one, unit="psi") for one in names), values=values
    )


def test_a_member_stands_in_all_its_places():
    whole = assembled(config(), models())
    assert set(whole.outputs) == {"BP", "AR", "BP9", "AR9"}
    assert whole.inputs == ("STP",)
    assert whole.member("AR9").mapping.inputs == ("BP9", "STP")
    assert_array_equal(whole.member("AR9").theta, whole.member("AR").theta)
    assert (whole.limits["AR"].high, whole.limits["AR9"].high) == ("BP", "BP9")
    own = assembled(config(TWO_PLACES.replace("limits: {", "limits: {AR9: {low: 0, high: STP}, ")), models())
    assert (own.limits["AR9"].low, own.limits["AR9"].high) == (0, "STP")


def test_a_stage_names_its_networks_where_they_are_others_than_before_and_counts_what_is_declared():
    relay = "known: [{mapping: BP+AR -> RL, gains: {BP: 1, AR: -1}, low: 0, high: 1, rest: 0, places: ['', '9']}]\n"
    asked = config(TWO_PLACES.replace("rest: {BP", f"{relay}rest: {{BP"))
    alone = assembled(asked, {**models(), "RL": known_model(asked.known[0], trace())})
    wider = reading_more(alone, {"AR": {"RL": (1,)}})
    label = alone.member("AR").structure.label
    said = written(asked, {"each alone": alone, "round 1": alone, "round 2": wider, "round 3": wider})
    assert sorted(said["each alone"][:-1]) == sorted(
        f"{one}: {label}" for one in ("STP -> BP", "STP -> BP9", "BP+STP -> AR", "BP9+STP -> AR9")
    )
    assert said["each alone"][-1] == "and 2 that the pipeline declares"
    assert said["round 1"] == said["round 3"] == ["all as before"]
    assert said["round 2"] == [f"BP+STP+RL -> AR: {wider.member('AR').structure.label}", "the rest as before"]


def test_a_mean_of_starts_is_what_it_puts_out_and_what_that_is_of():
    start = assembled(config(), models())
    said = written(config(), {"start 1": start, "mean of starts 1, 2": mean_of([start, start], ["BP", "AR"])})
    assert [one.split(":")[0] for one in said["mean of starts 1, 2"]] == [
        "BP_1+BP_2 -> BP", "AR_1+AR_2 -> AR", "and 8 of the starts",
    ]  # fmt: skip


def test_a_limit_may_be_declared_from_what_it_limits_a_sample_ago():
    text = (
        TWO_PLACES.replace("AR: {high: BP}", "AR: {low: 0, high: AH}")
        + """
known:
  - mapping: AR+BP -> AH
    gains: {AR: {1: 1}, BP: 0}
    constant: 0.4
    low: 0
    high: 91
    rest: 91
    unit: psi
    places: ["", "9"]
"""
    )
    declared = config(text)
    whole = assembled(declared, models() | {"AH": known_model(declared.known[0], trace())})
    assert (whole.limits["AR"].high, whole.limits["AR9"].high) == ("AH", "AH9")
    run = whole.simulate_trace(trace())
    for name in ("AR", "AR9"):
        assert np.diff(run[name]).max() == pytest.approx(0.4), "it rises no faster than declared"


def test_traces_of_a_member_go_through_its_places_in_turn():
    member = config().members[2]
    first, second, third = own_traces(member, [trace(seed=s) for s in range(3)])
    assert first.channel_names == second.channel_names == ("BP", "STP", "AR")
    assert_array_equal(first["BP"], trace(seed=0)["BP"])
    assert_array_equal(second["BP"], trace(seed=1)["BP9"])
    assert_array_equal(second["STP"], trace(seed=1)["STP"])
    assert_array_equal(third["AR"], trace(seed=2)["AR"])
    assert_array_equal(in_place(member, trace(), "9")["AR"], trace()["AR9"])
    weights = np.linspace(0.0, 1.0, len(first))
    assert_array_equal(in_place(member, replace(trace(), weights=weights), "9").weights, weights)


def test_who_reads_a_member_that_is_left_out_reads_what_was_measured():
    others = assembled(config(), models(), without="BP")
    assert others.inputs == ("STP", "BP")
    assert others.limits["AR"].high == "BP"
    (changed,) = simulated_inputs(others, [trace()])
    assert_array_equal(changed["BP"], trace()["BP"])
    assert_allclose(changed["BP9"], others.simulate_trace(trace())["BP9"])


def test_the_whole_chooses_the_candidate_that_it_does_best_with():
    good, whole = models(), assembled(config(), models())
    run = whole.simulate_trace(trace())
    names = trace().channel_names
    values = np.column_stack([run[name] for name in names])
    truth = Trace(name="truth", sample_time=0.1, channels=trace().channels, values=values)
    candidates = {name: [network("STP -> BP", seed=9), good[name]] if name == "BP" else [good[name]] for name in good}
    choice = choose_together(config(), candidates, dict.fromkeys(good, 0), [truth])
    assert choice.members == {"BP": 1, "BP9": 0, "AR": 0}
    assert choice.score == whole_score(whole, [truth], ("BP", "AR"))


def test_stress_counts_what_is_lost_and_names_the_worst():
    whole = assembled(config(), models())
    sequences = [trace(seed=s) for s in range(12)]
    found = stress(whole, sequences, "AR", limit=1e6)
    errors = [np.sqrt(np.mean((whole.simulate_trace(t)["AR"] - t["AR"]) ** 2)) for t in sequences]
    assert found.sequences == 12
    assert found.within == 1.0
    assert found.quantiles[1.0] == pytest.approx(max(errors))
    assert found.worst[0][1] == pytest.approx(max(errors))
    assert len(found.worst) == 10


class Halves:
    """An annotator: the first half of a trace is one state, the second another; a third never occurs."""

    channel, labels = "state", ("early", "never", "late")

    def __call__(self, trace: Trace) -> Trace:
        numbers = np.repeat([0.0, 2.0], len(trace) // 2)
        channels = (*trace.channels, Channel(name="state", unit="1"))
        return replace(trace, channels=channels, values=np.column_stack([trace.values, numbers]))


def test_stress_says_what_the_errors_of_each_state_are():
    whole = assembled(config(), models())
    sequences = [trace(seed=s) for s in range(5)]
    found = stress(whole, sequences, "AR", 1.0, annotator=Halves())
    halves = [((whole.simulate_trace(t)["AR"] - t["AR"]) ** 2).reshape(2, -1).mean(axis=1) ** 0.5 for t in sequences]
    for label, errors in zip(("early", "late"), np.transpose(halves), strict=True):
        assert found.by_state[label][0.5] == pytest.approx(np.median(errors))
        assert found.by_state[label][1.0] == pytest.approx(errors.max())
    assert "never" not in found.by_state
    plain, by_state = stress_tables(found)
    assert [row[0] for row in by_state["rows"]] == ["early", "late"]
    assert "share of sequences under 1 psi" in [row[0] for row in plain["rows"]], "with the output's unit"
    assert stress_tables(stress(whole, sequences, "AR", 1.0)) == [plain]


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        pytest.param("outputs: [upper, lower]", "outputs: [uper]", "which no member writes", id="a stranger scored"),
        pytest.param("members: [lower]", "members: [pump]", "which no member writes", id="a stranger retrained"),
        pytest.param("upper -> lower", "pump -> upper", "two members write one channel", id="a channel twice"),
        pytest.param(
            "{kind: NARX, input_delays: [0], output_delays: 1, neurons: 3}", "{kind: ARX, na: 1, nb: [1], nk: [1]}",
            "is ARX", id="a linear kind",
        ),
    ],
)  # fmt: skip
def test_an_assembly_that_cannot_be_is_refused(old, new, match):
    assert old in PIPELINE
    with pytest.raises(ConfigError, match=match):
        config(PIPELINE.replace(old, new))


def test_a_round_that_trains_a_stranger_is_refused():
    with pytest.raises(ConfigError, match="together, members names BQ, which no member writes"):
        config(TWO_PLACES + "together: {targets: {AR: 1}, again: [{members: [AR]}, {members: [BQ]}]}\n")
