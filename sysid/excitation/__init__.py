"""Inputs for an experiment: signals that stay within a range and hold every frequency that is asked for."""

from sysid.excitation.excitation import Excitation, excite
from sysid.excitation.kinds import KINDS
from sysid.excitation.manoeuvres import Pulses, Ramps, Sine
from sysid.excitation.noise import Chirp, FilteredNoise
from sysid.excitation.plan import AbstractExcitation, Plan
from sysid.excitation.sines import Multisine
from sysid.excitation.steps import APRBS, PRBS, Staircase

__all__ = ["APRBS", "KINDS", "PRBS", "AbstractExcitation", "Chirp", "Excitation", "FilteredNoise", "Multisine", "Plan"]
__all__ += ["Pulses", "Ramps", "Sine", "Staircase", "excite"]
