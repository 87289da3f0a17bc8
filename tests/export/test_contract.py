"""The contract of every exporter: its files compute what the model computes, in one run or in pieces."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sysid.export import EXPORTERS, Kind
from sysid.export.parity import largest_difference
from sysid.models import NARX, History

TOLERANCE = 1e-9


def test_every_exporter_is_in_this_contract(formats):
    assert set(formats) == set(EXPORTERS)


@pytest.mark.parametrize("n_samples", [1, 2, 7, 500])
def test_output_equals_the_models_free_run(exported, inputs, past, n_samples):
    model, history = exported.model, past(exported.model)
    u = inputs(n_samples, len(model.mapping.inputs))
    run = exported.run(u[:, np.newaxis], exported.layout.from_history(history)[np.newaxis])
    assert run.output.shape == (n_samples, 1, 1)
    assert np.isfinite(run.output).all()
    assert largest_difference(run.output[:, 0, 0], model.simulate(u, history)) <= TOLERANCE


def test_float64_goes_in_and_comes_out(exported, inputs, past):
    u = inputs(3, len(exported.model.mapping.inputs))
    run = exported.run(u[:, np.newaxis], exported.layout.from_history(past(exported.model))[np.newaxis])
    assert (run.output.dtype, run.state.dtype) == (np.float64, np.float64)


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
    np.testing.assert_allclose(run.state[0], exported.layout.from_history(later), rtol=0.0, atol=1e-11)


def test_several_cars_run_as_if_alone(exported, inputs, past):
    model, layout = exported.model, exported.layout
    cars = [(inputs(40, len(model.mapping.inputs), seed=i), past(model, seed=i)) for i in range(3)]
    together = exported.run(
        np.stack([u for u, _ in cars], axis=1), np.stack([layout.from_history(history) for _, history in cars])
    )
    assert together.output.shape == (40, 3, 1)
    assert together.state.shape == (3, layout.size)
    for i, (u, history) in enumerate(cars):
        assert largest_difference(together.output[:, i, 0], model.simulate(u, history)) <= TOLERANCE


def test_an_input_that_is_not_a_number_gives_what_the_model_gives(exported, inputs, past):
    model, history = exported.model, past(exported.model)
    u = inputs(30, len(model.mapping.inputs))
    u[10] = np.nan
    run = exported.run(u[:, np.newaxis], exported.layout.from_history(history)[np.newaxis])
    expected = model.simulate(u, history)
    if any(model.recursion.lags.inputs):
        assert np.isnan(expected).any()
        np.testing.assert_array_equal(np.isnan(run.output[:, 0, 0]), np.isnan(expected))


def test_the_same_model_gives_the_same_bytes(exported, format_name, models, tmp_path):
    EXPORTERS[format_name].write(models["NARX, one input"](), tmp_path)
    EXPORTERS[format_name].write(exported.model, tmp_path)
    assert (tmp_path / exported.path.name).read_bytes() == exported.path.read_bytes()


lag_sets = st.sets(st.integers(1, 6), min_size=1, max_size=3).map(sorted)
input_lag_sets = st.sets(st.integers(0, 6), min_size=1, max_size=3).map(sorted)
structures = st.builds(
    NARX,
    input_delays=st.lists(input_lag_sets, min_size=2, max_size=2),
    output_delays=lag_sets,
    neurons=st.integers(1, 4),
    feedthrough=st.booleans(),
)


@pytest.mark.parametrize("format_name", ["onnx"])
@settings(max_examples=40, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(structure=structures, seed=st.integers(0, 100), n_samples=st.integers(1, 30))
def test_any_structure(*, format_name, kind, narx, opened, inputs, past, tmp_path, structure, seed, n_samples):
    model = narx(structure, seed=seed)
    exported = opened(EXPORTERS[format_name], model, kind, tmp_path)
    u, history = inputs(n_samples, 2, seed=seed), past(model, seed=seed)
    run = exported.run(u[:, np.newaxis], exported.layout.from_history(history)[np.newaxis])
    assert largest_difference(run.output[:, 0, 0], model.simulate(u, history)) <= TOLERANCE


def test_kinds_are_both_written_by_every_exporter(format_name, narx, tmp_path):
    files = EXPORTERS[format_name].write(narx(NARX(input_delays=1, output_delays=1, neurons=1)), tmp_path)
    assert [file.kind for file in files] == [Kind.STEP, Kind.SEQUENCE]
    assert sorted(file.name for file in files) == sorted(path.name for path in tmp_path.iterdir())
