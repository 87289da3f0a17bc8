"""Where fits of poles begin."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

import sysid
from sysid.models.converting.orthonormal_basis import Domain

T, N, NOISE = 0.002, 3000, 0.02


def sampled_fast() -> tuple[np.ndarray, np.ndarray]:
    """Two modes at 1 and 4 Hz, 500 samples a second: a long ARX model of 40 lags sees 80 ms."""
    rng = np.random.default_rng(0)
    u = np.repeat(rng.choice([-1.0, 1.0], N // 25), 25)
    y = np.zeros(N)
    for frequency, damping in ((1.0, 0.1), (4.0, 0.03)):
        w = 2 * np.pi * frequency
        b, a, _ = signal.cont2discrete(([w * w], [1.0, 2 * damping * w, w * w]), T)
        y += rng.uniform(0.3, 1.0) * signal.lfilter(b.ravel(), a, u)
    return u, y


@pytest.mark.parametrize("domain", list(Domain))
def test_modes_that_are_slow_beside_the_sampling_are_found(domain: Domain) -> None:
    """The fit had ended in a minimum of 200 times the noise's power, CONVERGED."""
    u, clean = sampled_fast()
    noise = NOISE * clean.std() * np.random.default_rng(1).standard_normal(N)
    delays = (0,) if domain is Domain.CONTINUOUS else (1,)
    structure = sysid.TransferFunction(poles=(4,), zeros=(3,), delays=delays, domain=domain)
    fit = sysid.fit(sysid.data((u, clean + noise), sample_time=T), "u -> y", structure)
    assert fit.history["mse"][-1] < 1.1 * np.mean(noise**2)
    poles = np.asarray(fit.model.poles(0))
    found = np.abs(poles if domain is Domain.CONTINUOUS else np.log(poles) / T) / (2 * np.pi)
    np.testing.assert_allclose(np.sort(found), [1.0, 1.0, 4.0, 4.0], rtol=0.02)
