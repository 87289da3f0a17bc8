"""Equations as text: parsed into a tree, lowered to programs that the register machine runs; never evaluated."""

from sysid.equations.lowering import Lowered, Net, Terms, lower
from sysid.equations.system import System

__all__ = ["Lowered", "Net", "System", "Terms", "lower"]
