"""Traces and a structure in, a FitResult out."""

from sysid.estimation.arx import fit_arx
from sysid.estimation.narx import FitProgress, Training, fit_narx
from sysid.estimation.result import Evidence, FitResult, Loop, Status

__all__ = ["Evidence", "FitProgress", "FitResult", "Loop", "Status", "Training", "fit_arx", "fit_narx"]
