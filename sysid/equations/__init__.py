"""Equations as text: parsed into a tree, lowered to programs that the register machine runs; never evaluated."""

from sysid.equations.implicit import MOST_STATES_IMPLICIT
from sysid.equations.lowered import ROSENBROCK, RUNGE_KUTTA, SOLVERS, Lowered, Net, Terms
from sysid.equations.lowering import lower
from sysid.equations.system import System

__all__ = [
    "MOST_STATES_IMPLICIT",
    "ROSENBROCK",
    "RUNGE_KUTTA",
    "SOLVERS",
    "Lowered",
    "Net",
    "System",
    "Terms",
    "lower",
]
