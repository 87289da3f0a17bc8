"""Traces and a structure in, a FitResult out."""

from typing import TYPE_CHECKING

from sysid.lazy_names import imported_when_asked

if TYPE_CHECKING:
    from sysid.estimation.attempts import Attempt
    from sysid.estimation.linear.arx import fit_arx
    from sysid.estimation.linear.frequency_response import Spectrum, fit_spectra
    from sysid.estimation.linear.instrumental import fit_iv4
    from sysid.estimation.linear.modes import Mode, modes
    from sysid.estimation.linear.polynomial.fit import PolynomialTraining, fit_polynomial
    from sysid.estimation.linear.state_space.fit import fit_state_space
    from sysid.estimation.linear.state_space.orders import StateOrders, state_orders
    from sysid.estimation.linear.state_space.training import StateSpaceTraining
    from sysid.estimation.linear.transfer_function import fit_transfer_function
    from sysid.estimation.linear.transfer_function_training import TransferFunctionTraining
    from sysid.estimation.networks.cascade_fit import CascadeFit
    from sysid.estimation.networks.joint_options import JointTraining
    from sysid.estimation.networks.joint_training import fit_cascade, with_upstream_outputs
    from sysid.estimation.networks.narx import fit_narx
    from sysid.estimation.networks.neural_state_space import fit_neural_state_space
    from sysid.estimation.networks.posterior import Posterior
    from sysid.estimation.networks.training import FitProgress, Training
    from sysid.estimation.networks.vector_narx import fit_vector_narx
    from sysid.estimation.operating_point import OperatingPoint
    from sysid.estimation.result import Evidence, FitResult, Loop, Status
    from sysid.estimation.stability import StabilityOptions
    from sysid.estimation.uncertainty import Uncertainty

__all__ = [
    "Attempt",
    "CascadeFit",
    "Evidence",
    "FitProgress",
    "FitResult",
    "JointTraining",
    "Loop",
    "Mode",
    "OperatingPoint",
    "PolynomialTraining",
    "Posterior",
    "Spectrum",
    "StabilityOptions",
    "StateOrders",
    "StateSpaceTraining",
    "Status",
    "Training",
    "TransferFunctionTraining",
    "Uncertainty",
    "fit_arx",
    "fit_cascade",
    "fit_iv4",
    "fit_narx",
    "fit_neural_state_space",
    "fit_polynomial",
    "fit_spectra",
    "fit_state_space",
    "fit_transfer_function",
    "fit_vector_narx",
    "modes",
    "state_orders",
    "with_upstream_outputs",
]

_WHERE = {
    "sysid.estimation.attempts": ("Attempt",),
    "sysid.estimation.linear.arx": ("fit_arx",),
    "sysid.estimation.linear.frequency_response": ("Spectrum", "fit_spectra"),
    "sysid.estimation.linear.instrumental": ("fit_iv4",),
    "sysid.estimation.linear.modes": ("Mode", "modes"),
    "sysid.estimation.linear.polynomial.fit": ("PolynomialTraining", "fit_polynomial"),
    "sysid.estimation.linear.state_space.fit": ("fit_state_space",),
    "sysid.estimation.linear.state_space.orders": ("StateOrders", "state_orders"),
    "sysid.estimation.linear.state_space.training": ("StateSpaceTraining",),
    "sysid.estimation.linear.transfer_function": ("fit_transfer_function",),
    "sysid.estimation.linear.transfer_function_training": ("TransferFunctionTraining",),
    "sysid.estimation.networks.cascade_fit": ("CascadeFit",),
    "sysid.estimation.networks.joint_options": ("JointTraining",),
    "sysid.estimation.networks.joint_training": ("fit_cascade", "with_upstream_outputs"),
    "sysid.estimation.networks.narx": ("fit_narx",),
    "sysid.estimation.networks.neural_state_space": ("fit_neural_state_space",),
    "sysid.estimation.networks.posterior": ("Posterior",),
    "sysid.estimation.networks.training": ("FitProgress", "Training"),
    "sysid.estimation.networks.vector_narx": ("fit_vector_narx",),
    "sysid.estimation.operating_point": ("OperatingPoint",),
    "sysid.estimation.result": ("Evidence", "FitResult", "Loop", "Status"),
    "sysid.estimation.stability": ("StabilityOptions",),
    "sysid.estimation.uncertainty": ("Uncertainty",),
}
"""Where each name is defined: a frozen model is run without anything that fits one, which takes longest to import."""

__getattr__ = imported_when_asked(_WHERE)
