"""Members trained together through each other; one retrained on what comes from upstream."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sysid.errors import ConfigError
from sysid.estimation import CascadeFit, JointTraining, Status, fit_cascade
from sysid.estimation.networks.together.leading_windows import lengths
from sysid.estimation.networks.together.provider import CascadeProvider
from sysid.estimation.networks.training import FitProgress
from sysid.models import Cascade
from tests.models.cascades.cascades import command, linear, network, service

TRUTH = service()
TRAINING = JointTraining(max_iterations=20, checkpoints=4, windows=())


def measured(cascade: Cascade = TRUTH, n: int = 400, seed: int = 0):
    """What a system puts out that is a cascade itself."""
    return cascade.simulate(command(n, len(cascade.inputs), seed)).trace(f"record {seed}")


def disturbed(cascade: Cascade = TRUTH, seed: int = 7, by: float = 0.02) -> Cascade:
    """The same cascade, all parameters a little off."""
    one = CascadeProvider(cascade=cascade, traces=(measured(n=5),), errors=dict.fromkeys(cascade.outputs, 1.0))
    return one.at(one.theta + by * np.random.default_rng(seed).standard_normal(len(one.theta)))


def mse(cascade: Cascade, trace, name: str = "BC") -> float:
    return float(np.mean((cascade.simulate_trace(trace)[name] - trace[name]) ** 2))


@pytest.fixture(scope="module")
def fit() -> CascadeFit:
    return fit_cascade(disturbed(), [measured(), measured(seed=1)], training=TRAINING, selection=[measured(seed=2)])


def test_training_together_lowers_the_error_of_every_output_on_unseen_commands(fit):
    unseen = measured(seed=3)
    for name in TRUTH.outputs:
        assert mse(fit.model, unseen, name) < 0.01 * mse(disturbed(), unseen, name)
    assert fit.status.usable
    assert fit.seed is None


def test_the_curve_falls(fit):
    assert np.all(np.diff(fit.history["loss"]) <= 1e-12)
    assert len({len(column) for column in fit.history.values()}) == 1


def test_the_prior_has_groups_for_every_member(fit):
    assert {name.split(":")[0] for name in fit.evidence.alphas} == {"BP", "AR", "BC"}


def test_the_fit_survives_storing(fit):
    again = CascadeFit.from_dict(json.loads(json.dumps(fit.to_dict())))
    unseen = measured(seed=3)
    assert_array_equal(again.model.simulate_trace(unseen).values, fit.model.simulate_trace(unseen).values)
    assert (again.status, again.errors, again.notes) == (fit.status, fit.errors, fit.notes)
    assert repr(again.attempts) == repr(fit.attempts), "every start at every checkpoint"
    assert sum(one.chosen for one in fit.attempts) == 1


def test_the_downstream_target_alone_moves_upstream_members():
    start = disturbed()
    fit = fit_cascade(start, [measured()], targets=["BC"], training=TRAINING)
    assert mse(fit.model, measured()) < 0.01 * mse(start, measured())
    assert not np.array_equal(fit.model.member("BP").theta, start.member("BP").theta)


def test_members_that_are_not_trained_stay():
    start = disturbed()
    fit = fit_cascade(start, [measured()], targets={"BC": 0.1}, trained=["BC"], training=TRAINING)
    assert fit.errors == {"BC": 0.1}
    for name in ("BP", "AR"):
        assert_array_equal(fit.model.member(name).theta, start.member(name).theta)
    assert mse(fit.model, measured()) < mse(start, measured())


def test_a_start_that_the_selection_traces_prefer_is_kept():
    # The estimation record belongs to another system: training on it can only lead away.
    other = measured(disturbed(seed=11, by=0.1))
    fit = fit_cascade(TRUTH, [other], training=TRAINING, selection=[measured(seed=2)])
    assert fit.status is Status.NOT_IMPROVED
    assert_array_equal(fit.model.simulate_trace(other).values, TRUTH.simulate_trace(other).values)


def test_what_is_exactly_right_does_not_outweigh_the_rest():
    """A state that is exact on every selection trace scores as one that is right to a thousandth of what counts."""
    errors = dict.fromkeys(TRUTH.outputs, 0.5)
    fit = fit_cascade(
        TRUTH, [measured()], targets=errors, training=replace(TRAINING, max_iterations=1), selection=[measured(seed=2)]
    )
    assert [one.selection_mse for one in fit.attempts if one.chosen] == [pytest.approx(1e-6)]


def test_a_fit_is_the_same_every_time():
    training = replace(TRAINING, max_iterations=4, checkpoints=2)
    results = [fit_cascade(disturbed(), [measured(), measured(seed=1)], training=training) for _ in range(2)]
    assert_array_equal(*(one.model.simulate_trace(measured()).values for one in results))


def test_strides_find_the_same_system():
    fit = fit_cascade(disturbed(), [measured()], training=replace(TRAINING, stride=5))
    assert mse(fit.model, measured(seed=3)) < 0.05 * mse(disturbed(), measured(seed=3))


def test_a_cascade_with_a_linear_member_is_trained_too():
    truth = Cascade(models=(network("STP -> BP", seed=1), linear("BP -> BC")))
    start = truth.with_member(replace(linear("BP -> BC"), coefficients=np.array([0.12, 0.04, 0.55, 0.28])))
    record = truth.simulate(command(400)).trace("a")
    fit = fit_cascade(start, [record], training=replace(TRAINING, max_iterations=60))
    assert mse(fit.model, record) < 1e-3 * mse(start, record)


@pytest.mark.parametrize(("seed", "by"), [(2, 0.1), (2, 0.2), (3, 0.2), (0, 0.4)])
def test_a_whole_that_goes_astray_is_led_back_by_windows(seed: int, by: float) -> None:
    """Three times the iterations over whole traces stay lost, or far behind."""
    start, traces, unseen = disturbed(seed=seed, by=by), [measured(), measured(seed=1)], measured(seed=3)
    short, long = replace(TRAINING, max_iterations=15, windows=(20, 80)), replace(TRAINING, max_iterations=45)
    ours, plain = (
        fit_cascade(start, traces, training=training, selection=[measured(seed=2)]) for training in (short, long)
    )
    errors = [max(mse(one.model, unseen, name) for name in TRUTH.outputs) for one in (ours, plain)]
    assert errors[0] < 0.01
    assert errors[0] < errors[1]
    assert any("what windows led to" in note for note in ours.notes)
    assert {(one.start, one.seed) for one in ours.attempts} == {(1, None), (2, None)}
    assert ours.seed is None, "neither start was drawn"


@pytest.mark.parametrize(("seed", "by"), [(2, 0.2), (0, 0.4)])
def test_a_start_that_is_far_off_is_led_back_unasked_and_that_is_told(seed: int, by: float) -> None:
    start, traces, unseen = disturbed(seed=seed, by=by), [measured(), measured(seed=1)], measured(seed=3)
    ours, plain = (
        fit_cascade(start, traces, training=replace(TRAINING, windows=windows), selection=[measured(seed=2)])
        for windows in ("auto", ())
    )
    errors = [max(mse(one.model, unseen, name) for name in TRUTH.outputs) for one in (ours, plain)]
    assert errors[0] < 0.02
    assert errors[0] < 0.1 * errors[1]
    assert any("goes astray" in note and "windows: [] for none" in note for note in ours.notes)


def test_a_start_that_runs_well_is_trained_as_without_windows() -> None:
    start, traces = disturbed(by=0.001), [measured(), measured(seed=1)]
    fits = [fit_cascade(start, traces, training=replace(TRAINING, windows=one)) for one in ("auto", ())]
    assert_array_equal(*(one.model.simulate_trace(measured()).values for one in fits))
    assert [len(one.attempts) for one in fits] == [len(fits[1].attempts)] * 2
    assert not any("windows" in note for note in fits[0].notes)


def test_the_start_that_was_given_stays_in_the_race_with_what_windows_led_to() -> None:
    fit = fit_cascade(disturbed(), [measured()], training=replace(TRAINING, windows=(20, 80)), targets=["BC"])
    assert [max(a.iterations for a in fit.attempts if a.start == start) for start in (1, 2)] == [20, 20]


def test_records_too_short_to_be_cut_have_no_windows() -> None:
    short = measured(n=15)
    assert lengths([short], TRUTH.outputs) == ()
    fit = fit_cascade(disturbed(by=0.4), [short], training=replace(TRAINING, windows="auto", max_iterations=2))
    assert {one.start for one in fit.attempts} == {1}


def test_windows_are_longer_where_targets_remember_longer() -> None:
    quick, slow = measured(n=600), measured(n=600)
    values = slow.values.copy()
    column = slow.index("BC")
    values[:, column] = np.repeat(np.random.default_rng(0).standard_normal(5), 120)
    slow = replace(slow, values=values)
    assert lengths([quick], ["BC"])[0] < lengths([slow], ["BC"])[0]
    assert all(one <= 300 for some in (quick, slow) for one in lengths([some], ["BC"]))


def test_an_interruption_on_windows_ends_the_fit() -> None:
    told = []

    def interrupt(progress: FitProgress) -> None:
        told.append(progress.iteration)
        if progress.iteration == 2:
            raise KeyboardInterrupt

    training = replace(TRAINING, windows=(20, 80))
    fit = fit_cascade(disturbed(), [measured()], training=training, on_progress=interrupt)
    assert (fit.status, told[-1], told.count(2)) == (Status.INTERRUPTED, 2, 1)
    assert_array_equal(fit.model.member("BP").theta, disturbed().member("BP").theta)


def test_windows_never_take_a_better_start_away() -> None:
    other = measured(disturbed(seed=11, by=0.1))
    fit = fit_cascade(TRUTH, [other], training=replace(TRAINING, windows=(20, 80)), selection=[measured(seed=2)])
    assert fit.status is Status.NOT_IMPROVED
    assert_array_equal(fit.model.simulate_trace(other).values, TRUTH.simulate_trace(other).values)


@pytest.mark.parametrize(
    "fields",
    [
        {"stride": 0},
        {"moves": 0.0},
        {"windows": (1,)},
        {"windows": (80, 20)},
        {"windows": (20, 20)},
        {"windows": "often"},
    ],
    ids=str,
)
def test_training_that_cannot_be_is_refused(fields):
    with pytest.raises(ConfigError):
        JointTraining(**fields)


@pytest.mark.parametrize(
    "asked", [{"stride": 3}, {"moves": 2.0}, {"leverage": 9.0}, {"robust_scale": 0.5}, {"workers": 1}], ids=str
)
def test_every_option_that_says_what_counts_reaches_the_residuals(asked: dict[str, float]) -> None:
    provider = JointTraining(**asked).provider(TRUTH, [measured(n=50)], {"BC": 1.0}, ["BC"])
    ((name, value),) = asked.items()
    assert getattr(provider, name) == value
    assert (provider.trained, dict(provider.errors)) == (("BC",), {"BC": 1.0})
