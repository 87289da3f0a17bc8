"""The short way from Python: data in, fit, compare, plot, save.

Where you say nothing, the choices are those of a pipeline. Everything here is a few lines over the rooms below, which
take more options: :mod:`sysid.ingest`, :mod:`sysid.estimation`, :mod:`sysid.validation`, :mod:`sysid.reporting` and
:mod:`sysid.export`.

Example:
    >>> import numpy as np, sysid
    >>> u = np.repeat([0.0, 1.0, -1.0, 0.5, 0.0], 20)
    >>> y = np.zeros(100)
    >>> for k in range(99):
    ...     y[k + 1] = 0.8 * y[k] + 0.2 * u[k]
    >>> traces = sysid.data((u, y), sample_time=0.1)
    >>> fit = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=1))
    >>> print(sysid.compare(traces, fit))
    free run, fit in percent   record
    ARX [1; 1; 1]              100.00
"""

from typing import TYPE_CHECKING

from sysid.lazy_names import imported_when_asked

if TYPE_CHECKING:
    from sysid.api.comparison import Comparison, compare
    from sysid.api.fits import Fit, SystemFit
    from sysid.api.fitting import fit, load
    from sysid.api.looking import advise, excite, frequency_response, impulse_response
    from sysid.api.orders import OrderSearch, search_orders
    from sysid.api.responses import bode, poles, step
    from sysid.api.saving import read_bundle, save
    from sysid.estimation import (
        JointTraining,
        PolynomialTraining,
        StabilityOptions,
        StateSpaceTraining,
        Training,
        TransferFunctionTraining,
    )
    from sysid.ingest.arrays import data
    from sysid.models import (
        ARMAX,
        ARX,
        BJ,
        NARX,
        OE,
        GreyBox,
        HammersteinWiener,
        LinearStateSpace,
        NeuralStateSpace,
        PolynomialNARX,
        Start,
        TransferFunction,
        VectorGreyBox,
        VectorNARX,
        VectorNeuralStateSpace,
        VectorStateSpace,
        WienerHammerstein,
    )
    from sysid.traces import Role

__all__ = [
    "ARX",
    "NARX",
    "Comparison",
    "Fit",
    "GreyBox",
    "NeuralStateSpace",
    "OrderSearch",
    "Role",
    "StabilityOptions",
    "Start",
]
__all__ += ["ARMAX", "BJ", "OE", "LinearStateSpace", "PolynomialTraining", "StateSpaceTraining", "VectorStateSpace"]
__all__ += ["HammersteinWiener", "PolynomialNARX", "VectorGreyBox", "VectorNeuralStateSpace", "WienerHammerstein"]
__all__ += ["JointTraining", "SystemFit", "Training", "TransferFunction", "TransferFunctionTraining", "VectorNARX"]
__all__ += ["advise", "bode", "excite", "frequency_response", "impulse_response", "poles", "step"]
__all__ += ["compare", "data", "fit", "load", "read_bundle", "save", "search_orders"]

_WHERE = {
    "sysid.api.comparison": (
        "Comparison",
        "compare",
    ),
    "sysid.api.fits": (
        "Fit",
        "SystemFit",
    ),
    "sysid.api.fitting": (
        "fit",
        "load",
    ),
    "sysid.api.looking": (
        "advise",
        "excite",
        "frequency_response",
        "impulse_response",
    ),
    "sysid.api.orders": (
        "OrderSearch",
        "search_orders",
    ),
    "sysid.api.responses": (
        "bode",
        "poles",
        "step",
    ),
    "sysid.api.saving": (
        "read_bundle",
        "save",
    ),
    "sysid.estimation": (
        "JointTraining",
        "PolynomialTraining",
        "StabilityOptions",
        "StateSpaceTraining",
        "Training",
        "TransferFunctionTraining",
    ),
    "sysid.ingest.arrays": ("data",),
    "sysid.models": (
        "ARMAX",
        "ARX",
        "BJ",
        "NARX",
        "OE",
        "GreyBox",
        "HammersteinWiener",
        "LinearStateSpace",
        "NeuralStateSpace",
        "PolynomialNARX",
        "Start",
        "TransferFunction",
        "VectorGreyBox",
        "VectorNARX",
        "VectorNeuralStateSpace",
        "VectorStateSpace",
        "WienerHammerstein",
    ),
    "sysid.traces": ("Role",),
}

__getattr__ = imported_when_asked(_WHERE)
