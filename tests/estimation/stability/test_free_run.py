"""Random sequences and what they find: runs that stay, runs that leave, and runs that settle where they should not."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import sysid
from sysid.errors import TraceError
from sysid.estimation.stability import excursions as module
from sysid.models import ARX, ARXModel, Mapping
from sysid.traces import Channel, Trace
from sysid.validation import Excursions, TraceSequences, check_stability

CHANNELS = tuple(Channel(name=name, unit="V") for name in ("a", "b", "y"))


def model(pole: float = 0.9) -> ARXModel:
    gain = abs(1.0 - pole)
    return ARXModel(
        orders=ARX(na=1, nb=(1, 1), nk=(0, 0)), coefficients=np.array([gain, gain, pole]), intercept=0.0,
        mapping=Mapping.parse("a+b -> y"), sample_time=0.5, input_units=("V", "V"), output_unit="V", rest_output=0.0,
    )  # fmt: skip


def record(seed: int = 0, n: int = 2000, usable: np.ndarray | None = None) -> Trace:
    """Levels and rests; the second input follows the first, so that the two are never independent."""
    rng = np.random.default_rng(seed)
    a = np.repeat(rng.choice([0.0, 0.0, 0.5, 1.0], n // 200), 200)
    a[:200] = 0.0
    b = np.zeros(n)
    for t in range(1, n):
        b[t] = 0.95 * b[t - 1] + 0.05 * a[t]
    inputs = np.column_stack([a, b])
    values = np.column_stack([inputs, model().simulate(inputs)])
    return Trace(name=f"record {seed}", sample_time=0.5, channels=CHANNELS, values=values, usable=usable)


def excursions(*records: Trace) -> Excursions:
    return Excursions.of(records or (record(),), ["a", "b"], ["y"])


def test_a_stable_model_passes_and_settles_on_the_plateau():
    found = check_stability(model(), excursions(), count=60)
    assert found.stable
    assert (found.sequences, found.judged, found.unbounded) == (60, 60, 0)
    assert found.largest_plateau_error < 1e-3


def test_where_a_run_settles_is_not_judged_of_what_has_no_rest_to_come_back_to():
    rests = [record(seed) for seed in range(3)]
    kept = np.cumsum(0.01 * rests[0].columns(["a"]), axis=0) % 3.0  # goes on, and stays
    stays = replace(rests[0], values=np.column_stack([rests[0].columns(["a", "b"]), kept]))
    assert excursions(*rests).has_plateaus
    assert not excursions(*rests[1:], stays).has_plateaus


def test_a_run_that_grows_without_bound_is_found():
    found = check_stability(model(1.02), excursions(), count=20)
    assert (found.stable, found.unbounded) == (False, 20)
    assert "leaves its bounds on 20 of 20" in found.sentence


def test_where_the_time_ends_it_says_on_how_many_sequences_the_verdict_rests():
    found = check_stability(model(), excursions(), count=500, seconds=0.0)
    assert found.stable
    assert found.sequences == 10  # the first are run however long they take
    assert found.to_dict()["asked"] == 500
    assert "10 of 500 sequences were checked in the time" in found.sentence
    whole = check_stability(model(), excursions(), count=10)
    assert "asked" not in whole.to_dict()
    assert "in the time" not in whole.sentence


def test_a_run_that_is_not_a_number_has_left_its_bounds():
    found = check_stability(lambda s: np.full(len(s.inputs), np.nan), excursions(), count=3)
    assert found.unbounded == 3


def test_a_second_equilibrium_at_rest_is_found():
    """A run that sticks once it has been high, as a network with a false equilibrium does."""

    def sticks(sequence):
        y = model().simulate(sequence.inputs)
        return np.where(np.maximum.accumulate(y) > 0.9, np.maximum(y, 0.3), y)

    found = check_stability(sticks, excursions(), count=60)
    assert not found.stable
    assert found.unbounded == 0
    assert 0 < found.unsettled < 60
    width = np.ptp(record()["y"])
    assert found.largest_plateau_error == pytest.approx(0.3 / width, abs=0.02)
    assert_allclose(found.worst_outputs[-1], 0.3, atol=1e-9)


def test_the_worst_sequence_is_kept_to_the_digits_that_repeat_it():
    found = check_stability(model(0.97), excursions(), count=10)
    rows = list(csv.reader(io.StringIO(found.worst_csv())))
    assert rows[0] == ["time [s]", "a", "b", "y target", "y free run", "judged"]
    values = np.array(rows[1:], dtype=np.float64)
    assert values[1, 0] == 0.5
    assert_allclose(model(0.97).simulate(values[:, 1:3], found.worst.history(several=False)), values[:, 4], atol=1e-7)


def test_the_seed_decides_and_a_sequence_does_not_depend_on_how_many_are_drawn():
    few = list(excursions().draw(3, 5))
    module._kept.cache_clear()  # what is found again is the same anyhow
    many = list(excursions().draw(6, 5))
    assert all(np.array_equal(a.inputs, b.inputs) for a, b in zip(few, many, strict=False))
    assert not np.array_equal(few[0].inputs, next(iter(excursions().draw(1, 6))).inputs)


def test_what_was_drawn_is_found_again_by_all_that_it_depends_on_and_cannot_be_changed():
    first, again = next(excursions().draw(1, 5)), next(excursions().draw(1, 5))
    assert again is first
    with pytest.raises(ValueError, match="read-only"):
        first.inputs[0] = 1.0
    source = excursions()
    others = [
        excursions(record(1)).draw(1, 5),
        replace(source, samples=2 * source.samples).draw(1, 5),
        Excursions.of([record()], ["a"], ["b", "y"]).draw(1, 5),
        source.draw(1, 6),
    ]
    assert all(next(other).inputs.tobytes() != first.inputs.tobytes() for other in others)


def test_no_more_is_kept_than_memory_is_meant_for_it(monkeypatch):
    module._kept.cache_clear()
    rows = next(excursions().draw(1, 5))
    monkeypatch.setattr(module, "MOST_KEPT", 2 * (rows.inputs.nbytes + rows.targets.nbytes))
    drawn, again = list(excursions().draw(4, 8)), list(excursions().draw(4, 8))
    assert [a is b for a, b in zip(drawn, again, strict=True)].count(True) in {1, 2}
    assert all(np.array_equal(a.inputs, b.inputs) for a, b in zip(drawn, again, strict=True))


def test_sequences_stay_within_the_range_of_the_records_and_are_all_different():
    low, high = record().values.min(axis=0), record().values.max(axis=0)
    drawn = list(excursions().draw(30, 1))
    for sequence in drawn:
        rows = np.hstack([sequence.inputs, sequence.targets])
        assert (rows >= low).all() and (rows <= high).all()
    assert len({sequence.inputs.tobytes() for sequence in drawn}) == 30


def test_inputs_that_belong_together_stay_together():
    """The second input is the first one's moving average: at random and each for itself they would be far apart."""
    record_rows = record().values[:, :2]
    for sequence in excursions().draw(10, 2):
        nearest = [np.abs(record_rows - row).max(axis=1).min() for row in sequence.inputs[::25]]
        assert np.quantile(nearest, 0.9) < 0.1


