"""Fitting networks: what is learnt, what is chosen, what an interruption leaves."""

import signal
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sysid.errors import ChannelError, ConfigError
from sysid.estimation import Loop, Status, Training, fit_narx
from sysid.estimation.networks.starts.advancing import judged
from sysid.estimation.networks.starts.choosing import rank
from sysid.estimation.networks.starts.multistart import Place
from sysid.models import NARX, Start, StartKind
from sysid.traces import Trace
from tests.estimation.tank import TANK, tank

SMALL = NARX(input_delays=1, output_delays=1, neurons=4)


def free_run_mse(fit, trace: Trace) -> float:
    return float(np.mean((fit.model.simulate(trace.columns(["pump"])) - trace["level"]) ** 2))


def test_a_closed_loop_fit_predicts_a_record_it_has_not_seen():
    records = [tank(1), tank(4), tank(5)]
    fit = fit_narx(records, TANK, SMALL, Training(max_iterations=150, starts=4), selection=[tank(2)])
    unseen = tank(3)
    assert free_run_mse(fit, unseen) < 1e-3 * np.var(unseen["level"])
    assert fit.loop is Loop.CLOSED
    assert fit.status.usable
    assert fit.evidence is not None
    assert 0.0 < fit.evidence.total_effective_parameters <= fit.model.n_parameters


def test_the_learning_curve_ends_at_the_error_of_the_model():
    fit = fit_narx([tank(1)], TANK, SMALL, Training(max_iterations=20))
    assert fit.history["mse"][-1] == pytest.approx(free_run_mse(fit, tank(1)), rel=1e-9)
    assert len({len(column) for column in fit.history.values()}) == 1


def test_the_open_loop_minimises_the_one_step_error_and_the_closed_loop_the_free_run():
    trace = tank(1)
    fits = {loop: fit_narx([trace], TANK, SMALL, Training(loop=loop, max_iterations=60)) for loop in Loop}
    inputs = trace.columns(["pump"])

    def one_step(fit) -> float:
        return float(np.mean((fit.model.predict(inputs, trace["level"]) - trace["level"]) ** 2))

    assert one_step(fits[Loop.OPEN]) < one_step(fits[Loop.CLOSED])
    assert free_run_mse(fits[Loop.CLOSED], trace) < free_run_mse(fits[Loop.OPEN], trace)


@pytest.mark.parametrize("workers", [1, 2], ids=["one worker", "two workers"])
def test_the_seed_decides_and_not_the_number_of_workers(workers):
    training = Training(max_iterations=25, starts=3, seed=5, workers=workers)
    fit = fit_narx([tank(1)], TANK, SMALL, training, selection=[tank(2)])
    again = fit_narx([tank(1)], TANK, SMALL, Training(max_iterations=25, starts=3, seed=5), selection=[tank(2)])
    np.testing.assert_array_equal(fit.model.theta, again.model.theta)
    assert fit.seed in {5, 6, 7}


def test_a_repeated_fit_is_the_same_to_the_last_bit_wherever_its_arrays_lie():
    fits, elsewhere = [], []
    for size in (0, 17, 1001, 4096):
        elsewhere.append(np.empty(size))
        fits.append(fit_narx([tank(1)], TANK, SMALL, Training(max_iterations=10)))
    assert all(np.array_equal(fit.model.theta, fits[0].model.theta) for fit in fits)


def test_what_is_chosen_has_the_least_error_on_the_selection_traces():
    selection = [tank(2), tank(4)]
    fit = fit_narx([tank(1)], TANK, SMALL, Training(max_iterations=40, starts=4), selection=selection)
    scores = [attempt.selection_mse for attempt in fit.attempts]
    assert len(scores) >= 4
    chosen = np.exp(np.mean([np.log(free_run_mse(fit, trace)) for trace in selection]))
    assert chosen == pytest.approx(min(scores), rel=1e-9)


