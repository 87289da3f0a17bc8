"""What equations are told of their records before a fit."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.estimation import Training
from sysid.estimation.blocks.polynomial_narx import fit_polynomial_narx
from sysid.models import Mapping, PolynomialNARX, Start, StartKind
from sysid.models.blocks.built_model import BuiltModel
from tests.traces.made import trace_of


def test_pasts_of_one_output_range_alike_whatever_stood_before_the_record() -> None:
    """The second past hardly counts: its value before the record was taken for 2.4, and its range for so wide."""
    rng = np.random.default_rng(0)
    u, y, level = np.repeat(rng.uniform(0.0, 1.0, 24), 10), np.empty(240), 0.2
    for k in range(240):
        y[k] = level + 0.004 * rng.standard_normal()
        level += 0.1 * (u[k] - np.sqrt(abs(level)))
    trace = trace_of({"u": u, "y": y}, name="tank", sample_time=0.1, units={"u": "V", "y": "m"})
    model = fit_polynomial_narx(
        [trace], Mapping.parse("u -> y"), PolynomialNARX(input_delays=2, output_delays=2, degree=2),
        Training(max_iterations=20), start=Start(kind=StartKind.ESTIMATED),
    ).model  # fmt: skip
    assert isinstance(model, BuiltModel)
    terms = model.state_terms
    assert len(terms.level) == 2
    assert terms.level == pytest.approx(np.full(2, np.ptp(y) / 2.0 + y.min()), abs=0.05)
    assert terms.scale == pytest.approx(np.full(2, np.ptp(y) / 2.0), abs=0.05)
