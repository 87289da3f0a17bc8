"""Whether the free run of a fitted model is stable: by its poles, or over random sequences."""

from sysid.estimation.stability.check import AbstractStabilityCheck as AbstractStabilityCheck
from sysid.estimation.stability.check import FreeRunCheck as FreeRunCheck
from sysid.estimation.stability.check import NoCheck as NoCheck
from sysid.estimation.stability.check import PoleCheck as PoleCheck
from sysid.estimation.stability.check import StabilityOptions as StabilityOptions
from sysid.estimation.stability.excursions import Excursions as Excursions
from sysid.estimation.stability.free_run import Stability as Stability
from sysid.estimation.stability.free_run import check_stability as check_stability
from sysid.estimation.stability.sequences import AbstractSequences as AbstractSequences
from sysid.estimation.stability.sequences import InputSequence as InputSequence
from sysid.estimation.stability.sequences import TraceSequences as TraceSequences