def test_who_stays_within_a_tolerance_on_every_selection_trace_comes_before_who_fails_on_one():
    """The mean would take the other, who is far better than it needs to be elsewhere."""
    model = fit_narx([tank(1)], TANK, SMALL, Training(max_iterations=10)).model
    runs = [model.simulate(one.columns(["pump"])) for one in (tank(2), tank(4), tank(5))]
    span, training = np.ptp(np.concatenate(runs)), Training(within=0.01)

    def off_by(*shares: float) -> SimpleNamespace:
        traces = [
            replace(one, values=np.column_stack([one["pump"], run + share * span]))
            for one, run, share in zip((tank(2), tank(4), tank(5)), runs, shares, strict=True)
        ]
        mean, outside = judged(SimpleNamespace(selection=traces, training=training, start=Start()), model)
        solution = SimpleNamespace(status=Status.CONVERGED)
        return SimpleNamespace(score=mean, outside=outside, solution=solution, place=Place.BY_EVIDENCE)

    fails, holds = off_by(1e-5, 1e-5, 0.02), off_by(0.005, 0.005, 0.005)
    assert (fails.outside, holds.outside) == (1, 0)
    assert fails.score < holds.score
    assert rank(holds, "selection") < rank(fails, "selection")


def test_without_selection_traces_the_evidence_chooses():
    fit = fit_narx([tank(1)], TANK, SMALL, Training(max_iterations=30, starts=3))
    assert fit.evidence is not None
    assert fit.evidence.log_evidence == max(attempt.log_evidence for attempt in fit.attempts)
    (chosen,) = [attempt for attempt in fit.attempts if attempt.chosen]
    assert chosen.log_evidence == fit.evidence.log_evidence


def test_the_best_stable_model_is_chosen_where_the_best_is_not():
    asked = []

    def vet(model) -> bool:
        asked.append(free_run_mse(SimpleNamespace(model=model), tank(2)))
        return len(asked) == 3

    training = Training(max_iterations=30, starts=3)
    fit = fit_narx([tank(1)], TANK, SMALL, training, selection=[tank(2)], vet=vet)
    assert asked == sorted(asked)  # the best first
    assert free_run_mse(fit, tank(2)) == asked[2]
    assert sorted(str(a.stable) for a in fit.attempts if a.stable is not None) == ["False", "False", "True"]
    assert "passed over" in fit.notes[-1]


def test_the_best_model_stands_where_none_is_stable():
    training = Training(max_iterations=30, starts=2)
    fit = fit_narx([tank(1)], TANK, SMALL, training, selection=[tank(2)], vet=lambda _: False)
    best = fit_narx([tank(1)], TANK, SMALL, training, selection=[tank(2)])
    np.testing.assert_array_equal(fit.model.theta, best.model.theta)


def test_an_initial_fit_is_where_the_first_start_begins():
    first = fit_narx([tank(1)], TANK, SMALL, Training(loop="open", max_iterations=40))
    fit = fit_narx([tank(1)], TANK, SMALL, Training(max_iterations=5), initial=first)
    assert fit.history["mse"][0] == pytest.approx(free_run_mse(first, tank(1)), rel=1e-6)
    assert fit.seed is None


def test_an_initial_fit_that_is_not_contained_is_refused():
    first = fit_narx([tank(1)], TANK, SMALL, Training(loop="open", max_iterations=2))
    with pytest.raises(ConfigError, match="not contained"):
        fit_narx([tank(1)], TANK, NARX(input_delays=SMALL.input_delays, output_delays=1, neurons=0), initial=first)


def test_several_records_count_each_from_its_own_start():
    fit = fit_narx([tank(1, 200), tank(2, 300)], TANK, SMALL, Training(max_iterations=30))
    total = (200 * free_run_mse(fit, tank(1, 200)) + 300 * free_run_mse(fit, tank(2, 300))) / 500
    assert fit.history["mse"][-1] == pytest.approx(total, rel=1e-9)


def test_masked_samples_do_not_train():
    clean = tank(1)
    values = clean.values.copy()
    usable = np.ones(len(clean), dtype=bool)
    usable[100:110] = False
    values[100:110, 1] = 50.0
    dirty = Trace(name="dirty", sample_time=0.5, channels=clean.channels, values=values, usable=usable)
    fit = fit_narx([dirty], TANK, SMALL, Training(max_iterations=60))
    counted = (fit.model.simulate(dirty.columns(["pump"])) - clean["level"])[usable]
    assert np.mean(counted**2) < 1e-2 * np.var(clean["level"])


