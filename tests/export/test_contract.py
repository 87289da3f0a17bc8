"""The contract of every exporter: its files compute what the model computes, in one run or in pieces."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sysid.export import EXPORTERS, Flag, expected_flags
from sysid.export.differences import largest_difference
from sysid.models import NARX, History
from tests.export.conftest import usable


def test_every_file_of_every_exporter_is_in_this_contract(rows, narx, declared, tmp_path):
    surrogate = declared(narx(NARX(input_delays=1, output_delays=1, neurons=1)))
    here = [name for name, one in EXPORTERS.items() if not one.lacks()]
    assert {row.format for row in rows.values()} == {*EXPORTERS}
    written = [file for name in here for file in EXPORTERS[name].write(surrogate, tmp_path)]
    found = sorted((file.format, file.name, file.dtype) for file in written)
    assert found == sorted(
        (row.format, row.name.format(name=surrogate.identifier), row.dtype)
        for row in rows.values()
        if row.format in here
    )
    named = {name for file in written for name in (file.name, *file.companions)}
    assert sorted(named) == sorted(path.name for path in tmp_path.iterdir())


def test_output_equals_the_models_free_run(exported, inputs, past):
    model, history = exported.model, past(exported.model)
    for n_samples in (1, 7, 200):
        u = inputs(n_samples, len(model.mapping.inputs))
        run = exported.run(u[:, np.newaxis], exported.layout.from_history(history)[np.newaxis])
        assert run.output.shape == (n_samples, 1, 1)
        assert (run.output.dtype, run.state.dtype) == (exported.file.dtype, exported.file.dtype)
        assert np.isfinite(run.output).all()
        assert largest_difference(run.output[:, 0, 0], model.simulate(u, history)) <= exported.tolerance


def test_a_run_in_pieces_equals_one_long_run_exactly(exported, inputs, past):
    u = inputs(60, len(exported.model.mapping.inputs))[:, np.newaxis]
    state = exported.layout.from_history(past(exported.model))[np.newaxis]
    whole = exported.run(u, state)
    pieces = []
    for piece in np.split(u, [1, 2, 5, 30]):
        run = exported.run(piece, state)
        pieces.append(run.output)
        state = run.state
    np.testing.assert_array_equal(np.concatenate(pieces), whole.output)
    np.testing.assert_array_equal(state, whole.state)


def test_state_after_a_run_is_the_past_of_the_next_sample(exported, inputs, past):
    model, history = exported.model, past(exported.model)
    u = inputs(4, len(model.mapping.inputs))
    run = exported.run(u[:, np.newaxis], exported.layout.from_history(history)[np.newaxis])
    later = History(
        inputs=np.concatenate([history.inputs, u]), output=np.concatenate([history.output, model.simulate(u, history)])
    )
    slack = {"rtol": 0.0, "atol": 1e-11} if exported.file.dtype == "float64" else {"rtol": 1e-5, "atol": 1e-5}
    np.testing.assert_allclose(run.state[0, : exported.layout.size], exported.layout.from_history(later), **slack)


def test_several_cars_run_as_if_alone(exported, inputs, past):
    model, layout = exported.model, exported.layout
    cars = [(inputs(40, len(model.mapping.inputs), seed=i), past(model, seed=i)) for i in range(3)]
    together = exported.run(
        np.stack([u for u, _ in cars], axis=1), np.stack([layout.from_history(history) for _, history in cars])
    )
    assert together.output.shape == (40, 3, 1)
    assert together.state.shape == (3, exported.surrogate.state_length(exported.file.dtype))
    for i, (u, history) in enumerate(cars):
        assert largest_difference(together.output[:, i, 0], model.simulate(u, history)) <= exported.tolerance


def test_an_input_that_is_infinite_or_no_number_gives_what_the_model_gives(exported, inputs, past):
    """A car for each: outputs that are none from the same sample on, others as ever, and the same flags."""
    model, history = exported.model, past(exported.model)
    values = (np.nan, np.inf, -np.inf)
    u = np.stack([inputs(30, len(model.mapping.inputs))] * len(values), axis=1)
    u[10] = np.array(values)[:, np.newaxis]
    run = exported.run(u, np.stack([exported.layout.from_history(history)] * len(values)))
    for i in range(len(values)):
        expected = model.simulate(u[:, i], history)
        assert np.isnan(expected).any() == any(model.recursion.lags.inputs)
        assert largest_difference(run.output[:, i, 0], expected) <= exported.tolerance
        flags = expected_flags(exported.surrogate, u[:, i], expected[:, np.newaxis])
        np.testing.assert_array_equal(run.flags[:, i], flags)
        assert flags[10] & Flag.NOT_A_NUMBER


def test_flags_say_what_is_outside_held_or_lost(exported, inputs, past):
    """At the end of the range, above it and below."""
    model, surrogate = exported.model, exported.surrogate
    for value in (95.0, 95.001, -0.001):
        u = inputs(40, len(model.mapping.inputs))
        u[7, -1] = value
        u[30, 0] = np.nan
        run = exported.run(u[:, np.newaxis], exported.layout.from_history(past(model))[np.newaxis])
        expected = expected_flags(surrogate, u, model.simulate(u, past(model))[:, np.newaxis])
        assert run.flags.shape == (40, 1)
        np.testing.assert_array_equal(run.flags[:, 0], expected)
        assert expected[30] & Flag.NOT_A_NUMBER
        assert bool(expected[7] & Flag.OUTSIDE_RANGE) is (value != 95.0)


def test_a_state_set_anew_forgets_what_was_not_a_number(exported, inputs, past):
    model, state = exported.model, exported.layout.from_history(past(exported.model))[np.newaxis]
    u = inputs(20, len(model.mapping.inputs))[:, np.newaxis]
    before = exported.run(u, state)
    exported.run(np.full_like(u, np.nan), state)
    again = exported.run(u, state)
    np.testing.assert_array_equal(again.output, before.output)
    np.testing.assert_array_equal(again.flags, before.flags)


def test_no_input_brings_it_down_and_a_bounded_output_stays_bounded(exported, inputs):
    model, recursion = exported.model, exported.model.recursion
    bounds = [
        b * recursion.scaling.output_scale + recursion.scaling.output_offset for b in (recursion.low, recursion.high)
    ]
    slack = 1e-4 if exported.file.dtype == "float32" else 1e-12
    for value in (np.inf, -1e300, 5e-324):
        u = inputs(20, len(model.mapping.inputs))
        u[5:8] = value
        state = exported.surrogate.at_rest(u[0])[np.newaxis]
        with np.errstate(over="ignore"):
            run = exported.run(u[:, np.newaxis], state)
        finite = run.output[~np.isnan(run.output)]
        assert (finite >= bounds[0] - slack).all()
        assert (finite <= bounds[1] + slack).all()
        assert ((run.flags[np.isnan(run.output[..., 0])] & Flag.NOT_A_NUMBER) > 0).all()
        if abs(value) > 1.0:
            assert (run.flags[5:8] & Flag.OUTSIDE_RANGE).all()


def test_models_wired_run_as_one(wired, inputs):
    surrogate = wired.surrogate
    u = np.stack([inputs(200, len(surrogate.inputs), seed=i) for i in range(3)], axis=1)
    states = np.stack([surrogate.at_rest(u[0, i]) for i in range(3)])
    run = wired.run(u, states)
    assert run.output.shape == (200, 3, len(surrogate.outputs))
    lost = u[:20].copy()
    lost[5, 0, 0], lost[5, 1, -1], lost[5, 2, 0] = np.nan, np.inf, -np.inf
    # Far beyond what they know: each is held at a bound, or at a limit that lies beyond its bound.
    far = u[:40].copy()
    far[10:12], far[20:22, :, 0], far[30:32, :, -1] = 200.0, 1e4, -50.0
    for fed, found in ((u, run), (lost, wired.run(lost, states)), (far, wired.run(far, states))):
        for i in range(3):
            expected = surrogate.simulate(fed[:, i])
            assert largest_difference(found.output[:, i], expected) <= wired.tolerance
            flags = expected_flags(surrogate, fed[:, i], surrogate.compute(fed[:, i]))
            np.testing.assert_array_equal(found.flags[:, i], flags)
    half = wired.run(u[:90], states)
    rest = wired.run(u[90:], half.state)
    np.testing.assert_array_equal(np.concatenate([half.output, rest.output]), run.output)
    np.testing.assert_array_equal(rest.state, run.state)


def test_the_same_model_gives_the_same_bytes_whatever_was_written_before(format_name, models, declared, tmp_path):
    exporter, contents = usable(format_name), []
    for model in ("NARX 4/4/20", "NARX, direct input", "NARX 4/4/20"):
        folder = tmp_path / str(len(contents))
        folder.mkdir()
        files = exporter.write(declared(models[model]()), folder)
        names = {name for file in files for name in (file.name, *file.companions)}
        contents.append({name: (folder / name).read_bytes() for name in names})
    assert contents[0] == contents[2]


lag_sets = st.sets(st.integers(1, 6), min_size=1, max_size=3).map(sorted)
input_lag_sets = st.sets(st.integers(0, 6), min_size=1, max_size=3).map(sorted)
kinds = {"feedthrough": st.booleans()}, {"gated": st.just(True)}
structures = st.one_of(
    st.builds(
        NARX,
        input_delays=st.lists(input_lag_sets, min_size=2, max_size=2),
        output_delays=lag_sets,
        neurons=st.integers(1, 4),
        **kind,
    )
    for kind in kinds
)


@pytest.mark.parametrize("name", ["ONNX, step", "ONNX, sequence"])
@settings(max_examples=40, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(structure=structures, seed=st.integers(0, 100), n_samples=st.integers(1, 30))
def test_any_structure(*, name, rows, narx, declared, opened, inputs, past, tmp_path, structure, seed, n_samples):
    model = narx(structure, seed=seed)
    exported = opened(rows[name], declared(model), tmp_path)
    u, history = inputs(n_samples, 2, seed=seed), past(model, seed=seed)
    run = exported.run(u[:, np.newaxis], exported.layout.from_history(history)[np.newaxis])
    assert largest_difference(run.output[:, 0, 0], model.simulate(u, history)) <= exported.tolerance
