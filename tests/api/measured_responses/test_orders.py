"""Orders of a measured frequency response are those that tell frequencies left out of the fit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sysid
from sysid.errors import UserError

W = np.geomspace(0.1, 100.0, 50)
S = 1j * W
QUICK = sysid.TransferFunctionTraining(scattered_starts=0)


def mode(w: float, damping: float) -> Any:
    return w**2 / (S**2 + 2 * damping * w * S + w**2)


def searched(truth: Any, *, noise: float = 0.02, seed: int = 0, **asked: Any) -> Any:
    rng = np.random.default_rng(seed)
    errors = (rng.standard_normal(len(W)) + 1j * rng.standard_normal(len(W))) / np.sqrt(2.0)
    swept = sysid.response_data({"w [rad/s]": W, "H": truth * (1.0 + noise * errors)})
    options = {"sample_time": 0.001, "delays": (0,), "weighting": "relative", "training": QUICK, **asked}
    return sysid.search_response_orders(swept, **options)


PLANTS: dict[str, tuple[Any, tuple[int, int]]] = {
    "a lag": (2.0 / (1.0 + 0.5 * S), (1, 0)),
    "a lead": ((1.0 + 2.0 * S) / (1.0 + 0.1 * S), (1, 1)),
    "a mode, of which few points tell": (mode(4.0, 0.03) + 0.3, (2, 2)),
    "an integrator and a lag": (5.0 / (S * (1.0 + 0.1 * S)), (2, 0)),
    "a mode and a lag": (mode(6.0, 0.2) / (1.0 + S), (3, 0)),
}


@pytest.mark.parametrize("plant", PLANTS)
def test_the_orders_of_a_plant_are_found(plant: str) -> None:
    truth, orders = PLANTS[plant]
    found = searched(truth)
    assert (found.ranked[0].poles, found.ranked[0].zeros) == orders
    assert found.at_edge == ()
    assert found.fit.notes[1].startswith(f"Orders: {orders[0]} pole")
    assert found.best.delays == (0,)


def test_fewer_zeros_have_a_dead_time_of_their_own() -> None:
    """A zero stands for what a dead time lacks: with that of more zeros, fewer had left too much."""
    found = searched(mode(10.0, 0.2) * np.exp(-0.01 * S), poles=(2, 2), delays=None, sample_time=None)
    fewest = next(one for one in found.tried if one.zeros == 0)
    assert fewest.dead_time == pytest.approx(0.01, rel=0.02)
    assert found.left_out_percent(fewest) < 1.1 * found.left_out_percent(found.ranked[0])


def test_fits_without_noise_get_no_pole_for_rounding() -> None:
    assert searched(2.0 / (1.0 + 0.5 * S), noise=0.0).best.poles == (1,)


def test_noise_of_one_size_beside_a_resonance_brings_no_poles() -> None:
    """Relative errors, weighted by their own size: those at the peak are all that counts, and are few."""
    assert searched(mode(4.0, 0.05), noise=0.03, weighting="none").ranked[0].poles == 2


def test_the_edge_of_a_search_is_warned_of() -> None:
    found = searched(mode(6.0, 0.2) / (1.0 + S), poles=(1, 2))
    assert any("stand at the end of what was tried: allow more" in one for one in found.fit.warnings)
    assert "stand at the end" in str(found)


def test_the_table_has_all_that_were_tried_and_the_fit_has_the_search() -> None:
    found = searched(2.0 / (1.0 + 0.5 * S), poles=(1, 2))
    table = found.to_frame()
    assert table["score"].iloc[0] == 0.0
    assert table["score"].min() > -2.0
    assert len(table) == len(found.tried) == len(str(found).splitlines()) - 2
    assert found.fit.orders is found


def test_a_fit_without_a_structure_compares_them() -> None:
    truth = 2.0 / (1.0 + 0.5 * S)
    swept = sysid.response_data({"w [rad/s]": W, "H": truth})
    fit = sysid.fit_response(swept, sample_time=0.001, training=QUICK)
    assert fit.model.orders.poles == (1,)
    assert any(one.startswith("Orders: 1 pole and 0 zeros, of") for one in fit.notes)


def test_too_few_points_are_told() -> None:
    swept = sysid.response_data({"w [rad/s]": W[::10], "H": (2.0 / (1.0 + 0.5 * S))[::10]})
    found = sysid.search_response_orders(swept, sample_time=0.001, delays=(0,), training=QUICK)
    assert "5 points are too few for" in " ".join(found.failed)


@pytest.mark.parametrize("poles", [(0, 2), (3, 2), (1, 2.5)])
def test_what_is_no_range_is_refused(poles: Any) -> None:
    with pytest.raises(UserError, match="not a range of poles"):
        searched(mode(4.0, 0.05), poles=poles)
