"""What is in a record that a search goes by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sysid.advice import Advice
from sysid.models import ARX, Mapping, NeuralStateSpace, Start, StartKind
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.workbench.auto.families import FAMILIES
from sysid.workbench.auto.look import MOST_SHOWN, Looked, at_ends, in_motion, look, whole_traces
from sysid.workbench.auto.mechanisms import mechanism_of
from sysid.workbench.auto.parts import FEW
from tests.workbench.auto.conftest import data, record

MAPPING, ESTIMATED = Mapping.parse("u -> y"), Start(kind=StartKind.ESTIMATED)


def shifted(trace: Trace, by: float) -> Trace:
    return replace(trace, values=np.asarray(trace.values) + np.array([0.0, by]))


@pytest.fixture(scope="module")
def looked() -> Looked:
    return look(data(record("a", 200), others={Role.TEST: record("t", 50, seed=1)}), MAPPING, ESTIMATED)


def test_orders_dead_time_and_lags_are_found(looked: Looked) -> None:
    assert looked.orders
    assert looked.orders[0].na >= 1
    assert looked.delay >= 0
    assert 2 <= looked.lags <= 6
    assert looked.suggested
    assert 1 <= looked.shown <= MOST_SHOWN


def test_states_that_the_past_shows_are_believed_up_to_twice_those_of_a_free_run() -> None:
    one = Looked(n_inputs=1, n_outputs=1)
    assert [replace(one, states=n, shown=k).needed for n, k in ((2, 12), (4, 7), (5, 3))] == [4, 7, 5]


def test_states_whose_future_the_past_explains_by_half_are_clear() -> None:
    """A motor that turns fast and warms slowly: its linear models are no better for the third state."""
    runs = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        u = np.repeat(rng.uniform(0.0, 1.0, 20), 20)
        fast, slow, y = 0.0, 0.0, np.empty(400)
        for k, level in enumerate(u):
            fast += 0.4 * (level - fast)
            slow += 0.02 * ((level - fast) ** 2 + 0.3 * fast - slow)
            y[k] = fast + 2.0 * slow
        runs.append(replace(record(f"r{seed}", 400), values=np.column_stack([u, y])))
    found = look(data(*runs), MAPPING, Start(kind=StartKind.REST), exact=True)
    assert found.clear == 2
    assert found.exact
    tried = [one.structure for one in FAMILIES[4].first(replace(found, states=1, clear=3))]
    assert [(one.states, one.neurons) for one in tried] == [(3, 8), (3, 16), (4, 12)]  # type: ignore[attr-defined]
    summed = [one.structure for one in FAMILIES[4].first(replace(found, states=1, clear=3, integrators=1))]
    assert [one.integrators for one in summed] == [0, 1, 0, 0], "what looks like a sum is one among others"  # type: ignore[attr-defined]
    assert not FAMILIES[4].adds_up(replace(found, integrators=1))


def test_some_whole_records_are_looked_at_of_many() -> None:
    traces = [record(f"r{k}", 1000) for k in range(30)]
    assert [one.name for one in whole_traces(traces, 8_000)] == ["r0", "r4", "r8", "r12", "r17", "r21", "r25", "r29"]
    assert len(whole_traces(traces, 100)) == FEW
    assert whole_traces(traces, 30_000) is traces


def test_outputs_that_move_before_any_input_does_are_known() -> None:
    u = np.repeat([0.0, 1.0], [10, 30])[:, np.newaxis]
    channels = record("a", 40).channels
    for name, y in (("decays", 5.0 * 0.8 ** np.arange(40)), ("rests", np.minimum(u[:, 0], 0.5))):
        trace = Trace(name=name, sample_time=1.0, channels=channels, values=np.column_stack([u, y]))
        assert bool(in_motion([trace], MAPPING)) is (name == "decays")


def test_outputs_that_stand_at_an_end_while_an_input_moves_on_are_known() -> None:
    u = np.tile(np.linspace(-1.0, 1.0, 40), 5)[:, np.newaxis]
    channels = record("a", 200).channels
    for y, ends in ((np.clip(u[:, 0], -0.5, None), True), (u[:, 0], False)):
        trace = Trace(name="a", sample_time=1.0, channels=channels, values=np.column_stack([u, y]))
        assert set(at_ends([trace], MAPPING).values()) == {ends}


def test_what_is_linear_between_its_events_is_known_with_its_equations() -> None:
    """A charge that is emptied at 1; not where a record may begin anywhere."""
    runs = []
    for k, level in enumerate((1.2, 1.6, 2.0, 2.4, 3.0)):
        y, charge = [], 0.0
        for _ in range(200):
            charge += 0.05 * (level - charge)
            charge = 0.0 if charge >= 1.0 else charge
            y.append(charge)
        runs.append(replace(record("a", 200), name=f"r{k}", values=np.column_stack([np.full(200, level), y])))
    known = data(*runs)
    found = look(known, MAPPING, Start(kind=StartKind.REST)).resets
    assert found is not None
    assert "event_0_0 = on_0_0 >= 1" in found.equations
    assert look(known, MAPPING, ESTIMATED).resets is None
    assert look(data(record("a", 200)), MAPPING, Start(kind=StartKind.REST)).resets is None


def test_what_dry_friction_holds_is_known_with_its_equations() -> None:
    runs = []
    for seed in range(6):
        speed = place = 0.0
        u, y = np.append([0.0, 0.0], np.random.default_rng(seed).uniform(-1.0, 1.0, 20)).repeat(10)[:200], []
        for force in u:
            free = 0.9 * speed + 0.1 * force
            speed = np.sign(free) * max(abs(free) - 0.03, 0.0)
            y.append(place := place + speed)
        runs.append(replace(record("a", 200), name=f"r{seed}", values=np.column_stack([u, y])))
    known = data(*runs)
    found = look(known, MAPPING, Start(kind=StartKind.REST)).mechanism
    assert len(found) == 3
    assert all("deadzone(" in one.equations for one in found)
    held = mechanism_of(runs, MAPPING)
    assert held is not None
    assert held.told.startswith("y stands while an input moves on, as what dry friction holds")
    assert look(known, MAPPING, ESTIMATED).mechanism == ()
    masked = replace(runs[0], usable=np.arange(200) > 3)
    assert mechanism_of([masked, *runs[1:]], MAPPING) is None


def test_what_closes_a_linear_loop_is_known_with_its_equations() -> None:
    """A relay that switches by its own wall's temperature; nothing of its equations is left to estimate."""
    runs = []
    for seed in range(8):
        air, wall, on, y = 0.0, 0.0, 0.0, []
        rng = np.random.default_rng(seed)
        u = np.append([0.5, 0.5], rng.uniform(-0.5, 1.5, 12)).repeat(15)[:200]
        for asked in u:
            for _ in range(8):
                on = 1.0 if wall < asked - 0.1 else 0.0 if wall > asked + 0.1 else on
                wall, air = wall + 0.02 * (air - wall), air + 0.006 * (2.0 * on - air) + 0.002 * (wall - air)
            y.append(air)
        runs.append(replace(record("a", 200), name=f"r{seed}", values=np.column_stack([u, y])))
    held = mechanism_of(runs, MAPPING)
    assert held is not None
    assert held.told.startswith("Most samples follow one linear law, and the others another: equations of 2 linear")
    assert "closed by a relay" in held.told
    assert look(data(*runs), MAPPING, Start(kind=StartKind.REST)).mechanism == held.structures
    assert all(one.fixed for one in held.structures[0].parameters)
    masked = replace(runs[0], usable=np.arange(200) > 3)
    assert mechanism_of([masked, *runs[1:]], MAPPING) is None


