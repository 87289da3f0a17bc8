"""A network of several outputs against systems that are one, and against networks of one output."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sysid.errors import ConfigError
from sysid.estimation import Loop, Training, fit_narx
from sysid.estimation.networks.basis import RegressorBasis
from sysid.estimation.networks.initialise import Layout
from sysid.estimation.networks.pretraining import StepSamples
from sysid.estimation.networks.provider import RecursionProvider
from sysid.estimation.networks.warm_start import grown
from sysid.estimation.records.experiment import Experiment
from sysid.models import NARX, History, Mapping, Start, StartKind, VectorNARX, beginning
from sysid.models.contract.column_recursion import ColumnRecursion
from sysid.models.store import model_from_dict
from sysid.testing import finite_difference_jacobian
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.validation.evaluation import evaluate_outputs
from sysid.validation.intervals import predict_interval
from tests.models.cascades.cascades import block, command, network
from tests.traces.made import trace_of

MAPPING = Mapping.parse("u -> x+y")


def coupled(n: int = 800, seed: int = 0) -> Trace:
    """Two reservoirs that fill each other within a sample, one of them through a restriction that bends."""
    u = command(n, 1, seed)[:, 0] - 77.0
    x, y = np.zeros(n), np.zeros(n)
    for t in range(1, n):
        flow = 0.15 * (x[t - 1] - y[t - 1]) / (1.0 + 0.1 * abs(x[t - 1] - y[t - 1]))
        x[t] = x[t - 1] + 0.2 * (u[t] - x[t - 1]) - flow
        y[t] = y[t - 1] + flow
    return trace_of({"u": u, "x": x, "y": y}, name=f"record {seed}", sample_time=0.1, units="psi")


NETWORK = VectorNARX(input_delays=[0], output_delays=1, neurons=4)


def between_stops(n: int = 600, seed: int = 0) -> Trace:
    """A slide that is pushed through a lag, and stands at its stops; how fast it is pushed is measured beside it."""
    u = np.repeat(np.random.default_rng(seed).uniform(-1.0, 1.0, n // 10), 10)
    x, v, values = 2.0, 0.0, []
    for push in u:
        v = 0.8 * v + 0.1 * push
        x = min(max(x + v, 0.0), 4.0)
        values.append((push, x, v))
    channels = tuple(Channel(name=name, unit=unit) for name, unit in (("u", "V"), ("x", "mm"), ("y", "mm/s")))
    return Trace(name=f"slide {seed}", sample_time=0.1, channels=channels, values=np.array(values))


def test_outputs_are_held_at_their_ends_inside_the_recursion_the_others_are_free():
    held, free = (replace(NETWORK, limits=limits) for limits in ("found", None))
    rest, options = {"x": 2.0, "y": 0.0}, Training(max_iterations=60)
    records = [between_stops(), between_stops(seed=1)]
    fits = [fit_narx(records, MAPPING, one, options, rest_output=rest) for one in (held, free)]
    assert {name: (one.low, one.high) for name, one in fits[0].model.limits.items()} == {"x": (0.0, 4.0)}
    assert "The free run of x is held at 0 mm from below and at 4 mm from above." in fits[0].notes
    unseen = between_stops(seed=5)
    runs = [fit.model.run_from(unseen.columns(["u"]), np.array([2.0, 0.0])) for fit in fits]
    off = [np.sqrt(np.mean((run[:, 0] - unseen["x"]) ** 2)) / 4.0 for run in runs]
    assert off[0] < 0.2 * off[1]
    assert (runs[0][:, 0].min(), runs[0][:, 0].max()) == (0.0, 4.0)  # to the last bit
    again = model_from_dict(fits[0].model.to_dict())
    assert_array_equal(again.run_from(unseen.columns(["u"]), np.array([2.0, 0.0])), runs[0])
    before = History.at_rest(inputs=np.zeros(1), output=np.array([2.0, 0.0]))
    ahead = again.predict(unseen.columns(["u"]), unseen.columns(["x", "y"]), before)
    assert 0.0 <= ahead[:, 0].min() < ahead[:, 0].max() <= 4.0
    named = replace(NETWORK, limits={"x": [0, None]})
    assert VectorNARX(**{k: v for k, v in named.to_dict().items() if k != "kind"}) == named
    with pytest.raises(ConfigError, match="which is no output"):
        fit_narx([between_stops()], MAPPING, replace(NETWORK, limits={"z": [0, 1]}), options)
    with pytest.raises(ConfigError, match="stands at no end"):
        fit_narx([coupled()], MAPPING, held, options)
    with pytest.raises(ConfigError, match="not limits of several outputs"):
        replace(NETWORK, limits=[0, 1])


def test_a_coupled_system_is_found_in_free_run():
    training = Training(max_iterations=60, starts=2)
    fit = fit_narx([coupled(), coupled(seed=1)], MAPPING, NETWORK, training, selection=[coupled(seed=2)])
    unseen = coupled(seed=3)
    run = fit.model.simulate(unseen.columns(["u"]))
    for column, name in enumerate(("x", "y")):
        assert np.mean((run[:, column] - unseen[name]) ** 2) < 1e-3 * np.var(unseen[name])
    assert fit.seed in {0, 1}
    assert len(fit.attempts) >= 2
    again = fit_narx([coupled()], MAPPING, NETWORK, Training(max_iterations=2), initial=fit)
    assert again.seed is None
    with pytest.raises(ConfigError, match="not contained"):
        fit_narx([coupled()], MAPPING, NETWORK, initial=replace(fit, model=block("u -> x+y")))


def test_a_fit_is_its_seed():
    training = Training(max_iterations=4, seed=5)
    one, two = (fit_narx([coupled()], MAPPING, NETWORK, training).model.theta for _ in range(2))
    assert_array_equal(one, two)


def test_layout_of_a_single_output_is_that_of_a_network_alone():
    model = network("BP+AR -> BC", neurons=4)
    layout = Layout.of_member(model, ColumnRecursion.of(model))
    plain = Layout.of(model.network, 2)
    assert replace(layout, name="") == plain
    assert layout.n_parameters == model.n_parameters
    ours = {group.name.removeprefix("BC: "): group.members.tolist() for group in layout.groups(0)}
    theirs = {g.name: g.members.tolist() for g in plain.prior(plain.centre(), alpha=1.0, beta=1.0).groups}
    assert ours == theirs


@pytest.mark.parametrize(
    "model", [block("BP -> AR+BC"), block("BP -> AR+BC", feedthrough=False)], ids=["linear", "not"]
)
def test_groups_cover_every_parameter_once(model):
    layout = Layout.of_member(model, ColumnRecursion.of(model))
    members = np.concatenate([group.members for group in layout.groups(0)])
    assert sorted(members.tolist()) == list(range(model.n_parameters))


def test_the_centre_holds_every_output():
    model = block("BP -> AR+BC", output_delays=[[1, 2], [1, 3, 4]])
    layout = Layout.of_member(model, ColumnRecursion.of(model))
    w = layout.centre()[-2 * layout.lags.n_regressors :].reshape(2, -1)
    assert_allclose(w, [[0, 0, 1, 0, 0, 0, 0], [0, 0, 0, 0, 1, 0, 0]])


@pytest.mark.parametrize(
    ("fields", "n", "match"),
    [
        pytest.param({"output_delays": 0}, (1, 2), "not a set of lags", id="no lag"),
        pytest.param({"output_delays": [[1], [2], [3]]}, (1, 2), "sets of output delays", id="sets of another number"),
        pytest.param({"input_delays": [[1], [2]]}, (1, 2), "sets of input delays", id="input sets of another number"),
        pytest.param({"neurons": -1}, (1, 2), "not a number of neurons", id="negative neurons"),
    ],
)
def test_structures_that_cannot_be_are_refused(fields, n, match):
    with pytest.raises(ConfigError, match=match):
        VectorNARX(**({"input_delays": 2, "output_delays": 2, "neurons": 2} | fields)).lags(*n)


FREE = Start(kind=StartKind.ESTIMATED)


def off_balance(seed: int, n: int = 60, noise: float = 0.0) -> Trace:
    """A burst of two linear reservoirs that begins anywhere."""
    rng = np.random.default_rng(seed)
    u, z = np.repeat(rng.uniform(-1.0, 1.0, n // 5), 5)[:, None], rng.uniform(-2.0, 2.0, 2)
    values = np.empty((n, 3))
    for t in range(n):
        values[t] = [u[t, 0], *z]
        z = np.array([[0.9, 0.1], [-0.2, 0.8]]) @ z + np.array([0.1, 0.3]) * u[t]
    values[:, 1:] += noise * rng.standard_normal((n, 2))
    return replace(coupled(n), name=f"burst {seed}", values=values)


ONE_LAG = VectorNARX(input_delays=[1], output_delays=1, neurons=1)


@pytest.mark.parametrize("start", [FREE, Start(kind=StartKind.MEASURED, n_measured=5)], ids=["estimated", "measured"])
def test_records_may_begin_out_of_equilibrium(start):
    """Nothing is taken for granted of what came before: held at its first sample it would be another system."""
    bursts = [off_balance(seed) for seed in (1, 2, 3)]
    fit = fit_narx(bursts, MAPPING, ONE_LAG, Training(max_iterations=60), start=start)
    unseen = off_balance(4)
    begun = beginning(fit.model, unseen.columns(["u"]), unseen.columns(["x", "y"]), start)
    run = fit.model.simulate(unseen.columns(["u"])[begun.first :], begun.history)
    assert_allclose(run, unseen.columns(["x", "y"])[begun.first :], atol=4e-4)


def test_the_outputs_have_intervals_that_hold_what_is_measured():
    training = Training(max_iterations=40)
    noisy = [off_balance(seed, 200, noise=0.05) for seed in range(3)]
    fit = fit_narx(noisy, MAPPING, ONE_LAG, training, start=FREE)
    for loop in Loop:
        unseen = off_balance(7, 200, noise=0.05)
        interval = predict_interval(fit, unseen, loop=loop, start=FREE)
        target = unseen.columns(["x", "y"])[-len(interval.output) :]
        for one, measured in zip(interval.of_outputs(), target.T, strict=True):
            assert 0.9 < one.coverage(measured).share <= 1.0
            assert one.coverage(measured).mean_half_width < 0.2
    held = evaluate_outputs(fit.model, of(unseen), FREE, posterior=fit.posterior)
    assert all(found.cases[unseen.name].intervals is not None for found in held.values())


def of(trace: Trace) -> TraceSet:
    return TraceSet(name="unseen", traces=(trace,), roles={trace.name: Role.VALIDATION}, source="")


@pytest.mark.parametrize("closed", [True, False], ids=["free run", "one step ahead"])
@pytest.mark.parametrize("between", [(), ((-0.5, 0.6), (None, None))], ids=["free", "one held"])
def test_sensitivities_of_records_that_begin_measured_equal_finite_differences(closed, between):
    form = replace(block("u -> x+y", output_delays=[[1, 3], [2]]), between=between).recursion
    bursts = [Experiment.from_trace(off_balance(seed), MAPPING, FREE, np.zeros(2)) for seed in (1, 2)]
    provider = RecursionProvider(template=form, experiments=bursts, closed=closed, output_weights=(1.0, 0.25), stride=2)
    theta = 0.3 * np.random.default_rng(0).standard_normal(len(form.theta))
    assert provider.n_samples == 2 * 2 * len(range(0, 60 - form.lags.depth, 2))
    assert_allclose(provider.jacobian(theta), finite_difference_jacobian(provider.residuals, theta), atol=1e-6)


def test_one_step_residuals_of_several_outputs_have_their_derivatives():
    model, record = block("u -> x+y"), Experiment.from_trace(off_balance(1), MAPPING, FREE, np.zeros(2))
    layout = Layout.of(model.network, 1, 2)
    gaps = np.ones((60, 2))
    gaps[20:30, 1] = 0.0
    seen = replace(record, each=gaps).from_measured(layout.columns)
    samples = StepSamples.of(model, [seen], layout, RegressorBasis.identity(layout.lags), samples=10_000, seed=0)
    depth = layout.columns.depth
    assert samples.n_samples == 2 * (60 - depth) - 10
    theta = 0.3 * np.random.default_rng(0).standard_normal(layout.n_parameters)
    at = samples.linearise(theta)
    gradient = [(samples.loss(theta + step) - samples.loss(theta - step)) / 2e-6 for step in 1e-6 * np.eye(len(theta))]
    assert_allclose(at.gradient, gradient, rtol=1e-6, atol=1e-6)


def test_a_sample_that_is_masked_for_one_output_counts_for_the_other():
    trace = off_balance(1)
    masked = replace(trace, usable=np.column_stack([np.ones((60, 2), dtype=bool), np.arange(60) < 40]))
    record = Experiment.from_trace(masked, MAPPING, FREE, np.zeros(2))
    provider = RecursionProvider(template=block("u -> x+y").recursion, experiments=[record], closed=True)
    depth = block("u -> x+y").lags.depth
    assert provider.n_samples == (60 - depth) + (40 - depth)


@pytest.mark.parametrize(
    "options",
    [
        pytest.param({"loop": Loop.OPEN}, id="one step ahead"),
        pytest.param({"pretraining": 100, "pretraining_iterations": 5}, id="pretraining"),
        pytest.param({"offsets": [{"u": 0.1, "x": 0.1}]}, id="offsets"),
        pytest.param({"stride": 3}, id="stride"),
        pytest.param({"regularisation": 0.01}, id="regularisation"),
        pytest.param({"basis": "plain"}, id="plain basis"),
        pytest.param({"window": 40}, id="windows"),
        pytest.param({"starts": 3, "ensemble": 3}, id="ensemble"),
        pytest.param({"starts": 3, "input_subsets": [["u"]]}, id="subsets of inputs"),
    ],
)
def test_every_option_of_a_network_is_for_several_outputs_too(options):
    two = Mapping.parse("u+w -> x+y")
    one = coupled(400)
    wide = [with_channel(record, "w") for record in (one, coupled(400, 1))]
    training = Training(**{"max_iterations": 30} | options)
    fit = fit_narx(wide[:1], two, replace(NETWORK, input_delays=((0,), (0, 1))), training, selection=wide[1:])
    run = fit.model.simulate(wide[1].columns(two.inputs))
    off = np.mean((run - wide[1].columns(two.outputs)) ** 2, axis=0) / np.var(wide[1].columns(two.outputs), axis=0)
    assert off.max() < 0.1
    assert type(fit.model).__name__ == "VectorNARXModel"


def with_channel(record: Trace, name: str) -> Trace:
    """A record with one more channel, of noise."""
    more = np.random.default_rng(9).standard_normal((len(record), 1))
    channels = (*record.channels, Channel(name=name, unit="psi"))
    return replace(record, channels=channels, values=np.column_stack([record.values, more]))


def test_a_noisy_output_does_not_blur_what_a_clean_one_shows(monkeypatch):
    noises, rng, offs = np.array([0.0, 1.0, 0.005]), np.random.default_rng(0), {}
    records = [off_balance(seed) for seed in range(6)]
    noisy = [replace(one, values=one.values + noises * rng.standard_normal(one.values.shape)) for one in records]
    unseen = off_balance(7)
    for rounds in (0, 3):
        monkeypatch.setattr("sysid.estimation.networks.starts.output_weights.ROUNDS", rounds)
        fit = fit_narx(noisy, MAPPING, ONE_LAG, Training(max_iterations=60), start=FREE)
        begun = beginning(fit.model, unseen.columns(["u"]), unseen.columns(["x", "y"]), FREE)
        run = fit.model.simulate(unseen.columns(["u"])[begun.first :], begun.history)
        offs[rounds] = np.sqrt(np.mean((run[:, 1] - unseen["y"][begun.first :]) ** 2))
    assert offs[3] < 0.7 * offs[0]


def test_a_network_of_one_output_is_one_network_where_there_are_several():
    plain = NARX(input_delays="0:1", output_delays=2, neurons=4, activation="cubic")
    several = plain.for_outputs(2)
    assert several == VectorNARX(input_delays="0:1", output_delays=2, neurons=4, activation="cubic")
    assert plain.for_outputs(1) is plain
    assert replace(plain, limits="found").for_outputs(3).limits == "found"
    for own in (replace(plain, gated=True), replace(plain, limits=(0.0, 1.0))):
        assert own.for_outputs(2) is own


@pytest.mark.parametrize(
    "smaller",
    [replace(NETWORK, neurons=0), replace(NETWORK, neurons=2), replace(NETWORK, feedthrough=False)],
    ids=lambda one: one.label,
)
def test_a_network_begins_as_a_smaller_one_of_other_records(smaller):
    first = fit_narx([coupled(300)], MAPPING, smaller, Training(max_iterations=20))
    wider = [replace(coupled(300, 1), values=1.5 * coupled(300, 1).values)]
    layout = Layout.of(NETWORK, 1, 2)
    fresh = layout.draw(np.random.default_rng(0), layout.centre())
    fresh[layout.readout] = 0.0
    fit = fit_narx(wider, MAPPING, NETWORK, Training(max_iterations=1), initial=first)
    grew = replace(fit.model, theta=grown(first.model.recursion, fit.model.recursion, fresh))
    inputs = wider[0].columns(["u"])
    assert_allclose(grew.simulate(inputs), first.model.simulate(inputs), atol=1e-9)
    assert fit.seed is None
