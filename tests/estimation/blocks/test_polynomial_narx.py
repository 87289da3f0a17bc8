"""Where the run of a polynomial NARX begins."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import sysid
from sysid.estimation.networks.training import Training
from sysid.models import History, PolynomialNARX


def test_a_polynomial_begins_at_the_output_that_is_declared(tmp_path: Path) -> None:
    """It had begun where its inputs hold it, whatever was declared."""
    u = np.repeat(np.random.default_rng(1).uniform(-1.0, 1.0, 100), 4)
    u[:20] = 0.0  # so that what began at 0 is at rest
    y, before = np.zeros(len(u)), 0.4
    for k in range(len(u)):
        before = y[k] = 0.5 * before + 0.8 * u[k - 1] ** 2 * (k > 0)
    traces, structure = sysid.data((u, y), sample_time=0.5), PolynomialNARX(degree=2, terms=2, output_delays=1)
    one = Training(starts=1, max_iterations=80, workers=1)
    declared, held = (sysid.fit(traces, "u -> y", structure, one, rest_output=rest) for rest in (0.4, None))
    still = np.zeros(4)
    at_rest = History.at_rest(inputs=np.zeros(1), output=0.4)
    np.testing.assert_allclose(declared.model.simulate(still, at_rest), [0.2, 0.1, 0.05, 0.025], atol=1e-6)
    np.testing.assert_allclose(held.model.simulate(still, at_rest), 0.0, atol=1e-6)
    about = declared.save(tmp_path / "b", formats=("c",)).metadata["initialisation"]
    assert (about["values"]["y"], about["state"][0]) == (0.4, 0.4)