def test_what_asks_to_be_looked_at_is_told_in_words(looked: Looked) -> None:
    assert any("linear" in one for one in looked.cautions)


def test_traces_that_only_score_have_no_say(looked: Looked) -> None:
    other = data(record("a", 200), others={Role.TEST: shifted(record("t", 50, seed=2), 9.0)})
    assert look(other, MAPPING, ESTIMATED) == looked


def test_a_sensor_that_may_not_tell_a_sign_is_known_but_for_its_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sysid.workbench.auto.look._orders", lambda *_: ())
    nothing = Advice(data="rig", mapping=MAPPING, sample_time=0.1, units={}, findings=(), suggestions=())
    monkeypatch.setattr("sysid.workbench.auto.look.advise", lambda *_, **__: nothing)
    lowest = float(record("a", 200)["y"].min())
    for by, one_sign in ((0.0, False), (-lowest, True), (-lowest - 0.005, True), (-lowest - 0.1, False)):
        assert look(data(shifted(record("a", 200), by)), MAPPING, ESTIMATED).never_negative is one_sign


def test_what_adds_up_is_known(monkeypatch: pytest.MonkeyPatch, looked: Looked) -> None:
    monkeypatch.setattr("sysid.workbench.auto.look._orders", lambda *_: ())
    settles = record("a", 300)
    summed = replace(settles, values=np.column_stack([settles.columns(["u"]), np.cumsum(settles["u"])]))
    found = look(data(summed), MAPPING, ESTIMATED)
    assert (looked.integrators, found.integrators) == (0, 1)
    first = next(family for family in FAMILIES if family.kind == NeuralStateSpace.kind).first(found)
    assert {one.structure.to_dict().get("integrators") for one in first} == {1}


