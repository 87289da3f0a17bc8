"""What records leave open of curves is a warning where free runs feel it, and a note elsewhere."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from sysid.estimation.blocks.fit import fit_blocks
from sysid.estimation.networks.training import Training
from sysid.models import HammersteinWiener, WienerHammerstein
from tests.estimation.blocks.test_blocks import MAPPING, ONE, a_trace, block, error, first_order, steps


def test_more_pieces_than_the_record_shows_are_a_note_where_no_run_feels_them() -> None:
    """Every fit with a curve warned of it, those that were right to a hundredth on new commands too."""
    u = steps(1)
    y = first_order(u, 0.8, 0.0)
    fit = fit_blocks([a_trace(u, y)], MAPPING, WienerHammerstein(first=1, second=1), ONE)
    assert error(fit, lambda other: first_order(other, 0.8, 0.0)) < 1e-9
    assert fit.warnings == ()
    assert (
        sum("of 22 parameters apart from the others, which hardly moves the free run" in one for one in fit.notes) == 1
    )
    plain = fit_blocks([a_trace(u, block(u))], MAPPING, HammersteinWiener(states=2), Training(starts=1))
    assert plain.warnings == ()
    assert not any("apart from the others" in one for one in plain.notes)


def test_what_other_commands_would_meet_and_the_record_did_not_is_a_warning() -> None:
    """A slow plant whose input goes to and fro stays in the middle; two pieces of the record in a row lead it out."""
    u = np.tile(np.repeat([1.0, -1.0], 10), 40) + 0.05 * np.repeat(np.random.default_rng(0).standard_normal(80), 10)

    def slow(other: np.ndarray) -> np.ndarray:
        inside = lfilter((0.0, 0.03), (1.0, -0.97), other)
        return np.asarray(inside + 0.3 * inside**2)

    y = slow(u) + 0.01 * np.std(slow(u)) * np.random.default_rng(1).standard_normal(len(u))
    fit = fit_blocks([a_trace(u, y)], MAPPING, HammersteinWiener(states=1, output="piecewise 8"), ONE)
    (told,) = fit.warnings
    assert "of the free run is open by more than the noise" in told
    assert "of 19 parameters apart from the others. A simpler curve" in told
    assert error(fit, slow) > 0.05
