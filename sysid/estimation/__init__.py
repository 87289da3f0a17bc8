"""Traces and a structure in, a FitResult out."""

from sysid.estimation.arx import fit_arx
from sysid.estimation.instrumental import fit_iv4
from sysid.estimation.narx import fit_narx
from sysid.estimation.operating_point import OperatingPoint
from sysid.estimation.result import Evidence, FitResult, Loop, Status
from sysid.estimation.training import FitProgress, Training
from sysid.estimation.transfer_function import fit_transfer_function
from sysid.estimation.transfer_function_search import TransferFunctionTraining
from sysid.estimation.uncertainty import Uncertainty

__all__ = [
    "Evidence",
    "FitProgress",
    "FitResult",
    "Loop",
    "OperatingPoint",
    "Status",
    "Training",
    "TransferFunctionTraining",
    "Uncertainty",
    "fit_arx",
    "fit_iv4",
    "fit_narx",
    "fit_transfer_function",
]
