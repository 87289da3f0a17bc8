"""Traces and a structure in, a FitResult out."""

from sysid.estimation.arx import fit_arx
from sysid.estimation.result import Evidence, FitResult, Loop, Status

__all__ = ["Evidence", "FitResult", "Loop", "Status", "fit_arx"]
