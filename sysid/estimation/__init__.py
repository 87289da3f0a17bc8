"""Traces and a structure in, a FitResult out."""

from typing import TYPE_CHECKING

from sysid.lazy_names import imported_when_asked

if TYPE_CHECKING:
    from sysid.estimation.linear.arx import fit_arx as fit_arx
    from sysid.estimation.linear.frequency_response.fit import fit_spectra as fit_spectra
    from sysid.estimation.linear.frequency_response.spectrum import Spectrum as Spectrum
    from sysid.estimation.linear.instrumental import fit_iv4 as fit_iv4
    from sysid.estimation.linear.modes import Mode as Mode
    from sysid.estimation.linear.modes import modes as modes
    from sysid.estimation.linear.polynomial.fit import PolynomialTraining as PolynomialTraining
    from sysid.estimation.linear.polynomial.fit import fit_polynomial as fit_polynomial
    from sysid.estimation.linear.state_space.fit import fit_state_space as fit_state_space
    from sysid.estimation.linear.state_space.orders import StateOrders as StateOrders
    from sysid.estimation.linear.state_space.orders import state_orders as state_orders
    from sysid.estimation.linear.state_space.training import StateSpaceTraining as StateSpaceTraining
    from sysid.estimation.linear.transfer_function.fit import fit_transfer_function as fit_transfer_function
    from sysid.estimation.linear.transfer_function.training import TransferFunctionTraining as TransferFunctionTraining
    from sysid.estimation.networks.narx import fit_narx as fit_narx
    from sysid.estimation.networks.neural.state_space import fit_neural_state_space as fit_neural_state_space
    from sysid.estimation.networks.posterior import Posterior as Posterior
    from sysid.estimation.networks.together.options import JointTraining as JointTraining
    from sysid.estimation.networks.together.result import CascadeFit as CascadeFit
    from sysid.estimation.networks.together.training import fit_cascade as fit_cascade
    from sysid.estimation.networks.training import FitProgress as FitProgress
    from sysid.estimation.networks.training import Training as Training
    from sysid.estimation.records.operating_point import OperatingPoint as OperatingPoint
    from sysid.estimation.results.attempts import Attempt as Attempt
    from sysid.estimation.results.result import Evidence as Evidence
    from sysid.estimation.results.result import FitResult as FitResult
    from sysid.estimation.results.result import Loop as Loop
    from sysid.estimation.results.result import Status as Status
    from sysid.estimation.results.uncertainty import Uncertainty as Uncertainty
    from sysid.estimation.stability import StabilityOptions as StabilityOptions

__getattr__, __all__ = imported_when_asked(__file__)
"""A frozen model is run without anything that fits one, which takes longest to import."""
