"""What the curves of a block-oriented model are given and make of it, against the equations by hand."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.estimation.blocks.fit import fit_blocks
from sysid.estimation.networks.training import Training
from sysid.models import BuiltModel, HammersteinWiener, History, Mapping, WienerHammerstein
from sysid.models.blocks.curve_values import curve_values
from sysid.reporting.figures.curves_figure import curves_figure
from sysid.traces import Trace
from tests.traces.made import trace_of

MAPPING = Mapping.parse("u -> y")
U = np.repeat(np.random.default_rng(0).uniform(-1.0, 1.0, 40), 5)
RECORD = (U[:, None], History.at_rest(inputs=U[:1], output=0.0))
BRIEF = Training(starts=1, max_iterations=3, workers=1)


def a_trace() -> Trace:
    y = np.zeros(len(U))
    for k in range(len(U) - 1):
        y[k + 1] = 0.8 * y[k] + 0.2 * np.clip(U[k], -0.4, 0.6)
    return trace_of({"u": U, "y": y}, sample_time=0.1, units={"u": "V", "y": "m"})


def a_model(structure: HammersteinWiener | WienerHammerstein) -> BuiltModel:
    model = fit_blocks([a_trace()], MAPPING, structure, BRIEF).model
    assert isinstance(model, BuiltModel)
    return model


def test_curves_before_and_behind_a_block_are_those_of_its_equations() -> None:
    model = a_model(HammersteinWiener(states=1, input="saturation", output="network 2"))
    before, behind = curve_values(model, [RECORD])
    scaled = (U - (U.max() + U.min()) / 2.0) / (np.ptp(U) / 2.0)
    clipped = np.clip(scaled, model.parameters["f_low"], model.parameters["f_high"])
    assert (before.title, before.before) == ("u: saturation", "u [V]")
    np.testing.assert_array_equal(before.x, U)
    np.testing.assert_allclose(before.y, clipped, atol=1e-12)
    assert behind.behind == "y [m]"
    np.testing.assert_array_equal(behind.y, model.simulate(*RECORD))
    order = np.argsort(behind.x)
    steps = np.abs(np.diff(behind.y[order])) - 5.0 * np.diff(behind.x[order])
    assert steps.max() < 1e-9  # one value of the curve for each of what it is given


def test_dead_times_and_known_limits_are_in_units() -> None:
    model = a_model(HammersteinWiener(states=1, input={"saturation": [-0.4, 0.6]}, delays=3))
    (only,) = curve_values(model, [RECORD])
    np.testing.assert_array_equal(only.x[2:], U[:-2])
    inside = (only.x > -0.4) & (only.x < 0.6)
    slope = np.polyfit(only.x[inside], only.y[inside], 1)
    np.testing.assert_allclose(only.y, np.polyval(slope, np.clip(only.x, -0.4, 0.6)), atol=1e-12)


def test_a_curve_between_two_blocks_has_its_picture() -> None:
    model = a_model(WienerHammerstein(first=1, second=1, curve="polynomial 2"))
    (only,) = curve_values(model, [RECORD, RECORD])
    assert len(only.x) == 2 * len(U)
    np.testing.assert_allclose(only.y, only.x + model.parameters["f_c2"] * only.x**2, atol=1e-12)
    drawn = only.drawn()
    panel, counts = curves_figure([drawn]).axes
    assert panel.get_ylabel() == "into the second, scaled"
    assert drawn.counts.sum() == 2 * len(U)
    np.testing.assert_array_equal(counts.patches[0].get_data().values, drawn.counts)  # type: ignore[attr-defined]
    assert np.all(np.diff(drawn.x) > 0.0)
    np.testing.assert_allclose(drawn.y, drawn.x + model.parameters["f_c2"] * drawn.x**2, atol=1e-12)


def test_a_block_without_curves_has_none_to_show() -> None:
    with pytest.raises(ConfigError, match="no static curves"):
        curve_values(a_model(HammersteinWiener(states=1)), [RECORD])
