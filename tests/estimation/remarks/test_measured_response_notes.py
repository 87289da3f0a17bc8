"""What a measured frequency response leaves open is told of the transfer function that was fitted to it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sysid

W = np.geomspace(0.1, 100.0, 60)
QUICK = sysid.TransferFunctionTraining(scattered_starts=0)


def mode(w: Any, at: float, damping: float) -> Any:
    s = 1j * w
    return at**2 / (s**2 + 2 * damping * at * s + at**2)


def told(w: Any, truth: Any, *, poles: int, zeros: int, noise: float = 0.01, **asked: Any) -> tuple[str, ...]:
    rng = np.random.default_rng(0)
    errors = (rng.standard_normal(len(w)) + 1j * rng.standard_normal(len(w))) / np.sqrt(2.0)
    swept = sysid.response_data({"w [rad/s]": w, "H": truth * (1.0 + noise * errors)})
    delays = asked.pop("delays", (0,))
    structure = sysid.TransferFunction(poles=(poles,), zeros=(zeros,), delays=delays, domain="continuous")
    options = {"weighting": "relative", "sample_time": 0.002, "training": QUICK, **asked}
    fit = sysid.fit_response(swept, structure, **options)
    assert set(fit.warnings) <= set(fit.notes)
    return fit.warnings


def test_a_fit_to_points_that_show_it_all_is_told_of_nothing() -> None:
    assert told(W, mode(W, 4.0, 0.2), poles=2, zeros=0) == ()


def test_a_pole_and_a_zero_too_many_are_not_told_apart() -> None:
    warned = " ".join(told(W, 2.0 / (1.0 + 0.5j * W), poles=2, zeros=1))
    assert "not told apart by their 95 % intervals: fit a pole and a zero less" in warned or "Fit a pole less" in warned


def test_a_pole_and_a_zero_that_are_near_but_measured_stay() -> None:
    truth = (1.0 + 0.5j * W) / (1.0 + 0.4j * W) / (1.0 + 0.05j * W)
    assert told(W, truth, poles=2, zeros=1, noise=0.001) == ()


@pytest.mark.parametrize(("damping", "narrow"), [(0.002, True), (0.1, False)])
def test_a_resonance_between_two_points_is_told(damping: float, narrow: bool) -> None:
    warned = " ".join(told(W, mode(W, 4.0, damping), poles=2, zeros=0))
    assert ("is hardly measured: measure more finely" in warned) == narrow


def test_a_steady_state_that_no_point_shows_is_told() -> None:
    high = W[W > 5.0]
    warned = " ".join(told(high, 1.0 / (1.0 + 1j * high), poles=1, zeros=0))
    assert "lies below the lowest frequency" in warned


def test_a_roll_off_that_no_point_shows_is_told() -> None:
    low = W[W < 5.0]
    warned = " ".join(told(low, 1.0 / (1.0 + 0.02j * low), poles=1, zeros=0, noise=0.001))
    assert "lies beyond the highest frequency" in warned


@pytest.mark.parametrize(("weighting", "few"), [("none", True), ("relative", False)])
def test_errors_that_count_at_a_few_points_alone_are_told(weighting: str, few: bool) -> None:
    truth = mode(W, W[33], 0.003) / (1.0 + 0.01j * W)
    warned = " ".join(told(W, truth, poles=3, zeros=2, weighting=weighting))
    assert ("fewer than 6 parameters need: the others hardly matter" in warned) == few


def test_a_dead_time_at_the_end_of_its_search_is_told() -> None:
    low = W[W < 20.0]
    late = np.exp(-0.05j * low) / (1.0 + 0.5j * low)
    short = sysid.TransferFunctionTraining(scattered_starts=0, max_delay=20)
    warned = " ".join(told(low, late, poles=1, zeros=0, delays=None, training=short))
    assert "0.04 s, is the longest that was tried" in warned


def test_a_phase_that_turns_between_points_is_told() -> None:
    w = np.linspace(1.0, 100.0, 34)
    late = np.exp(-0.95j * w) / (1.0 + 0.01j * w)
    warned = " ".join(told(w, late, poles=1, zeros=0, delays=(475,)))
    assert "several dead times explain it" in warned
