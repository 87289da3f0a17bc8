"""Runs that begin by measured outputs: of one model with one output or several, and of several models."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sysid.errors import ConfigError, TraceError
from sysid.export import Bundle, simulate_bundle
from sysid.export.bundle import OutsideRangeWarning, UnreadOutputWarning
from sysid.export.inputs import read_inputs
from sysid.export.measured_run import obstacle
from sysid.ingest import write_trace
from sysid.models import ARX, NARX, ARXModel, Cascade, Limit, Mapping, VectorNARX
from sysid.traces import Channel, Trace
from tests.export.cascades import build_cascade, build_circle, wired_narx, wired_transfer_function, wired_vector
from tests.export.grey_boxes import build_grey

SMALL = NARX(input_delays="0:1", output_delays=2, neurons=3)


def beside():
    return Cascade(models=(wired_narx("STP -> BP", SMALL, 1), wired_transfer_function("STP -> X")))


SOURCES = {
    "one output": lambda: wired_narx("STP -> BP", SMALL, 1),
    "two outputs": lambda: wired_vector(
        "STP -> V+W", VectorNARX(input_delays=1, output_delays=[[2], [1]], neurons=3), 4
    ),
    "side by side": beside,
    "equations of two outputs": lambda: build_grey(
        "dx/dt = (BP - x)/2\ndz/dt = x - z\nBC = x + 0.1*BP\nER = z", mapping="BP -> BC+ER"
    ),
    "one behind the other": build_cascade,
    "two outputs behind another": lambda: Cascade(
        models=(
            wired_narx("STP -> BP", SMALL, 1),
            wired_vector("BP -> V+W", VectorNARX(input_delays=1, output_delays=[[2], [1]], neurons=3), 4),
        )
    ),
}


def bundled(model, **metadata) -> Bundle:
    """A bundle that was not written: what a run needs of it."""
    units = dict.fromkeys((*model.inputs, *model.outputs), "psi")
    sides = {
        side: [{"name": name, "unit": units[name], "range": None} for name in names]
        for side, names in {"inputs": model.inputs, "outputs": model.outputs}.items()
    }
    return Bundle(folder=Path("b"), model=model, metadata={**sides, **metadata}, files=())


def recorded(model, n=160) -> Trace:
    """A record that the model itself made, from elsewhere than rest: its later part is what a run has to find."""
    rng = np.random.default_rng(5)
    u = np.repeat(rng.uniform(10.0, 80.0, (n // 10, len(model.inputs))), 10, axis=0)
    y = model.run_from(u, np.full(len(model.outputs), 55.0))
    channels = tuple(Channel(name=name, unit="psi") for name in (*model.inputs, *model.outputs))
    return Trace(name="r", sample_time=0.1, channels=channels, values=np.column_stack([u, y])[20:])


@pytest.mark.parametrize("start", ["estimated", {"measured": 30}])
@pytest.mark.parametrize("source", SOURCES)
def test_what_a_model_made_is_found_behind_its_first_samples(source, start):
    model = SOURCES[source]()
    bundle, record = bundled(model), recorded(model)
    run = simulate_bundle(bundle, record, start=start)
    assert list(run.scored) == list(model.outputs) == list(run.firsts)
    for name, found in run.scored.items():
        assert found.nrmse_fit == pytest.approx(100.0, abs=1e-3)
        np.testing.assert_allclose(run.trace[name][run.first :], record[name][run.first :], atol=1e-3)
    assert f"the first {run.first} samples" in run.begins
    frame = pd.DataFrame(record.values, columns=list(record.channel_names))
    assert np.array_equal(bundle.simulate(frame, start=start).to_numpy(), run.trace.columns(model.outputs))


@pytest.mark.parametrize("source", SOURCES)
def test_it_is_estimated_where_the_outputs_are_measured_and_nobody_says_otherwise(source):
    model = SOURCES[source]()
    bundle, record = bundled(model), recorded(model)
    assert np.array_equal(
        simulate_bundle(bundle, record).trace.values, simulate_bundle(bundle, record, start="estimated").trace.values
    )
    rest = simulate_bundle(bundle, record, start="rest")
    assert rest.firsts == {} and "at rest" in rest.begins
    assert set(rest.scored) == set(model.outputs), "and scored on all samples"


@pytest.mark.parametrize("source", SOURCES)
def test_a_pair_of_the_samples_before_is_gone_on_from(source):
    model = SOURCES[source]()
    bundle, record = bundled(model), recorded(model)
    u, y = record.columns(model.inputs), record.columns(model.outputs)
    found = bundle.simulate(u[60:], initial=(u[:60], y[:60]))
    np.testing.assert_allclose(found.reshape(len(u) - 60, -1), y[60:], atol=1e-6)
    frame = pd.DataFrame(y[:60], columns=list(model.outputs))
    assert np.array_equal(bundle.simulate(u[60:], initial=(u[:60], frame)), found)


@pytest.mark.parametrize(
    ("pair", "says"),
    [
        pytest.param((np.ones(5), np.ones((4, 2))), "these are no samples before a run", id="not as many"),
        pytest.param((np.ones(5),), "these are no samples before a run", id="no pair"),
        pytest.param((np.ones(5), np.full((5, 2), np.nan)), "values are missing", id="not a number"),
    ],
)
def test_a_pair_that_is_none_is_refused(pair, says):
    model = SOURCES["two outputs"]()
    with pytest.raises(TraceError, match=says):
        bundled(model).simulate(np.ones(9), initial=pair)


@pytest.mark.parametrize(
    ("build", "says"),
    [
        pytest.param(lambda: replace(build_circle(), limits={}), "its models read each other", id="in a circle"),
        pytest.param(
            lambda: replace(beside(), limits={"BP": Limit(low=0.0)}),
            "limits that were declared for the whole",
            id="held",
        ),
    ],
)
def test_models_that_cannot_begin_so_say_why_and_are_scored(build, says):
    model = build()
    bundle, record = bundled(model), recorded(model)
    run = simulate_bundle(bundle, record)
    assert says in obstacle(model) and says in run.begins
    assert set(run.scored) == set(model.outputs)
    with pytest.raises(ConfigError, match="begin at their declared levels"):
        simulate_bundle(bundle, record, start="estimated")
    u, y = record.columns(model.inputs), record.columns(model.outputs)
    with pytest.raises(ConfigError, match="begin at their declared levels"):
        bundle.simulate(u, initial=(u, y))


def test_each_of_two_outputs_begins_by_what_was_measured_of_it(tmp_path):
    """A file with one of them: the other begins at rest, which is said."""
    model = beside()
    bundle, record = bundled(model), recorded(model)
    write_trace(
        Trace(name="f", sample_time=0.1, channels=record.channels[:2], values=record.values[:, :2]), tmp_path / "f.csv"
    )
    run = simulate_bundle(bundle, read_inputs(bundle, tmp_path / "f.csv"))
    assert set(run.scored) == {"BP"} == set(run.firsts)
    assert run.begins.startswith("BP: its initial state is estimated") and "X: it begins at rest" in run.begins
    np.testing.assert_array_equal(run.trace["X"], simulate_bundle(bundle, record, start="rest").trace["X"])


def test_one_of_the_two_outputs_of_a_model_says_too_little():
    model = SOURCES["two outputs"]()
    record = recorded(model)
    part = replace(record, channels=record.channels[:2], values=record.values[:, :2])
    run = simulate_bundle(bundled(model), part)
    assert run.firsts == {} and set(run.scored) == {"V"}
    assert "what was measured of V says too little" in run.begins


def test_an_assembly_that_declares_its_levels_begins_there():
    model = replace(beside(), rest={"BP": 20.0})
    record = recorded(model)
    begun = {"kind": "rest", "n_measured": 0}
    assert simulate_bundle(bundled(model, cases_start=begun), record).firsts == {}
    assert simulate_bundle(bundled(beside(), cases_start=begun | {"said": True}), record).firsts == {}
    for silent in (begun, begun | {"said": False}):
        assert simulate_bundle(bundled(beside(), cases_start=silent), record).firsts


def test_outputs_that_are_not_read_are_told():
    model = SOURCES["one output"]()
    record = recorded(model)
    frame = pd.DataFrame(record.values, columns=list(record.channel_names))
    for given in (frame, record):
        with pytest.warns(UnreadOutputWarning, match="what was measured of BP is not read"):
            found = bundled(model).simulate(given)
        assert np.array_equal(np.ravel(found), bundled(model).simulate(record["STP"]))
    assert not issubclass(UnreadOutputWarning, OutsideRangeWarning)
    with pytest.raises(ConfigError, match="in two ways"):
        bundled(model).simulate(frame, initial=3.0, start="estimated")
    with pytest.raises(ConfigError, match="needs the measured output"):
        bundled(model).simulate(record["STP"], start="estimated")


def test_a_frame_is_run_as_a_trace_is():
    """Blank outputs are masked, columns say their units."""
    model = beside()
    record = recorded(model)
    frame = pd.DataFrame(record.values, columns=[f"{name} [psi]" for name in record.channel_names])
    assert np.array_equal(
        simulate_bundle(bundled(model), frame).trace.values, simulate_bundle(bundled(model), record).trace.values
    )
    frame.iloc[3, 1] = np.nan
    run = simulate_bundle(bundled(model), frame)
    np.testing.assert_allclose(run.trace["BP"][60:], record["BP"][60:], atol=1e-2)


def test_a_model_without_inputs_begins_by_its_output(tmp_path):
    model = ARXModel(
        orders=ARX(na=1, nb=(), nk=()), coefficients=np.array([0.9]), intercept=0.0, mapping=Mapping.parse("-> y"),
        sample_time=0.1, input_units=(), output_unit="psi", rest_output=0.0,
    )  # fmt: skip
    bundle = replace(
        bundled(model),
        metadata={
            "inputs": [{"name": "tick", "unit": "1", "range": None}],
            "outputs": [{"name": "y", "unit": "psi", "range": None}],
        },
    )
    frame = pd.DataFrame({"y": 5.0 * 0.9 ** np.arange(40)})
    frame.assign(**{"time [s]": 0.1 * np.arange(40), "y [psi]": frame["y"]}).drop(columns="y").to_csv(
        tmp_path / "f.csv"
    )
    for record in (frame, read_inputs(bundle, tmp_path / "f.csv")):
        run = simulate_bundle(bundle, record)
        assert run.scored["y"].nrmse_fit == pytest.approx(100.0, abs=1e-6)
    assert np.array_equal(bundle.simulate(frame, start="estimated")["y"], run.trace["y"])
    np.testing.assert_allclose(bundle.simulate(3, initial=(np.zeros((2, 0)), [2.0, 1.0])), [0.9, 0.81, 0.729])
