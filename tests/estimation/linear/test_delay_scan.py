"""Dead times of a frequency response, all that are tried at once."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.estimation.linear.delay_scan import scan_losses
from sysid.estimation.linear.poles import sections_of
from sysid.estimation.linear.sanathanan_koerner import sk_poles
from sysid.models.converting.orthonormal_basis import Domain, basis_of, responses

W = np.geomspace(0.1, 20.0, 40)
T, LATE = 0.02, 9
START = {
    Domain.CONTINUOUS: np.array([-1.0 + 2.0j, -1.0 - 2.0j, -4.0]),
    Domain.DISCRETE: np.array([0.9 + 0.1j, 0.9 - 0.1j, 0.7], dtype=np.complex128),
}


@pytest.mark.parametrize("domain", Domain)
def test_losses_are_those_of_the_iterations_of_each_alone(domain: Domain) -> None:
    rng = np.random.default_rng(3)
    late = np.exp(-1j * T * W * LATE)
    target = (
        late * (2.0 / (1.0 + 0.4j * W) + 1.0 / (9.0 - W**2 + 0.9j * W)) * (1.0 + 0.02 * rng.standard_normal(len(W)))
    )
    variable = 1j * W if domain is Domain.CONTINUOUS else np.exp(-1j * W * T)
    root, delays = 1.0 / np.sqrt(np.abs(target)), np.arange(0, 30, 3)
    dead = np.exp(-1j * T * np.outer(delays, W))
    found = scan_losses(
        dead, target, variable, START[domain], 2, domain=domain, root_weights=root, iterations=4
    )  # fmt: skip
    assert delays[int(np.argmin(found))] == LATE
    for input_, loss in zip(dead, found, strict=True):
        poles = sk_poles(
            input_[:, np.newaxis], target, variable, START[domain], (2,), domain=domain, weights=root, iterations=4
        )  # fmt: skip
        columns = responses(basis_of(sections_of(poles, domain), 2, domain), variable) * (input_ * root)[:, np.newaxis]
        rows, wanted = (np.concatenate([one.real, one.imag]) for one in (columns, target * root))
        alone = np.sum((wanted - rows @ np.linalg.lstsq(rows, wanted, rcond=None)[0]) ** 2)
        assert loss == pytest.approx(alone, rel=1e-4)
