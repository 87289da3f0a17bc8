"""The door through which any structure is fitted; that all answer alike is in ``tests/workbench/test_doors.py``."""

from __future__ import annotations

from dataclasses import replace

import pytest

from sysid.errors import ConfigError
from sysid.estimation import StabilityOptions, Status, Training, fit_arx
from sysid.estimation.fitting import fit, with_stability
from sysid.models import ARX, Mapping
from tests.estimation.test_estimators import MAPPING, NETWORK, ORDERS, trace


def test_a_structure_of_one_output_refuses_several() -> None:
    with pytest.raises(ConfigError, match="an ARX model has one output"):
        fit([trace()], Mapping.parse("u -> y+u2"), ARX(na=1, nb=1, nk=1))


@pytest.mark.parametrize(("pole", "status"), [(0.9, Status.EXACT), (1.05, Status.UNSTABLE)])
def test_a_linear_fit_with_a_pole_outside_the_unit_circle_is_unstable(pole: float, status: Status) -> None:
    assert fit([trace(pole)], MAPPING, ORDERS).status is status
    alone = fit_arx([trace(pole)], MAPPING, ORDERS)
    assert with_stability(alone, [trace(pole)], StabilityOptions()).status is status
    assert with_stability(alone, [trace(pole)], None) is alone


def test_an_initial_fit_at_another_sample_time_is_refused() -> None:
    first = fit([replace(trace(), sample_time=1.0)], MAPPING, ORDERS)
    with pytest.raises(ConfigError, match="the initial fit has another sample time"):
        fit([trace()], MAPPING, NETWORK, Training(max_iterations=1), initial=first)
