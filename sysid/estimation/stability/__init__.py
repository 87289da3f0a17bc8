"""Whether the free run of a fitted model is stable: by its poles, or over random sequences."""

from sysid.estimation.stability.check import (
    AbstractStabilityCheck,
    FreeRunCheck,
    NoCheck,
    PoleCheck,
    StabilityOptions,
)
from sysid.estimation.stability.excursions import Excursions
from sysid.estimation.stability.free_run import Stability, check_stability
from sysid.estimation.stability.sequences import AbstractSequences, InputSequence, TraceSequences

__all__ = [
    "AbstractSequences",
    "AbstractStabilityCheck",
    "Excursions",
    "FreeRunCheck",
    "InputSequence",
    "NoCheck",
    "PoleCheck",
    "Stability",
    "StabilityOptions",
    "TraceSequences",
    "check_stability",
]
