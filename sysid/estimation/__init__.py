"""Traces and a structure in, a FitResult out."""

from sysid.estimation.arx import fit_arx
from sysid.estimation.attempts import Attempt
from sysid.estimation.cascade import fit_cascade, with_upstream_outputs
from sysid.estimation.instrumental import fit_iv4
from sysid.estimation.joint import CascadeFit, JointTraining
from sysid.estimation.narx import fit_narx
from sysid.estimation.neural_state_space import fit_neural_state_space
from sysid.estimation.operating_point import OperatingPoint
from sysid.estimation.posterior import Posterior
from sysid.estimation.result import Evidence, FitResult, Loop, Status
from sysid.estimation.training import FitProgress, Training
from sysid.estimation.transfer_function import fit_transfer_function
from sysid.estimation.transfer_function_search import TransferFunctionTraining
from sysid.estimation.uncertainty import Uncertainty
from sysid.estimation.vector_narx import fit_vector_narx

__all__ = [
    "Attempt",
    "CascadeFit",
    "Evidence",
    "FitProgress",
    "FitResult",
    "JointTraining",
    "Loop",
    "OperatingPoint",
    "Posterior",
    "Status",
    "Training",
    "TransferFunctionTraining",
    "Uncertainty",
    "fit_arx",
    "fit_cascade",
    "fit_iv4",
    "fit_narx",
    "fit_neural_state_space",
    "fit_transfer_function",
    "fit_vector_narx",
    "with_upstream_outputs",
]
