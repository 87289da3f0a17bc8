"""A cascade is judged as a whole, from its inputs alone, output by output."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sysid.errors import ChannelError
from sysid.models import Cascade, Limit, Start
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.validation import evaluate, evaluate_cascade
from tests.models.cascades.cascades import CASCADES, command, network, service

NOISE = 0.3


def measured(cascade: Cascade, seed: int = 0, *, usable=None) -> Trace:
    """What the cascade puts out, with noise on it."""
    trace = cascade.simulate(command(150, len(cascade.inputs), seed)).trace(f"case {seed}")
    noise = NOISE * np.random.default_rng(seed).standard_normal(trace.values.shape)
    noise[:, : len(cascade.inputs)] = 0.0
    return replace(trace, values=trace.values + noise, usable=usable)


@pytest.fixture(scope="module")
def traces() -> TraceSet:
    return TraceSet(name="set", traces=(measured(service()), measured(service(), 1)), roles={"case 0": Role.ESTIMATION})


def test_every_output_is_judged_in_the_free_run_of_the_whole(traces):
    found = evaluate_cascade(service(), traces, repeats=1)
    assert list(found.outputs) == ["BP", "AR", "BC"]
    for name, evaluation in found.outputs.items():
        for trace in traces:
            run = service().simulate_trace(trace)
            assert evaluation.cases[trace.name].free_run.mse == np.mean((run[name] - trace[name]) ** 2)
            assert evaluation.cases[trace.name].role is traces.roles[trace.name]
        assert found.mse(name)["case 1"] == evaluation.cases["case 1"].free_run.mse
    assert found.held == {}
    json.dumps(found.to_dict(), allow_nan=False)


def test_a_cascade_of_one_model_is_judged_as_that_model(traces):
    model = network("STP -> BP", seed=1)
    one = evaluate(model, traces, Start(), repeats=1)
    other = evaluate_cascade(Cascade(models=(model,)), traces, repeats=1).outputs["BP"]
    for name, case in one.cases.items():
        assert_allclose(other.cases[name].free_run.mse, case.free_run.mse, rtol=1e-9)
        assert_allclose(other.cases[name].predicted, case.predicted, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("name", ["a network of several outputs", "several outputs without a linear part"])
def test_one_step_ahead_of_its_own_output_is_that_output(name):
    cascade = CASCADES[name]
    trace = cascade.simulate(command(80, len(cascade.inputs))).trace("own")
    found = evaluate_cascade(cascade, TraceSet(name="own", traces=(trace,)), repeats=1)
    for evaluation in found.outputs.values():
        assert_allclose(evaluation.cases["own"].predicted, evaluation.cases["own"].simulated, rtol=0.0, atol=1e-8)


def test_samples_that_are_not_usable_do_not_count():
    usable = np.ones(150, dtype=bool)
    usable[40:] = False
    trace = measured(service(), usable=usable)
    spoilt = replace(trace, values=np.where(usable[:, None] | (np.arange(4) == 0), trace.values, 1e6))
    found = evaluate_cascade(service(), TraceSet(name="set", traces=(spoilt,)), repeats=0)
    assert found.mse("BC")["case 0"] < 4.0 * NOISE**2
    assert np.isnan(found.outputs["BC"].cases["case 0"].run_time_s)
    assert found.outputs["BC"].cases["case 0"].to_dict()["n_samples"] == 40


def test_active_limits_are_reported_by_case(traces):
    found = evaluate_cascade(replace(service(), limits={"BP": Limit(low=85.0)}), traces, repeats=1)
    assert set(found.held) == {"case 0", "case 1"}
    assert found.held["case 0"][0].startswith("BP at its lower limit for ")


def test_outputs_that_are_not_measured_are_left_out(traces):
    names = ["STP", "BC"]
    fewer = [replace(t, channels=tuple(t.channel(n) for n in names), values=t.columns(names)) for t in traces]
    found = evaluate_cascade(service(), TraceSet(name="fewer", traces=fewer), repeats=1)
    assert list(found.outputs) == ["BC"]
    with pytest.raises(ChannelError, match="missing channel AR"):
        found.mse("AR")
    with pytest.raises(ChannelError, match="missing channel XX"):
        evaluate_cascade(service(), traces, outputs=["XX"])


def test_traces_without_any_output_are_refused():
    trace = Trace(name="a", sample_time=0.1, channels=(Channel(name="STP", unit="psi"),), values=command())
    with pytest.raises(ChannelError, match="missing channel"):
        evaluate_cascade(service(), TraceSet(name="set", traces=(trace,)))
