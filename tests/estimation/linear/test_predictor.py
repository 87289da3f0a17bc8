"""Errors of free runs that grow, through a predictor that does not."""

from __future__ import annotations

import numpy as np
from scipy import linalg

from sysid.estimation.linear.predictor import GROWTH, MirroredPredictor
from sysid.models.converting.realisation import Realisation

N = 100


def test_a_pole_at_the_bound_is_on_either_side_of_it_and_never_on_both() -> None:
    """One decomposition had a pole beyond the bound, and the other none: an error of NumPy."""
    edge, rng = GROWTH ** (1.0 / N), np.random.default_rng(0)
    for _ in range(50):
        scale = np.diag(10.0 ** rng.uniform(-3.0, 3.0, 3))
        A = scale @ linalg.companion(np.poly([edge, 0.5, 0.2])) @ linalg.inv(scale)
        system = Realisation(A=A, B=np.ones(3), C=np.eye(3), D=np.zeros(3))
        found = MirroredPredictor.of([system], N)
        if found is not None:
            assert len(found.growing) == 1
            assert found.beginnings().shape == (N, 3)
