"""Figures of merit: what they are, and that there is none where there is nothing to be relative to."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sysid
from sysid.reporting.fit_records import FiguresRecord
from sysid.testing import first_order_record
from sysid.traces import Role, Trace, TraceSet
from sysid.validation.metrics import MERITS, Figures, figures, mean_fit, percent

LEVELS = st.floats(-1e12, 1e12, allow_subnormal=False)


@pytest.mark.parametrize("last", [1e200, -1e200, math.inf, math.nan])
def test_a_run_that_has_left_has_no_figures_and_no_warning(last: float) -> None:
    """Squares that overflow came as warnings of NumPy from ``sysid orders`` and ``sysid auto``."""
    found = figures(np.arange(3.0), np.array([0.0, 1.0, last]), "V")
    assert (found.mse, found.nrmse_fit, found.max_abs_error) == (math.inf, -math.inf, math.inf)


def test_a_fit_is_as_compare_prints_it() -> None:
    target, output = np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 1.0, 2.0, 2.0])
    found = figures(target, output, "V")
    assert found.nrmse_fit == pytest.approx(100.0 * (1.0 - 1.0 / math.sqrt(5.0)))
    assert (found.mse, found.max_abs_error) == (0.25, 1.0)


def test_what_is_stored_is_read_and_what_a_later_release_added_is_no_number() -> None:
    found = figures(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.5]), "V")
    assert Figures.from_dict(found.to_dict()) == found
    stored = {key: value for key, value in found.to_dict().items() if key != "r"}
    assert math.isnan(Figures.from_dict(stored).r)


def test_every_figure_of_merit_is_shown_under_its_unit() -> None:
    assert (
        {merit.key for merit in MERITS} | {"unit"}
        == set(Figures.__dataclass_fields__)
        == set(FiguresRecord.model_fields)
    )
    said = {merit.key: merit.said("psi") for merit in MERITS}
    assert said.items() >= {"mse": "psi²", "nrmse_fit": "%", "max_abs_error": "psi", "r": "correlation"}.items()


@given(level=LEVELS, n=st.integers(1, 70), error=st.floats(-1e3, 1e3))
def test_of_a_constant_target_nothing_relative_is_said_and_the_error_is(level: float, n: int, error: float) -> None:
    found = figures(np.full(n, level), np.full(n, level) + error, "V")
    assert math.isnan(found.nrmse_fit)
    assert math.isnan(found.r)
    assert math.isfinite(found.mse)


def test_a_run_that_is_lost_has_no_fit_to_a_constant_target_either() -> None:
    found = figures(np.full(3, 0.3), np.array([0.0, np.inf, np.nan]), "V")
    assert math.isnan(found.nrmse_fit)
    assert found.mse == math.inf
    assert figures(np.arange(3.0), np.array([0.0, np.inf, np.nan]), "V").nrmse_fit == -math.inf


def test_where_no_sample_counts_no_figure_is_given() -> None:
    found = figures(np.arange(3.0), np.zeros(3), "V", np.zeros(3, dtype=np.bool_))
    assert all(math.isnan(value) for value in (found.mse, found.nrmse_fit, found.max_abs_error, found.r))


def test_a_small_step_on_a_high_level_is_not_constant() -> None:
    target = 1e5 + np.array([0.0, 1e-6, 0.0])
    assert figures(target, target, "Pa").nrmse_fit == 100.0


def test_a_mean_over_cases_leaves_out_those_without_a_fit() -> None:
    assert mean_fit([50.0, math.nan]) == 50.0
    assert math.isnan(mean_fit([math.nan]))
    assert percent(math.nan) == "-"


def test_a_comparison_prints_a_dash_for_a_constant_output() -> None:
    (record,) = sysid.load(first_order_record()).traces
    still = Trace(
        name="off",
        sample_time=record.sample_time,
        channels=record.channels,
        values=np.column_stack([np.zeros(50), np.full(50, 0.3)]),
    )
    traces = TraceSet(
        name="s", traces=(record, still), roles={record.name: Role.ESTIMATION, "off": Role.VALIDATION}, source=""
    )
    found = sysid.compare(traces, sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=(1,), nk=(1,))))
    _, row, *told = str(found).splitlines()
    assert row.split()[-1] == "-"
    assert "In off no input moves" in told[0]
    (evaluation,) = found.evaluations.values()
    assert 0.0 <= evaluation.cases["off"].free_run.mse <= 0.09
