"""An uncertainty of parameters as one of polynomials, for models whose parameters are others."""

from __future__ import annotations

import numpy as np

from sysid.estimation.linear import vector_arx
from sysid.estimation.linear.process import uncertainty as process
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import AbstractModel, FittedProcess, VectorARXModel


def of_polynomials(model: AbstractModel, known: Uncertainty | None) -> Uncertainty | None:
    """An uncertainty of polynomials, as views of a linear model read it.

    Args:
        model: The model.
        known: Of its parameters.

    Returns:
        Of a process model and of ARX of several outputs that of the numerators and denominators of its ratios, to first
        order; of others it itself.
    """
    if known is None:
        return None
    if isinstance(model, FittedProcess):
        names, values, table = process.polynomials_of(model, known)
    elif isinstance(model, VectorARXModel):
        names, values, table = vector_arx.polynomials_of(model, known)
    else:
        return known
    unknown = np.isnan(np.diag(known.covariance))
    covariance = table @ np.where(np.isnan(known.covariance), 0.0, known.covariance) @ table.T
    open_ = (table[:, unknown] != 0.0).any(axis=1)
    covariance[open_] = covariance[:, open_] = np.nan
    return Uncertainty(names=names, values=values, covariance=covariance, noise_variance=known.noise_variance)
