"""What the fit of a transfer function says of its poles."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sysid.estimation.linear.transfer_function.words import of_speed, of_stability
from sysid.models.converting.orthonormal_basis import Domain


def model(*poles: complex, domain: Domain = Domain.CONTINUOUS) -> Any:
    values = np.array(poles)
    away = np.abs(values) - 1.0 if domain is Domain.DISCRETE else values.real
    return SimpleNamespace(
        poles=lambda _: values, sections=((),), orders=SimpleNamespace(domain=domain), sample_time=0.005,
        stable=bool((away < 0.0).all()),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("poles", "said"),
    [
        ((-8.44,), "is stable"),
        ((-8.44, -1.94e10), "is stable"),
        ((-8.44, 1e-12), "not stable: an integrator"),
        ((0.0, 0.0, -3e4), "not stable: a double integrator"),
        ((-8.44, 2.0), "the pole 2+0j lies outside"),
    ],
)
def test_an_integrator_is_a_pole_at_zero_and_not_one_that_is_slow_beside_another(
    poles: tuple[float, ...], said: str
) -> None:
    assert said in of_stability(model(*poles))


def test_a_pole_that_settles_within_a_sample_is_too_many() -> None:
    (told,) = of_speed(model(-8.44, -1.94e10))
    assert "-1.94e+10 rad/s" in told and "Fit a pole less" in told
    assert of_speed(model(-8.44, -600.0)) == ()
    assert of_speed(model(0.5, 1e-9, domain=Domain.DISCRETE)) == ()
