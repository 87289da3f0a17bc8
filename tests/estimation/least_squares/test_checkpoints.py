"""A fit that was cut off goes on where it was, and ends as if nothing had happened."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sysid.estimation import (
    JointTraining,
    Training,
    fit_cascade,
    fit_narx,
    fit_neural_state_space,
)
from sysid.estimation.least_squares.checkpoints import Checkpoints, Watch, checkpoints_of, part_of
from sysid.models import NARX, Mapping, NeuralStateSpace, VectorNeuralStateSpace
from sysid.traces import Channel, Trace
from tests.estimation.networks.test_joint_training import disturbed, measured
from tests.estimation.tank import TANK, tank

NETWORK = NARX(input_delays=1, output_delays=1, neurons=4)
Fit = Callable[[Callable[[Any], None]], Any]


def narx(**options: Any) -> Fit:
    training = Training(**{"max_iterations": 25, "seed": 5, **options})
    return lambda told: fit_narx([tank(1)], TANK, NETWORK, training, selection=[tank(2)], on_progress=told)


def neural(told: Callable[[Any], None]) -> Any:
    training = Training(max_iterations=12, starts=2, workers=1)
    network = NeuralStateSpace(states=2, neurons=2)
    return fit_neural_state_space([tank(1)], TANK, network, training, selection=[tank(2)], on_progress=told)


def beside(seed: int) -> Trace:
    """The tank with a noisy gauge beside it."""
    trace = tank(seed)
    gauge = 2.0 * trace["level"] + 0.3 * np.random.default_rng(seed).standard_normal(len(trace))
    channels = (*trace.channels, Channel(name="gauge", unit="V"))
    return replace(trace, channels=channels, values=np.column_stack([trace.values, gauge]))


def neural_of_two(told: Callable[[Any], None]) -> Any:
    training = Training(max_iterations=12, starts=2, workers=1)
    mapping = Mapping(inputs=("pump",), outputs=("level", "gauge"))
    network = VectorNeuralStateSpace(states=2, neurons=2)
    return fit_neural_state_space([beside(1)], mapping, network, training, on_progress=told)


def one_after_the_other(told: Callable[[Any], None]) -> Any:
    narx(max_iterations=10)(part_of(told, "first"))
    return narx(max_iterations=15)(part_of(told, "second"))


def cascade(told: Callable[[Any], None]) -> Any:
    training = JointTraining(max_iterations=12, checkpoints=3)
    return fit_cascade(disturbed(), [measured()], training=training, selection=[measured(seed=2)], on_progress=told)


class CutOffError(Exception):
    """Stands for whatever ends a fit half way."""


FITS = {
    "one start": narx(),
    "one step ahead first": narx(pretraining=200, pretraining_iterations=6, starts=2, workers=1),
    "raced": narx(starts=4, workers=1),
    "raced by two": narx(starts=4, workers=2),
    "open loop": narx(loop="open", starts=2, workers=1),
    "without evidence": narx(regularisation=0.0),
    "neural state space": neural,
    "neural state space of two outputs": neural_of_two,
    "two fits that are kept together": one_after_the_other,
    "cascade": cascade,
}


def parameters(fit: Any) -> str:
    """All numbers of a model, to the last bit."""
    return json.dumps(fit.model.to_dict())


@pytest.mark.parametrize("name", FITS)
@pytest.mark.parametrize("share", [0.6])
def test_a_fit_that_was_cut_off_ends_as_one_that_was_not(name: str, share: float) -> None:
    fit, whole = FITS[name], list[Any]()
    expected = fit(whole.append)
    told, kept = [list[Any](), list[Any]()], list[dict[str, Any]]()

    def until(entry: Any) -> None:
        told[0].append(entry)
        if len(told[0]) >= share * len(whole):
            raise CutOffError

    first = Checkpoints(save=kept.append, every_s=0.0)
    with pytest.raises(CutOffError):
        fit(Watch(report=until, checkpoints=first))
    stored = json.loads(json.dumps(kept[-1]).replace("NaN", '"NaN"'))
    found = fit(Watch(report=told[1].append, checkpoints=Checkpoints(kept=stored, save=kept.append)))
    assert parameters(found) == parameters(expected)
    assert found.status is expected.status
    np.testing.assert_array_equal(found.history["iteration"], expected.history["iteration"])

    def iterations(entries: list[Any]) -> list[tuple[str, int, int]]:
        return sorted((one.stage, one.start, one.iteration) for one in entries if one.iteration)

    assert iterations([*told[0], *told[1]]) == iterations(whole)


def test_what_ended_is_not_done_again() -> None:
    kept, told = list[dict[str, Any]](), list[Any]()
    fit = narx(starts=2, workers=1)
    book = Checkpoints(save=kept.append)
    expected = fit(Watch(report=lambda _: None, checkpoints=book))
    assert kept == []  # it took less than the time between two savings
    book.flush()
    found = fit(Watch(report=told.append, checkpoints=Checkpoints(kept=kept[-1], save=kept.append)))
    assert told == []
    assert parameters(found) == parameters(expected)
    # What earlier sessions have spent is part of what a fit took.
    assert found.train_time_s >= kept[0]["spent_s"]


def test_who_only_listens_keeps_nothing() -> None:
    assert checkpoints_of(print).save is None
    assert part_of(print, "first") is print


def test_a_part_has_its_own_time() -> None:
    """Of fits that are kept together each tells what it took itself."""
    kept = list[dict[str, Any]]()
    one_after_the_other(Watch(report=lambda _: None, checkpoints=Checkpoints(save=kept.append, every_s=0.0)))
    whole = Watch(report=lambda _: None, checkpoints=Checkpoints(kept=kept[-1]))
    first, second = (checkpoints_of(part_of(whole, name)).earlier_s for name in ("first", "second"))
    assert 0.0 < first < first + second <= checkpoints_of(whole).earlier_s
