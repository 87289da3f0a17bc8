"""Equations as text: parsed into a tree, lowered to programs that the register machine runs; never evaluated."""

from sysid.equations.lowered import Lowered, Net, Terms
from sysid.equations.lowering import lower
from sysid.equations.system import System

__all__ = ["Lowered", "Net", "System", "Terms", "lower"]
