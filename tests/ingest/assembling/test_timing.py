"""Surveys of time stamps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.ingest.assembling.timing import even_step, round_step, survey


@pytest.mark.parametrize(
    ("stamps", "step", "gaps", "missing", "duplicates", "backward"),
    [
        pytest.param([0, 1, 2, 3], 1.0, [], 0, [], [], id="even"),
        pytest.param([0, 1, 2, 5, 6], 1.0, [2], 2, [], [], id="a gap of two"),
        pytest.param([0, 1, 1, 2, 3], 1.0, [], 0, [2], [], id="a duplicate"),
        pytest.param([0, 1, 2, 0.5, 3, 4], 1.0, [], 0, [], [3], id="a step back"),
        pytest.param([0, 1, 2, 0, 1, 2, 3, 4], 1.0, [], 0, [], [3, 4], id="a clock that starts again"),
        pytest.param([0, 1, 2, 2, 7, 8], 1.0, [2], 4, [3], [], id="a duplicate before a gap"),
    ],
)
def test_a_survey_finds(  # noqa: PLR0917 - one row of a table
    stamps: list[float], step: float, gaps: list[int], missing: int, duplicates: list[int], backward: list[int]
) -> None:
    timing = survey(np.array(stamps, dtype=float))
    assert timing.step == pytest.approx(step)
    assert timing.missing == missing
    assert (timing.gaps.tolist(), timing.duplicates.tolist(), timing.backward.tolist()) == (gaps, duplicates, backward)


@pytest.mark.parametrize("stamps", [[5.0], [5.0, 5.0]], ids=["one", "two alike"])
def test_without_two_different_stamps_there_is_no_step(stamps: list[float]) -> None:
    timing = survey(np.array(stamps))
    assert np.isnan(timing.step)
    assert (timing.samples, timing.missing, len(timing.gaps)) == (len(stamps), 0, 0)


@given(st.floats(1e-4, 1e3), st.integers(20, 200), st.floats(0.0, 0.2), st.integers(0, 2**32 - 1))
def test_step_and_jitter_of_jittered_stamps_are_measured(step: float, count: int, share: float, seed: int) -> None:
    noise = share * np.random.default_rng(seed).uniform(-1.0, 1.0, count)
    timing = survey(step * (np.arange(count) + noise))
    assert timing.missing == 0
    assert timing.jitter <= 2.0 * share * step + 1e-9 * step
    assert abs(timing.step - step) <= 6.0 * share * step / count + 1e-9 * step


@given(st.integers(1, 10**6), st.lists(st.integers(1, 1), min_size=10, max_size=400), st.integers(2, 9))
def test_even_stamps_give_a_step_whose_grid_they_lie_on(millionths: int, steps: list[int], gap: int) -> None:
    steps[len(steps) // 2] = gap
    places = np.concatenate([[0], np.cumsum(steps)])
    stamps = 3.0 + millionths * 1e-6 * places
    step = even_step(stamps, survey(stamps), tolerance=0.01)
    assert step is not None
    assert len(repr(step)) <= len(repr(millionths * 1e-6))
    np.testing.assert_array_equal(np.rint((stamps - 3.0) / step), places)


def test_uneven_stamps_have_none() -> None:
    stamps = np.array([0.0, 0.1, 0.23, 0.3, 0.4, 0.5])
    assert even_step(stamps, survey(stamps), tolerance=0.01) is None
    assert even_step(np.array([1.0]), survey(np.array([1.0])), tolerance=0.01) is None


@given(st.floats(1e-9, 1e9))
def test_a_rounded_step_is_near_and_short(step: float) -> None:
    rounded = round_step(step)
    assert abs(rounded - step) <= 5e-3 * step
    whole_hours = step <= 1e6 and rounded % 3600.0 == 0.0
    assert whole_hours or len(f"{rounded:e}".split("e")[0].rstrip("0")) <= 4
