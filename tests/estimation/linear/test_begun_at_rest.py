"""What records that begin at rest tell of dead times, and the samples that others leave out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

import sysid
from sysid.estimation.linear.begun_at_rest import at_rest, left_out

LENGTH, DEAD = 300, 12


def record(steps: dict[int, float], *, level: float = 0.0, dead: int = DEAD) -> tuple[np.ndarray, np.ndarray, None]:
    """A lag behind a dead time, of an input that goes to these values at these samples; it had stood at a level."""
    u = np.zeros(LENGTH)
    for sample, value in steps.items():
        u[sample:] = value
    y = signal.lfilter([*np.zeros(dead), 0.05], [1.0, -0.95], np.concatenate([np.full(200, level), u]))[200:]
    y += 0.005 * np.random.default_rng(0).standard_normal(LENGTH)
    return u[:, np.newaxis], y[:, np.newaxis], None


@pytest.mark.parametrize(
    ("steps", "level", "dead", "expected"),
    [
        ({5: 1.0}, 0.0, 0, 5),
        ({5: 1.0}, 1.0, 0, 5),  # it moved as the record began, which has not shown yet
        ({5: 1.0}, 1.0, DEAD, 0),  # and has now
        ({2: 1.0}, 0.0, 0, 0),  # too few samples to tell
        ({}, 0.0, 0, 0),
    ],
)
def test_inputs_and_outputs_that_stand_at_first_are_a_rest(
    steps: dict[int, float], level: float, dead: int, expected: int
) -> None:
    assert at_rest(record(steps, level=level), dead) == expected


@pytest.mark.parametrize(
    ("records", "expected"),
    [
        ([{5: 1.0}], [0]),  # one step, which 40 samples less 5 would leave out
        ([{5: 1.0, 100: 0.0}], [35]),  # there is another
        ([{60: 1.0}], [0]),
        ([{5: 1.0}, {5: 1.0}], [0, 0]),
        ([{5: 1.0}, {100: 1.0}], [35, 0]),  # the other record has it
        ([{1: 1.0}], [40]),  # not known to have been at rest
        ([{}], [40]),
    ],
)
def test_what_all_dead_times_would_leave_out_is_kept(records: list[dict[int, float]], expected: list[int]) -> None:
    assert left_out([record(steps) for steps in records], 40, 0) == expected


@pytest.mark.parametrize(
    "structure",
    [sysid.TransferFunction(poles=1, zeros=0), sysid.LinearStateSpace(states=1, nk="auto", noise=False)],
    ids=["TransferFunction", "LinearStateSpace"],
)
@pytest.mark.parametrize("lead", [5, 30])
def test_a_single_step_tells_a_dead_time_longer_than_the_rest_before_it(
    structure: sysid.models.AbstractStructure, lead: int
) -> None:
    u, y, _ = record({lead: 1.0})
    fit = sysid.fit(sysid.data((u[:, 0], y[:, 0]), sample_time=0.2), "u -> y", structure)
    new, expected, _ = record({20: -1.0, 90: 0.5, 200: 0.0})
    assert f"Dead times in samples: {DEAD}." in fit.notes
    assert np.std(fit.simulate(new[:, 0]) - expected[:, 0]) < 0.03 * np.std(expected)
