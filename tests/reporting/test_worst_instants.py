"""The worst instants: the right ones, and no two of the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sysid.reporting.sections.amplitude import bands
from sysid.reporting.signals import CaseSignals
from sysid.reporting.worst_instants import worst_instants


def _case(errors: dict[int, float], samples: int = 1000) -> CaseSignals:
    simulated = np.zeros(samples)
    for sample, error in errors.items():
        simulated[sample] = error
    zero = np.zeros(samples)
    return CaseSignals(time=0.5 * np.arange(samples), target=zero, simulated=simulated, predicted=zero)


def test_the_largest_errors_of_all_cases_come_first_whatever_their_sign() -> None:
    instants = worst_instants({"A": _case({100: 1.0, 500: -3.0}), "B": _case({700: 2.0})}, 5)
    assert [(m.case, m.sample, m.time, m.error) for m in instants] == [
        ("A", 500, 250.0, -3.0),
        ("B", 700, 350.0, 2.0),
        ("A", 100, 50.0, 1.0),
    ]


def test_neighbours_of_a_moment_are_part_of_it() -> None:
    instants = worst_instants({"A": _case({500: 3.0, 501: 2.9, 530: 2.8, 600: 1.0})}, 5)
    assert [m.sample for m in instants] == [500, 600]
    assert (instants[0].first, instants[0].last) == (480, 520)


def test_a_window_is_so_narrow_that_the_error_can_be_seen() -> None:
    ramp = 0.1 * np.arange(4000.0)
    simulated = ramp.copy()
    simulated[2000] += 0.5
    (instant,) = worst_instants({"A": CaseSignals(time=ramp, target=ramp, simulated=simulated, predicted=ramp)}, 1)
    shown = slice(instant.first, instant.last + 1)
    assert np.ptp(ramp[shown]) <= 12 * 0.5
    assert np.ptp(ramp[shown]) > 6 * 0.5
    assert instant.first < 2000 < instant.last


def test_a_window_stays_inside_its_case() -> None:
    (first, last) = worst_instants({"A": _case({0: 1.0, 999: 2.0})}, 5)
    assert (first.first, first.last) == (979, 999)
    assert (last.first, last.last) == (0, 20)


def test_where_the_free_run_is_not_finite_is_worse_than_anything() -> None:
    instants = worst_instants({"A": _case({100: 1e9}), "B": _case({300: np.nan})}, 1)
    assert [(m.case, m.sample) for m in instants] == [("B", 300)]


def test_no_more_than_asked_for() -> None:
    assert len(worst_instants({"A": _case(dict.fromkeys(range(0, 1000, 100), 1.0))}, 3)) == 3


def test_a_perfect_free_run_has_no_worst_moment() -> None:
    assert worst_instants({"A": _case({})}, 5) == []


def test_a_masked_sample_is_no_instant_and_in_no_band():
    counts = np.ones(1000)
    counts[500] = 0.0
    masked = replace(_case({100: 1.0, 500: -3.0}), counts=counts)
    assert [instant.sample for instant in worst_instants({"A": masked}, 5)] == [100]
    ramp = replace(masked, target=np.arange(1000.0), simulated=np.arange(1000.0) + np.where(counts > 0.0, 0.5, 9.0))
    assert sum(band.samples for band in bands({"A": ramp})) == 999
    assert max(band.largest for band in bands({"A": ramp})) == 0.5
