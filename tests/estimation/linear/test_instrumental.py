"""Instrumental variables: no bias where least squares has one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from sysid.estimation import fit_arx, fit_iv4
from sysid.models import ARX, Mapping
from sysid.traces import Trace
from tests.estimation.linear_systems import arx_response, noise_for, steps, trace_of

A, B, TRUE = [1.5, -0.7], [[0.0, 1.0, 0.5]], np.array([1.0, 0.5, 1.5, -0.7])
MAPPING, ORDERS = Mapping.parse("u1 -> y"), ARX(na=2, nb=(2,), nk=(1,))


def record(seed: int, *, coloured: bool, n: int = 1500) -> Trace:
    """Output noise at 20 dB: white at the output, so coloured in the equation; or white in the equation."""
    rng = np.random.default_rng(seed)
    u = steps(n, 1, rng)
    clean = arx_response(A, B, u, np.zeros(n))
    noise = noise_for(clean, 20.0, rng)
    if not coloured:
        noise = lfilter([1.0], [1.0, -1.5, 0.7], 0.3 * noise)
    return trace_of(u, clean + noise)


def test_output_noise_biases_least_squares_but_not_instrumental_variables() -> None:
    ls = np.mean([fit_arx([record(s, coloured=True)], MAPPING, ORDERS).model.coefficients for s in range(20)], axis=0)
    iv = np.mean([fit_iv4([record(s, coloured=True)], MAPPING, ORDERS).model.coefficients for s in range(20)], axis=0)
    assert np.abs(ls - TRUE)[2:].max() > 0.1
    assert np.abs(iv - TRUE)[2:].max() < 0.01


@pytest.mark.parametrize("coloured", [False, True], ids=["white equation error", "white output noise"])
def test_true_parameters_lie_within_their_95_percent_intervals(coloured: bool) -> None:
    held = 0
    for seed in range(20):
        interval = fit_iv4([record(seed, coloured=coloured)], MAPPING, ORDERS).uncertainty.interval(0.95)[:4]
        held += int(np.sum((interval[:, 0] <= TRUE) & (interval[:, 1] >= TRUE)))
    assert 0.90 <= held / 80 <= 0.99


def test_without_noise_both_are_exact() -> None:
    trace = record(0, coloured=False)
    clean = trace_of(trace.columns(["u1"]), arx_response(A, B, trace.columns(["u1"]), np.zeros(len(trace))))
    np.testing.assert_allclose(fit_iv4([clean], MAPPING, ORDERS).model.coefficients, TRUE, rtol=1e-8)


def test_samples_that_do_not_count_do_not() -> None:
    trace = record(5, coloured=True)
    values, usable = trace.values.copy(), np.ones(len(trace), dtype=bool)
    usable[400:420] = False
    gap = Trace(name="gap", sample_time=1.0, channels=trace.channels, values=values, usable=usable)
    fit = fit_iv4([gap], MAPPING, ORDERS)
    np.testing.assert_allclose(fit.model.coefficients, TRUE, atol=0.2)
    assert fit.model.coefficients.tolist() != fit_iv4([trace], MAPPING, ORDERS).model.coefficients.tolist()
