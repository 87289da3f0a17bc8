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
    from sysid.api.comparison import Comparison as Comparison
    from sysid.api.comparison import compare as compare
    from sysid.api.estimates import frequency_response as frequency_response
    from sysid.api.estimates import impulse_response as impulse_response
    from sysid.api.fits import Fit as Fit
    from sysid.api.fitting import fit as fit
    from sysid.api.fitting import load as load
    from sysid.api.looking import advise as advise
    from sysid.api.looking import excite as excite
    from sysid.api.measured_responses.fitting import fit_response as fit_response
    from sysid.api.measured_responses.fitting import response_data as response_data
    from sysid.api.measured_responses.fitting import search_response_orders as search_response_orders
    from sysid.api.order_search import OrderSearch as OrderSearch
    from sysid.api.orders import search_orders as search_orders
    from sysid.api.responses import bode as bode
    from sysid.api.responses import poles as poles
    from sysid.api.responses import step as step
    from sysid.api.saving import read_bundle as read_bundle
    from sysid.api.saving import save as save
    from sysid.api.system_fit import SystemFit as SystemFit
    from sysid.estimation import JointTraining as JointTraining
    from sysid.estimation import PolynomialTraining as PolynomialTraining
    from sysid.estimation import StabilityOptions as StabilityOptions
    from sysid.estimation import StateSpaceTraining as StateSpaceTraining
    from sysid.estimation import Training as Training
    from sysid.estimation import TransferFunctionTraining as TransferFunctionTraining
    from sysid.ingest.memory.arrays import data as data
    from sysid.models import ARMAX as ARMAX
    from sysid.models import ARX as ARX
    from sysid.models import BJ as BJ
    from sysid.models import NARX as NARX
    from sysid.models import OE as OE
    from sysid.models import GreyBox as GreyBox
    from sysid.models import HammersteinWiener as HammersteinWiener
    from sysid.models import LinearStateSpace as LinearStateSpace
    from sysid.models import NeuralStateSpace as NeuralStateSpace
    from sysid.models import PolynomialNARX as PolynomialNARX
    from sysid.models import ProcessModel as ProcessModel
    from sysid.models import Start as Start
    from sysid.models import TransferFunction as TransferFunction
    from sysid.models import VectorARX as VectorARX
    from sysid.models import VectorGreyBox as VectorGreyBox
    from sysid.models import VectorNARX as VectorNARX
    from sysid.models import VectorNeuralStateSpace as VectorNeuralStateSpace
    from sysid.models import VectorStateSpace as VectorStateSpace
    from sysid.models import WienerHammerstein as WienerHammerstein
    from sysid.traces import Role as Role

__getattr__, __all__ = imported_when_asked(__file__)
