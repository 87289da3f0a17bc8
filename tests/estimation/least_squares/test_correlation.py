"""A long residual is looked at in blocks, and has the correlation time of its definition."""

import numpy as np
import pytest
from scipy.signal import lfilter

from sysid.estimation.least_squares import correlation


def slow(residual: np.ndarray) -> float:
    """Sums of products lag by lag, up to the first that is five times the sum; the largest where none is."""
    taus = [1.0]
    for k in range(1, len(residual)):
        taus.append(taus[-1] + 2.0 * float(residual[:-k] @ residual[k:]) / float(residual @ residual))
    inside = [tau for k, tau in enumerate(taus) if k >= 5.0 * tau]
    return max(1.0, inside[0] if inside else max(taus))


@pytest.mark.parametrize("n", [64, 65, 500, 1023])
@pytest.mark.parametrize("pole", [0.5, 0.9, 0.99])
def test_blocks_give_what_the_whole_gives(monkeypatch: pytest.MonkeyPatch, n: int, pole: float) -> None:
    monkeypatch.setattr(correlation, "BLOCK", 64)
    monkeypatch.setattr(correlation, "LAGS", 16)
    residual = lfilter([1.0], [1.0, -pole], np.random.default_rng(n).standard_normal(n))
    assert correlation.correlation_time(residual) == pytest.approx(slow(residual), rel=1e-9)