@pytest.mark.parametrize("offset", [{"pump": 0.3}, {"pump": 0.3, "level": -0.1}], ids=["input", "output too"])
def test_offsets_are_copies_of_the_record_that_differ_in_level_alone(offset):
    shifted = tank(1)
    values = shifted.values + np.array([offset.get(channel.name, 0.0) for channel in shifted.channels])
    copy = Trace(name="copy", sample_time=0.5, channels=shifted.channels, values=values)
    rest = float(shifted["level"][0])
    start = {"start": Start(kind=StartKind.MEASURED, n_measured=2), "rest_output": rest}
    by_hand = fit_narx([tank(1), copy], TANK, SMALL, Training(max_iterations=15), **start)
    by_option = fit_narx([tank(1)], TANK, SMALL, Training(max_iterations=15, offsets=[offset]), **start)
    np.testing.assert_allclose(by_option.model.theta, by_hand.model.theta, rtol=1e-9)


def test_an_offset_of_a_channel_that_is_not_in_the_mapping_is_refused():
    with pytest.raises(ChannelError, match="did you mean pump"):
        fit_narx([tank(1)], TANK, SMALL, Training(offsets=[{"pumb": 0.3}]))


def test_an_interruption_keeps_the_best_model_so_far():
    seen = threading.Event()

    def interrupt_once(progress) -> None:
        if progress.iteration == 10 and not seen.is_set():
            seen.set()
            signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)  # as Ctrl-C does

    training = Training(max_iterations=100_000, starts=1, patience=100_000)
    fit = fit_narx([tank(1)], TANK, SMALL, training, on_progress=interrupt_once)
    assert fit.status is Status.INTERRUPTED
    assert np.isfinite(fit.model.theta).all()
    assert len(fit.history["mse"]) >= 10


def test_a_start_is_waited_for_of_which_an_interrupted_pool_does_not_know(monkeypatch):
    """Ctrl-C while a thread of the pool starts leaves it running, and unknown to the pool."""
    tenth = threading.Event()

    def submit(_, work, number: int) -> None:
        threading.Thread(target=work, args=(number,)).start()
        assert tenth.wait(60.0)
        raise KeyboardInterrupt

    monkeypatch.setattr(ThreadPoolExecutor, "submit", submit)
    training = Training(max_iterations=100_000, starts=1, patience=100_000)
    fit = fit_narx(
        [tank(1)], TANK, SMALL, training, on_progress=lambda one: tenth.set() if one.iteration >= 10 else None
    )
    assert fit.status is Status.INTERRUPTED
    assert len(fit.history["mse"]) >= 10


def test_a_free_run_that_leaves_its_bounds_says_so():
    # One iteration from a start whose first record is all that it has seen; the selection trace is far outside.
    far = tank(2)
    values = far.values.copy()
    values[:, 0] *= 1e3
    outside = Trace(name="outside", sample_time=0.5, channels=far.channels, values=values)
    fit = fit_narx([tank(1)], TANK, SMALL, Training(max_iterations=30), selection=[outside])
    bound = fit.model.clamp * fit.model.scaling.output_scale
    level = fit.model.simulate(outside.columns(["pump"])) - fit.model.scaling.output_offset
    assert np.abs(level).max() == pytest.approx(bound)
    assert fit.status is Status.UNSTABLE
    # Random sequences may all stay bounded: what left its bounds is named.
    assert [one for one in fit.warnings if "the record outside," in one]
    assert set(fit.warnings) <= set(fit.notes)


def test_progress_ends_at_the_whole():
    fractions = []
    fit_narx([tank(1)], TANK, SMALL, Training(max_iterations=10), on_progress=lambda p: fractions.append(p.fraction))
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0


@pytest.mark.parametrize(
    "fields",
    [
        {"choose_by": "luck"},
        {"basis": "fourier"},
        {"starts": 0},
        {"max_iterations": 0},
        {"within": 1.0},
    ],
    ids=lambda fields: next(iter(fields)),
)
def test_training_that_cannot_be_is_refused(fields):
    with pytest.raises(ConfigError, match=next(iter(fields))):
        Training(**fields)
