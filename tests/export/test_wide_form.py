"""Stages put together into wide products: which ones, and what a step hands to the next."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from sysid.export import Surrogate
from sysid.export.wide.whole import WideForm
from sysid.models import NARX, Cascade
from tests.export.cascades import CASCADES, build_circle, build_limited, wired_narx


def chain(count, *, lag, neurons=3):
    """Networks that read the one before at this sample, or at the last."""
    names = ["STP", *(f"Y{i}" for i in range(count))]
    lags = [[lag]]
    return Cascade(
        models=tuple(
            wired_narx(f"{a} -> {b}", NARX(input_delays=lags, output_delays=1, neurons=neurons), i)
            for i, (a, b) in enumerate(pairwise(names))
        )
    )


@pytest.mark.parametrize(("lag", "groups"), [(0, 5), (1, 1)])
def test_a_group_is_all_that_does_not_wait_for_another(lag, groups):
    form = WideForm.of(Surrogate.of(chain(5, lag=lag)), np.float64)
    assert len(form.groups) == groups
    assert sum(len(group.blocks) for group in form.groups) == 5


def test_a_group_that_multiplies_by_too_many_zeros_is_two():
    form = WideForm.of(Surrogate.of(chain(60, lag=1, neurons=20)), np.float64)
    assert 1 < len(form.groups) < 10


def test_exactly_each_stage_is_a_group_that_reads_its_own():
    form = WideForm.of(Surrogate.of(build_limited()), np.float64, exact=True)
    assert [len(group.blocks) for group in form.groups] == [1] * len(form.surrogate.stages)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("name", CASCADES)
def test_memory_and_lines_of_inputs_are_the_state(name, dtype):
    build, outputs = CASCADES[name]
    surrogate = Surrogate.of(build(), outputs=outputs)
    form = WideForm.of(surrogate, dtype)
    of_inputs = [line.first + lag for line in form.input_lines for lag in range(line.length)]
    assert sorted((*form.memory, *of_inputs)) == [*range(surrogate.state_length(dtype))]


def test_what_a_channel_can_reach_follows_its_limits():
    surrogate = Surrogate.of(build_circle())
    form = WideForm.of(surrogate, np.float64)
    reach = dict(zip((port.name for port in surrogate.channels), form.reach, strict=True))
    assert reach["STP"] == (-np.inf, np.inf)
    assert reach["BP"] == pytest.approx((40.0 - 3.0 * 38.0, 40.0 + 3.0 * 38.0))
    assert reach["AR"] == (12.0, pytest.approx(154.0))  # at least 12, at most what BP can be
    assert reach["ER"] == (38.0, pytest.approx(154.0))
