"""A round that trains everywhere: one set of weights for all places, each trace as one place sees it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sysid.composite.fixed_members import known_model, with_known
from sysid.composite.members import assembled
from sysid.composite.round import JointRound
from sysid.composite.shared_weights import Everywhere
from sysid.composite.stages import reading_more
from sysid.errors import ConfigError
from sysid.models import Cascade, Mapping
from sysid.traces import Channel, Trace
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.yaml_files import check, parse_yaml
from tests.models.cascades import network

LINE = """\
kind: assembly
name: line
data: cases
training: excitation
outputs: [BP, AR]
members:
  - {mapping: STP -> BP, structure: {kind: NARX, input_delays: [0, 1, 3], output_delays: 2, neurons: 3}, rest: 90}
  - {mapping: BP -> BP9, structure: {kind: NARX, input_delays: [0, 1, 3], output_delays: 2, neurons: 3}, rest: 90}
  - mapping: BP+STP -> AR
    structure: {kind: NARX, input_delays: [0, 1, 3], output_delays: 2, neurons: 3}
    rest: 90
    places: ["", "9"]
    shared: [STP]
  - mapping: BP+AR+RL -> BC
    structure: {kind: NARX, input_delays: [0, 1, 3], output_delays: 2, neurons: 3}
    rest: 0
    places: ["", "9"]
known:
  - {mapping: BP+AR -> RL, gains: {BP: 1, AR: -1, RL: 3}, constant: -1, low: 0, high: 1, rest: 0, places: ["", "9"]}
together:
  members: [AR, BC]
  everywhere: true
  targets: {AR: 1, BC: 1}
  training: {max_iterations: 2, looks: 1, workers: 1}
"""


def config(*changes: tuple[str, str]) -> AssemblyConfig:
    text = LINE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return check(AssemblyConfig, parse_yaml(text, where="text"), where="text")


def trace(seed: int) -> Trace:
    rng = np.random.default_rng(seed)
    names = ("STP", "BP", "AR", "BC", "BP9", "AR9", "BC9")
    values = rng.uniform(60.0, 90.0, (120, len(names)))
    channels = tuple(Channel(name=name, unit="psi") for name in names)
    (seen,) = with_known(config().known, [Trace(name=f"t{seed}", sample_time=0.1, channels=channels, values=values)])
    return seen


def whole() -> Cascade:
    fitted = {
        "BP": network("STP -> BP", seed=1),
        "BP9": replace(network("STP -> BP", seed=2), mapping=Mapping.parse("BP -> BP9")),
        "AR": network("BP+STP -> AR", seed=3),
        "BC": replace(network("BP+AR+RL -> BC", seed=4), rest_output=0.0),
    }
    declared = {one.mapping.output: known_model(one, trace(0)) for one in config().known}
    units = {name: ("psi", "psi", "1")[: len(model.mapping.inputs)] for name, model in fitted.items()}
    fitted = {name: replace(model, input_units=units[name]) for name, model in fitted.items()}
    return assembled(config(), {**fitted, **declared})


def everywhere(*changes: tuple[str, str]) -> Everywhere:
    asked = config(*changes)
    assert asked.together is not None
    return Everywhere.of(asked, asked.together, whole())


def test_a_declared_member_stands_in_all_its_places_too():
    seen = trace(0)
    assert seen.channel_names[-2:] == ("RL", "RL9")
    swapped = with_known(config().known, [replace(seen, channels=_swapped(seen))])[0]
    assert_array_equal(swapped.values[:, -2:], seen.values[:, [-1, -2]])
    assert whole().member("RL9").mapping.inputs == ("BP9", "AR9")
    assert (whole().limits["RL9"].low, whole().limits["RL9"].high) == (0, 1)


def _swapped(seen: Trace) -> tuple[Channel, ...]:
    other = {"BP": "BP9", "AR": "AR9", "BP9": "BP", "AR9": "AR", "RL": "r", "RL9": "r9"}
    return tuple(replace(one, name=other.get(one.name, one.name)) for one in seen.channels)


def test_one_place_is_run_and_what_comes_from_elsewhere_is_its_input():
    part = everywhere().part
    assert (set(part.inputs), set(part.outputs)) == ({"BP", "STP"}, {"AR", "BC", "RL"})


def test_each_trace_is_as_one_place_sees_it_with_what_the_whole_puts_out_there():
    given = [trace(0), trace(1), trace(2)]
    for number, (seen, of, place) in enumerate(zip(everywhere().traces(given), given, ("", "9", ""), strict=True)):
        ran = whole().simulate_trace(of)
        assert_array_equal(seen["BP"], ran[f"BP{place}"])
        assert_array_equal(seen["STP"], of["STP"])
        for name in ("AR", "BC", "RL"):
            assert_array_equal(seen[name], of[f"{name}{place}"])
        assert seen.name == f"t{number} {place}".strip()


def test_what_is_named_as_measured_is_as_measured_at_its_place():
    given = [trace(0), trace(1)]
    stand = everywhere(("  everywhere: true", "  everywhere: true\n  measured: [BP, RL]"))
    assert set(stand.part.outputs) == {"AR", "BC"}
    for seen, of, place in zip(stand.traces(given), given, ("", "9"), strict=True):
        for name in ("BP", "AR", "BC", "RL"):
            assert_array_equal(seen[name], of[f"{name}{place}"])


def test_after_the_round_every_place_has_the_same_new_weights():
    asked, before = config(), whole()
    assert asked.together is not None
    estimation, selection = [trace(s) for s in range(4)], [trace(5)]
    ready = JointRound.of(asked, asked.together, before, estimation=estimation, selection=selection)
    fit = ready.fit(lambda _: None)
    for name in ("AR", "BC"):
        assert not np.array_equal(fit.model.member(name).theta, before.member(name).theta)
        assert_array_equal(fit.model.member(f"{name}9").theta, fit.model.member(name).theta)
        assert fit.model.member(f"{name}9").mapping == before.member(f"{name}9").mapping
    for name in ("BP", "BP9"):
        assert_array_equal(fit.model.member(name).theta, before.member(name).theta)
    chosen, others = fit.notes
    assert chosen.endswith(f"on the selection traces {ready.error(fit.model):.4g}.")
    assert f" {ready.error(before):.4g} (0)" in others


def test_what_a_member_has_come_to_read_it_reads_at_its_own_place():
    """A circle closed in an earlier round, at the first place alone, stands in all of them after the next."""
    asked, wider = config(), reading_more(whole(), {"AR": {"BC": (1,)}})
    assert asked.together is not None
    stand = Everywhere.of(asked, asked.together, wider)
    found = stand.put(stand.part)
    assert found.member("AR").mapping.inputs == ("BP", "STP", "BC")
    assert found.member("AR9").mapping.inputs == ("BP9", "STP", "BC9")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        pytest.param(("members: [AR, BC]", "members: [BP]"), "cannot be trained everywhere", id="one place"),
        pytest.param(("targets: {AR: 1", "targets: {BP9: 1"), "AR at 2, BP9 elsewhere", id="a target elsewhere"),
        pytest.param(("  members: [AR, BC]\n", ""), "names no members", id="no members"),
    ],
)
def test_what_does_not_stand_in_several_places_is_refused(change, said):
    with pytest.raises(ConfigError, match=said):
        everywhere(change)