def test_joints_are_led_over():
    """Where two passages meet, the slow input moves no faster than in the record by more than a little."""
    fastest = np.abs(np.diff(record()["b"])).max()
    for sequence in excursions().draw(10, 3):
        assert np.abs(np.diff(sequence.inputs[:, 1])).max() < 2.0 * fastest


def test_a_sequence_ends_where_a_record_began_and_stands_there():
    for sequence in excursions().draw(10, 4):
        held = sequence.inputs[sequence.judged]
        assert len(held) > 1
        assert np.ptp(held, axis=0).max() == 0.0
        assert_allclose(held[0], 0.0, atol=0.05)
        assert sequence.judged[-1]


def test_records_that_never_stand_still_show_that_a_run_stays_bounded():
    rng = np.random.default_rng(0)
    inputs = rng.uniform(-1.0, 1.0, (500, 2))
    values = np.column_stack([inputs, model().simulate(inputs)])
    trace = Trace(name="noise", sample_time=0.5, channels=CHANNELS, values=values)
    found = check_stability(model(), excursions(trace), count=20)
    assert (found.stable, found.judged) == (True, 0)
    assert "None of them stands still" in found.sentence
    assert found.to_dict()["largest_plateau_error"] is None


def test_passages_do_not_cross_what_is_masked():
    usable = np.ones(2000, dtype=bool)
    usable[700:750] = False
    source = excursions(record(usable=usable))
    assert [len(r) for r in source.records] == [700, 1250]


def test_pieces_of_a_record_stand_still_no_sooner_than_the_record():
    whole = record()
    pieces = replace(whole, usable=np.arange(len(whole.values)) % 500 < 400)
    assert excursions(pieces).hold == excursions(whole).hold == 100
    assert excursions(pieces).passage[1] < excursions(whole).passage[1], "passages lie within a piece"


def test_several_records_all_serve():
    source = excursions(record(0), record(1))
    assert all(sequence.judged.any() for sequence in source.draw(5, 0))
    assert_allclose(source.output_range[1], max(record(0)["y"].max(), record(1)["y"].max()))


