"""A network of several outputs against systems that are one, and against networks of one output."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sysid.errors import ConfigError
from sysid.estimation import JointTraining, Loop, fit_vector_narx
from sysid.estimation.networks.initialise import Layout
from sysid.estimation.records.experiment import Experiment
from sysid.models import Cascade, History, Mapping, Start, StartKind, VectorNARX, beginning
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
    rest, options = {"x": 2.0, "y": 0.0}, JointTraining(max_iterations=60)
    records = [between_stops(), between_stops(seed=1)]
    fits = [fit_vector_narx(records, MAPPING, one, options, rest_output=rest) for one in (held, free)]
    assert {name: (one.low, one.high) for name, one in fits[0].model.limits.items()} == {"x": (0.0, 4.0)}
    assert "The free run of x is held at 0 mm from below and at 4 mm from above." in fits[0].notes
    unseen = between_stops(seed=5)
    runs = [fit.model.run_from(unseen.columns(["u"]), np.array([2.0, 0.0])) for fit in fits]
    off = [np.sqrt(np.mean((run[:, 0] - unseen["x"]) ** 2)) / 4.0 for run in runs]
    assert off[0] < 0.01 < off[1]
    assert (runs[0][:, 0].min(), runs[0][:, 0].max()) == (0.0, 4.0)  # to the last bit
    again = model_from_dict(fits[0].model.to_dict())
    assert_array_equal(again.run_from(unseen.columns(["u"]), np.array([2.0, 0.0])), runs[0])
    before = History.at_rest(inputs=np.zeros(1), output=np.array([2.0, 0.0]))
    ahead = again.predict(unseen.columns(["u"]), unseen.columns(["x", "y"]), before)
    assert 0.0 <= ahead[:, 0].min() < ahead[:, 0].max() <= 4.0
    named = replace(NETWORK, limits={"x": [0, None]})
    assert VectorNARX(**{k: v for k, v in named.to_dict().items() if k != "kind"}) == named
    with pytest.raises(ConfigError, match="which is no output"):
        fit_vector_narx([between_stops()], MAPPING, replace(NETWORK, limits={"z": [0, 1]}), options)
    with pytest.raises(ConfigError, match="stands at no end"):
        fit_vector_narx([coupled()], MAPPING, held, options)
    with pytest.raises(ConfigError, match="not limits of several outputs"):
        replace(NETWORK, limits=[0, 1])


def test_a_coupled_system_is_found_in_free_run():
    training = JointTraining(max_iterations=60, starts=2)
    fit = fit_vector_narx([coupled(), coupled(seed=1)], MAPPING, NETWORK, training, selection=[coupled(seed=2)])
    unseen = coupled(seed=3)
    run = fit.model.simulate(unseen.columns(["u"]))
    for column, name in enumerate(("x", "y")):
        assert np.mean((run[:, column] - unseen[name]) ** 2) < 1e-3 * np.var(unseen[name])
    assert fit.seed in {0, 1}
    assert len(fit.notes) >= 3
    again = fit_vector_narx([coupled()], MAPPING, NETWORK, JointTraining(max_iterations=2, checkpoints=1), initial=fit)
    assert again.seed is None
    with pytest.raises(ConfigError, match="another structure"):
        fit_vector_narx([coupled()], MAPPING, NETWORK, initial=replace(fit, model=block("u -> x+y")))


def test_a_fit_is_its_seed():
    training = JointTraining(max_iterations=4, checkpoints=2, seed=5)
    one, two = (fit_vector_narx([coupled()], MAPPING, NETWORK, training).model.theta for _ in range(2))
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


def test_a_record_on_which_the_run_is_lost_counts_less_in_a_robust_loss():
    shifted = coupled(seed=1)
    lost = Trace(
        name="shifted",
        sample_time=0.1,
        channels=shifted.channels,
        values=shifted.values + np.where(np.arange(len(shifted)) > 400, 20.0, 0.0)[:, None] * [0.0, 1.0, 1.0],
    )
    plain, robust = (
        fit_vector_narx([coupled(), lost], MAPPING, NETWORK, JointTraining(max_iterations=3, robust_scale=margin)).model
        for margin in (np.inf, 1.0)
    )
    assert not np.array_equal(plain.theta, robust.theta)


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
    fit = fit_vector_narx(bursts, MAPPING, ONE_LAG, JointTraining(max_iterations=60), start=start)
    unseen = off_balance(4)
    begun = beginning(fit.model, unseen.columns(["u"]), unseen.columns(["x", "y"]), start)
    run = fit.model.simulate(unseen.columns(["u"])[begun.first :], begun.history)
    assert_allclose(run, unseen.columns(["x", "y"])[begun.first :], atol=4e-4)


def test_sensitivities_of_records_that_begin_measured_equal_finite_differences():
    bursts = [off_balance(1), off_balance(2)]
    model = block("u -> x+y", output_delays=[[1, 3], [2]])
    lags = model.lags

    def record(trace: Trace) -> Experiment:
        return Experiment.from_trace(trace, MAPPING, FREE, np.zeros(2)).from_measured(lags)

    provider = JointTraining().provider(Cascade(models=(model,)), bursts, {"x": 1.0, "y": 2.0}, measured=record)
    theta = 0.3 * np.random.default_rng(0).standard_normal(len(provider.theta))
    assert provider.n_samples == 2 * (2 * 60 - 2 * lags.depth)
    assert_allclose(provider.jacobian(theta), finite_difference_jacobian(provider.residuals, theta), atol=1e-6)


def test_the_outputs_have_intervals_that_hold_what_is_measured():
    training = JointTraining(max_iterations=40)
    noisy = [off_balance(seed, 200, noise=0.05) for seed in range(3)]
    fit = fit_vector_narx(noisy, MAPPING, ONE_LAG, training, start=FREE)
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


def test_windows_lead_a_start_of_a_network_of_several_outputs() -> None:
    options = JointTraining(max_iterations=5, windows=(40, 160))
    for start in (None, Start(kind=StartKind.ESTIMATED)):
        fit = fit_vector_narx([coupled(400)], MAPPING, NETWORK, options, start=start, selection=[coupled(400, 1)])
        assert any("windows of 40, 160 samples" in note for note in fit.notes)
        assert {one.start for one in fit.attempts} == {1, 2}


def test_a_drawn_start_is_not_taken_for_one_that_is_lost() -> None:
    fit = fit_vector_narx([coupled(400)], MAPPING, NETWORK, JointTraining(max_iterations=5))
    assert not any("windows" in note for note in fit.notes)


def test_without_selection_traces_nothing_is_said_of_an_error_there() -> None:
    options = JointTraining(max_iterations=5, starts=2)
    alone = fit_vector_narx([coupled(400)], MAPPING, NETWORK, options).notes
    assert not any("nan" in note or "selection" in note for note in alone)
    assert any("mean squared residual (iterations): " in note for note in alone)
    chosen = fit_vector_narx([coupled(400)], MAPPING, NETWORK, options, selection=[coupled(400, 1)]).notes
    assert any("error on the selection traces (iterations): " in note for note in chosen)
