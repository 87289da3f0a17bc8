"""Long records: what starts are raced on, and that what is chosen stands where all samples put it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.estimation.fitting import fit
from sysid.estimation.networks.training import Training
from sysid.estimation.networks.windows import COUNT, LONG, SAMPLES, Windows
from sysid.estimation.records.experiment import Experiment
from sysid.models import NARX, AbstractStructure, HammersteinWiener, History, Mapping, NeuralStateSpace
from sysid.traces import Channel, Trace

MAPPING = Mapping.parse("u -> y")


def quiet_but_once(n: int, at: int) -> Experiment:
    u = np.zeros((n, 1))
    u[at : at + 5] = 1.0
    y = np.convolve(u[:, 0], 0.5 ** np.arange(10))[:n]
    return Experiment(inputs=u, output=y, history=History.at_rest(inputs=np.zeros(1), output=0.0))


def test_windows_lie_in_equal_parts_where_most_happens() -> None:
    record = quiet_but_once(3200, at=1450)
    seen = Windows.of([record], Training(window=100)).experiments
    assert [len(one.output) for one in seen] == [100] * COUNT
    assert seen[3].inputs.max() == 1.0  # samples 1400 to 1499 of the fourth 400
    assert seen[0].history is record.history
    assert seen[0].past is None
    assert all(one.free for one in seen[1:])
    np.testing.assert_array_equal(seen[3].history.output, record.output[1400:1401])


def test_a_mask_moves_no_window_and_stays_where_it_was() -> None:
    record = quiet_but_once(3200, at=1450)
    usable = np.ones(3200, dtype=np.bool_)
    usable[1440:1500] = False
    masked = Experiment(
        inputs=record.inputs, output=record.output, history=record.history, weights=usable * 1.0, usable=usable
    )
    seen = Windows.of([masked], Training(window=100)).experiments
    assert sum(one.n_counted for one in seen) == 100 * COUNT  # where nothing counts nothing happens


def test_of_many_short_records_some_are_taken_whole() -> None:
    records = [quiet_but_once(50, at=10) for _ in range(100)]
    seen = Windows.of(records, Training(window=100)).experiments
    assert len(seen) == 16
    assert all(any(one.output is not None and len(one.output) == 50 for one in records) for one in seen)
    assert not any(one.free for one in seen)


@pytest.mark.parametrize(
    ("samples", "window", "seen"),
    [(LONG, None, LONG), (LONG + 1, None, COUNT * SAMPLES), (LONG + 1, 0, LONG + 1), (800, 100, 800), (801, 100, 800)],
)
def test_only_long_records_are_parted(samples: int, window: int | None, seen: int) -> None:
    found = Windows.of([quiet_but_once(samples, at=5)], Training(window=window)).experiments
    assert sum(len(one.output) for one in found) == seen


def a_record() -> Trace:
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1.0, 1.0, 400), 5)
    u[:10] = 0.0
    y = np.zeros(len(u))
    for k in range(len(u) - 1):
        y[k + 1] = 0.8 * y[k] + 0.3 * np.clip(u[k], -0.5, 0.7)
    channels = (Channel(name="u", unit="V"), Channel(name="y", unit="V"))
    values = np.column_stack([u, y + 0.01 * rng.standard_normal(len(u))])
    return Trace(name="record", sample_time=0.1, channels=channels, values=values)


@pytest.mark.parametrize(
    "structure",
    [
        NeuralStateSpace(states=1, neurons=3),
        NARX(input_delays=1, output_delays=1, neurons=3),
        HammersteinWiener(states=1, input="saturation"),
    ],
    ids=lambda one: str(one.label),
)
def test_a_fit_raced_on_windows_ends_no_worse_than_one_on_all_samples(structure: AbstractStructure) -> None:
    options: dict[str, Any] = {"starts": 2, "workers": 1, "max_iterations": 40}
    raced, whole = (
        fit([a_record()], MAPPING, structure, Training(window=window, **options), stability=None) for window in (100, 0)
    )
    assert raced.history["mse"][-1] < 1.01 * whole.history["mse"][-1]  # windows may lead to a better minimum
    assert raced.posterior is not None
    assert any(note.startswith("Raced on 8 windows of 100 samples") and "2,000" in note for note in raced.notes)
    assert not any("window" in note for note in whole.notes)


def test_a_window_that_holds_nothing_is_refused() -> None:
    with pytest.raises(ConfigError, match="window is too small"):
        Training(window=3)
