"""Whether a fit leaves nothing but noise, so that no other start can do better."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.estimation.grey_box.provider import EquationProvider
from sysid.estimation.grey_box.stepping import ACCURACY

Array = NDArray[np.float64]

LAGS, FEWEST, PROBABILITY = 20, 50, 1e-3
"""Lags of the Ljung-Box test; samples of an output below which it says too little; and the probability below which
what is left is not white."""


def at_noise(provider: EquationProvider, theta: Array) -> bool:
    """Whether what some parameters leave of every output is white, or no more than the steps of the solver are worth.

    More than half the range of an output is none. Errors of a minimum that is not the one sought persist over many
    samples: it takes the wrong oscillation for the right one. White ones are those of a sensor, which no other
    parameters take away.

    Args:
        provider: The records.
        theta: What is trained.

    Returns:
        Whether it is; not where records are too short for it to be known.
    """
    shared, each = provider.at(theta), [list[Array]() for _ in range(provider.form.n_outputs)]
    for i, record in enumerate(provider.records):
        form = provider.of_record(shared, theta, i)
        with np.errstate(over="ignore", invalid="ignore"):  # a run that explodes leaves more than noise
            errors = record.errors(form.run(record.u, provider.begin(form, theta, i)), form.output_scale)
        counts = np.ones(errors.shape, dtype=np.bool_) if record.roots is None else record.roots > 0.0
        for own, error, known in zip(each, errors.T, np.broadcast_to(counts, errors.shape).T, strict=True):
            own.append(error[known])
    return all(_is_noise(some) for some in each)


def _is_noise(records: list[Array]) -> bool:
    """Ljung and Box 1978, over several records: products of samples across their ends are none."""
    whole = np.concatenate(records)
    if not np.isfinite(whole).all():
        return False
    power, n = float(whole @ whole), len(whole)
    if power <= ACCURACY**2 * n:
        return True
    # A run that explodes leaves one sample beside which all others are none, and that is as white as noise.
    if n < FEWEST or power > n:
        return False
    lags = np.arange(1, LAGS + 1)
    products = np.array([sum(float(one[k:] @ one[:-k]) for one in records) for k in lags])
    statistic = n * (n + 2.0) * np.sum((products / power) ** 2 / (n - lags))
    return bool(scipy.stats.chi2.sf(statistic, LAGS) > PROBABILITY)
