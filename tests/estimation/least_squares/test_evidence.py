"""The evidence of a fit is compared with that of another start, whatever part of its samples is news."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.estimation.least_squares.evidence import Group, Prior, settled
from sysid.estimation.least_squares.provider import Linearisation

N = 1500
PRIOR = Prior(
    centre=np.zeros(4), groups=(Group(name="all", members=np.arange(4)),), alphas=np.array([1e-2]), beta=1.0
)  # fmt: skip


def log_evidence(mse: float, correlation_time: float) -> float:
    at = Linearisation(
        loss=0.5 * N * mse, gradient=np.zeros(4), gauss_newton=N * np.eye(4), correlation_time=correlation_time
    )  # fmt: skip
    return settled(PRIOR, np.full(4, 0.5), at, N)[1].log_evidence


@pytest.mark.parametrize("correlation_time", [1.0, 4.0, 16.0])
def test_of_starts_the_right_one_has_the_larger_evidence_though_its_error_persists(correlation_time: float) -> None:
    """A start of 170 times the mean square had been chosen, as its error was news at every third sample."""
    assert log_evidence(2.5e-5, correlation_time) > log_evidence(4.3e-3, 3.0)


def test_of_two_that_are_as_close_the_one_whose_error_is_news_has_the_larger() -> None:
    assert log_evidence(1e-3, 1.0) > log_evidence(1e-3, 10.0)