@pytest.mark.parametrize("outputs", [1, 2])
def test_orders_that_nobody_tries_are_not_looked_for(monkeypatch: pytest.MonkeyPatch, outputs: int) -> None:
    """What is suggested is for one output: of several it took most of the time of a look, and was dropped."""
    asked: list[bool] = []

    def counted(known: TraceSet, mapping: Mapping, *, suggest: bool) -> Advice:
        asked.append(suggest)
        return Advice(data=known.name, mapping=mapping, sample_time=0.1, units={}, findings=(), suggestions=())

    monkeypatch.setattr("sysid.workbench.auto.look._orders", lambda *_: ())
    monkeypatch.setattr("sysid.workbench.auto.look.advise", counted)
    names = ("y",) if outputs == 1 else ("y1", "y2")
    look(data(record("a", 60, outputs=outputs)), Mapping(inputs=("u",), outputs=names), ESTIMATED)
    assert asked == [outputs == 1] * outputs


def test_of_many_inputs_and_outputs_some_are_looked_at_and_that_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """A look at 14 outputs and as many inputs took six minutes of a search of one."""
    asked: list[list[str]] = [[], []]

    def counted(known: TraceSet, mapping: Mapping, *, suggest: bool) -> Advice:
        asked[0].append(mapping.output)
        return Advice(data=known.name, mapping=mapping, sample_time=0.1, units={}, findings=(), suggestions=())

    def searched(_: TraceSet, mapping: Mapping, __: Start) -> tuple[ARX, ...]:
        asked[1].append(mapping.output)
        return (ARX(na=2, nb=(1,) * 14, nk=(1,) * 14),)

    monkeypatch.setattr("sysid.workbench.auto.look.advise", counted)
    monkeypatch.setattr("sysid.workbench.auto.look._orders_of", searched)
    inputs, outputs = (tuple(f"{one}{k}" for k in range(n)) for one, n in (("u", 14), ("y", 13)))
    values = np.random.default_rng(0).normal(size=(60, 27))
    channels = tuple(Channel(name=name, unit="1") for name in (*inputs, *outputs))
    trace = Trace(name="a", sample_time=1.0, channels=channels, values=values)
    found = look(data(trace), Mapping(inputs=inputs, outputs=outputs), ESTIMATED)
    assert asked == [["y0"], [f"y{k}" for k in range(6)]]
    assert any("Only y0 of 13 outputs had a look" in one for one in found.cautions)
    (order,) = found.orders
    assert (order.na, order.nk, order.nb) == (2, (0,) * 14, (2,) * 14)


def test_a_dead_time_that_drift_has_made_is_not_that_of_the_inputs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sysid.workbench.auto.look._orders", lambda *_: (ARX(na=2, nb=1, nk=9),))
    lags = record("a", 300)
    at_once = replace(lags, values=np.column_stack([lags["u"], lags["u"] + lags["y"]]))
    assert look(data(at_once), MAPPING, ESTIMATED).delay == 0
