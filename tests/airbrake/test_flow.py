"""The flow coefficient: its table of known values, its branches, and tables that are refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.airbrake.flow import (
    CRITICAL_RATIO,
    discharge_coefficient,
    flow_coefficient,
    flow_function,
    flow_table,
)
from sysid.errors import StabilityError

RATIO = [0, 0.2, 0.4, 0.5, CRITICAL_RATIO, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 0.999, 1]
FLOW = [0.040418] * 5 + [0.039957, 0.037679, 0.033095, 0.024944, 0.018159, 0.008303, 0.002638, 0.0]
DISCHARGE = [0.84140, 0.83064, 0.78689, 0.74910, 0.73737, 0.70715, 0.66757, 0.63581, 0.61424, 0.60667]
DISCHARGE += [0.60140, 0.60023, 0.60010]


def test_the_flow_function_has_its_known_values() -> None:
    np.testing.assert_allclose(flow_function(np.array(RATIO)), FLOW, atol=6e-7)


def test_perrys_polynomial_has_its_known_values() -> None:
    np.testing.assert_allclose(discharge_coefficient(np.array(RATIO)), DISCHARGE, atol=6e-6)


def test_choked_flow_is_the_closed_formula() -> None:
    gamma, gas = 1.4, 287.0
    choked = np.sqrt(2 * gamma / (gas * (gamma + 1))) * (2 / (gamma + 1)) ** (1 / (gamma - 1))
    assert float(flow_function(np.array(0.1))) == pytest.approx(choked, rel=1e-14)
    assert pytest.approx(0.528282, abs=1e-6) == CRITICAL_RATIO


@given(st.floats(0.0, 1.0))
def test_flow_falls_with_the_ratio_and_is_never_negative(ratio: float) -> None:
    higher = min(1.0, ratio + 1e-3)
    assert flow_coefficient(np.array(higher)) <= flow_coefficient(np.array(ratio)) + 1e-15
    assert flow_coefficient(np.array(ratio)) >= 0.0


@pytest.mark.parametrize("laminar", [None, 0.995, 0.999])
def test_the_table_is_the_formula(laminar: float | None) -> None:
    table = flow_table(laminar_ratio=laminar)
    ratio = 1.0 - np.logspace(-12, 0, 20_001)
    exact = flow_coefficient(ratio, laminar_ratio=laminar)
    # Linear interpolation over h = 1/4096 in s = sqrt(1 - r). Where the laminar branch starts, the slope in s
    # jumps by kappa / s = 0.05, and a quarter of h times the jump is lost at most.
    np.testing.assert_allclose(table(ratio), exact, atol=5e-9 if laminar is None else 0.25 * 0.0502 / 4096)
    assert table(np.array(1.0)) == 0.0


def test_the_laminar_branch_is_linear_and_continuous() -> None:
    ratio = np.array([0.995, 0.9975, 1.0])
    values = flow_coefficient(ratio, laminar_ratio=0.995)
    np.testing.assert_allclose(values, [values[0], values[0] / 2, 0.0], rtol=1e-12)
    assert values[0] == pytest.approx(float(flow_coefficient(np.array(0.995))))


@pytest.mark.parametrize("laminar", [0.4, 1.0, 1.2])
def test_a_laminar_branch_elsewhere_is_refused(laminar: float) -> None:
    with pytest.raises(StabilityError, match="laminar branch"):
        flow_table(laminar_ratio=laminar)