def test_records_that_are_too_short_are_refused():
    with pytest.raises(TraceError, match="no trace is long enough"):
        excursions(record(n=200).__class__(name="s", sample_time=0.5, channels=CHANNELS, values=np.zeros((10, 3))))


def test_traces_of_a_generator_are_judged_wherever_they_stand_still():
    traces = [record(seed) for seed in range(5)]
    source = TraceSequences(
        inputs=("a", "b"), outputs=("y",), sample_time=0.5, traces=traces, source_text="Five records.", still=60
    )
    found = check_stability(model(), source, count=4)
    assert (found.sequences, found.judged, found.source) == (4, 4, "Five records.")
    assert found.largest_plateau_error < 1e-9
    wrong = check_stability(lambda s: model().simulate(s.inputs) * 0.8, source)
    assert wrong.unsettled == 5
    judged = next(iter(source.draw(1, 0))).judged
    y = traces[0]["y"]
    plain = [
        t >= 60 and np.ptp(traces[0].values[t - 60 : t + 1, 2]) <= 0.01 * np.ptp(source.output_range)
        for t in range(len(y))
    ]
    np.testing.assert_array_equal(judged, plain)


def with_parameter(value: float, seed: int, n: int = 2000) -> Trace:
    """The same, with its second input held all along: a parameter of the plant."""
    made = record(seed, n)
    values = np.array(made.values)
    values[:, 1] = value
    values[:, 2] = model().simulate(values[:, :2])
    return replace(made, name=f"parameter {value}", values=values)


def test_an_input_that_never_moves_within_a_record_does_not_move_within_a_sequence():
    known = {0.1: 0, 0.4: 1, 0.9: 2}
    source = excursions(*(with_parameter(value, seed) for value, seed in known.items()))
    drawn = list(source.draw(40, seed=3))
    values = [set(one.inputs[:, 1].tolist()) for one in drawn]
    assert all(len(one) == 1 for one in values)
    assert set.union(*values) == set(known)
    assert sum(np.ptp(one.inputs[:, 0]) > 0.0 for one in drawn) > 20


def test_records_of_one_parameter_that_are_shorter_than_a_passage_are_used_as_they_are():
    source = excursions(with_parameter(0.1, 0, n=40_000), with_parameter(0.4, 1, n=200))
    assert {one.inputs[0, 1] for one in source.draw(20, seed=0)} == {0.1, 0.4}


def test_inputs_go_beyond_what_was_recorded_and_no_plateau_is_judged_there():
    usual, further = (Excursions.of([record()], ["a", "b"], ["y"], amplitude) for amplitude in (1.0, 1.5))
    for near, far in zip(usual.draw(5, 1), further.draw(5, 1), strict=True):
        assert_allclose(far.inputs - 0.5, 1.5 * (near.inputs - 0.5), atol=1e-3)  # b comes near 1 and 0
        assert near.judged.any()
        assert not far.judged.any()
    parameter = replace(record(), values=record().values * [1.0, 0.0, 1.0] + [0.0, 2.0, 0.0])
    sequence = next(Excursions.of([parameter], ["a", "b"], ["y"], 1.5).draw(1, 1))
    assert set(sequence.inputs[:, 1]) == {2.0}  # what does not move in a record is a parameter


@pytest.mark.parametrize(("pole", "stable"), [(0.995, True), (1.01, False)])
def test_a_slow_plant_begins_where_its_record_does_and_not_at_an_equilibrium_it_never_saw(
    pole: float, stable: bool
) -> None:
    """A battery warms with the square of its current: at rest under the first one it is far above the record."""
    current = np.concatenate([[3.0] * 20, np.repeat(np.random.default_rng(0).uniform(-3.0, 3.0, 49), 20)])
    warm = np.zeros(1000)
    for k in range(999):
        warm[k + 1] = 0.995 * warm[k] + 0.02 * current[k] ** 2
    (record,) = sysid.data((current, warm + 0.02 * np.random.default_rng(1).standard_normal(1000)), sample_time=1.0)
    equations = sysid.GreyBox(
        equations=f"x[k+1] = {pole}*x + g*u^2\ny = x", parameters={"g": {"start": 0.02, "fixed": True}}
    )
    model = sysid.fit([record], "u -> y", equations, stability=sysid.StabilityOptions(count=0)).model
    found = check_stability(model, Excursions.of([record], ["u"], ["y"]), count=50)
    assert found.stable is stable
    again = check_stability(model, Excursions.of([record], ["u"], ["y"]), count=50)
    assert np.array_equal(found.worst_outputs, again.worst_outputs)  # whichever of two threads is first
    if stable:
        assert found.forgets  # two runs come nearer to each other, and are not there yet
        assert model.simulate(current[:1, np.newaxis])[0] > 2.0 * warm.max()  # from rest
